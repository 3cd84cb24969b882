"""A student's work, run at home as grading runs it: what is recorded, what is not, and why. Nothing is marked.

The notebooks as they were saved are put into the course's frame and run from the first cell to the last, in a copy of
the folder. There is no sandbox: it is the student's own code, on their own machine.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any

import labcourse
from labcourse import course_file, courses, files, program, released
from labcourse.answers import (
    answers,
    report_files,
    schema,
    words,
)
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.cell_reports import REPORTS_FILE, Reports
from labcourse.errors import AnswerError
from labcourse.files import ANSWERS_FILE, COURSE_FILE
from labcourse.run import (
    alignment,
    execute,
    merge,
    portability,
    reasons,
    reports_along,
    student_folder,
)
from labcourse.run.alignment import Change, Role
from labcourse.run.alike import alike
from labcourse.run.asked import Asked, Where, asked
from labcourse.run.execute import Broken, Report
from labcourse.run.merge import Merged
from labcourse.run.reasons import Claim
from labcourse.run.student_folder import Work
from labcourse.student_id import caseless

_ROUGHLY = 2.0  # s by which the clocks of files may differ from ours


class State(StrEnum):
    """What became of a part of a question."""

    RECORDED = "recorded"
    WRITTEN = "written"  # an answer in words
    IN_PDF = "in a PDF"  # of the student's own: a text of a report
    DIFFERENT = "different"  # from what was recorded at home
    MISSING = "missing"  # and there is something to say of it
    EMPTY = "empty"


GOOD = (State.RECORDED, State.WRITTEN, State.IN_PDF)


@dataclass(frozen=True)
class Part:
    """A part of a question, and what became of it."""

    notebook: str
    question: str
    name: str
    state: State
    why: str = ""


@dataclass(frozen=True)
class Checked:
    """What a check found.

    Attributes
    ----------
    student, folder : whose work, and where
    parts : all that is asked, in the notebooks' order
    stops : what stopped, and what builds on it, a sentence each
    lost : what was recorded at home and is not here, though nothing stopped; a sentence each
    changes : notebook's file name → what happened to cells of the course's
    unsaved : notebook's file name → a sentence, where something was recorded after it was saved
    problems : what could not be read or run
    notes : what is worth knowing
    seconds : that it took
    """

    student: str
    folder: Path
    parts: tuple[Part, ...]
    stops: tuple[str, ...] = ()
    lost: tuple[str, ...] = ()
    changes: Mapping[str, tuple[Change, ...]] = field(default_factory=dict)
    unsaved: Mapping[str, str] = field(default_factory=dict)
    problems: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    seconds: float = 0.0

    @property
    def good(self) -> bool:
        """Whether all that is asked is there, as it is on the page."""
        return not self.problems and all(part.state in GOOD for part in self.parts)

    @property
    def questions(self) -> dict[str, bool]:
        """Question → whether all of its parts are there."""
        found: dict[str, bool] = {}
        for part in self.parts:
            found[part.question] = found.get(part.question, True) and part.state in GOOD
        return found


@dataclass(frozen=True)
class _Home:
    """What a student's own ``answers.json`` says."""

    answers: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    seed: int | None = None
    when: Mapping[str, Mapping[str, int]] = field(default_factory=dict)
    claim: Claim | None = None
    note: str = ""


