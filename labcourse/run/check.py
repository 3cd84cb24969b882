"""Check a student's work at home: run it as grading runs it, and report what is recorded, what is not, and why.

The notebooks as they were saved are put into the course's frame and run from the first cell to the last, in a copy of
the folder. There is no sandbox: it is the student's own code, on their own computer. Nothing is marked.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import Any

import labcourse
from labcourse import course_file, courses, files
from labcourse.answers import answers, notebooks, report_files, schema, words
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.cell_reports import REPORTS_FILE, CellReports
from labcourse.answers.report_files import ReportFile
from labcourse.errors import AnswerError
from labcourse.files import ANSWERS_FILE, COURSE_FILE
from labcourse.messages import number_of
from labcourse.problems import Code, Problem, Where
from labcourse.run import execute, merge, portability, reasons, student_folder
from labcourse.run.alignment import Change, Role, asked_cells, cells_by_change, source_of
from labcourse.run.merge import Merged
from labcourse.run.reasons import Reasons
from labcourse.run.student_folder import StudentFolder
from labcourse.student_id import caseless

CLOSE = 1e-4  #: relative: answers are stored to six digits, and another library may differ in the last of them


class CheckState(StrEnum):
    """What became of a part of a question."""

    RECORDED = "recorded"
    WRITTEN = "written"  # an answer in words
    IN_PDF = "in a PDF"  # of the student's own: a text of a report
    DIFFERENT = "different"  # from what was recorded at home
    MISSING = "missing"  # and there is something to say about it
    EMPTY = "empty"


GOOD = (CheckState.RECORDED, CheckState.WRITTEN, CheckState.IN_PDF)


@dataclass(frozen=True)
class CheckedPart:
    """A part of a question, and what became of it."""

    notebook: str
    question: str
    name: str
    state: CheckState
    why: Problem | None = None


@dataclass(frozen=True)
class Checked:
    """The result of a check: plain data.

    Attributes
    ----------
    student, folder : whose work, and where
    parts : all that is asked, in the notebooks' order
    problems : what could not be read
    stops : what stopped, and what builds on it
    unlike : what to do about answers that the saved notebooks do not give as they were recorded
    notes : what else is worth knowing
    seconds : that it took
    """

    student: str
    folder: Path
    parts: tuple[CheckedPart, ...]
    problems: tuple[Problem, ...] = ()
    stops: tuple[Problem, ...] = ()
    unlike: tuple[Problem, ...] = ()
    notes: tuple[Problem, ...] = ()
    seconds: float = 0.0

    @property
    def good(self) -> bool:
        """Whether all that is asked is there, as it is on the page."""
        return not self.problems and all(part.state in GOOD for part in self.parts)

    @property
    def questions(self) -> dict[str, bool]:
        """Question → whether all of its parts are there."""
        return {part.question: not self._states(part.question) - {*GOOD} for part in self.parts}

    @property
    def summary(self) -> str:
        """How much is there, as a sentence."""
        there = sum(self.questions.values())
        count = number_of(len(self.questions), "question")
        return f"Complete: {count}." if there == len(self.questions) else f"Complete: {there} of {count}."

    @property
    def advice(self) -> tuple[Problem, ...]:
        """What to look at first, besides the missing answers and why they are missing."""
        causes = {_cell_of(part.why) for part in self.parts if part.why}
        return (*self.problems, *(stop for stop in self.stops if _cell_of(stop) not in causes), *self.unlike)

    def _states(self, question: str) -> set[CheckState]:
        return {part.state for part in self.parts if part.question == question}


def _cell_of(problem: Problem) -> tuple[str | None, ...]:
    """Return which cell stopped: its notebook and id."""
    return tuple(problem.parameters.get(name) for name in ("notebook", "cell"))


def check(
    folder: Path,
    masters: Mapping[str, dict[str, Any]],
    catalogue: Catalogue,
    *,
    student: str = "",
    cell_timeout: float = execute.CELL_TIMEOUT,
    report: Callable[[str], None] = lambda name: None,
) -> Checked:
    """Run a student's saved notebooks as grading does, and compare with what they recorded.

    Parameters
    ----------
    folder : the student's, with the notebooks in it
    masters : file name → notebook as released
    catalogue : of the course
    student : ID, of whose bench; else the student of the folder
    cell_timeout : time for a cell, s
    report : called with the file name of each notebook that begins

    Raises
    ------
    CheckError
        If the ID cannot be one, or nothing can be run here.
    """
    begun = time.monotonic()
    work = student_folder.read(folder, list(masters), notebooks.packages_of(masters), catalogue)
    student = student_folder.student_of(work, student)
    elsewhere = [*student_folder.work_elsewhere(work, masters)]
    away = {problem.where for problem in elsewhere}
    merged = merge.merged(masters, work.hand_in.notebooks)
    data, reports = _run(work, merged, student, masters, cell_timeout, report)
    (run, unreadable), (home, incomparable) = _parsed(data), _at_home(work, student)
    unread = [Problem.of(Code.ANSWERS_UNREAD, error=unreadable)] if unreadable else []
    given = {*answers.by_part(run)}
    seconds = cell_timeout if time.monotonic() - begun > cell_timeout else None  # else nothing can have run so long
    limits: dict[str, Any] = {"handed_in": work.hand_in.notebooks, "seconds": seconds, "at_home": True}
    why = reasons.explain(masters, merged, reports, given, catalogue, claim=home.get("cells"), **limits)
    answered, budget = work.hand_in.notebooks, words.Budget()
    written = {
        name: words.written(master["cells"], answered.get(name, ()), work.hand_in.files, budget=budget)
        for name, master in masters.items()
    }
    pdfs = report_files.of_files(work.hand_in.reports, catalogue)
    texts = {where: CheckState.WRITTEN for of_notebook in written.values() for where in of_notebook.words}
    in_pdf = {number: CheckState.IN_PDF for number, pdf in pdfs.items() if pdf.own}
    parts: dict[Where, CheckedPart] = {}
    for name, entry, asked_for in asked_cells(masters, catalogue):
        for where in asked_for:
            in_words = texts.get(where) or in_pdf.get(entry.question) or CheckState.EMPTY
            state = in_words if entry.in_words else _state(where, run, home, why)
            cause = why.roots.get(where) or why.missing.get(where)
            parts.setdefault(where, CheckedPart(name, *where, state, cause if state is CheckState.MISSING else None))
    return Checked(
        student,
        folder,
        tuple(parts.values()),
        problems=(*work.problems, *elsewhere, *unread),
        stops=why.stops,
        unlike=tuple(_unlike({at: part for at, part in parts.items() if part.notebook not in away}, home, why)),
        notes=(
            *(note for name, changed in merged.changes.items() for note in _of_changes(name, changed)),
            *work.notes,
            *([incomparable] if incomparable else []),
            *_of_versions(work.hand_in.course),
            *(
                replace(note, where=name)
                for name, of in written.items()
                for note in (*of.problems, *of.notes, *of.asked)
            ),
            *_foreign(work, merged),
            *_of_reports(work, pdfs.values(), catalogue),
            *why.harmless,
        ),
        seconds=time.monotonic() - begun,
    )


# --- the run, and what was recorded at home ---------------------------------------------------------------------------


def _run(
    work: StudentFolder,
    merged: Merged,
    student: str,
    masters: Mapping[str, dict[str, Any]],
    cell_timeout: float,
    report: Callable[[str], None],
) -> tuple[bytes | None, CellReports]:
    """Run in a copy of the folder; return what was recorded, and what became of cells."""
    with tempfile.TemporaryDirectory(prefix="labcourse-check-", ignore_cleanup_errors=True) as scratch:
        place = Path(scratch)
        for name, content in work.hand_in.files.items():
            (place / name).parent.mkdir(parents=True, exist_ok=True)
            (place / name).write_bytes(content)
        if work.hand_in.course:
            about = {**work.hand_in.course, course_file.STUDENT_KEY: student}
            (place / COURSE_FILE).write_text(course_file.text(about), encoding="utf-8")
        options: dict[str, Any] = {"parameters": {"student": student}, "imports": notebooks.imports_of(masters)}
        execute.run(merged.notebooks, place, cell_timeout=cell_timeout, report=report, **options)
        log, recorded = place / REPORTS_FILE, place / ANSWERS_FILE
        reports = schema.read_reports(files.read(log) if log.exists() else b"")
        return (files.read(recorded) if recorded.exists() else None), reports


def _parsed(data: bytes | None) -> tuple[Mapping[str, Any], str]:
    """Parse an ``answers.json``, of the run or of the student; return an empty mapping and why if that fails."""
    try:
        return (answers.parse(data) if data is not None else {}), ""
    except AnswerError as error:
        return {}, str(error)


def _at_home(work: StudentFolder, student: str) -> tuple[Mapping[str, Any], Problem | None]:
    """Return what the student recorded at home, and a note if there is nothing to compare with."""
    home, problem = _parsed(work.hand_in.claim)
    if problem:
        return {}, Problem.of(Code.HOME_ANSWERS_UNREAD, ANSWERS_FILE, error=problem)
    if not home:
        return {}, Problem.of(Code.HOME_ANSWERS_ABSENT, ANSWERS_FILE)
    if caseless(home["student"]) != caseless(student):
        return {}, Problem.of(Code.HOME_ANSWERS_OF_ANOTHER, ANSWERS_FILE, student=home["student"])
    return home, None


def _state(where: Where, run: Mapping[str, Any], home: Mapping[str, Any], why: Reasons) -> CheckState:
    """Compare what the run recorded of a part with what the student recorded."""
    now, before = (content.get("answers", {}).get(where[0], {}).get(where[1]) for content in (run, home))
    if now is None:  # of what nobody has begun it is not reported that it builds on others
        is_begun = where in why.begun or before is not None
        return CheckState.MISSING if where in why.missing and is_begun else CheckState.EMPTY
    is_same_trial = now.get("kind") != "function" or run["probe_seed"] == home.get("probe_seed")
    return (
        CheckState.DIFFERENT if before is not None and is_same_trial and not alike(now, before) else CheckState.RECORDED
    )


def alike(first: Any, second: Any, scale: float = 0.0) -> bool:
    """Return whether two pieces of plain data are equal, numbers to within :data:`CLOSE`.

    That is relative to the larger first, or to the largest number beside them in a list, or to ``scale``.
    """
    if _is_number(first) and _is_number(second):
        return bool(abs(first - second) <= CLOSE * max(abs(first), abs(second), scale))
    if type(first) is not type(second):
        return False
    if isinstance(first, dict):
        return first.keys() == second.keys() and all(alike(first[key], second[key]) for key in first)
    if isinstance(first, list):
        largest = max((abs(number) for number in (*first, *second) if _is_number(number)), default=scale)
        return len(first) == len(second) and all(alike(a, b, largest) for a, b in zip(first, second, strict=True))
    return bool(first == second)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


# --- what else is worth knowing ---------------------------------------------------------------------------------------


def _unlike(parts: Mapping[Where, CheckedPart], home: Mapping[str, Any], why: Reasons) -> Iterator[Problem]:
    """Yield what to do about answers of a cell that the saved notebooks do not give, though nothing stopped."""
    cells = home.get("cells", {})
    unlike = {
        f"{part.question} in {part.notebook}": None
        for where, part in parts.items()
        if part.state is CheckState.DIFFERENT
        or (part.state is CheckState.MISSING and cells.get(part.question, {}).get(part.name) and where not in why.roots)
    }
    if unlike:
        yield Problem.of(Code.ANSWERS_UNLIKE, answers=[*unlike])


def _of_changes(name: str, changes: Sequence[Change]) -> Iterator[Problem]:
    """Yield what happened to the course's cells in a notebook, and to answer cells that are text cells now."""
    yield from (replace(change.problem, where=name) for change in changes if change.is_turned_code)
    others = [change for change in changes if not change.is_turned_code]
    if cells := [(what, ids) for what, ids in cells_by_change(others).items() if ids]:
        yield Problem.of(Code.CELLS_CHANGED, name, cells=cells, number=name.partition("_")[0])


