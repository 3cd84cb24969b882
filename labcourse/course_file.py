"""``course.json``, beside the notebooks: the student who works in the folder, and the release of the course.

It is ``{"student", "course", "release", "draw", "title", "term", "bench", "reflect", "without", "python"}``; with
``"page_limit"`` if the course limits reports, ``"optional"`` if it has optional notebooks, and ``"given"`` if the class
is given values in place of answers (:mod:`labcourse.answers.catalogue`). A release leaves the student empty; old files
have no course, or the student alone. Unknown entries, which a later release may add, stay.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from labcourse import benches, courses, files, job, program, student_id
from labcourse.benches import BenchPolicy
from labcourse.errors import ConfigurationError, StudentIDError
from labcourse.files import COURSE_FILE

STUDENT_KEY, RELEASE_KEY = "student", "release"
COURSE_KEY = "course"  #: its name, see :func:`labcourse.courses.name_of`; earlier releases lack it
REFLECT, ON, OFF = "reflect", "on", "off"  #: whether own answers are compared with each other; or from what time on
PYTHON = "python"  #: of the grading computer, major and minor version; earlier releases lack it
PAGE_LIMIT = "page_limit"  #: pages of a report, cover and contents included; absent without a limit
OPTIONAL, WITHOUT = "optional", "without"  #: names of optional notebooks that the class has; of others that it lacks
GIVEN = "given"  #: question → part → value
NOBODY = "demo"  #: the student if nobody gives an ID


def how_to_name() -> str:
    """Return what a person does to say who they are, or that they are another one."""
    if files.IN_BROWSER:
        return f"delete the file {COURSE_FILE}, and reload the page, which asks for it"
    return f"start {program.name()} lab --student YOUR-ID"


def read(folder: Path) -> dict[str, Any] | None:
    """Read a folder's ``course.json``; None if there is none.

    Raises
    ------
    ConfigurationError
        If it cannot be read, or is not an object with a student.
    """
    try:
        course = parse(files.read(folder / COURSE_FILE))
        course[STUDENT_KEY]  # required
    except FileNotFoundError:
        return None
    except (OSError, KeyError) as error:
        raise _unreadable(error) from None
    return course


def parse(data: bytes) -> dict[str, Any]:
    """Parse the content of a ``course.json``, an untrusted file.

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


def about(folder: Path) -> dict[str, Any]:
    """Return the content of a folder's ``course.json``; nothing if there is none, or if it is broken."""
    try:
        return read(folder) or {}
    except ConfigurationError:
        return {}


def student(folder: Path) -> str:
    """Return the student in a folder's ``course.json``; :data:`NOBODY` if it names none."""
    named = about(folder).get(STUDENT_KEY)
    return named if isinstance(named, str) and named else NOBODY


def _unreadable(error: Exception) -> ConfigurationError:
    return ConfigurationError(f'{COURSE_FILE} should be {{"student": "your id"}}; it is not: {error!r}.')


def text(course: Mapping[str, Any]) -> str:
    """Return the content of a ``course.json``."""
    return json.dumps(dict(course), ensure_ascii=False) + "\n"


def of(folder: Path) -> dict[str, Any] | None:
    """Read the ``course.json`` of a folder, or else that of the installed release.

    Returns None if there is neither, as in the course's own folder. In a run by a check or by grading, the file of the
    folder is the one that the run began with (:mod:`labcourse.job`), whatever a cell writes.

    Raises
    ------
    ConfigurationError
        If the file cannot be read.
    """
    own: dict[str, Any] | None = job.COURSE if job.STUDENT else read(folder)
    if own is not None:
        return own
    try:
        course = courses.current()
    except ConfigurationError:
        return None
    return read(course.place / courses.NOTEBOOKS)


def bench_policy(folder: Path) -> BenchPolicy:
    """Return which bench a student has, by the ``course.json`` of their folder or of the installed release.

    Raises
    ------
    ConfigurationError
        If the file cannot be read.
    """
    try:
        return benches.policy_of(of(folder) or {})
    except ConfigurationError as error:
        raise ConfigurationError(f"{COURSE_FILE}: {error}") from None


# --- the course of a folder ------------------------------------------------------------------------------------------


def courses_of(folder: Path) -> list[str]:
    """Return the names of the courses that a folder may be of; none if it is no course's folder.

    A course's folder has a ``course.json``, or most of a course's notebooks: one or two may be there by chance. If the
    file names no course, the notebooks beside it tell; if these are of no installed course, its title is returned.
    """
    content = about(folder)
    if (named := content.get(COURSE_KEY)) and isinstance(named, str):
        return [named]
    known, has_file = courses.notebooks(), os.path.isfile(folder / COURSE_FILE)
    there = {course: {name for name in names if os.path.isfile(folder / name)} for course, names in known.items()}
    some = [course for course, names in there.items() if names and (has_file or 2 * len(names) > len(known[course]))]
    if has_file and not some:
        return [str(content.get("title") or "without a name")] if any(folder.glob("*.ipynb")) else list(known)
    return [course for course in some if there[course] == set().union(*there.values())] or some


def around(place: Path) -> Path | None:
    """Return the nearest folder of a course at a place or above it, or in a folder ``notebooks`` there; None without.

    A folder ``notebooks`` of another course than that which is worked on is not meant.
    """
    current = courses.name_of(os.environ.get(courses.COURSE_VARIABLE, ""))
    for folder in (place.resolve(), *place.resolve().parents):
        if courses_of(folder):
            return folder
        if (inside := courses_of(folder / courses.NOTEBOOKS)) and current in ("", *inside):
            return folder / courses.NOTEBOOKS
    return None


# --- the user of a JupyterHub ----------------------------------------------------------------------------------------

HUB_USER = "JUPYTERHUB_USER"  #: environment variable that a hub sets for each user's server
_BINDER = ("BINDER_LAUNCH_HOST", "BINDER_REPO_URL", "BINDER_REQUEST")  # its hub invents a user for each visit


def hub_user() -> str:
    """Return the hub's name for its user as a student ID; "" without a hub, or if its users are anonymous.

    Raises
    ------
    ConfigurationError
        If the hub's name for the user cannot be an ID.
    """
    named = _hub_name()
    try:
        return student_id.normalised(named) if named else ""
    except StudentIDError as error:
        raise ConfigurationError(
            f"This hub's name for you is no student ID. {error} Give your ID: {program.name()} lab --student YOUR-ID."
        ) from None


def other_hub_user(student: str) -> str | None:
    """Return a message if a student is not the hub's user; None if they are the same, or without a hub."""
    named = _hub_name()
    if not named or student_id.caseless(named) == student_id.caseless(student):
        return None
    return f"The hub knows you as {named[: student_id.LONGEST]!r}. The work here is that of {student!r}."


def on_hub() -> bool:
    """Check whether a hub runs the server: then JupyterLab runs already, at the hub's address."""
    return bool(os.environ.get("JUPYTERHUB_SERVICE_PREFIX"))


def _hub_name() -> str:
    if any(name in os.environ for name in _BINDER):
        return ""
    return os.environ.get(HUB_USER, "").strip()
