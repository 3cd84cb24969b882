"""The course as it was handed out: its notebooks, and what they say of the course they belong to.

A notebook as handed out is a *master*: what a student's own is held against.
"""

from __future__ import annotations

import ast
import importlib
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from labcourse import course_file, courses
from labcourse.errors import ConfigurationError

if TYPE_CHECKING:  # the command begins here, and is quick to say what it can do
    from labcourse.answers.catalogue import Catalogue

Notebook = dict[str, Any]  #: as in the file


def masters() -> dict[str, Notebook]:
    """Return the notebooks of the course that is worked on, as handed out: file name → content, in order.

    Raises
    ------
    ConfigurationError
        If there are none.
    """
    paths = sorted(courses.current().notebooks.glob("*.ipynb"))
    return {path.name: json.loads(path.read_text(encoding="utf-8")) for path in paths}


def release() -> str:
    """The name of the release that is installed; "" where there is none, as in a checkout."""
    try:
        named = (course_file.read(courses.current().notebooks) or {}).get(course_file.RELEASE)
    except ConfigurationError:
        return ""
    return named if isinstance(named, str) else ""


def imports_of(notebooks: Mapping[str, Notebook]) -> tuple[str, ...]:
    """The import statements of masters, each once, in order."""
    found = [
        ast.unparse(statement)
        for notebook in notebooks.values()
        for statement in _statements(notebook)
        if isinstance(statement, ast.Import | ast.ImportFrom)
    ]
    return tuple(dict.fromkeys(found))


def packages_of(notebooks: Mapping[str, Notebook]) -> tuple[str, ...]:
    """Return top-level names of the modules that work needs: those that masters import, and ``labcourse``."""
    names = {name.partition(".")[0] for notebook in notebooks.values() for name in _modules(notebook)}
    return tuple(sorted({*names, "labcourse"}))


def catalogue_of(notebooks: Mapping[str, Notebook]) -> Catalogue:
    """The catalogue of the course that masters belong to: the ``CATALOGUE`` of a module that they import.

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
    raise ConfigurationError(
        "None of the modules that the course's notebooks import has the course's questions (CATALOGUE)."
    )


def asked_of(notebooks: Mapping[str, Notebook], folder: Path) -> Catalogue:
    """The catalogue of what is asked of whoever works in a folder: a class may begin in the middle.

    Raises
    ------
    ConfigurationError
        If no module has a catalogue, or the folder's ``course.json`` cannot be understood.
    """
    from labcourse.answers import starts

    catalogue = catalogue_of(notebooks)
    return starts.narrowed(catalogue, starts.chosen(course_file.of(folder) or {}, catalogue))


def _modules(notebook: Notebook) -> Iterator[str]:
    """Modules that a master imports, or may, those first whose name says that they are a course's laboratory."""
    names = []
    for statement in _statements(notebook):
        match statement:
            case ast.Import(names=aliases):
                names += [alias.name for alias in aliases]
            case ast.ImportFrom(module=str() as module, names=aliases, level=0):
                names += [module, *(f"{module}.{alias.name}" for alias in aliases)]
    return iter(sorted(names, key=lambda name: not name.endswith(".lab")))


def _statements(notebook: Notebook) -> Iterator[ast.stmt]:
    """Statements of the code cells; cells that are not Python alone have none."""
    for cell in notebook["cells"]:
        if cell["cell_type"] == "code":
            try:
                yield from ast.parse("".join(cell["source"])).body
            except SyntaxError:
                continue
