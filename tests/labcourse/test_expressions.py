"""Expressions to trees and back; symbols, functions of time and derivatives by it, as the ones that are meant."""

import cmath
import json

import numpy as np
import pytest
import sympy
from hypothesis import assume, given, reject, settings
from hypothesis import strategies as st
from sympy.physics.mechanics import dynamicsymbols

from labcourse.answers.expressions import MAX_EXPONENT, Names, check, decode, encode, encode_equation, spelling
from labcourse.answers.json_values import FormError, NotAnswered
from labcourse.errors import AnswerError

NAMES = ("theta", "alpha", "theta_dot", "alpha_dot", "theta_ddot", "alpha_ddot", "tau", "J_eq", "J_l", "B_eq", "K_s")
theta, theta_dot, theta_ddot, alpha = sympy.symbols("theta theta_dot theta_ddot alpha")
alpha_dot, J_eq, J_l, K_s, tau, t = sympy.symbols("alpha_dot J_eq J_l K_s tau t")

leaves = st.one_of(
    st.sampled_from(NAMES).map(sympy.Symbol),
    st.integers(-1000, 1000).map(sympy.Integer),
    st.fractions(max_denominator=1000)
    .filter(lambda f: abs(f) < 1000)
    .map(lambda f: sympy.Rational(*f.as_integer_ratio())),
    st.floats(-1e6, 1e6, allow_subnormal=False).map(sympy.Float),
    st.just(sympy.pi),
)
expressions = st.recursive(
    leaves,
    lambda inner: st.one_of(
        st.tuples(inner, inner).map(lambda pair: pair[0] + pair[1]),
        st.tuples(inner, inner).map(lambda pair: pair[0] * pair[1]),
        st.tuples(inner, st.sampled_from([2, -1])).map(lambda pair: pair[0] ** pair[1]),
        st.sampled_from(NAMES).map(lambda name: sympy.sqrt(sympy.Symbol(name))),
        inner.map(sympy.sin),
        inner.map(sympy.cos),
    ),
    max_leaves=6,
)


@given(expressions)
@settings(max_examples=100, deadline=None)
def test_an_expression_comes_back_from_json_as_it_was(expression):
    assume(not expression.has(sympy.zoo, sympy.nan, sympy.oo))
    try:
        tree = encode(expression, NAMES)
    except FormError as error:
        assert "too large" in str(error)
        reject()
    back = decode(json.loads(json.dumps(tree)), NAMES)
    point = {sympy.Symbol(name): sympy.Rational(k + 3, 7) for k, name in enumerate(NAMES)}
    before, after = (complex(e.subs(point).evalf(30)) for e in (expression, back))
    assume(cmath.isfinite(before))  # 1/sin(pi theta) has poles, too
    assert after == pytest.approx(before, rel=1e-9, abs=1e-12)


def test_functions_of_time_are_taken_as_the_symbols_that_are_meant():
    theta_t, alpha_t = sympy.Function("theta")(t), sympy.Function("alpha")(t)
    energy = J_eq * theta_t.diff(t) ** 2 / 2 + J_l * (theta_t + alpha_t).diff(t) ** 2 / 2
    expected = J_eq * theta_dot**2 / 2 + J_l * (theta_dot + alpha_dot) ** 2 / 2
    assert sympy.expand(decode(encode(energy, NAMES)) - expected) == 0
    assert decode(encode(theta_t.diff(t, 2), NAMES)) == theta_ddot
    assert decode(encode(sympy.Derivative(theta_t + alpha_t, t), NAMES)) == theta_dot + alpha_dot
    assert decode(encode(dynamicsymbols("theta").diff(), NAMES)) == theta_dot


def test_wrappers_other_spellings_and_plain_numbers_are_the_expression_that_is_meant():
    expected = tau / J_eq
    for wrapped in ([expected], (expected,), {expected}, sympy.Matrix([[expected]])):
        assert decode(encode(wrapped, NAMES)) == expected
    for symbol in (sympy.Symbol("K_s", positive=True), sympy.Symbol("Ks"), sympy.Symbol("K_{s}")):
        assert decode(encode(symbol, NAMES)) == K_s
    assert decode(encode(0, NAMES)) == 0
    assert decode(encode(np.float64(0.5), NAMES)) == sympy.Float(0.5)
    for nothing in (None, ..., [None]):
        with pytest.raises(NotAnswered):
            encode(nothing, NAMES)


