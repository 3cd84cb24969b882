"""Checks of numbers that build on each other: model, poles, companion form, gain.

Everything after the stiffness depends on it, and it is measured. So an answer is compared with three things in turn:
what the true stiffness of the student's bench leads to; what the student's *own* stiffness leads to when all the rest
is done right; and what their own answer just before leads to. The first is right; so is the second, if the student's
stiffness is; the third, and the second with a stiffness that is off, are right given their own earlier answers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotflex.config import Joint, Servo
from rotflex.courseware.parts import Part
from rotflex.instructor import design, model
from rotflex.instructor.marking.checks import NOT_TO_BE_HAD
from rotflex.instructor.verdicts import Case, Own, Verdict, follow_through, partly, right, wrong
from rotflex.simulation import with_actuator
from rotflex.specifications import OMEGA_N, P_3, P_4, ZETA
from rotflex.workbook.probes import PLANT_PARAMETERS

from . import tolerances

Array = NDArray[Any]


def desired_poles() -> Array:
    """Desired closed-loop poles (3.4)."""
    return design.desired_poles(ZETA, OMEGA_N, P_3, P_4)


def desired_polynomial() -> Array:
    """Desired characteristic polynomial (3.4)."""
    return np.poly(desired_poles()).real


@dataclass(frozen=True)
class Design:
    """All that follows from a stiffness: the workbook's route, done right.

    Parameters
    ----------
    servo, joint : the parts, as the student is told them
    K_s : stiffness, N·m/rad
    """

    servo: Servo
    joint: Joint
    K_s: float

    @cached_property
    def torque_model(self) -> tuple[Array, Array, Array, Array]:
        """A, B, C, D with the torque as input (2.14)."""
        system = model.state_space(self.servo, self.joint, self.K_s, input="torque")
        return np.asarray(system.A), np.asarray(system.B), np.asarray(system.C), np.asarray(system.D)

    @cached_property
    def voltage_model(self) -> tuple[Array, Array]:
        """A and B with the motor voltage as input."""
        return with_actuator(self.torque_model[0], self.torque_model[1], self.servo)

    @cached_property
    def poles(self) -> Array:
        """Open-loop poles (2.18)."""
        return np.linalg.eigvals(self.voltage_model[0])

    @cached_property
    def polynomial(self) -> Array:
        """Open-loop characteristic polynomial (3.2)."""
        return np.poly(self.voltage_model[0])

    @cached_property
    def transformation(self) -> tuple[Array, Array, Array]:
        """T, T_c and W (3.7)."""
        return design.transformation(*self.voltage_model)

    @cached_property
    def K(self) -> Array:
        """Gain (3.8, 3.10)."""
        return design.gain_by_place(*self.voltage_model, desired_poles())


def candidates(case: Case) -> Iterator[tuple[Design, bool]]:
    """The designs that an answer may stand on, and whether their stiffness is right.

    Where the stiffness was not answered, the one in the student's matrix A serves, but only if it is right: nothing
    follows from a number that was never given.
    """
    bench = case.bench
    yield Design(bench.servo, bench.joint, bench.K_s), True
    answered = True
    try:
        own = float(case.own("2.12", "K_s"))
    except LookupError:
        answered = False
        try:
            own = float(case.own("2.14", "A")[2][1]) * bench.servo.J_eq
        except LookupError:
            return
    is_right = abs(own - bench.K_s) <= tolerances.K_S * bench.K_s
    if is_right or (answered and own > 0):
        yield Design(bench.servo, bench.joint, own), is_right


def own_voltage_model(own: Own, servo: Servo) -> tuple[Array, Array]:
    """A and B with the motor voltage as input, from the student's own matrices. Raises LookupError without them."""
    return with_actuator(own("2.14", "A"), np.reshape(own("2.14", "B"), (4, 1)), servo)


Follow = Callable[[Own, Servo], Array]


