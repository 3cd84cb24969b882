"""Answers in words that stand in code cells, between quotes, as older releases asked for them.

They are read off the source; nothing is run.
"""

from __future__ import annotations

import ast
import inspect
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from rotflex.courseware.run import alignment
from rotflex.courseware.run.handed_in import CODE
from rotflex.courseware.run.recorders import recorded
from rotflex.courseware.words import Where

_UNREADABLE = (SyntaxError, ValueError, RecursionError, MemoryError)  # not Python alone, or built to be hard to read


def words_in_code(cells: Iterable[Mapping[str, Any]]) -> dict[Where, str | None]:
    """(question, part) of what a notebook records → the text that its code gives it; None where that is calculated.

    What has no text yet is left out.

    Parameters
    ----------
    cells : of the notebook, each with id, metadata, kind and source
    """
    found: dict[Where, str | None] = {}
    values: dict[str, str | None] = {}
    for cell in cells:
        if cell["cell_type"] != CODE:
            continue
        try:
            values.update(_values(alignment.source_of(cell)))
            records = list(recorded([cell]))
        except _UNREADABLE:
            continue
        for one in records:
            named = {part: name for part, name in (one.names or {}).items() if name in values}
            found |= {(one.question, part): values[name] for part, name in named.items() if name is not None}
    return {where: text for where, text in found.items() if text != ""}


def _values(source: str) -> Iterator[tuple[str, str | None]]:
    """Names that a cell binds, each with its text, in order; None where it is no text that stands there."""
    body = ast.parse(source).body
    for statement in body:
        match statement:
            case ast.Assign(targets=targets, value=ast.Constant(value=str() as text)):
                yield from ((name, inspect.cleandoc(text).strip()) for name in _names(targets))
            case ast.Assign(targets=targets, value=ast.Constant(value=None)):
                yield from ((name, "") for name in _names(targets))
            case _:
                yield from ((name, None) for name in _names([statement]))


def _names(nodes: Iterable[ast.AST]) -> Iterator[str]:
    for node in nodes:
        for one in ast.walk(node):
            if isinstance(one, ast.Name) and isinstance(one.ctx, ast.Store):
                yield one.id
