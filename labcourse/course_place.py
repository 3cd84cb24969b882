"""Choose the folder that ``labcourse lab`` works in: the given one, the course around it, or the last one.

A course's folder has a ``course.json``, or most of the course's notebooks. The last folder is saved in a small file
beside Jupyter's settings; the student who works in a folder, in the folder's ``course.json``.
"""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Collection
from pathlib import Path

from labcourse import files
from labcourse.courses import NOTEBOOKS
from labcourse.files import COURSE_FILE

SETTINGS = "LABCOURSE_CONFIG_DIR"  #: environment variable: the folder of the user's settings
_LAST = "lab.json"  # there: {"folder": "..."}


def choose(given: Path | None, notebooks: Collection[str]) -> tuple[Path, list[str]]:
    """Return the folder to work in, and messages about it.

    No course is begun inside another: that one is opened.

    Parameters
    ----------
    given : by the user; None if they gave none
    notebooks : file names of the course's notebooks
    """
    if given is None:
        return _default_folder(notebooks)
    if is_course(given, notebooks):
        return given, []
    for folder in given.resolve().parents:
        if is_course(folder, notebooks):
            return folder, [f"{given} is inside the course in {folder}: that one is opened, and no second one begun."]
    if is_course(given / NOTEBOOKS, notebooks):
        return given / NOTEBOOKS, [f"The course in {given / NOTEBOOKS} is opened."]
    last = remembered()
    if last is not None and last != given.resolve() and is_course(last, notebooks):
        return given, [f"A new course is begun in {given}. The last one is in {last}."]
    return given, []


def _default_folder(notebooks: Collection[str]) -> tuple[Path, list[str]]:
    """Return the folder to work in if the user gave none, and messages about it."""
    here = Path.cwd()
    if is_course(here / NOTEBOOKS, notebooks) and not is_course(here, notebooks):
        return Path(NOTEBOOKS), []
    for place in (here, *here.parents):
        for folder in (place, place / NOTEBOOKS):
            if is_course(folder, notebooks):
                return folder, [f"The course in {folder} is opened."]
    last = remembered()
    if last is not None and is_course(last, notebooks):
        return last, [f"The course in {last} is opened, as last time."]
    return Path(NOTEBOOKS), []


def is_course(folder: Path, notebooks: Collection[str]) -> bool:
    """Check whether somebody works on the course in a folder. One or two notebooks may be there by chance."""
    count = sum(os.path.isfile(folder / name) for name in notebooks)
    return os.path.isfile(folder / COURSE_FILE) or 2 * count > len(notebooks)


def remember(folder: Path) -> None:
    """Save the folder that the student works in, so that it need not be given next time."""
    place = settings()
    with contextlib.suppress(OSError):  # a home that cannot be written: next time, the folder has to be given
        place.mkdir(parents=True, exist_ok=True)
        files.write(place / _LAST, json.dumps({"folder": str(folder.resolve())}) + "\n")


def remembered() -> Path | None:
    """Return the last folder; None if it is not known."""
    try:
        return Path(json.loads((settings() / _LAST).read_text(encoding="utf-8"))["folder"])
    except (OSError, ValueError, TypeError, KeyError):
        return None


def settings() -> Path:
    """Return the folder of the user's settings; it may not be there yet."""
    from jupyter_core.paths import jupyter_config_dir

    return Path(os.environ.get(SETTINGS) or Path(jupyter_config_dir(), "labcourse"))
