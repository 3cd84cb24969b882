"""Find what in a student's code works at home and may fail where it is graded: packages, and files."""

from __future__ import annotations

import ast
import contextlib
import importlib.metadata
import importlib.util
import os
import posixpath
import sys
import unicodedata
from collections.abc import Collection, Iterable, Iterator
from pathlib import Path

from labcourse.patterns import pattern
from labcourse.run.skippable_cells import NO_PYTHON

Version = tuple[int, int]  #: of Python: major, minor
HERE: Version = (sys.version_info.major, sys.version_info.minor)
_VERSION = pattern(r"(3)\.(\d{1,3})(?!\d)")
_NAME, _BETWEEN = pattern(r"[A-Za-z0-9._-]*"), pattern(r"[-_.]+")


def version(text: object) -> Version | None:
    """Return the version that a text begins with, as "3.12.1"; None if it is no such text."""
    match = _VERSION.match(text) if isinstance(text, str) else None
    return (int(match[1]), int(match[2])) if match else None


def version_text(python: Version) -> str:
    """Return a version as people write it: major and minor, with a dot."""
    return ".".join(map(str, python))


def not_packed(source: str, folder: Path, packed: Collection[str]) -> Iterator[str]:
    """Yield names in a source of files at home that are not handed in, and of such modules beside the folder.

    Parameters
    ----------
    source : of a cell or a module
    folder : from which relative names go
    packed : paths of the files that are handed in, with "/"
    """
    for node in _nodes(source):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            name = posixpath.normpath(unicodedata.normalize("NFC", node.value))
            if name not in packed and os.path.isfile(folder / node.value):
                yield node.value
    own = [name for name in imported(source) if f"{name}.py" not in packed and (folder.parent / f"{name}.py").is_file()]
    installed = importlib.metadata.packages_distributions() if own else ()
    yield from (f"../{name}.py" for name in own if name not in (*sys.stdlib_module_names, *installed))


def foreign(sources: Iterable[str], own: Iterable[str], packages: Collection[str]) -> list[str]:
    """Return the modules here that sources import, and that neither the course, Python nor the student brings.

    Parameters
    ----------
    sources : source code; code that cannot be parsed is ignored
    own : names of the student's own modules
    packages : the course's and labcourse; their distributions list what comes with them

    Returns
    -------
    list
        Names, in order; none if it is not known what the course brings.
    """
    known = {*own, *packages, "__main__", *sys.stdlib_module_names}
    names = {name for source in sources for name in imported(source)} - known
    if not names:
        return []
    homes = importlib.metadata.packages_distributions()
    starts = [home for package in packages for home in homes.get(package, (package,))]
    brought = _with_requirements(starts)
    if brought <= {_canonical(start) for start in starts}:
        return []
    others = (name for name in names if not brought & {_canonical(home) for home in homes.get(name, ())})
    return sorted(name for name in others if name in homes or importlib.util.find_spec(name))  # else the run says so


def imported(source: str) -> Iterator[str]:
    """Yield the top-level names of the modules that a source imports, anywhere in it."""
    for node in _nodes(source):
        if isinstance(node, ast.Import):
            yield from (alias.name.partition(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield node.module.partition(".")[0]


def _nodes(source: str) -> Iterator[ast.AST]:
    """Yield the nodes of a cell's source, in which IPython's magics are calls; none if it cannot be parsed."""
    from IPython.core.inputtransformer2 import TransformerManager

    with contextlib.suppress(SyntaxError):
        source = TransformerManager().transform_cell(source)
    with contextlib.suppress(*NO_PYTHON):
        yield from ast.walk(ast.parse(source))


def _with_requirements(distributions: Iterable[str]) -> set[str]:
    """Return distributions and all that they need, as far as it is installed."""
    names: set[str] = set()
    waiting = [*distributions]
    while waiting:
        name = _canonical(waiting.pop())
        if name not in names:
            names.add(name)
            try:
                needed = importlib.metadata.distribution(name).requires or ()
            except importlib.metadata.PackageNotFoundError:
                continue
            waiting += [text for text in needed if "extra==" not in text.replace(" ", "")]
    return names


def _canonical(requirement: str) -> str:
    """Return the normalized name of the distribution that a requirement begins with."""
    name = _NAME.match(requirement)
    return _BETWEEN.sub("-", name[0] if name else "").lower()
