"""Section 2: what can be asked of the derivation, the stiffness and the model.

Of the derivation (2.3 to 2.6), steps that do not follow from the one before; expressions are compared at a few random
points. Of the stiffness and the model (2.11 to 2.18), what does not agree with what is measured or derived.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any

import numpy as np

from labcourse.answers.reflection import Comparison
from rotflex.config import Joint, Servo
from rotflex.course.probes import PLANT_PARAMETERS
from rotflex.course.reflection.common import (
    BUILT,
    CARRIED,
    AnyArray,
    StoredRecording,
    alike,
    hertz,
    listed,
    same_poles,
    sweep_spectrum,
)
from rotflex.simulation import with_actuator

Point = Mapping[str, float]

_NAMES = ("theta", "alpha", "theta_dot", "alpha_dot", "tau", "J_eq", "J_l", "B_eq", "B_l", "K_s")
_ARMS = ("m_1", "L_1", "m_2", "L_2", "d_12")
_POINTS = 4
AGREES = 2e-3  #: relative: a third may be written 0.333

_ELSEWHERE = 0.2  # relative, of omega_n: read off a free swing it is up to 10 % low, and a sweep's peak up to 6 % high
_RINGS = 0.1  # relative, of omega_n: K_s and omega_n of two digits are 6 % apart at most
_EXACT = 1e-3  # relative: outputs are stored to six digits, and a third may be 0.333


def modeling_checks(servo: Servo, joint: Joint, probe_seed: int) -> tuple[Comparison, ...]:
    """Return the checks of derivation, stiffness and model.

    Parameters
    ----------
    servo, joint : as the student is told them
    probe_seed : from which the inputs of functions are drawn
    """
    rates = ("2.6", "theta_ddot"), ("2.6", "alpha_ddot")
    paper = ("2.7", "A"), ("2.7", "B")
    omega_n, K_s, J_l = ("2.11", "omega_n"), ("2.12", "K_s"), ("2.12", "J_l")
    A, B = ("2.14", "A"), ("2.14", "B")
    numbers = partial(_numbers, servo=servo)
    return (
        Comparison((("2.3", "L"), ("2.2", "T"), ("2.1", "V")), _lagrangian),
        Comparison((*rates, ("2.4", "equation"), ("2.5", "equation")), _solve),
        Comparison((omega_n, ("2.9", "sweep")), _peak),
        Comparison((J_l, ("2.8", "J_l")), partial(_inertia, joint=joint)),
        Comparison((K_s, J_l, omega_n), _stiffness),
        Comparison((("2.13", "state_space"), *paper), partial(_code, probe_seed=probe_seed)),
        Comparison((A, paper[0], K_s, J_l), numbers),
        Comparison((B, paper[1], K_s, J_l), numbers),
        Comparison((A, B, omega_n), _rings),
        Comparison((("2.18", "poles"), A, B), partial(_open_loop, servo=servo)),
    )


# --- expressions at points --------------------------------------------------------------------------------------------


def points(names: tuple[str, ...]) -> Iterator[dict[str, float]]:
    """Draw a few points: a value of each name."""
    draw = np.random.default_rng(1)
    for _point in range(_POINTS):
        yield dict(zip(names, draw.uniform(0.5, 2.0, len(names)).tolist(), strict=True))


def value_at(expression: Any, point: Point) -> float:
    """Return the value of an expression at a point.

    Raises
    ------
    ArithmeticError
        If it has no real one there.
    """
    import sympy

    number = sympy.sympify(expression).xreplace({sympy.Symbol(name): sympy.Float(v) for name, v in point.items()})
    found = complex(number)
    if not np.isfinite(found) or abs(found.imag) > 1e-9 * abs(found.real):
        raise ArithmeticError("not a real number")
    return found.real


def _matrix_at(matrix: Any, point: Point) -> AnyArray:
    """Return the numbers of a matrix of expressions at a point."""
    rows, columns = matrix.shape
    return np.array([[value_at(matrix[i, j], point) for j in range(columns)] for i in range(rows)])


# --- one step from the one before -------------------------------------------------------------------------------------


def _lagrangian(L: Any, T: Any, V: Any) -> str | None:
    for point in points(_NAMES):
        own_L, own_T, own_V = (value_at(expression, point) for expression in (L, T, V))
        if abs(own_L - (own_T - own_V)) > AGREES * max(abs(own_L), abs(own_T), abs(own_V), 1e-3):
            return "This L is not the Lagrangian of your own T and V. How do you compute L from T and V?"
    return None


def _solve(theta_ddot: Any, alpha_ddot: Any, servo: Any, link: Any) -> str | None:
    for point in points(_NAMES):
        undamped = {**point, "B_l": 0.0}
        found = {"theta_ddot": value_at(theta_ddot, undamped), "alpha_ddot": value_at(alpha_ddot, undamped)}
        solved = {**undamped, **found}
        for number, equation in (("2.4", servo), ("2.5", link)):
            left = equation.lhs - equation.rhs
            terms = max(abs(value_at(left, one)) for one in (solved, *({**solved, name: 0.0} for name in found)))
            if abs(value_at(left, solved)) > 2 * AGREES * terms:
                return (
                    f"Your two accelerations do not satisfy your own equation of question {number} with B_l = 0. "
                    "Did you lose a sign or a term when you solved for them?"
                )
    return None


# --- what is measured -------------------------------------------------------------------------------------------------


def _peak(omega_n: float, sweep: StoredRecording) -> str | None:
    omega, amplitude = sweep_spectrum(sweep)
    if abs(omega_n / omega[np.argmax(amplitude)] - 1) <= _ELSEWHERE:
        return None
    there = 100 * float(np.interp(omega_n, omega, amplitude))
    return (
        f"Your omega_n of {omega_n:.3g} rad/s is {hertz(omega_n)}. There, the spectrum of your own sweep has "
        f"{there:.0f} % of its highest value. Which peak did you read?"
    )


def _inertia(J_l: float, formula: Any, *, joint: Joint) -> str | None:
    own = value_at(formula, {name: getattr(joint, name) for name in _ARMS})
    if alike(J_l, own, CARRIED / 2):
        return None
    return (
        f"Your own formula (2.8), with lab.joint's masses and lengths, gives {100 * own / J_l:.3g} % of this J_l. Are "
        "these the numbers of your own bench, at its anchor?"
    )


def _stiffness(K_s: float, J_l: float, omega_n: float) -> str | None:
    if alike(K_s, J_l * omega_n**2, BUILT):
        return None
    return (
        f"With your J_l = {J_l:.3g} kg·m² and K_s = {K_s:.3g} N·m/rad, a link swings at "
        f"{hertz(math.sqrt(abs(K_s / J_l)))}; your omega_n is {hertz(omega_n)}. Which of the three numbers is "
        "wrong?"
    )


# --- the model in code and in numbers ---------------------------------------------------------------------------------


def _code(outputs: list[tuple[AnyArray, ...]], A: Any, B: Any, *, probe_seed: int) -> str | None:
    differing: dict[str, set[int]] = {"A": set(), "B": set()}
    for (code_A, code_B, *_more), parameters in zip(outputs, PLANT_PARAMETERS.inputs(probe_seed), strict=True):
        point = dict(zip(("K_s", "J_l", "J_eq", "B_eq"), parameters, strict=True))
        for name, code, paper in (("A", code_A, _matrix_at(A, point)), ("B", code_B, _matrix_at(B, point))):
            differing[name].update(_rows(code, paper, _EXACT))
    if not any(differing.values()):
        return None
    rows = " and ".join(
        f"row {', '.join(map(str, sorted(rows)))} of {name}" for name, rows in differing.items() if rows
    )
    return (
        "With the same parameters, your function and your own A and B of question 2.7 give different numbers in "
        f"{rows}. At least one of the two is wrong. If it is 2.7, which step from 2.1 on is wrong?"
    )


def _rows(one: AnyArray, other: AnyArray, rtol: float) -> list[int]:
    """Return the rows (from 1) in which two matrices differ; small entries are held to the row's largest."""
    a, b = np.reshape(one, (4, -1)), np.reshape(other, (4, -1))
    return [row + 1 for row in range(4) if not alike(a[row], b[row], rtol, 1e-3 * max(np.abs(b[row]).max(), 1e-3))]


