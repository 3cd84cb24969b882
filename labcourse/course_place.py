"""Which folder ``labcourse lab`` works in: the one that is named, the course around it, or the one of last time.

A course's folder is told by its ``course.json``, or by most of the course's notebooks. The folder of last time stands
in a small file beside Jupyter's settings; which student works in a folder, in the folder's own ``course.json``.
"""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Collection
from pathlib import Path

from labcourse import files
from labcourse.files import COURSE_FILE

USUAL = Path("notebooks")  #: the folder's name unless another is given
SETTINGS = "LABCOURSE_CONFIG_DIR"  #: environment variable: the folder of the user's settings
_LAST = "lab.json"  # there: {"folder": "..."}


def choose(given: Path | None, notebooks: Collection[str]) -> tuple[Path, list[str]]:
    """The folder to work in, and what is to be said of it.

    No course is begun inside another: that one is opened.

    Parameters
    ----------
    given : as named by a person; None if they named none
    notebooks : file names of the course's
    """
    return _usual(notebooks) if given is None else _named(given, notebooks)


def _usual(notebooks: Collection[str]) -> tuple[Path, list[str]]:
    here = Path.cwd()
    if is_course(here / USUAL, notebooks) and not is_course(here, notebooks):
        return USUAL, []
    for place in (here, *here.parents):
        for found in (place, place / USUAL):
            if is_course(found, notebooks):
                return found, [f"The course in {found} is opened."]
    last = remembered()
    if last is not None and is_course(last, notebooks):
        return last, [f"The course in {last} is opened, as last time."]
    return USUAL, []


def _named(given: Path, notebooks: Collection[str]) -> tuple[Path, list[str]]:
    if is_course(given, notebooks):
        return given, []
    for place in given.resolve().parents:
        if is_course(place, notebooks):
            return place, [f"{given} is inside the course in {place}: that one is opened, and no second one begun."]
    if is_course(given / USUAL, notebooks):
        inner = given / USUAL
        return inner, [f"The course in {inner} is opened."]
    last = remembered()
    if last is not None and last != given.resolve() and is_course(last, notebooks):
        return given, [f"A new course is begun in {given}. The one of last time is in {last}."]
    return given, []


def is_course(folder: Path, notebooks: Collection[str]) -> bool:
    """Whether somebody works on the course in a folder. One or two of its notebooks alone may be there by chance."""
    there = sum(os.path.isfile(folder / name) for name in notebooks)
    return os.path.isfile(folder / COURSE_FILE) or 2 * there > len(notebooks)


def remember(folder: Path) -> None:
    """Keep a folder for next time."""
    place = settings()
    with contextlib.suppress(OSError):  # a home that cannot be written: next time, the folder has to be named
        place.mkdir(parents=True, exist_ok=True)
        files.write(place / _LAST, json.dumps({"folder": str(folder.resolve())}) + "\n")


def remembered() -> Path | None:
    """The folder of last time; None if it is not known."""
    try:
        folder = json.loads((settings() / _LAST).read_text(encoding="utf-8"))["folder"]
    except (OSError, ValueError, TypeError, KeyError):
        return None
    return Path(folder) if isinstance(folder, str) else None


def settings() -> Path:
    """The folder of the user's settings; it may not be there yet."""
    named = os.environ.get(SETTINGS)
    if named:
        return Path(named)
    from jupyter_core.paths import jupyter_config_dir

    return Path(jupyter_config_dir(), "labcourse")
