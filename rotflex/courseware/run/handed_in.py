"""What a student handed in, as a run takes it: the source of cells, their own files, what they recorded at home.

It is read from untrusted files, by grading, and from the student's own folder, by the check at home. Outputs are never
needed, and are left behind.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

MAX_CELLS = 1_000  #: of a notebook; ten times what a long one has
MAX_SOURCE = 200_000  #: characters of a cell; thousands of lines
MAX_TEXT = 10_000_000  #: characters of a text cell, which may hold pictures, as Colab writes them
CODE, TEXT = "code", "markdown"  #: kinds of cells that count; there are others
UNREADABLE = "unreadable"  #: kind of a cell whose source is no text, or too long; it is empty here


class NotebookError(Exception):
    """A notebook that cannot be read; the message says why."""


@dataclass(frozen=True)
class Cell:
    """A cell of a student's notebook.

    Attributes
    ----------
    id : its id; "" where the file has none
    grade_id : as its grading metadata say, which an editor that gives new ids keeps; "" where there are none
    kind : "code", "markdown", "raw", or :data:`UNREADABLE`
    source : its text
    attachments : of a text cell: file name → media type → base64
    """

    id: str
    grade_id: str
    kind: str
    source: str
    attachments: Mapping[str, Mapping[str, str]] = field(default_factory=dict)


@dataclass(frozen=True)
class HandIn:
    """All that counts of what a student handed in.

    Attributes
    ----------
    notebooks : notebook's file name → its cells
    files : the student's own files beside the notebooks: relative path, with "/" → content
    claim : their own answers.json, to be compared with what a run records, and for nothing else
    course : what their course.json says
    reports : file name of a report's PDF → its content; no run needs it
    """

    notebooks: Mapping[str, tuple[Cell, ...]] = field(default_factory=dict)
    files: Mapping[str, bytes] = field(default_factory=dict)
    claim: bytes | None = None
    course: Mapping[str, Any] = field(default_factory=dict)
    reports: Mapping[str, bytes] = field(default_factory=dict)


def as_released(notebook: Mapping[str, Any], answers: Mapping[str, str] | None = None) -> tuple[Cell, ...]:
    """The cells of a course's notebook as a student has them who wrote these answers, and changed nothing else.

    Parameters
    ----------
    notebook : as released
    answers : cell's id → what was written there
    """
    found = _cells(notebook["cells"])
    return tuple(replace(cell, source=(answers or {}).get(cell.id, cell.source)) for cell in found)


def cells_of(data: bytes) -> tuple[Cell, ...]:
    """The cells of a notebook's file. What is no cell is passed over.

    Raises
    ------
    NotebookError
        If it is not a notebook with cells.
    """
    return _cells(document(data)["cells"])


def document(data: bytes) -> dict[str, Any]:
    """A notebook's file as it is, with a list of cells whatever its format: in format 3 they stand elsewhere.

    Raises
    ------
    NotebookError
        If it is not a notebook with cells.
    """
    try:
        notebook = json.loads(data)
    except (ValueError, RecursionError) as error:
        raise NotebookError(f"it is not JSON ({type(error).__name__}).") from None
    cells = _listed(notebook) if isinstance(notebook, dict) else None
    if not isinstance(cells, list):
        raise NotebookError("it is JSON, but not a notebook with cells.")
    if len(cells) > MAX_CELLS:
        raise NotebookError(f"it has more than {MAX_CELLS} cells.")
    kept = {name: value for name, value in notebook.items() if name != "worksheets"}
    return {**(notebook if "cells" in notebook else kept), "cells": cells}


def _listed(notebook: dict[str, Any]) -> Any:
    """The cells of a notebook; in format 3 and before, they are on worksheets, and code is an input."""
    sheets = notebook.get("worksheets")
    if "cells" in notebook or not isinstance(sheets, list):
        return notebook.get("cells")
    cells = [cell for sheet in sheets if isinstance(sheet, dict) for cell in sheet.get("cells") or ()]
    return [{**cell, "source": cell.get("source", cell.get("input"))} for cell in cells if isinstance(cell, dict)]


def _cells(cells: Sequence[Any]) -> tuple[Cell, ...]:
    return tuple(_cell(cell) for cell in cells if isinstance(cell, dict))


def _cell(cell: dict[str, Any]) -> Cell:
    source = cell.get("source")
    if isinstance(source, list) and all(isinstance(line, str) for line in source):
        source = "".join(source)
    kind = _text(cell.get("cell_type"))
    if not isinstance(source, str) or not _is_readable(source, MAX_TEXT if kind == TEXT else MAX_SOURCE):
        kind, source = UNREADABLE, ""
    metadata = cell.get("metadata")
    grading = metadata.get("nbgrader") if isinstance(metadata, dict) else None
    grade_id = grading.get("grade_id") if isinstance(grading, dict) else None
    return Cell(_text(cell.get("id")), _text(grade_id), kind, source, _attachments(cell))


def _is_readable(source: str, most: int) -> bool:
    """Whether it is valid text of no more than so many characters."""
    if len(source) > most:
        return False
    try:
        source.encode()
    except UnicodeEncodeError:
        return False
    return True


def _text(value: object) -> str:
    return value if isinstance(value, str) else ""


def _attachments(cell: dict[str, Any]) -> dict[str, dict[str, str]]:
    """Of a text cell; anything of another form is left out."""
    found = cell.get("attachments")
    if cell.get("cell_type") != TEXT or not isinstance(found, dict):
        return {}
    return {
        name: {kind: data for kind, data in content.items() if isinstance(data, str)}
        for name, content in found.items()
        if isinstance(name, str) and isinstance(content, dict)
    }
