"""Checks of numbers that build on each other: model, poles, companion form.

Everything after the stiffness depends on it, and it is measured. So an answer is compared with three things in turn:
what the true stiffness of the student's bench leads to; what the student's *own* stiffness leads to when all the rest
is done right; and what their own answers just before lead to. The first is right; so is the second, if the student's
stiffness is; the third, and the second with a stiffness that is off, are right given their own earlier answers.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labcourse.answers.parts import Part
from labcourse.grading.marking import checks
from labcourse.grading.marking.checks import EVALUATION_ERRORS, MIRRORED, mirrored, same_entries
from labcourse.grading.marking.expression_checks import value_at
from labcourse.grading.verdicts import Case, NothingFollows, OwnAnswers, Verdict, follow_through, partly, right, wrong
from rotflex import design, model
from rotflex.config import Joint, Servo
from rotflex.course.probes import PLANT_PARAMETERS
from rotflex.simulation import with_actuator

from . import tolerances
from .own_answers import usable
from .wanted import desired_poles

Array = NDArray[Any]
Follow = Callable[[Case], Any]
#: What an answer may follow from: what that is, in words → what it leads to.
Follows = tuple[tuple[str, Follow], ...]
CARRIED = "your own answer"
DISCRETE = "it is that of a model in discrete time; one in continuous time is asked for"


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
    """Return the designs that an answer may be based on, and whether their stiffness is right.

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


def carried(question: str, part: str) -> Follows:
    """Return what an entry of a results table follows from: the student's own answer, carried over."""
    return ((CARRIED, lambda case: np.asarray(usable(case.own, question, part))),)


def led_to(case: Case, follow: Follows) -> tuple[list[tuple[str, Any]], str]:
    """Return what the student's own answers lead to, each with its name; and why to nothing, if that is known."""
    found, why = [], ""
    for words, function in follow:
        try:
            expected = function(case)
        except NothingFollows as nothing:
            why = why or f" {nothing}"
        except EVALUATION_ERRORS:
            pass  # nothing of their own
        else:
            if np.any(expected):
                found.append((words, expected))
            else:
                why = why or f" From {words} follows nothing but zeros."
    return found, why


def judge_candidates(
    value: Any,
    case: Case,
    what: str,
    ideal: Callable[[Design], Any],
    agrees: Callable[[Any, Any], bool],
    follow: Follows,
) -> tuple[Verdict | None, str]:
    """Judge a value by each design that it may be based on, then by what the student's own answers lead to.

    Returns
    -------
    Verdict or None
        The verdict of the first that the value agrees with; None if it agrees with none.
    str
        Why nothing follows from the student's own answers, with a space before it; empty where that is not known.
    """
    for candidate, stiffness_is_right in candidates(case):
        try:
            expected = ideal(candidate)
        except EVALUATION_ERRORS:
            continue
        if agrees(value, expected):
            if stiffness_is_right:
                return right(f"Agrees with {what} of your bench."), ""
            return follow_through(f"Not {what} of your bench, but it agrees with your own stiffness."), ""
    found, why = led_to(case, follow)
    for words, expected in found:
        if agrees(value, expected):
            return follow_through(f"Not {what} of your bench, but it agrees with {words}."), ""
    return None, why


def _wrong(what: str, case: Case, follow: Follows, why: str) -> Verdict:
    """The verdict on a value that agrees with nothing; own answers are named only if there are any that lead to one."""
    has_own = led_to(case, follow)[0] or len([*candidates(case)]) > 1
    own = ", and not what follows from your own earlier answers" if has_own else ""
    return wrong(f"Not {what} of your bench{own}.{why}")


