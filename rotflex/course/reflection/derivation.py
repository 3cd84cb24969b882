"""Of the derivation (2.1 to 2.8): units that do not go together, and steps that do not follow from the one before.

Expressions are compared at a few random points.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Any

import numpy as np

from labcourse.answers.reflection import Check
from rotflex.config import Joint, Servo
from rotflex.course.reflection.numbers import CARRIED, Array, alike, unit_of

Point = Mapping[str, float]

_STATE = ("theta", "alpha", "theta_dot", "alpha_dot")
_NAMES = (*_STATE, "theta_ddot", "alpha_ddot", "tau", "J_eq", "J_l", "B_eq", "B_l", "K_s")
_ARMS = ("m_1", "L_1", "m_2", "L_2", "d_12")
_POINTS = 4
_AGREES = 2e-3  # relative: a third may be written 0.333
_STIFFNESS = 1.0  # N·m/rad: any will do, where only signs are looked at
_GROWS = 1e-3  # of the fastest pole: what is nearer to the imaginary axis does not run away

_TIME, _ENERGY, _MASS, _LENGTH = 1.7, 2.3, 3.1, 0.6  # other units of these
#: What a symbol's value becomes in the other units.
_SCALES: Mapping[str, float] = {
    "theta_dot": 1 / _TIME,
    "alpha_dot": 1 / _TIME,
    "theta_ddot": _TIME**-2,
    "alpha_ddot": _TIME**-2,
    "tau": _ENERGY,
    "J_eq": _ENERGY * _TIME**2,
    "J_l": _ENERGY * _TIME**2,
    "B_eq": _ENERGY * _TIME,
    "B_l": _ENERGY * _TIME,
    "K_s": _ENERGY,
    "m_1": _MASS,
    "m_2": _MASS,
    "L_1": _LENGTH,
    "L_2": _LENGTH,
    "d_12": _LENGTH,
}


def checks(servo: Servo, joint: Joint) -> tuple[Check, ...]:
    """What the derivation can be asked.

    Parameters
    ----------
    servo, joint : as the student is told them
    """
    energies = [("2.1", "V"), ("2.2", "T"), ("2.3", "L")]
    return (
        *(Check((where,), _units(_ENERGY, "an energy (N·m)")) for where in energies),
        Check((("2.3", "L"), ("2.2", "T"), ("2.1", "V")), _lagrangian),
        Check((("2.4", "equation"),), _units_of_equation),
        Check((("2.4", "equation"), ("2.3", "L")), _follows("theta")),
        Check((("2.5", "equation"),), _units_of_equation),
        Check((("2.5", "equation"), ("2.3", "L")), _follows("alpha")),
        Check((("2.5", "equation"),), _carried_along),
        *(
            Check((("2.6", part),), _units(_TIME**-2, "an angular acceleration (rad/s²)"))
            for part in ("theta_ddot", "alpha_ddot")
        ),
        Check((("2.6", "theta_ddot"), ("2.6", "alpha_ddot"), ("2.4", "equation"), ("2.5", "equation")), _solve),
        Check((("2.7", "A"),), lambda A: kinematics(_at_nominal(A, servo, joint))),
        Check((("2.7", "A"), ("2.7", "B"), ("2.6", "theta_ddot"), ("2.6", "alpha_ddot")), _rows),
        Check((("2.7", "A"),), lambda A: left_alone(_at_nominal(A, servo, joint))),
        Check((("2.8", "J_l"),), _units(_MASS * _LENGTH**2, "an inertia (kg·m²)")),
        Check((("2.12", "J_l"), ("2.8", "J_l")), lambda J_l, formula: _inertia(J_l, formula, joint)),
    )


# --- expressions at points --------------------------------------------------------------------------------------------


def _points(names: tuple[str, ...]) -> Iterator[dict[str, float]]:
    draw = np.random.default_rng(1)
    for _point in range(_POINTS):
        yield dict(zip(names, draw.uniform(0.5, 2.0, len(names)).tolist(), strict=True))


def value_at(expression: Any, point: Point) -> float:
    """The value of an expression at a point.

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


