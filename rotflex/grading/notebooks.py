"""The course's notebooks: what a student gets of an instructor's notebook, and which of its cells are answers.

In ``solutions/``, the part of an answer cell that students are to write stands between two lines,
``### BEGIN SOLUTION`` and ``### END SOLUTION``; cells tagged ``instructor`` are for instructors' eyes only.
"""

from __future__ import annotations

import sys
from pathlib import Path

from rotflex.errors import GradingError

# jsonschema, behind nbformat, loads a grammar of web addresses where there is one: for a second, and for nothing, as
# no notebook's schema has it checked.
_SLOW = "rfc3987_syntax"
if _SLOW not in sys.modules:
    sys.modules[_SLOW] = None  # type: ignore[assignment]
    try:
        import jsonschema  # noqa: F401
    finally:
        del sys.modules[_SLOW]

import nbformat  # noqa: E402
from nbformat import NotebookNode, ValidationError  # noqa: E402
from nbformat.reader import NotJSONError  # noqa: E402

BEGIN, END = "### BEGIN SOLUTION", "### END SOLUTION"
STUB = "# Your code here."
INSTRUCTOR_TAG = "instructor"
_FIRST_INSTRUCTOR_NOTEBOOK = "90"  # from 90_derivation on, notebooks are for instructors only
_KEPT_CELL_METADATA = ("deletable", "editable", "jupyter", "nbgrader", "tags")


def instructor_notebooks(source: Path) -> list[Path]:
    """The notebooks of ``source/solutions`` that have a student version, in order.

    Raises
    ------
    GradingError
        If there are none.
    """
    found = sorted((source / "solutions").glob("*.ipynb"))
    released = [path for path in found if path.name < _FIRST_INSTRUCTOR_NOTEBOOK]
    if not released:
        raise GradingError(
            f"There are no notebooks in {(source / 'solutions').resolve()}. Run this in a checkout of the course, or "
            "name one with --source."
        )
    return released


def read(path: Path) -> NotebookNode:
    """A notebook of our own, checked against the format.

    Raises
    ------
    GradingError
        If it is not a valid notebook of format 4.5 or later (whose cells have ids).
    """
    try:
        notebook: NotebookNode = nbformat.read(path, as_version=nbformat.NO_CONVERT)
        nbformat.validate(notebook)
    except (NotJSONError, ValidationError, OSError, UnicodeDecodeError) as error:
        raise GradingError(f"{path.name} is not a valid notebook: {error}") from None
    if (notebook.nbformat, notebook.nbformat_minor) < (4, 5):
        raise GradingError(f"{path.name} has format {notebook.nbformat}.{notebook.nbformat_minor}; save it as 4.5.")
    return notebook


def student_version(notebook: NotebookNode, name: str) -> NotebookNode:
    """A copy without solutions, instructor's cells, outputs, and what a run leaves in the metadata.

    Parameters
    ----------
    notebook : the instructor's
    name : for messages

    Raises
    ------
    GradingError
        If a solution would stay in it: markers that do not pair, or an answer cell without any.
    """
    cells = []
    for cell in notebook.cells:
        if INSTRUCTOR_TAG in cell.metadata.get("tags", []):
            continue
        where = f"{name}, cell {cell.id!r}"
        source = _without_solutions(cell.source, where)
        if is_answer(cell) and source == cell.source:
            raise GradingError(f"{where}: an answer cell without {BEGIN!r} would be released with its solution.")
        if cell.cell_type != "code" and source != cell.source:
            raise GradingError(f"{where}: a solution must be in a code cell.")
        metadata = {key: cell.metadata[key] for key in _KEPT_CELL_METADATA if key in cell.metadata}
        kept = NotebookNode(id=cell.id, cell_type=cell.cell_type, metadata=NotebookNode(metadata), source=source)
        if cell.cell_type == "code":
            kept.update(execution_count=None, outputs=[])
        elif "attachments" in cell:
            kept["attachments"] = cell.attachments
        cells.append(kept)
    about = {"language_info": {"name": "python"}}
    if "kernelspec" in notebook.metadata:
        about["kernelspec"] = notebook.metadata.kernelspec
    released: NotebookNode = nbformat.from_dict(
        {"cells": cells, "metadata": about, "nbformat": notebook.nbformat, "nbformat_minor": notebook.nbformat_minor}
    )
    return released


def text(notebook: NotebookNode) -> str:
    """The notebook as it stands in a file, always the same."""
    return str(nbformat.writes(notebook, version=nbformat.NO_CONVERT)).rstrip("\n") + "\n"


def is_answer(cell: NotebookNode) -> bool:
    """Whether a cell of a course notebook is one that students fill in."""
    return bool(cell.metadata.get("nbgrader", {}).get("solution", False))


def answer_cells(notebook: NotebookNode) -> list[str]:
    """The ids of a course notebook's answer cells, in order."""
    return [cell.id for cell in notebook.cells if is_answer(cell)]


def _without_solutions(source: str, where: str) -> str:
    kept, inside = [], False
    for line in source.split("\n"):
        word = line.strip()
        if word == (END if inside else BEGIN):
            if not inside:
                kept.append(line[: len(line) - len(line.lstrip())] + STUB)
            inside = not inside
        elif word in (BEGIN, END):
            raise GradingError(f"{where}: {word!r} without its {'end' if inside else 'beginning'}.")
        elif "BEGIN SOLUTION" in line.upper() or "END SOLUTION" in line.upper():
            raise GradingError(f"{where}: {word!r} should be exactly {BEGIN!r} or {END!r}, alone on its line.")
        elif not inside:
            kept.append(line)
    if inside:
        raise GradingError(f"{where}: {BEGIN!r} without its end.")
    return "\n".join(kept)
