"""The course as released: its notebooks, and the packages and catalogue that they import.

A notebook as released is a *master*: students' notebooks are compared with it.
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

if TYPE_CHECKING:  # for a quick --help
    from labcourse.answers.catalogue import Catalogue

Notebook = dict[str, Any]  #: as in the file


def masters() -> dict[str, Notebook]:
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
        name = (course_file.read(courses.current().notebooks) or {}).get(course_file.RELEASE)
    except ConfigurationError:
        return ""
    return name if isinstance(name, str) else ""


def imports_of(notebooks: Mapping[str, Notebook]) -> tuple[str, ...]:
    """Return the import statements of masters, each once, in order."""
    imports = [
        ast.unparse(statement)
        for notebook in notebooks.values()
        for statement in _statements(notebook)
        if isinstance(statement, ast.Import | ast.ImportFrom)
    ]
    return tuple(dict.fromkeys(imports))


def packages_of(notebooks: Mapping[str, Notebook]) -> tuple[str, ...]:
    """Return the top-level packages that masters import, and ``labcourse``."""
    names = {name.partition(".")[0] for notebook in notebooks.values() for name in _modules(notebook)}
    return tuple(sorted({*names, "labcourse"}))


def catalogue_of(notebooks: Mapping[str, Notebook]) -> Catalogue:
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


def asked_of(notebooks: Mapping[str, Notebook], folder: Path) -> Catalogue:
    """Return the catalogue for a student's folder: a class that begins in the middle is asked less.

    Raises
    ------
    ConfigurationError
        If no module has a catalogue, or the folder's ``course.json`` cannot be understood.
    """
    from labcourse.answers import starts

    catalogue = catalogue_of(notebooks)
    return starts.narrowed(catalogue, starts.chosen(course_file.of(folder) or {}, catalogue))


def _modules(notebook: Notebook) -> Iterator[str]:
    """List the names that a master imports, which may be modules; a course's ``lab`` first, which has its catalogue."""
    names = []
    for statement in _statements(notebook):
        match statement:
            case ast.Import(names=aliases):
                names += [alias.name for alias in aliases]
            case ast.ImportFrom(module=str() as module, names=aliases, level=0):
                names += [module, *(f"{module}.{alias.name}" for alias in aliases)]
    return iter(sorted(names, key=lambda name: not name.endswith(".lab")))


def _statements(notebook: Notebook) -> Iterator[ast.stmt]:
    """Parse the code cells; cells that are not plain Python are skipped."""
    for cell in notebook["cells"]:
        if cell["cell_type"] == "code":
            try:
                yield from ast.parse("".join(cell["source"])).body
            except SyntaxError:
                continue
