"""What the student's own expressions lead to: equations of motion, accelerations; by differences, at bounded cost."""

from __future__ import annotations

from typing import Any

import numpy as np

from labcourse.grading.marking.expression_checks import SymbolValues, value_at

STATE = ("theta", "alpha", "theta_dot", "alpha_dot", "tau")
MOTION = frozenset((*STATE, "theta_ddot", "alpha_ddot"))  #: the symbols of what moves; all others are parameters

COORDINATES = ("theta", "alpha")

_STEP = 1e-3  # a second difference of a quadratic form is exact but for rounding
_RATES = {"theta": "theta_dot", "alpha": "alpha_dot"}
_ACCELERATIONS = {"theta": "theta_ddot", "alpha": "alpha_ddot"}


def slope(expression: Any, name: str, point: SymbolValues) -> float:
    """The partial derivative of an expression at a point."""
    up, down = point[name] + _STEP, point[name] - _STEP
    return (value_at(expression, {**point, name: up}) - value_at(expression, {**point, name: down})) / (2 * _STEP)


def _mixed(expression: Any, first: str, second: str, point: SymbolValues) -> float:
    """The second derivative in two symbols at a point."""
    up, down = point[second] + _STEP, point[second] - _STEP
    return (slope(expression, first, {**point, second: up}) - slope(expression, first, {**point, second: down})) / (
        2 * _STEP
    )


def euler_lagrange(lagrangian: Any, coordinate: str, point: SymbolValues) -> float:
    """d/dt(∂L/∂q̇) − ∂L/∂q at a point, which gives angles, rates and accelerations (Equation 2.1)."""
    rate = _RATES[coordinate]
    change = sum(_mixed(lagrangian, rate, q, point) * point[_RATES[q]] for q in _RATES)
    change += sum(_mixed(lagrangian, rate, _RATES[q], point) * point[_ACCELERATIONS[q]] for q in _RATES)
    return change - slope(lagrangian, coordinate, point)


def residual(equation: Any) -> Any:
    """An equation's left side less its right side, as an expression."""
    return equation.lhs - equation.rhs


def link_acceleration(equation: Any, theta_ddot: Any, point: SymbolValues) -> float:
    """alpha_ddot from the link's equation of motion and an acceleration of the servo, with B_l = 0 (2.6)."""
    where = {**point, "B_l": 0.0, "theta_ddot": value_at(theta_ddot, point)}
    left = residual(equation)
    constant, one = (value_at(left, {**where, "alpha_ddot": value}) for value in (0.0, 1.0))
    return -constant / (one - constant)


def accelerations(first: Any, second: Any, point: SymbolValues) -> tuple[float, float]:
    """theta_ddot and alpha_ddot from two equations of motion, which are linear in them, with B_l = 0 (2.6)."""

    def left(theta_ddot: float, alpha_ddot: float) -> np.ndarray:
        where = {**point, "B_l": 0.0, "theta_ddot": theta_ddot, "alpha_ddot": alpha_ddot}
        return np.array([value_at(residual(equation), where) for equation in (first, second)])

    constant = left(0.0, 0.0)
    matrix = np.column_stack([left(1.0, 0.0) - constant, left(0.0, 1.0) - constant])
    solved = np.linalg.solve(matrix, -constant)
    return float(solved[0]), float(solved[1])
