"""Checks of the feedback: a gain is judged by the poles that it gives, and poles by the student's own gain."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from labcourse.answers.parts import Part
from labcourse.grading.marking.checks import EVALUATION_ERRORS
from labcourse.grading.verdicts import Case, NothingFollows, Verdict, follow_through, right, wrong
from rotflex.design import gain_by_place

from . import tolerances
from .design_checks import (
    Array,
    Follows,
    candidates,
    led_to,
    same_poles,
)
from .own_answers import usable
from .own_model import own_voltage_model
from .wanted import desired_poles, desired_polynomial

Slip = Callable[[Array, Case], Any]  # (the right gain, the case) → the gain that a mistake leads to


def wanted_polynomials(case: Case) -> Iterator[tuple[Array, bool]]:
    """The closed-loop polynomials that a gain may be made for, and whether they are the right one.

    Besides the right one there are those of the student's own desired poles and polynomial (3.4).
    """
    yield desired_polynomial(), True
    for find in (
        lambda: np.poly(np.ravel(usable(case.own, "3.4", "desired_poles"))).real,
        lambda: np.ravel(usable(case.own, "3.4", "polynomial")),
    ):
        try:
            yield find(), False
        except EVALUATION_ERRORS:
            continue


def places(gain: Array, A: Array, B: Array, wanted: Array, rtol: float = tolerances.PLACED) -> bool:
    """Whether a gain gives a model this closed-loop polynomial."""
    closed = A - B @ np.reshape(gain, (1, 4))
    if not np.isfinite(closed).all():  # a gain may be as large as numbers go
        return False
    reached = np.poly(closed).real
    return bool(np.shape(reached) == np.shape(wanted) and np.all(np.abs(reached - wanted) <= rtol * np.abs(wanted)))


@dataclass(frozen=True)
class GainPlaces:
    """A gain that puts the poles of the model where they are wanted, however it was found.

    The gain is judged by what it does: the closed-loop polynomial with the right model for the student's stiffness, or
    with the student's own model; and the poles wanted may be the student's own of 3.4.

    Parameters
    ----------
    follow : gains from the student's own answers that are right to use
    slips : usual mistakes: what was done → the gain that it leads to
    """

    follow: Follows = ()
    slips: tuple[tuple[str, Slip], ...] = ()
    kinds = ("matrix",)

    def verdict(self, part: Part, value: Any, case: Case) -> Verdict:
        """Place the poles with it."""
        gain = np.reshape(value, (1, 4))
        found = self._by_placing(gain, case)
        if found is not None:
            return found
        own, why = led_to(case, self.follow)
        for words, expected in own:
            if np.allclose(gain, np.ravel(expected), rtol=tolerances.PLACED):
                return follow_through(f"It agrees with {words}.")
        reason = "With this gain the poles of your model, the eigenvalues of A - B K, are not where they are wanted"
        for slip, leads_to in self.slips:
            if self._is(gain, leads_to, case):
                return wrong(f"{reason}: {slip}.{why}")
        return wrong(f"{reason}.{why}")

    def _by_placing(self, gain: Array, case: Case) -> Verdict | None:
        for wanted, wanted_is_right in wanted_polynomials(case):
            where = "they are wanted" if wanted_is_right else "you want them in question 3.4"
            for candidate, stiffness_is_right in candidates(case):
                if places(gain, *candidate.voltage_model, wanted):
                    if stiffness_is_right and wanted_is_right:
                        return right("With this gain the poles of your model are where they are wanted.")
                    model = "right model" if stiffness_is_right else "model that your own stiffness gives"
                    return follow_through(f"It puts the poles of the {model} where {where}.")
            try:
                if places(gain, *own_voltage_model(case.own, case.bench.servo), wanted):
                    return follow_through(f"It puts the poles of your own model where {where}.")
            except EVALUATION_ERRORS:
                continue  # nothing of their own to try it on
        return None

    def _is(self, gain: Array, leads_to: Slip, case: Case) -> bool:
        for candidate, _stiffness_is_right in candidates(case):
            try:
                if np.allclose(gain, np.reshape(leads_to(np.ravel(candidate.K), case), (1, 4)), rtol=tolerances.PLACED):
                    return True
            except EVALUATION_ERRORS:
                continue
        return False


@dataclass(frozen=True)
class ClosedLoopPoles:
    """The poles of A − B K, with the student's own gain: the desired ones only if that gain gives them.

    Without a gain of their own, the desired poles are all that can be expected.

    Parameters
    ----------
    rtol : as for :class:`~solutions.design_checks.PolesFrom`
    follow : more that these poles may be
    """

    rtol: float = 0.02
    follow: Follows = ()
    kinds = ("poles",)

    def verdict(self, part: Part, value: Any, case: Case) -> Verdict:
        """Close the loop with the student's own gain."""
        wanted = same_poles(value, desired_poles(), self.rtol)
        try:
            gain = self._own_gain(case)
        except NothingFollows as nothing:
            return wrong(f"These are not the poles of a loop with feedback. {nothing}")
        except LookupError:
            gain = None
        if gain is None and wanted:
            return right("These are the desired poles.")
        found = self._by_closing(gain, value, wanted, case) if gain is not None else None
        own, why = led_to(case, self.follow)
        for words, expected in own:
            if found is None and same_poles(value, expected, self.rtol):
                found = follow_through(f"It agrees with {words}.")
        if found is not None:
            return found
        if wanted:
            return wrong(
                "These are the desired poles, but with your own gain of question 3.8 they are not where your "
                "model's are: compute the eigenvalues of A - B K."
            )
        if gain is None:
            return wrong(f"These are not the desired poles, and there is no gain of yours that gives others.{why}")
        return wrong(f"Not the poles of your own model with your own gain: the eigenvalues of A - B K.{why}")

    def _by_closing(self, gain: Array, value: Any, wanted: bool, case: Case) -> Verdict | None:
        """The verdict on the poles that the student's own gain gives; None on others."""
        for A, B in self._models(case):
            if wanted and places(gain, A, B, desired_polynomial()):
                return right("Your own gain puts the poles there, and these are the desired ones.")
            loop = A - B @ gain
            if np.isfinite(loop).all() and same_poles(value, np.linalg.eigvals(loop), self.rtol):
                return follow_through(
                    "It is what your own model and gain give. These are not the desired poles: look for the "
                    "reason in questions 2.14, 3.5, 3.7 and 3.8."
                )
        return None

    def _own_gain(self, case: Case) -> Array:
        try:
            return np.reshape(usable(case.own, "3.8", "K"), (1, 4))
        except NothingFollows:
            raise
        except LookupError:
            return np.reshape(usable(case.own, "3.10", "K"), (1, 4))

    def _models(self, case: Case) -> Iterator[tuple[Array, Array]]:
        """The student's own model first, then those that follow from a stiffness."""
        try:
            A, B = own_voltage_model(case.own, case.bench.servo)
            yield A, np.reshape(B, (4, 1))
        except EVALUATION_ERRORS:
            pass  # none of their own
        for candidate, _stiffness_is_right in candidates(case):
            yield candidate.voltage_model


def by_own_companion(case: Case) -> Array:
    """The gain by the student's own gain in companion form and their own W (3.8)."""
    return np.ravel(usable(case.own, "3.5", "K_c")) @ np.linalg.inv(usable(case.own, "3.7", "W"))


def torque_gain(case: Case) -> Array:
    """The gain that places the poles of the student's own model with the torque as input, for which none was asked."""
    return gain_by_place(usable(case.own, "2.14", "A"), usable(case.own, "2.14", "B"), desired_poles())
