"""Expressions and equations: what is equivalent agrees, what is perturbed does not."""

from functools import partial

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st

from labcourse.grading.marking import expression_checks
from labcourse.grading.marking.expression_checks import ExpressionIs, value_at
from labcourse.grading.marks import Status
from labcourse.grading.verdicts import Case
from rotflex.course.questions import CATALOGUE
from solutions import motion
from solutions.motion import accelerations, euler_lagrange, slope

EquationIs = partial(expression_checks.EquationIs, motion=motion.MOTION)
SymbolicMatrixIs = partial(expression_checks.SymbolicMatrixIs, own_symbols=motion.STATE)

V = CATALOGUE.find("2.1").part("V")
MOTION = CATALOGUE.find("2.4").part("equation")
MATRIX = CATALOGUE.find("2.7").part("A")

theta, alpha, theta_dot, alpha_dot = STATE = sympy.symbols("theta alpha theta_dot alpha_dot")
theta_ddot, alpha_ddot, tau = sympy.symbols("theta_ddot alpha_ddot tau")
J_eq, J_l, B_eq, B_l, K_s = PARAMETERS = sympy.symbols("J_eq J_l B_eq B_l K_s")

ENERGY = J_eq * theta_dot**2 / 2 + J_l * (theta_dot + alpha_dot) ** 2 / 2 - K_s * alpha**2 / 2
SERVO = (J_eq + J_l) * theta_ddot + J_l * alpha_ddot + B_eq * theta_dot - tau
LINK = J_l * (theta_ddot + alpha_ddot) + B_l * alpha_dot + K_s * alpha

#: Forms that sympy gives to the same thing.
REWRITINGS = (
    sympy.expand,
    sympy.factor,
    sympy.together,
    sympy.simplify,
    lambda e: sympy.collect(sympy.expand(e), alpha_dot),
    lambda e: e * J_l / J_l + K_s - K_s,
    lambda e: sympy.Mul(sympy.Rational(1, 3), 3 * sympy.expand(e), evaluate=False),
)
TERMS = [J_eq * theta_dot**2, J_l * theta_dot * alpha_dot, K_s * alpha**2, B_eq * theta_dot, J_l * alpha_dot**2]
FACTORS = [J_l, J_eq, K_s, -J_l, J_eq + J_l, 1 / J_l, J_l / K_s, sympy.Integer(-2), sympy.Rational(1, 3)]

seeds = st.integers(0, 2**32)
# Not within the tolerance for decimals.
perturbations = st.fractions(-2, 2, max_denominator=50).filter(lambda x: abs(x) >= 0.02).map(sympy.Rational)


def rule(expression):
    return lambda p: float(expression.subs(dict(p)))


def case(seed=1, **own):
    """A case in which some questions' parts were answered, as ``q2_1_V=...``."""
    given = {(name[1:].split("_", 2)[0] + "." + name.split("_")[1], name.split("_", 2)[2]): own[name] for name in own}
    return Case(bench=None, own=lambda question, part: given[question, part], probe_seed=seed)


def status(check, part, value, seed=1, **own):
    return check.verdict(part, value, case(seed, **own)).status


@settings(max_examples=15)
@given(seeds, perturbations, st.sampled_from(TERMS), st.sampled_from(REWRITINGS))
def test_perturbed_expressions_never_agree(seed, by, term, rewritten):
    assert status(ExpressionIs(rule(ENERGY)), V, rewritten(ENERGY + by * term), seed) is Status.WRONG


@settings(max_examples=8)
@given(seeds, st.sampled_from((SERVO, LINK)), st.sampled_from(FACTORS), st.sampled_from(FACTORS), perturbations)
def test_an_equation_may_be_multiplied_and_turned_round_and_not_changed(seed, residual, one, other, by):
    check = EquationIs(rule(residual))
    left, right = sympy.expand(residual * one * other), 0
    assert status(check, MOTION, sympy.Eq(right, left, evaluate=False), seed) is Status.RIGHT
    moved = sympy.Eq(left - one * K_s * alpha, -one * K_s * alpha, evaluate=False)
    assert status(check, MOTION, moved, seed) is Status.RIGHT
    for term in (theta_dot * B_eq, alpha * K_s, alpha_ddot * J_l, tau):
        changed = sympy.Eq(one * other * (residual + by * term), 0, evaluate=False)
        if sympy.expand(by * term + residual) != 0:
            assert status(check, MOTION, changed, seed) is Status.WRONG


@pytest.mark.parametrize("factor", [alpha, theta_dot, 1 + alpha**2, sympy.Integer(0)])
def test_an_equation_times_a_motion_or_times_nothing_is_another_one(factor):
    equation = sympy.Eq(factor * LINK, 0, evaluate=False)
    assert status(EquationIs(rule(LINK)), MOTION, equation) is Status.WRONG


@pytest.mark.parametrize("factor", [sympy.Rational(1, 10**9), sympy.Integer(10**9)])
def test_an_equation_is_compared_as_exactly_whatever_it_was_multiplied_by(factor):
    check, changed = EquationIs(rule(LINK)), LINK + sympy.Rational(1, 1000) * K_s * alpha
    assert status(check, MOTION, sympy.Eq(factor * LINK, 0, evaluate=False)) is Status.RIGHT
    assert status(check, MOTION, sympy.Eq(factor * changed, 0, evaluate=False)) is Status.WRONG


