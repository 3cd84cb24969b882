"""Write everybody's marks from the gradebook and its roster, whatever was graded just now.

``grades.csv`` has a row for each student (its columns: :func:`grades_table`); each student of whom something was graded
has ``marks.json`` and ``feedback.html`` in a folder of their own. ``hints.md`` exists if there are hints.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import labcourse
from labcourse import files, program
from labcourse.errors import GradingError
from labcourse.grading.accounts import exact, in_full, unknown_names
from labcourse.grading.course import Course
from labcourse.grading.gradebook import Gradebook, Graded, StudentRecord
from labcourse.grading.reports import feedback, hints
from labcourse.grading.reports.result import Result, asked, lapse, points, result_in, sums
from labcourse.messages import DISK_FULL, FREE_SPACE
from labcourse.safe_text import as_csv, no_escapes
from labcourse.student_id import GRADES_FILE, HINTS_FILE, caseless

NOTHING_HANDED_IN = "nothing handed in"
NOT_GRADED_YET = "handed in, not graded yet"
MARKS_FILE, FEEDBACK_FILE = "marks.json", "feedback.html"  #: in a student's folder
_PROBE = ".labcourse-probe"  # written and removed
_TOTALS = ("total", "out_of", "final", "final out of", "how it counts", "awaiting a person", "not marked", "undecided")


def make_folder(out: Path) -> None:
    """Make the folder of results if it does not exist, and check that it can be written to.

    Raises
    ------
    GradingError
        If it cannot.
    """
    table = out / GRADES_FILE
    if table.is_dir():
        raise GradingError(
            f"{table} is a folder, where a file is to be written. Move it away, or choose another folder."
        )
    try:
        out.mkdir(parents=True, exist_ok=True)
        files.write(out / _PROBE, b"")
        (out / _PROBE).unlink(missing_ok=True)  # another grader may have removed it
    except OSError as error:
        raise GradingError(f"There can be no results in {out}: {error.strerror}.") from None


class Reports:
    """The folder of results.

    At the end of a ``with`` block everybody's reports are written, also if an error or an interrupt ends it.

    Parameters
    ----------
    out : the folder; made if needed
    course : the course
    book : what the reports are made from
    handed_in : students who handed in something, besides those of whom the gradebook knows it

    Raises
    ------
    GradingError
        If the folder cannot be made.
    """

    def __init__(self, out: Path, course: Course, book: Gradebook, handed_in: Collection[str] = ()) -> None:
        make_folder(out)
        self._out, self._course, self._book, self._handed_in = out, course, book, handed_in
        self._failures: dict[Path, OSError] = {}
        self._hints: list[hints.Hint] = []

    def __enter__(self) -> Reports:
        return self

    def __exit__(self, *_: object) -> None:
        self.write_all()

    def result(self, graded: Graded) -> Result:
        """Return what came out for a student, with what the roster says of them."""
        about = {caseless(one.student): one for one in self._book.students()}.get(caseless(graded.run.student))
        return result_in(self._book, self._course, graded, about)

    def notices(self) -> Iterator[str]:
        """Yield what an instructor should know after :meth:`write_all`: pages that are closed, unknown names, hints."""
        settings = self._course.settings
        if not settings.feedback.is_open(datetime.now(UTC)):
            yield (
                f"Feedback pages say that they open at {settings.feedback.opens:%Y-%m-%d %H:%M %Z} (course.toml); then "
                f"say {program.name()} report."
            )
        if settings.deadlines:
            in_deadlines, in_extensions = unknown_names(settings, self._book.students())
            text = "course.toml names these in {}, and the gradebook does not have them: {}. Nobody has {} by them."
            if in_deadlines:
                yield text.format("deadlines", ", ".join(map(repr, in_deadlines)), "a deadline")
            if in_extensions:
                yield text.format("extensions", ", ".join(map(repr, in_extensions)), "more time")
        for about, count in Counter(hint.about for hint in self._hints).items():
            yield f"{about}, as a hint and never a verdict: {count}, listed in {self._out / HINTS_FILE}."

    def write_all(self) -> int:
        """Write everybody's pages, ``grades.csv`` and ``hints.md``.

        Returns
        -------
        int
            number of students

        Raises
        ------
        GradingError
            If some file cannot be written; all others are written.
        """
        self._failures.clear()
        handed_in = set(map(caseless, [*self._handed_in, *self._book.handed_in()]))
        students = [*map(StudentRecord, self._handed_in), *self._book.students()]
        everybody = {caseless(one.student): one for one in students}
        rows: list[Result | StudentRecord] = []
        for _name, about in sorted(everybody.items()):
            graded = self._book.current(about.student)
            rows.append(about if graded is None else self._write_pages(graded, about))
        self._write_hints()
        if rows:
            with self._file(self._out / GRADES_FILE) as path:
                files.write(path, grades_table(rows, handed_in, self._course.key))
        if self._failures:
            raise _not_written(self._failures)
        return len(rows)

    def _write_hints(self) -> None:
        self._hints = hints.of_class(self._book, self._course)
        with self._file(self._out / HINTS_FILE) as path:
            if self._hints:
                files.write(path, no_escapes(hints.as_markdown(self._hints)))
            else:
                path.unlink(missing_ok=True)

    def _write_pages(self, graded: Graded, about: StudentRecord) -> Result:
        result = result_in(self._book, self._course, graded, about)
        pages = {
            MARKS_FILE: json.dumps(_as_json(result), indent=1, sort_keys=True, default=datetime.isoformat) + "\n",
            FEEDBACK_FILE: feedback.page(result, self._course),
        }
        for name, content in pages.items():
            with self._file(self._out / result.about.student / name) as path:
                path.parent.mkdir(exist_ok=True)
                files.write(path, content)
        return result

    @contextmanager
    def _file(self, path: Path) -> Iterator[Path]:
        """Remember if a file cannot be written, and go on."""
        try:
            yield path
        except OSError as error:
            self._failures[path] = error


def _not_written(failures: dict[Path, OSError]) -> GradingError:
    path, error = next(reversed(failures.items()))  # grades.csv, if it is among them
    others = f" So it is with {len(failures) - 1} more." if len(failures) > 1 else ""
    todo = f"All marks are in the gradebook: when that is mended, `{program.name()} report` writes what is missing."
    if error.errno in DISK_FULL:  # the gradebook may lie on the same disk, and lack the last marks
        todo = f"{FREE_SPACE} `{program.name()} grade` runs nothing again that is in the gradebook."
    return GradingError(f"{path} cannot be written: {error.strerror or error}.{others} {todo}")


def _as_json(result: Result) -> dict[str, Any]:
    """Return the content of ``marks.json``."""
    about, run, sums = result.about, result.run, result.sums
    graded = not result.not_graded
    return {
        **{"student": about.student, "name": about.name, "email": about.email, "section": about.section},
        **{"problems": run.problems, "notes": run.notes, "stamp": run.isolation},
        **{"out_of": sums.out_of, "awaiting": sums.awaiting, "not_marked": sums.not_marked},
        "software": f"labcourse {labcourse.__version__}",
        "marks": list(map(asdict, result.marks)),
        "total": result.total if graded else None,
        "account": result.account.as_data() if result.account and graded else None,
        "lapsed": list(map(lapse, result.graded.lapsed)),
        "requests": [asdict(request) for request in result.requests],
        "comments": [
            {"question": one.question, "text": one.text, "by": one.actor, "when": one.when} for one in result.comments
        ],
    }


# --- grades.csv -------------------------------------------------------------------------------------------------------


def grades_table(
    rows: Sequence[Result | StudentRecord], handed_in: Collection[str] = (), order: Collection[str] = ()
) -> str:
    """Return ``grades.csv``.

    ======================  ============================================================================================
    student, name, email,   from the roster
    section
    a column for each       points earned; empty if nothing of it is decided yet, or nothing was handed in
    question
    total                   points earned so far; empty as above
    out_of                  possible points
    final                   the final grade by the course's settings; empty while something that counts is not decided
    final out of            its scale
    how it counts           what is special about it: what was left out, has another weight, came late, ...
    awaiting a person       points that wait for a person; out_of includes them, total does not
    not marked              points that could not be marked, through a fault of the key; in out_of, not in total
    undecided               question and part of what waits, or could not be marked
    notes                   problems, notes, and how it was run; or why there are no points
    ======================  ============================================================================================

    Parameters
    ----------
    rows : everybody; a student without marks is a record of the roster
    handed_in : those of them who handed in something, in small letters (:func:`caseless`)
    order : the questions, in the order of their columns; others come behind
    """
    marks = [mark for row in rows if isinstance(row, Result) for mark in row.marks if mark.out_of]
    marked = dict.fromkeys(mark.question for mark in marks)
    questions = [*(number for number in order if number in marked), *(one for one in marked if one not in order)]
    heads = ["student", "name", "email", "section", *questions, *_TOTALS, "notes"]
    lines = []
    for row in rows:
        about = row.about if isinstance(row, Result) else row
        cells = [""] * len([*questions, *_TOTALS])
        notes = NOT_GRADED_YET if caseless(about.student) in handed_in else NOTHING_HANDED_IN
        if isinstance(row, Result):
            requests = [f"{one.question}, {one.part}: {asked(one)}" for one in row.requests]
            run, cells = row.run, _points(row, questions)
            notes = " ".join([*run.problems, *map(lapse, row.graded.lapsed), *requests, *run.notes, run.isolation])
        lines.append([about.student, about.name, about.email, about.section, *cells, notes])
    return as_csv([heads, *lines])


def _points(row: Result, questions: Sequence[str]) -> list[str]:
    """Return the cells of a student between section and notes."""
    by_question = [sums(mark for mark in row.marks if mark.question == number).earned for number in questions]
    whole, account = row.sums, row.account
    final = ["", "", ""]
    if account is not None:
        final = [account.final_text, in_full(exact(account.final_out_of)), "; ".join(account.how())]
    return [
        *("" if earned is None else points(earned) for earned in by_question),
        points(row.total) if whole.earned is not None or not whole.out_of else "",
        points(whole.out_of),
        *final,
        points(whole.awaiting),
        points(whole.not_marked),
        "; ".join(f"{mark.question} {mark.part}" for mark in row.undecided()),
    ]
