"""Why answers are missing after a run: what stopped, what builds on it, and what was recorded at home all the same.

Of each answer that was not recorded, the cells are looked at from the one that recorded the answer before it. If one of
them stopped, the cause is sought upwards: in earlier cells that stopped and bind a name which this one uses, and in
earlier answers that it asked for. All of it is taken from claims of the run, and used for words alone.
"""

from __future__ import annotations

import re
from bisect import bisect_left
from collections import deque
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import islice
from typing import Any

from rotflex.courseware.catalogue import Catalogue
from rotflex.courseware.messages import _
from rotflex.courseware.run import skippable_cells
from rotflex.courseware.run.alignment import Role, source_of
from rotflex.courseware.run.cell_reports import LEFT, CellError, CellReport, Reports
from rotflex.courseware.run.merge import Merged, role_of
from rotflex.courseware.run.recorders import recorded as recorders_of

Where = tuple[str, str]  # question and part
_UNDEFINED = re.compile(r"name '(\w+)' is not defined")
_NO_MODULE = re.compile(r"No module named '([\w.]+)'")
_NAMED = 2  # questions that are named before "and 12 more"
_MOST_HARMLESS = 20  # cells that are told of though they cost nothing


@dataclass(frozen=True)
class Claim:
    """What a student's own ``answers.json`` says was recorded.

    Attributes
    ----------
    cells : question → part → id of the cell that recorded it; "" if none did
    knows_cells : whether the file says so at all; those of earlier versions do not
    """

    cells: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    knows_cells: bool = True


@dataclass(frozen=True)
class Reasons:
    """What there is to say of answers that are not there.

    Attributes
    ----------
    missing : (question, part) → why, for the student; only where there is more to say than that nothing was written
    stops : what stopped, a sentence each, and what builds on it
    lost : what was recorded at home and is not here, though nothing stopped; a sentence each
    harmless : what stopped, and cost no answer; a sentence each
    """

    missing: Mapping[Where, str]
    stops: tuple[str, ...] = ()
    lost: tuple[str, ...] = ()
    harmless: tuple[str, ...] = ()


def explain(
    pristine: Mapping[str, dict[str, Any]],
    merged: Merged,
    reports: Reports,
    recorded: Collection[Where],
    catalogue: Catalogue,
    *,
    handed_in: Collection[str],
    claim: Claim | None = None,
    seconds: float | None = None,
    place: str = _("where grading runs"),
) -> Reasons:
    """Why answers are missing.

    Parameters
    ----------
    pristine : file name → notebook as released
    merged : what was run
    reports : on its cells
    recorded : (question, part) of what was recorded
    catalogue : of the course
    handed_in : file names of the notebooks that were handed in
    claim : what was recorded at home; None if it is not known
    seconds : that a cell might take
    place : where it was run, as in "pandas is not installed ..."
    """
    words = _Words(seconds, place)
    run = _Run(pristine, merged, reports, set(recorded), catalogue)
    missing: dict[Where, str] = {}
    built: dict[_Cell, list[str]] = {}
    for where in run.missing():
        cause = run.cause_of(where)
        if isinstance(cause, _Cell):
            built.setdefault(cause, []).append(where[0])
        said = words.of_missing(run, where, cause)
        if said:
            missing[where] = said
    stops = tuple(words.of_stop(run, cell, list(dict.fromkeys(questions))) for cell, questions in built.items())
    stopped = {where for where in run.missing() if isinstance(run.cause_of(where), _Cell)}
    lost = _lost(run, claim, stopped, handed_in) if claim else {}
    for where, why in lost.items():
        missing.setdefault(where, _("It was recorded at home; {why}.").format(why=why))
    stopped_cells = [cell for cells in run.cells.values() for cell in cells if cell.stopped]
    harmless = [
        words.of_harmless(run, cell) for cell in stopped_cells if cell not in built and not run.is_passed_on(cell)
    ]
    return Reasons(missing, stops, tuple(_grouped(lost)), tuple(harmless[:_MOST_HARMLESS]))


