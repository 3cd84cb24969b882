"""A student's level in each criterion, from the marks of the parts that carry its code.

One rule for all of them, whoever gave the marks: the points earned of the points possible, over all parts with the code
that are decided, are a share, and the share is a level by the course's thresholds. A person who gives a level gives its
share of the points, so that levels and points cannot contradict each other. What waits for a person, or could not be
marked for a fault of the key, is in neither sum, and is counted. What is missing earned nothing, and is in both.

An accreditation outcome has all parts of all codes that go to it: its share is the mean of the codes' shares, weighted
by their points. ``docs/outcomes.md`` has an example to do by hand.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass

from labcourse.answers.catalogue import Catalogue
from labcourse.grading.gradebook import GIVEN_BY_A_PERSON, Gradebook, Graded, MarkRecord, StudentRecord
from labcourse.grading.settings import SHARE_DIGITS, MarkSettings
from labcourse.grading.verdicts import UNDECIDED
from labcourse.student_id import caseless

ALL = MarkSettings()  #: nothing is dropped
LevelOf = Callable[[float], int]  #: of a share of points, 0 to 1


@dataclass(frozen=True)
class Judged:
    """One part of one student's work that carries a code.

    Attributes
    ----------
    code : of the criterion that it gives evidence of
    mark : as it counts now
    """

    code: str
    mark: MarkRecord

    @property
    def decided(self) -> bool:
        """Whether its points are known."""
        return self.mark.status not in UNDECIDED

    @property
    def by_a_person(self) -> bool:
        """Whether a person gave its points, and not the machine."""
        return self.mark.status == GIVEN_BY_A_PERSON


@dataclass(frozen=True)
class Evidence:
    """What several parts came to.

    Attributes
    ----------
    earned, decided : points earned of points possible, of the parts that are decided
    possible : points possible, of all of them
    waiting : how many parts are not decided yet
    """

    earned: float = 0.0
    decided: float = 0.0
    possible: float = 0.0
    waiting: int = 0

    @property
    def share(self) -> float | None:
        """Points earned of points possible, 0 to 1; None where nothing is decided."""
        return round(self.earned / self.decided, SHARE_DIGITS) if self.decided else None


def evidence(parts: Iterable[Judged]) -> Evidence:
    """What parts came to."""
    parts = list(parts)
    decided = [one.mark for one in parts if one.decided]
    return Evidence(
        sum(mark.points for mark in decided),
        sum(mark.out_of for mark in decided),
        sum(one.mark.out_of for one in parts),
        len(parts) - len(decided),
    )


def judged(marks: Iterable[MarkRecord], catalogue: Catalogue, counted: MarkSettings = ALL) -> list[Judged]:
    """The parts that carry a code and are worth points, in the order of their marks.

    Parameters
    ----------
    marks : a student's
    catalogue : which code each part carries
    counted : says what is dropped in this term: it is no evidence either
    """
    codes = {
        (number, part.name): part.outcome
        for number, question in catalogue.marked.items()
        for part in question.parts
        if part.outcome and not counted.dropped_as(number, part.name)
    }
    return [Judged(codes[mark.where], mark) for mark in marks if mark.where in codes and mark.out_of]


@dataclass(frozen=True)
class Standing:
    """A student, and the parts of their work that carry a code."""

    about: StudentRecord
    parts: tuple[Judged, ...]

    def by_criterion(self, criteria: Mapping[str, Collection[str]]) -> dict[str, Evidence]:
        """What the parts came to, for each criterion.

        Parameters
        ----------
        criteria : name of a criterion → the codes of its parts. A code is a criterion of its own; an accreditation
            outcome has several
        """
        return {name: evidence(one for one in self.parts if one.code in codes) for name, codes in criteria.items()}


def codes_of(catalogue: Catalogue) -> dict[str, frozenset[str]]:
    """Each code of a course as a criterion of its own, in the order of the catalogue."""
    return {code: frozenset((code,)) for code in catalogue.outcomes}


def standing(graded: Graded, catalogue: Catalogue, about: StudentRecord, counted: MarkSettings = ALL) -> Standing:
    """What the gradebook holds of a student, as far as it carries codes."""
    return Standing(about, tuple(judged(graded.marks, catalogue, counted)))


def standings(book: Gradebook, catalogue: Catalogue, counted: MarkSettings = ALL) -> Iterator[Standing]:
    """All students of whom anything is marked, by ID; who has no marks is in no figure."""
    known = {caseless(one.student): one for one in book.students()}
    for graded in book.all_current():
        student = graded.run.student
        yield standing(graded, catalogue, known.get(caseless(student), StudentRecord(student)), counted)
