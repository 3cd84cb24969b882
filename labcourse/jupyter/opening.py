"""Which cells run by themselves when a notebook opens: the course's first ones, as the installed release has them.

The page (``labextensions/labcourse/static/opening.js``) asks in the kernel, and runs the cells that :func:`begin`
names. A notebook may be a stranger's, as an instructor opens it: nothing of it is run but what the installed course
has, byte for byte.
"""

from __future__ import annotations

import itertools
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from IPython import get_ipython
from IPython.display import JSON

from labcourse import benches, course_file, courses, job
from labcourse.errors import ConfigurationError
from labcourse.patterns import CELL, pattern

VIRTUAL = "virtual"  #: the address of a bench that only this computer computes, or what such addresses begin with
KEY = "To begin, click into the first cell and press Shift+Enter {count} times."
CHANGED = "Read the cells at the top first: your course has others there, so nothing ran by itself."
REAL = "The bench may be a real one, so nothing ran by itself."

_ASSIGNED = pattern(r"""(\w+) *= *(?:"([^"\\]*)"|'([^'\\]*)') *(?:#.*)?""", CELL)  # a text to a name, on one line

granted: set[str] = set()  #: sources of the cells that the page runs by itself; a second page runs nothing


def begin(asked: str) -> JSON:
    """Decide which cells the page runs by itself, in a kernel that has run nothing yet.

    Parameters
    ----------
    asked : JSON: the notebook's file name, and id and source of each code cell

    Returns
    -------
    JSON
        ``{"run": positions of the cells to run}`` or ``{"say": sentence}``. Empty if the notebook is not of the
        course, or if the kernel has run something already.
    """
    name, cells = json.loads(asked)
    shell = get_ipython()
    first = [] if granted or job.STUDENT or shell is None or shell.execution_count > 1 else _first(name)
    if not first:
        return JSON({})
    found = [[at for at, (cell, _source) in enumerate(cells) if cell == wanted["id"]] for wanted in first]
    sources = [cells[places[0]][1] if len(places) == 1 else "" for places in found]
    reason = REAL if all(map(_is_as_released, first, sources)) else CHANGED
    if reason == CHANGED or not _is_virtual(sources):
        return JSON({"say": f"{KEY.format(count=len(first))} {reason}"})
    granted.update(sources)
    return JSON({"run": [places[0] for places in found]})


def _first(name: str) -> list[dict[str, Any]]:
    """Return the first code cells of the installed course's notebook of this name.

    These are the cells down to the set-up cell, and those between it and the next text. There are none in a folder
    that is not this course's.
    """
    try:
        current = courses.current()
        path = current.notebooks / Path(name).name
        if course_file.courses_of(Path.cwd()) != [courses.name_of(current.package)] or not path.is_file():
            return []
    except ConfigurationError:
        return []
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    setup = next((at for at, cell in enumerate(cells) if cell["id"] == "setup"), len(cells))
    after = itertools.takewhile(_is_code, cells[setup:])
    return [*filter(_is_code, cells[:setup]), *after] if setup < len(cells) else []


def _is_code(cell: Mapping[str, Any]) -> bool:
    return bool(cell["cell_type"] == "code")


def _is_as_released(cell: Mapping[str, Any], source: str) -> bool:
    """Check whether a cell has its released source; of parameters, the texts that are assigned may differ."""
    released = "".join(cell["source"])
    is_parameters = "parameters" in cell["metadata"].get("tags", ())
    return source == released or (is_parameters and [*_texts(source)] == [*_texts(released)] != [])


def _texts(source: str) -> dict[str, str]:
    """Return the texts that a source assigns to names; none if it does anything else."""
    found = [_ASSIGNED.fullmatch(line) for line in source.splitlines() if line.strip()]
    return {match[1]: match[2] or match[3] or "" for match in found if match} if all(found) else {}


def _is_virtual(sources: Sequence[str]) -> bool:
    """Check whether course and parameters say that the bench is virtual."""
    try:
        policy = course_file.bench_policy(Path.cwd())
    except ConfigurationError:
        return False
    addresses = [_texts(source).get("bench", VIRTUAL) for source in sources]
    return policy.which != benches.REAL and all(address.partition(":")[0] == VIRTUAL for address in addresses)
