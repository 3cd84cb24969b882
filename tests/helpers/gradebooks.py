"""What gradebooks hold, made up for a test: marks of three questions of this course, runs, and rosters."""

import csv
import io
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from made_courses import OURS

from labcourse.grading.accounts import account_of
from labcourse.grading.assignments import Handed
from labcourse.grading.gradebook import Gradebook, Graded, RunRecord, StudentRecord
from labcourse.grading.graded_run import facts_as_json
from labcourse.grading.marks import Mark
from labcourse.grading.reports.result import Result
from labcourse.grading.submission import Submission
from labcourse.problems import Reason


def mark(status: str = "right", points: float = 2.0, reason: Reason = "Well.", given: str = "19.9 rad/s") -> Mark:
    """The mark for a number of two points."""
    return Mark("2.11", "omega_n", status, points, 2.0, reason, given)


def prose(status: str = "for a person", points: float = 0.0, given: str = "Because it bends.") -> Mark:
    """The mark for an explanation of one point."""
    return Mark("2.11", "explanation", status, points, 1.0, "A person will read this.", given)


def report_text(status: str = "for a person", points: float = 0.0, given: str = "It was fine.") -> Mark:
    """The mark for a question that is words alone, of two points."""
    return Mark("2.16", "comparison", status, points, 2.0, "A person will read this.", given)


def facts(student: str = "ada", **about: Any) -> tuple[dict[str, Any], ...]:
    """What a run's record stores of a submission."""
    return facts_as_json(Submission(student=student, **about))


def graded(student: str, *marks: Mark, submission: str = "first", key: str = "key 1", **run: Any) -> Graded:
    """A run with its marks."""
    values = {"master": "m", "software": "rotflex 0", "probe_seed": 7, "isolation": "Run in isolation."} | run
    record = RunRecord(key=f"{student} {submission}", student=student, submission=submission, **values)
    return Graded(record, marks or (mark(), prose(), report_text()), key)


def result(
    *marks: Mark, student: str = "ada", about: Sequence[str] = (), lapsed: Sequence[Any] = (), **more: Any
) -> Result:
    """What came out for a student with these marks: name, email and section in ``about``; more of the run or result."""
    comments, account, run = (more.pop(name, None) for name in ("comments", "account", "run"))
    made, record = graded(student, *marks), StudentRecord(student, *about)
    made = replace(made, run=run or graded(student, **more).run, lapsed=tuple(lapsed))
    account = account or account_of(OURS, Handed(record, made.marks, graded=made))
    return Result(made, record, account, comments or ())


def record(book: Gradebook, *runs: Graded) -> None:
    """Put runs into a gradebook."""
    for one in runs:
        book.record(one, "batch", "run")


def enrol(book: Gradebook, folder: Path, *rows: tuple[str, str, str, str]) -> None:
    """Take a roster in: ID, name, email and section of each."""
    text = io.StringIO(newline="")
    csv.writer(text).writerows([("id", "name", "email", "section"), *rows])
    (folder / "roster.csv").write_text(text.getvalue(), encoding="utf-8")
    book.import_roster(folder / "roster.csv")


def rows(out: Path) -> dict[str, dict[str, str]]:
    """The rows of grades.csv, by student."""
    with (out / "grades.csv").open(encoding="utf-8", newline="") as file:
        return {row["student"]: row for row in csv.DictReader(file)}
