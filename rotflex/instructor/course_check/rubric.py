"""The rubric, held against the catalogue."""

from __future__ import annotations

from collections.abc import Iterator

from rotflex.instructor.course import RUBRIC_FILE, Course
from rotflex.instructor.course_check.finding import Finding
from rotflex.instructor.scoring import rubric


def check(course: Course) -> Iterator[Finding]:
    """Faults of the course's rubric; none where it has no rubric."""
    for fault in rubric.examine(course.folder, course.catalogue)[1]:
        yield Finding(RUBRIC_FILE, fault)
