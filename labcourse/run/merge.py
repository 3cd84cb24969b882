"""The notebooks of a run: the course's, with what a student wrote in them, where it stands."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from labcourse.answers.notebooks import CODE, Cell
from labcourse.run import alignment, skippable_cells
from labcourse.run.alignment import Change, Placed, Role

Notebook = dict[str, Any]
ROLE = "role"  #: key of the role of a cell that is run, in its metadata's ``labcourse``
_NAME = re.compile(r"[a-zA-Z0-9_-]{1,64}")  # what the format of notebooks has for an id


@dataclass(frozen=True)
class Merged:
    """What is to be run of a hand-in.

    Attributes
    ----------
    notebooks : file name → notebook, code only; it goes on to the next cell whatever happens in one
    changes : file name → what happened to cells of the course's
    skipped : file name → ids of cells that are left out, as they only show something
    """

    notebooks: dict[str, Notebook]
    changes: dict[str, tuple[Change, ...]]
    skipped: dict[str, frozenset[str]]


def merged(
    pristine: Mapping[str, Notebook],
    handed_in: Mapping[str, Sequence[Cell]],
    every_cell: bool = False,
    supplied: Mapping[str, Mapping[str, str]] | None = None,
) -> Merged:
    """The course's notebooks with a student's cells in them.

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
        cells, changes = _cells(notebook["cells"], handed_in.get(name))
        cells = _with_supplied(cells, (supplied or {}).get(name, {}))
        idle = frozenset() if every_cell else frozenset(skippable_cells.skippable(cells))
        kept = [cell for cell in cells if cell["id"] not in idle]
        made.notebooks[name] = {**notebook, "cells": kept}
        made.changes[name] = changes
        made.skipped[name] = idle
    return made


def role_of(cell: Mapping[str, Any]) -> Role:
    """Whose a cell of a merged notebook is."""
    return Role(cell["metadata"]["labcourse"][ROLE])


def _cells(
    master: Sequence[dict[str, Any]], student: Sequence[Cell] | None
) -> tuple[list[dict[str, Any]], tuple[Change, ...]]:
    """The code cells to be run, in order, each with an id of its own."""
    if student is None:
        return [
            _code(cell, cell["id"], cell["source"], alignment.role_of(cell)) for cell in master if _is_code(cell)
        ], ()
    aligned = alignment.align(master, student)
    names = {cell["id"] for cell in master}
    begun: set[int] = set()  # cells of the course's that have a piece already, which bears their name
    found = []
    for place in aligned.placed:
        source = _source(place, master, student)
        if source is None:
            continue
        if place.master is not None and place.master not in begun:
            begun.add(place.master)
            template = master[place.master]
            found.append(_code(template, template["id"], source, place.role))
        else:
            name = _name(student, place, names)
            names.add(name)
            found.append(_code(None, name, source, place.role))
    return found, aligned.changes


def _source(place: Placed, master: Sequence[dict[str, Any]], student: Sequence[Cell]) -> str | None:
    """What is run there; None if it is no code, or nothing."""
    if place.role is Role.LOCKED or (place.role is Role.OPEN and place.student is None):
        cell = master[place.master or 0]
        return alignment.source_of(cell) if _is_code(cell) else None
    if place.student is None or student[place.student].kind != CODE:
        return None
    return student[place.student].source


def _is_code(cell: Mapping[str, Any]) -> bool:
    return bool(cell["cell_type"] == CODE)


def _code(template: Mapping[str, Any] | None, name: str, source: object, role: Role) -> dict[str, Any]:
    metadata = dict(template["metadata"]) if template else {}
    metadata["tags"] = [*metadata.get("tags", []), "raises-exception"]
    metadata["labcourse"] = {**metadata.get("labcourse", {}), ROLE: role.value}
    return {
        "id": name,
        "cell_type": CODE,
        "execution_count": None,
        "metadata": metadata,
        "outputs": [],
        "source": source,
    }


def _name(student: Sequence[Cell], place: Placed, taken: set[str]) -> str:
    """An id of its own for a cell of the student's: theirs, if it can be one."""
    given = student[place.student or 0].id
    if _NAME.fullmatch(given) and given not in taken:
        return given
    number = place.student or 0
    while f"added-{number}" in taken:
        number += 1
    return f"added-{number}"


def _with_supplied(cells: list[dict[str, Any]], supplied: Mapping[str, str]) -> list[dict[str, Any]]:
    found = []
    for cell in cells:
        if cell["id"] in supplied:
            found.append(_code(None, f"supplied-{cell['id']}"[:64], supplied[cell["id"]], Role.LOCKED))
        found.append(cell)
    return found
