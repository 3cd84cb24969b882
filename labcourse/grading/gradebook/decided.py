"""What persons decide: acts of scoring, answers as scorers see them, requests, publications. Plain data."""

from __future__ import annotations

import math
from dataclasses import dataclass
from datetime import datetime

from labcourse.grading.gradebook.records import FOR_A_PERSON, GIVEN_BY_A_PERSON, GivenMark, MarkRecord


@dataclass(frozen=True)
class Act:
    """One thing that a scorer did to one answer.

    Attributes
    ----------
    number : of the act, by which it is undone
    student, question, part : whose answer, and which
    actor : the scorer
    level : that was given; None if points were given without one, or the instructor is asked
    points, out_of : given, and possible; points are None where the instructor is asked
    remark : for the student; where the instructor is asked, for the instructor
    given : the answer as it was read
    asked : whether the instructor is asked; then the answer waits
    undoes : number of the act that this one takes back
    when : UTC
    """

    number: int
    student: str
    question: str
    part: str
    actor: str
    level: int | None
    points: float | None
    out_of: float
    remark: str
    given: str
    asked: bool
    undoes: int | None
    when: datetime

    @property
    def where(self) -> tuple[str, str]:
        """Question and part."""
        return self.question, self.part


@dataclass(frozen=True)
class Answer:
    """An answer that a person reads or has marked, as it is now.

    Attributes
    ----------
    student, question, part : whose, and which
    mark : as it counts
    acts : on this very answer, in order; without those that were taken back
    given : the mark as a person gave it, by an act or by ``labcourse mark``; None while nobody has
    """

    student: str
    question: str
    part: str
    mark: MarkRecord
    acts: tuple[Act, ...] = ()
    given: GivenMark | None = None

    @property
    def where(self) -> tuple[str, str]:
        """Question and part."""
        return self.question, self.part

    def last(self) -> Act | None:
        """The last act. Whether the mark comes from it, :attr:`decision` says."""
        return self.acts[-1] if self.acts else None

    @property
    def decision(self) -> Act | None:
        """The act that the mark comes from; None while it waits, and where ``labcourse mark`` gave it since."""
        last, given = self.last(), self.given
        if last is None or last.points is None or given is None:
            return None
        same = (last.actor, last.remark) == (given.actor, given.mark.reason)
        return last if same and math.isclose(last.points, given.mark.points) else None

    @property
    def asked(self) -> bool:
        """Whether it waits for the instructor: asked, and decided by nobody since."""
        last = self.last()
        return last is not None and last.asked and self.mark.status != GIVEN_BY_A_PERSON

    @property
    def waiting(self) -> bool:
        """Whether nobody has decided yet."""
        return self.asked or self.mark.status == FOR_A_PERSON


@dataclass(frozen=True)
class Request:
    """A student's wish to have an answer looked at again; open until it is answered.

    Attributes
    ----------
    number : by which it is answered
    student, question, part, text, made : whose, of which answer, in their words, when (UTC)
    answered_by, answer, answered : by whom, what, and when; None while it is open
    """

    number: int
    student: str
    question: str
    part: str
    text: str
    made: datetime
    answered_by: str | None = None
    answer: str | None = None
    answered: datetime | None = None

    @property
    def where(self) -> tuple[str, str]:
        """Question and part."""
        return self.question, self.part

    @property
    def is_open(self) -> bool:
        """Whether nobody has answered."""
        return self.answered is None


@dataclass(frozen=True)
class Publication:
    """Feedback given back to the class: who did it, when (UTC), and a note."""

    number: int
    actor: str
    note: str
    when: datetime