def check(
    folder: Path,
    masters: Mapping[str, dict[str, Any]],
    catalogue: Catalogue,
    *,
    student: str = "",
    cell_timeout: float = execute.CELL_TIMEOUT,
    report: Report = lambda name, done, of: None,
) -> Checked:
    """Run a student's saved notebooks as grading does, and compare with what they recorded.

    Parameters
    ----------
    folder : the student's, with the notebooks in it
    masters : file name → notebook as handed out
    catalogue : of the course
    student : whose bench to use; else the student of the folder
    cell_timeout : what a cell may take, s
    report : told as the run goes on, see :data:`labcourse.run.execute.Report`

    Raises
    ------
    CheckError
        If the ID cannot be one, or nothing can be run here.
    """
    begun = time.monotonic()
    work = student_folder.read(folder, list(masters), released.packages_of(masters), catalogue)
    student = student_folder.student_of(work, student)
    merged = merge.merged(masters, work.hand_in.notebooks)
    data, reports, broken = _run(work, merged, student, released.imports_of(masters), cell_timeout, report)
    found, unreadable = _answers(data)
    home = _home(work, student)
    written = {
        name: words.written(master["cells"], work.hand_in.notebooks.get(name, ()), work.hand_in.files)
        for name, master in masters.items()
    }
    why = reasons.explain(
        masters,
        merged,
        reports,
        {(question, part) for question, parts in found.items() for part in parts},
        catalogue,
        handed_in=work.hand_in.notebooks,
        claim=home.claim,
        seconds=cell_timeout,
        place="here",
    )
    along = report_files.of_files(work.hand_in.reports, catalogue)
    own = {number for number, one in along.items() if one.own}
    parts = tuple(
        _part(one, written[one.notebook].words, (found, _seed(data)), home, why.missing.get(one.where, ""), own)
        for one in asked(masters, merged, catalogue)
    )
    changes = {name: changed for name, changed in merged.changes.items() if changed}
    return Checked(
        student,
        folder,
        parts,
        why.stops,
        why.lost,
        changes,
        _unsaved(parts, work.saved, home),
        (*work.problems, *unreadable, *_broken(broken), *_too_new(work, merged)),
        (
            *work.notes,
            *filter(None, (home.note, _other_release(work))),
            *(f"{name}: {one}" for name, of in written.items() for one in (*of.problems, *of.notes, *of.asked)),
            *_foreign(work, merged),
            *reports_along.notes(
                work, along, {(one.question, one.name) for one in parts if one.state is State.WRITTEN}, catalogue
            ),
            *why.harmless,
        ),
        time.monotonic() - begun,
    )


# --- the run ----------------------------------------------------------------------------------------------------------


def _run(
    work: Work, merged: Merged, student: str, imports: Sequence[str], cell_timeout: float, report: Report
) -> tuple[bytes | None, Reports, tuple[Broken, ...]]:
    """Run in a copy of the folder: what was recorded, what became of cells, and which did not end by themselves."""
    with tempfile.TemporaryDirectory(prefix="labcourse-check-", ignore_cleanup_errors=True) as scratch:
        place = Path(scratch)
        for name, content in work.hand_in.files.items():
            (place / name).parent.mkdir(parents=True, exist_ok=True)
            (place / name).write_bytes(content)
        if work.hand_in.course:
            about = {**work.hand_in.course, course_file.STUDENT: student}
            (place / COURSE_FILE).write_text(course_file.text(about), encoding="utf-8")
        log = place / REPORTS_FILE

        def begin(name: str) -> str:
            return f"import labcourse.answers.cell_reports as _r; _r.begin({str(log)!r}, {name!r}); del _r"

        broken = execute.run(
            merged.notebooks,
            place,
            parameters={"student": student},
            imports=imports,
            first=begin,
            cell_timeout=cell_timeout,
            report=report,
        )
        reports = schema.read_reports(files.read(log) if log.exists() else b"")
        recorded = place / ANSWERS_FILE
        return (files.read(recorded) if recorded.exists() else None), reports, broken


def _answers(data: bytes | None) -> tuple[Mapping[str, Mapping[str, Any]], tuple[str, ...]]:
    """What a run recorded, and why it cannot be read."""
    if data is None:
        return {}, ()
    try:
        return answers.parse(data)["answers"], ()
    except AnswerError as error:
        return {}, (f"What the run recorded cannot be read. {error}",)


def _seed(data: bytes | None) -> int | None:
    try:
        return int(answers.parse(data)["probe_seed"]) if data is not None else None
    except AnswerError:
        return None


def _broken(broken: Sequence[Broken]) -> Iterator[str]:
    for one in broken:
        if one.how == execute.EXITED:
            yield f"{one.notebook}: the cell {one.cell} ends Python (exit); nothing after it was run."


def _home(work: Work, student: str) -> _Home:
    """What was recorded at home."""
    if work.hand_in.claim is None:
        return _Home(
            note=f"There is no {ANSWERS_FILE} here: nothing was recorded on the page. That costs no points, for your "
            "notebooks are run anew. But what they answer then cannot be compared with what you saw."
        )
    try:
        content = answers.parse(work.hand_in.claim)
    except AnswerError as error:
        return _Home(note=f"{ANSWERS_FILE} cannot be compared with. {error}")
    if caseless(content["student"]) != caseless(student):
        return _Home(note=f"{ANSWERS_FILE} holds the answers of {content['student'][:40]!r}, and is not compared with.")
    return _Home(content["answers"], content["probe_seed"], content.get("when", {}), Claim(content["cells"]))


# --- what it means ----------------------------------------------------------------------------------------------------


