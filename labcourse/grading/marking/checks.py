"""How an answer of each sort is compared. A course's key is a table of these, and of what knows its plant.

A check is given a decoded answer (:mod:`labcourse.grading.marking.decoding`: finite numbers, bounded in size) and the
case at hand, and comes to a verdict: a status, the share of the points, and the reason, in words that a student can act
on and an instructor can defend. Reasons do not tell the expected value.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labcourse.answers.json_values import thin
from labcourse.answers.kinds.recordings import Sampled
from labcourse.answers.parts import WHOLE, Part
from labcourse.errors import CourseError
from labcourse.grading.verdicts import Case, Own, OwnBench, Verdict, follow_through, for_a_person, right, wrong

MOST_RUNS = 1000  #: of an experiment, far more than anybody makes: a bench repeats none beyond
_FIRST_RUN = 1  # counted as people count
_LONGEST_SHOWN = 40  # characters of what a recording says

#: What a calculation with a student's own answers may raise: then there is nothing that follows from them.
NOT_TO_BE_HAD = (LookupError, ArithmeticError, ValueError, RuntimeError, CourseError)


@dataclass(frozen=True)
class ForAPerson:
    """An answer in words, or a report as a whole. What to look for in it, the course's rubric says."""

    kinds = ("prose", WHOLE)

    def verdict(self, part: Part, value: Any, case: Case) -> Verdict:
        """Leave it to a person."""
        return for_a_person("A person will read this.")


@dataclass(frozen=True)
class Number:
    """A number near what the student's own bench gives, or else near what their own earlier answers give.

    Parameters
    ----------
    what : the quantity, as in "the time constant of your bench"
    expected : of the bench
    rtol : tolerance, relative
    follow : from the student's own answers; None where nothing comes before
    follow_what : what that is, as in "the product of your own two factors"
    follow_rtol : tolerance for it, relative
    slips : usual mistakes: what was done → the number that it leads to
    fewest_digits : the expected number, rounded to so many significant digits, is right as well; 0 for none of that
    own_bench : for what differs from bench to bench: by what it is known again; None where that is not looked for
    """

    what: str
    expected: Callable[[Any], float]
    rtol: float
    follow: Callable[[Own], float] | None = None
    follow_what: str = ""
    follow_rtol: float = 0.02
    slips: Callable[[Any], Mapping[str, float]] = field(default=lambda bench: {})
    fewest_digits: int = 0
    own_bench: OwnBench | None = None
    kinds = ("number",)

    def verdict(self, part: Part, value: Any, case: Case) -> Verdict:
        """Compare with the bench, then with the student's own answers."""
        expected = self.expected(case.bench)
        if _near(value, expected, self.rtol):
            return right(f"Within {100 * self.rtol:g} % of {self.what}.")
        if self.fewest_digits and _near(value, float(f"{expected:.{self.fewest_digits}g}"), 1e-9):
            return right(f"It is {self.what}, rounded.")
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
class ChoiceIs:
    """One of several words.

    Parameters
    ----------
    expected : the right one
    reason : why it is
    follow, follow_what : what the student's own answers make right (on their bench), and what these are in words
    """

    expected: str
    reason: str
    follow: Callable[[Own, Any], str] | None = None
    follow_what: str = ""
    kinds = ("choice",)

    def verdict(self, part: Part, value: Any, case: Case) -> Verdict:
        """Compare words."""
        if value == self.expected:
            return right(self.reason)
        if self.follow is not None:
            try:
                if value == self.follow(case.own, case.bench):
                    return follow_through(f"It agrees with {self.follow_what}.")
            except NOT_TO_BE_HAD:
                pass  # nothing of their own to compare with
        return wrong("Look again at what decides it.")


@dataclass(frozen=True)
class RecordingOf:
    """A recording that the student's own bench gives, too, when the experiment is run again.

    Parameters
    ----------
    recording : of the bench; and of the number of the run, where ``runs``
    channel : to compare
    rtol : largest RMS difference, relative. Where a bench came to rest before moves a whole channel a little, so means
        are not compared.
    slips : usual mistakes that the recording's metadata shows: (name, what it should be) → what was done
    runs : whether the bench's runs differ: then a recording is held against the run that it says it is
        (:func:`said_run`)
    """

    recording: Callable[..., Sampled]
    channel: str
    rtol: float
    slips: Mapping[tuple[str, str], str] = field(default_factory=dict)
    runs: bool = False
    kinds = ("recording",)

    def verdict(self, part: Part, value: Any, case: Case) -> Verdict:
        """Compare samples."""
        refused = refused_recording(part, value, case)
        if refused is not None:
            return refused
        of_run = (said_run(value["metadata"]),) if self.runs else ()
        expected = self.recording(case.bench, *of_run)
        if value["n"] != len(expected) or not _near(value["sample_time"], expected.sample_time, 1e-3):
            return wrong("It has another length or sample time than the experiment as the notebook describes it.")
        samples = value["channels"][self.channel]["values"]
        wanted = expected.channels[self.channel].values
        difference = misfit(samples, wanted[thin(len(expected), samples.size)])
        if difference <= self.rtol:
            return right("Your bench gives the same when the experiment is run again.")
        for (name, usual), slip in self.slips.items():
            if value["metadata"].get(name, usual) != usual:
                return wrong(slip)
        return wrong(
            "Not a recording of your bench: run again on your own bench as the notebook describes it, the "
            f"experiment gives another {self.channel}."
        )


def refused_recording(part: Part, value: dict[str, Any], case: Case) -> Verdict | None:
    """The verdict on a recording that cannot be compared, or is of another experiment; None if it can be."""
    if not case.virtual:
        return for_a_person("It does not come from a bench that is known here; a person will look at it.")
    for name, wanted in part.settings:
        if value["metadata"].get(name) != wanted:
            return wrong(f"It is not the recording that is asked for: its {name} should be {wanted!r}.")
    try:
        said_run(value["metadata"])
    except ValueError as error:
        return wrong(str(error))
    return None


def said_run(metadata: Mapping[str, Any]) -> int:
    """The number of the run that a recording says it is, as ``metadata["bench"]["run"]``; 1 where it says none.

    Raises
    ------
    ValueError
        If that is no number of a run; the message is for the student.
    """
    about = metadata.get("bench")
    run = about.get("run", _FIRST_RUN) if isinstance(about, Mapping) else _FIRST_RUN
    if isinstance(run, int) and not isinstance(run, bool) and _FIRST_RUN <= run <= MOST_RUNS:
        return run
    raise ValueError(
        f"It says that it is run {repr(run)[:_LONGEST_SHOWN]} of the bench. Runs have whole numbers from "
        f"{_FIRST_RUN} to {MOST_RUNS}: record it again with one of these."
    )


def misfit(values: NDArray[np.float64], reference: NDArray[np.float64]) -> float:
    """RMS difference of two signals (n,) about their means, relative to the reference's own; inf where it has none."""
    given, wanted = values - values.mean(), reference - reference.mean()
    ratio = float(np.sqrt(np.mean((given - wanted) ** 2) / np.mean(wanted**2)))
    return ratio if math.isfinite(ratio) else math.inf
