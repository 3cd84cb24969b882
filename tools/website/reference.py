"""Docstrings as Sphinx takes them.

The pages in ``docs/reference`` name the public modules. Of a module with ``__all__``, what that names is public, and
else what has a docstring and no underscore before its name.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

_SECTION = re.compile(r"^(Parameters|Attributes|Returns|Yields)$")
_ENTRY = re.compile(r"^(\*{0,2}[\w.]+(?:, \*{0,2}[\w.]+)*) : (.+)$")
_VALUES, _COLON = ("attribute", "data", "property"), "\ue000"
_BAR = re.compile(r"\|(?=(?:[^`]*`[^`]*`)*[^`]*$)")  #: outside of code; reStructuredText would look for a substitution
_NAMES = re.compile(r"^[A-Za-z_][\w.]*$")


def process_docstring(_app: Any, what: str, name: str, item: Any, options: Any, lines: list[str]) -> None:
    """Our way to write parameters, ``name : what it is``, as numpydoc has it: a name, and below it what it is.

    Types stand in the annotations, from which Sphinx takes them.
    """
    lines[:] = [_BAR.sub(r"\|", line) for line in as_numpydoc(lines)]
    if what in _VALUES:  # what stands before a colon would be taken for a type
        lines[:] = [line.replace(":", _COLON) for line in lines]


def with_colons(_app: Any, what: str, name: str, item: Any, options: Any, lines: list[str]) -> None:
    """After napoleon: the colons that were kept from it."""
    lines[:] = [line.replace(_COLON, ":") for line in lines]


def as_numpydoc(lines: Sequence[str]) -> list[str]:
    """The lines of a docstring, rewritten."""
    done: list[str] = []
    section = ""
    for number, line in enumerate(lines):
        follows = lines[number + 1] if number + 1 < len(lines) else ""
        if _SECTION.match(line.strip()) and follows.startswith("---"):
            section = line.strip()
        elif section and line.strip() and _is_heading(follows):
            section = ""
        entry = _ENTRY.match(line) if section in ("Parameters", "Attributes") else None
        if entry:
            done += [entry[1], f"    {entry[2]}"]
        elif section in ("Returns", "Yields") and _is_prose(line):
            done += _prose(line, done)
        else:
            done.append(line)
    return done


def _is_heading(follows: str) -> bool:
    return bool(re.match(r"^-{3,}$", follows))


def _is_prose(line: str) -> bool:
    """Whether a line below ``Returns`` says what comes back, and names no type alone."""
    return bool(line) and not line.startswith((" ", "-")) and not _SECTION.match(line) and not _NAMES.match(line)


def _prose(line: str, done: Sequence[str]) -> list[str]:
    # A text where numpydoc expects a type: below the line that says "Returns" it becomes the description.
    return [f"    {line}"] if done and done[-1].startswith("    ") else [":", f"    {line}"]
