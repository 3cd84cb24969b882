"""Checks of what is measured on a student's own bench: natural frequency, inertia, stiffness.

A number is right for the bench, or follows from the student's own. What follows is bounded, or a friend's numbers would
follow from each other: see :class:`Stiffness`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from labcourse.answers.parts import Part
from labcourse.grading.verdicts import Case, OwnBench, Verdict, follow_through, right, wrong
from rotflex.config import Joint, joint
from rotflex.hil.student_benches import FIRST_RUN
from rotflex.units import HZ

from . import readings, tolerances
from .repeated import run_of
from .true_bench import TrueBench

SWEEP, OMEGA_N, J_L, K_S = ("2.9", "sweep"), ("2.11", "omega_n"), ("2.12", "J_l"), ("2.12", "K_s")
_CARRIED = "It is your own answer, carried over."


@dataclass(frozen=True)
class NaturalFrequency:
    """omega_n, read in any honest way off what the student's own bench does (:mod:`.readings`).

    Parameters
    ----------
    carried : (question, part) of an answer that this one only carries over
    own_bench : by what it is known again on another bench
    """

    carried: tuple[str, str] | None = None
    own_bench: OwnBench | None = None
    kinds = ("number",)

    def verdict(self, part: Part, value: Any, case: Case) -> Verdict:
        """Look for a reading that it is."""
        found = frequency_of(value, case)
        if found is not None:
            return right(f"It is {found.what}, as near as that can be read.")
        if _is_own(value, self.carried, case):
            return follow_through(_CARRIED)
        if frequency_of(value * HZ, case) is not None:
            return wrong("Not the natural frequency of your bench: it looks like one in Hz; rad/s are asked for.")
        return wrong(
            "Nothing on your bench has its peak at this frequency: not its sweep, nor the ratio, nor a free swing."
        )


@dataclass(frozen=True)
class Stiffness:
    """K_s: right for the student's own bench, or what follows from their own J_l and omega_n.

    It follows from a wrong omega_n if J_l is right, and from a wrong J_l if omega_n is: one slip costs its own points.
    It does not follow where both are wrong, nor from an inertia that is wrong and another arm's: so a friend's three
    numbers, which fit each other, do not follow from each other.

    Parameters
    ----------
    carried : (question, part) of an answer that this one only carries over
    own_bench : by what it is known again on another bench
    """

    carried: tuple[str, str] | None = None
    own_bench: OwnBench | None = None
    kinds = ("number",)

    def verdict(self, part: Part, value: Any, case: Case) -> Verdict:
        """Compare with the bench, then with the student's own answers."""
        bench, omega, inertia = case.bench, _own(OMEGA_N, case), _own(J_L, case)
        if _by_itself(value, case):
            return right("It is J_l·omega_n² of your bench, as near as omega_n can be read.")
        reads = omega is not None and frequency_of(omega, case) is not None
        if reads and omega is not None and _agree(value, bench.J_l * omega * omega):
            return right("It is J_l·omega_n² of your bench, with your own omega_n.")
        follows = omega is not None and inertia is not None and _agree(value, inertia * omega * omega)
        if follows and inertia is not None and self._may_follow(inertia, bench, reads):
            return follow_through("Not the stiffness of your joint, but it agrees with your own J_l and omega_n.")
        if _is_own(value, self.carried, case):
            return follow_through(_CARRIED)
        return wrong(f"Not the stiffness of your joint{self._why(value, case, follows, reads)}.")

    def _may_follow(self, inertia: float, bench: TrueBench, reads: bool) -> bool:
        return is_right_inertia(inertia, bench) or (reads and not is_of_other_arms(inertia, bench))

    def _why(self, value: float, case: Case, follows: bool, reads: bool) -> str:
        if _by_itself(value * HZ**2, case):
            return ": it looks like J_l·f² with the frequency in Hz"
        if follows and reads:
            return ". It agrees with your own J_l, but that is another arm's"
        if follows:
            return ". It agrees with your own J_l and omega_n, but neither is your bench's"
        has_both = None not in (_own(OMEGA_N, case), _own(J_L, case))
        return ", and not J_l·omega_n² with your own J_l and omega_n" if has_both else ""


def frequency_of(omega: float, case: Case) -> readings.Span | None:
    """What a frequency (rad/s) is on the student's bench; None if it is nothing there."""
    return readings.place(omega, readings.spans(case.bench, _run(case)))


def is_right_inertia(J_l: float, bench: TrueBench) -> bool:
    """Whether it is that of the bench."""
    return abs(J_l - bench.J_l) <= max(tolerances.J_L * bench.J_l, readings.half_a_digit(J_l))


def is_of_other_arms(J_l: float, bench: TrueBench) -> bool:
    """Whether it may be an arm's, and is not made of the bench's own arm by a slip."""
    low, high = tolerances.ARMS
    slipped = (abs(J_l - one) <= tolerances.J_L_SLIP * one for one in inertia_slips(bench).values())
    return low <= J_l <= high and not any(slipped)


def inertia_slips(bench: TrueBench) -> Mapping[str, float]:
    """What usual mistakes make of J_l: what was done → the number."""
    arm: Joint = bench.joint
    others = sorted({1, 2, 3} - {arm.arm_position})
    own = arm.m_2 * arm.L_2**2 / 12  # of the top arm, about its middle
    return {
        **{
            f"the top arm is not at anchor {position} on your bench": replace(arm, d_12=joint(position).d_12).J_l
            for position in others
        },
        "the top arm has an inertia about its own middle, too": arm.J_l - own,
        "the distance of the top arm is that of its middle": arm.J_l + 3 * own,
    }


def _by_itself(K_s: float, case: Case) -> bool:
    """Whether a stiffness is right by itself: from the true frequency or the sweep's peak, to half a bin."""
    bench, room = case.bench, readings.half_a_digit(K_s)
    true = readings.around(bench.omega_n, tolerances.BIN)
    return any(
        bench.J_l * span.low**2 - room <= K_s <= bench.J_l * span.high**2 + room
        for span in (true, *readings.of_sweep(bench, _run(case), tolerances.BIN))
    )


def _agree(value: float, target: float) -> bool:
    room = max(tolerances.K_S_FROM_OWN * abs(target), readings.half_a_digit(value))
    return math.isfinite(target) and abs(value - target) <= room


def _is_own(value: float, carried: tuple[str, str] | None, case: Case) -> bool:
    own = None if carried is None else _own(carried, case)
    return own is not None and abs(value - own) <= tolerances.CARRIED * abs(own)


def _own(where: tuple[str, str], case: Case) -> float | None:
    """The student's own number; None where there is none to follow from."""
    try:
        return float(case.own(*where)) or None
    except LookupError:
        return None


def _run(case: Case) -> int:
    """The run that the student's own sweep says it is."""
    try:
        return run_of(case.own(*SWEEP)["metadata"])
    except LookupError:
        return FIRST_RUN