def _numbers(matrix: AnyArray, symbols: Any, K_s: float, J_l: float, *, servo: Servo) -> str | None:
    own = _matrix_at(symbols, {"K_s": K_s, "J_l": J_l, "J_eq": servo.J_eq, "B_eq": servo.B_eq})
    rows = _rows(matrix, own, BUILT)
    if not rows:
        return None
    return (
        "Your own matrix of question 2.7, with your K_s and J_l and lab.servo's J_eq and B_eq put in, differs "
        f"from these numbers in row {', '.join(map(str, rows))}. Which number, or which sign?"
    )


def _rings(A: AnyArray, B: AnyArray, omega_n: float) -> str | None:
    """Ask about a model in which the arm, with the servo held, does not swing as fast as the student has measured."""
    b = np.ravel(B)
    square = -(A[3, 1] - b[3] / b[2] * A[2, 1])
    if not square > 0:
        return (
            "When the servo of your model is held still, its arm does not swing, because nothing pulls it back. Which "
            "signs do the spring's terms have in rows 3 and 4 of A, and which signs does B have?"
        )
    if abs(math.sqrt(square) / omega_n - 1) <= _RINGS:
        return None
    return (
        f"When the servo is held still, the arm of your A swings at {hertz(math.sqrt(square))}. In your own recording, "
        f"it swings at {hertz(omega_n)}. What is wrong: the stiffness (2.12), the inertia, or a term of A?"
    )


def _open_loop(poles: AnyArray, A: AnyArray, B: AnyArray, *, servo: Servo) -> str | None:
    if same_poles(poles, np.linalg.eigvals(with_actuator(A, B, servo)[0])):
        return None
    if same_poles(poles, np.linalg.eigvals(A)):
        return "These are the poles of A as it is, with the torque as input. Which input does the question name?"
    return (
        f"The poles of your own A and B (2.14), with the motor voltage as input, are others: not {listed(poles)}. Why?"
    )
