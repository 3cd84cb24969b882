"""Whether the program that writes a file still lives: it holds a lock, which the system takes back however it ends."""

from __future__ import annotations

import contextlib
import os
import sys
from pathlib import Path

if sys.platform == "win32":
    import msvcrt

    def _lock(handle: int) -> None:
        msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)

else:
    import fcntl

    def _lock(handle: int) -> None:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)


class Held:
    """A lock of this program's, until it is released or the program ends.

    Where the file system has no locks, there is none, and nobody is kept from anything.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._handle: int | None = os.open(path, os.O_RDWR | os.O_CREAT, 0o600)
        with contextlib.suppress(OSError):
            _lock(self._handle)

    def release(self) -> None:
        """Let go of it, and take its file away; a second call does nothing."""
        handle, self._handle = self._handle, None
        if handle is not None:
            os.close(handle)
            with contextlib.suppress(OSError):  # on Windows, while another program asks whether it is held
                self._path.unlink(missing_ok=True)

    def __del__(self) -> None:
        if self._handle is not None:
            os.close(self._handle)


def is_held(path: Path) -> bool:
    """Whether a program that lives, this one or another, holds the lock."""
    try:
        handle = os.open(path, os.O_RDWR)
    except FileNotFoundError:
        return False
    except OSError:  # it is somebody else's
        return True
    try:
        _lock(handle)
    except OSError:
        return True
    finally:
        os.close(handle)
    return False
