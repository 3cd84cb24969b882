"""The key, held against the catalogue."""

from __future__ import annotations

from collections.abc import Iterator

from labcourse.grading.course import Course
from labcourse.grading.course_check.finding import Finding, in_key
from labcourse.grading.marking.checks import ForAPerson


def check(course: Course) -> Iterator[Finding]:
    """Questions without a key, parts marked otherwise than the catalogue says, follow-through without its words."""
    for number, question in course.catalogue.marked.items():
        if number not in course.key:
            yield Finding("the key", f"question {number} has no entry.")
            continue
        for part in question.parts:
            one = course.key[number][part.name]
            for_a_person = isinstance(one, ForAPerson)
            if _follows_unnamed(one):
                yield Finding(in_key(question, part), "it has follow, and no follow_what: what feedback says of it.")
            if for_a_person != (part.marked == "person"):
                yield Finding(
                    in_key(question, part),
                    f"the catalogue says that it is marked by {part.marked}, the key does otherwise.",
                )


def _follows_unnamed(one: object) -> bool:
    """Whether a check takes what follows from own answers without words for it (one, or several with words)."""
    follow = getattr(one, "follow", None)
    if isinstance(follow, tuple):
        return not all(words for words, _from_own in follow)
    return follow is not None and not getattr(one, "follow_what", "")