def test_an_equation_for_the_asked_symbol_stands_for_its_right_side():
    assert decode(encode(sympy.Eq(theta_ddot, tau / J_eq), NAMES, "theta_ddot")) == tau / J_eq
    with pytest.raises(FormError, match="equation"):
        encode(sympy.Eq(alpha, tau / J_eq), NAMES, "theta_ddot")


def test_a_solution_of_solve_stands_for_the_asked_symbol():
    solution = {theta_ddot: tau / J_eq, sympy.Symbol("alpha_ddot"): -tau / J_eq}
    assert decode(encode(solution, NAMES, "theta_ddot")) == tau / J_eq
    assert decode(encode([solution], NAMES, "alpha_ddot")) == -tau / J_eq
    by_time = {sympy.Function("theta")(t).diff(t, 2): tau / J_eq}
    assert decode(encode(by_time, NAMES, "theta_ddot")) == tau / J_eq
    for value, name in ((solution, "tau"), (solution, ""), ({"theta_ddot": tau}, "theta_ddot"), ({}, "theta_ddot")):
        with pytest.raises(FormError, match=r"solution\[symbol\]"):
            encode(value, NAMES, name)


def test_what_is_not_an_expression_in_the_given_symbols_is_told():
    many = sympy.Add(*(alpha**n * K_s**m for n in range(40) for m in range(40)))
    for fragment, values in (
        ("J_t, which is not among the given symbols: theta, alpha", [sympy.Symbol("J_t")]),
        ("text", ["K_s*alpha"]),
        ("True or False", [True]),
        ("tan, which does not belong", [sympy.tan(alpha)]),
        ("exponent is not a number: alpha", [tau**alpha]),
        ("infinite or undefined", [sympy.oo, sympy.Integer(1) / sympy.Integer(0)]),
        ("I, which does not belong", [sympy.I * alpha]),
        ("a function", [lambda: 1]),
        ("a matrix", [sympy.eye(2)]),
        ("ndarray", [np.ones(3)]),
        ("too large", [alpha**1000, many]),
        (r"Integral, .*\.doit\(\)", [sympy.Integral(alpha, alpha)]),
        (r"UnevaluatedExpr, .*\.doit\(\)", [sympy.UnevaluatedExpr(alpha) * tau]),
    ):
        for value in values:
            with pytest.raises(FormError, match=fragment):
                encode(value, NAMES)


def test_an_equation_may_be_given_in_three_ways():
    left, right = J_l * alpha, tau
    expected = left - right
    for given_form in (sympy.Eq(left, right), (left, right), [left, right], left - right, [sympy.Eq(left, right)]):
        lhs, rhs = encode_equation(given_form, NAMES).values()
        assert sympy.expand(decode(lhs) - decode(rhs) - expected) == 0


def test_a_comparison_in_place_of_an_equation_is_told():
    for value, fragment in ((alpha == tau, "Eq"), (sympy.Eq(alpha, alpha), "Eq"), ((alpha, tau, J_l), "two sides")):
        with pytest.raises(FormError, match=fragment):
            encode_equation(value, NAMES)
    for nothing in (None, (alpha, None)):
        with pytest.raises(NotAnswered):
            encode_equation(nothing, NAMES)


def deep(levels):
    tree = ["symbol", "alpha"]
    for _ in range(levels):
        tree = ["sin", tree]
    return tree


def tower(levels):
    tree = ["mul", ["int", 2], ["symbol", "alpha"]]
    for _ in range(levels):
        tree = ["pow", tree, ["int", 16]]
    return tree


UNTRUSTED = [None, "alpha", [], [["symbol", "alpha"]], ["symbol"], ["symbol", "__class__"], ["symbol", "x" * 40]]
UNTRUSTED += [["symbol", "x"], ["symbol", 3], ["int", True], ["int", 1.5], ["int", 10**21]]
UNTRUSTED += [["rational", 1, 0], ["rational", 1, -2], *(["float", value] for value in (np.nan, np.inf, 10**400))]
UNTRUSTED += [["eval", ["int", 1]], ["add"], ["pi", 3], ["sin", ["int", 1], ["int", 2]], deep(50), deep(5000), tower(3)]
UNTRUSTED += [["pow", ["int", 10], ["symbol", "alpha"]], ["pow", ["int", 10], ["int", 10**9]]]
UNTRUSTED += [["pow", ["int", 0], ["int", -1]], ["add", *([["int", 1]] * 2000)]]
UNTRUSTED += [["pow", ["add", ["int", 1], ["int", -1]], ["int", -1]]]  # undefined


