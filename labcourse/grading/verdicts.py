"""Cases, verdicts, and the protocol of a check, for a course's key."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

from labcourse.answers.parts import Part
from labcourse.grading.marks import Status
from labcourse.problems import Reason


class OwnAnswers(Protocol):
    """The student's own answers: ``own("1.2", "speed")`` returns one. Raises LookupError without a usable one."""

    def __call__(self, question: str, part: str) -> Any: ...


class NothingFollows(LookupError):
    """One of the student's own answers cannot be used for what follows from it. The message names it and says why.

    For example it is all zeros, from which zeros follow without any work. A check treats it as a missing answer.
    """

    def __str__(self) -> str:
        return " ".join(map(str, self.args))


EARLIER_ANSWERS = "your own earlier answers"  #: default text for what an answer follows from


@dataclass(frozen=True)
class Case:
    """The data by which an answer is judged.

    Attributes
    ----------
    bench : the student's own bench as it really is, from :meth:`labcourse.grading.course.Course.true_bench`
    own : the student's other answers
    probe_seed : seed from which the inputs of functions were drawn
    truth_is_known : whether the truth of the bench is known, as that of a virtual bench is, and that of some real ones
    bench_word : what the course calls a bench, in reasons
    """

    bench: Any
    own: OwnAnswers
    probe_seed: int
    truth_is_known: bool = True
    bench_word: str = "bench"


@dataclass(frozen=True)
class Verdict:
    """What a check decides: a status, the share of the points (0 to 1), and the reason, a text or a problem."""

    status: Status
    share: float
    reason: Reason


@dataclass(frozen=True)
class OwnBench:
    """How to recognise a number that was measured on a student's bench in another student's answer.

    :mod:`labcourse.grading.reports.hints` uses it of each check that has it as its ``own_bench``.

    Attributes
    ----------
    expected : function of a bench: returns the number that is measured on it
    rtol : largest relative difference from the expected number
    is_discriminating : whether an equal number is a hint by itself; False where all students read off the same scale
    """

    expected: Callable[[Any], float]
    rtol: float
    is_discriminating: bool = True


class Check(Protocol):
    """A check of answers to one part; ``kinds`` are the kinds of parts that it can check."""

    kinds: tuple[str, ...]

    def verdict(self, part: Part, value: Any, case: Case) -> Verdict:
        """Judge a decoded answer (``value``) to a part."""


def right(reason: str) -> Verdict:
    """Return a verdict with all points."""
    return Verdict(Status.RIGHT, 1.0, reason)


def follow_through(reason: str) -> Verdict:
    """Return a verdict with all points for an answer that is right given the student's own earlier answers."""
    return Verdict(Status.FOLLOW_THROUGH, 1.0, reason)


def partly(share: float, reason: str) -> Verdict:
    """Return a verdict with a share (0 to 1) of the points."""
    return Verdict(Status.PARTLY, share, reason)


def wrong(reason: str) -> Verdict:
    """Return a verdict with no points."""
    return Verdict(Status.WRONG, 0.0, reason)


def for_a_person(reason: str) -> Verdict:
    """Return a verdict that leaves the answer to a person: no points yet."""
    return Verdict(Status.FOR_A_PERSON, 0.0, reason)


@runtime_checkable
class JudgesMissing(Protocol):
    """A check that may accept a missing answer."""

    def missing(self, part: Part, case: Case) -> Verdict | None:
        """Judge a missing answer; return None if there is no more to say than that it is missing."""


Key = Mapping[str, Mapping[str, Check]]  #: question → part → check
