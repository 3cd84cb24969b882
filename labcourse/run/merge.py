"""Make the notebooks of a run: the course's, with what a student wrote in them, where it stands."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from labcourse.answers.notebooks import CODE, Cell
from labcourse.patterns import CELL_ID
from labcourse.run import alignment, skippable_cells
from labcourse.run.alignment import Change, Placed, Role, source_of

NotebookJson = dict[str, Any]
ROLE = "role"  #: key of the role of a cell that is run, in its metadata's ``labcourse``


@dataclass(frozen=True)
class Merged:
    """What is to be run of a hand-in.

    Attributes
    ----------
    notebooks : file name → notebook, code only; after an error in a cell, the next cell is run
    changes : file name → what happened to cells of the course
    skipped : file name → ids of cells that are left out, as they only show something
    """

    notebooks: dict[str, NotebookJson]
    changes: dict[str, tuple[Change, ...]]
    skipped: dict[str, frozenset[str]]


def merged(
    pristine: Mapping[str, NotebookJson],
    handed_in: Mapping[str, Sequence[Cell]],
    every_cell: bool = False,
    supplied: Mapping[str, Mapping[str, str]] | None = None,
) -> Merged:
    """Put a student's cells into the course's notebooks.

    Locked cells are always the course's. Text is left out, and so are cells that only show something
    (:mod:`~labcourse.run.skippable_cells`). A notebook that was not handed in is run as released.

    Parameters
    ----------
    pristine : file name → notebook as released
    handed_in : file name → the student's cells
    every_cell : leave nothing out
    supplied : file name → id of a cell → source to be run before it, an instructor's
    """
    made = Merged({}, {}, {})
    for name, notebook in pristine.items():
        cells, made.changes[name] = _cells(notebook["cells"], handed_in.get(name))
        inserted = (supplied or {}).get(name, {})
        cells = list(itertools.chain.from_iterable(_with_supplied(cell, inserted) for cell in cells))
        made.skipped[name] = frozenset(() if every_cell else skippable_cells.skippable(cells))
        made.notebooks[name] = {**notebook, "cells": [cell for cell in cells if cell["id"] not in made.skipped[name]]}
    return made


def role_of(cell: Mapping[str, Any]) -> Role:
    """Return the role of a cell of a merged notebook."""
    return Role(cell["metadata"]["labcourse"][ROLE])


def _cells(
    master: Sequence[dict[str, Any]], student: Sequence[Cell] | None
) -> tuple[list[dict[str, Any]], tuple[Change, ...]]:
    """Return the code cells to be run, in order, each with an id of its own; and what happened to the course's."""
    if student is None:
        code = [cell for cell in master if cell["cell_type"] == CODE]
        return [_code(cell["id"], cell["source"], alignment.role_of(cell), cell) for cell in code], ()
    aligned = alignment.align(master, student)
    turned = {change.cell for change in aligned.changes if change.is_turned_code}
    names = {cell["id"] for cell in master}
    begun: set[int] = set()  # the course's cells of which there is a piece already, which has their id
    cells = []
    for place in aligned.placed:
        source = _source(place, master, student, turned)
        if source is None:
            continue
        if place.master is not None and place.master not in begun:
            begun.add(place.master)
            template = master[place.master]
            cells.append(_code(template["id"], source, place.role, template))
        else:
            name = _new_id(student[place.student or 0].id, place.student or 0, names)
            names.add(name)
            cells.append(_code(name, source, place.role))
    return cells, aligned.changes


def _source(place: Placed, master: Sequence[dict[str, Any]], student: Sequence[Cell], turned: set[str]) -> str | None:
    """Return what is run in a place; None if it is no code, or nothing. An answer turned into text is run."""
    if place.role is Role.LOCKED or (place.role is Role.OPEN and place.student is None):
        cell = master[place.master or 0]
        return source_of(cell) if cell["cell_type"] == CODE else None
    if place.student is None:
        return None
    is_turned = place.master is not None and master[place.master]["id"] in turned
    return student[place.student].source if is_turned or student[place.student].kind == CODE else None


def _code(name: str, source: object, role: Role, template: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Return a code cell, with the metadata of a cell of the course if it is one."""
    metadata = dict(template["metadata"]) if template else {}
    metadata["tags"] = [*metadata.get("tags", []), "raises-exception"]
    metadata["labcourse"] = {**metadata.get("labcourse", {}), ROLE: role.value}
    content = {"id": name, "cell_type": CODE, "execution_count": None}
    return {**content, "metadata": metadata, "outputs": [], "source": source}


def _new_id(given: str, place: int, others: set[str]) -> str:
    """Return an id for a cell of the student's: theirs if possible."""
    if CELL_ID.fullmatch(given) and given not in others:
        return given
    return next(name for number in itertools.count(place) if (name := f"added-{number}") not in others)


def _with_supplied(cell: dict[str, Any], supplied: Mapping[str, str]) -> list[dict[str, Any]]:
    source = supplied.get(cell["id"])
    before = [] if source is None else [_code(f"supplied-{cell['id']}"[:64], source, Role.LOCKED)]
    return [*before, cell]
