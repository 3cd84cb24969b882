"""The modules that notebooks import, by the course's list."""

from __future__ import annotations

import importlib.util
from collections.abc import Iterator

from labcourse.grading.course import Course
from labcourse.grading.course_check.finding import Finding


def check(course: Course) -> Iterator[Finding]:
    """Modules that are not to be found."""
    for name in course.imports:
        try:
            found = importlib.util.find_spec(name)
        except ModuleNotFoundError:
            found = None
        if found is None:
            yield Finding("course.py, imports", f"there is no module {name!r}.")
