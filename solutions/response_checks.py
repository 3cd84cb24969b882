"""Checks of closed-loop responses, simulated and on the bench, and of what is measured on them.

Nothing measured is taken on trust: the experiment is run again (:mod:`solutions.repeated`), on the student's own
virtual bench with their own gain, or simulated again with their own model, and the student's recording and numbers are
held against that. Numbers that are read correctly off a recording of something else that is known, such as the other
feedback, follow from that recording.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labcourse.answers.json_values import thin
from labcourse.answers.parts import Part
from labcourse.grading.marking.checks import misfit, refused_recording
from labcourse.grading.marks import Status
from labcourse.grading.verdicts import Case, Verdict, follow_through, for_a_person, partly, right, wrong
from rotflex import response
from rotflex.errors import RotflexError
from rotflex.recording import Recording
from rotflex.specifications import LIMITS as OF_SUMMARY
from rotflex.units import DEG

from .own_answers import usable
from .repeated import Again

Vector = NDArray[np.float64]
_COMPARED = ("theta", "alpha")  # channels by which a recording of something else is known
_SAME = 0.04  # RMS difference, relative, of two recordings of the same


@dataclass(frozen=True)
class ResponseOf:
    """A recording that comes out the same, channel by channel, when the experiment is run again.

    Parameters
    ----------
    again : runs it; any of the results will do
    channels : to compare; those in ``model`` are of the student's model and cost half of the points if they differ
    rtol : largest RMS difference, relative
    slips : usual mistakes: what was done → what it gives
    """

    again: Again
    channels: tuple[str, ...]
    model: tuple[str, ...] = ()
    rtol: float = 0.04
    slips: Mapping[str, Again] = field(default_factory=dict)
    kinds = ("recording",)

    def verdict(self, part: Part, value: Any, case: Case) -> Verdict:
        """Run it again and compare samples."""
        refused = refused_recording(part, value, case)
        if refused is not None:
            return refused
        runs = [run for run in self.again(case, value["metadata"]) if value["n"] == len(run)]
        if not runs:
            return wrong("It cannot be run again: it has another length than the notebook's, or the loop is unstable.")
        worst = [_apart(value, run, self.channels) for run in runs]
        best = runs[int(np.argmin(worst))]
        if min(worst) > self.rtol:
            for slip, does in self.slips.items():
                if any(_apart(value, run, self.channels) <= self.rtol for run in does(case, value["metadata"])):
                    return wrong(f"It is not the response that is asked for: {slip}.")
            return wrong(f"The experiment gives another response when it is run again{_with_what(case)}.")
        if any(_apart(value, best, (channel,)) > self.rtol for channel in self.model):
            return partly(0.5, "The bench's channels are right; your model of question 2.14 gives other curves.")
        return right(f"It comes out the same when the experiment is run again{_with_what(case)}.")


def _with_what(case: Case) -> str:
    """With which answers an experiment is run again: the student's own, if there is a gain or a model of theirs."""
    if any(_is_there(case, *where) for where in (("3.8", "K"), ("3.10", "K"), ("2.14", "A"))):
        return " with your own answers"
    return " with the right design, for you gave none"


def _is_there(case: Case, question: str, part: str) -> bool:
    """Whether there is an own answer from which something can follow."""
    try:
        usable(case.own, question, part)
    except LookupError:
        return False
    return True


def _apart(value: dict[str, Any], run: Recording, channels: tuple[str, ...]) -> float:
    """The largest RMS difference, relative, between a student's recording and a run; inf if the lengths differ."""
    if value["n"] != len(run):
        return math.inf
    samples = {channel: value["channels"][channel]["values"] for channel in channels}
    wanted = {channel: run[channel][thin(len(run), values.size)] for channel, values in samples.items()}
    return max(_differ(values, wanted[channel]) for channel, values in samples.items())


