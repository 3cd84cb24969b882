"""Write files whole or not at all, and find the folder for what benches keep.

However a program ends, a file is then the old one or the new one, and nothing lies beside it.
"""

from __future__ import annotations

import contextlib
import itertools
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import IO

SETTINGS_VARIABLE = "ROTFLEX_CONFIG_DIR"  #: environment variable: the folder of the user's settings

_count = itertools.count()  # two threads may write the same file
# On Windows a file that another program has open, such as a virus scanner, cannot be replaced or deleted.
_PATIENCE = 2.0 if sys.platform == "win32" else 0.0  # s until it is an error
_PAUSE = 0.05  # s between two tries


def settings() -> Path:
    """Return the folder in which marks and unfinished runs of benches are kept; it may not exist yet."""
    return Path(os.environ.get(SETTINGS_VARIABLE) or Path.home() / ".rotflex")


def patiently(act: Callable[[], object]) -> None:
    """Replace or delete a file; try again for a while where another program may have it open.

    Raises
    ------
    OSError
        If it cannot be done.
    """
    until = time.monotonic() + _PATIENCE
    while True:
        try:
            act()
            return
        except PermissionError:
            if time.monotonic() >= until:
                raise
        time.sleep(_PAUSE)


def lock(file: IO[bytes]) -> None:
    """Lock a file until it is closed, or its program ends. (Laboratory and engine have the same function.)

    Raises
    ------
    BlockingIOError, PermissionError
        If another program has it locked.
    OSError
        If its file system has no locks.
    """
    if sys.platform == "win32":
        import msvcrt

        msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
    elif sys.platform != "emscripten":  # a browser has no locks
        import fcntl

        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


def write(target: str | os.PathLike[str], content: str | bytes | Callable[[Path], object]) -> None:
    """Write a file under a temporary name, and give it its own name once it is whole.

    Parameters
    ----------
    target : the file
    content : bytes; text, written as UTF-8 with its line ends as they are; or a function that writes the file at the
        path that it is given, which ends otherwise than the target

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
        patiently(lambda: os.replace(scratch, target))
    finally:
        with contextlib.suppress(OSError):  # it is gone if all went well; otherwise the first error says more
            scratch.unlink()