def test_an_equation_with_another_put_into_it_is_as_good():
    alone = SERVO - LINK  # the servo cut free
    check = EquationIs(rule(SERVO), others=(rule(alone),))
    for residual in (SERVO, alone, sympy.expand(-alone / J_eq)):
        assert status(check, MOTION, sympy.Eq(0, residual)) is Status.RIGHT
    for residual in (LINK, SERVO + LINK, alone + 2 * K_s * alpha, alone - SERVO):
        assert status(check, MOTION, sympy.Eq(0, residual)) is Status.WRONG
    assert status(EquationIs(rule(SERVO)), MOTION, sympy.Eq(0, alone)) is Status.WRONG


@pytest.mark.parametrize("value", [sympy.zoo, sympy.nan, sympy.sqrt(-K_s), 1 / (alpha - alpha), sympy.exp(10**6 * K_s)])
def test_what_has_no_real_value_agrees_with_nothing(value):
    assert status(ExpressionIs(rule(ENERGY)), V, value) is Status.WRONG


def test_rounded_decimals_agree_and_roughly_rounded_ones_do_not():
    check = ExpressionIs(rule(K_s * alpha**2 / 3))
    assert status(check, V, sympy.Float("0.333") * K_s * alpha**2) is Status.RIGHT
    assert status(check, V, sympy.Float("0.3") * K_s * alpha**2) is Status.WRONG


def test_what_agrees_with_own_answers_follows_and_a_known_slip_is_named():
    check = ExpressionIs(
        rule(ENERGY), follow=lambda own, p: value_at(own("2.1", "V"), p), slips={"twice too much": rule(2 * ENERGY)}
    )
    assert status(check, V, K_s * theta, q2_1_V=theta * K_s) is Status.FOLLOW_THROUGH
    assert status(check, V, K_s * theta) is Status.WRONG
    assert "twice too much" in check.verdict(V, 2 * ENERGY, case()).reason


@pytest.mark.slow
def test_a_matrix_is_compared_by_its_entries_and_one_wrong_row_costs_its_share():
    A = sympy.Matrix([[0, 0, 1, 0], [0, 0, 0, 1], [0, K_s, -B_eq, 0], [0, -K_s / J_l, B_eq, 0]])
    check = SymbolicMatrixIs(lambda p: [[rule(sympy.sympify(entry))(p) for entry in row] for row in A.tolist()])
    assert status(check, MATRIX, A.applyfunc(sympy.together)) is Status.RIGHT
    changed = A.copy()
    changed[3, 1] = K_s / J_l
    verdict = check.verdict(MATRIX, changed, case())
    assert (verdict.status, verdict.share) == (Status.PARTLY, 0.75)
    assert status(check, MATRIX, A.T) is Status.WRONG


def test_a_matrix_that_agrees_with_own_answers_follows():
    own = sympy.diag(K_s, J_l, B_eq, tau)
    check = SymbolicMatrixIs(
        lambda point: np.eye(4),
        follow=lambda own, point: [[value_at(entry, point) for entry in row] for row in own("2.5", "A").tolist()],
        follow_what="your own equations",
    )
    verdict = check.verdict(MATRIX, own, case(q2_5_A=own))
    assert verdict.status is Status.FOLLOW_THROUGH and "agrees with your own equations" in verdict.reason
    assert status(check, MATRIX, 2 * own, q2_5_A=own) is status(check, MATRIX, own) is Status.WRONG


def test_an_equation_that_agrees_with_own_answers_follows():
    check = EquationIs(rule(LINK), follow=lambda own, p: value_at(own("2.4", "own"), p), follow_what="your own energy")
    verdict = check.verdict(MOTION, sympy.Eq(2 * SERVO, 0, evaluate=False), case(q2_4_own=SERVO))
    assert verdict.status is Status.FOLLOW_THROUGH and "agrees with your own energy" in verdict.reason
    assert status(check, MOTION, sympy.Eq(SERVO + tau, 0, evaluate=False), q2_4_own=SERVO) is Status.WRONG


POINT = dict(
    zip(
        [str(s) for s in (*STATE, theta_ddot, alpha_ddot, tau, *PARAMETERS)],
        [0.7, 1.3, 0.9, 1.7, 0.6, 1.1, 1.9, 0.8, 1.2, 0.5, 1.4, 1.6],
        strict=True,
    )
)


@pytest.mark.parametrize("symbol", STATE)
def test_a_slope_is_the_partial_derivative(symbol):
    assert slope(ENERGY, str(symbol), POINT) == pytest.approx(rule(ENERGY.diff(symbol))(POINT), rel=1e-8, abs=1e-9)


@pytest.mark.parametrize(
    ("coordinate", "equation"), [("theta", SERVO - B_eq * theta_dot + tau), ("alpha", LINK - B_l * alpha_dot)]
)
def test_the_lagrangian_leads_to_the_equations_of_motion(coordinate, equation):
    assert euler_lagrange(ENERGY, coordinate, POINT) == pytest.approx(rule(equation)(POINT), rel=1e-6)


def test_accelerations_are_those_that_sympy_solves_for_without_damping_of_the_link():
    equations = [sympy.Eq(SERVO / J_l, 0), sympy.Eq(0, LINK)]
    solved = sympy.solve([SERVO, LINK.subs(B_l, 0)], [theta_ddot, alpha_ddot], dict=True)[0]
    expected = [rule(solved[symbol])(POINT) for symbol in (theta_ddot, alpha_ddot)]
    assert accelerations(*equations, POINT) == pytest.approx(expected, rel=1e-9)
