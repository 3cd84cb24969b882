"""The course's notebooks: what a student gets of an instructor's notebook, and which of its cells are answers.

In an instructor's notebook, the part of an answer cell that students are to write stands between two lines,
``### BEGIN SOLUTION`` and ``### END SOLUTION``; cells tagged ``instructor`` are for instructors' eyes only. Points
stand in the catalogue alone, and are written into the cells here.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from rotflex.courseware.catalogue import Catalogue
from rotflex.courseware.messages import _
from rotflex.courseware.parts import Question
from rotflex.errors import AnswerError, GradingError

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
_KEPT_CELL_METADATA = ("deletable", "editable", "jupyter", "nbgrader", "tags")


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
        raise GradingError(_("{name} is not a valid notebook: {error}").format(name=path.name, error=error)) from None
    if (notebook.nbformat, notebook.nbformat_minor) < (4, 5):
        raise GradingError(
            _("{name} has format {major}.{minor}; save it as 4.5.").format(
                name=path.name, major=notebook.nbformat, minor=notebook.nbformat_minor
            )
        )
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
        the catalogue does not have.
    """
    points = points_of(notebook, name, catalogue)
    cells = []
    for cell in notebook.cells:
        if INSTRUCTOR_TAG in cell.metadata.get("tags", []):
            continue
        where = _("{name}, cell {cell!r}").format(name=name, cell=cell.id)
        source = _without_solutions(cell.source, where)
        if is_answer(cell) and source == cell.source:
            raise GradingError(
                _("{where}: an answer cell without {begin!r} would be released with its solution.").format(
                    where=where, begin=BEGIN
                )
            )
        if cell.cell_type != "code" and source != cell.source:
            raise GradingError(_("{where}: a solution must be in a code cell.").format(where=where))
        metadata = {key: cell.metadata[key] for key in _KEPT_CELL_METADATA if key in cell.metadata}
        if cell.id in points:
            metadata["nbgrader"] = {**cell.metadata.nbgrader, "points": points[cell.id]}
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


@dataclass(frozen=True)
class Recorded:
    """What a locked cell records: ``lab.answer(question, part=..., ...)``.

    Attributes
    ----------
    cell : id of the cell
    question : its number
    parts : names, or None where the call does not write them out (``**``)
    """

    cell: str
    question: str
    parts: tuple[str, ...] | None

    def of(self, question: Question) -> tuple[str, ...]:
        """The names, all of the question's where they are not written out."""
        return question.names if self.parts is None else self.parts


def recorded(notebook: NotebookNode) -> Iterator[Recorded]:
    """What the cells of a course notebook record, in order. (Cells that are not Python alone record nothing.)"""
    for cell in notebook.cells:
        if cell.cell_type != "code" or is_answer(cell):
            continue
        try:
            body = ast.parse(cell.source).body
        except SyntaxError:
            continue
        for statement in body:
            match statement:
                case ast.Expr(
                    value=ast.Call(
                        func=ast.Attribute(attr="answer"), args=[ast.Constant(value=str() as number)]
                    ) as call
                ):
                    names = [keyword.arg for keyword in call.keywords]
                    known = tuple(name for name in names if name is not None)
                    yield Recorded(cell.id, number, known if len(known) == len(names) else None)


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
    """Id of each answer cell → points of what is recorded of it before the next answer cell.

    Raises
    ------
    GradingError
        If a cell records what the catalogue does not have.
    """
    by_cell: dict[str, list[Recorded]] = {}
    for one in recorded(notebook):
        by_cell.setdefault(one.cell, []).append(one)
    points: dict[str, float] = {}
    latest = ""
    for cell in notebook.cells:
        if is_answer(cell):
            latest = cell.id
            points[latest] = 0
        for one in by_cell.get(cell.id, ()):
            try:
                question = catalogue.find(one.question)
                sums = sum(question.part(part).points for part in one.of(question))
            except AnswerError as error:
                raise GradingError(
                    _("{name}, cell {cell!r}: {error}").format(name=name, cell=cell.id, error=error)
                ) from None
            if latest:
                points[latest] += sums
    return {cell: int(value) if value == int(value) else value for cell, value in points.items()}


def _without_solutions(source: str, where: str) -> str:
    kept, inside = [], False
    for line in source.split("\n"):
        word = line.strip()
        if word == (END if inside else BEGIN):
            if not inside:
                kept.append(line[: len(line) - len(line.lstrip())] + STUB)
            inside = not inside
        elif word in (BEGIN, END):
            raise GradingError(
                _("{where}: {word!r} without its {which}.").format(
                    where=where, word=word, which=_("end") if inside else _("beginning")
                )
            )
        elif "BEGIN SOLUTION" in line.upper() or "END SOLUTION" in line.upper():
            raise GradingError(
                _("{where}: {word!r} should be exactly {begin!r} or {end!r}, alone on its line.").format(
                    where=where, word=word, begin=BEGIN, end=END
                )
            )
        elif not inside:
            kept.append(line)
    if inside:
        raise GradingError(_("{where}: {begin!r} without its end.").format(where=where, begin=BEGIN))
    return "\n".join(kept)
