"""Where a run stopped, and what builds on that: from an answer that is missing, upwards to the first cause.

Of each answer that was not recorded, the cells are looked at from the one that recorded the answer before it. If one of
them stopped, the cause is sought upwards: in earlier cells that stopped and bind a name which this one uses, and in
earlier answers that it asked for. All of it is taken from claims of the run, and used for words alone.
"""

from __future__ import annotations

import re
from bisect import bisect_left
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import islice
from typing import Any

from labcourse.answers.catalogue import Catalogue
from labcourse.answers.cell_reports import LEFT, CellReport, Reports
from labcourse.run import skippable_cells
from labcourse.run.alignment import Role, source_of
from labcourse.run.merge import Merged, role_of
from labcourse.run.recorders import recorded as recorders_of

Where = tuple[str, str]  #: question and part
_UNDEFINED = re.compile(r"name '(\w+)' is not defined")


@dataclass(frozen=True, eq=False)
class RunCell:
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
class Unanswered:
    """An earlier answer that is missing, though nothing stopped."""

    question: str


@dataclass(frozen=True)
class Refused:
    """An answer that was given and not taken."""

    why: str


Cause = RunCell | Unanswered | Refused | None


class Causes:
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
        self.cells: dict[str, list[RunCell]] = {}
        for name, notebook in merged.notebooks.items():
            cells = notebook["cells"]
            readable = skippable_cells.readable(map(source_of, cells))
            self.cells[name] = [
                RunCell(
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
                for part in filter(question.names.__contains__, one.of(question)):
                    self.recorder[question.number, part] = name, places[one.cell]
        self._causes: dict[Where, Cause] = {}
        self._roots: dict[RunCell, Cause] = {}

    def missing(self) -> list[Where]:
        """What was asked and not recorded, in the order in which it is asked."""
        asked = ((number, part) for number, question in self.catalogue.everything.items() for part in question.names)
        return [where for where in asked if where in self.recorder and where not in self.recorded]

    def question_of(self, cell: RunCell) -> str:
        """The question whose answer is recorded next after a cell, or by it; "" if there is none."""
        later = (place for place in sorted(self.questions.get(cell.notebook, ())) if place >= cell.place)
        place = next(later, None)
        return "" if place is None else self.questions[cell.notebook][place]

    def cause_of(self, where: Where) -> Cause:
        """Why an answer is missing; None if there is no more to say than that it is."""
        if where not in self._causes:
            self._causes[where] = None  # should it be asked for again on the way
            self._causes[where] = self._cause(where)
        return self._causes[where]

    def _cause(self, where: Where) -> Cause:
        name, recorder = self.recorder[where]
        cells = self.cells[name]
        before = max((place for place in self.questions[name] if place < recorder), default=-1)
        own = cells[before + 1 : recorder + 1]
        for cell in own:
            if cell.stopped:
                return self.root(cell)
        if cells[recorder].report is None:  # it was never come to
            return next((cell for cell in reversed(cells[:recorder]) if cell.ended_all), None)
        for cell in self._upstream(own):
            lacked = self._lacked(cell, where)
            if lacked is not None or cell.stopped:
                return lacked or self.root(cell)
        return Refused(self.refusals[where]) if where in self.refusals else None

    def root(self, cell: RunCell) -> Cause:
        """The first cause of the stop of a cell: the cell itself, or what it builds on."""
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

    def is_passed_on(self, cell: RunCell) -> bool:
        """Whether it was found that what stopped in a cell was caused elsewhere."""
        return self._roots.get(cell, cell) is not cell

    def _upstream(self, cells: Sequence[RunCell]) -> Iterator[RunCell]:
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

    def _lacked(self, cell: RunCell, where: Where | None = None) -> Cause:
        """The cause that lies in an earlier answer which a cell asked for and did not get."""
        for needed in cell.report.lacked if cell.report else ():
            if needed in self.recorder and needed not in self.recorded and needed != where:
                return self.cause_of(needed) or Unanswered(needed[0])
        return None
