"""Which cells run by themselves when a notebook opens: the course's first ones, as the installed release has them.

The page asks in the kernel, and runs what it is told (``labextensions/labcourse/static/opening.js``). A notebook may
be a stranger's, as an instructor opens it: nothing of it is run but what the installed course has, byte for byte.
"""

from __future__ import annotations

import ast
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from IPython import get_ipython
from IPython.display import JSON

from labcourse import benches, course_file, courses, job
from labcourse.errors import ConfigurationError

VIRTUAL = "virtual"  #: the address of a bench that only this computer computes, or what such addresses begin with
CHANGED = "Nothing ran by itself, because the cells at the top of this notebook are not as your course has them."
REAL = "Nothing ran by itself, because the bench may be a real one."
KEY = "Read the cells at the top. Then click into the first one, and press Shift+Enter {count} times."

granted: set[str] = set()  #: sources of the cells that the page runs by itself; a second page runs nothing


def begin(asked: str) -> JSON:
    """Decide which cells the page runs by itself, in a kernel that has run nothing yet.

    Parameters
    ----------
    asked : JSON: the notebook's file name, and id and source of each code cell

    Returns
    -------
    JSON
        ``{"run": positions among the cells}``, or ``{"say": sentence}``, or neither for what is no course's notebook
        and for a kernel that is in use.
    """
    shell = get_ipython()
    name, cells = json.loads(asked)
    master = None if granted or job.STUDENT or shell is None or shell.execution_count > 1 else _master(name)
    if master is None:
        return JSON({})
    first = _first(master)
    found = [[at for at, (cell, _source) in enumerate(cells) if cell == wanted["id"]] for wanted in first]
    sources = [cells[at[0]][1] if len(at) == 1 else "" for at in found]
    key = KEY.format(count=len(first))
    if not all(map(_is_as_released, first, sources)):
        return JSON({"say": f"{CHANGED} {key}"})
    if not _is_virtual(sources):
        return JSON({"say": f"{REAL} {key}"})
    granted.update(sources)
    return JSON({"run": [at[0] for at in found]})


def _master(name: str) -> dict[str, Any] | None:
    """Return the installed course's notebook of this name; None in a folder that is not this course's."""
    try:
        current = courses.current()
        if course_file.courses_of(Path.cwd()) != [courses.name_of(current.package)]:
            return None
        path = current.notebooks / Path(name).name
        return dict(json.loads(path.read_text(encoding="utf-8"))) if path.is_file() else None
    except ConfigurationError:
        return None


def _first(master: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the code cells down to the set-up cell, and those between it and the text after it."""
    first: list[dict[str, Any]] = []
    for cell in master["cells"]:
        if cell["cell_type"] == "code":
            first.append(cell)
        elif any(before["id"] == "setup" for before in first):
            break
    return first


def _is_as_released(cell: Mapping[str, Any], source: str) -> bool:
    """Check whether a cell has its released source; of parameters, the texts that are assigned may differ."""
    released = "".join(cell["source"])
    if source == released:
        return True
    texts = _texts(source) if "parameters" in cell["metadata"].get("tags", ()) else None
    return texts is not None and [*texts] == [*(_texts(released) or ())]


def _texts(source: str) -> dict[str, str] | None:
    """Return the texts that a source assigns to names; None if it does anything else."""
    texts = {}
    try:
        for statement in ast.parse(source).body:
            match statement:
                case ast.Assign(targets=[ast.Name(id=name)], value=ast.Constant(value=str(text))):
                    texts[name] = text
                case _:
                    return None
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return None
    return texts


def _is_virtual(sources: Sequence[str]) -> bool:
    """Check whether course and parameters say that the bench is virtual."""
    try:
        policy = course_file.bench_policy(Path.cwd())
    except ConfigurationError:
        return False
    addresses = [(_texts(source) or {}).get("bench", VIRTUAL) for source in sources]
    return policy.which != benches.REAL and all(address.partition(":")[0] == VIRTUAL for address in addresses)
