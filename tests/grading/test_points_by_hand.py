"""Points by hand against those that ``rotflex report`` writes: late, extended, dropped, weighted, in any mixture.

Beside each student stands the arithmetic, done on paper; the command gets the marks, the times and the settings.
"""

from dataclasses import replace
from datetime import datetime, timedelta, timezone
from pathlib import Path

import pytest
from gradebooks import enrol, graded, record, rows
from made_courses import OURS, copied
from typer.testing import CliRunner

from labcourse.grading.accounts import account_of, in_full
from labcourse.grading.assignments import Handed
from labcourse.grading.gradebook import Arrival, Delivery, Gradebook, StudentRecord
from labcourse.grading.marks import Mark
from labcourse.grading.settings import read
from rotflex import cli

PRELAB, STIFFNESS, VALIDATION = "01_modeling_prelab", "02_finding_stiffness", "03_model_validation"
CET = timezone(timedelta(hours=1))
DUE = datetime(2026, 11, 20, 18, tzinfo=CET)
HOUR, DAY = timedelta(hours=1), timedelta(days=1)

TERM = """
[marks]
drop = ["2.16", "2.14 D"]
weights = {"2.11" = 2.0, "2.11 explanation" = 0.5, "2.13" = 1.5}

[[deadline]]
due = 2026-11-20T18:00:00+01:00

[[deadline]]
due = 2026-11-22T18:00:00+01:00
section = "B"

[[extension]]
until = 2026-11-27T18:00:00+01:00
students = ["EXT"]
notebooks = ["02_finding_stiffness"]

[[extension]]
until = 2026-11-25T18:00:00+01:00
section = "C"

[late]
per_day = 7.5
cap = 40
grace_hours = 1.5
"""

# V of 2 in the first notebook, omega_n of 2 and the explanation of 1 in the second, all others in the third.
# 2.16 and 2.14 D do not count. Out of: 2 + 2×2 + 0.5×1 + 1.5×2 + 1 = 10.5.
ALL = {"V": 2, "omega_n": 2, "explanation": 1, "state_space": 2, "A": 1, "D": 0.25, "comparison": 2}
WHERE = {
    "V": ("2.1", "V"),
    "omega_n": ("2.11", "omega_n"),
    "explanation": ("2.11", "explanation"),
    "state_space": ("2.13", "state_space"),
    "A": ("2.14", "A"),
    "D": ("2.14", "D"),
    "comparison": ("2.16", "comparison"),
}
SOME = {"V": 1.5, "omega_n": 1.5, "explanation": 0.5, "state_space": 1, "A": 0.75, "D": 0.25, "comparison": 0.5}

#: Student → section, earned, lateness of the notebooks from DUE on, and the points of 10.5 by hand.
CLASS = {
    # All of it, in time.
    "all": ("A", ALL, (-DAY, -DAY, timedelta()), "10.50"),
    # 1.5 + 2×1.5 + 0.5×0.5 + 1.5×1 + 0.75 = 7
    "some": ("A", SOME, (-DAY, -DAY, -DAY), "7.00"),
    # What is dropped is lost.
    "undropped": ("A", ALL | {"D": 0, "comparison": 0}, (-DAY, -DAY, -DAY), "10.50"),
    # Within the grace of 1.5 h, to the minute.
    "grace": ("A", SOME, (1.5 * HOUR, 1.5 * HOUR, 1.5 * HOUR), "7.00"),
    # A second later, one notebook: 2×1.5 + 0.5×0.5 = 3.25, less 7.5 % = 0.24375; 6.75625.
    "second": ("A", SOME, (-DAY, 1.5 * HOUR + timedelta(seconds=1), -DAY), "6.76"),
    # Exactly a day after the grace is one day still; a second more are two: 15 % of 3.25 = 0.4875; 6.5125.
    "one": ("A", SOME, (-DAY, DAY + 1.5 * HOUR, -DAY), "6.76"),
    "two": ("A", SOME, (-DAY, DAY + 1.5 * HOUR + timedelta(seconds=1), -DAY), "6.51"),
    # Six days would be 45 %, of which 40 % are taken, of all: 0.6 × 7 = 4.2.
    "capped": ("A", SOME, (5 * DAY + 2 * HOUR,) * 3, "4.20"),
    # Section B has two days more, so that three days and an hour late are one: 0.925 × 7 = 6.475, half up.
    "later": ("B", SOME, (2 * DAY + 2 * HOUR,) * 3, "6.48"),
    # EXT has a week for the second notebook, but not for the first and third, six days late: 40 %.
    # 3.25 + 0.6 × (1.5 + 1.5 + 0.75) = 5.5
    "ext": ("A", SOME, (6 * DAY, 6 * DAY, 6 * DAY), "5.50"),
    # Section C has until five days after: six days late are one: 6.475.
    "more": ("C", SOME, (6 * DAY,) * 3, "6.48"),
    # Nothing earned, late: 0.
    "none": ("A", dict.fromkeys(ALL, 0), (9 * DAY,) * 3, "0.00"),
}