# --- a run, and where it stopped --------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class _Cell:
    """A cell of a run, in its place."""

    notebook: str
    place: int
    id: str
    role: Role
    source: str
    report: CellReport | None
    readable: bool  # so that its names can be told

    @property
    def stopped(self) -> bool:
        return self.report is not None and (self.report.error is not None or not self.report.finished)

    @property
    def ended_all(self) -> bool:
        """Whether nothing after it was run."""
        report = self.report
        return report is not None and (not report.finished or (report.error is not None and report.error.type == LEFT))

    @cached_property
    def binds(self) -> set[str]:
        return _names(skippable_cells.bound, self.source) if self.readable else set()

    @cached_property
    def uses(self) -> set[str]:
        error = self.report.error if self.report else None
        undefined = _UNDEFINED.search(error.message) if error and error.type == "NameError" else None
        if undefined:
            return {undefined[1]}
        return _names(skippable_cells.uses, self.source) if self.readable else set()


def _names(read: Any, source: str) -> set[str]:
    try:
        return set(read(source))
    except (SyntaxError, ValueError, RecursionError, MemoryError):  # not Python alone, or too long
        return set()


@dataclass(frozen=True)
class _Unanswered:
    """An earlier answer that is missing, though nothing stopped."""

    question: str


@dataclass(frozen=True)
class _Refused:
    """An answer that was given and not taken."""

    why: str


_Cause = _Cell | _Unanswered | _Refused | None


