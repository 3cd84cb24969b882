"""A student's notebook beside the course's own: which cell is which, and in what order they are run.

A cell is found by its id, else by the name in its grading metadata, which an editor keeps where it gives new ids (as
JupyterLab does when a cell is split), else by its content, else, if it is an answer, by its place. The order is the
student's, for it is the order in which they ran their work, but for the course's own cells that were moved away from
their place or deleted; and what records an answer comes after it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cached_property
from typing import Any

from labcourse.answers.notebooks import CODE, Cell

PARAMETERS = "parameters"  #: tag of the cell after which a run puts its parameters
OPEN = "open"  #: tag of course cells that students may change


class Role(StrEnum):
    """What a cell is in a notebook that is to be run."""

    LOCKED = "locked"  # code of the course's
    TEXT = "text"  # the course's
    OPEN = "open"  # the course's, which students may change
    ANSWER = "answer"  # to be written by the student, code or text
    ADDED = "added"  # the student's own


@dataclass(frozen=True)
class Placed:
    """A cell in its place.

    Attributes
    ----------
    role : what it is
    master : its number among the course's cells; None if it is the student's own
    student : its number among the student's cells; None if it is not there
    """

    role: Role
    master: int | None
    student: int | None


class Happened(StrEnum):
    """What became of a cell of the course's in a student's notebook."""

    CHANGED = "changed"
    MISSING = "missing"
    MOVED = "moved"
    RENAMED = "renamed"
    OTHER_KIND = "of another kind"


_WORDS = {
    Happened.CHANGED: "the course's cell {cell} was changed; it is run as the course has it.",
    Happened.MISSING: "the cell {cell} is not there.",
    Happened.MOVED: "the course's cell {cell} was moved; it is run where the course has it.",
    Happened.RENAMED: "the cell {cell} has lost its name; what stands in its place is taken for it.",
    Happened.OTHER_KIND: "the answer cell {cell} is no longer a {kind} cell, and cannot be taken.",
}
_KINDS = {CODE: "code"}


@dataclass(frozen=True)
class Change:
    """Something that happened to a cell of the course's. ``str()`` of it is a sentence without its beginning."""

    what: Happened
    cell: str
    role: Role
    kind: str = CODE

    def __str__(self) -> str:
        return _WORDS[self.what].format(cell=self.cell, kind=_KINDS.get(self.kind, "text"))


@dataclass(frozen=True)
class Alignment:
    """Where each cell stands.

    Attributes
    ----------
    placed : all cells of either, in the order in which they are run; an answer cell that is not there is placed, too
    changes : what happened to cells of the course's
    """

    placed: tuple[Placed, ...]
    changes: tuple[Change, ...]


def role_of(cell: Mapping[str, Any]) -> Role:
    """What a cell of the course's notebooks is."""
    metadata = cell.get("metadata", {})
    if metadata.get("nbgrader", {}).get("solution", False):
        return Role.ANSWER
    if {PARAMETERS, OPEN} & set(metadata.get("tags", ())):
        return Role.OPEN
    return Role.LOCKED if cell["cell_type"] == CODE else Role.TEXT


def name_of(cell: Mapping[str, Any]) -> str:
    """The id of a cell of the course's."""
    return str(cell["id"])


def source_of(cell: Mapping[str, Any]) -> str:
    """The text of a cell of the course's."""
    source = cell["source"]
    return source if isinstance(source, str) else "".join(source)


def align(master: Sequence[Mapping[str, Any]], cells: Sequence[Cell]) -> Alignment:
    """Find the course's cells in a student's notebook.

    Parameters
    ----------
    master : cells of the notebook as released
    cells : of the student's notebook
    """
    return _Aligner(master, cells).result()


