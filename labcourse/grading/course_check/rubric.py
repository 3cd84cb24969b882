"""The rubric, held against the catalogue."""

from __future__ import annotations

from collections.abc import Iterator

from labcourse.grading.course import RUBRIC_FILE, Course
from labcourse.grading.course_check.finding import Finding
from labcourse.grading.scoring import rubric


def check(course: Course) -> Iterator[Finding]:
    """Faults of the course's rubric; none where it has no rubric."""
    for fault in rubric.examine(course.folder, course.catalogue)[1]:
        yield Finding(RUBRIC_FILE, fault)
