"""Write everybody's marks from the gradebook and its roster, whatever was graded just now.

``grades.csv`` has a row for each student (its columns: :func:`grades_table`); each student of whom something was graded
has ``marks.json`` and ``feedback.html`` in a folder of their own. ``hints.md`` and ``hints.json`` exist if there are
hints.
"""

from __future__ import annotations

import json
from collections import Counter, defaultdict
from collections.abc import Collection, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from datetime import datetime
from functools import cached_property
from pathlib import Path
from typing import Any

import labcourse
from labcourse import clock, files, program
from labcourse.errors import GradingError
from labcourse.grading import counting
from labcourse.grading.accounts import Account, in_full, points, unknown_names
from labcourse.grading.assignments import given_back
from labcourse.grading.course import Course
from labcourse.grading.gradebook import Gradebook, Graded, Publication, StudentRecord
from labcourse.grading.marking.marking_processes import marking_digest
from labcourse.grading.reports import feedback, hints
from labcourse.grading.reports.changes import ChangedMark, changed_in
from labcourse.grading.reports.hints import digest
from labcourse.grading.reports.result import Result, account_in, lapse, request_text, result_in, state_of, sums
from labcourse.grading.running.prepared import content_digest, program_digest
from labcourse.messages import DISK_FULL, FREE_SPACE
from labcourse.safe_text import as_csv
from labcourse.sentences import sentence, sentences
from labcourse.student_id import GRADES_FILE, HINTS_FILE, caseless

NOTHING_HANDED_IN = "nothing handed in"
NOT_GRADED_YET = "handed in, not graded yet"
MARKS_FILE, FEEDBACK_FILE = "marks.json", "feedback.html"  #: in a student's folder
EXECUTED_FOLDER = "executed"  #: in a student's folder: what notebooks showed when they were run again
_PROBE = ".labcourse-probe"  # written and removed
_SO_FAR = ("so far", "so far out of", "how it counts")
_TOTALS = ("total", "out_of", "awaiting a person", "not marked", "undecided")


@dataclass(frozen=True)
class NotGraded:
    """A student of whom nothing was graded: what the roster says, and the states of their work."""

    about: StudentRecord
    account: Account