@dataclass(frozen=True)
class ArrayFrom:
    """A matrix or a vector of numbers, each entry within a tolerance.

    Parameters
    ----------
    what : as in "the companion matrix"
    ideal : from a design
    rtol : relative to the entry; and a thousandth of it relative to the largest entry, for what should be zero
    follow : from the student's own answers
    slips : usual mistakes: what was done → from the right array, what it leads to
    others : usual mistakes: what was done → from the student's own answers, what it leads to
    """

    what: str
    ideal: Callable[[Design], Any]
    rtol: float = 0.02
    follow: Follows = ()
    slips: tuple[tuple[str, Callable[[Array], Array]], ...] = ()
    others: Follows = ()
    kinds = ("matrix",)

    def verdict(self, part: Part, value: Any, case: Case) -> Verdict:
        """Compare with what the answer may be based on."""
        found, why = judge_candidates(value, case, self.what, self.ideal, self._agrees, self.follow)
        if found is not None:
            return found
        ideal_ones = [*self._ideal_ones(case), *(own for _words, own in led_to(case, self.follow)[0])]
        for slip, changed in self.slips:
            for expected in ideal_ones:
                with contextlib.suppress(*EVALUATION_ERRORS):  # what cannot be inverted, say, was not
                    if self._agrees(value, changed(np.asarray(expected))):
                        return wrong(f"Not {self.what}: {slip}.")
        if np.ndim(value) == 2 and any(is_sampled(value, expected, self._agrees) for expected in ideal_ones):
            return wrong(f"Not {self.what}: {DISCRETE}.")
        for slip, expected in led_to(case, self.others)[0]:
            if self._agrees(value, expected):
                return wrong(f"Not {self.what}: {slip}.")
        return _wrong(self.what, case, self.follow, why)

    def _ideal_ones(self, case: Case) -> Iterator[Any]:
        for candidate, _stiffness_is_right in candidates(case):
            with contextlib.suppress(*EVALUATION_ERRORS):  # a stiffness may be too large to design with
                yield self.ideal(candidate)

    def _agrees(self, value: Any, expected: Any) -> bool:
        return same_entries(value, expected, self.rtol)


@dataclass(frozen=True)
class PolesFrom:
    """A set of poles, in any order, each within a tolerance.

    Parameters
    ----------
    what : as in "the open-loop poles"
    ideal : from a design
    rtol : distance relative to the pole's own, but at least to 1 rad/s
    follow : from the student's own answers
    slips : usual mistakes: what was done → what undoes it
    others : usual mistakes: what was done → from the student's own answers, what it leads to
    """

    what: str
    ideal: Callable[[Design], Any]
    rtol: float = 0.02
    follow: Follows = ()
    slips: tuple[tuple[str, Callable[[Array], Array]], ...] = ()
    others: Follows = ()
    kinds = ("poles",)

    def verdict(self, part: Part, value: Any, case: Case) -> Verdict:
        """Compare with what the answer may be based on."""
        found, why = judge_candidates(value, case, self.what, self.ideal, self._agrees, self.follow)
        if found is not None:
            return found
        for slip, changed in ((MIRRORED, mirrored), *self.slips):
            if judge_candidates(changed(value), case, self.what, self.ideal, self._agrees, self.follow)[0] is not None:
                return wrong(f"Not {self.what}: {slip}.")
        if judge_candidates(value, case, self.what, self.ideal, self._is_sampled, self.follow)[0] is not None:
            return wrong(f"Not {self.what}: {DISCRETE}.")
        for slip, expected in led_to(case, self.others)[0]:
            if self._agrees(value, expected):
                return wrong(f"Not {self.what}: {slip}.")
        return _wrong(self.what, case, self.follow, why)

    def _agrees(self, value: Any, expected: Any) -> bool:
        return same_poles(value, expected, self.rtol)

    def _is_sampled(self, value: Any, expected: Any) -> bool:
        return is_sampled(value, expected, self._agrees)


def is_sampled(value: Any, expected: Any, agrees: Callable[[Any, Any], bool]) -> bool:
    """Whether a matrix, or a set of poles, is that of the expected model from one sample to the next.

    Its logarithm, or what Euler's method adds to 1, agrees with a multiple of what is expected, by the sample time.
    """
    wanted, given = np.asarray(expected), np.asarray(value)
    with np.errstate(all="ignore"), contextlib.suppress(*EVALUATION_ERRORS):
        steps = [np.log(given.astype(complex)), given - 1]
        if given.ndim == 2:
            steps = [logarithm(given), given - np.eye(len(given))]
        multiples = [step * (np.linalg.norm(wanted) / np.linalg.norm(step)) for step in steps]
        return any(np.isfinite(one).all() and agrees(np.real_if_close(one), wanted) for one in multiples)
    return False