def _part(
    asked_for: Asked,
    written: Mapping[Where, Any],
    recorded: tuple[Mapping[str, Mapping[str, Any]], int | None],
    home: _Home,
    why: str,
    own_documents: Collection[str] = (),
) -> Part:
    """What became of a part. Of one that nobody has begun it is not told that it builds on others."""
    (question, name), (found, seed) = asked_for.where, recorded

    def is_(state: State, why: str = "") -> Part:
        return Part(asked_for.notebook, question, name, state, why)

    if asked_for.in_words and asked_for.where in written:
        return is_(State.WRITTEN)
    if asked_for.in_words:
        return is_(State.IN_PDF if question in own_documents else State.EMPTY)
    now, before = found.get(question, {}).get(name), home.answers.get(question, {}).get(name)
    if now is None:
        return is_(State.MISSING, why) if why and (asked_for.begun or before is not None) else is_(State.EMPTY)
    if before is None or alike(now, before) or (now.get("kind") == "function" and seed != home.seed):
        return is_(State.RECORDED)
    return is_(State.DIFFERENT)


def _unsaved(parts: Sequence[Part], saved: Mapping[str, float], home: _Home) -> dict[str, str]:
    """Notebooks in which something was recorded after they were saved."""
    latest: dict[str, tuple[float, Part]] = {}
    for part in parts:
        when = home.when.get(part.question, {}).get(part.name)
        if when is not None and when > latest.get(part.notebook, (0.0, part))[0]:
            latest[part.notebook] = when, part
    return {
        name: (
            f"was saved at {_clock(saved[name])}, and {part.question} was recorded at {_clock(when)}: save it "
            "(Ctrl+S), and check again"
        )
        for name, (when, part) in latest.items()
        if name in saved and when > saved[name] + _ROUGHLY
    }


def _other_release(work: Work) -> str:
    """A word on work that was begun under another release than the one that is installed; "" else."""
    begun, here = work.hand_in.course.get(course_file.RELEASE), released.release()
    if not here or not isinstance(begun, str) or begun == here:
        return ""
    return (
        f"This folder was begun with release {begun[:80]} of the course, and is checked with {here}, which is "
        f"installed. Started once more, {program.name()} lab brings the folder to it, and touches no answer."
    )


def _clock(seconds: float) -> str:
    return time.strftime("%H:%M:%S" if time.time() - seconds < 43_200 else "%Y-%m-%d %H:%M", time.localtime(seconds))


def _too_new(work: Work, merged: Merged) -> Iterator[str]:
    """Yield a message on each piece of code that the older Python which grades cannot read."""
    grader = portability.version(work.hand_in.course.get(course_file.PYTHON))
    if grader is None or grader >= portability.HERE:
        return
    here, there = map(portability.in_words, (portability.HERE, grader))
    for name, source in _own_code(work, merged):
        why = portability.too_new(source, grader)
        if why is not None:
            yield (
                f"{name}: your Python is {here}, and Python {there}, which grades, cannot read any of the code that "
                f"begins with {source.strip().splitlines()[0][:80]!r}: {why[:200]}. Write that for {there}."
            )


def _packages() -> tuple[str, str]:
    """Return the packages that bring what a course's work may import."""
    return labcourse.__name__, courses.current().package.partition(".")[0]


def _foreign(work: Work, merged: Merged) -> Iterator[str]:
    """Yield a message on each module and each file that is here and may be missing elsewhere."""
    sources = [*_own_code(work, merged)]
    files = work.hand_in.files
    own = {name.partition("/")[0].partition(".")[0] for name in files}
    for name in portability.foreign((source for _name, source in sources), own, _packages()):
        yield (
            f"{name} does not come with the course: it may be missing where your work is graded. Ask your "
            "instructor, or do without it."
        )
    packed = {*files, *work.hand_in.reports, *work.saved, ANSWERS_FILE, COURSE_FILE}
    left = ((place, name) for place, one in sources for name in portability.not_packed(one, work.folder, packed))
    for place, name in dict.fromkeys(left):
        yield (
            f"{place} names the file {name!r}, which is not handed in: put it beside your notebooks, and name it as "
            "it is called there."
        )


def _own_code(work: Work, merged: Merged) -> Iterator[tuple[str, str]]:
    """Yield the student's own code, cells and modules: file name and source."""
    for name, notebook in merged.notebooks.items():
        for cell in notebook["cells"]:
            if merge.role_of(cell) is not Role.LOCKED:
                yield name, alignment.source_of(cell)
    for name, content in work.hand_in.files.items():
        if name.endswith(".py"):
            yield name, content.decode(errors="replace")