class _Run:
    def __init__(
        self,
        pristine: Mapping[str, dict[str, Any]],
        merged: Merged,
        reports: Reports,
        recorded: set[Where],
        catalogue: Catalogue,
    ) -> None:
        self.catalogue, self.recorded = catalogue, recorded
        self.refusals = {(one.question, one.part): one.why for one in reports.refusals}
        by_cell = {(one.notebook, one.cell): one for one in reports.cells}
        self.cells: dict[str, list[_Cell]] = {}
        for name, notebook in merged.notebooks.items():
            cells = notebook["cells"]
            readable = skippable_cells.readable(map(source_of, cells))
            self.cells[name] = [
                _Cell(
                    name, place, cell["id"], role_of(cell), source_of(cell), by_cell.get((name, cell["id"])), readable
                )
                for place, cell in enumerate(cells)
            ]
        self.recorder: dict[Where, tuple[str, int]] = {}  # notebook, and place in it
        self.questions: dict[str, dict[int, str]] = {}  # notebook → place of a recorder → question
        for name, notebook in pristine.items():
            places = {cell.id: cell.place for cell in self.cells[name]}
            for one in recorders_of(notebook["cells"]):
                question = catalogue.everything.get(one.question)
                if question is None or one.cell not in places:
                    continue
                self.questions.setdefault(name, {})[places[one.cell]] = question.number
                for part in one.of(question):
                    self.recorder[question.number, part] = name, places[one.cell]
        self._causes: dict[Where, _Cause] = {}
        self._roots: dict[_Cell, _Cause] = {}

    def missing(self) -> list[Where]:
        """What was asked and not recorded, in the order in which it is asked."""
        asked = ((number, part) for number, question in self.catalogue.everything.items() for part in question.names)
        return [where for where in asked if where in self.recorder and where not in self.recorded]

    def question_of(self, cell: _Cell) -> str:
        """The question whose answer is recorded next after a cell, or by it; "" if there is none."""
        later = (place for place in sorted(self.questions.get(cell.notebook, ())) if place >= cell.place)
        place = next(later, None)
        return "" if place is None else self.questions[cell.notebook][place]

    def cause_of(self, where: Where) -> _Cause:
        """Why an answer is missing; None if there is no more to say than that it is."""
        if where not in self._causes:
            self._causes[where] = None  # should it be asked for again on the way
            self._causes[where] = self._cause(where)
        return self._causes[where]

    def _cause(self, where: Where) -> _Cause:
        name, recorder = self.recorder[where]
        cells = self.cells[name]
        before = max((place for place in self.questions[name] if place < recorder), default=-1)
        own = cells[before + 1 : recorder + 1]
        for cell in own:
            if cell.stopped:
                return self._root(cell)
        if cells[recorder].report is None:  # it was never come to
            return next((cell for cell in reversed(cells[:recorder]) if cell.ended_all), None)
        for cell in self._upstream(own):
            lacked = self._lacked(cell, where)
            if lacked is not None or cell.stopped:
                return lacked or self._root(cell)
        return _Refused(self.refusals[where]) if where in self.refusals else None

    def _root(self, cell: _Cell) -> _Cause:
        """The first cause of a cell's stop: itself, or what it builds on."""
        passed = []
        cause: _Cause = None
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

    def is_passed_on(self, cell: _Cell) -> bool:
        """Whether it was found that what stopped in a cell was caused elsewhere."""
        return self._roots.get(cell, cell) is not cell

    def _upstream(self, cells: Sequence[_Cell]) -> Iterator[_Cell]:
        """Cells, and all that they build on by the names that they use: those that bound a name last, and theirs."""
        found = set(cells)
        waiting = deque(cells)
        yield from cells
        while waiting:
            cell = waiting.popleft()
            for name in sorted(cell.uses):
                places = self._binders[cell.notebook].get(name, ())
                place = bisect_left(places, cell.place) - 1
                if place >= 0:
                    binder = self.cells[cell.notebook][places[place]]
                    if binder not in found:
                        found.add(binder)
                        waiting.append(binder)
                        yield binder

    @cached_property
    def _binders(self) -> dict[str, dict[str, list[int]]]:
        """Notebook → name → places of the cells that bind it."""
        found: dict[str, dict[str, list[int]]] = {}
        for notebook, cells in self.cells.items():
            names = found.setdefault(notebook, {})
            for cell in cells:
                for name in cell.binds:
                    names.setdefault(name, []).append(cell.place)
        return found

    def _lacked(self, cell: _Cell, where: Where | None = None) -> _Cause:
        """The cause that lies in an earlier answer which a cell asked for and did not get."""
        for needed in cell.report.lacked if cell.report else ():
            if needed in self.recorder and needed not in self.recorded and needed != where:
                return self.cause_of(needed) or _Unanswered(needed[0])
        return None


