"""Stored answers marked again by a changed key. No notebook is run."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any

from labcourse.errors import AnswerError, CourseError, GradingError
from labcourse.grading.course import Course
from labcourse.grading.gradebook import GIVEN_BY_A_PERSON, Gradebook, Graded, MarkRecord
from labcourse.grading.graded_run import facts_of, mark_records, to_be_marked, with_messages
from labcourse.grading.marking.digest import marking_digest
from labcourse.grading.marking.marking_processes import Marker
from labcourse.grading.reports.result import points
from labcourse.grading.verdicts import UNDECIDED

ACTOR = "labcourse regrade"  #: who changes marks here, in the audit trail


@dataclass(frozen=True)
class LeftAlone:
    """A mark that a person gave and that stays, and what the key gives now."""

    given: MarkRecord
    by_key: MarkRecord

    def __str__(self) -> str:
        """As in "1.2, speed: 1.5 of 2, given by a person, stays; the key gives 2 of 2 (right)."."""
        given, now = self.given, self.by_key
        stays = f"{points(given.points)} of {points(given.out_of)}, {given.status}, stays"
        other = f"; the key gives {points(now.points)} of {points(now.out_of)} ({now.status})"
        return f"{given.question}, {given.part}: {stays}{other if now.points != given.points else ''}."

    def as_data(self) -> dict[str, Any]:
        """Return the same as plain data."""
        where = {"question": self.given.question, "part": self.given.part}
        return {**where, "points": self.given.points, "by_key": self.by_key.points}


@dataclass(frozen=True)
class Regraded:
    """A student's marks before and after.

    Attributes
    ----------
    before, after : as in the gradebook
    problem : why they could not be marked again; "" where they could
    left : marks that persons gave to answers that the key marks, too
    """

    before: Graded
    after: Graded
    problem: str = ""
    left: tuple[LeftAlone, ...] = ()


def regrade(gradebook: Gradebook, course: Course, questions: Collection[str] = (), jobs: int = 1) -> Iterator[Regraded]:
    """Mark everybody's stored answers by the key as it is now. Where that fails for a student, the marks stay.

    Parameters
    ----------
    gradebook : with the answers
    course : the course, with its key
    questions : whose marks are to change; all if there are none
    jobs : submissions to mark at a time

    Raises
    ------
    GradingError
        If the gradebook has no answers, or the key not one of the questions.
    """
    _check(questions, course)
    with Marker(course, jobs) as marker, ThreadPoolExecutor(jobs) as graders:
        everybody = list(gradebook.all_current())
        if not everybody:
            raise GradingError("There is nothing in the gradebook to mark again.")
        digest = marking_digest(course)
        for done in graders.map(lambda one: _marked(one, marker, questions, digest), everybody):
            yield done if done.problem else _recorded(gradebook, done, questions)


def _recorded(gradebook: Gradebook, done: Regraded, questions: Collection[str]) -> Regraded:
    reason = f"marked again: {', '.join(questions) or 'all questions'}"
    gradebook.record(done.after, actor=ACTOR, reason=reason)
    # As it is in the gradebook: there, a mark that a person gave has stayed.
    after = gradebook.current(done.after.run.student) or done.after
    by_key = {one.where: one for one in done.after.marks if one.status not in (GIVEN_BY_A_PERSON, *UNDECIDED)}
    given = [one for one in after.marks if one.status == GIVEN_BY_A_PERSON and one.where in by_key]
    return replace(done, after=after, left=tuple(LeftAlone(one, by_key[one.where]) for one in given))


def _check(questions: Collection[str], course: Course) -> None:
    for number in questions:
        try:
            course.catalogue.find_marked(number)
        except AnswerError as error:
            raise GradingError(str(error)) from None
        if number not in course.key:
            raise GradingError(f"The key has no question {number}.")


def _marked(graded: Graded, marker: Marker, questions: Collection[str], digest: str) -> Regraded:
    run = graded.run
    if (
        run.answers is None and not run.words and not facts_of(run).reports_in_pdf
    ):  # nothing was read of it, or it could not be run: there is nothing to mark
        return Regraded(graded, graded)
    try:
        marked = marker.mark(to_be_marked(run))
    except CourseError as error:
        return Regraded(graded, graded, str(error))
    if not questions:
        return Regraded(graded, Graded(with_messages(run, marked), mark_records(marked.marks), digest))
    new = {(one.question, one.part): one for one in mark_records(marked.marks) if one.question in questions}
    kept = [new.pop((one.question, one.part), one) for one in graded.marks]
    # The other marks are still those of the key before: the next grading of the class looks at them again.
    return Regraded(graded, replace(graded, marks=(*kept, *new.values())))
