"""The settings of a course: what is read, and what is told of what cannot be."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta, timezone
from pathlib import Path

import pytest
from checkout import ROOT
from made_courses import OURS, copied

from rotflex.courseware import reflection
from rotflex.courseware.benches import BenchPolicy
from rotflex.errors import GradingError
from rotflex.hil.student_benches import DRAW
from rotflex.instructor import course as courses
from rotflex.instructor import settings
from rotflex.instructor.settings import CourseSettings


def read(folder: Path, text: str, presets: tuple[str, ...] = ("workbook",)) -> CourseSettings:
    """The settings of a file with this content."""
    (folder / "course.toml").write_text(text, encoding="utf-8")
    return settings.read(folder, presets)


def test_without_a_file_or_with_an_empty_one_everything_is_as_usual(tmp_path):
    usual = settings.read(tmp_path)
    assert usual == read(tmp_path, "") == CourseSettings()
    assert usual.bench == BenchPolicy("own")
    assert usual.feedback.points and usual.feedback.reasons and usual.feedback.is_open(datetime.now(UTC))


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
    assert read(tmp_path, '[bench]\nwhich = "preset"\npreset = "workbook"').bench == BenchPolicy(
        "preset", preset="workbook"
    )


@pytest.mark.parametrize("given", ["2026-12-01", "2026-12-01T00:00:00"])
def test_a_time_without_a_zone_is_this_computers_and_a_date_begins_at_midnight(tmp_path, given):
    opens = read(tmp_path, f"[feedback]\nfrom = {given}").feedback.opens
    assert opens == datetime(2026, 12, 1).astimezone() and opens.tzinfo is not None


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("[bench\n", "is not TOML: Expected ']'"),
        ("[bank]\n", "bank: there is no such section; there are [course], [bench], [feedback], [reflect], [releases]."),
        ('title = "x"\n', "title: there is no such section; it belongs under [course]."),
        ("bench = 3\n", "bench: it should be a section, a line [bench] with its entries below."),
        ("[feedback]\npoint = true\n", "feedback.point: there is no such entry; there are points, reasons, from."),
        (
            "[course]\ntitle = 3\n",
            "course.title: it is 3, and should be a line of text of at most 120 characters, as in: ",
        ),
        ('[course]\ntitle = ""\n', "course.title: it is '', and should be a line of text"),
        ('[course]\nterm = "a\\nb"\n', "course.term: it is 'a\\nb', and should be a line of text"),
        (
            '[bench]\nwhich = "mine"\n',
            'bench.which: it is \'mine\', and should be "own", "same", "preset" or "real", as in: ',
        ),
        (
            '[bench]\nwhich = "same"\nseed = "x"\n',
            "bench.seed: it is 'x', and should be a whole number from 0 to 4294967295, as in: seed = 2026",
        ),
        ('[bench]\nwhich = "same"\nseed = -1\n', "bench.seed: it is -1, and should be a whole number"),
        ('[bench]\nwhich = "same"\nseed = true\n', "bench.seed: it is True, and should be a whole number"),
        ('[bench]\nwhich = "real"\n', 'bench.benches: which = "real" needs it. It should be names of the laboratory'),
        ('[bench]\nwhich = "real"\nbenches = []\n', "bench.benches: it is [], and should be names"),
        (
            '[bench]\nwhich = "real"\nbenches = ["east"]\n',
            "bench.benches: of 'east' the course has no truth; it has that of none.",
        ),
        ('[bench]\nbenches = ["east"]\n', 'bench.benches: it goes with which = "real", and which is "own"'),
        ('[bench]\nwhich = "same"\n', 'bench.seed: which = "same" needs it. It should be a whole number'),
        ('[bench]\nwhich = "preset"\n', 'bench.preset: which = "preset" needs it. It should be the name of a bench'),
        ("[bench]\nseed = 7\n", 'bench.seed: it goes with which = "same", and which is "own". Leave one of them out.'),
        (
            '[bench]\nwhich = "preset"\npreset = "mars"\n',
            "bench.preset: the course has no bench 'mars'; it has \"workbook\".",
        ),
        (
            '[feedback]\nfrom = "tomorrow"\n',
            "feedback.from: it is 'tomorrow', and should be a date, or a date and time",
        ),
        ("[feedback]\nfrom = 12:00:00\n", "feedback.from: it is datetime.time(12, 0), and should be a date"),
        ("[reflect]\nasks = 1\n", "reflect.asks: it is 1, and should be true or false, as in: asks = true"),
        (
            "[reflect]\nfrom = 1\n",
            "reflect.from: it is 1, and should be a date, or a date and time, as in: from = 2026",
        ),
        ("[reflect]\nasks = false\nfrom = 2026-11-02\n", "reflect.from: it goes with asks = true, and asks is false."),
        (
            '[feedback]\npoints = "no"\n',
            "feedback.points: it is 'no', and should be true or false, as in: points = true",
        ),
    ],
)
def test_what_is_not_understood_is_told_with_file_entry_what_is_expected_and_an_example(tmp_path, text, told):
    with pytest.raises(GradingError) as raised:
        read(tmp_path, text)
    assert str(tmp_path / "course.toml") in str(raised.value)
    assert told in str(raised.value)


def test_all_faults_are_told_at_once(tmp_path):
    with pytest.raises(GradingError) as raised:
        read(tmp_path, '[course]\ntitel = "x"\n[bench]\nwhich = 1\n[feedback]\nfrom = 1\n')
    assert [line.split(":")[0].strip() for line in str(raised.value).splitlines()[1:]] == [
        "course.titel",
        "bench.which",
        "feedback.from",
    ]


@pytest.mark.parametrize(
    ("text", "released"),
    [
        ("", "on"),
        ("[reflect]\nasks = true\n", "on"),
        ("[reflect]\nasks = false\n", "off"),
        ("[reflect]\nfrom = 2026-11-02T08:00:00+01:00\n", "2026-11-02T08:00:00+01:00"),
        ("[reflect]\nfrom = 2026-11-02\n", datetime(2026, 11, 2).astimezone().isoformat()),
    ],
)
def test_whether_reflect_asks_is_released_as_students_read_it(tmp_path, text, released):
    plain = read(tmp_path, text).reflect.plain()
    assert plain == released
    before, after = datetime(2026, 11, 1, tzinfo=UTC), datetime(2026, 11, 4, tzinfo=UTC)
    asks = [not reflection.silence({"reflect": plain}, now) for now in (before, after)]
    assert asks == {"on": [True, True], "off": [False, False]}.get(plain, [False, True])


def test_a_file_that_is_no_text_is_told(tmp_path):
    (tmp_path / "course.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(GradingError, match=r"course\.toml cannot be read"):
        settings.read(tmp_path)


def test_our_file_says_what_counts_without_it_but_for_the_title():
    """Its comments promise so."""
    assert OURS.settings.title == OURS.title == "The rotary flexible joint laboratory"
    assert OURS.settings == CourseSettings(title=OURS.title, bench=BenchPolicy(draw=DRAW))


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


def test_a_title_stands_in_one_place():
    assert OURS.title not in (ROOT / "solutions" / "course.py").read_text(encoding="utf-8")
