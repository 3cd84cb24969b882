"""Usual mistakes on paper are called by their names, each from a formula of its own; other mistakes are not."""

import pytest
import sympy
from made_courses import OURS
from sympy import Eq, Rational

from labcourse.grading.verdicts import Case, Status

theta, alpha, theta_dot, alpha_dot, theta_ddot, alpha_ddot, tau = sympy.symbols(
    "theta alpha theta_dot alpha_dot theta_ddot alpha_ddot tau"
)
J_eq, J_l, B_eq, B_l, K_s, m_1, L_1, m_2, L_2, d_12 = sympy.symbols("J_eq J_l B_eq B_l K_s m_1 L_1 m_2 L_2 d_12")
HALF = Rational(1, 2)
V = HALF * K_s * alpha**2
T = HALF * J_eq * theta_dot**2 + HALF * J_l * (theta_dot + alpha_dot) ** 2
SERVO = (J_eq + J_l) * theta_ddot + J_l * alpha_ddot
LINK = J_l * theta_ddot + J_l * alpha_ddot + K_s * alpha
FIRST = (tau - B_eq * theta_dot + K_s * alpha) / J_eq
ROD, TOP = m_1 * L_1**2 / 3, m_2 * L_2**2 / 12

#: (question, part) → what is written, the beginning of what is said of it, and what is right.
SLIPS = [
    ("2.1", "V", 2 * V, "look at the factor in front", V),
    ("2.1", "V", HALF * K_s * theta**2, "the springs are bent by alpha", V),
    ("2.2", "T", 2 * T, "look at the factor in front", T),
    ("2.2", "T", HALF * (J_eq * theta_dot**2 + J_l * alpha_dot**2), "the link turns through theta + alpha", T),
    ("2.3", "L", T + V, "this is the total energy", T - V),
    ("2.4", "equation", Eq(SERVO - B_eq * theta_dot, tau), "look at the sign of the friction", None),
    ("2.4", "equation", Eq(SERVO, tau), "the friction is missing", None),
    ("2.4", "equation", Eq(SERVO + B_eq * theta_dot, -tau), "look at the sign of the torque", None),
    ("2.4", "equation", Eq(SERVO + B_eq * theta_dot, tau), "", Eq(SERVO + B_eq * theta_dot, tau)),
    ("2.5", "equation", Eq(LINK + B_l * theta_dot, 0), "the link's damping goes with alpha_dot", None),
    ("2.5", "equation", Eq(LINK + B_l * alpha_dot - 2 * K_s * alpha, 0), "look at the sign of the spring's", None),
    ("2.5", "equation", Eq(LINK + B_l * alpha_dot, 0), "", Eq(LINK + B_l * alpha_dot, 0)),
    ("2.6", "theta_ddot", (tau - B_eq * theta_dot - K_s * alpha) / J_eq, "look at the sign of the spring's", FIRST),
    ("2.6", "theta_ddot", (tau + B_eq * theta_dot + K_s * alpha) / J_eq, "look at the sign of the friction", FIRST),
    ("2.6", "alpha_ddot", -K_s * alpha / J_l, "this is the acceleration of theta + alpha", -FIRST - K_s * alpha / J_l),
    ("2.8", "J_l", ROD + TOP, "the top arm is not on the pivot", ROD + TOP + m_2 * d_12**2),
    ("2.8", "J_l", m_1 * L_1**2 / 12 + TOP + m_2 * d_12**2, "the bottom arm turns about its end", None),
    ("2.8", "J_l", ROD + m_2 * L_2**2 / 3 + m_2 * d_12**2, "the distance of the top arm is that of its middle", None),
]


def verdict(question, part, value):
    def own(*where):
        raise KeyError(where)

    check = OURS.key[question][part]
    return check.verdict(OURS.catalogue.find(question).part(part), value, Case(None, own, 3))


@pytest.mark.parametrize(("question", "part", "given", "said", "right"), SLIPS)
def test_a_usual_mistake_is_called_by_its_name(question, part, given, said, right):
    found = verdict(question, part, given)
    if said:
        assert found.status is Status.WRONG and said in found.reason
    if right is not None:
        assert verdict(question, part, right).status is Status.RIGHT


@pytest.mark.parametrize(("question", "part", "given", "said", "right"), [one for one in SLIPS if one[3]])
def test_another_mistake_is_not_called_by_that_name(question, part, given, said, right):
    other = Eq(given.lhs + 7 * J_l * theta_ddot, given.rhs) if isinstance(given, Eq) else 3 * given
    found = verdict(question, part, other)
    assert found.status is Status.WRONG and said not in found.reason
