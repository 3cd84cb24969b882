"""Read students' notebooks, at home and where they are graded. They are untrusted files, which may hold anything.

Broken cells are repaired as far as possible. A run needs no outputs: :meth:`Notebook.without_outputs` drops those of
each cell as soon as they are parsed.
"""

from __future__ import annotations

import ast
import importlib
import json
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from labcourse import course_file, courses, files
from labcourse.errors import ConfigurationError
from labcourse.patterns import CELL, pattern
from labcourse.problems import Code, Problem
from labcourse.sentences import sentence

if TYPE_CHECKING:
    from labcourse.answers.catalogue import Catalogue


MAX_FILE = 100_000_000  #: bytes of a notebook with its outputs, which are dropped
MAX_NOTEBOOK = 5_000_000  #: bytes of it without outputs and pictures
MAX_PICTURES = 15_000_000  #: bytes of the pictures pasted into the text cells of one notebook, as they are stored
MAX_PARTS = 10_000_000  #: brackets, braces, commas and quotes in a notebook, and in all that are read of a submission
MAX_CELLS = 1_000  #: of a notebook; ten times what a long one has
MAX_LINES = 50_000  #: of all its cells, as many as fit into :data:`MAX_NOTEBOOK`
MAX_SOURCE = 200_000  #: characters of a cell; thousands of lines
MAX_TEXT = CELL  #: characters of a text cell, which may hold pictures, as Colab writes them
CODE, TEXT, RAW = "code", "markdown", "raw"  #: kinds of cells
UNREADABLE = "unreadable"  #: kind of a cell with a source that is too long; the source is left out

_TYPES = {"nbgrader": dict, "labcourse": dict, "tags": list}  # of those entries of a cell's metadata that are used
_LONGEST_LANGUAGE = 2_000  # bytes that Jupyter writes about the language
_VERSION = pattern(rb'"version"\s*:\s*"([\d.]+)', _LONGEST_LANGUAGE)
_DROPPED = ("outputs", "widgets")  # of cells, and of the notebook's metadata


class NotebookError(Exception):
    """A notebook that cannot be read; ``problem`` says why."""

    def __init__(self, problem: Problem) -> None:
        super().__init__(problem)
        self.problem = problem

    def __str__(self) -> str:
        return sentence(self.problem)


def why_unread(error: OSError | NotebookError) -> Problem:
    """Return why a notebook's file cannot be read."""
    if isinstance(error, NotebookError):
        return error.problem
    return Problem.of(Code.SYSTEM_ERROR, error=files.reason(error))


