"""What came out for a student, as reports show it."""

from __future__ import annotations

from dataclasses import dataclass

from rotflex.instructor.gradebook import Graded
from rotflex.instructor.marking.marking import Mark
from rotflex.instructor.verdicts import Status


@dataclass(frozen=True)
class Result:
    """What came out for a student.

    Attributes
    ----------
    student : ID
    marks : for every part of every question in the key
    problems : what went wrong with the submission
    notes : what else is worth knowing
    stamp : how it was run
    """

    student: str
    marks: tuple[Mark, ...]
    problems: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    stamp: str = ""

    @property
    def total(self) -> float:
        """Points earned."""
        return sum(mark.points for mark in self.marks)

    @property
    def out_of(self) -> float:
        """Points that there are."""
        return sum(mark.out_of for mark in self.marks)

    @property
    def awaiting(self) -> float:
        """Points that a person has yet to give or not."""
        return sum(mark.awaiting for mark in self.marks)

    def by_question(self) -> dict[str, tuple[float, float]]:
        """Points earned and possible, for each question that has any."""
        found: dict[str, tuple[float, float]] = {}
        for mark in self.marks:
            earned, possible = found.get(mark.question, (0.0, 0.0))
            found[mark.question] = (earned + mark.points, possible + mark.out_of)
        return {number: sums for number, sums in found.items() if sums[1]}


def result_of(graded: Graded) -> Result:
    """What the gradebook holds of a student, as a result."""
    run = graded.run
    marks = tuple(
        Mark(one.question, one.part, Status(one.status), one.points, one.out_of, one.reason, one.given)
        for one in graded.marks
    )
    return Result(run.student, marks, run.problems, run.notes, run.isolation)
