"""The course's notebooks: the student version of an instructor's notebook, and which cells are answers.

In an instructor's notebook, the part of an answer cell that students are to write stands between two lines,
``### BEGIN SOLUTION`` and ``### END SOLUTION``; in a text cell for an answer in words they are
``<!-- BEGIN SOLUTION -->`` and ``<!-- END SOLUTION -->``, which are not seen when the cell is rendered. Cells tagged
``instructor`` are for instructors only. Points stand in the catalogue alone, and are written into the cells here.
Students may edit answers, the parameters, and cells tagged ``open``, which a text asks them to change; other cells are
locked.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any
from urllib.parse import quote

import nbformat
from nbformat import NotebookNode, ValidationError
from nbformat.reader import NotJSONError

from labcourse.answers import words
from labcourse.answers.catalogue import Catalogue
from labcourse.errors import AnswerError, GradingError
from labcourse.run.alignment import recorded
from labcourse.run.restore import STUB_KEY, stub_digest

BEGIN_CODE, END_CODE = "### BEGIN SOLUTION", "### END SOLUTION"
_ALMOST_A_MARKER = re.compile(r"(?<![^\W_])(?:begin|end)[\s_-]*solution", re.IGNORECASE)
CODE_STUB = "# Your code here."
_WIDTH = 88  # characters of the comment with which a code cell to be filled in begins
INSTRUCTOR_TAG, OPEN_TAG, PARAMETERS_TAG = words.INSTRUCTOR, "open", "parameters"
COLLAPSED = "jp-MarkdownHeadingCollapsed"  #: JupyterLab's, of a text cell: what is below its heading is folded away
_CELL_METADATA = ("jupyter", COLLAPSED, "nbgrader", "tags", words.KEY)  # that students get


def read(path: Path) -> NotebookNode:
    """Read a notebook of the course, and check it against the format.

    Raises
    ------
    GradingError
        If it is not a valid notebook of format 4.5 or later (cells have ids from 4.5 on).
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
    """Return the student version of a notebook: without solutions, instructor's cells, outputs, and traces of a run.

    Answers are labelled and have their points; cells are protected against edits and deletion.

    Parameters
    ----------
    notebook : the instructor's
    name : file name of the notebook, for messages
    catalogue : of the course, for the points

    Raises
    ------
    GradingError
        If a solution would stay in it: markers that do not pair, or an answer cell without any. If a cell records what
        the catalogue does not have, or is for an answer in words and does not name the question.
    """
    answered = _answered(notebook, name, catalogue)
    cells: list[NotebookNode] = []
    for cell in notebook.cells:
        if INSTRUCTOR_TAG in cell.metadata.get("tags", []):
            continue
        source = _released_source(cell, f"{name}, cell {cell.id!r}")
        if cell.cell_type == "code" and is_answer(cell) and (questions := ", ".join(answered[cell.id][1])):
            _label_answer(cells, cell.id, questions)
            if not source.startswith("%%"):  # a cell magic must come first
                source = f"# {words.MARK} Your answer: {questions} ".ljust(_WIDTH, "─") + f"\n{source}"
        metadata = {key: cell.metadata[key] for key in _CELL_METADATA if key in cell.metadata} | _protection(cell)
        if is_answer(cell):  # so that a later release knows whether the student has written in it
            metadata[words.KEY] = {**metadata.get(words.KEY, {}), STUB_KEY: stub_digest(source)}
            metadata["nbgrader"] = {**cell.metadata.nbgrader, "points": answered[cell.id][0]}
        released = NotebookNode(id=cell.id, cell_type=cell.cell_type, metadata=NotebookNode(metadata), source=source)
        if cell.cell_type == "code":
            released.update(execution_count=None, outputs=[])
        elif pictures := {name: data for name, data in cell.get("attachments", {}).items() if _is_shown(source, name)}:
            released["attachments"] = pictures
        cells.append(released)
    kernel = {key: value for key, value in notebook.metadata.items() if key == "kernelspec"}
    notebook_metadata = {"language_info": {"name": "python"}, **kernel}
    version = {"nbformat": notebook.nbformat, "nbformat_minor": notebook.nbformat_minor}
    return NotebookNode(nbformat.from_dict({"cells": cells, "metadata": notebook_metadata, **version}))


def is_derived(notebook: NotebookNode) -> bool:
    """Return whether a notebook is a student version without any outputs."""
    return all(cell.metadata.get("deletable") is False and not cell.get("outputs") for cell in notebook.cells)


def _released_source(cell: NotebookNode, where: str) -> str:
    """Return the source of a cell as students get it; ``where`` names the cell for messages.

    Raises
    ------
    GradingError
        If a solution would stay in it or is not in an answer cell, or a text cell for an answer names no question.
    """
    in_words = is_answer(cell) and cell.cell_type == "markdown"
    if in_words and words.where_of(cell) is None:
        raise GradingError(f'{where}: its metadata should have "{words.KEY}": {{"question": ..., "part": ...}}.')
    begin, end, stub = (words.BEGIN, words.END, words.STUB) if in_words else (BEGIN_CODE, END_CODE, CODE_STUB)
    source = _without_solutions(cell.source, where, begin, end, stub)
    if is_answer(cell) and source == cell.source:
        raise GradingError(f"{where}: an answer cell without {begin!r} would be released with its solution.")
    if cell.cell_type != "code" and not in_words and source != cell.source:
        raise GradingError(f"{where}: a solution must be in a code cell, or in an answer cell.")
    return source


def _protection(cell: NotebookNode) -> dict[str, bool]:
    """Return the metadata by which JupyterLab protects a cell: only answers can be edited, and nothing can be deleted.

    Cells with the tags "parameters" and "open" can be edited, too.
    """
    tags = cell.metadata.get("tags", [])
    if is_answer(cell) or PARAMETERS_TAG in tags or OPEN_TAG in tags:
        return {"deletable": False}
    return {"deletable": False, "editable": False}