@dataclass(frozen=True)
class Cell:
    """A cell of a student's notebook.

    Attributes
    ----------
    id : "" where the file has none
    grade_id : from its grading metadata, which editors keep that renew ids; "" where there are none
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
    """All that counts of a student's work.

    Attributes
    ----------
    notebooks : notebook's file name → its cells
    files : the student's own files beside the notebooks: relative path, with "/" → content
    claim : their own answers.json, which is only compared with what a run records
    course : content of their course.json
    reports : file name of a report's PDF → its content; no run needs it
    """

    notebooks: Mapping[str, tuple[Cell, ...]] = field(default_factory=dict)
    files: Mapping[str, bytes] = field(default_factory=dict)
    claim: bytes | None = None
    course: Mapping[str, Any] = field(default_factory=dict)
    reports: Mapping[str, bytes] = field(default_factory=dict)


@dataclass(frozen=True)
class Notebook:
    """A notebook in format 4, except that a cell has an id only if it has one in the file.

    Attributes
    ----------
    content : as in the file, but without unknown entries, and without entries in the list of cells that are no cells
    problems : each thing that was left out for its size
    python : version of the Python that it was saved with, as "3.12.1"; "" if unknown. :meth:`read` leaves it out.
    """

    content: dict[str, Any]
    problems: tuple[Problem, ...] = ()
    python: str = ""

    @classmethod
    def read(cls, data: bytes, **hooks: Any) -> Notebook:
        """Read a notebook's file with its outputs, and repair what can be repaired.

        Parameters
        ----------
        data : the file's content
        hooks : for :func:`json.loads`

        Raises
        ------
        NotebookError
            If it is not a notebook with cells.
        """
        try:
            content = files.from_json(data, **hooks)
        except ValueError as error:
            raise NotebookError(Problem.of(Code.NOT_JSON, error=str(error))) from None
        cells = content.get("cells") if isinstance(content, dict) else None
        if not isinstance(cells, list):
            raise NotebookError(Problem.of(Code.NO_CELLS))
        if len(cells) > MAX_CELLS:
            raise NotebookError(Problem.of(Code.TOO_MANY_CELLS, most=MAX_CELLS))
        about = {name: content[name] for name in ("metadata", "nbformat", "nbformat_minor") if name in content}
        if not isinstance(about.get("metadata", {}), dict):
            del about["metadata"]
        return cls({"cells": [_repaired(cell) for cell in cells if isinstance(cell, dict)], **about})

    @classmethod
    def without_outputs(cls, data: bytes) -> Notebook:
        """Read a notebook's file as far as grading needs it, with limits on the size of what is read.

        Raises
        ------
        NotebookError
            If it is not a notebook with cells, or too large without its outputs.
        """
        if len(data) > MAX_FILE:
            raise NotebookError(Problem.of(Code.NOTEBOOK_TOO_LARGE, most=MAX_FILE))
        if parts_in(data) > MAX_PARTS:
            raise NotebookError(Problem.of(Code.TOO_MANY_PARTS, most=MAX_PARTS))
        notebook = cls.read(data, object_pairs_hook=_needed)
        sizes = Counter[str]()
        for cell in notebook.cells:
            sizes[cell.kind] += len(cell.source.encode())
        if sum(len(cell.source.splitlines()) for cell in notebook.cells) > MAX_LINES:
            raise NotebookError(Problem.of(Code.TOO_MANY_LINES, most=MAX_LINES))
        for kind, size in sizes.items():
            # Some editors put pictures into the text itself.
            if size > (most := MAX_PICTURES if kind == TEXT else MAX_NOTEBOOK):
                raise NotebookError(Problem.of(Code.CELLS_TOO_LARGE, kind=kind, most=most))
        problems = tuple(notebook._drop_pictures())
        language = max(data.rfind(b'"language_info"'), 0)
        version = _VERSION.search(data, language, language + _LONGEST_LANGUAGE)
        return replace(notebook, problems=problems, python=version[1].decode() if version else "")

    @property
    def cells(self) -> tuple[Cell, ...]:
        """The cells, without their outputs."""
        return tuple(map(_as_cell, self.content["cells"]))

    def _drop_pictures(self) -> Iterator[Problem]:
        """Drop the attachments that exceed the limit of all together, and yield a problem for each."""
        size = 0
        for place, cell in enumerate(self.content["cells"], 1):
            for name, content in [*cell.get("attachments", {}).items()]:
                added = len(name) + sum(len(kind) + sum(map(len, data)) for kind, data in content.items())
                if size + added > MAX_PICTURES:
                    yield Problem.of(Code.PASTED_PICTURE_LEFT_OUT, picture=name, cell=place)
                    del cell["attachments"][name]
                else:
                    size += added


def parts_in(data: bytes) -> int:
    """Count the parts of a notebook's file: what reading it costs."""
    return sum(map(data.count, (b"[", b"{", b",", b'"')))


def _needed(pairs: Iterable[tuple[str, Any]]) -> dict[str, Any]:
    """Return an object of a notebook's file without its outputs."""
    return {name: value for name, value in pairs if name not in _DROPPED}


def as_released(notebook: Mapping[str, Any], answers: Mapping[str, str] | None = None) -> tuple[Cell, ...]:
    """Return the cells of a student who wrote these answers into a notebook of the course, and changed nothing else.

    Parameters
    ----------
    notebook : as released
    answers : cell's id → what was written there
    """
    cells = Notebook(dict(notebook)).cells
    return tuple(replace(cell, source=(answers or {}).get(cell.id, cell.source)) for cell in cells)


def to_bytes(cells: Sequence[Cell]) -> bytes:
    """Return cells as a notebook's file; :meth:`Notebook.read` gives the same cells again."""
    content: list[dict[str, Any]] = []
    for cell in cells:
        metadata = {"nbgrader": {"grade_id": cell.grade_id}} if cell.grade_id else {}
        content.append({"cell_type": cell.kind, "id": cell.id, "metadata": metadata, "source": cell.source})
        if cell.attachments:
            content[-1]["attachments"] = {name: dict(data) for name, data in cell.attachments.items()}
    return json.dumps({"cells": content}, sort_keys=True, separators=(",", ":")).encode()


# --- repair -----------------------------------------------------------------------------------------------------------


def _repaired(cell: Mapping[str, Any]) -> dict[str, Any]:
    """Return a cell in format 4, keys sorted as JupyterLab writes them."""
    metadata, kind = cell.get("metadata"), cell.get("cell_type")
    entries = metadata.items() if isinstance(metadata, dict) else ()
    repaired: dict[str, Any] = {
        "cell_type": kind if kind in (CODE, TEXT, UNREADABLE) else RAW,
        "metadata": {key: value for key, value in entries if isinstance(value, _TYPES.get(key, object))},
        "source": _source(cell.get("source")),
    }
    if isinstance(cell.get("id"), str):
        repaired["id"] = cell["id"]
    if kind == CODE:
        count, outputs = cell.get("execution_count"), cell.get("outputs")
        repaired["execution_count"] = count if type(count) is int else None
        repaired["outputs"] = [*filter(_can_be_opened, outputs)] if isinstance(outputs, list) else []
    elif isinstance(attachments := cell.get("attachments"), dict):
        repaired["attachments"] = {
            name: {media: data for media, data in content.items() if _is_text(data)}
            for name, content in attachments.items()
            if isinstance(content, dict)
        }
    return dict(sorted(repaired.items()))


