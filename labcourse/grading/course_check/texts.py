"""Numbers of the course, held against the texts that repeat them."""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np

from labcourse.grading.course import Course
from labcourse.grading.course_check.finding import Finding, in_cell
from labcourse.grading.release import student_notebooks


def check(course: Course) -> Iterator[Finding]:
    """Numbers of the course that a text has otherwise, and patterns that no text has any more."""
    cells = [
        (in_cell(path.name, cell.id), cell.source)
        for path in sorted(course.folder.glob("*.ipynb"))
        for cell in student_notebooks.read(path).cells
    ]
    for stated in course.stated:
        pattern = re.compile(re.sub(r" +", r"\\s+", stated.pattern))
        found = [(where, match[1]) for where, text in cells for match in pattern.finditer(text)]
        if not found:
            yield Finding(
                f"stated, {stated.what}",
                f"no text has it as {stated.pattern!r} any more: mend the pattern, or take it out.",
            )
        for where, number in found:
            if not np.isclose(float(number.replace("−", "-")), stated.value, rtol=1e-9, atol=0):
                yield Finding(
                    where,
                    f"{stated.what} is {stated.value:g}; this text says {number}.",
                )
