"""A student's notebook beside the course's own: which cell is which, and in what order they are run.

A cell is found by its id, else by the name in its grading metadata, which an editor keeps where it gives new ids (as
JupyterLab does when a cell is split), else by its content, else, if it is an answer, by its place. The order is the
student's, because they ran their work in this order. The course's own cells that were moved or deleted are put back,
and what records an answer (``lab.answer(question, part=..., ...)``) comes after it.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from labcourse.answers import words
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.notebooks import CODE, Cell
from labcourse.answers.parts import Question
from labcourse.problems import Code, Problem, Where

PARAMETERS = "parameters"  #: tag of the cell after which a run puts its parameters
OPEN = "open"  #: tag of course cells that students may change


class Role(StrEnum):
    """What a cell is in a notebook that is to be run."""

    LOCKED = "locked"  # code of the course
    TEXT = "text"  # of the course
    OPEN = "open"  # of the course, which students may change
    ANSWER = "answer"  # to be written by the student, code or text
    ADDED = "added"  # the student's own


@dataclass(frozen=True)
class Placed:
    """A cell in its place.

    Attributes
    ----------
    role : what it is
    master : its index among the course's cells; None if it is the student's own
    student : its index among the student's cells; None if it is not there
    """

    role: Role
    master: int | None
    student: int | None


class Happened(StrEnum):
    """What happened to a cell of the course in a student's notebook; completes "the cell was ..."."""

    CHANGED = "changed"
    MISSING = "deleted"
    MOVED = "moved"
    RENAMED = "replaced by a new cell"  # what stands in its place is taken for it
    OTHER_KIND = "turned into another kind of cell"


@dataclass(frozen=True)
class Change:
    """What happened to a cell of the course."""

    what: Happened
    cell: str
    role: Role
    kind: str = CODE

    @property
    def is_turned_code(self) -> bool:
        """Whether an answer cell for code is a text cell now, as one key does it: its text is run."""
        return self.what is Happened.OTHER_KIND and self.kind == CODE

    @property
    def problem(self) -> Problem:
        """Return what there is to say about it."""
        if self.is_turned_code:
            return Problem.of(Code.CELL_IS_TEXT, cell=self.cell)
        return Problem.of(Code.CELL_CHANGED, cell=self.cell, what=self.what.value, role=self.role.value)


@dataclass(frozen=True)
class Alignment:
    """Where each cell stands.

    Attributes
    ----------
    placed : all cells of either, in the order in which they are run; an answer cell that is not there is placed, too
    changes : what happened to cells of the course
    """

    placed: tuple[Placed, ...]
    changes: tuple[Change, ...]


def cells_by_change(changes: Sequence[Change]) -> dict[Happened, list[str]]:
    """Return the ids of the cells to which each thing happened."""
    return {what: [change.cell for change in changes if change.what is what] for what in Happened}


def role_of(cell: Mapping[str, Any]) -> Role:
    """Return what a cell of the course's notebooks is."""
    metadata = cell.get("metadata", {})
    if metadata.get("nbgrader", {}).get("solution", False):
        return Role.ANSWER
    if {PARAMETERS, OPEN} & set(metadata.get("tags", ())):
        return Role.OPEN
    return Role.LOCKED if cell["cell_type"] == CODE else Role.TEXT


def source_of(cell: Mapping[str, Any]) -> str:
    """Return the text of a cell of a notebook's file, which may be a list of lines."""
    return "".join(cell["source"])


# --- what the course's cells record -----------------------------------------------------------------------------------


@dataclass(frozen=True)
class Recorded:
    """What a cell records.

    Attributes
    ----------
    cell : id of the cell
    question : its number
    names : part → the variable that is recorded for it, or None if that is not a plain name; None as a whole if the
        call does not write its parts out (``**``)
    in_words : whether it is a text cell, which is itself the answer
    """

    cell: str
    question: str
    names: Mapping[str, str | None] | None
    in_words: bool = False

    def of(self, question: Question) -> tuple[str, ...]:
        """Return the names of the parts; all of the question if they are not written out."""
        return question.names if self.names is None else tuple(self.names)


