"""Notebooks of a course that are written as text with cells (jupytext's percent format).

The text is ``NAME.py`` in the course's folder, and ``NAME.ipynb`` beside it is made of it. The name begins with a
digit, unlike those of modules. A cell begins with one of these lines::

    # %% [markdown]                text
    # %%                           code of the course's
    # %% answer 1.3                the solution of a question: of all its parts that no other cell has
    # %% answer 1.3 omega          of some of its parts
    # %% words 1.4 why [markdown]  the model answer in words
    # %% front Report [markdown]   the entries that students fill in: authors, captions, sources of a report

The cells of the parameters and of the setup are added after the first text, and a cell that records the answer after
each solution. A solution without ``### BEGIN SOLUTION`` is all of its cell; the names of its parts are preset
before it.
"""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from nbformat import NotebookNode
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook

from labcourse import files
from labcourse.answers import words
from labcourse.answers.parts import Part, Question
from labcourse.errors import AnswerError, GradingError
from labcourse.grading.course import Course
from labcourse.grading.release import student_notebooks
from labcourse.grading.release.student_notebooks import BEGIN_CODE, END_CODE, OPEN_TAG, PARAMETERS_TAG
from labcourse.report.contents import FRONT

_MADE_OF = "made of"  # of a notebook's metadata: the file name of its text
_NO_NAME = "-"  # id of a cell until it is named
_SETUP = "import {module}\n\nlab = {module}.start(student)"


def outdated(course: Course) -> dict[Path, NotebookNode]:
    """Make the notebooks that are written as text, and return those that differ from their files, or have none.

    Outputs are not compared. Nothing is written.

    Returns
    -------
    dict
        Path → notebook as its text gives it now.

    Raises
    ------
    GradingError
        If a cell answers what the catalogue does not have, or is not written as it should be.
    """
    texts = [path for path in sorted(course.folder.glob("[0-9]*.py")) if path.stem not in course.off]
    notebooks = {path.with_suffix(".ipynb"): notebook(path.read_text("utf-8"), path.name, course) for path in texts}
    return {
        path: made
        for path, made in notebooks.items()
        if not path.is_file() or _content(student_notebooks.read(path)) != _content(made)
    }


def write(course: Course) -> None:
    """Make the notebooks of a course that are written as text, and remove those of a text that was renamed.

    Raises
    ------
    GradingError
        If a cell answers what the catalogue does not have.
    """
    for path, made in outdated(course).items():
        files.write(path, student_notebooks.text(made))
    for path in course.notebooks:
        text = student_notebooks.read(path).metadata.get(_MADE_OF)
        if text and not (course.folder / text).is_file() and path.stem not in course.catalogue.notebooks:
            path.unlink()


def _content(notebook: NotebookNode) -> list[Any]:
    """Return what is compared of a notebook: id, type, source and tags of its cells."""
    return [(cell.id, cell.cell_type, cell.source, cell.metadata.get("tags")) for cell in notebook.cells]


def notebook(text: str, name: str, course: Course) -> NotebookNode:
    """Make a notebook from its text.

    Parameters
    ----------
    text : in the percent format, as this module describes it
    name : file name of the text
    course : for its catalogue, its parameters and the first of its imports, which notebooks begin with

    Raises
    ------
    GradingError
        If a cell answers what the catalogue does not have.
    """
    import jupytext

    written = jupytext.reads(text, fmt="py:percent").cells
    made: NotebookNode = new_notebook(cells=list(_CellMaker(course, name).make(written)))
    student_notebooks.set_points(made, name, course.catalogue)
    made.metadata[_MADE_OF] = name
    return made