def marks(earned):
    return [Mark(*WHERE[name], "partly right", earned[name], ALL[name], "Reason.") for name in WHERE]


def deliveries(late):
    names = [f"{one}.ipynb" for one in (PRELAB, STIFFNESS, VALIDATION)]
    return [Delivery(name, name, b"{}", DUE + after) for name, after in zip(names, late, strict=True)]


def reported(folder: Path, book: Path, settings: str):
    """The rows of grades.csv that the command writes with these settings, and what it says."""
    source = copied(folder)
    (source / "course.toml").write_text(settings, encoding="utf-8")
    words = ["report", book, "--out", folder / "out", "--solutions", source]
    done = CliRunner().invoke(cli.app, [str(one) for one in words])
    assert done.exit_code == 0, done.output
    return rows(folder / "out"), " ".join(done.output.split())


@pytest.fixture(scope="module")
def book(tmp_path_factory):
    folder = tmp_path_factory.mktemp("class")
    with Gradebook(folder / "book.sqlite") as opened:
        enrol(opened, folder, *((student, "", "", section) for student, (section, *_) in CLASS.items()))
        for student, (_section, earned, late, _so_far) in CLASS.items():
            record(opened, graded(student, *marks(earned)))
            opened.deliver(student, deliveries(late))
    return folder / "book.sqlite"


@pytest.fixture(scope="module")
def term(book, tmp_path_factory):
    folder = tmp_path_factory.mktemp("term")
    return reported(folder, book, TERM), folder / "out"


@pytest.mark.parametrize("student", CLASS)
def test_by_hand_and_by_command_to_the_hundredth(term, student):
    row = term[0][0][student]
    assert (row["so far"], row["so far out of"]) == (CLASS[student][-1], "10.5")
    assert float(row["total"]) == sum(CLASS[student][1].values()) and row["out_of"] == "10.25"  # as they were


def test_how_it_counts_says_what_was_dropped_weighted_and_late(term):
    some, ext = (term[0][0][student]["how it counts"] for student in ("some", "ext"))
    assert some.startswith("Not counted: 2.14 D, 2.16. 2.11 counts 2 times. 2.11 explanation counts 0.5 times. ")
    late = "on 2026-11-26 18:00 UTC+01:00, due on 2026-11-20 18:00 UTC+01:00 with 1.5 h of grace: 6 days late"
    assert f"{PRELAB} was handed in {late}" in ext and f"{VALIDATION} was handed in {late}" in ext
    assert "40 % at most: it loses 40 % of its points." in ext
    assert "There is an extension until 2026-11-27 18:00 UTC+01:00, so it is in time." in ext


def test_whom_nobody_knows_is_told(book, tmp_path):
    settings = TERM.replace('["EXT"]', '["EXT", "exxt"]').replace('section = "C"', 'section = "D"')
    settings = settings.replace('section = "B"', 'section = "nobody-here"')
    _found, said = reported(tmp_path, book, settings)
    assert "'exxt', 'D'" in said and "'nobody-here'" in said


def so_far(folder, settings, earned, late):
    """The points and their maximum, by settings as they stand in the file; notebooks came so long after DUE."""
    (folder / "course.toml").write_text(settings, encoding="utf-8")
    course = replace(OURS, settings=read(folder, catalogue=OURS.catalogue))
    received = {name: Arrival(DUE + after) for name, after in late}
    found = account_of(course, Handed(StudentRecord("ada"), earned, received))
    return found.so_far_text, in_full(found.out_of)


def test_a_date_is_until_its_end_on_the_clock_of_whoever_grades(tmp_path):
    end = datetime(2026, 11, 21).astimezone() + DAY
    settings = "[[deadline]]\ndue = 2026-11-21\n[late]\nper_day = 100\n"
    earned = [Mark("2.1", "V", "right", 2.0, 2.0, "")]
    for when, points in ((end - timedelta(seconds=1), "2.00"), (end, "0.00")):
        assert so_far(tmp_path, settings, earned, [(f"{PRELAB}.ipynb", when - DUE)])[0] == points


def test_a_report_as_a_whole_is_as_late_as_its_notebook_and_can_be_weighted_and_dropped(tmp_path):
    whole = "Modeling report, as a whole"
    earned = [
        Mark(whole, part, "partly right", points, 1.0, "")
        for part, points in (("organisation", 0.5), ("appearance", 1.0))
    ]
    late = "[[deadline]]\ndue = 2026-11-20T17:00:00Z\n[late]\nper_day = 10\n"
    settings = f'[marks]\ndrop = ["{whole} appearance"]\nweights = {{"{whole}" = 3}}\n{late}'
    # 3 × 0.5, less a tenth
    assert so_far(tmp_path, settings, earned, [("04_modeling_results.ipynb", DAY)]) == ("1.35", "3")
