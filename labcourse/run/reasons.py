"""Explain why answers are missing after a run: what stopped, what builds on it, and what was recorded at home.

For each answer that was not recorded, the cells are examined from the one that recorded the answer before it. If one of
them stopped, the cause is sought upwards: in earlier cells that stopped and bind a name which this one uses, and in
earlier answers that it asked for. All of this is taken from claims of the run, and used for explanations alone.

A reason is given under these facts, and not without them. Above a cell are those that bind the names that it uses.
"Reported" is what the run wrote down; "at home" is what the ``answers.json`` that was handed in has.

====================  ==================================================================================================
code                  facts
====================  ==================================================================================================
REFUSED               reported: the answer was refused
BUILDS_ON_REFUSED     reported of that one; a cell beside or above this one asked for it
BUILDS_ON_UNANSWERED  that one is missing; a cell beside or above this one asked for it, or stopped on its name
CELL_STOPPED          reported: an error stopped this cell, beside the answer
BUILDS_ON_STOPPED     reported: an error stopped that cell, above one beside the answer
TOOK_TOO_LONG         reported: an interrupt; and the runner stopped a cell or the run
PYTHON_ENDED          reported: this cell began; its end is not
LEFT_AS_IT_WAS        reported: it had no value; no code for it is written in the notebook
RUN_AND_EMPTY         reported: it had no value; code for it is written in the notebook
NOTEBOOK_NOT_THERE    at home; the notebook is not among those that were handed in and read
NOTHING_LEFT          at home; not reported that it had no value
NO_CELL_KNOWN         at home, without a cell's id; reported: it had no value
CELL_NOT_AMONG        at home, by a cell that is not in the run; reported: it had no value
RUN_LEAVES_EMPTY      at home, by a cell that is in the run; reported: it had no value
====================  ==================================================================================================

Where none applies, marking says that there is no answer, and no more (:mod:`labcourse.grading.marking.marking`).
"""

from __future__ import annotations

from bisect import bisect_left
from collections import deque
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import islice
from typing import Any

from labcourse.answers.catalogue import Catalogue
from labcourse.answers.cell_reports import LEFT, CellReport, CellReports
from labcourse.patterns import pattern
from labcourse.problems import Code, Problem, Where
from labcourse.run import skippable_cells
from labcourse.run.alignment import Role, asked_cells, source_of
from labcourse.run.merge import Merged, role_of
from labcourse.run.portability import HERE, Version, version_text

_UNDEFINED = pattern(r"name '(\w+)' is not defined")
_NO_MODULE = pattern(r"No module named '([\w.]+)'")
#: Errors of a cell that uses a name without a value: a name that is not defined, or is None.
_OF_NO_VALUE = {"NameError", "TypeError", "AttributeError", "ValueError", "IndexError", "LinAlgError", "UFuncTypeError"}
_NOTHING = pattern(r"\b(NoneType|ellipsis)\b")
_BINDS_UNSEEN = ("import *", "%")  # in a cell's source: it may bind names that are not written in it
_MOST = 20  # cells, and parameters, that are mentioned though they cost nothing

#: From a student's own ``answers.json``: question → part → id of the cell that recorded the answer; "" if none did.
CellIdsAtHome = Mapping[str, Mapping[str, str]]


@dataclass(frozen=True)
class Reasons:
    """What there is to say about missing answers.

    Attributes
    ----------
    missing : (question, part) → why, for the student; only if there is more to say than that it is missing
    roots : (question, part) → what stopped and cost this answer; the same for all that it cost
    stops : what stopped, and what builds on it
    lost : what was recorded at home and is not here, though nothing stopped
    harmless : what stopped and cost no answer, and parameters that changed nothing
    begun : (question, part) of what the student wrote code for, or what needs none of theirs
    """

    missing: Mapping[Where, Problem]
    roots: Mapping[Where, Problem] = field(default_factory=dict)
    stops: tuple[Problem, ...] = ()
    lost: tuple[Problem, ...] = ()
    harmless: tuple[Problem, ...] = ()
    begun: frozenset[Where] = frozenset()