def _of_versions(course: Mapping[str, Any]) -> Iterator[Problem]:
    """Yield that work was begun under another release than the installed one, and that an older Python grades it."""
    begun, here = course.get(course_file.RELEASE_KEY), notebooks.release()
    if here and isinstance(begun, str) and begun != here:
        yield Problem.of(Code.OTHER_RELEASE_BEGUN, begun=begun[:80], here=here)
    grader = portability.version(course.get(course_file.PYTHON))
    if grader is not None and grader < portability.HERE:
        ours, theirs = map(portability.version_text, (portability.HERE, grader))
        yield Problem.of(Code.OLDER_PYTHON_GRADES, here=ours, there=theirs)


def _foreign(work: StudentFolder, merged: Merged) -> Iterator[Problem]:
    """Yield a note on each module and each file that is here and may be missing elsewhere."""
    sources = [*_own_code(work, merged)]
    own = {name.partition("/")[0].partition(".")[0] for name in work.hand_in.files}
    packages = (labcourse.__name__, courses.current().package.partition(".")[0])
    for name in portability.foreign((source for _name, source in sources), own, packages):
        yield Problem.of(Code.MODULE_NOT_OF_COURSE, module=name)
    packed = {*work.hand_in.files, *work.hand_in.reports, *work.hand_in.notebooks, ANSWERS_FILE, COURSE_FILE}
    left = ((place, name) for place, code in sources for name in portability.not_packed(code, work.folder, packed))
    for place, name in dict.fromkeys(left):
        yield Problem.of(Code.FILE_NOT_HANDED_IN, place, file=name)


def _own_code(work: StudentFolder, merged: Merged) -> Iterator[tuple[str, str]]:
    """Yield the student's own code, cells and modules: file name and source."""
    for name, notebook in merged.notebooks.items():
        yield from ((name, source_of(cell)) for cell in notebook["cells"] if merge.role_of(cell) is not Role.LOCKED)
    for name, content in work.hand_in.files.items():
        if name.endswith(".py"):
            yield name, content.decode(errors="replace")


def _of_reports(work: StudentFolder, pdfs: Iterable[ReportFile], catalogue: Catalogue) -> Iterator[Problem]:
    """Yield notes on the reports that are handed in as PDF."""
    for pdf in pdfs:
        yield pdf.note
        notebook = catalogue.reports[pdf.report].notebook
        keyword = report_files.keyword(work.hand_in.notebooks.get(f"{notebook}.ipynb", ()))
        if pdf.own:
            yield Problem.of(Code.OWN_REPORT_READ, pdf.report, name=pdf.name)
        elif keyword.encode() not in work.hand_in.reports[pdf.name]:
            yield Problem.of(Code.REPORT_OUT_OF_DATE, pdf.name, notebook=notebook)
