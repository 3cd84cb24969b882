"""How an answer of each sort is compared. ``solutions/key.py`` is a table of these.

A check is given a decoded answer (:mod:`rotflex.grading.decoding`: finite numbers, bounded in size) and the case at
hand, and comes to a verdict: a status, the share of the points, and the reason, in words that a student can act on and
an instructor can defend. Reasons do not tell the expected value.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from rotflex.grading.truth import TrueBench
from rotflex.recording import Recording
from rotflex.workbook.parts import Part
from rotflex.workbook.plain import thin


class Status(StrEnum):
    """What became of an answer."""

    RIGHT = "right"
    FOLLOW_THROUGH = "right, given your own earlier answers"
    PARTLY = "partly right"
    WRONG = "wrong"
    MISSING = "missing"
    FOR_A_PERSON = "for a person"
    BY_A_PERSON = "given by a person"


class Own(Protocol):
    """The student's own answers: ``own("2.12", "J_l")``. Raises LookupError where there is none that can be used."""

    def __call__(self, question: str, part: str) -> Any: ...


@dataclass(frozen=True)
class Case:
    """What an answer is judged against.

    Attributes
    ----------
    bench : the student's own, as it really is
    own : the student's other answers
    probe_seed : from which the inputs of functions were drawn
    virtual : whether the answers come from the virtual bench; of another one, nothing is known here
    """

    bench: TrueBench
    own: Own
    probe_seed: int
    virtual: bool = True


@dataclass(frozen=True)
class Verdict:
    """A status, the share of the points (0 to 1) that goes with it, and why."""

    status: Status
    share: float
    reason: str


class Check(Protocol):
    """A way to compare an answer."""

    kinds: tuple[str, ...]

    def verdict(self, part: Part, value: Any, case: Case) -> Verdict:
        """Judge an answer to a part."""


def right(reason: str) -> Verdict:
    """All of the points."""
    return Verdict(Status.RIGHT, 1.0, reason)


def follow_through(reason: str) -> Verdict:
    """All of the points, for what is right given the student's own earlier answers."""
    return Verdict(Status.FOLLOW_THROUGH, 1.0, reason)


def partly(share: float, reason: str) -> Verdict:
    """Some of the points."""
    return Verdict(Status.PARTLY, share, reason)


def wrong(reason: str) -> Verdict:
    """No points."""
    return Verdict(Status.WRONG, 0.0, reason)


def for_a_person(reason: str) -> Verdict:
    """No points yet."""
    return Verdict(Status.FOR_A_PERSON, 0.0, reason)


@dataclass(frozen=True)
class ForAPerson:
    """An answer in words. ``look_for`` is the rubric: for whoever reads it, not for the student."""

    look_for: str
    kinds = ("prose",)

    def verdict(self, part: Part, value: Any, case: Case) -> Verdict:
        """Leave it to a person."""
        return for_a_person("A person will read this.")


@dataclass(frozen=True)
class Number:
    """A number near what the student's own bench gives, or else near what their own earlier answers give.

    Parameters
    ----------
    what : the quantity, as in "the natural frequency of your bench"
    expected : of the bench
    rtol : tolerance, relative
    follow : from the student's own answers; None where nothing comes before
    follow_what : what that is, as in "J_l·omega_n² with your own J_l and omega_n"
    follow_rtol : tolerance for it, relative
    slips : usual mistakes: what was done → the number that it leads to
    """

    what: str
    expected: Callable[[TrueBench], float]
    rtol: float
    follow: Callable[[Own], float] | None = None
    follow_what: str = ""
    follow_rtol: float = 0.02
    slips: Callable[[TrueBench], Mapping[str, float]] = field(default=lambda bench: {})
    kinds = ("number",)

    def verdict(self, part: Part, value: Any, case: Case) -> Verdict:
        """Compare with the bench, then with the student's own answers."""
        if _near(value, self.expected(case.bench), self.rtol):
            return right(f"Within {100 * self.rtol:g} % of {self.what}.")
        own = self._from_own(case)
        if own is not None and _near(value, own, self.follow_rtol):
            return follow_through(f"Not {self.what}, but it agrees with {self.follow_what}.")
        for slip, number in self.slips(case.bench).items():
            if _near(value, number, self.rtol):
                return wrong(f"Not {self.what}: {slip}.")
        disagrees = f" It does not agree with {self.follow_what} either." if own is not None else ""
        return wrong(f"More than {100 * self.rtol:g} % off {self.what}.{disagrees}")

    def _from_own(self, case: Case) -> float | None:
        """What the student's own answers lead to; None where they lead nowhere."""
        if self.follow is None:
            return None
        try:
            number = float(self.follow(case.own))
        except (LookupError, ArithmeticError):
            return None
        return number if math.isfinite(number) and number != 0 else None


def _near(value: float, target: float, rtol: float) -> bool:
    return abs(value - target) <= rtol * abs(target)


@dataclass(frozen=True)
class RecordingOf:
    """A recording that the student's own bench gives, too, when the experiment is run again.

    Parameters
    ----------
    recording : of the bench
    channel : to compare
    rtol : largest RMS difference, relative. Where the arm came to rest before moves a whole channel a little, so means
        are not compared.
    """

    recording: Callable[[TrueBench], Recording]
    channel: str
    rtol: float
    kinds = ("recording",)

    def verdict(self, part: Part, value: Any, case: Case) -> Verdict:
        """Compare samples."""
        refused = refused_recording(part, value, case)
        if refused is not None:
            return refused
        expected = self.recording(case.bench)
        if value["n"] != len(expected) or not _near(value["sample_time"], expected.sample_time, 1e-3):
            return wrong("It has another length or sample time than the experiment as the notebook describes it.")
        samples = value["channels"][self.channel]["values"]
        difference = misfit(samples, expected[self.channel][thin(len(expected), samples.size)])
        if difference <= self.rtol:
            return right("Your bench gives the same when the experiment is run again.")
        if value["metadata"].get("drive", "position") != "position":
            return wrong("The servo did not follow the sweep: it was sent to the motor as a voltage.")
        return wrong(
            "Not a recording of your bench: run again on your own bench as the notebook describes it, the experiment "
            f"gives another {self.channel}."
        )


def refused_recording(part: Part, value: dict[str, Any], case: Case) -> Verdict | None:
    """The verdict on a recording that cannot be compared, or is of another experiment; None if it can be."""
    if not case.virtual:
        return for_a_person("It does not come from the virtual bench; a person will look at it.")
    for name, wanted in part.settings:
        if value["metadata"].get(name) != wanted:
            return wrong(f"It is not the recording that is asked for: its {name} should be {wanted!r}.")
    return None


def misfit(values: NDArray[np.float64], reference: NDArray[np.float64]) -> float:
    """RMS difference of two signals (n,) about their means, relative to the reference's own; inf where it has none."""
    given, wanted = values - values.mean(), reference - reference.mean()
    ratio = float(np.sqrt(np.mean((given - wanted) ** 2) / np.mean(wanted**2)))
    return ratio if math.isfinite(ratio) else math.inf
