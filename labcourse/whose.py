"""Whose work it is, where a session begins."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from labcourse import course_file, hub, student_id
from labcourse.errors import ConfigurationError, StudentIDError
from labcourse.files import COURSE_FILE

DEMO = course_file.NOBODY  #: the student of whoever gives no name


def student_of(given: str, folder: Path) -> str:
    """The student's name: the given one, or that of ``course.json`` in the folder, or the hub's, or "demo".

    Raises
    ------
    ConfigurationError
        If it is not usable.
    """
    student: Any = given
    if not given:
        student = (course_file.read(folder) or {}).get("student") or hub.user() or DEMO
    try:
        return student_id.normalised(student)
    except StudentIDError as error:
        if given:
            raise
        raise ConfigurationError(f"{COURSE_FILE}: {error}") from None
