"""The settings of a course: what is read, and what is told of what cannot be."""

import re
import sys
from dataclasses import replace
from datetime import UTC, datetime, timedelta, timezone
from pathlib import Path

import pytest
from made_courses import OURS, copied

from labcourse import clock
from labcourse.answers import reflection
from labcourse.benches import BenchPolicy
from labcourse.errors import GradingError
from labcourse.grading import course as courses
from labcourse.grading import settings
from labcourse.grading.release import student_course
from labcourse.grading.settings import CourseSettings, Deadline, Extension, LateSettings, MarkSettings, OutcomeSettings
from rotflex.hil.student_benches import DRAW

DUE = "[[deadline]]\ndue = 2026-11-21\n"


def read(folder: Path, text: str, presets: tuple[str, ...] = ("workbook",)) -> CourseSettings:
    (folder / "course.toml").write_text(text, encoding="utf-8")
    return settings.read(folder, presets)


def test_without_a_file_or_with_an_empty_one_everything_is_as_usual(tmp_path):
    usual = settings.read(tmp_path)
    assert usual == read(tmp_path, "") == CourseSettings() and usual.bench == BenchPolicy("own")
    assert usual.feedback.points and usual.feedback.reasons and usual.feedback.is_open(clock.now())


def test_everything_that_may_be_said_is_read(tmp_path):
    found = read(
        tmp_path,
        '[course]\ntitle = "Regelungstechnik für Anfänger"\nterm = "2026 autumn"\n'
        '[bench]\nwhich = "same"\nseed = 7\n'
        "[feedback]\npoints = false\nreasons = false\nfrom = 2026-12-01T12:00:00+01:00\n"
        '[releases]\nfolder = "kept"\n',
    )
    assert (found.title, found.term, found.releases) == ("Regelungstechnik für Anfänger", "2026 autumn", "kept")
    assert found.bench == BenchPolicy("same", seed=7)
    assert not found.feedback.points and not found.feedback.reasons
    assert found.feedback.opens == datetime(2026, 12, 1, 12, tzinfo=timezone(timedelta(hours=1)))
    assert not found.feedback.is_open(datetime(2026, 12, 1, 10, 59, tzinfo=UTC))
    assert found.feedback.is_open(datetime(2026, 12, 1, 11, tzinfo=UTC))
    (tmp_path / "course.toml").write_text('[bench]\nwhich = "real"\nbenches = ["north"]\n', encoding="utf-8")
    real = settings.read(tmp_path, benches={"north": "", "south": "its file"}).bench
    assert real == BenchPolicy("real", benches=("north",))
    with pytest.raises(GradingError, match=r"bench\.benches: north\.toml cannot be used: it knows no entry 'J_eqq'"):
        settings.read(tmp_path, benches={"north": "north.toml cannot be used: it knows no entry 'J_eqq'"})


@pytest.mark.parametrize("given", ["2026-12-01", "2026-12-01T00:00:00"])
def test_a_time_without_a_zone_is_this_computers_and_a_date_begins_at_midnight(tmp_path, given):
    opens = read(tmp_path, f"[feedback]\nfrom = {given}").feedback.opens
    assert opens == datetime(2026, 12, 1).astimezone() and opens.tzinfo is not None


def places(error: pytest.ExceptionInfo[GradingError]) -> list[str]:
    """Return table and entry of each fault, as "marks.drop"."""
    first, *rows = str(error.value).splitlines()
    assert first.endswith("course.toml cannot be used:")
    return sorted(re.match(r"  (.+?): ", row)[1] for row in rows)


#: A file → table and entry of its faults.
REFUSED = [
    ("# a title\n[bank]\n", "bank"),
    ("[feedback]\npoint = true\n", "feedback.point"),
    ('[course]\ntitle = ""\n', "course.title"),
    (f'[course]\nterm = "{"a" * 121}"\n', "course.term"),
    ('[bench]\nwhich = "same"\nseed = 4294967296\n', "bench.seed"),
    ('[bench]\nwhich = "real"\nbenches = ["east"]\n', "bench.benches"),
    ('[bench]\nbenches = ["east"]\n', "bench.benches, bench.benches"),
    ('[bench]\nwhich = "same"\n', "bench.seed"),
    ("[bench]\nseed = 7\n", "bench.seed"),
    ('[bench]\nwhich = "preset"\npreset = "mars"\n', "bench.preset"),
    ('[feedback]\nfrom = "2026-12-01"\n', "feedback.from"),
    ("[report]\npage_limit = 0\n", "report.page_limit"),
    ('[marks]\ndrop = ["1.2",\n  3]\n[late]\ncap = -1\n', "late.cap, marks.drop"),
    ("[marks]\nweights = {1.2 = 2}\n", "marks.weights"),
    ('[marks]\nweights = {"1.2" = 0}\n', "marks.weights"),
    ("[levels]\nshares = {4 = 101}\n", "levels.shares"),
    ("[levels]\nshares = {3 = 95}\n", "levels"),
    ("[deadline]\ndue = 2026-11-21\n", "deadline"),
    ("[[marks]]\n", "marks"),
    ('[[deadline]]\nnotebooks = ["x"]\n', "deadline 1.due"),
    ("[[deadline]]\ndue = 9999-12-31\n", "deadline 1.due"),
    (f"{DUE}\n[[deadline]]\ndue = 2026-11-21\nnotebooks = []\n", "deadline 2.notebooks"),
    ("[late]\nper_day = 10\n", "late"),
    ("[[extension]]\nuntil = 2026-11-22\nstudents = ['a']\n", "extension 1"),
    (f"{DUE}[[extension]]\nuntil = 2026-11-22\n", "extension 1"),
    (f"{DUE}[[extension]]\nuntil = 2025-11-28\nstudents = ['a']\n", "extension 1.until"),
    (
        f"{DUE}notebooks = ['a']\n[[extension]]\nuntil = 2026-11-28\nstudents = ['a']\nnotebooks = ['b']\n",
        "extension 1",
    ),
]


