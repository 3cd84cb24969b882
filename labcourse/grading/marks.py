"""Marks of answers, as marking makes them, the gradebook stores them, and pages show them."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from labcourse.problems import Reason, Where


class Status(StrEnum):
    """The status of an answer. The gradebook stores these words."""

    RIGHT = "right"
    FOLLOW_THROUGH = "right, given your own earlier answers"
    PARTLY = "partly right"
    WRONG = "wrong"
    MISSING = "missing"
    FOR_A_PERSON = "for a person"
    BY_A_PERSON = "given by a person"
    SUPPLIED = "supplied by your instructor"
    NOT_MARKED = "not marked: key fault"
    UNCONFIRMED = "handed in by a partner who is not confirmed"


#: Statuses of answers on which nobody has decided yet. (No points is a decision.)
UNDECIDED = (Status.FOR_A_PERSON, Status.NOT_MARKED, Status.UNCONFIRMED)


@dataclass(frozen=True)
class Mark:
    """The mark of the answer to one part of a question.

    Attributes
    ----------
    question, part : number of the question, and name of the part
    status : whether it is right, or who decides it
    points, out_of : points earned, and possible
    reason : for the student: the words of the key or of a person, or the problem that decided it
    given : the student's answer as a short text, answers in words as a whole; "" if there is none
    """

    question: str
    part: str
    status: Status
    points: float
    out_of: float
    reason: Reason
    given: str = ""

    @property
    def where(self) -> Where:
        """Question and part."""
        return self.question, self.part

    @property
    def awaiting(self) -> float:
        """The possible points if a person has yet to read the answer; else 0."""
        return self.out_of if self.status == Status.FOR_A_PERSON else 0.0