def logarithm(matrix: Array) -> Array:
    """Return the logarithm of a matrix (n, n), such as A h of exp(A h)."""
    values, vectors = np.linalg.eig(matrix)
    return np.real_if_close((vectors * np.log(values.astype(complex))) @ np.linalg.inv(vectors), tol=1e6)


def same_poles(value: Any, expected: Any, rtol: float) -> bool:
    """Whether two sets of poles are the same, in any order; the tolerance is that of :class:`PolesFrom`."""
    return checks.same_poles(value, expected, rtol, rtol * 1.0)  # of 1 rad/s


@dataclass(frozen=True)
class StateSpaceFunction:
    """``state_space(K_s, J_l, J_eq, B_eq) -> (A, B, C, D)``, tried on random parameters. A share for each matrix."""

    rtol: float = 1e-4
    kinds = ("function",)

    def verdict(self, part: Part, value: Any, case: Case) -> Verdict:
        """Compare the matrices with those of the derivation, written out, and with the student's own of 2.7."""
        inputs = PLANT_PARAMETERS.inputs(case.probe_seed)
        bad = self._differing(value, [dict(zip("ABCD", _written_out(*one), strict=True)) for one in inputs])
        if not bad:
            return right("Called with other parameters, it gives their model.")
        pairs = zip(value, inputs, strict=True)
        if all(is_sampled(output[0], _written_out(*one)[0], partial(same_entries, rtol=0.02)) for output, one in pairs):
            return wrong(f"Not the model of the derivation: {DISCRETE}.")
        try:
            own = [own_matrices(case.own, *one) for one in inputs]
        except EVALUATION_ERRORS:
            own = []
        if own and not set(bad) - set("AB") and not self._differing(value, own):
            return follow_through("Not the model of the derivation, but it gives your own matrices of question 2.7.")
        reason = f"Called with other parameters, it gives another {' and '.join(bad)} than the derivation."
        if "A" in bad:
            reason += f" Look at row {', '.join(map(str, self._rows(value, inputs)))} of A, and at the signs in it."
        return partly(0.5, reason) if len(bad) == 1 and bad != ["A"] else wrong(reason)

    def _differing(self, value: Any, expected: list[dict[str, Array]]) -> list[str]:
        """The matrices that differ, of those that are expected."""
        bad = []
        for name in expected[0]:
            pairs = [(output["ABCD".index(name)], one[name]) for output, one in zip(value, expected, strict=True)]
            if not all(self._near(given, wanted).all() for given, wanted in pairs):
                bad.append(name)
        return bad

    def _near(self, given: Any, wanted: Array) -> Array:
        room = self.rtol * max(1e-9, float(np.abs(wanted).max()))
        return np.asarray(np.abs(np.reshape(given, wanted.shape) - wanted) <= room)

    def _rows(self, value: Any, inputs: Any) -> list[int]:
        """The rows of A that differ from those of the derivation, counted from 1."""
        good = np.all(
            [self._near(output[0], _written_out(*one)[0]) for output, one in zip(value, inputs, strict=True)], 0
        )
        return [i + 1 for i in range(len(good)) if not good[i].all()]


def own_matrices(own: OwnAnswers, K_s: float, J_l: float, J_eq: float, B_eq: float) -> dict[str, Array]:
    """The student's own A and B of question 2.7 for some parameters. Raises LookupError without them."""
    point = {"K_s": K_s, "J_l": J_l, "J_eq": J_eq, "B_eq": B_eq}
    found = {}
    for name in "AB":
        matrix = own("2.7", name)
        found[name] = np.reshape([value_at(entry, point) for entry in matrix], matrix.shape)
    if np.linalg.matrix_rank(found["A"]) < 3 or not np.any(found["B"]):
        raise NothingFollows("Your own matrices of question 2.7 are nearly all zeros, and nothing follows from that.")
    return found


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
