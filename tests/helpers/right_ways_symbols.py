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
    STATE,
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
PARAMETERS = (J_eq, J_l, B_eq, B_l, K_s, m_1, L_1, m_2, L_2, d_12)
MOVING = (*STATE, theta_ddot, alpha_ddot)
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


def renamed(name: Callable[[str], str], **assumptions: bool) -> Callable[[Any], Any]:
    """With other symbols in place of the notebook's."""
    others = {one: sympy.Symbol(name(one.name), **assumptions) for one in (*PARAMETERS, *MOVING, tau)}
    return each(lambda expression: expression.xreplace(others))


def with_functions(theta_t: Any, alpha_t: Any) -> Callable[[Any], Any]:
    """With functions of time and their derivatives."""
    time = theta_t.args[0]
    meant = {theta: theta_t, theta_dot: theta_t.diff(time), theta_ddot: theta_t.diff(time, 2)}
    meant |= {alpha: alpha_t, alpha_dot: alpha_t.diff(time), alpha_ddot: alpha_t.diff(time, 2)}
    return each(lambda expression: expression.xreplace(meant))


def not_tidied_up(expression: Any) -> Any:
    some = sorted(expression.free_symbols, key=str)[:1]
    return sympy.Add(expression, *some, *(-one for one in some), evaluate=False)


WAYS.each_of(
    ALL,
    {
        "symbols that are positive": renamed(str, positive=True),
        "dynamicsymbols": with_functions(*mechanics.dynamicsymbols("theta alpha")),
        "dummies": each(lambda e: e.xreplace({one: sympy.Dummy(one.name) for one in e.free_symbols})),
        "decimals for fractions": each(lambda e: e.evalf()),
        "decimals of three digits": each(lambda e: e.evalf(3)),
        "multiplied out": each(sympy.expand),
        "factored": each(sympy.factor),
        "not tidied up": each(not_tidied_up),
        "halves as unevaluated products": each(lambda e: sympy.Mul(sympy.Rational(1, 2), 2 * e, evaluate=False)),
    },
)


xi = sympy.Symbol("xi")
RATES = sympy.Matrix([theta_dot, alpha_dot])
MASSES = sympy.Matrix([[J_eq + J_l, J_l], [J_l, J_l]])


def energy_of_points() -> Any:
    """The kinetic energy by way of positions, sines and cosines left as they come."""
    theta_t, alpha_t = sympy.Function("theta")(t), sympy.Function("alpha")(t)

    def of(inertia: Any, angle: Any) -> Any:
        return inertia * (sympy.cos(angle).diff(t) ** 2 + sympy.sin(angle).diff(t) ** 2) / 2

    return of(J_eq, theta_t) + of(J_l, theta_t + alpha_t)


WAYS.add("V, an integral", {("2.1", "V"): lambda V, own: sympy.integrate(K_s * xi, (xi, 0, alpha))})
WAYS.add("T, by positions", {("2.2", "T"): lambda T, own: energy_of_points()})
WAYS.add("T, a quadratic form, 1 x 1", {("2.2", "T"): lambda T, own: RATES.T * MASSES * RATES / 2})
WAYS.add("L, written out", {("2.3", "L"): lambda L, own: sympy.expand(own["2.2", "T"]) - own["2.1", "V"]})
WAYS.add(
    "L, not evaluated", {("2.3", "L"): lambda L, own: sympy.Add(own["2.2", "T"], -own["2.1", "V"], evaluate=False)}
)
WAYS.add("one in a list", dict.fromkeys(EXPRESSIONS, lambda value, own: [value]))


WAYS.each_of(
    EQUATIONS,
    {
        "sides exchanged": lambda e: sympy.Eq(e.rhs, e.lhs, evaluate=False),
        "all on the left": lambda e: sympy.Eq(e.lhs - e.rhs, 0),
        "signs reversed": lambda e: sympy.Eq(-e.lhs, -e.rhs, evaluate=False),
        "divided by an inertia": lambda e: sympy.Eq(sympy.expand(e.lhs / J_l), sympy.expand(e.rhs / J_l)),
        "twice": lambda e: sympy.Eq(2 * e.lhs, 2 * e.rhs),
        "as a pair": lambda e: (e.lhs, e.rhs),
        "as what is zero": lambda e: e.lhs - e.rhs,
        "solved for its own acceleration": lambda e: sympy.Eq(alpha_ddot, sympy.solve(e, alpha_ddot)[0]),
        "solved for the other acceleration": lambda e: sympy.Eq(theta_ddot, sympy.solve(e, theta_ddot)[0]),
        "inertia, friction, stiffness, input": lambda e: sympy.Eq(
            sympy.collect(sympy.expand(e.lhs), [theta_ddot, alpha_ddot, theta_dot, alpha_dot]), e.rhs
        ),
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


SOLVED = (("2.6", "theta_ddot"), ("2.6", "alpha_ddot"))
FORCES = sympy.Matrix([tau - B_eq * theta_dot, -K_s * alpha])


def solutions(own: Any) -> Any:
    return sympy.solve([own[e].subs(B_l, 0) for e in EQUATIONS], [theta_ddot, alpha_ddot])


def both(change: Callable[[Any, int], Any]) -> dict[Any, Any]:
    """A change of both accelerations, by their index."""
    return {where: lambda value, own, i=i: change(value, i) for i, where in enumerate(SOLVED)}


WAYS.add("all that solve gives", dict.fromkeys(SOLVED, lambda value, own: solutions(own)))
WAYS.add("equations for the accelerations", both(lambda e, i: sympy.Eq((theta_ddot, alpha_ddot)[i], e)))
WAYS.add(
    "equations for second derivatives",
    both(lambda e, i: sympy.Eq(sympy.Function(("theta", "alpha")[i])(t).diff(t, 2), e)),
)
WAYS.add("by the inverse of the mass matrix", both(lambda e, i: (MASSES.inv() * FORCES)[i]))
WAYS.add(
    "B_l dropped at the end",
    both(lambda e, i: (MASSES.inv() * (FORCES - sympy.Matrix([0, B_l * alpha_dot])))[i].subs(B_l, 0)),
)


WAYS.each_of(
    MATRICES,
    {
        "lists of lists": lambda m: m.tolist(),
        "numpy arrays of expressions": lambda m: np.array(m.tolist()),
        "SparseMatrix": sympy.SparseMatrix,
        "sympy.Array": lambda m: sympy.Array(m.tolist()),
        "a table with names of rows and columns": lambda m: Frame(m.tolist()),
    },
)
WAYS.add("B as a list", {("2.7", "B"): lambda B, own: list(B)})


INERTIA = ("2.8", "J_l")
r = sympy.Symbol("r")
BOTTOM = sympy.integrate(r**2 * m_1 / L_1, (r, 0, L_1))
TOP = sympy.integrate(r**2 * m_2 / L_2, (r, d_12 - L_2 / 2, d_12 + L_2 / 2))

WAYS.add("J_l, two integrals", {INERTIA: lambda J, own: BOTTOM + TOP})
WAYS.add(
    "J_l, thirds and twelfths of three digits",
    {INERTIA: lambda J, own: 0.333 * m_1 * L_1**2 + 0.0833 * m_2 * L_2**2 + m_2 * d_12**2},
)