def settle(
    value: Any,
    case: Case,
    what: str,
    ideal: Callable[[Design], Any],
    agrees: Callable[[Any, Any], bool],
    follow: Follow | None,
    follow_what: str,
) -> Verdict | None:
    """The verdict on a value that agrees with one of the things that it may stand on; None if with none."""
    for candidate, stiffness_is_right in candidates(case):
        try:
            expected = ideal(candidate)
        except NOT_TO_BE_HAD:
            continue
        if agrees(value, expected):
            if stiffness_is_right:
                return right(f"Agrees with {what} of your bench.")
            return follow_through(f"Not {what} of your bench, but it agrees with your own stiffness.")
    if follow is not None:
        try:
            expected = follow(case.own, case.bench.servo)
        except NOT_TO_BE_HAD:
            return None
        if agrees(value, expected):
            return follow_through(f"Not {what} of your bench, but it agrees with {follow_what}.")
    return None


@dataclass(frozen=True)
class ArrayFrom:
    """A matrix or a vector of numbers, each entry within a tolerance.

    Parameters
    ----------
    what : as in "the companion matrix"
    ideal : from a design
    rtol : relative to the entry; and a thousandth of it relative to the largest entry, for what should be zero
    follow, follow_what : from the student's own answers, and what that is in words
    slips : usual mistakes: what was done → from the right array, what it leads to
    """

    what: str
    ideal: Callable[[Design], Any]
    rtol: float = 0.02
    follow: Follow | None = None
    follow_what: str = ""
    slips: tuple[tuple[str, Callable[[Array], Array]], ...] = ()
    kinds = ("matrix",)

    def verdict(self, part: Part, value: Any, case: Case) -> Verdict:
        """Compare with what the answer may stand on."""
        found = settle(value, case, self.what, self.ideal, self._agrees, self.follow, self.follow_what)
        if found is not None:
            return found
        for slip, changed in self.slips:
            for candidate, _ in candidates(case):
                if self._agrees(value, changed(np.asarray(self.ideal(candidate)))):
                    return wrong(f"Not {self.what}: {slip}.")
        return wrong(f"Not {self.what} of your bench, and not what follows from your own earlier answers.")

    def _agrees(self, value: Any, expected: Any) -> bool:
        given, wanted = np.ravel(value), np.ravel(np.asarray(expected, dtype=float))
        if given.shape != wanted.shape:
            return False
        room = self.rtol * np.abs(wanted) + 1e-3 * self.rtol * np.abs(wanted).max()
        return bool(np.all(np.abs(given - wanted) <= room))


@dataclass(frozen=True)
class GainPlaces:
    """A gain that puts the poles of the model where they are wanted, however it was found.

    The gain is judged by what it does: the closed-loop polynomial with the right model for the student's stiffness, or
    with the student's own model.

    Parameters
    ----------
    rtol : tolerance of the polynomial's coefficients, relative; the gain may be given to three digits
    follow, follow_what : a gain from the student's own answers that is right to use, and what it is in words
    """

    rtol: float = 0.02
    follow: Follow | None = None
    follow_what: str = ""
    kinds = ("matrix",)

    def verdict(self, part: Part, value: Any, case: Case) -> Verdict:
        """Place the poles with it."""
        gain = np.reshape(value, (1, 4))
        for candidate, stiffness_is_right in candidates(case):
            if self._places(gain, *candidate.voltage_model, desired_polynomial()):
                if stiffness_is_right:
                    return right("With this gain the poles of your model are where they are wanted.")
                return follow_through("It places the poles of the model that your own stiffness gives.")
        try:
            A, B = own_voltage_model(case.own, case.bench.servo)
            if self._places(gain, A, B, desired_polynomial()):
                return follow_through("It places the poles of your own model.")
            if self.follow is not None and np.allclose(gain, np.ravel(self.follow(case.own, case.bench.servo)), 2e-2):
                return follow_through(f"It agrees with {self.follow_what}.")
        except NOT_TO_BE_HAD:
            pass  # nothing of their own to try it on
        return wrong("With this gain the poles of your model are not where they are wanted.")

    def _places(self, gain: Array, A: Array, B: Array, wanted: Array) -> bool:
        closed = A - B @ gain
        if not np.isfinite(closed).all():  # a gain may be as large as numbers go
            return False
        reached = np.poly(closed).real
        return bool(np.all(np.abs(reached - wanted) <= self.rtol * np.abs(wanted)))


