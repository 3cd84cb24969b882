"""What a student handed in, as a run takes it: the source of cells, their own files, what they recorded at home.

It is read from untrusted files, by grading, and from the student's own folder, by the check at home. Outputs are never
needed, and are left behind.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from labcourse import files

MAX_CELLS = 1_000  #: of a notebook; ten times what a long one has
MAX_SOURCE = 200_000  #: characters of a cell; thousands of lines
MAX_TEXT = 10_000_000  #: characters of a text cell, which may hold pictures, as Colab writes them
CODE, TEXT, RAW = "code", "markdown", "raw"  #: kinds of cells
UNREADABLE = "unreadable"  #: kind of a cell with a source that is too long; the source is left out
_FORMS = {"nbgrader": dict, "labcourse": dict, "tags": list}  # of a cell's metadata, as far as they are used


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
    return tuple(replace(cell, source=(answers or {}).get(cell.id, cell.source)) for cell in cells_in(notebook))


def cells_of(data: bytes) -> tuple[Cell, ...]:
    """The cells of a notebook's file. What is no cell is passed over.

    Raises
    ------
    NotebookError
        If it is not a notebook with cells.
    """
    return cells_in(document(data))


def cells_in(notebook: Mapping[str, Any]) -> tuple[Cell, ...]:
    """The cells of a notebook that :func:`document` has read, or of one of the course's."""
    return tuple(map(_cell, notebook["cells"]))


def document(data: bytes) -> dict[str, Any]:
    """Read a notebook's file, the only way in which students' notebooks are read. What can be repaired is.

    Cells are in format 4, except that they have an id only where the file gives one. What is no cell, and what the
    format does not know, is left out.

    Raises
    ------
    NotebookError
        If it is not a notebook with cells.
    """
    try:
        notebook = files.from_json(data)
    except ValueError as error:
        raise NotebookError(f"it is not JSON ({error}).") from None
    cells = _listed(notebook) if isinstance(notebook, dict) else None
    if not isinstance(cells, list):
        raise NotebookError("it is JSON, but not a notebook with cells.")
    if len(cells) > MAX_CELLS:
        raise NotebookError(f"it has more than {MAX_CELLS} cells.")
    kept = {name: notebook[name] for name in ("metadata", "nbformat", "nbformat_minor") if name in notebook}
    if not isinstance(kept.get("metadata", {}), dict):
        del kept["metadata"]
    return {"cells": [_repaired(cell) for cell in cells if isinstance(cell, dict)], **kept}


def _listed(notebook: dict[str, Any]) -> Any:
    """The cells of a notebook, which are on worksheets in format 3 and before; None if one of these is none."""
    sheets = notebook.get("worksheets")
    if "cells" in notebook or not isinstance(sheets, list):
        return notebook.get("cells")
    found: list[Any] = []
    for sheet in sheets:
        cells = sheet.get("cells", []) if isinstance(sheet, dict) else None
        if not isinstance(cells, list):
            return None
        found += cells
    return [_upgraded(cell) for cell in found if isinstance(cell, dict)]


def _upgraded(cell: dict[str, Any]) -> dict[str, Any]:
    """A cell of format 3 in format 4; without its outputs and metadata if these are broken."""
    from nbformat import from_dict  # comes with JupyterLab; takes a while to load, and old notebooks are rare
    from nbformat.v4.convert import upgrade_cell

    for tried in (cell, {**cell, "outputs": [], "metadata": {}}):
        try:
            return {**upgrade_cell(from_dict(tried)), "id": cell.get("id")}  # instead of one drawn by chance
        except Exception:  # nbformat checks nothing: whatever a broken cell leads to
            continue
    return cell


def _repaired(cell: Mapping[str, Any]) -> dict[str, Any]:
    """A cell in format 4, keys sorted as JupyterLab writes them."""
    metadata, kind = cell.get("metadata"), cell.get("cell_type")
    found: dict[str, Any] = {
        "cell_type": kind if kind in (CODE, TEXT, UNREADABLE) else RAW,
        "metadata": {
            key: value
            for key, value in (metadata.items() if isinstance(metadata, dict) else ())
            if isinstance(value, _FORMS.get(key, object))
        },
        "source": _source(cell.get("source")),
    }
    if isinstance(cell.get("id"), str):
        found["id"] = cell["id"]
    if kind == CODE:
        count, outputs = cell.get("execution_count"), cell.get("outputs")
        found["execution_count"] = count if type(count) is int else None
        found["outputs"] = [*filter(_can_be_opened, outputs)] if isinstance(outputs, list) else []
    elif isinstance(attachments := cell.get("attachments"), dict):
        found["attachments"] = {
            name: {kind: data for kind, data in content.items() if _is_text(data)}
            for name, content in attachments.items()
            if isinstance(content, dict)
        }
    return dict(sorted(found.items()))


def _can_be_opened(output: Any) -> bool:
    """Whether JupyterLab opens a notebook in which a cell has shown this."""
    return (
        isinstance(output, dict)
        and isinstance(output.get("output_type"), str)
        and isinstance(output.get("data", {}), dict)
        and _is_text(output.get("text", ""))
    )


def _is_text(value: Any) -> bool:
    """Whether it is text, or a list of its lines."""
    return all(isinstance(one, str) for one in (value if isinstance(value, list) else [value]))


def _source(source: Any) -> str | list[str]:
    """Text, or its lines; where a value is neither, it is shown as JSON, so that nothing is lost."""
    if isinstance(source, list):
        return [one if isinstance(one, str) else json.dumps(one) for one in source]
    return source if isinstance(source, str) else "" if source is None else json.dumps(source)


def _cell(cell: Mapping[str, Any]) -> Cell:
    kind, source = cell["cell_type"], "".join(cell["source"])
    if len(source) > (MAX_TEXT if kind == TEXT else MAX_SOURCE):
        kind, source = UNREADABLE, ""
    grade_id = cell.get("metadata", {}).get("nbgrader", {}).get("grade_id")
    attached = cell.get("attachments", {}) if kind == TEXT else {}
    attachments = {name: {kind: "".join(data) for kind, data in one.items()} for name, one in attached.items()}
    return Cell(cell.get("id", ""), grade_id if isinstance(grade_id, str) else "", kind, source, attachments)