def recorded(cells: Iterable[Mapping[str, Any]]) -> Iterator[Recorded]:
    """Yield what the cells of a course's notebook record, in order. Cells that are not plain Python record nothing."""
    for cell in cells:
        is_answer, where = role_of(cell) is Role.ANSWER, words.where_of(cell)
        if is_answer and where is not None:
            yield Recorded(cell["id"], where[0], {where[1]: None}, in_words=True)
        elif cell["cell_type"] == CODE and not is_answer:
            for number, call in _calls(source_of(cell)):
                names = {
                    keyword.arg: keyword.value.id if isinstance(keyword.value, ast.Name) else None
                    for keyword in call.keywords
                    if keyword.arg is not None
                }
                yield Recorded(cell["id"], number, names if len(names) == len(call.keywords) else None)


def asked_cells(
    notebooks: Mapping[str, Mapping[str, Any]], catalogue: Catalogue
) -> Iterator[tuple[str, Recorded, tuple[Where, ...]]]:
    """Yield what a course's notebooks record of what a catalogue has.

    Yields
    ------
    tuple
        File name of the notebook; what a cell records; and its (question, part), those that the catalogue has.
    """
    for name, notebook in notebooks.items():
        for entry in recorded(notebook["cells"]):
            if (question := catalogue.everything.get(entry.question)) is not None:
                yield (
                    name,
                    entry,
                    tuple((entry.question, part) for part in entry.of(question) if part in question.names),
                )


def _calls(source: str) -> Iterator[tuple[str, ast.Call]]:
    """Yield the calls of ``lab.answer`` in a source, each with its question."""
    try:
        body = ast.parse(source).body
    except SyntaxError:
        return
    for statement in body:
        match statement:
            case ast.Expr(
                value=ast.Call(func=ast.Attribute(attr="answer"), args=[ast.Constant(value=str() as number)]) as call
            ):
                yield number, call


# --- a student's cells beside the course's ----------------------------------------------------------------------------


def align(master: Sequence[Mapping[str, Any]], cells: Sequence[Cell]) -> Alignment:
    """Find the course's cells in a student's notebook.

    Parameters
    ----------
    master : cells of the notebook as released
    cells : of the student's notebook
    """
    aligner = _Aligner(master, cells)
    aligner.find_cells()
    aligner.note_differences()
    return Alignment(tuple(aligner.ordered()), tuple(aligner.changes))


def count_changed(master: Sequence[Mapping[str, Any]], cells: Sequence[Cell]) -> int:
    """Count the cells in which a student wrote something: cells for an answer or a text, open cells, and own cells.

    A cell counts if it has a line that the course's notebook does not have. The parameters, what stands in locked cells
    and in the course's texts, white space, and what was deleted do not count.

    Parameters
    ----------
    master : cells of the notebook as released
    cells : of the student's notebook
    """
    released = {line for cell in master for line in _lines(source_of(cell))}
    may_hold = [place for place, cell in enumerate(cells) if not _lines(cell.source) <= released]
    if not may_hold:
        return 0
    aligned = {place.student: place for place in align(master, cells).placed}
    return sum(_is_students(aligned.get(place), master) for place in may_hold)


def _is_students(place: Placed | None, master: Sequence[Mapping[str, Any]]) -> bool:
    """Return whether what a cell holds is the student's: not a cell of the course that is locked, or its parameters."""
    if place is None or place.master is None:
        return True  # an own cell, or a further piece of an answer
    is_parameters = PARAMETERS in master[place.master].get("metadata", {}).get("tags", ())
    return place.role in (Role.ANSWER, Role.OPEN) and not is_parameters


def _lines(source: str) -> set[str]:
    """Return the lines of a cell without white space around them."""
    return {line.strip() for line in source.strip().splitlines()}