@pytest.mark.parametrize(("text", "faults"), REFUSED)
def test_each_fault_is_reported_with_its_table_and_entry(tmp_path, text, faults):
    with pytest.raises(GradingError) as error:
        read(tmp_path, text)
    assert ", ".join(places(error)) == faults


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[feedback]\npoint = true\n", "Did you mean points?"),
        ('title = "x"\n', "[course]"),
        ("[deadline]\n", "[[deadline]]"),
    ],
)
def test_a_message_says_what_to_write_instead(tmp_path, text, said):
    with pytest.raises(GradingError, match=re.escape(said)):
        read(tmp_path, text)


def test_what_marks_come_to_is_read(tmp_path):
    found = read(
        tmp_path,
        '[marks]\ndrop = ["1.2", "2.3 speed"]\nweights = {"1.4" = 2, "First report" = 0.5}\n'
        "[levels]\nshares = {3 = 80, 2 = 60}\nthresholds = {4 = 85, 1 = 10}\n"
        "[[deadline]]\ndue = 2026-11-21T18:00:00+01:00\n"
        '[[deadline]]\ndue = 2026-12-01T18:00:00Z\nnotebooks = ["01_first.ipynb", "02_second"]\nsection = "B"\n'
        '[[extension]]\nuntil = 2026-12-24\nstudents = ["ada"]\nsection = "C"\nnotebooks = ["02_second"]\n'
        "[late]\nper_day = 10\ncap = 50.5\ngrace_hours = 2\n"
        "[outcomes]\nlevel = 2\nshare = 60\nfewest = 8\n",
    )
    assert found.marks == MarkSettings(("1.2", "2.3 speed"), {"1.4": 2, "First report": 0.5})
    assert found.levels.shares == {4: 1, 3: 0.8, 2: 0.6, 1: 0.25, 0: 0}
    assert found.levels.thresholds == {4: 0.85, 3: 0.75, 2: 0.5, 1: 0.1}
    assert found.deadlines == (
        Deadline(datetime(2026, 11, 21, 17, tzinfo=UTC)),
        Deadline(datetime(2026, 12, 1, 18, tzinfo=UTC), ("01_first", "02_second"), "B"),
    )
    end_of_day = datetime(2026, 12, 25).astimezone() - timedelta(microseconds=1)
    assert found.extensions == (Extension(end_of_day, ("ada",), "C", ("02_second",)),)
    assert found.late == LateSettings(10, 50.5, 2) and found.outcomes == OutcomeSettings(2, 60, 8)


def test_per_cents_with_decimals_are_the_shares_that_they_say(tmp_path):
    found = read(tmp_path, "[levels]\nshares = {3 = 70.7}\nthresholds = {3 = 70.7, 1 = 1e-5}\n").levels
    assert (found.shares[3], found.thresholds[3], found.thresholds[1]) == (0.707, 0.707, 1e-7)  # 70.7 / 100 is not


@pytest.mark.parametrize(
    ("share", "level"),
    [(1.0, 4), (0.9, 4), (0.899, 3), (0.75, 3), (0.749, 2), (0.5, 2), (0.49, 1), (0.001, 1), (0.0, 0)],
)
def test_a_share_of_points_has_the_highest_level_that_it_reaches(tmp_path, share, level):
    assert CourseSettings().levels.level_of(share) == level
    stricter = read(tmp_path, "[levels]\nthresholds = {1 = 10}").levels
    assert stricter.level_of(share) == (level if share >= 0.1 else 0)


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ('[marks]\ndrop = ["2.111"]', "2.11"),
        ('[marks]\nweights = {"2.11 omega" = 2, "2.11" = 2}', "omega_n"),
        (f'{DUE}notebooks = ["02_stiffness"]', "02_stiffness"),
    ],
)
def test_names_that_the_catalogue_does_not_have_are_refused(tmp_path, text, name):
    (copied(tmp_path) / "course.toml").write_text(text, encoding="utf-8")
    with pytest.raises(GradingError, match=name) as raised:
        courses.load(tmp_path / "solutions")
    assert len(str(raised.value).splitlines()) == 2