def matrix_at(matrix: Any, point: Point) -> Array:
    """The numbers of a matrix of expressions at a point."""
    rows, columns = matrix.shape
    return np.array([[value_at(matrix[i, j], point) for j in range(columns)] for i in range(rows)])


def _residual(equation: Any) -> Any:
    return equation.lhs - equation.rhs


def _close(one: float, other: float, size: float = 0.0) -> bool:
    return abs(one - other) <= _AGREES * max(abs(one), abs(other), size, 1e-3)


# --- units ------------------------------------------------------------------------------------------------------------


def _scaled(point: Point) -> dict[str, float]:
    return {name: value * _SCALES.get(name, 1.0) for name, value in point.items()}


def _units(factor: float, what: str) -> Callable[[Any], str]:
    """Asks where an expression is not the quantity ``what``, which in the other units is so many times as large."""

    def ask(expression: Any) -> str:
        pairs = [
            (value_at(expression, _scaled(point)), factor * value_at(expression, point))
            for point in _points(_NAMES + _ARMS)
        ]
        if all(_close(one, other) for one, other in pairs):
            return ""
        return (
            f"It should be {what}; by the units of its symbols, it is not in every term. Which term has another "
            "unit than the others?"
        )

    return ask


def _units_of_equation(equation: Any) -> str:
    left = _residual(equation)
    ratios = [value_at(left, _scaled(point)) / value_at(left, point) for point in _points(_NAMES)]
    if all(_close(one, ratios[0]) for one in ratios):
        return ""
    return (
        "The terms of your equation do not all have the same unit, by the units of its symbols. Which one has another?"
    )


# --- one step from the one before -------------------------------------------------------------------------------------


def _lagrangian(L: Any, T: Any, V: Any) -> str:
    values = [[value_at(one, point) for one in (L, T, V)] for point in _points(_NAMES)]
    if all(_close(L, T - V, max(abs(T), abs(V))) for L, T, V in values):
        return ""
    return "With your own T and V put in, this L is not the Lagrangian. How is L made of T and V?"


def _euler_lagrange(L: Any, coordinate: str, point: Point) -> float:
    """The left side of the Euler-Lagrange equation at rest: what accelerations and angles make of it."""
    import sympy

    rate = sympy.Symbol(f"{coordinate}_dot")
    momentum = sympy.diff(L, rate)
    faster = sum(sympy.diff(momentum, sympy.Symbol(f"{q}_dot")) * sympy.Symbol(f"{q}_ddot") for q in ("theta", "alpha"))
    return value_at(faster - sympy.diff(L, sympy.Symbol(coordinate)), point)


def _affine(f: Callable[[Point], float], point: Point) -> Array:
    """At rest and without a torque: what ``f`` has of each acceleration, and what is left without them."""
    still = {**point, "theta_dot": 0.0, "alpha_dot": 0.0, "tau": 0.0, "theta_ddot": 0.0, "alpha_ddot": 0.0}
    left = f(still)
    return np.array([f({**still, "theta_ddot": 1.0}) - left, f({**still, "alpha_ddot": 1.0}) - left, left])


def _follows(coordinate: str) -> Callable[[Any, Any], str]:
    """Asks where an equation is no combination of the two that the own L gives: either may be put into the other."""

    def ask(equation: Any, L: Any) -> str:
        left = _residual(equation)
        for point in _points(_NAMES):
            given = _affine(lambda p: value_at(left, p), point)
            wanted = np.transpose([_affine(partial(_euler_lagrange, L, q), point) for q in ("theta", "alpha")])
            parts = np.linalg.lstsq(wanted, given, rcond=None)[0]
            if np.linalg.norm(wanted @ parts - given) > _AGREES * np.linalg.norm(given):
                return (
                    "Friction and torque set aside, this equation does not follow from your own L (2.3). "
                    f"Differentiate your L once more with respect to {coordinate}_dot, then time, and with "
                    f"respect to {coordinate}: which term comes out otherwise?"
                )
        return ""

    return ask


