"""The date that files of a release bear: when their sources were changed last, so that the same sources give the same
bytes."""

from __future__ import annotations

import os
import subprocess
import time
from collections.abc import Iterable
from pathlib import Path

from labcourse.files import ANSWERS_FILE

_FIRST, _LAST = 315_532_800, 4_354_819_198  # s since 1970, UTC: from 1980 to 2107, which a zip can hold
_PATIENCE = 20  # s for git; it takes a fraction of one
_NOT_SOURCES = ("__pycache__", ANSWERS_FILE)  # what a run leaves there

ZipTime = tuple[int, int, int, int, int, int]


def of_sources(folders: Iterable[Path]) -> ZipTime:
    """The time of the last commit that changed something in one of the folders, in UTC, as zips have it.

    A folder that is in no repository, as that of an installed package, counts by its newest file.
    """
    newest = max((_committed(folder) or _written(folder) for folder in folders), default=_FIRST)
    return time.gmtime(min(max(newest, _FIRST), _LAST))[:6]


def _committed(folder: Path) -> int | None:
    """When something in a folder was committed last, s since 1970; None where that is not known."""
    try:
        done = subprocess.run(
            ["git", "log", "-1", "--format=%ct", "--", "."],
            cwd=folder,
            capture_output=True,
            text=True,
            timeout=_PATIENCE,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired):  # no git here
        return None
    said = done.stdout.strip()
    return int(said) if done.returncode == 0 and said.isdecimal() else None


def _written(folder: Path) -> int:
    """When the newest file in a folder was written, s since 1970."""
    times = [_FIRST]
    for place, folders, files in os.walk(folder):
        folders[:] = [name for name in folders if name not in _NOT_SOURCES and not name.startswith(".")]
        times += [int(os.stat(os.path.join(place, name)).st_mtime) for name in files if name not in _NOT_SOURCES]
    return max(times)