# --- in words ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Words:
    seconds: float | None
    place: str

    def of_missing(self, run: _Run, where: Where, cause: _Cause) -> str:
        """Why one answer is missing, for the student."""
        if isinstance(cause, _Refused):
            return _("It was given, and not recorded: {why}.").format(why=cause.why.rstrip("."))
        if isinstance(cause, _Unanswered):
            return _("It builds on {question}, which is not answered.").format(question=cause.question)
        if cause is None:
            return ""
        cell, error = self.name(run, cause), self.of_error(cause)
        if run.question_of(cause) == where[0]:
            return _("{cell} stopped: {error}.").format(cell=cell, error=error)
        return _("It builds on what stopped before it: {cell} ({error}).").format(cell=cell, error=error)

    def of_stop(self, run: _Run, cell: _Cell, questions: Sequence[str]) -> str:
        """What stopped, and all that builds on it, in a sentence."""
        own = run.question_of(cell)
        others = [question for question in questions if question != own]
        shown = _("{cell} stopped: {error}").format(cell=self.name(run, cell), error=self.of_error(cell))
        if not others:
            return f"{shown}."
        return _("{stop}; {others} on it.").format(stop=shown, others=_several(others, _("builds"), _("build")))

    def of_harmless(self, run: _Run, cell: _Cell) -> str:
        """What stopped, and cost nothing."""
        shown = _("{cell} stopped: {error}").format(cell=self.name(run, cell), error=self.of_error(cell))
        return _("{stop}; no answer is missing for it.").format(stop=shown)

    def name(self, run: _Run, cell: _Cell) -> str:
        """What a cell is called."""
        question = run.question_of(cell)
        if cell.role is Role.ADDED:
            if question:
                return _("Your own cell before {question}").format(question=question)
            return _("Your own cell {cell} in {notebook}").format(cell=cell.id, notebook=cell.notebook)
        if cell.role is Role.ANSWER or cell.place in run.questions.get(cell.notebook, ()):
            return question or cell.id
        return _("The course's cell {cell} in {notebook}").format(cell=cell.id, notebook=cell.notebook)

    def of_error(self, cell: _Cell) -> str:
        """What stopped a cell."""
        report = cell.report
        if report is None or report.error is None:
            return _("the Python process ended in it, and nothing after it in this notebook was run")
        error = report.error
        if error.type == LEFT:
            return _("it called exit(), which ends Python: nothing after it in this notebook was run")
        line = _(", line {line}").format(line=error.line) if error.line else ""
        if error.type == "KeyboardInterrupt" and self.seconds is not None:
            return _("it took longer than {seconds:g} s and was stopped{line}").format(seconds=self.seconds, line=line)
        return f"{self._what(error)}{line}"

    def _what(self, error: CellError) -> str:
        message = " ".join(error.message.split()).rstrip(".")
        no_module = _NO_MODULE.search(message)
        if error.type == "ModuleNotFoundError" and no_module:
            return _("{module} is not installed {place}, and no file of that name was handed in").format(
                module=no_module[1].partition(".")[0], place=self.place
            )
        if error.type == "LimitExceeded":
            return _("your bench stopped: {message}").format(message=message)
        return f"{error.type}, {message}" if message else error.type


def _several(questions: Sequence[str], one: str, many: str) -> str:
    """As "1.2 builds", "1.2 and 1.3 build", "1.2, 1.3 and 12 more build"."""
    rest = len(questions) - _NAMED
    if rest > 1:
        named = _("{named} and {count} more").format(named=", ".join(questions[:_NAMED]), count=rest)
        return f"{named} {many}"
    *most, last = questions
    if not most:
        return f"{last} {one}"
    return _("{most} and {last} {build}").format(most=", ".join(most), last=last, build=many)


# --- what was recorded at home ----------------------------------------------------------------------------------------


def _lost(run: _Run, claim: Claim, stopped: Collection[Where], handed_in: Collection[str]) -> dict[Where, str]:
    """What is claimed, and missing though nothing stopped: why."""
    found = {}
    for where in run.missing():
        cell = claim.cells.get(where[0], {}).get(where[1])
        if cell is None or where in stopped or isinstance(run.cause_of(where), _Refused):
            continue
        notebook = run.recorder[where][0]
        if notebook not in handed_in:
            found[where] = _("{notebook} was not handed in").format(notebook=notebook)
        elif claim.knows_cells and not cell:
            found[where] = _(
                "that was done by the button of an explorer or by hand, and no cell that was handed in records it"
            )
        elif claim.knows_cells and cell not in {one.id for one in run.cells[notebook]}:
            found[where] = _("the cell that did it, {cell}, is no longer in {notebook}").format(
                cell=cell[:64], notebook=notebook
            )
        else:
            found[where] = _("{notebook}, run from top to bottom, leaves it empty").format(notebook=notebook)
    return found


def _grouped(lost: Mapping[Where, str]) -> Iterator[str]:
    """A sentence for each reason."""
    by_reason: dict[str, list[str]] = {}
    for (question, part), why in lost.items():
        by_reason.setdefault(why, []).append(f"{question} {part}")
    for why, parts in by_reason.items():
        yield _("Recorded at home and missing here: {parts}; {why}.").format(parts=", ".join(parts), why=why)