def _carried_along(equation: Any) -> str:
    """Whether an arm that is carried round evenly, unbent, needs nothing but the torque that holds the servo's speed.

    (Which stands in the equation where the servo's was put into it.)
    """
    left = _residual(equation)
    for point in _points(_NAMES):
        turning = {**point, **dict.fromkeys(("alpha", "alpha_dot", "theta_ddot", "alpha_ddot"), 0.0)}
        turning["tau"] = point["B_eq"] * point["theta_dot"]
        if not _close(value_at(left, turning), 0.0, point["theta_dot"]):
            return (
                "Let the servo turn evenly, with the arm unbent and at rest on it. Nothing is bent, moves against the "
                "joint or is accelerated, and your equation still has a term. Which one, and with which rate?"
            )
    return ""


def _solve(theta_ddot: Any, alpha_ddot: Any, servo: Any, link: Any) -> str:
    for point in _points(_NAMES):
        undamped = {**point, "B_l": 0.0}
        found = {"theta_ddot": value_at(theta_ddot, undamped), "alpha_ddot": value_at(alpha_ddot, undamped)}
        for number, equation in (("2.4", servo), ("2.5", link)):
            left = _residual(equation)
            at_rest = [{**undamped, **found, name: 0.0} for name in found]
            terms = max(abs(value_at(left, one)) for one in ({**undamped, **found}, *at_rest))
            if abs(value_at(left, {**undamped, **found})) > 2 * _AGREES * terms:
                return (
                    f"Put into your own equation of question {number} (without the link's damping), your two "
                    "accelerations do not satisfy it. Is a sign or a term lost where you solved for them?"
                )
    return ""


def _rows(A: Any, B: Any, theta_ddot: Any, alpha_ddot: Any) -> str:
    wrong = set()
    for point in _points(_NAMES):
        rates = matrix_at(A, point) @ [point[name] for name in _STATE] + matrix_at(B, point).ravel() * point["tau"]
        for row, own in ((3, theta_ddot), (4, alpha_ddot)):
            if not _close(rates[row - 1], value_at(own, point)):
                wrong.add(row)
    if not wrong:
        return ""
    return (
        "A times the state, plus B times tau, is not your own acceleration of question 2.6 in these rows: "
        f"{' and '.join(map(str, sorted(wrong)))}. Which coefficient stands in another column, or has another "
        "sign?"
    )


def _inertia(J_l: float, formula: Any, joint: Joint) -> str:
    own = value_at(formula, {name: getattr(joint, name) for name in _ARMS})
    if alike(J_l, own, CARRIED / 2):
        return ""
    unit = unit_of(J_l / own) if own else ""
    if unit:
        return f"Your own formula (2.8), with lab.joint's masses and lengths, gives another size: is it {unit}?"
    return (
        f"Your own formula (2.8), with lab.joint's masses and lengths, gives {100 * own / J_l:.0f} % of this "
        "J_l. Are these the numbers of your own bench, at its anchor?"
    )


# --- models -----------------------------------------------------------------------------------------------------------


def _at_nominal(A: Any, servo: Servo, joint: Joint) -> Array:
    """A matrix of expressions with the parts' numbers and some stiffness."""
    arm = {"J_l": joint.J_l, "K_s": _STIFFNESS, "B_l": 0.0}
    return matrix_at(A, {"J_eq": servo.J_eq, "B_eq": servo.B_eq, **arm})


def kinematics(A: Array) -> str:
    """Asks where the first rows of a model's A are not those of angles and their rates."""
    if alike(np.asarray(A)[:2], [[0, 0, 1, 0], [0, 0, 0, 1]], 0.0, 1e-6):
        return ""
    return (
        "The first two rows of A say how the two angles change: as fast as the two rates that are states, too. With "
        "the states theta, alpha, theta_dot, alpha_dot, do your rows 1 and 2 say that?"
    )


def left_alone(A: Array) -> str:
    """Asks where a model without an input runs away."""
    poles = np.linalg.eigvals(np.asarray(A, dtype=float))
    if poles.real.max() <= _GROWS * max(1.0, np.abs(poles).max()):
        return ""
    return (
        "Without any torque, this A has a pole with a positive real part: an arm that is let go swings wider and "
        "wider. Does your bench do that? If not: which sign of the spring or of the friction, in which row?"
    )