@pytest.mark.parametrize(
    ("entry", "least", "most"), [("late.grace_hours", 0, 1000), ("late.per_day", 0, 100), ("outcomes.level", 1, 4)]
)
def test_numbers_are_accepted_from_the_least_to_the_most(tmp_path, entry, least, most):
    table, _dot, name = entry.partition(".")
    for value in (least, most):
        found = getattr(getattr(read(tmp_path, f"{DUE}[{table}]\n{name} = {value}\n"), table), name)
        assert (found, type(found)) == (value, type(value))  # a whole number is shown without a point
    for value in (least - 0.0005, most + 1, "true", '"1"', "nan", "9" * 400):
        with pytest.raises(GradingError) as error:
            read(tmp_path, f"{DUE}[{table}]\n{name} = {value}\n")
        assert places(error) == [entry]


@pytest.mark.parametrize(
    ("text", "released"),
    [
        ("", "on"),
        ("[reflect]\nasks = false\n", "off"),
        ("[reflect]\nfrom = 2026-11-02T08:00:00+01:00\n", "2026-11-02T08:00:00+01:00"),
        ("[reflect]\nfrom = 2026-11-02\n", datetime(2026, 11, 2).astimezone().isoformat()),
    ],
)
def test_whether_reflect_asks_is_released_as_students_read_it(tmp_path, text, released):
    released_as = read(tmp_path, text).reflect.as_json()
    assert released_as == released
    before, after = datetime(2026, 11, 1, tzinfo=UTC), datetime(2026, 11, 4, tzinfo=UTC)
    asks = [not reflection.silence({"reflect": released_as}, now) for now in (before, after)]
    assert asks == {"on": [True, True], "off": [False, False]}.get(released_as, [False, True])


@pytest.mark.parametrize(
    ("text", "python"),
    [("", f"{sys.version_info.major}.{sys.version_info.minor}"), ('[course]\npython = "3.10"\n', "3.10")],
)
def test_the_python_that_grades_is_released_and_no_part_of_the_name(tmp_path, text, python):
    (tmp_path / "notebooks").mkdir()
    about = student_course._course_json(replace(OURS, settings=read(tmp_path, text)), tmp_path / "notebooks")
    usual = student_course._course_json(replace(OURS, settings=read(tmp_path, "")), tmp_path / "notebooks")
    assert (about["python"], about["release"]) == (python, usual["release"])


@pytest.mark.parametrize("content", [b"\xff\xfe", b"[bench\n"])
def test_a_file_that_is_no_text_or_no_toml_is_told(tmp_path, content):
    (tmp_path / "course.toml").write_bytes(content)
    with pytest.raises(GradingError, match=r"course\.toml"):
        settings.read(tmp_path)


def test_a_course_has_its_settings_and_the_presets_are_its_own(tmp_path):
    folder = copied(tmp_path)
    (folder / "course.toml").write_text('[bench]\nwhich = "preset"\npreset = "real_bench"\n[releases]\nfolder = "old"')
    course = courses.load(folder)
    assert course.settings.bench == BenchPolicy("preset", preset="real_bench", draw=DRAW)
    assert course.title == course.name == "rotflex-course"
    assert course.releases == tmp_path / "old"
    (folder / "course.toml").write_text('[bench]\nwhich = "preset"\npreset = "mars"')
    with pytest.raises(GradingError, match='it has "real_bench", "workbook"'):
        courses.load(folder)


def read_ours(folder: Path, text: str, benches: tuple[str, ...] = ()) -> CourseSettings:
    (folder / "course.toml").write_text(text, encoding="utf-8")
    return settings.read(folder, OURS.presets, DRAW, dict.fromkeys(benches, ""), OURS.catalogue)


def test_a_class_may_do_without_notebooks_that_are_not_optional(tmp_path):
    text = '[optional]\nwithout = ["01_modeling_prelab", "02_finding_stiffness"]\n'
    assert read_ours(tmp_path, text).without == ("01_modeling_prelab", "02_finding_stiffness")


@pytest.mark.parametrize(
    ("text", "place", "said"),
    [
        ('[optional]\nwithout = ["01_modelling"]\n', "optional.without", '"01_modeling_prelab"'),
        ('[optional]\nwithout = ["11_beyond_the_workbook"]\n', "optional.without", "11_beyond_the_workbook"),
        ('[optional]\nwithout = "01_modeling_prelab"\n', "optional.without", "a list, in brackets"),
    ],
)
def test_what_cannot_be_left_out_is_refused(tmp_path, text, place, said):
    with pytest.raises(GradingError, match=said) as error:
        read_ours(tmp_path, text)
    assert places(error) == [place]