def _differ(values: Vector, wanted: Vector) -> float:
    """The RMS difference, relative; 0 where both stay where they are, as an angle of a model may."""
    return 0.0 if np.allclose(values, wanted, rtol=1e-5, atol=1e-9) else misfit(values, wanted)


@dataclass(frozen=True)
class Measured:
    """A number read off a response, near what the package reads off the same experiment run again.

    Parameters
    ----------
    quantity : "t_s", "PO", "alpha_max_deg", "V_max", "swing_deg" or "noise"
    again : runs it
    recording : (question, part) of the student's recording, for its settings
    measured : the question in which all is measured on it
    rtol, atol : tolerance: the larger of the two counts
    carried : (question, part) of an answer that this one only carries over
    slips : what else the student's recording may be of; then a number that agrees with that follows from it
    """

    quantity: str
    again: Again
    recording: tuple[str, str]
    measured: str = ""
    rtol: float = 0.03
    atol: float = 0.0
    carried: tuple[str, str] | None = None
    slips: tuple[Again, ...] = ()
    kinds = ("number",)

    def verdict(self, part: Part, value: Any, case: Case) -> Verdict:
        """Run it again, measure, and compare."""
        if not case.truth_is_known:
            return for_a_person("It was not measured on a bench that is known here; a person will look at it.")
        measured = measured_again(case, self.again, self.recording)
        expected = [one[self.quantity] for one in measured]
        if any(self._near(value, target) for target in expected):
            return right(f"Agrees with what is measured when the experiment is run again{_with_what(case)}.")
        found = self._from_own(value, case)
        if found is not None:
            return found
        if not expected:
            return wrong("It cannot be checked: with your gain the loop is unstable, or nothing could be measured.")
        slip = self._slip(value, expected)
        if self.quantity == "swing_deg" and any(abs(value - one["alpha_max_deg"]) <= self.atol for one in measured):
            slip = "It is the largest deflection of all; wanted is the largest later than 0.5 s after a turn begins."
        again = f"Not what is measured when the experiment is run again{_with_what(case)}."
        return wrong(f"{again} {slip}".strip())

    def _slip(self, value: float, expected: list[float]) -> str:
        """What was done wrong, where it shows."""
        if any(abs(value * DEG - t) <= self.rtol * t or abs(value / DEG - t) <= self.rtol * t for t in expected if t):
            return "Mind the unit: degrees and radians are mixed up."
        if self.quantity == "PO" and any(self._near(value / 2, target) for target in expected):
            return "It looks like per cent of the final angle; wanted is per cent of the step, which is twice as high."
        return ""

    def missing(self, part: Part, case: Case) -> Verdict | None:
        """A servo that never settles has no settling time to give: then it is right to leave it out."""
        if self.quantity != "t_s" or not case.truth_is_known:
            return None
        try:
            case.own(*self.recording)
            case.own(self.measured, "PO")
        except LookupError:
            return None
        expected = [measured["t_s"] for measured in measured_again(case, self.again, self.recording)]
        if not expected or np.isfinite(expected).any():
            return None
        return right("With your own answers the servo never settles, so there is no settling time to give.")

    def _from_own(self, value: float, case: Case) -> Verdict | None:
        """The verdict on a number that is the student's own answer, or on their own recording; None on another."""
        if self.carried is not None:
            try:
                if self._near(value, float(usable(case.own, *self.carried))):
                    return follow_through("It is your own answer, carried over.")
            except LookupError:
                pass  # nothing of their own to carry over
        if any(self._near(value, measured[self.quantity]) for measured in self._on_own_recording(case)):
            return follow_through("It is what your own recording shows, though that is not the one that is asked for.")
        return None

    def _on_own_recording(self, case: Case) -> list[dict[str, float]]:
        """What is measured on the student's own recording, if it is of one of the other things that are known."""
        try:
            own = case.own(*self.recording)
        except LookupError:
            return []
        runs = [run for does in self.slips for run in does(case, own["metadata"])]
        return _measured(run for run in runs if _apart(own, run, _COMPARED) <= _SAME)

    def _near(self, value: float, target: float) -> bool:
        # What never settles has no settling time to be near.
        return np.isfinite(target) and abs(value - target) <= max(self.rtol * abs(target), self.atol)