def _can_be_opened(output: Any) -> bool:
    """Check whether JupyterLab opens a notebook with this output."""
    return (
        isinstance(output, dict)
        and isinstance(output.get("output_type"), str)
        and isinstance(output.get("data", {}), dict)
        and _is_text(output.get("text", ""))
    )


def _is_text(value: Any) -> bool:
    """Check whether a value is text, or a list of its lines."""
    return all(isinstance(line, str) for line in (value if isinstance(value, list) else [value]))


def _source(source: Any) -> str | list[str]:
    """Return text, or its lines; other values as JSON, so that nothing is lost."""
    if isinstance(source, list):
        return [line if isinstance(line, str) else json.dumps(line) for line in source]
    return source if isinstance(source, str) else "" if source is None else json.dumps(source)


def _as_cell(cell: Mapping[str, Any]) -> Cell:
    """Return a repaired cell without its outputs."""
    kind, source = cell["cell_type"], "".join(cell["source"])
    if len(source) > (MAX_TEXT if kind == TEXT else MAX_SOURCE):
        kind, source = UNREADABLE, ""
    grade_id = cell.get("metadata", {}).get("nbgrader", {}).get("grade_id")
    attachments = {
        name: {media: "".join(data) for media, data in content.items()}
        for name, content in (cell.get("attachments", {}) if kind == TEXT else {}).items()
    }
    return Cell(cell.get("id", ""), grade_id if isinstance(grade_id, str) else "", kind, source, attachments)


# --- the course as released -------------------------------------------------------------------------------------------


def masters() -> dict[str, dict[str, Any]]:
    """Return the masters of the current course: file name → content, in order.

    Raises
    ------
    ConfigurationError
        If there are none.
    """
    paths = sorted(courses.current().notebooks.glob("*.ipynb"))
    return {path.name: json.loads(path.read_text(encoding="utf-8")) for path in paths}


def release() -> str:
    """Return the name of the installed release; "" without one, as in a checkout."""
    try:
        name = (course_file.read(courses.current().notebooks) or {}).get(course_file.RELEASE_KEY)
    except ConfigurationError:
        return ""
    return name if isinstance(name, str) else ""


def imports_of(notebooks: Mapping[str, dict[str, Any]]) -> tuple[str, ...]:
    """Return the import statements of masters, each once, in order."""
    statements = (statement for notebook in notebooks.values() for statement in _statements(notebook))
    imports = (one for one in statements if isinstance(one, ast.Import | ast.ImportFrom))
    return tuple(dict.fromkeys(map(ast.unparse, imports)))


def packages_of(notebooks: Mapping[str, dict[str, Any]]) -> tuple[str, ...]:
    """Return the top-level packages that masters import, and ``labcourse``."""
    names = {name.partition(".")[0] for notebook in notebooks.values() for name in _modules(notebook)}
    return tuple(sorted({*names, "labcourse"}))


def catalogue_of(notebooks: Mapping[str, dict[str, Any]]) -> Catalogue:
    """Find the catalogue of the masters' course: the ``CATALOGUE`` of a module that they import.

    Raises
    ------
    ConfigurationError
        If no such module has one.
    """
    from labcourse.answers.catalogue import Catalogue

    for name in dict.fromkeys(name for notebook in notebooks.values() for name in _modules(notebook)):
        try:
            catalogue = getattr(importlib.import_module(name), "CATALOGUE", None)
        except ImportError:  # ``from a import b`` may name no module
            continue
        if isinstance(catalogue, Catalogue):
            return catalogue
    raise ConfigurationError("No module that the course's notebooks import has the course's questions (CATALOGUE).")


def asked_of(notebooks: Mapping[str, dict[str, Any]], folder: Path) -> Catalogue:
    """Return the catalogue for a student's folder: some releases ask less than the whole course.

    Raises
    ------
    ConfigurationError
        If no module has a catalogue, or the folder's ``course.json`` cannot be understood.
    """
    return catalogue_of(notebooks).of_release(course_file.of(folder) or {})


def _modules(notebook: dict[str, Any]) -> Iterator[str]:
    """List the names that a master imports, which may be modules; a course's ``lab`` first, which has its catalogue."""
    names = []
    for statement in _statements(notebook):
        match statement:
            case ast.Import(names=aliases):
                names += [alias.name for alias in aliases]
            case ast.ImportFrom(module=str() as module, names=aliases, level=0):
                names += [module, *(f"{module}.{alias.name}" for alias in aliases)]
    return iter(sorted(names, key=lambda name: not name.endswith(".lab")))


def _statements(notebook: dict[str, Any]) -> Iterator[ast.stmt]:
    """Parse the code cells; cells that are not plain Python are skipped."""
    for cell in notebook["cells"]:
        if cell["cell_type"] == "code":
            try:
                yield from ast.parse("".join(cell["source"])).body
            except SyntaxError:
                continue