@pytest.mark.parametrize("tree", UNTRUSTED)
def test_an_untrusted_tree_is_refused(tree):
    with pytest.raises(AnswerError):
        decode(tree, NAMES)


def test_an_exponential_within_an_exponential_or_a_sine_is_refused():
    # sin(exp(exp(18))) is a sine of a number with 10^8 bits.
    for kinds in (("exp", "exp"), ("sin", "exp"), ("cos", "sqrt", "exp"), ("exp", "sin", "exp")):
        tree = ["mul", ["int", 18], ["symbol", "alpha"]]
        for kind in reversed(kinds):
            tree = [kind, tree]
        with pytest.raises(AnswerError, match="exponential"):
            check(tree)


def test_exponentials_beside_each_other_are_expressions():
    tree = ["mul", ["exp", ["sin", ["symbol", "alpha"]]], ["pow", ["exp", ["symbol", "tau"]], ["int", 2]]]
    assert decode(tree, NAMES) == sympy.exp(sympy.sin(alpha)) * sympy.exp(2 * sympy.Symbol("tau"))


def test_trees_with_the_largest_numbers_that_pass_can_be_built():
    # As many digits and exponents as the bounds allow.
    largest = ["int", 10**20 - 1]
    product = ["mul", *([largest] * 300)]
    tree = ["add", ["pow", product, ["int", MAX_EXPONENT]], ["pow", product, ["rational", 63, 64]]]
    check(tree)
    assert decode(tree).is_number


SYMBOLS = (*(name for name in NAMES if name != "alpha_ddot"), "x", "x_dot", "m_1")


def test_a_symbol_of_another_spelling_is_the_given_one():
    spellings = {"J_eq": ["Jeq", "J_{eq}"], "theta": [r"\theta", "θ", "ϑ", "𝜃"], "tau": ["τ"], "m_1": ["m₁"]}
    spellings |= {"theta_dot": [r"\dot{\theta}", "θ̇", "thetadot"], "theta_ddot": [r"\ddot\theta", "θ̈"]}
    spellings |= {"x_dot": [r"\dot{x}", r"\dot x", "ẋ"]}
    for meant, written in spellings.items():
        for name in written:
            assert Names(SYMBOLS)[name] == meant
            assert decode(encode(sympy.Symbol(name), SYMBOLS)) == sympy.Symbol(meant)


def test_spellings_of_different_symbols_stay_different():
    assert len({spelling(name) for name in (*SYMBOLS, "Theta", "T", "k_s", "theta_dddot")}) == len(SYMBOLS) + 4
    with pytest.raises(FormError, match=r"Θ.*theta"):
        encode(sympy.Symbol("Θ"), SYMBOLS)


def test_a_derivative_of_a_plain_symbol_by_time_is_its_rate_and_not_zero():
    assert decode(encode(sympy.Derivative(theta, t), SYMBOLS)) == theta_dot
    assert decode(encode(sympy.Derivative(theta, (t, 2)), SYMBOLS)) == theta_ddot
    for rate in (theta_dot, *(sympy.Function(name)(t) for name in ("theta_dot", "thetadot", r"\dot{\theta}"))):
        assert decode(encode(sympy.Derivative(rate, t), SYMBOLS)) == theta_ddot
    assert decode(encode(sympy.Derivative(J_eq * theta + alpha, t), SYMBOLS)) == J_eq * theta_dot + alpha_dot
    assert decode(encode(sympy.Derivative(theta**2, sympy.Symbol("time")), SYMBOLS)) == 2 * theta * theta_dot


def test_a_derivative_by_a_given_symbol_is_a_partial_one():
    energy = J_eq * theta_dot**2 / 2 + theta
    assert decode(encode(sympy.Derivative(energy, theta_dot), SYMBOLS)) == J_eq * theta_dot
    assert decode(encode(sympy.Derivative(sympy.Derivative(energy, theta_dot), t), SYMBOLS)) == J_eq * theta_ddot


def test_a_derivative_that_has_no_symbol_is_told():
    with pytest.raises(FormError, match="Derivative"):
        encode(sympy.Function("theta")(t).diff(t, 3), SYMBOLS)
    with pytest.raises(FormError, match="alpha_ddot"):
        encode(sympy.Function("alpha")(t).diff(t, 2), SYMBOLS)