def measured_again(case: Case, again: Again, recording: tuple[str, str]) -> list[dict[str, float]]:
    """What is measured on the runs of an experiment; nothing for runs on which nothing can be."""
    try:
        metadata = case.own(*recording)["metadata"]
    except LookupError:
        metadata = {}
    return _measured(again(case, metadata))


def _measured(runs: Iterable[Recording]) -> list[dict[str, float]]:
    found = []
    for run in runs:
        try:
            summary = response.worst(response.measure(run))
        except RotflexError:
            continue
        numbers = (summary.settling_time, summary.overshoot, summary.max_alpha, summary.max_vm)
        if None not in numbers:
            t_s, PO, max_alpha, max_vm = (float(number or 0.0) for number in numbers)
            later = {"swing_deg": response.swing(run) / DEG, "noise": response.voltage_noise(run)}
            found.append({"t_s": t_s, "PO": PO, "alpha_max_deg": max_alpha / DEG, "V_max": max_vm, **later})
    return found


#: Section 3.1, by the names of the answers.
LIMITS = {
    "t_s": OF_SUMMARY["settling_time"],
    "PO": OF_SUMMARY["overshoot"],
    "alpha_max_deg": OF_SUMMARY["max_alpha"] / DEG,
    "V_max": OF_SUMMARY["max_vm"],
}


@dataclass(frozen=True)
class Satisfied:
    """Whether the specifications are met: as the student's own numbers say, if these are there.

    Nothing follows from numbers that were never measured: all of them are wrong, and nothing was recorded.

    Parameters
    ----------
    question : in which the numbers are given
    again : runs the experiment again
    recording : (question, part) of the student's recording
    numbers : the checks of the numbers
    """

    question: str
    again: Again
    recording: tuple[str, str]
    numbers: Mapping[str, Measured] = field(default_factory=dict)
    kinds = ("choice",)

    def verdict(self, part: Part, value: Any, case: Case) -> Verdict:
        """Compare with the student's own numbers, else with the experiment run again."""
        try:
            own = {name: float(usable(case.own, self.question, name)) for name in LIMITS}
        except LookupError:
            own = {}
        if own:
            return self._by_own(part, value, own, case)
        answers = {_meets(measured) for measured in measured_again(case, self.again, self.recording)}
        return right("It is so.") if value in answers else wrong("Hold each number against its limit.")

    def _by_own(self, part: Part, value: Any, own: dict[str, float], case: Case) -> Verdict:
        """Compare with the student's own numbers, of which some or all may be wrong."""
        judged = [check.verdict(part, own[name], case) for name, check in self.numbers.items()]
        wrong_ones = sum(verdict.status is Status.WRONG for verdict in judged)
        if judged and wrong_ones == len(judged) and not _is_there(case, *self.recording):
            return wrong("None of your numbers is right, and you recorded nothing: nothing follows from them.")
        if value != _meets(own) and not _touches(own):
            return wrong("Your own numbers, held against the four limits, say otherwise.")
        if not wrong_ones:
            return right("It agrees with the numbers that you measured.")
        return follow_through("It agrees with the numbers that you gave, though not all of them are right.")


def _touches(measured: dict[str, float]) -> bool:
    """Whether a number is on its limit, to rounding, and none beyond: 10 V at which it was cut off may be either."""
    shares = [measured[name] / limit for name, limit in LIMITS.items()]
    return 1 - 1e-3 <= max(shares) <= 1 + 1e-3


def _meets(measured: dict[str, float]) -> str:
    return "yes" if all(measured[name] <= limit for name, limit in LIMITS.items()) else "no"
