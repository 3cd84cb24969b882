"""The key, held against the catalogue."""

from __future__ import annotations

from collections.abc import Iterator

from labcourse.grading.course import Course
from labcourse.grading.course_check.finding import Finding, in_key
from labcourse.grading.marking.checks import ForAPerson


def check(course: Course) -> Iterator[Finding]:
    """Questions without a key, and parts marked otherwise than the catalogue says."""
    for number, question in course.catalogue.marked.items():
        if number not in course.key:
            yield Finding("the key", f"question {number} has no entry.")
            continue
        for part in question.parts:
            for_a_person = isinstance(course.key[number][part.name], ForAPerson)
            if for_a_person != (part.marked == "person"):
                yield Finding(
                    in_key(question, part),
                    f"the catalogue says that it is marked by {part.marked}, the key does otherwise.",
                )
