"""Marks for people, all of them from the gradebook and its roster, whatever was graded just now.

``grades.csv`` has a row for everybody; each student of whom something was graded has ``marks.json`` and
``feedback.html`` in a folder of their own. ``hints.md`` is there if there are any (:mod:`.hints`).
"""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from collections.abc import Collection
from dataclasses import asdict, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import labcourse
from labcourse import files, program
from labcourse.errors import GradingError
from labcourse.grading.accounts.lateness import unknown_names
from labcourse.grading.course import Course
from labcourse.grading.gradebook import Gradebook, Graded, RunRecord, StudentRecord
from labcourse.grading.reports import feedback, grades_table, hints
from labcourse.grading.reports.grades_table import NOT_GRADED_YET, NOTHING_HANDED_IN, Unmarked
from labcourse.grading.reports.result import Result, lapse, result_in
from labcourse.messages import DISK_FULL, FREE_SPACE
from labcourse.safe_text import no_escapes
from labcourse.student_id import GRADES_FILE, HINTS_FILE, caseless

_PROBE = ".labcourse-probe"  # written, and taken away again
MARKS_FILE, FEEDBACK_FILE = "marks.json", "feedback.html"  #: in a student's folder


def make_folder(out: Path) -> None:
    """Make the folder of results, unless it is there, and see that it can be written to: before a class is run.

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
        probe = out / _PROBE
        files.write(probe, b"")
        probe.unlink(missing_ok=True)  # another grader, begun just now, may have done so
    except OSError as error:
        raise GradingError(f"There can be no results in {out}: {error.strerror}.") from None


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
        self._failures: dict[Path, OSError] = {}
        self._written: dict[str, str] = {}  # student → digest of all that their pages show
        self._hints: list[hints.Hint] = []

    def __enter__(self) -> Reports:
        return self

    def __exit__(self, *_: object) -> None:
        self.write_all()

    def write(self, graded: Graded) -> Result:
        """Write a student's pages in place of earlier ones. :meth:`write_all` raises for what cannot be written."""
        about = {caseless(one.student): one for one in self._book.students()}.get(caseless(graded.run.student))
        return self._pages(graded, about)

    @property
    def closed(self) -> str:
        """What an instructor should know of pages that students may not see yet; "" where they may."""
        seen = self._course.settings.feedback
        if seen.opens is None or seen.is_open(datetime.now(UTC)):
            return ""
        return (
            f"Feedback pages say that they open at {seen.opens:%Y-%m-%d %H:%M %Z} (course.toml); then say "
            f"{program.name()} report."
        )

    @property
    def unknown(self) -> str:
        """What the settings name of a class that is not there, in a line or two; "" where there is nothing."""
        settings = self._course.settings
        if not settings.deadlines:
            return ""
        missing = unknown_names(settings, self._book.students())
        due = (
            "course.toml names these in deadlines, and the gradebook has no such section: {names}. Nobody has a "
            "deadline by them."
        )
        more_time = (
            "course.toml names these in extensions, and the gradebook has no such student or section: {names}. Nobody "
            "has more time by them."
        )
        told = ((due, missing.due), (more_time, missing.more_time))
        return "\n".join(text.format(names=", ".join(map(repr, names))) for text, names in told if names)

    @property
    def hints(self) -> str:
        """What class-mates have in common, in a line or two; "" where it is nothing. After :meth:`write_all`."""
        counts = Counter(one.about for one in self._hints)
        file = self._out / HINTS_FILE
        return "\n".join(
            f"{about}, as a hint and never a verdict: {count}, listed in {file}." for about, count in counts.items()
        )

    def write_all(self) -> int:
        """Write everybody's pages, ``grades.csv``, and ``hints.md``.

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
        self._write_hints()
        if rows:
            self._write(self._out / GRADES_FILE, grades_table.text(rows, self._course.key))
        if self._failures:
            raise _not_written(self._failures)
        return len(rows)

    def _write_hints(self) -> None:
        """Write the file of hints; without hints, remove an earlier one."""
        self._hints = hints.of_class(self._book, self._course)
        path = self._out / HINTS_FILE
        if self._hints:
            self._write(path, no_escapes(hints.as_markdown(self._hints)))
            return
        try:
            path.unlink(missing_ok=True)
        except OSError as error:
            self._failures[path] = error

    def _pages(self, graded: Graded, about: StudentRecord | None) -> Result:
        result = result_in(self._book, self._course, graded, about)
        is_open = self._course.settings.feedback.is_open(datetime.now(UTC))
        digest = hashlib.sha256(repr((result, graded.run, is_open)).encode()).hexdigest()
        if self._written.get(result.student) == digest:
            return result
        folder = self._out / result.student
        self._write(folder / MARKS_FILE, json.dumps(_record(result), indent=1, sort_keys=True) + "\n")
        self._write(folder / FEEDBACK_FILE, self._feedback(result, graded.run))
        if not self._failures:
            self._written[result.student] = digest
        return result

    def _feedback(self, result: Result, run: RunRecord) -> str:
        """What a student may see now."""
        course, settings = self._course, self._course.settings
        opens = settings.feedback.opens
        if opens is not None and not settings.feedback.is_open(datetime.now(UTC)):
            return feedback.not_open_yet(result, opens, course.title, settings.term)
        return feedback.page(result, course.catalogue, course.title, run, settings.term, settings.feedback)

    def _write(self, path: Path, content: str) -> None:
        try:
            path.parent.mkdir(exist_ok=True)
            files.write(path, content)
        except OSError as error:
            self._failures[path] = error


def _not_written(failures: dict[Path, OSError]) -> GradingError:
    path, error = next(reversed(failures.items()))  # of grades.csv, if it is among them
    others = f" So it is with {len(failures) - 1} more." if len(failures) > 1 else ""
    todo = f"All marks are in the gradebook: when that is mended, `{program.name()} report` writes what is missing."
    if error.errno in DISK_FULL:  # the gradebook may lie on the same disk, and lack the last marks
        todo = f"{FREE_SPACE} `{program.name()} grade` runs nothing again that is in the gradebook."
    return GradingError(f"{path} cannot be written: {error.strerror or error}.{others} {todo}")


def _record(result: Result) -> dict[str, Any]:
    """A student's marks as plain data."""
    totals = {
        "total": None if result.not_graded else result.total,
        "out_of": result.out_of,
        "awaiting": result.awaiting,
        "not_marked": result.not_marked,
        "software": f"labcourse {labcourse.__version__}",
    }
    comments = [
        {"question": one.question, "text": one.text, "by": one.actor, "when": one.when.isoformat()}
        for one in result.comments
    ]
    requests = [
        {**asdict(one), "made": one.made.isoformat(), "answered": _time(one.answered)} for one in result.requests
    ]
    told = {"comments": comments, "lapsed": list(map(lapse, result.lapsed)), "requests": requests}
    account = None if result.account is None or result.not_graded else result.account.as_data()
    return {**asdict(replace(result, account=None)), **totals, **told, "account": account}


def _time(when: datetime | None) -> str | None:
    return None if when is None else when.isoformat()