class _CellMaker:
    """Makes the cells of a notebook from those of its text.

    Parameters
    ----------
    course : for its catalogue, its parameters and its imports
    name : file name of the text, for messages
    """

    def __init__(self, course: Course, name: str) -> None:
        self._course, self._name = course, name
        self._separate: set[tuple[str, str]] = set()  # (question, part) of the parts that have separate cells

    def make(self, written: list[NotebookNode]) -> Iterator[NotebookNode]:
        """Make the cells, in order, from those of the text. A cell without a name is named after the next answer.

        Raises
        ------
        GradingError
            If a cell answers what the catalogue does not have, or is not written as it should be, or two have one name.
        """
        titled = [(cell, *self._question_and_parts(cell.metadata.get("title", ""))) for cell in written]
        self._separate = {(question.number, part.name) for _, question, parts in titled if question for part in parts}
        for title, count in Counter(cell.metadata.get("title", "") for cell in written).items():
            if title and count > 1:
                raise GradingError(f"{self._name}: {count} cells begin with # %% {title}; one cell has a name.")
        waiting: list[NotebookNode] = []
        for place, (cell, question, parts) in enumerate(titled):
            made = [] if question is None else [*self._answer_cells(cell, question, parts)]
            waiting += [] if made else [_course_cell(cell)]
            if made or (place == 0 and cell.cell_type == "markdown"):
                yield from (*_with_names(waiting, made[0].id if made else "title"), *made)
                waiting = []
            if place == 0:
                yield from self._opening_cells()
        yield from _with_names(waiting, "end")

    def _question_and_parts(self, title: str) -> tuple[Question | None, tuple[Part, ...]]:
        """Read what stands after ``# %%``, as "answer 1.3 omega": the question that a cell answers, and its parts.

        For a cell that answers nothing, the question is None. The number of a question may have spaces in it: the
        longest one with which the rest of the title begins is taken.
        """
        kind, _space, rest = title.partition(" ")
        if kind not in ("answer", "words"):
            return None, ()
        numbers = [number for number in self._course.catalogue.everything if f"{rest} ".startswith(f"{number} ")]
        try:
            question = self._course.catalogue.find(max(numbers, key=len, default=rest))
            return question, tuple(map(question.part, rest[len(question.number) :].split()))
        except AnswerError as error:
            raise GradingError(f"{self._name}, cell {title!r}: {error}") from None

    def _answer_cells(self, cell: NotebookNode, question: Question, parts: tuple[Part, ...]) -> Iterator[NotebookNode]:
        """Make the cell of an answer to some parts (none: all others); and after code, the cell that records it."""
        number = re.sub(r"\W+", "-", question.number).lower()
        name = "-".join([f"q{number}" if number[0].isdigit() else number, *(part.name for part in parts)])
        if cell.metadata.title.startswith("words "):
            if len(parts) != 1 or cell.cell_type != "markdown":
                raise GradingError(f"{self._name}: begin a cell for words as # %% words 1.4 why [markdown].")
            heading = words.heading(f"Your answer: {question.number}, {parts[0].name}")
            source = f"{heading}\n\n{words.BEGIN}\n{cell.source}\n{words.END}"
            answered = {words.KEY: {"question": question.number, "part": parts[0].name}}
            yield new_markdown_cell(source, id=name, metadata={**answered, **_nbgrader_metadata(name, "markdown")})
            return
        asked = parts or [part for part in question.parts if (question.number, part.name) not in self._separate]
        source = cell.source
        if BEGIN_CODE not in source:
            presets = [f"{part.name} = None{f'  # {part.unit}' if part.unit else ''}" for part in asked]
            source = "\n".join([*presets, BEGIN_CODE, source, END_CODE])
        yield new_code_cell(source, id=name, metadata=_nbgrader_metadata(name, "code"))
        arguments = ", ".join(f"{part.name}={part.name}" for part in asked)
        yield _locked_cell(f"{name}-answer", f'lab.answer("{question.number}", {arguments})')

    def _opening_cells(self) -> Iterator[NotebookNode]:
        """Make the cells of the parameters and of the setup, with which each notebook begins.

        Raises GradingError if the course names no module to import.
        """
        if not self._course.imports:
            raise GradingError("course.py should name the module that notebooks begin with, as imports=(...).")
        parameters = {"student": "", **self._course.parameters}
        source = "\n".join(f"{name} = {json.dumps(value, ensure_ascii=False)}" for name, value in parameters.items())
        yield new_code_cell(source, id="parameters", metadata={"tags": [PARAMETERS_TAG]})
        yield _locked_cell("setup", _SETUP.format(module=self._course.imports[0]))


def _course_cell(cell: NotebookNode) -> NotebookNode:
    """Make a cell of the course's own text or code, or for a report's entries (front). Its title becomes its id."""
    title, metadata = cell.metadata.get("title", ""), {"tags": cell.metadata.tags} if "tags" in cell.metadata else {}
    kind, _space, report = title.partition(" ")
    name = re.sub(r"[^a-z0-9]+", "-", title.lower()).strip("-") or _NO_NAME
    if kind == "front":
        source = f"{words.heading('Your text: authors, captions and sources')}\n\n{cell.source}"
        name = f"{report.lower().replace(' ', '-')}-front"
        return NotebookNode(
            new_markdown_cell(source, id=name, metadata={words.KEY: {FRONT: report}, "tags": [OPEN_TAG]})
        )
    if cell.cell_type != "code":
        return NotebookNode(new_markdown_cell(cell.source, id=name, metadata=metadata))
    code = _locked_cell(name, cell.source)
    code.metadata.update(metadata)
    return code


def _with_names(cells: list[NotebookNode], name: str) -> Iterator[NotebookNode]:
    """Yield cells; give those without an id one from ``name``: "title", "q1-1-text", "q1-1-text-2", "q1-1-code"."""
    counted = Counter[str]()
    for cell in cells:
        if cell.id == _NO_NAME:
            kind = "text" if cell.cell_type == "markdown" else "code"
            counted[kind] += 1
            stem = name if name == "title" else f"{name}-{kind}"
            cell.id = stem + (f"-{counted[kind]}" if counted[kind] > 1 else "")
        if cell.cell_type == "code":
            cell.metadata.nbgrader.grade_id = cell.id
        yield cell


def _locked_cell(name: str, source: str) -> NotebookNode:
    """Make a code cell that is no answer and that students cannot edit; ``name`` is its id."""
    return NotebookNode(new_code_cell(source, id=name, metadata=_nbgrader_metadata(name, "code", answer=False)))


def _nbgrader_metadata(name: str, kind: str, answer: bool = True) -> dict[str, Any]:
    """Return the metadata that mark an answer, or a locked cell, in nbgrader's schema; kind is "code" or "markdown"."""
    nbgrader = {"grade": answer, "grade_id": name, "locked": not answer, "schema_version": 3}
    nbgrader |= {"solution": answer, "task": False}
    return {"nbgrader": nbgrader | ({"cell_type": kind} if kind == "markdown" else {})}
