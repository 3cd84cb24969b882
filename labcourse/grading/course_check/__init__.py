"""Whether a course is whole: catalogue, key, cells and texts fit each other, and the key marks the solutions as right.

Each finding names its place; nothing is changed.

================  =====================================================================================
``static``        what is found without running a notebook: key, rubric, outcomes, cells, numbers, starts
``reading_time``  how long a notebook takes, and whether it states that
``solutions``     what stops when nothing is filled in; what the key makes of solutions and of wrong answers
================  =====================================================================================
"""

from __future__ import annotations

from collections.abc import Iterator

from labcourse import program
from labcourse.grading.course import Course
from labcourse.grading.course_check import reading_time, solutions, static
from labcourse.grading.course_check.static import Finding
from labcourse.grading.release import percent
from labcourse.grading.running import bundle

__all__ = ["Finding", "check"]


def check(course: Course, run: bool = True) -> Iterator[Finding]:
    """Look for what is missing in a course, or contradicts itself.

    Parameters
    ----------
    course : the course; its key has been compared with its catalogue when it was loaded
    run : run the student notebooks as they are handed out, and those with solutions, and mark their answers: it takes
        as long as grading two submissions
    """
    if outdated := percent.outdated(course):
        for path in outdated:
            yield Finding(path.name, f"it is not what its text gives now: say {program.name()} make-notebooks.")
        return
    checks = [static.check_key, static.check_files, static.check_cells, static.check_derived, static.check_starts]
    for part in (*checks, static.check_numbers, reading_time.check, static.check_imports):
        yield from part(course)
    if run:
        released = bundle.build(course)
        yield from solutions.check_empty(course, released)
        yield from solutions.check_key(course, released)
