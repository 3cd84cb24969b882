"""The course's notebooks: what a student gets of an instructor's notebook, and which of its cells are answers.

In an instructor's notebook, the part of an answer cell that students are to write stands between two lines,
``### BEGIN SOLUTION`` and ``### END SOLUTION``; in a text cell for an answer in words they are
``<!-- BEGIN SOLUTION -->`` and ``<!-- END SOLUTION -->``, which are not seen when the cell is rendered. Cells tagged
``instructor`` are for instructors' eyes only. Points stand in the catalogue alone, and are written into the cells here.
So is what students may change: answers, the parameters, and cells tagged ``open``, which a text asks them to change.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any
from urllib.parse import quote

from labcourse.answers import words
from labcourse.answers.catalogue import Catalogue
from labcourse.errors import AnswerError, GradingError
from labcourse.run import recorders
from labcourse.run.recorders import Recorded
from labcourse.run.update import STUB_KEY, stub_digest

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
_LIKE_A_MARK = re.compile(r"(?<![^\W_])(?:begin|end)[\s_-]*solution", re.IGNORECASE)
STUB = "# Your code here."
_WIDTH = 88  # characters of the comment with which a code cell to be filled in begins
INSTRUCTOR_TAG, OPEN_TAG, PARAMETERS_TAG = words.INSTRUCTOR, "open", "parameters"
COLLAPSED = "jp-MarkdownHeadingCollapsed"  #: JupyterLab's, of a text cell: what is below its heading is folded away
_KEPT_CELL_METADATA = ("jupyter", COLLAPSED, "nbgrader", "tags", words.KEY)


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


def student_version(notebook: NotebookNode, name: str, catalogue: Catalogue) -> NotebookNode:
    """A copy without solutions, instructor's cells, outputs, and what a run leaves in the metadata.

    Parameters
    ----------
    notebook : the instructor's
    name : for messages
    catalogue : of the course, for the points

    Raises
    ------
    GradingError
        If a solution would stay in it: markers that do not pair, or an answer cell without any. If a cell records what
        the catalogue does not have, or is for words and does not say of which question.
    """
    points = points_of(notebook, name, catalogue)
    asked = _asked_in(notebook)
    cells = []
    for cell in notebook.cells:
        if INSTRUCTOR_TAG in cell.metadata.get("tags", []):
            continue
        source = _released_source(cell, f"{name}, cell {cell.id!r}")
        if cell.id in asked:
            cells.append(_band(cell.id, asked[cell.id]))
        if cell.id in asked and not source.startswith("%%"):  # a cell magic must come first
            source = f"# {words.MARK} Your answer: {', '.join(asked[cell.id])} ".ljust(_WIDTH, "─") + f"\n{source}"
        metadata = {key: cell.metadata[key] for key in _KEPT_CELL_METADATA if key in cell.metadata} | _locks(cell)
        if is_answer(cell):  # so that a later release knows whether the student has written in it
            metadata[words.KEY] = {**metadata.get(words.KEY, {}), STUB_KEY: stub_digest(source)}
        if cell.id in points:
            metadata["nbgrader"] = {**cell.metadata.nbgrader, "points": points[cell.id]}
        kept = NotebookNode(id=cell.id, cell_type=cell.cell_type, metadata=NotebookNode(metadata), source=source)
        if cell.cell_type == "code":
            kept.update(execution_count=None, outputs=[])
        elif shown := {name: data for name, data in cell.get("attachments", {}).items() if _shows(source, name)}:
            kept["attachments"] = shown
        cells.append(kept)
    about = {"language_info": {"name": "python"}}
    if "kernelspec" in notebook.metadata:
        about["kernelspec"] = notebook.metadata.kernelspec
    released: NotebookNode = nbformat.from_dict(
        {"cells": cells, "metadata": about, "nbformat": notebook.nbformat, "nbformat_minor": notebook.nbformat_minor}
    )
    return released


def is_derived(notebook: NotebookNode) -> bool:
    """Whether a notebook is a student version in which nobody has run a cell."""
    return all(cell.metadata.get("deletable") is False and not cell.get("outputs") for cell in notebook.cells)


def _released_source(cell: NotebookNode, where: str) -> str:
    """What a cell holds for students."""
    in_words = is_answer(cell) and cell.cell_type == "markdown"
    if in_words and words.where_of(cell) is None:
        raise GradingError(f'{where}: its metadata should have "{words.KEY}": {{"question": ..., "part": ...}}.')
    begin, end, stub = (words.BEGIN, words.END, words.STUB) if in_words else (BEGIN, END, STUB)
    source = _without_solutions(cell.source, where, begin, end, stub)
    if is_answer(cell) and source == cell.source:
        raise GradingError(f"{where}: an answer cell without {begin!r} would be released with its solution.")
    if cell.cell_type != "code" and not in_words and source != cell.source:
        raise GradingError(f"{where}: a solution must be in a code cell, or in an answer cell.")
    return source


def _locks(cell: NotebookNode) -> dict[str, bool]:
    """What JupyterLab lets students do with a cell, by what the cell is for."""
    tags = cell.metadata.get("tags", [])
    if is_answer(cell) or PARAMETERS_TAG in tags or OPEN_TAG in tags:
        return {"deletable": False}
    return {"deletable": False, "editable": False}


def _band(answer: str, questions: list[str]) -> NotebookNode:
    """The line in colour above an answer cell with code, which cannot have a colour itself."""
    label = f"Your answer: {', '.join(questions)} (code, in the next cell)"
    metadata = NotebookNode(deletable=False, editable=False)
    return NotebookNode(id=f"{answer}-here", cell_type="markdown", metadata=metadata, source=words.heading(label))


def _shows(source: str, name: str) -> bool:
    """Whether a text shows the picture of a name."""
    return f"attachment:{name}" in source or f"attachment:{quote(name)}" in source


def _asked_in(notebook: NotebookNode) -> dict[str, list[str]]:
    """Id of each code answer cell → the questions that are recorded of it."""
    answers = {cell.id: cell for cell in notebook.cells if is_answer(cell)}
    found: dict[str, list[str]] = {}
    for latest, one in _by_answer(notebook):
        if latest and answers[latest].cell_type == "code" and one.question not in found.setdefault(latest, []):
            found[latest].append(one.question)
    return found


def text(notebook: NotebookNode) -> str:
    """The notebook as it stands in a file, always the same."""
    return str(nbformat.writes(notebook, version=nbformat.NO_CONVERT)).rstrip("\n") + "\n"


def is_answer(cell: Mapping[str, Any]) -> bool:
    """Whether a cell of a course notebook is one that students fill in."""
    return bool(cell["metadata"].get("nbgrader", {}).get("solution", False))


def answer_cells(notebook: NotebookNode) -> list[str]:
    """The ids of a course notebook's answer cells with code, in order."""
    return [cell.id for cell in notebook.cells if is_answer(cell) and cell.cell_type == "code"]


