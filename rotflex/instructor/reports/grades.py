"""Marks for people, all of them from the gradebook and its roster, whatever was graded just now.

``grades.csv`` has a row for everybody; each student of whom something was graded has ``marks.json`` and
``feedback.html`` in a folder of their own.
"""

from __future__ import annotations

import json
from collections.abc import Collection
from dataclasses import asdict
from pathlib import Path
from typing import Any

import rotflex
from rotflex.courseware import files
from rotflex.courseware.messages import _
from rotflex.courseware.student_id import GRADES_FILE, caseless
from rotflex.errors import GradingError
from rotflex.instructor.course import Course
from rotflex.instructor.gradebook import Gradebook, Graded, StudentRecord
from rotflex.instructor.reports import feedback, grades_table
from rotflex.instructor.reports.grades_table import NOT_GRADED_YET, NOTHING_HANDED_IN, Unmarked
from rotflex.instructor.reports.result import Result, lapse, result_of

MARKS_FILE, FEEDBACK_FILE = "marks.json", "feedback.html"  #: in a student's folder


def make_folder(out: Path) -> None:
    """Make the folder of results, unless it is there.

    Raises
    ------
    GradingError
        If that is not possible.
    """
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise GradingError(_("There can be no results in {out}: {why}.").format(out=out, why=error.strerror)) from None


class Reports:
    """The folder of results.

    In a ``with`` block, everybody's reports are written at its end, also where an error or an interrupt ends it.

    Parameters
    ----------
    out : the folder; made if needed
    course : whose questions these are
    book : what the reports are made from
    handed_in : students who are known to have handed in something, besides those of whom the gradebook knows it

    Raises
    ------
    GradingError
        If the folder cannot be made.
    """

    def __init__(self, out: Path, course: Course, book: Gradebook, handed_in: Collection[str] = ()) -> None:
        make_folder(out)
        self._out, self._course, self._book, self._handed_in = out, course, book, handed_in
        self._failures: dict[Path, str] = {}

    def __enter__(self) -> Reports:
        return self

    def __exit__(self, *_: object) -> None:
        self.write_all()

    def write(self, graded: Graded) -> Result:
        """Write a student's pages in place of earlier ones. What cannot be written is told by :meth:`write_all`."""
        about = {caseless(one.student): one for one in self._book.students()}.get(caseless(graded.run.student))
        return self._pages(graded, about)

    def write_all(self) -> int:
        """Write everybody's pages, and ``grades.csv``.

        Returns
        -------
        int
            How many students there are.

        Raises
        ------
        GradingError
            If something of it cannot be written; all that can be is written.
        """
        self._failures.clear()
        waiting = {caseless(one): StudentRecord(one) for one in (*self._handed_in, *self._book.handed_in())}
        everybody = waiting | {caseless(one.student): one for one in self._book.students()}
        rows: list[Result | Unmarked] = []
        for known_as, about in sorted(everybody.items()):
            graded = self._book.current(about.student)
            if graded is None:
                rows.append(Unmarked(about, NOT_GRADED_YET if known_as in waiting else NOTHING_HANDED_IN))
            else:
                rows.append(self._pages(graded, about))
        if rows:
            self._write(self._out / GRADES_FILE, grades_table.text(rows, self._course.key))
        if self._failures:
            raise _not_written(self._failures)
        return len(rows)

    def _pages(self, graded: Graded, about: StudentRecord | None) -> Result:
        result = result_of(graded, about, self._book.comments(graded.run.student))
        folder = self._out / result.student
        self._write(folder / MARKS_FILE, json.dumps(_record(result), indent=1, sort_keys=True) + "\n")
        page = feedback.page(result, self._course.catalogue, self._course.title, graded.run)
        self._write(folder / FEEDBACK_FILE, page)
        return result

    def _write(self, path: Path, content: str) -> None:
        try:
            path.parent.mkdir(exist_ok=True)
            files.write(path, content)
        except OSError as error:
            self._failures[path] = error.strerror or str(error)


def _not_written(failures: dict[Path, str]) -> GradingError:
    path, why = next(reversed(failures.items()))  # of grades.csv, if it is among them
    others = _(" So it is with {count} more.").format(count=len(failures) - 1) if len(failures) > 1 else ""
    return GradingError(
        _(
            "{path} cannot be written: {why}.{others} All marks are in the gradebook: when that is mended, "
            "`rotflex report` writes what is missing."
        ).format(path=path, why=why, others=others)
    )


def _record(result: Result) -> dict[str, Any]:
    """A student's marks as plain data."""
    totals = {
        "total": result.total,
        "out_of": result.out_of,
        "awaiting": result.awaiting,
        "not_marked": result.not_marked,
        "software": f"rotflex {rotflex.__version__}",
    }
    comments = [
        {"question": one.question, "text": one.text, "by": one.actor, "when": one.when.isoformat()}
        for one in result.comments
    ]
    return {**asdict(result), **totals, "comments": comments, "lapsed": list(map(lapse, result.lapsed))}
