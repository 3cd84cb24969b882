"""Cases, verdicts, and the protocol of a check: what an answer is judged against, and the result."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Protocol, runtime_checkable

from labcourse.answers.parts import Part


class Status(StrEnum):
    """Result of marking an answer."""

    RIGHT = "right"
    FOLLOW_THROUGH = "right, given your own earlier answers"
    PARTLY = "partly right"
    WRONG = "wrong"
    MISSING = "missing"
    FOR_A_PERSON = "for a person"
    BY_A_PERSON = "given by a person"
    SUPPLIED = "supplied by your instructor"
    NOT_MARKED = "not marked: key fault"


#: Nothing is decided yet; this does not mean no points.
UNDECIDED = (Status.FOR_A_PERSON, Status.NOT_MARKED)


class Own(Protocol):
    """The student's own answers: ``own("1.2", "speed")``. Raises LookupError where there is none that can be used."""

    def __call__(self, question: str, part: str) -> Any: ...


class NothingFollows(LookupError):
    """One of the student's own answers holds nothing that the next step could use; the message, for them, says which.

    What follows from it takes no work: zeros from zeros. A check treats it as a missing answer.
    """

    def __str__(self) -> str:
        return " ".join(map(str, self.args))


OWN_ANSWERS = "your own earlier answers"  #: what an answer follows from, where a check does not name it


@dataclass(frozen=True)
class Case:
    """What an answer is judged against.

    Attributes
    ----------
    bench : the student's own, as it really is: what the course's ``bench`` gives
    own : the student's other answers
    probe_seed : from which the inputs of functions were drawn
    virtual : whether the answers come from a bench whose truth is known here, as a virtual one's
    """

    bench: Any
    own: Own
    probe_seed: int
    virtual: bool = True


@dataclass(frozen=True)
class Verdict:
    """A status, the share of the points (0 to 1) that goes with it, and why."""

    status: Status
    share: float
    reason: str


@dataclass(frozen=True)
class OwnBench:
    """How to recognise a number that was measured on another student's bench.

    :mod:`labcourse.grading.reports.hints` uses it of checks that have it as their ``own_bench``.

    Attributes
    ----------
    expected : a function of a bench: the number that it gives
    rtol : relative tolerance within which a number is of that bench
    is_discriminating : whether an equal number alone is a hint; not where everybody reads off the same scale
    """

    expected: Callable[[Any], float]
    rtol: float
    is_discriminating: bool = True


class Check(Protocol):
    """Protocol of a check, which compares an answer."""

    kinds: tuple[str, ...]

    def verdict(self, part: Part, value: Any, case: Case) -> Verdict:
        """Judge an answer to a part."""


def right(reason: str) -> Verdict:
    """Return a verdict with all of the points."""
    return Verdict(Status.RIGHT, 1.0, reason)


def follow_through(reason: str) -> Verdict:
    """Return a verdict with all of the points, for an answer that follows from the student's own earlier answers."""
    return Verdict(Status.FOLLOW_THROUGH, 1.0, reason)


def partly(share: float, reason: str) -> Verdict:
    """Return a verdict with a share of the points."""
    return Verdict(Status.PARTLY, share, reason)


def wrong(reason: str) -> Verdict:
    """Return a verdict with no points."""
    return Verdict(Status.WRONG, 0.0, reason)


def for_a_person(reason: str) -> Verdict:
    """Return a verdict with no points yet: a person decides."""
    return Verdict(Status.FOR_A_PERSON, 0.0, reason)


@runtime_checkable
class JudgesMissing(Protocol):
    """Protocol of a check for which no answer may be right."""

    def missing(self, part: Part, case: Case) -> Verdict | None:
        """Judge that there is no answer; None if it is just missing."""


Key = Mapping[str, Mapping[str, Check]]  #: question → part → check
