"""Files of answers that are set aside beside ``answers.json``: ``answers.broken.json``, ``answers.<ID>.json``."""

from __future__ import annotations

import re
from pathlib import Path

from labcourse import files


def set_aside(path: Path, why: str) -> str:
    """Rename a file to a name that is not taken, and return that name."""
    count = 1
    while True:
        suffix = f"-{count}" if count > 1 else ""
        aside = path.with_name(f"{path.stem}.{why}{suffix}{path.suffix}")
        if not aside.exists():
            files.replace(path, aside)
            return aside.name
        count += 1


def label(student: str) -> str:
    """What stands for a student in the name of a file that is set aside."""
    return re.sub(r"[^\w.-]+", "_", student)[:40] or "nobody"