def explain(
    pristine: Mapping[str, dict[str, Any]],
    merged: Merged,
    reports: CellReports,
    recorded: Collection[Where],
    catalogue: Catalogue,
    *,
    handed_in: Collection[str],
    claim: CellIdsAtHome | None = None,
    seconds: float | None = None,
    at_home: bool = False,
    python: Version | None = None,
) -> Reasons:
    """Explain why answers are missing.

    Parameters
    ----------
    pristine : file name → notebook as released
    merged : what was run
    reports : on its cells
    recorded : (question, part) of what was recorded
    catalogue : of the course
    handed_in : file names of the notebooks that were handed in
    claim : what was recorded at home; None if it is not known
    seconds : time limit of a cell
    at_home : whether it was run on the student's computer
    python : version that the notebooks were saved with, if it is known
    """
    run = Causes(pristine, merged, reports, set(recorded), catalogue)
    make = _Maker(run, seconds, at_home, python or HERE)
    away = {where for where in run.missing() if run.recorder[where][0] not in handed_in and not run.is_begun(where)}
    causes = {where: None if where in away else run.cause_of(where) for where in run.missing()}
    built_on: dict[RunCell, list[str]] = {}
    stopping = {where: cause for where, cause in causes.items() if isinstance(cause, RunCell)}
    for where, cell in stopping.items():
        built_on.setdefault(cell, []).append(where[0])
    lost = _lost(run, claim, causes, handed_in) if claim else {}
    missing = {where: why for where, cause in causes.items() if (why := make.of_missing(where, cause))}
    missing |= {where: Problem.of(Code.MISSING_HERE, why=why) for where, why in lost.items() if where not in missing}
    for where in causes:
        if where in run.empty and run.recorder[where][0] in handed_in:
            empty = Code.RUN_AND_EMPTY if run.is_begun(where) else Code.LEFT_AS_IT_WAS
            missing.setdefault(where, Problem.of(empty))
    by_reason: dict[Problem, list[str]] = {}
    for (question, part), why in lost.items():
        by_reason.setdefault(why, []).append(f"{question} {part}")
    stopped = [cell for cells in run.cells.values() for cell in cells if cell.stopped]
    # A cell that stopped beside a missing answer with a cause is not named again.
    beside = {cell for where, cause in causes.items() if cause or where in away for cell in run.cells_of(where)}
    aside = [cell for cell in stopped if cell not in beside and cell not in built_on]
    said = ((cell, problem) for cell in aside if (problem := make.of_harmless(cell)))
    harmless = dict(islice(said, _MOST))
    unused = [one for one in reports.unused[:_MOST] if one[0] in run.cells]
    return Reasons(
        missing,
        {where: make.of_cell(Code.CELL_STOPPED, cell) for where, cell in stopping.items()},
        tuple(make.of_stop(cell, questions) for cell, questions in built_on.items()),
        tuple(Problem.of(Code.RECORDED_AT_HOME, parts=parts, why=why) for why, parts in by_reason.items()),
        (
            *harmless.values(),
            *(Problem.of(Code.NAME_NOT_USED, where, name=name, value=value) for where, name, value in unused),
        ),
        frozenset(filter(run.is_begun, run.recorder)),
    )


def _lost(
    run: Causes, claim: CellIdsAtHome, causes: Mapping[Where, Cause], handed_in: Collection[str]
) -> dict[Where, Problem]:
    """Return what is claimed, and missing though nothing stopped: (question, part) → why."""
    lost = {}
    for where, cause in causes.items():
        cell = claim.get(where[0], {}).get(where[1])
        if cell is None or isinstance(cause, RunCell | RefusedAnswer):
            continue
        notebook = run.recorder[where][0]
        if notebook not in handed_in:
            lost[where] = Problem.of(Code.NOTEBOOK_NOT_THERE, notebook)
        elif where not in run.empty:
            lost[where] = Problem.of(Code.NOTHING_LEFT, notebook)
        elif not cell:
            lost[where] = Problem.of(Code.NO_CELL_KNOWN, notebook)
        elif all(cell != other.id for other in run.cells[notebook]):
            lost[where] = Problem.of(Code.CELL_NOT_AMONG, notebook, cell=cell[:64])
        else:
            lost[where] = Problem.of(Code.RUN_LEAVES_EMPTY, notebook)
    return lost