@dataclass
class _Aligner:
    master: Sequence[Mapping[str, Any]]
    cells: Sequence[Cell]
    of_cell: dict[int, int] = field(default_factory=dict)  # student's number → the course's
    pieces: dict[int, list[int]] = field(default_factory=dict)  # the course's number → student's numbers
    changes: list[Change] = field(default_factory=list)

    def result(self) -> Alignment:
        self.roles = [role_of(cell) for cell in self.master]
        self._by_id()
        self._by_grade_id()
        self._by_content()
        self._by_place()
        self._note_differences()
        return Alignment(tuple(self._ordered()), tuple(self.changes))

    # --- which is which ----------------------------------------------------------------------------------------------

    def _take(self, master: int, cell: int) -> None:
        self.of_cell[cell] = master
        self.pieces.setdefault(master, []).append(cell)

    def _free(self) -> list[int]:
        return [number for number in range(len(self.cells)) if number not in self.of_cell]

    def _missing(self) -> list[int]:
        return [number for number in range(len(self.master)) if number not in self.pieces]

    def _by_id(self) -> None:
        named = {name_of(cell): number for number, cell in enumerate(self.master)}
        for number, cell in enumerate(self.cells):
            found = named.get(cell.id)
            if found is not None and found not in self.pieces:
                self._take(found, number)

    def _by_grade_id(self) -> None:
        """Cells that have new ids: all pieces of one that was split, but no copy that stands elsewhere."""
        for master, cell in enumerate(self.master):
            name = cell.get("metadata", {}).get("nbgrader", {}).get("grade_id")
            bearers = [number for number in self._free() if name and self.cells[number].grade_id == name]
            if master in self.pieces:  # of a split cell, one piece may have kept the id
                self._take_neighbours(master, bearers)
                continue
            if self.roles[master] is not Role.ANSWER:
                # Of copies, the one that is as the course has it; the others are the student's own.
                same = [number for number in bearers if self._same(master, number)]
                bearers = (same or bearers)[:1]
            for number in bearers:
                if master in self.pieces and self._parted(self.pieces[master][-1], number):
                    break
                self._take(master, number)

    def _take_neighbours(self, master: int, bearers: Sequence[int]) -> None:
        if self.roles[master] is not Role.ANSWER:
            return
        (found,) = self.pieces[master]
        before = [number for number in bearers if number < found and not self._parted(number, found)]
        after = [number for number in bearers if number > found and not self._parted(found, number)]
        for number in (*before, *after):
            self._take(master, number)
        self.pieces[master].sort()

    def _parted(self, one: int, other: int) -> bool:
        """Whether a cell of the course's stands between two of the student's."""
        return any(number in self.of_cell for number in range(one + 1, other))

    def _by_content(self) -> None:
        for master in self._missing():
            for number in self._free():
                if not self.cells[number].grade_id and self._same(master, number):
                    self._take(master, number)
                    break

    def _same(self, master: int, cell: int) -> bool:
        mine, theirs = self.master[master], self.cells[cell]
        return mine["cell_type"] == theirs.kind and self._lines[0][master] == self._lines[1][cell]

    @cached_property
    def _lines(self) -> tuple[list[str], list[str]]:
        """The text of the course's cells, and of the student's, without what cannot be seen: each is compared often."""
        return [_plain(source_of(cell)) for cell in self.master], [_plain(cell.source) for cell in self.cells]

    def _by_place(self) -> None:
        """An answer cell that lost its name: what stands between its neighbours, all of it."""
        for master in self._missing():
            if self.roles[master] is not Role.ANSWER:
                continue
            before = max((self.pieces[number][-1] for number in range(master) if number in self.pieces), default=-1)
            later = (self.pieces[number][0] for number in range(master + 1, len(self.master)) if number in self.pieces)
            after = min((place for place in later if place > before), default=len(self.cells))
            kind = self.master[master]["cell_type"]
            found = [
                number
                for number in range(before + 1, after)
                if number not in self.of_cell and self.cells[number].kind == kind
            ]
            for number in found:
                self._take(master, number)
            if found:
                self._note(Happened.RENAMED, master)

    def _note(self, what: Happened, master: int) -> None:
        cell = self.master[master]
        self.changes.append(Change(what, name_of(cell), self.roles[master], cell["cell_type"]))

    def _note_differences(self) -> None:
        for master, role in enumerate(self.roles):
            if master not in self.pieces:
                self._note(Happened.MISSING, master)
            elif role in (Role.LOCKED, Role.TEXT) and not self._same(master, self.pieces[master][0]):
                self._note(Happened.CHANGED, master)
            elif role is Role.ANSWER:
                kinds = {self.cells[number].kind for number in self.pieces[master]}
                if self.master[master]["cell_type"] not in kinds:
                    self._note(Happened.OTHER_KIND, master)

    # --- in what order -----------------------------------------------------------------------------------------------

    def _ordered(self) -> list[Placed]:
        firsts = {places[0]: master for master, places in self.pieces.items()}
        self._settled = _longest_rise([firsts[number] for number in sorted(firsts)], self._goes_along)
        stays = {master for master in self.pieces if master in self._settled or self._goes_along(master)}
        moved = [master for master in sorted(self.pieces) if master not in stays]
        for master in moved:
            if self.roles[master] is Role.LOCKED:
                self._note(Happened.MOVED, master)
        order = [
            self._placed(number)
            for number in range(len(self.cells))
            if number not in self.of_cell or self.of_cell[number] in stays
        ]
        for master in sorted([*moved, *self._missing()]):
            order.insert(self._place_of(master, order), self._back(master))
        return self._recorders_last(order)

    def _goes_along(self, master: int) -> bool:
        """Whether a cell may stand anywhere: an answer, and what records it, behind it and the student's own cells."""
        if self.roles[master] is Role.ANSWER:
            return True
        recorded = self.pieces.get(master - 1) if self._records(master) else None
        if not recorded:
            return False
        here = self.pieces[master][0]
        return recorded[-1] < here and not self._parted(recorded[-1], here)

    def _records(self, master: int) -> bool:
        return master > 0 and self.roles[master] is Role.LOCKED and self.roles[master - 1] is Role.ANSWER

    def _placed(self, number: int) -> Placed:
        master = self.of_cell.get(number)
        return Placed(Role.ADDED if master is None else self.roles[master], master, number)

    def _back(self, master: int) -> Placed:
        return Placed(self.roles[master], master, self.pieces.get(master, [None])[0])

    def _place_of(self, master: int, order: Sequence[Placed]) -> int:
        """Where a cell of the course's belongs: after the last one before it that is in its place; what records an
        answer, after all of it, wherever that is.

        A cell that the student added below an answer belongs to it.
        """
        records = self._records(master)
        before = master - 1 if records else max((one for one in self._settled if one < master), default=None)
        if before in (None, *self._settled):
            self._settled.add(master)
        if before is None:
            return 0
        place = next(i for i in reversed(range(len(order))) if order[i].master == before) + 1
        while records and place < len(order) and order[place].master is None:
            place += 1
        return place

    def _recorders_last(self, order: list[Placed]) -> list[Placed]:
        """Let no cell that records an answer come before it, wherever a student may have moved the one or the other."""
        for master, role in enumerate(self.roles[1:], start=1):
            if role is not Role.LOCKED or self.roles[master - 1] is not Role.ANSWER:
                continue
            here = next(i for i, one in enumerate(order) if one.master == master)
            last = max(i for i, one in enumerate(order) if one.master == master - 1)
            if last > here and order[last].student is not None:
                recorder = order.pop(here)
                order.insert(last, recorder)  # which is behind it, now that the recorder is gone from before it
        return order


def _plain(source: str) -> str:
    return "\n".join(line.rstrip() for line in source.strip().splitlines())


def _longest_rise(numbers: Sequence[int], light: Callable[[int], bool]) -> set[int]:
    """The longest selection of different numbers that rises, as they come; of equally long ones, one with few light."""
    best: list[tuple[int, int]] = []  # length and number of heavy ones of the best selection that ends here
    before: list[int | None] = []
    for number in numbers:
        earlier = [place for place in range(len(best)) if numbers[place] < number]
        last = max(earlier, key=lambda place: best[place], default=None)
        length, heavy = best[last] if last is not None else (0, 0)
        best.append((length + 1, heavy + (not light(number))))
        before.append(last)
    found = set()
    place = max(range(len(best)), key=lambda place: best[place], default=None)
    while place is not None:
        found.add(numbers[place])
        place = before[place]
    return found
