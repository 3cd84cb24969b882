"""Other ways of writing the derivation (2.1 to 2.8) rightly: symbols, equations, accelerations, matrices."""

from collections.abc import Callable
from typing import Any

import numpy as np
import sympy
from right_ways_types import Frame, Ways
from sympy.physics import mechanics
from working_through import (
    L_1,
    L_2,
    B_eq,
    B_l,
    J_eq,
    J_l,
    K_s,
    alpha,
    alpha_ddot,
    alpha_dot,
    d_12,
    m_1,
    m_2,
    tau,
    theta,
    theta_ddot,
    theta_dot,
)

t = sympy.Symbol("t")
EXPRESSIONS = (("2.1", "V"), ("2.2", "T"), ("2.3", "L"), ("2.6", "theta_ddot"), ("2.6", "alpha_ddot"), ("2.8", "J_l"))
EQUATIONS = (SERVO, LINK) = (("2.4", "equation"), ("2.5", "equation"))
MATRICES = (("2.7", "A"), ("2.7", "B"))
ALL = (*EXPRESSIONS, *EQUATIONS, *MATRICES)

WAYS = Ways("2.1 to 2.8")


def each(change: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """A change of an expression, for each side of an equation and each entry of a matrix."""

    def of(value: Any) -> Any:
        if isinstance(value, sympy.Eq):
            return sympy.Eq(change(value.lhs), change(value.rhs), evaluate=False)
        return value.applyfunc(change) if isinstance(value, sympy.MatrixBase) else change(value)

    return of


def with_functions(theta_t: Any, alpha_t: Any) -> Callable[[Any], Any]:
    """With functions of time and their derivatives."""
    time = theta_t.args[0]
    meant = {theta: theta_t, theta_dot: theta_t.diff(time), theta_ddot: theta_t.diff(time, 2)}
    meant |= {alpha: alpha_t, alpha_dot: alpha_t.diff(time), alpha_ddot: alpha_t.diff(time, 2)}
    return each(lambda expression: expression.xreplace(meant))


WAYS.each_of(
    ALL,
    {
        "dynamicsymbols": with_functions(*mechanics.dynamicsymbols("theta alpha")),
        "dummies": each(lambda e: e.xreplace({one: sympy.Dummy(one.name) for one in e.free_symbols})),
        "decimals for fractions": each(lambda e: e.evalf()),
        "decimals of three digits": each(lambda e: e.evalf(3)),
    },
)


def energy_of_points() -> Any:
    """The kinetic energy by way of positions, sines and cosines left as they come."""
    theta_t, alpha_t = sympy.Function("theta")(t), sympy.Function("alpha")(t)

    def of(inertia: Any, angle: Any) -> Any:
        return inertia * (sympy.cos(angle).diff(t) ** 2 + sympy.sin(angle).diff(t) ** 2) / 2

    return of(J_eq, theta_t) + of(J_l, theta_t + alpha_t)


WAYS.add("V, an integral", {("2.1", "V"): lambda V, own: sympy.integrate(K_s * t, (t, 0, alpha))})
WAYS.add("T, by positions", {("2.2", "T"): lambda T, own: energy_of_points()})


WAYS.each_of(
    EQUATIONS,
    {
        "solved for its own acceleration": lambda e: sympy.Eq(alpha_ddot, sympy.solve(e, alpha_ddot)[0]),
        "solved for the other acceleration": lambda e: sympy.Eq(theta_ddot, sympy.solve(e, theta_ddot)[0]),
    },
)


def by_newton(equation: Any, own: Any) -> Any:
    """The servo cut free: the spring and the joint's friction pull on it."""
    return sympy.Eq(J_eq * theta_ddot, tau - B_eq * theta_dot + K_s * alpha + B_l * alpha_dot)


def without_theta_ddot(equation: Any, own: Any) -> Any:
    """The link's equation, with the servo's acceleration put in from that of the servo."""
    servo = sympy.solve([own[SERVO], own[LINK]], [theta_ddot, alpha_ddot], dict=True)[0]
    return sympy.Eq(J_l * (servo[theta_ddot] + alpha_ddot) + B_l * alpha_dot + K_s * alpha, 0)


def without_alpha_ddot(equation: Any, own: Any) -> Any:
    """The servo's equation, with the link's acceleration put in from that of the link."""
    return sympy.Eq(own[SERVO].lhs.subs(alpha_ddot, sympy.solve(own[LINK], alpha_ddot)[0]), tau)


WAYS.add("the servo alone, by Newton", {SERVO: by_newton})
WAYS.add("the servo's without alpha_ddot", {SERVO: without_alpha_ddot})
WAYS.add("the link's without theta_ddot", {LINK: without_theta_ddot})
WAYS.add("by Newton, and both solved", {SERVO: by_newton, LINK: without_theta_ddot})


WAYS.add(
    "equations for second derivatives",
    {
        ("2.6", f"{angle}_ddot"): lambda e, own, angle=angle: sympy.Eq(sympy.Function(angle)(t).diff(t, 2), e)
        for angle in ("theta", "alpha")
    },
)


WAYS.each_of(
    MATRICES,
    {
        "numpy arrays of expressions": lambda m: np.array(m.tolist()),
        "SparseMatrix": sympy.SparseMatrix,
        "sympy.Array": lambda m: sympy.Array(m.tolist()),
        "a table with names of rows and columns": lambda m: Frame(m.tolist()),
    },
)


INERTIA = ("2.8", "J_l")
WAYS.add(
    "J_l, thirds and twelfths of three digits",
    {INERTIA: lambda J, own: 0.333 * m_1 * L_1**2 + 0.0833 * m_2 * L_2**2 + m_2 * d_12**2},
)
