"""A notebook that was handed in as a Python program, as JupyterLab and other editors export it."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any

from labcourse.answers.notebooks import CODE, Cell, NotebookError
from labcourse.run.alignment import Role, name_of, role_of, source_of

ENDING = ".py"
_MARKER = re.compile(r"^# (?:In ?\[[\d *]*\]:|%%.*)$", re.MULTILINE)  # of JupyterLab; of VS Code and Spyder


def cells_of(data: bytes, master: Iterable[Mapping[str, Any]]) -> tuple[Cell, ...]:
    """Return the cells of a program, by the text of the course's own cells in it.

    The course's code is found by its whole text, and an answer by the first line that the course wrote there. What
    stands between is the student's.

    Parameters
    ----------
    data : the program
    master : cells of the notebook as released

    Raises
    ------
    NotebookError
        If it does not hold most of the course's code cells in their order.
    """
    text = _MARKER.sub("", data.decode("utf-8-sig", "replace").replace("\r\n", "\n"))
    places: dict[int, Mapping[str, Any]] = {}
    locked = [cell for cell in master if role_of(cell) is Role.LOCKED]
    answers: list[Mapping[str, Any]] = []
    end = found = 0
    for cell in (*master, None):
        if cell is not None and role_of(cell) in (Role.ANSWER, Role.OPEN):
            answers.append(cell)
        if cell is not None and role_of(cell) is not Role.LOCKED:
            continue
        place = len(text) if cell is None else text.find(source_of(cell).strip(), end)
        if place < 0:
            continue
        for answer in answers:  # before it, and after the last one
            here = text.find(_first_line(answer), end, place)
            if here >= 0:
                places[here], end = answer, here + 1
        answers.clear()
        if cell is not None:
            places[place], end, found = cell, place + len(source_of(cell).strip()), found + 1
    if 2 * found < len(locked) or not found:
        raise NotebookError(
            f"it is a program that does not hold the course's cells in order ({found} of {len(locked)}). Hand in the "
            "notebook itself (.ipynb)."
        )
    return tuple(_cells(text, places))


def _first_line(cell: Mapping[str, Any]) -> str:
    line = source_of(cell).strip().partition("\n")[0]
    return line if cell["cell_type"] == CODE else f"# {line}"


def _cells(text: str, places: Mapping[int, Mapping[str, Any]]) -> Iterable[Cell]:
    starts = sorted(places)
    for start, end in zip(starts, [*starts[1:], len(text)], strict=True):
        cell = places[start]
        source, name, kind = text[start:end], name_of(cell), cell["cell_type"]
        if kind != CODE:  # in an export, each line of a text is a comment
            block = re.match(r"(?:#.*\n?)*", source)
            assert block is not None
            yield Cell(name, "", kind, re.sub("^# ?", "", block[0], flags=re.MULTILINE).strip())
            continue
        if role_of(cell) is Role.LOCKED:
            own = source_of(cell).strip()
            yield Cell(name, "", CODE, own)
            source, name = source[len(own) :], ""
        source = re.sub(r"\n\s*\n(?:\s*(?:#.*)?\n?)*\Z", "", f"\n\n{source}").strip()  # texts of the course that follow
        if source or name:
            yield Cell(name, "", CODE, source)