def _label_answer(cells: list[NotebookNode], answer: str, questions: str) -> None:
    """Put a coloured line above an answer cell with code, which cannot be coloured itself.

    The line ends the course's text just before the answer, or is a text cell of its own.

    Parameters
    ----------
    cells : the released cells before the answer, to which the line is added
    answer : id of the answer cell
    questions : numbers of the questions that it answers, as text
    """
    label = words.heading(f"Your answer: {questions} (code, in the next cell)")
    if cells and cells[-1].cell_type == "markdown" and not is_answer(cells[-1]):
        cells[-1].source += f"\n\n{label}"
        return
    metadata = NotebookNode(deletable=False, editable=False)
    cells.append(NotebookNode(id=f"{answer}-here", cell_type="markdown", metadata=metadata, source=label))


def _is_shown(source: str, name: str) -> bool:
    """Return whether the source of a text cell shows the attached picture of this name."""
    return f"attachment:{name}" in source or f"attachment:{quote(name)}" in source


def text(notebook: NotebookNode) -> str:
    """Return the text of a notebook's file; the same notebook gives the same text."""
    return str(nbformat.writes(notebook, version=nbformat.NO_CONVERT)).rstrip("\n") + "\n"


def without_links(text: str, notebooks: Collection[str]) -> str:
    """Return a notebook's text with links to some notebooks, named without ending, replaced by their texts."""
    return _links_to(notebooks).sub(r"\1", text) if notebooks else text


def without_lines(content: str, notebooks: Collection[str]) -> str:
    """Return a notebook's text without the lines in its cells that link to some notebooks, named without ending."""
    if not notebooks or not (link := _links_to(notebooks)).search(content):
        return content
    notebook = nbformat.reads(content, as_version=nbformat.NO_CONVERT)
    for cell in notebook.cells:
        cell.source = "\n".join(line for line in cell.source.split("\n") if not link.search(line))
    return text(notebook)


def _links_to(notebooks: Collection[str]) -> re.Pattern[str]:
    """Return the pattern of a link to one of some notebooks, named without ending; its group is the link's text."""
    return re.compile(rf"\[([^\[\]]*)\]\((?:{'|'.join(map(re.escape, notebooks))})\.ipynb[^)\s]*\)")


def is_answer(cell: Mapping[str, Any]) -> bool:
    """Return whether a cell of a course notebook is one that students fill in."""
    return bool(cell["metadata"].get("nbgrader", {}).get("solution", False))


def set_points(notebook: NotebookNode, name: str, catalogue: Catalogue) -> bool:
    """Write the catalogue's points into the metadata of a notebook's answer cells; return whether any changed.

    Raises
    ------
    GradingError
        If a cell records what the catalogue does not have.
    """
    changed = False
    answered = _answered(notebook, name, catalogue)
    for cell in notebook.cells:
        if cell.id in answered and cell.metadata.nbgrader.get("points") != answered[cell.id][0]:
            cell.metadata.nbgrader["points"], changed = answered[cell.id][0], True
    return changed


def _answered(notebook: NotebookNode, name: str, catalogue: Catalogue) -> dict[str, tuple[float, list[str]]]:
    """Find the points and questions of each answer cell: what it records, or cells up to the next code answer.

    Parameters
    ----------
    notebook : the instructor's
    name : file name of the notebook, for messages
    catalogue : of the course

    Returns
    -------
    dict
        Id of the answer cell → points, and numbers of the questions.

    Raises
    ------
    GradingError
        If a cell records what the catalogue does not have.
    """
    points: dict[str, float] = {cell.id: 0 for cell in notebook.cells if is_answer(cell)}
    questions: dict[str, dict[str, None]] = {cell: {} for cell in points}
    answer_of, latest = dict[str, str](), ""  # cell → the answer that it records: itself, or the last one with code
    for cell in notebook.cells:
        latest = cell.id if is_answer(cell) and cell.cell_type == "code" else latest
        answer_of[cell.id] = cell.id if is_answer(cell) else latest
    for entry in recorded(notebook.cells):
        try:
            question = catalogue.find(entry.question)
            earned = sum(question.part(part).points for part in entry.of(question))
        except AnswerError as error:
            raise GradingError(f"{name}, cell {entry.cell!r}: {error}") from None
        if answer := answer_of[entry.cell]:
            points[answer] += earned
            questions[answer][entry.question] = None
    return {cell: (int(p) if p == int(p) else p, list(questions[cell])) for cell, p in points.items()}


def _without_solutions(source: str, where: str, begin: str, end: str, stub: str) -> str:
    """Return a source with a stub in place of each solution.

    Parameters
    ----------
    source : of a cell
    where : names the cell, for messages
    begin, end : lines between which a solution stands
    stub : line to put in its place

    Raises
    ------
    GradingError
        If the lines do not pair, or one is almost such a line.
    """
    lines, inside = [], False
    for line in source.split("\n"):
        marker = line.strip()
        if marker == (end if inside else begin):
            if not inside:
                lines.append(line[: len(line) - len(line.lstrip())] + stub)
            inside = not inside
        elif marker in (begin, end):
            raise GradingError(f"{where}: {marker!r} without its {'end' if inside else 'beginning'}.")
        elif _ALMOST_A_MARKER.search(line):
            raise GradingError(f"{where}: {marker!r} should be exactly {begin!r} or {end!r}, alone on its line.")
        elif not inside:
            lines.append(line)
    if inside:
        raise GradingError(f"{where}: {begin!r} without its end.")
    return "\n".join(lines)
