"""Symbols, functions of time and derivatives by it, as the ones that are meant."""

from __future__ import annotations

import pytest
import sympy

from rotflex.courseware.expressions import decode, encode
from rotflex.courseware.json_values import FormError
from rotflex.courseware.symbols import Names, plain

NAMES = ("theta", "alpha", "theta_dot", "alpha_dot", "theta_ddot", "x", "x_dot", "J_eq", "K_s", "tau", "m_1")
theta, theta_dot, theta_ddot = sympy.symbols("theta theta_dot theta_ddot")
alpha, alpha_dot, J_eq, t = sympy.symbols("alpha alpha_dot J_eq t")


def test_a_symbol_of_another_spelling_is_the_given_one():
    spellings = {"J_eq": ["Jeq", "J_{eq}"], "theta": [r"\theta", "θ", "ϑ", "𝜃"], "tau": ["τ"], "m_1": ["m₁"]}
    spellings |= {"theta_dot": [r"\dot{\theta}", "θ̇", "thetadot"], "theta_ddot": [r"\ddot\theta", "θ̈"]}
    spellings |= {"x_dot": [r"\dot{x}", r"\dot x", "ẋ"]}
    for meant, written in spellings.items():
        for name in written:
            assert Names(NAMES)[name] == meant
            assert decode(encode(sympy.Symbol(name), NAMES)) == sympy.Symbol(meant)


def test_spellings_of_different_symbols_stay_different():
    assert len({plain(name) for name in (*NAMES, "Theta", "T", "k_s", "theta_dddot")}) == len(NAMES) + 4
    with pytest.raises(FormError, match=r"Θ.*theta"):
        encode(sympy.Symbol("Θ"), NAMES)


def test_a_derivative_of_a_plain_symbol_by_time_is_its_rate_and_not_zero():
    assert decode(encode(sympy.Derivative(theta, t), NAMES)) == theta_dot
    assert decode(encode(sympy.Derivative(theta, (t, 2)), NAMES)) == theta_ddot
    assert decode(encode(sympy.Derivative(theta_dot, t), NAMES)) == theta_ddot
    assert decode(encode(sympy.Derivative(J_eq * theta + alpha, t), NAMES)) == J_eq * theta_dot + alpha_dot
    assert decode(encode(sympy.Derivative(theta**2, sympy.Symbol("time")), NAMES)) == 2 * theta * theta_dot


def test_a_derivative_of_a_rate_that_is_a_function_is_the_acceleration():
    for name in ("theta_dot", "thetadot", r"\dot{\theta}"):
        assert decode(encode(sympy.Function(name)(t).diff(t), NAMES)) == theta_ddot


def test_a_derivative_by_a_given_symbol_is_a_partial_one():
    energy = J_eq * theta_dot**2 / 2 + theta
    assert decode(encode(sympy.Derivative(energy, theta_dot), NAMES)) == J_eq * theta_dot
    assert decode(encode(sympy.Derivative(sympy.Derivative(energy, theta_dot), t), NAMES)) == J_eq * theta_ddot


def test_a_derivative_that_has_no_symbol_is_told():
    with pytest.raises(FormError, match="Derivative"):
        encode(sympy.Function("theta")(t).diff(t, 3), NAMES)
    with pytest.raises(FormError, match="alpha_ddot"):
        encode(sympy.Function("alpha")(t).diff(t, 2), NAMES)