class _Aligner:
    """Finds the course's cells by several rules, one after the other, and puts all cells in order.

    Attributes
    ----------
    of_cell : index of a student's cell → index of the course's cell that it is
    pieces : index of a course's cell → indices of the student's cells that it is; several if it was split
    changes : what happened to cells of the course
    """

    def __init__(self, master: Sequence[Mapping[str, Any]], cells: Sequence[Cell]) -> None:
        self.master, self.cells = master, cells
        self.roles = [role_of(cell) for cell in master]
        self._released = [_visible(source_of(cell)) for cell in master]
        self._own = [_visible(cell.source) for cell in cells]
        self.of_cell: dict[int, int] = {}
        self.pieces: dict[int, list[int]] = {}
        self.changes: list[Change] = []

    # --- which is which ----------------------------------------------------------------------------------------------

    def find_cells(self) -> None:
        """Find the course's cells among the student's."""
        named = {cell["id"]: index for index, cell in enumerate(self.master)}
        for index, cell in enumerate(self.cells):
            if (master := named.get(cell.id)) is not None and master not in self.pieces:
                self._take(master, index)
        for master in range(len(self.master)):
            self._find_by_grade_id(master)
        for master in self._missing():
            same = (index for index in self._free() if not self.cells[index].grade_id and self._is_same(master, index))
            if (first := next(same, None)) is not None:
                self._take(master, first)
        for master in self._missing():
            if self.roles[master] is Role.ANSWER:
                self._find_by_place(master)

    def _take(self, master: int, index: int) -> None:
        self.of_cell[index] = master
        self.pieces.setdefault(master, []).append(index)

    def _free(self) -> list[int]:
        return [index for index in range(len(self.cells)) if index not in self.of_cell]

    def _missing(self) -> list[int]:
        return [index for index in range(len(self.master)) if index not in self.pieces]

    def _is_same(self, master: int, index: int) -> bool:
        same_kind = self.master[master]["cell_type"] == self.cells[index].kind
        return same_kind and self._released[master] == self._own[index]

    def _find_by_grade_id(self, master: int) -> None:
        """Take cells that have new ids: all pieces of one that was split, but no copy that stands elsewhere."""
        name = self.master[master].get("metadata", {}).get("nbgrader", {}).get("grade_id")
        bearers = [index for index in self._free() if name and self.cells[index].grade_id == name]
        is_answer = self.roles[master] is Role.ANSWER
        if master in self.pieces:  # of a split cell, one piece may have kept the id
            (piece,) = self.pieces[master]
            near = [index for index in bearers if is_answer and not self._are_parted(*sorted((index, piece)))]
            for index in near:
                self._take(master, index)
            self.pieces[master].sort()
            return
        if not is_answer:  # of copies, the one that is as the course has it; the others are the student's own
            bearers = ([index for index in bearers if self._is_same(master, index)] or bearers)[:1]
        for index in bearers:
            if master in self.pieces and self._are_parted(self.pieces[master][-1], index):
                break
            self._take(master, index)

    def _are_parted(self, first: int, second: int) -> bool:
        """Return whether a cell of the course stands between two of the student's cells."""
        return any(index in self.of_cell for index in range(first + 1, second))

    def _find_by_place(self, master: int) -> None:
        """Take all that stands between the neighbours of an answer cell that lost its name."""
        before = max((self.pieces[other][-1] for other in range(master) if other in self.pieces), default=-1)
        later = (self.pieces[other][0] for other in range(master + 1, len(self.master)) if other in self.pieces)
        after = min((place for place in later if place > before), default=len(self.cells))
        kind = self.master[master]["cell_type"]
        for index in range(before + 1, after):
            if index not in self.of_cell and self.cells[index].kind == kind:
                self._take(master, index)
        if master in self.pieces:
            self._note(Happened.RENAMED, master)

    def _note(self, what: Happened, master: int) -> None:
        cell = self.master[master]
        self.changes.append(Change(what, str(cell["id"]), self.roles[master], cell["cell_type"]))

    def note_differences(self) -> None:
        """Note which of the course's cells are missing, changed, or of another kind."""
        for master, role in enumerate(self.roles):
            pieces = self.pieces.get(master)
            if pieces is None:
                self._note(Happened.MISSING, master)
            elif role in (Role.LOCKED, Role.TEXT) and not self._is_same(master, pieces[0]):
                self._note(Happened.CHANGED, master)
            elif role is Role.ANSWER and self.master[master]["cell_type"] not in {self.cells[i].kind for i in pieces}:
                self._note(Happened.OTHER_KIND, master)

    # --- in what order -----------------------------------------------------------------------------------------------

    def ordered(self) -> list[Placed]:
        """Return all cells in the order in which they are run, and note which were moved."""
        firsts = {places[0]: master for master, places in self.pieces.items()}
        self._in_place = _longest_rise([firsts[index] for index in sorted(firsts)], self._goes_along)
        stay = {master for master in self.pieces if master in self._in_place or self._goes_along(master)}
        moved = [master for master in sorted(self.pieces) if master not in stay]
        for master in moved:
            if self.roles[master] is Role.LOCKED:
                self._note(Happened.MOVED, master)
        order = []
        for index in range(len(self.cells)):
            place = self.of_cell.get(index)
            if place is None or place in stay:
                order.append(Placed(Role.ADDED if place is None else self.roles[place], place, index))
        for master in sorted([*moved, *self._missing()]):
            piece = self.pieces.get(master, [None])[0]
            order.insert(self._place_of(master, order), Placed(self.roles[master], master, piece))
        self._put_recorders_last(order)
        return order

    def _goes_along(self, master: int) -> bool:
        """Return whether a cell may stand anywhere: an answer; and what records it, behind it and the student's own."""
        if self.roles[master] is Role.ANSWER:
            return True
        answer = self.pieces.get(master - 1) if self._is_recorder(master) else None
        if not answer:
            return False
        here = self.pieces[master][0]
        return answer[-1] < here and not self._are_parted(answer[-1], here)

    def _is_recorder(self, master: int) -> bool:
        return master > 0 and self.roles[master] is Role.LOCKED and self.roles[master - 1] is Role.ANSWER

    def _place_of(self, master: int, order: Sequence[Placed]) -> int:
        """Return where a cell of the course belongs: after the last one before it that is in its place.

        What records an answer belongs after all of it, wherever that is. A cell that the student added below an answer
        is part of it.
        """
        is_recorder = self._is_recorder(master)
        before = max((other for other in self._in_place if other < master), default=None)
        if is_recorder:
            before = master - 1
        if before is None or before in self._in_place:
            self._in_place.add(master)
        if before is None:
            return 0
        place = next(i for i in reversed(range(len(order))) if order[i].master == before) + 1
        while is_recorder and place < len(order) and order[place].master is None:
            place += 1
        return place

    def _put_recorders_last(self, order: list[Placed]) -> None:
        """Move each cell that records an answer behind it, wherever a student may have moved either."""
        for master in filter(self._is_recorder, range(len(self.master))):
            here = next(i for i, cell in enumerate(order) if cell.master == master)
            last = max(i for i, cell in enumerate(order) if cell.master == master - 1)
            if last > here and order[last].student is not None:
                order.insert(last, order.pop(here))


def _visible(source: str) -> str:
    """Return a text without white space at the ends of its lines."""
    return "\n".join(line.rstrip() for line in source.strip().splitlines())


def _longest_rise(numbers: Sequence[int], is_light: Callable[[int], bool]) -> set[int]:
    """Return the longest rising selection of different numbers; of equally long ones, one with few light numbers."""
    best: list[tuple[int, int]] = []  # length and number of heavy ones of the best selection that ends here
    before: list[int | None] = []
    for number in numbers:
        earlier = [place for place in range(len(best)) if numbers[place] < number]
        last = max(earlier, key=lambda place: best[place], default=None)
        length, heavy = best[last] if last is not None else (0, 0)
        best.append((length + 1, heavy + (not is_light(number))))
        before.append(last)
    selected = set()
    place = max(range(len(best)), key=lambda place: best[place], default=None)
    while place is not None:
        selected.add(numbers[place])
        place = before[place]
    return selected
