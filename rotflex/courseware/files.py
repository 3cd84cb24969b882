"""Files written whole or not at all: whatever happens, there is the old one or the new one, and nothing beside it."""

from __future__ import annotations

import contextlib
import itertools
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

ANSWERS_FILE = "answers.json"  #: beside the notebooks: what a student has answered
COURSE_FILE = "course.json"  #: beside the notebooks: {"student": "..."}

Content = str | bytes | Callable[[Path], object]

_count = itertools.count()  # two threads may write the same file

# Windows lets nobody replace a file that another program has open (a search, a virus scanner, a cloud's copy, another
# notebook), and nobody read one that is being replaced. Elsewhere, what is refused stays refused.
_MAY_BE_OPEN = sys.platform == "win32"
_PATIENCE = 2.0  # s until it is an error; a virus scanner has a new file for a second
_PAUSE = 0.05  # s between two tries; a program that reads a small file has it for less

_Result = TypeVar("_Result")


def patiently(act: Callable[[], _Result]) -> _Result:
    """Do what another program may be in the way of for a moment, on Windows, and do it again until it is done.

    Raises
    ------
    OSError
        If it cannot be done.
    """
    until = time.monotonic() + _PATIENCE
    while True:
        try:
            return act()
        except PermissionError:
            if not _MAY_BE_OPEN or time.monotonic() > until:
                raise
        time.sleep(_PAUSE)


def replace(source: Path, target: Path) -> None:
    """Give a file another's name, in its place.

    Raises
    ------
    OSError
        If it cannot be done.
    """
    patiently(lambda: os.replace(source, target))


def write(target: str | os.PathLike[str], content: Content) -> os.stat_result:
    """Write a file in place of an earlier one, under a temporary name first.

    Parameters
    ----------
    target : the file
    content : bytes; or text, which is written as UTF-8, its line ends as they are; or a function that is given a path,
        whose ending is not the target's, and writes the file there

    Returns
    -------
    os.stat_result
        Of what was written, taken before it bore the target's name: another program may have replaced it since.

    Raises
    ------
    OSError
        If it cannot be written.
    """
    target = Path(target)
    scratch = target.with_name(f".{target.name}.{os.getpid()}-{next(_count)}.tmp")
    try:
        if callable(content):
            content(scratch)
        else:
            scratch.write_bytes(content.encode() if isinstance(content, str) else content)
        written = scratch.stat()
        replace(scratch, target)
    finally:
        with contextlib.suppress(OSError):  # it is gone, after all went well; and what went wrong before says more
            scratch.unlink()
    return written
