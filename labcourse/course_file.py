"""``course.json``, beside the notebooks: whose folder it is, and of which release of the course.

It is ``{"student", "release", "draw", "title", "term", "bench", "reflect", "python"}``; ``"page_limit"`` where the
course sets one for reports, and ``"given"`` where a class begins in the middle (:mod:`labcourse.answers.starts`). The
one that a release brings names no student; old ones name nothing else. What a later release may add is kept.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from labcourse import benches, courses, files
from labcourse.benches import BenchPolicy
from labcourse.errors import ConfigurationError
from labcourse.files import COURSE_FILE

STUDENT, RELEASE = "student", "release"
REFLECT, ON, OFF = "reflect", "on", "off"  #: whether own answers are asked about; or a time, from which on they are
PYTHON = "python"  #: that grades, major and minor version; earlier releases do not say
PAGE_LIMIT = "page_limit"  #: pages of a report, cover and contents included; not there where there is no limit
NOBODY = "demo"  #: the student of whoever gives no name


def read(folder: Path) -> dict[str, Any] | None:
    """What the folder's ``course.json`` says; None where there is none.

    Raises
    ------
    ConfigurationError
        If it cannot be read, or is not an object that names a student.
    """
    try:
        course = parse(files.read(folder / COURSE_FILE))
        course[STUDENT]
    except FileNotFoundError:
        return None
    except (OSError, KeyError) as error:
        raise _unreadable(error) from None
    return course


def parse(data: bytes) -> dict[str, Any]:
    """Parse the content of a ``course.json``, which may hold anything.

    Raises
    ------
    ConfigurationError
        If it is not an object.
    """
    try:
        course = files.from_json(data)
    except ValueError as error:
        raise _unreadable(error) from None
    if not isinstance(course, dict):
        raise _unreadable(TypeError("it is no object"))
    return course


def student(folder: Path) -> str:
    """The ID of whoever works in a folder, as its ``course.json`` has it; :data:`NOBODY` where it names none."""
    try:
        named = (read(folder) or {}).get(STUDENT)
    except ConfigurationError:
        named = None
    return named if isinstance(named, str) and named else NOBODY


def _unreadable(error: Exception) -> ConfigurationError:
    return ConfigurationError(f'{COURSE_FILE} should be {{"student": "your id"}}; it is not: {error!r}.')


def text(course: Mapping[str, Any]) -> str:
    """The file's content."""
    return json.dumps(dict(course), ensure_ascii=False) + "\n"


def of(folder: Path) -> dict[str, Any] | None:
    """What holds for a student who works in a folder: its ``course.json``, else that of the installed release.

    None where neither is there, as in the course's own folder.

    Raises
    ------
    ConfigurationError
        If the file cannot be read.
    """
    course = read(folder)
    return _released() if course is None else course


def _released() -> dict[str, Any] | None:
    """Return the ``course.json`` of the installed release; None where there is none, as in a checkout."""
    try:
        course = courses.current()
    except ConfigurationError:
        return None
    return read(course.place / courses.NOTEBOOKS)


def bench_policy(folder: Path, latest: int = benches.FIRST_DRAW) -> BenchPolicy:
    """Which bench a student who works in a folder has: as its ``course.json`` says, else as the installed release does.

    Parameters
    ----------
    folder : where the notebooks are
    latest : version of the draws where neither is there, as in the course's own folder

    Raises
    ------
    ConfigurationError
        If the file cannot be read.
    """
    course = of(folder)
    try:
        return benches.policy_of({"draw": latest} if course is None else course)
    except ConfigurationError as error:
        raise ConfigurationError(f"{COURSE_FILE}: {error}") from None
