"""Marks for people: ``grades.csv``, and for each student ``marks.json`` and ``feedback.html``."""

from __future__ import annotations

import csv
import io
import json
from dataclasses import asdict
from pathlib import Path

import rotflex
from rotflex.courseware import files
from rotflex.courseware.catalogue import Catalogue
from rotflex.courseware.messages import _
from rotflex.courseware.student_id import GRADES_FILE
from rotflex.errors import GradingError
from rotflex.instructor.gradebook import Graded
from rotflex.instructor.reports import feedback
from rotflex.instructor.reports.feedback import points
from rotflex.instructor.reports.result import Result, result_of
from rotflex.instructor.reports.safe_text import spreadsheet_cell


class Reports:
    """The folder of results: ``grades.csv``, and for each student ``marks.json`` and ``feedback.html``.

    Parameters
    ----------
    out : the folder; made if needed
    catalogue : of the course, for the questions' titles

    Raises
    ------
    GradingError
        If it cannot be made.
    """

    def __init__(self, out: Path, catalogue: Catalogue) -> None:
        try:
            out.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise GradingError(
                _("There can be no results in {out}: {why}.").format(out=out, why=error.strerror)
            ) from None
        self._out, self._catalogue = out, catalogue
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
        files.write(folder / "feedback.html", feedback.page(result, self._catalogue))
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