def make_folder(out: Path) -> None:
    """Make the folder of results if it does not exist, and check that it can be written to.

    Raises
    ------
    GradingError
        If it cannot be made or written to, or its ``grades.csv`` is a folder.
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


@dataclass
class Reports(AbstractContextManager["Reports"]):
    """The folder of results.

    At the end of a ``with`` block everybody's reports are written, also if an error or an interrupt ends it.

    Attributes
    ----------
    out : the folder; made if needed
    course : the course
    book : what the reports are made from
    handed_in : students who handed in something, besides those of whom the gradebook knows it
    publication : that is being made, and is not in the gradebook yet

    Raises
    ------
    GradingError
        As :func:`make_folder` does, and as :meth:`write_all` does at the end of the block.
    """

    out: Path
    course: Course
    book: Gradebook
    handed_in: Collection[str] = ()
    publication: Publication | None = None

    def __post_init__(self) -> None:
        make_folder(self.out)
        counting.recount_all(self.book, self.course)
        self._failures: dict[Path, OSError] = {}
        self._hints: list[hints.Hint] = []

    def __exit__(self, *_: object) -> None:
        self.write_all()

    def notices(self) -> Iterator[str]:
        """Yield what an instructor should know after :meth:`write_all`: pages that are closed, unknown names, hints."""
        settings = self.course.settings
        if not settings.feedback.is_open(clock.now()):
            yield (
                f"Feedback pages say that they open at {settings.feedback.opens:%Y-%m-%d %H:%M %Z} (course.toml); then "
                f"say {program.name()} report."
            )
        if settings.dues or settings.extensions:
            text = "course.toml names these in {}, and the gradebook does not have them: {}. Nobody has {} by them."
            tables = (("deadlines", "a deadline"), ("extensions", "more time"))
            for (table, what), names in zip(tables, unknown_names(settings, self.book.students()), strict=True):
                if names:
                    yield text.format(table, ", ".join(map(repr, names)), what)
        for sort, count in Counter(hint.sort for hint in self._hints).items():
            yield f"{sort}, as a hint and never a verdict: {count}, listed in {self.out / HINTS_FILE}."

    def write_all(self) -> int:
        """Write everybody's pages, ``grades.csv``, and the hints.

        Returns
        -------
        int
            number of students who have pages

        Raises
        ------
        GradingError
            If some file cannot be written; all others are written.
        """
        self._failures.clear()
        handed_in = set(map(caseless, [*self.handed_in, *self.book.handed_in()]))
        students = [*map(StudentRecord, self.handed_in), *self.book.students()]
        everybody = {caseless(one.student): one for one in students}
        rows: list[Result | NotGraded] = []
        new = [] if self.publication is None else [self.publication]
        back = given_back([*self.book.publications(), *new])
        moved = defaultdict[str, list[ChangedMark]](list)
        for change in changed_in(self.book, self.course, since_first=True):
            moved[caseless(change.student)] += [change] if change.before is not None else []
        gather, works = hints.works(self.book, self.course), list[hints.ComparedWork]()
        for name, about in sorted(everybody.items()):
            graded = self.book.current(about.student)
            if graded is None:
                rows.append(NotGraded(about, account_in(self.book, self.course, None, about)))
            else:
                rows.append(self._write_pages(graded, about, back, moved[name]))
                works.append(gather(graded))
        self._hints = hints.compared(works, self.course)
        for name, content in hints.as_files(self._hints).items():
            self._write(self.out / name, content if self._hints else None)
        if rows:
            self._write(self.out / GRADES_FILE, grades_table(rows, handed_in, self.course.key))
        if self._failures:
            raise _not_written(self._failures)
        return sum(isinstance(row, Result) for row in rows)

    def _write_pages(
        self, graded: Graded, about: StudentRecord, back: frozenset[str] | None, moved: Sequence[ChangedMark]
    ) -> Result:
        """Write ``marks.json`` and ``feedback.html`` of a student; return all that came out, without the answers.

        Parameters
        ----------
        graded : the run that counts, and its marks
        about : what the roster says of the student
        back : notebooks that were given back: the files have no other marks; None for all
        moved : marks that moved since they were first given back
        """
        result = result_in(self.book, self.course, graded, about)
        shown = replace(result.given_back(self.course, back), changes=moved)
        folder = self.out / about.student
        marks, page, made_of = folder / MARKS_FILE, folder / FEEDBACK_FILE, content_digest([self._basis, shown])
        content = _content_of(page)
        if files.object_in(_content_of(marks)).get("page") != [made_of, digest(content)]:  # else it is as it would be
            content = feedback.page(shown, self.course).encode()
            self._write(page, content)
        about_page = {"page": [made_of, digest(content)]}
        data = json.dumps(_as_json(shown) | about_page, indent=1, sort_keys=True, default=datetime.isoformat)
        self._write(marks, f"{data}\n")
        return replace(result, graded=graded.without_answers())

    @cached_property
    def _basis(self) -> str:
        """Digest of all that a page depends on besides what came out for its student: program, course, settings."""
        course, settings = self.course, self.course.settings  # of its packages, marks have the digest
        about = repr([course.title, course.cells, settings, settings.feedback.is_open(clock.now())])
        return content_digest([program_digest(), marking_digest(course), about])

    def _write(self, path: Path, content: str | bytes | None) -> None:
        """Write a file, or delete it if there is nothing to write; if that fails, remember it and go on."""
        try:
            if content is None:
                path.unlink(missing_ok=True)
            else:
                path.parent.mkdir(exist_ok=True)
                files.write(path, content)
        except OSError as error:
            self._failures[path] = error


def _content_of(path: Path) -> bytes:
    """Return what a file holds; nothing if it is not there or cannot be read, so that it is written anew."""
    try:
        return path.read_bytes()
    except OSError:
        return b""


def _not_written(failures: dict[Path, OSError]) -> GradingError:
    path, error = next(reversed(failures.items()))  # grades.csv, if it is among them
    others = f" So it is with {len(failures) - 1} more." if len(failures) > 1 else ""
    todo = f"All marks are in the gradebook: when that is mended, `{program.name()} report` writes what is missing."
    if error.errno in DISK_FULL:  # the gradebook may lie on the same disk, and lack the last marks
        todo = f"{FREE_SPACE} `{program.name()} grade` runs nothing again that is in the gradebook."
    return GradingError(f"{path} cannot be written: {error.strerror or error}.{others} {todo}")


def _as_json(result: Result) -> dict[str, Any]:
    """Return the content of ``marks.json``; total and account are None if nothing could be marked."""
    about, run, sums = result.about, result.run, result.sums
    graded = not result.not_graded
    return {
        **{"student": about.student, "name": about.name, "email": about.email, "section": about.section},
        **{"problems": sentences(run.problems), "notes": sentences(run.notes), "stamp": run.isolation},
        **{"out_of": sums.out_of, "awaiting": sums.awaiting, "not_marked": sums.not_marked},
        "software": f"labcourse {labcourse.__version__}",
        "marks": [{**vars(mark), "reason": sentence(mark.reason)} for mark in result.marks],
        "total": (sums.earned or 0.0) if graded else None,
        "account": result.account.as_data() if graded else None,
        "lapsed": list(map(lapse, result.graded.lapsed)),
        "comments": [
            {"question": one.question, "part": one.part, "text": one.text, "by": one.actor, "when": one.when}
            | ({"open": one.is_open} if one.asks else {})
            for one in result.comments
        ],
    }


# --- grades.csv -------------------------------------------------------------------------------------------------------


def grades_table(
    rows: Sequence[Result | NotGraded], handed_in: Collection[str] = (), order: Collection[str] = ()
) -> str:
    """Return ``grades.csv``.

    ======================  ============================================================================================
    student, name, email,   from the roster
    section
    TITLE, TITLE out of,    of each assignment: its points, rounded, empty while they are not known; what it is out of;
    TITLE state             and the state of the work, see :class:`labcourse.grading.assignments.State`, with how late
                            it came, or that the student is excused
    so far, so far out of   points of the assignments that are due, rounded, and what they are out of
    how it counts           what is special about it: what was left out, has another weight, came late, ...
    a column for each       points earned; empty if nothing of it is decided yet, or nothing was handed in
    question
    total, out_of           points earned and possible in what is due, before weights and lateness
    awaiting a person       points that wait for a person; out_of includes them, total does not
    not marked              points that could not be marked, through a fault of the key; in out_of, not in total
    undecided               question and part of what waits, or could not be marked
    notes                   problems, notes, and how it was run; or why there are no points
    ======================  ============================================================================================

    Parameters
    ----------
    rows : everybody
    handed_in : those of them who handed in something, in small letters (:func:`caseless`)
    order : the questions, in the order of their columns; others come behind
    """
    marks = [mark for row in rows if isinstance(row, Result) for mark in row.marks if mark.out_of]
    marked = dict.fromkeys(mark.question for mark in marks)
    questions = [*(number for number in order if number in marked), *(one for one in marked if one not in order)]
    titles = [one.title for one in (rows[0].account.assignments if rows else ()) if one.title]
    assignments = [heading for title in titles for heading in (title, f"{title} out of", f"{title} state")]
    heads = ["student", "name", "email", "section", *assignments, *_SO_FAR, *questions, *_TOTALS, "notes"]
    lines = []
    for row in rows:
        about = row.about
        cells = [""] * len([*questions, *_TOTALS])
        notes = NOT_GRADED_YET if caseless(about.student) in handed_in else NOTHING_HANDED_IN
        if isinstance(row, Result):
            requests = [f"{one.question}, {one.part}: {request_text(one)}" for one in row.requests]
            run, cells, lapsed = row.run, _points(row, questions), map(lapse, row.graded.lapsed)
            notes = " ".join([*sentences(run.problems), *lapsed, *requests, *sentences(run.notes), run.isolation])
        lines.append([about.student, about.name, about.email, about.section, *_grades(row.account), *cells, notes])
    return as_csv([heads, *lines])


def _grades(account: Account) -> list[str]:
    """Return the cells of a student between section and the questions."""
    cells, has_marks = [], any(one.all_items for one in account.assignments)
    for one in account.assignments:
        if one.title:
            cells += [one.points_text, in_full(one.out_of) if has_marks else "", state_of(one)]
    if not has_marks:
        return [*cells, "", "", ""]
    so_far = [account.so_far_text, in_full(account.out_of)] if account.out_of else ["", ""]
    return [*cells, *so_far, " ".join(account.explanations())]


def _points(row: Result, questions: Sequence[str]) -> list[str]:
    """Return the cells of a student between how it counts and the notes.

    Cells of questions leave out marks that are not decided, in work that has no points yet, or excused.
    """
    empty = {
        (item.question, item.part)
        for one in row.account.assignments
        for item in one.all_items
        if item.points is None or one.is_empty or one.is_excused
    }
    shown = [mark for mark in row.marks if mark.where not in empty]
    decided = (sums(mark for mark in shown if mark.question == number) for number in questions)
    whole = row.sums
    return [
        *("" if one.earned is None else points(one.earned) for one in decided),
        points(whole.earned or 0.0) if whole.earned is not None or not whole.out_of else "",
        *map(points, (whole.out_of, whole.awaiting, whole.not_marked)),
        "; ".join(f"{mark.question} {mark.part}" for mark in row.undecided()),
    ]
