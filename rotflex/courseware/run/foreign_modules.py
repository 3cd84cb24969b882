"""Modules that a student's code imports and that the course does not bring: they may be missing where it is graded."""

from __future__ import annotations

import ast
import importlib.metadata
import re
import sys
from collections.abc import Iterable, Iterator

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]*")
_EXTRA = re.compile(r"extra\s*==")


def foreign(sources: Iterable[str], own: Iterable[str], package: str = "rotflex") -> list[str]:
    """Modules that are installed here, are imported by these sources, and do not come with the course.

    Parameters
    ----------
    sources : of code; what is no Python alone imports nothing
    own : names of the student's own modules
    package : one of the course's packages, whose distribution says what it brings

    Returns
    -------
    list
        Names, in order; none where it is not known what the course brings.
    """
    asked = {name for source in sources for name in imported(source)} - set(own) - set(sys.stdlib_module_names)
    if not asked:
        return []
    homes = importlib.metadata.packages_distributions()
    brought = {_plain(name) for start in homes.get(package, ()) for name in _closure(start)}
    if not brought:
        return []
    return sorted(name for name in asked if name in homes and not brought & {_plain(home) for home in homes[name]})


def imported(source: str) -> Iterator[str]:
    """Top-level names of the modules that a source imports, somewhere in it."""
    try:
        tree = ast.parse(source)
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name.partition(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield node.module.partition(".")[0]


def _closure(distribution: str) -> set[str]:
    """A distribution and all that it needs, as far as it is installed."""
    found: set[str] = set()
    waiting = [distribution]
    while waiting:
        name = _plain(waiting.pop())
        if name in found:
            continue
        found.add(name)
        try:
            needed = importlib.metadata.distribution(name).requires or ()
        except importlib.metadata.PackageNotFoundError:
            continue
        waiting += [match[0] for one in needed if not _EXTRA.search(one) and (match := _NAME.match(one))]
    return found


def _plain(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()
