"""Whether a course is whole: catalogue, key, cells and texts fit each other, and the key marks the solutions as right.

What is found is told in words that name the place; nothing is changed.

================  =====================================================================================
``key``           questions without an entry in the key, and entries that are not complete
``rubric``        what a person looks for: parts that it lacks, and those that there are not
``outcomes``      a map to outcomes, or scoring sheets, that cannot be used; what is on no sheet
``cells``         notebooks that do not record what the catalogue asks, or not as they should
``starts``        where a class may begin in the middle: what is given, and what is left without an answer
``texts``         numbers of the course that a text has otherwise
``times``         how long a notebook takes, where it says so otherwise than one formula for all has it
``solved``        what the key makes of the solutions, and of wrong answers made of them
================  =====================================================================================
"""

from __future__ import annotations

from collections.abc import Iterator

from labcourse import program
from labcourse.grading.course import Course
from labcourse.grading.course_check import (
    cells,
    imports,
    key,
    outcomes,
    rubric,
    solved,
    starts,
    texts,
    times,
    unfilled,
)
from labcourse.grading.course_check.finding import Finding
from labcourse.grading.release import percent
from labcourse.grading.running import bundle

__all__ = ["Finding", "check"]


def check(course: Course, run: bool = True) -> Iterator[Finding]:
    """Look at all of a course.

    Parameters
    ----------
    course : the course; its key has been held against its catalogue when it was loaded
    run : run the student notebooks as they are handed out, and those with solutions, and mark what these answer: it
        takes as long as grading two submissions
    """
    if outdated := percent.outdated(course):
        for name in outdated:
            yield Finding(name, f"it is not what is made of its text now: say {program.name()} make-notebooks.")
        return
    yield from key.check(course)
    yield from rubric.check(course)
    yield from outcomes.check(course)
    yield from cells.check(course)
    yield from cells.check_derived(course)
    yield from starts.check(course)
    yield from texts.check(course)
    yield from times.check(course)
    yield from imports.check(course)
    if run:
        made = bundle.build(course)
        yield from unfilled.check(course, made)
        yield from solved.check(course, made)