def recorded(notebook: NotebookNode) -> Iterator[Recorded]:
    """What the cells of a course notebook record, in order; a text cell for an answer is the answer itself."""
    for cell in notebook.cells:
        where = words.where_of(cell)
        if where is not None and is_answer(cell):
            yield Recorded(cell.id, where[0], {where[1]: None})
        yield from recorders.recorded([cell])


def set_points(notebook: NotebookNode, name: str, catalogue: Catalogue) -> bool:
    """Write the catalogue's points into a notebook's answer cells; whether there was anything to change.

    Raises
    ------
    GradingError
        If a cell records what the catalogue does not have.
    """
    changed = False
    points = points_of(notebook, name, catalogue)
    for cell in notebook.cells:
        if cell.id in points and cell.metadata.nbgrader.get("points") != points[cell.id]:
            cell.metadata.nbgrader["points"] = points[cell.id]
            changed = True
    return changed


def points_of(notebook: NotebookNode, name: str, catalogue: Catalogue) -> dict[str, float]:
    """Id of each answer cell → points of what is recorded of it before the next answer cell, or of its words.

    Raises
    ------
    GradingError
        If a cell records what the catalogue does not have.
    """
    points: dict[str, float] = {
        cell: sum(catalogue.find(question).part(part).points for question, part in parts)
        for cell, parts in parts_of(notebook, name, catalogue).items()
    }
    return {cell: int(value) if value == int(value) else value for cell, value in points.items()}


def parts_of(notebook: NotebookNode, name: str, catalogue: Catalogue) -> dict[str, tuple[tuple[str, str], ...]]:
    """Id of each answer cell → question and part of all that is recorded of it, as for :func:`points_of`.

    Raises
    ------
    GradingError
        If a cell records what the catalogue does not have.
    """
    found: dict[str, tuple[tuple[str, str], ...]] = {cell.id: () for cell in notebook.cells if is_answer(cell)}
    for latest, one in _by_answer(notebook):
        try:
            question = catalogue.find(one.question)
            parts = [question.part(part).name for part in one.of(question)]
        except AnswerError as error:
            raise GradingError(f"{name}, cell {one.cell!r}: {error}") from None
        if latest:
            found[latest] += tuple((question.number, part) for part in parts)
    return found


def _by_answer(notebook: NotebookNode) -> Iterator[tuple[str, Recorded]]:
    """What is recorded, with the answer cell that it is recorded of: a text cell itself, or the last one with code."""
    by_cell: dict[str, list[Recorded]] = {}
    for one in recorded(notebook):
        by_cell.setdefault(one.cell, []).append(one)
    latest = ""
    for cell in notebook.cells:
        if is_answer(cell) and cell.cell_type == "code":
            latest = cell.id
        for one in by_cell.get(cell.id, ()):
            yield (cell.id if is_answer(cell) else latest), one


def _without_solutions(source: str, where: str, begin: str, end: str, stub: str) -> str:
    kept, inside = [], False
    for line in source.split("\n"):
        word = line.strip()
        if word == (end if inside else begin):
            if not inside:
                kept.append(line[: len(line) - len(line.lstrip())] + stub)
            inside = not inside
        elif word in (begin, end):
            raise GradingError(f"{where}: {word!r} without its {'end' if inside else 'beginning'}.")
        elif _LIKE_A_MARK.search(line):
            raise GradingError(f"{where}: {word!r} should be exactly {begin!r} or {end!r}, alone on its line.")
        elif not inside:
            kept.append(line)
    if inside:
        raise GradingError(f"{where}: {begin!r} without its end.")
    return "\n".join(kept)
