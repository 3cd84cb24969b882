"""Where a student is: the notebook that this kernel runs, those beside it, and where each question is answered."""

from __future__ import annotations

import html
import json
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path, PurePath
from typing import Any

from labcourse import courses
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.notebooks import CODE
from labcourse.errors import ConfigurationError
from labcourse.problems import Code, Problem
from labcourse.run import SESSION, from_notebook, skippable_cells
from labcourse.run.alignment import recorded, source_of
from labcourse.sentences import sentence

_QUESTION = re.compile(r"(?<![\w.])\d+\.\d+(?=[,:;)]|  | first|$)", re.MULTILINE)  # and no value with its unit
_TITLE = re.compile(r"^# (.+)$", re.MULTILINE)


_Beside = tuple[str, str] | None  # file name and title of a notebook


@dataclass(frozen=True)
class NotebookPlace:
    """A notebook's place in its course; of a copy, that of its original, and the line says so.

    All is empty if the notebook is not known, or is none of the course's.

    Attributes
    ----------
    name : of the notebook's file
    line : where it is, as in "3 of 11 · A first measurement"
    before, after : the notebooks beside it, if they are in the folder
    cells : number of a question → id of the cell that records its first part
    builds : id of a cell → number of the question that it prepares
    """

    name: str = ""
    line: str = ""
    before: _Beside = None
    after: _Beside = None
    cells: Mapping[str, str] = field(default_factory=dict)
    builds: Mapping[str, str] = field(default_factory=dict)


def here(folder: Path, catalogue: Catalogue) -> NotebookPlace:
    """Return the place of the notebook that this kernel runs.

    Parameters
    ----------
    folder : of the notebooks
    catalogue : of what the class is asked
    """
    try:
        paths = sorted(courses.current().notebooks.glob("*.ipynb"))
    except ConfigurationError:
        return NotebookPlace()
    opened = PurePath(os.environ.get(SESSION, "")).name
    at = next((at for at, path in enumerate(paths) if path.stem in opened), None)
    if at is None:
        return NotebookPlace()
    own, beside = paths[at], (paths[n] if 0 <= n < len(paths) else None for n in (at - 1, at + 1))
    before, after = ((path.name, _title(path)) if path and (folder / path.name).exists() else None for path in beside)
    builds: dict[str, str] = {}
    waiting: list[str] = []
    for cell in _cells(own):
        waiting += [cell["id"]] if skippable_cells.ILLUSTRATION not in cell["metadata"].get("tags", ()) else []
        for entry in recorded([cell]):
            if entry.question in catalogue.everything:
                builds |= dict.fromkeys(waiting, entry.question)
            waiting = []
    copied = Problem.of(Code.COPY_NOT_CHECKED, own.name, file=opened)
    line = f"{at + 1} of {len(paths)} · {_title(own)}" if opened == own.name else sentence(copied)
    return NotebookPlace(own.name, line, before, after, _recording(own), builds)


def _cells(path: Path) -> list[dict[str, Any]]:
    cells: list[dict[str, Any]] = json.loads(path.read_text(encoding="utf-8"))["cells"]
    return cells


def _recording(path: Path) -> dict[str, str]:
    """Return the cell of a notebook that records a question's first part: number → id."""
    return {entry.question: entry.cell for entry in reversed([*recorded(_cells(path))])}


def _title(path: Path) -> str:
    """Return a notebook's first heading."""
    titles = (_TITLE.search(source_of(cell)) for cell in _cells(path) if cell["cell_type"] != CODE)
    return next((match[1] for match in titles if match), path.stem)


# --- links in messages ----------------------------------------------------------------------------------------------


def show_linked(text: str, catalogue: Catalogue) -> None:
    """Print a message; in a live notebook, with links in place of the questions and notebooks that it names.

    Parameters
    ----------
    text : the message, in which a number such as "1.2" is a question
    catalogue : of the course
    """
    if not from_notebook.in_kernel():
        print(text)
        return
    linked = _QUESTION.sub(lambda match: _question(catalogue, match[0]), html.escape(text, quote=False))
    for name in catalogue.notebooks:
        linked = re.sub(rf"(?<![\w\"]){name}\b(?!\.ipynb)", f'<a href="{name}.ipynb">{name}</a>', linked)
    page = f'<div style="white-space: pre-wrap; font-family: var(--jp-code-font-family, monospace)">{linked}</div>'
    from_notebook.show(page, text)


def _question(catalogue: Catalogue, number: str) -> str:
    """Return a link to a question's cell. (JupyterLab goes to a heading only in a notebook that is open.)"""
    if number not in catalogue.everything:
        return number
    name = f"{catalogue.everything[number].notebook}.ipynb"
    try:
        cell = _recording(courses.current().notebooks / name).get(number, "")
    except (ConfigurationError, OSError):  # a course that is being written
        cell = ""
    return f'<a href="{name}#cell-id={cell}">{number}</a>'
