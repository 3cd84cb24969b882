"""What counts in a term: marks, answers and notebooks without what ``course.toml`` drops."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from labcourse.answers.catalogue import Catalogue
from labcourse.grading.gradebook import Answer, Graded
from labcourse.grading.graded_run import key_faults
from labcourse.grading.settings import MarkSettings


def of_run(graded: Graded, settings: MarkSettings) -> Graded:
    """A run with the marks that count; faults of the key in others are not among its problems."""
    dropped = tuple(one for one in graded.marks if settings.dropped_as(*one.where))
    faults = key_faults(replace(graded, marks=dropped))
    return replace(
        graded,
        run=replace(graded.run, problems=tuple(line for line in graded.run.problems if line not in faults)),
        marks=tuple(one for one in graded.marks if not settings.dropped_as(*one.where)),
        lapsed=tuple(one for one in graded.lapsed if not settings.dropped_as(*one.mark.where)),
    )


def of_answers(answers: Iterable[Answer], settings: MarkSettings) -> list[Answer]:
    """The answers that count."""
    return [one for one in answers if not settings.dropped_as(*one.where)]


def notebooks(catalogue: Catalogue, settings: MarkSettings) -> list[str]:
    """Names of the notebooks that count: not all that is worth points there is dropped."""
    dropped: set[str] = set()
    counts: set[str] = set()
    for question in catalogue.marked.values():
        for part in question.parts:
            if part.points:
                (dropped if settings.dropped_as(question.number, part.name) else counts).add(question.notebook)
    return [name for name in catalogue.notebooks if name in counts or name not in dropped]


def left_out(settings: MarkSettings) -> str:
    """What is left out, in a line; "" where nothing is."""
    if not settings.drop:
        return ""
    return (
        f"Left out, as course.toml drops it: {', '.join(settings.drop)}. Requests and changed marks are told all "
        "the same."
    )