@dataclass(frozen=True)
class _Maker:
    """Makes the problems about causes."""

    run: Causes
    seconds: float | None
    at_home: bool
    python: Version

    def of_missing(self, where: Where, cause: Cause) -> Problem | None:
        """Return why one answer is missing, for the student."""
        match cause:
            case RefusedAnswer() if cause.where == where:
                return Problem.of(Code.REFUSED, why=cause.why)
            case RefusedAnswer():
                return Problem.of(Code.BUILDS_ON_REFUSED, on=cause.where[0], why=cause.why)
            case Unanswered():
                return Problem.of(Code.BUILDS_ON_UNANSWERED, on=cause.question)
            case RunCell():
                is_own = self.run.question_of(cause) == where[0]
                return self.of_cell(Code.CELL_STOPPED if is_own else Code.BUILDS_ON_STOPPED, cause)
        return None

    def of_stop(self, cell: RunCell, questions: Sequence[str]) -> Problem:
        """Return what stopped, and which questions build on it."""
        building = [question for question in dict.fromkeys(questions) if question != self.run.question_of(cell)]
        return self.of_cell(Code.CELL_STOPPED, cell, **({"building": building} if building else {}))

    def of_harmless(self, cell: RunCell) -> Problem | None:
        """Return that a cell stopped beside which no answer is missing; None if another problem says what caused it."""
        cause = self.run.root(cell)
        if isinstance(cause, RunCell):
            if cause is not cell:
                return None
            cause = next((Unanswered(where[0]) for where in self.run.without_value(cell, anywhere=True)), None)
        match cause:
            case Unanswered():
                return self.of_cell(Code.STOPPED_ON_UNANSWERED, cell, on=cause.question)
            case RefusedAnswer():
                return self.of_cell(Code.STOPPED_ON_REFUSED, cell, on=cause.where[0], refusal=cause.why)
        return self.of_cell(Code.STOPPED_WITHOUT_COST, cell)

    def of_cell(self, code: Code, cell: RunCell, **more: Any) -> Problem:
        """Return that a cell stopped, and why."""
        is_recorder = cell.role is not Role.ADDED and cell.place in self.run.questions.get(cell.notebook, ())
        about = {"cell": cell.id, "notebook": cell.notebook, "role": "recorder" if is_recorder else cell.role}
        return Problem.of(code, **about, question=self.run.question_of(cell), why=self._why(cell), **more)

    def _why(self, cell: RunCell) -> Problem:
        error = cell.report.error if cell.report else None
        if error is None:
            return Problem.of(Code.PYTHON_ENDED)
        if error.type == LEFT:
            return Problem.of(Code.LEFT_PYTHON)
        text = " ".join(error.message.split()).rstrip(".")
        code, about = Code.RAISED, dict[str, Any](type=error.type, text=text)
        no_module = _NO_MODULE.search(text)
        if error.type == "KeyboardInterrupt" and self.seconds is not None:
            code, about = Code.TOOK_TOO_LONG, {"seconds": self.seconds}
        elif error.type == "FileNotFoundError":
            code = Code.FILE_NOT_FOUND
        elif error.type == "ModuleNotFoundError" and no_module:
            code, about = Code.MODULE_MISSING, {"module": no_module[1], "at_home": self.at_home}
        elif error.type == "LimitExceeded":
            code, about = Code.BENCH_STOPPED, {"text": text}
        elif error.type == "StdinNotImplementedError":  # of input(), or of a debugger
            code, about = Code.INPUT_NEEDED, {}
        elif cell.written and error.type in ("TypeError", "AttributeError") and _NOTHING.search(text):
            code = Code.NONE_USED
        elif error.type == "SyntaxError" and self.python > HERE:
            code = Code.NEWER_PYTHON_NEEDED
            about |= {"needed": version_text(self.python), "here": version_text(HERE)}
        return Problem.of(code, line=error.line, **about)


# --- what stopped first -----------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class RunCell:
    """A cell of a run, in its place."""

    notebook: str
    place: int
    id: str
    role: Role
    source: str
    report: CellReport | None
    readable: bool  # whether its names can be looked at
    written: bool  # whether the student wrote something in it

    @property
    def stopped(self) -> bool:
        """Whether an error stopped it, or it did not come to its end."""
        return self.report is not None and (self.report.error is not None or not self.report.finished)

    @property
    def ended_all(self) -> bool:
        """Whether nothing after it was run."""
        report = self.report
        return report is not None and (not report.finished or (report.error is not None and report.error.type == LEFT))

    @cached_property
    def binds(self) -> frozenset[str]:
        """The names that it binds."""
        return self._names(skippable_cells.bound)

    @cached_property
    def uses(self) -> frozenset[str]:
        """The names that it uses; if one of them was not defined, only that one."""
        error = self.report.error if self.report else None
        undefined = _UNDEFINED.search(error.message) if error and error.type == "NameError" else None
        return frozenset({undefined[1]}) if undefined else self._names(skippable_cells.uses)

    def _names(self, read: Callable[[str], frozenset[str]]) -> frozenset[str]:
        try:
            return read(self.source) if self.readable else frozenset()
        except skippable_cells.NO_PYTHON:
            return frozenset()


