"""Marks for people: ``grades.csv``, and for each student ``marks.json`` and ``feedback.html``."""

from __future__ import annotations

import csv
import io
import json
from dataclasses import asdict, dataclass
from pathlib import Path

import rotflex
from rotflex.courseware import files
from rotflex.courseware.student_id import GRADES_FILE
from rotflex.errors import GradingError
from rotflex.gradebook import Graded
from rotflex.grading import feedback
from rotflex.grading.checks import Status
from rotflex.grading.feedback import points
from rotflex.grading.marking import Mark
from rotflex.grading.plain import spreadsheet_cell


@dataclass(frozen=True)
class Result:
    """What came out for a student.

    Attributes
    ----------
    student : ID
    marks : for every part of every question in the key
    problems : what went wrong with the submission
    notes : what else is worth knowing
    stamp : how it was run
    """

    student: str
    marks: tuple[Mark, ...]
    problems: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    stamp: str = ""

    @property
    def total(self) -> float:
        """Points earned."""
        return sum(mark.points for mark in self.marks)

    @property
    def out_of(self) -> float:
        """Points that there are."""
        return sum(mark.out_of for mark in self.marks)

    @property
    def awaiting(self) -> float:
        """Points that a person has yet to give or not."""
        return sum(mark.awaiting for mark in self.marks)

    def by_question(self) -> dict[str, tuple[float, float]]:
        """Points earned and possible, for each question that has any."""
        found: dict[str, tuple[float, float]] = {}
        for mark in self.marks:
            earned, possible = found.get(mark.question, (0.0, 0.0))
            found[mark.question] = (earned + mark.points, possible + mark.out_of)
        return {number: sums for number, sums in found.items() if sums[1]}


def result_of(graded: Graded) -> Result:
    """What the gradebook holds of a student, as a result."""
    run = graded.run
    marks = tuple(
        Mark(one.question, one.part, Status(one.status), one.points, one.out_of, one.reason, one.given)
        for one in graded.marks
    )
    return Result(run.student, marks, run.problems, run.notes, run.isolation)


class Reports:
    """The folder of results: ``grades.csv``, and for each student ``marks.json`` and ``feedback.html``.

    Parameters
    ----------
    out : the folder; made if needed

    Raises
    ------
    GradingError
        If it cannot be made.
    """

    def __init__(self, out: Path) -> None:
        try:
            out.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise GradingError(f"There can be no results in {out}: {error.strerror}.") from None
        self._out = out
        self._results: dict[str, Result] = {}

    def __enter__(self) -> Reports:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def write(self, graded: Graded) -> Result:
        """Put a student's pages in place of earlier ones."""
        result = result_of(graded)
        folder = self._out / result.student
        folder.mkdir(exist_ok=True)
        totals = {"total": result.total, "out_of": result.out_of, "awaiting": result.awaiting}
        record = {**asdict(result), **totals, "software": f"rotflex {rotflex.__version__}"}
        files.write(folder / "marks.json", json.dumps(record, indent=1, sort_keys=True) + "\n")
        files.write(folder / "feedback.html", feedback.page(result))
        self._results[result.student] = result
        return result

    def close(self) -> None:
        """Write ``grades.csv`` with all that were written."""
        if self._results:
            write_grades(self._out / GRADES_FILE, [self._results[student] for student in sorted(self._results)])


def write_grades(path: Path, results: list[Result]) -> None:
    """One row for each student, one column for each question that has points."""
    table = io.StringIO(newline="")
    writer = csv.writer(table)
    questions = list(results[0].by_question()) if results else []
    writer.writerow(["student", *questions, "total", "out_of", "awaiting a person", "notes"])
    for result in results:
        earned = result.by_question()
        writer.writerow(
            [
                spreadsheet_cell(result.student),
                *(points(earned[number][0]) for number in questions),
                points(result.total),
                points(result.out_of),
                points(result.awaiting),
                spreadsheet_cell(" ".join((*result.problems, *result.notes, result.stamp))),
            ]
        )
    files.write(path, table.getvalue())