@dataclass(frozen=True)
class PolesFrom:
    """A set of poles, in any order, each within a tolerance.

    Parameters
    ----------
    what : as in "the open-loop poles"
    ideal : from a design
    rtol : distance relative to the pole's own, but at least to 1 rad/s
    follow, follow_what : from the student's own answers, and what that is in words
    """

    what: str
    ideal: Callable[[Design], Any]
    rtol: float = 0.02
    follow: Follow | None = None
    follow_what: str = ""
    kinds = ("poles",)

    def verdict(self, part: Part, value: Any, case: Case) -> Verdict:
        """Compare with what the answer may stand on."""
        found = settle(value, case, self.what, self.ideal, self._agrees, self.follow, self.follow_what)
        if found is not None:
            return found
        mirrored = settle(-np.conj(value), case, self.what, self.ideal, self._agrees, self.follow, self.follow_what)
        if mirrored is not None:
            return wrong(f"Not {self.what}: the signs of the real parts are turned round.")
        return wrong(f"Not {self.what} of your bench, and not what follows from your own earlier answers.")

    def _agrees(self, value: Any, expected: Any) -> bool:
        from scipy.optimize import linear_sum_assignment

        given, wanted = np.ravel(value).astype(complex), np.ravel(expected).astype(complex)
        if given.shape != wanted.shape:
            return False
        distance = np.abs(given[:, None] - wanted[None, :]) / np.maximum(1.0, np.abs(wanted))[None, :]
        rows, columns = linear_sum_assignment(distance)
        return bool(distance[rows, columns].max() <= self.rtol)


@dataclass(frozen=True)
class StateSpaceFunction:
    """``state_space(K_s, J_l, J_eq, B_eq) -> (A, B, C, D)``, tried on random parameters. A share for each matrix."""

    rtol: float = 1e-4
    kinds = ("function",)

    def verdict(self, part: Part, value: Any, case: Case) -> Verdict:
        """Compare the matrices with those of the derivation, written out."""
        good = dict.fromkeys("ABCD", True)
        for arguments, output in zip(PLANT_PARAMETERS.inputs(case.probe_seed), value, strict=True):
            for name, given, wanted in zip("ABCD", output, _written_out(*arguments), strict=True):
                room = self.rtol * max(1e-9, float(np.abs(wanted).max()))
                good[name] &= bool(np.all(np.abs(np.reshape(given, wanted.shape) - wanted) <= room))
        bad = [name for name, is_good in good.items() if not is_good]
        if not bad:
            return right("Called with other parameters, it gives their model.")
        reason = f"Called with other parameters, it gives another {' and '.join(bad)} than the derivation."
        return partly(0.5, reason) if len(bad) == 1 and bad != ["A"] else wrong(reason)


def _written_out(K_s: float, J_l: float, J_eq: float, B_eq: float) -> tuple[Array, Array, Array, Array]:
    """The model with the torque as input (Ans. 2.10 and 2.11)."""
    A = np.array(
        [
            [0, 0, 1, 0],
            [0, 0, 0, 1],
            [0, K_s / J_eq, -B_eq / J_eq, 0],
            [0, -K_s * (J_l + J_eq) / (J_l * J_eq), B_eq / J_eq, 0],
        ]
    )
    return A, np.array([[0], [0], [1 / J_eq], [-1 / J_eq]]), np.eye(2, 4), np.zeros((2, 1))
