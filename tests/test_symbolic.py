"""The derivation against Kane's method, against the laws of energy, and against the numeric model."""

from dataclasses import replace

import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from sympy import Eq, Rational, symbols

from rotflex import model, symbolic
from rotflex.config import joint, srv02

# As a student writes them: plain symbols.
J_eq, J_l, B_eq, B_l, K_s, tau, V_m = symbols("J_eq J_l B_eq B_l K_s tau V_m")
theta, alpha, theta_dot, alpha_dot, theta_ddot, alpha_ddot = symbols(
    "theta alpha theta_dot alpha_dot theta_ddot alpha_ddot"
)
eta_g, eta_m, K_g, k_t, k_m, R_m = symbols("eta_g eta_m K_g k_t k_m R_m")


def same(left: sympy.Expr, right: sympy.Expr) -> bool:
    return sympy.simplify(left - right) == 0


@pytest.fixture(scope="module")
def accelerations() -> tuple[sympy.Expr, sympy.Expr]:
    first, second = (symbolic.without_time(a) for a in symbolic.accelerations())
    return first, second


def test_power_of_the_motor_is_what_the_dampers_take_and_what_is_stored(accelerations):
    energy = symbolic.without_time(symbolic.kinetic_energy() + symbolic.potential_energy())
    stored = energy.diff(alpha) * alpha_dot
    stored += energy.diff(theta_dot) * accelerations[0] + energy.diff(alpha_dot) * accelerations[1]
    assert same(stored, tau * theta_dot - B_eq * theta_dot**2 - B_l * alpha_dot**2)


def test_equations_of_motion_have_the_general_form():
    first, second = symbolic.equations_of_motion()
    assert isinstance(first, Eq)
    assert first.rhs == tau
    assert second.rhs == 0
    servo, link = symbolic.without_time(first.lhs), symbolic.without_time(second.lhs)
    assert same(servo, (J_eq + J_l) * theta_ddot + J_l * alpha_ddot + B_eq * theta_dot)
    assert same(link, J_l * theta_ddot + J_l * alpha_ddot + B_l * alpha_dot + K_s * alpha)
    assert servo.coeff(theta_ddot) == J_eq + J_l  # collected, not just equal


def test_inertia_of_the_link_is_the_integral_over_both_rods_about_the_pivot():
    m_1, L_1, m_2, L_2, d_12, r = symbols("m_1 L_1 m_2 L_2 d_12 r")
    directly = sympy.integrate(r**2 * m_1 / L_1, (r, 0, L_1))
    directly += sympy.integrate(r**2 * m_2 / L_2, (r, d_12 - L_2 / 2, d_12 + L_2 / 2))
    assert same(symbolic.link_inertia(), directly)
    assert same(symbolic.link_inertia(), m_1 * L_1**2 / 3 + m_2 * L_2**2 / 12 + m_2 * d_12**2)


# No friction, or enough of it: numbers near 1e-310 have lost their digits.
NO_FRICTION = st.just(0.0)


@settings(max_examples=50, deadline=None)  # the first example waits for the derivation
@given(
    input=st.sampled_from(["voltage", "torque"]),
    J=st.floats(1e-4, 1e-2),
    B=NO_FRICTION | st.floats(1e-9, 0.05),
    position=st.sampled_from([1, 2, 3]),
    mass=st.floats(0.01, 0.2),
    stiffness=st.floats(0.1, 20),
    damping=st.one_of(st.none(), NO_FRICTION, st.floats(1e-9, 0.02)),
    resistance=st.floats(1, 10),
    efficiency=st.floats(0.3, 1),
)
def test_derived_matrices_in_numbers_are_those_of_the_model(
    input, J, B, position, mass, stiffness, damping, resistance, efficiency
):
    servo = replace(srv02(), J_eq=J, B_eq=B, R_m=resistance, eta_g=efficiency)
    arm = replace(joint(position), m_2=mass, B_l=0.001)
    A, B_ = symbolic.numeric_state_space(servo, arm, stiffness, input, damping)
    system = model.state_space(servo, arm, stiffness, input, damping)
    assert A.shape == (4, 4)
    assert B_.shape == (4, 1)
    assert_allclose(system.A, A, rtol=1e-12)
    assert_allclose(system.B, B_, rtol=1e-12)


def test_results_are_exact():
    found = symbolic.link_inertia().atoms(sympy.Float) | symbolic.state_space()[0].atoms(sympy.Float)
    assert not found
    assert Rational(1, 3) in symbolic.link_inertia().atoms(Rational)