@dataclass(frozen=True)
class Unanswered:
    """An earlier answer that is missing, though nothing stopped."""

    question: str


@dataclass(frozen=True)
class RefusedAnswer:
    """An answer that was given and not recorded."""

    where: Where
    why: str


Cause = RunCell | Unanswered | RefusedAnswer | None


class Causes:
    """The cells of a run, and what stopped first.

    Parameters
    ----------
    pristine, merged, reports, recorded, catalogue : as for :func:`explain`

    Attributes
    ----------
    cells : file name of a notebook → its cells
    recorder : (question, part) → notebook of the cell that records it, and the cell's place
    questions : file name of a notebook → place of a cell that records → question
    empty : (question, part) of what had no value when its cell was run
    """

    def __init__(
        self,
        pristine: Mapping[str, dict[str, Any]],
        merged: Merged,
        reports: CellReports,
        recorded: set[Where],
        catalogue: Catalogue,
    ) -> None:
        self._catalogue, self._recorded = catalogue, recorded
        self._refusals = {(one.question, one.part): one.why for one in reports.refusals if one.why}
        self.empty = {(one.question, one.part) for one in reports.refusals if not one.why}
        by_cell = {(report.notebook, report.cell): report for report in reports.cells}
        self.cells: dict[str, list[RunCell]] = {}
        self.recorder: dict[Where, tuple[str, int]] = {}
        self.questions: dict[str, dict[int, str]] = {}
        self._variables: dict[str, list[Where]] = {}  # name of a variable → what is recorded from it
        for name, notebook in merged.notebooks.items():
            readable = skippable_cells.readable(map(source_of, notebook["cells"]))
            released = {cell["id"]: source_of(cell) for cell in pristine[name]["cells"]}
            self.cells[name] = []
            for index, cell in enumerate(notebook["cells"]):
                role, source, report = role_of(cell), source_of(cell), by_cell.get((name, cell["id"]))
                written = role is Role.ADDED or (role is Role.ANSWER and source != released.get(cell["id"]))
                self.cells[name].append(RunCell(name, index, cell["id"], role, source, report, readable, written))
        places = {(name, cell.id): cell.place for name, cells in self.cells.items() for cell in cells}
        for name, entry, asked_for in asked_cells(pristine, catalogue):
            if (place := places.get((name, entry.cell))) is not None and not entry.in_words:
                self.questions.setdefault(name, {})[place] = entry.question
                self.recorder |= dict.fromkeys(asked_for, (name, place))
                for where in asked_for:
                    if variable := (entry.names or {}).get(where[1]):
                        self._variables.setdefault(variable, []).append(where)
        self._causes: dict[Where, Cause] = {}
        self._roots: dict[RunCell, Cause] = {}

    def missing(self) -> list[Where]:
        """Return what was asked and not recorded, in the order in which it is asked."""
        questions = self._catalogue.everything.items()
        every = ((number, part) for number, question in questions for part in question.names)
        return [where for where in every if where in self.recorder and where not in self._recorded]

    def question_of(self, cell: RunCell) -> str:
        """Return the question whose answer is recorded next after a cell, or by it; "" if there is none."""
        places = self.questions.get(cell.notebook, {})
        return next((places[place] for place in sorted(places) if place >= cell.place), "")

    def cause_of(self, where: Where) -> Cause:
        """Return why an answer is missing; None if there is no more to say than that it is."""
        if where not in self._causes:
            self._causes[where] = None  # should it be asked for again on the way
            self._causes[where] = self._cause(where)
        return self._causes[where]

    def is_begun(self, where: Where) -> bool:
        """Return whether the student wrote code for an answer, or had none to write."""
        own = self.cells_of(where)
        return any(cell.written for cell in own) or all(cell.role is not Role.ANSWER for cell in own)

    def cells_of(self, where: Where) -> list[RunCell]:
        """Return the cells after the one that recorded the answer before, up to the one that records this one."""
        name, recorder = self.recorder[where]
        before = max((place for place in self.questions[name] if place < recorder), default=-1)
        return self.cells[name][before + 1 : recorder + 1]

    def _cause(self, where: Where) -> Cause:
        name, recorder = self.recorder[where]
        cells, beside = self.cells[name], self.cells_of(where)
        own = [cell for cell in beside if not cell.stopped or self._matters(cell, beside)]
        if (stopped := next((cell for cell in own if cell.stopped), None)) is not None:
            return self.root(stopped)
        if cells[recorder].report is None:  # it was never reached
            return next((cell for cell in reversed(cells[:recorder]) if cell.ended_all), None)
        for cell in self._upstream(own):
            lacked = self._lacked(cell, where)
            if lacked is not None or cell.stopped:
                return lacked or self.root(cell)
        return RefusedAnswer(where, self._refusals[where]) if where in self._refusals else None

    def _matters(self, cell: RunCell, own: Sequence[RunCell]) -> bool:
        """Return whether a stop beside an answer may have cost it: not if the student's own cell has no part in it."""
        others = [other for other in own if other.role is not Role.ADDED]
        begun = any(other.written or other.stopped for other in others)
        may_bind = any(text in cell.source for text in _BINDS_UNSEEN) or any(cell.binds & it.uses for it in others)
        return begun or may_bind or cell.ended_all or cell in others

    def root(self, cell: RunCell) -> Cause:
        """Return the first cause of the stop of a cell: the cell itself, or what it builds on."""
        passed = []
        cause: Cause = None
        while cause is None:
            passed.append(cell)
            cause = self._roots.get(cell) or self._lacked(cell)
            for earlier in () if cause else islice(self._upstream([cell]), 1, None):
                cause = self._lacked(earlier)
                if cause or earlier.stopped:
                    cell = earlier
                    break
            else:
                cause = cause or cell
        self._roots |= dict.fromkeys(passed, cause)
        return cause

    def without_value(self, cell: RunCell, anywhere: bool = False) -> Iterator[Where]:
        """Yield the missing answers from which a cell takes a name without a value, which stopped it.

        A cell of the course must not stop on a name that is None; such a stop is its own.

        Parameters
        ----------
        cell : that stopped
        anywhere : also look at answers that are asked for later, or in another notebook
        """
        error = cell.report.error if cell.report else None
        may_be = error and (error.type == "NameError" or (cell.written and error.type in _OF_NO_VALUE))
        for name in sorted(cell.uses) if may_be else ():
            for where in self._variables.get(name, ()):
                notebook, recorder = self.recorder[where]
                is_before = notebook == cell.notebook and self._bound_at(cell, name) <= recorder < cell.place
                has_none = where not in self._recorded and where not in self._refusals
                if has_none and (is_before or anywhere):
                    yield where

    def _upstream(self, cells: Sequence[RunCell]) -> Iterator[RunCell]:
        """Yield cells, and all that they build on by the names that they use: those that bound a name last."""
        seen = set(cells)
        waiting = deque(cells)
        yield from cells
        while waiting:
            cell = waiting.popleft()
            for name in sorted(cell.uses):
                place = self._bound_at(cell, name)
                binder = self.cells[cell.notebook][place] if place >= 0 else cell
                if binder not in seen:
                    seen.add(binder)
                    waiting.append(binder)
                    yield binder

    def _bound_at(self, cell: RunCell, name: str) -> int:
        """Return the place of the last cell before this one that binds a name; -1 if there is none."""
        places = self._binders[cell.notebook].get(name, [])
        before = bisect_left(places, cell.place)
        return places[before - 1] if before else -1

    @cached_property
    def _binders(self) -> dict[str, dict[str, list[int]]]:
        """Notebook → name → places of the cells that bind it."""
        binders: dict[str, dict[str, list[int]]] = {}
        for notebook, cells in self.cells.items():
            names = binders.setdefault(notebook, {})
            for cell in cells:
                for name in cell.binds:
                    names.setdefault(name, []).append(cell.place)
        return binders

    def _lacked(self, cell: RunCell, where: Where | None = None) -> Cause:
        """Return the cause that lies in an earlier answer which a cell asked for and did not get."""
        for needed in (*(cell.report.lacked if cell.report else ()), *self.without_value(cell)):
            if needed in self.recorder and needed not in self._recorded and needed != where:
                return self.cause_of(needed) or Unanswered(needed[0])
        return None
