"""Pole placement against the printed design (with its errata), python-control, and itself by another route."""

import control
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from rotflex import design, model
from rotflex.config import joint, srv02
from rotflex.errors import DesignError

PRINTED = model.state_space(srv02(), joint(), 1.400)  #: the stiffness behind the printed matrices
IDENTIFIED = model.state_space(srv02(), joint(), 1.300)
WANTED = [-12 + 16j, -12 - 16j, -30, -40]
ROUTES = pytest.mark.parametrize("gain_by", [design.gain_by_companion, design.gain_by_place])


def same_poles(found: np.ndarray, wanted: list[complex], atol: float) -> bool:
    """Whether two sets of distinct poles agree, each with its own nearest."""
    distance = np.abs(np.asarray(found)[:, np.newaxis] - wanted)
    return bool(np.all(distance.min(axis=0) <= atol) and np.all(distance.min(axis=1) <= atol))


def off_by(A: np.ndarray, B: np.ndarray, K: np.ndarray, wanted: list[complex]) -> float:
    """How far the closed loop's characteristic polynomial is from the wanted one, in its own size."""
    found = np.poly(np.asarray(A) - np.reshape(B, (-1, 1)) @ K)
    return float(np.max(np.abs(found - np.poly(wanted)) / np.poly(-np.abs(wanted))))


def test_matrices_of_the_transformation():
    T, T_tilde, W = design.transformation(PRINTED.A, PRINTED.B)
    assert_allclose(  # as printed, with -2160 and 2160 in the third column of the first two rows
        T,
        [[0, 62, -2160, 34284], [0, -62, 2160, -7962], [62, -2160, 34284, 249377], [-62, 2160, -7962, -1171777]],
        atol=0.5,
        rtol=0,
    )
    assert_allclose(T_tilde, [[0, 0, 0, 1], [0, 0, 1, -35], [0, 1, -35, 129], [1, -35, 129, 19012]], atol=0.5, rtol=0)
    assert_allclose(  # with 14966, not -14966, in the first place
        np.linalg.inv(T_tilde), [[14966, 1099, 35, 1], [1099, 35, 1, 0], [35, 1, 0, 0], [1, 0, 0, 0]], atol=0.5, rtol=0
    )
    assert_allclose(W, [[26322, 0, 62, 0], [0, 0, -62, 0], [0, 26322, 0, 62], [0, 0, 0, -62]], atol=0.5, rtol=0)


@ROUTES
@pytest.mark.parametrize(
    ("system", "K"),
    [(PRINTED, [[18.2356, -17.1547, 1.5893, 0.6327]]), (IDENTIFIED, [[19.638, -17.025, 1.755, 0.799]])],
    ids=["K_s = 1.4", "K_s = 1.3"],
)
def test_gain_of_the_printed_design(gain_by, system, K):
    found = gain_by(system.A, system.B, WANTED)
    assert found.shape == (1, 4)
    assert_allclose(found, K, atol=6e-5 if system is PRINTED else 6e-4, rtol=0)
    assert same_poles(np.linalg.eigvals(system.A - system.B @ found), WANTED, 1e-8)


@st.composite
def controllable_pairs(draw: st.DrawFn) -> tuple[np.ndarray, np.ndarray]:
    """A random (A, B) that is controllable, and not just so."""
    n = draw(st.integers(2, 5))
    rng = np.random.default_rng(draw(st.integers(0, 10**6)))
    A, B = rng.uniform(-3, 3, (n, n)), rng.uniform(-3, 3, (n, 1))
    T = control.ctrb(A, B)
    assume(np.linalg.cond(T / np.linalg.norm(T, axis=0)) < 1e3)
    return A, B


@st.composite
def pole_sets(draw: st.DrawFn, n: int) -> list[complex]:
    """Poles of a stable real system; they may repeat."""
    poles: list[complex] = []
    while len(poles) < n:
        real = -draw(st.floats(0.5, 10))
        if len(poles) <= n - 2 and draw(st.booleans()):
            imaginary = draw(st.floats(0.5, 10))
            poles += [complex(real, imaginary), complex(real, -imaginary)]
        else:
            poles += [real] * min(draw(st.sampled_from([1, 1, 2, 3])), n - len(poles))
    return poles


@st.composite
def placements(draw: st.DrawFn) -> tuple[np.ndarray, np.ndarray, list[complex]]:
    A, B = draw(controllable_pairs())
    return A, B, draw(pole_sets(len(A)))


@settings(max_examples=40, deadline=None)
@given(placements())
def test_both_routes_agree_with_ackermanns_formula_and_with_place(placement):
    A, B, wanted = placement
    reference = control.acker(A, B, wanted).reshape(1, -1)
    atol = 1e-6 * np.abs(reference).max()
    assert_allclose(design.gain_by_companion(A, B, wanted), reference, rtol=1e-6, atol=atol)
    assert_allclose(design.gain_by_place(A, B, wanted), reference, rtol=1e-6, atol=atol)
    distance = np.abs(np.subtract.outer(wanted, wanted))[np.triu_indices(len(A), 1)]
    if distance.min() > 0.1:
        assert_allclose(control.place(A, B, wanted), reference, rtol=1e-4, atol=100 * atol)


@pytest.mark.parametrize("wanted", [WANTED, [-20] * 4], ids=["distinct", "repeated"])
def test_place_keeps_its_digits_for_a_joint_of_steel(wanted):
    stiff = model.state_space(srv02(), joint(), 1e10)
    with pytest.raises(ValueError, match="reachable"):
        control.acker(stiff.A, stiff.B, wanted)  # in raw units
    assert off_by(stiff.A, stiff.B, design.gain_by_place(stiff.A, stiff.B, wanted), wanted) < 1e-5


@pytest.mark.parametrize(
    ("zeta", "omega_n", "p_3", "p_4", "message"),
    [
        (0, 20, -30, -40, "damping ratio"),
        (0.6, 0, -30, -40, "natural frequency"),
        (0.6, 20, 30, -40, "^p_3 "),
        (0.6, 20, -30 + 1j, -40, "real"),
        (np.nan, 20, -30, -40, "finite"),
    ],
)
def test_desired_poles_out_of_range_are_refused(zeta, omega_n, p_3, p_4, message):
    assert_allclose(design.desired_poles(zeta=0.6, omega_n=20, p_3=-30, p_4=-40), WANTED, rtol=1e-12)
    with pytest.raises(DesignError, match=message):
        design.desired_poles(zeta, omega_n, p_3, p_4)


@ROUTES
def test_pair_that_is_not_controllable_is_refused(gain_by):
    A = np.diag([-1.0, -2, -3, -4])
    with pytest.raises(DesignError, match="rank 3"):
        gain_by(A, [1, 1, 0, 1], WANTED)


@pytest.mark.parametrize("unit", [1e-9, 1e-3, 1.0, 1e6])
def test_how_exactly_poles_must_be_conjugate_does_not_depend_on_the_unit_of_time(unit):
    nearly, hardly = ([unit * (-3 + 4j), unit * (-3 - 4j * (1 + off)), -unit] for off in (1e-7, 1e-4))
    assert_array_equal(design.paired(nearly, 3), nearly)
    with pytest.raises(DesignError):
        design.paired(hardly, 3)


@ROUTES
@pytest.mark.parametrize(
    ("wanted", "message"),
    [
        ([-12 + 16j, -12 + 16j, -30, -40], r"-12\+16j"),
        ([-12 + 16j, -12 - 16j, -30], "there are 3"),
        ([[-1, -2], [-3, -4]], r"\(2, 2\)"),
        ([-1, -2, -3, np.inf], "finite"),
    ],
)
def test_poles_that_cannot_be_placed_are_refused(gain_by, wanted, message):
    with pytest.raises(DesignError, match=message):
        gain_by(PRINTED.A, PRINTED.B, wanted)


@ROUTES
def test_matrices_that_do_not_fit_are_refused(gain_by):
    """As those of :func:`model.controllability`, see test_model.py."""
    with pytest.raises(DesignError, match="must"):
        gain_by(np.eye(4), np.ones(3), WANTED)


def test_a_system_of_python_control_will_do_in_place_of_the_matrices():
    K = design.gain_by_place(PRINTED, WANTED)
    assert_array_equal(K, design.gain_by_place(PRINTED.A, PRINTED.B, WANTED))
    assert model.controllability(PRINTED).rank == 4


@ROUTES
def test_poles_may_be_a_column(gain_by):
    column = np.reshape(WANTED, (4, 1))
    assert_array_equal(gain_by(PRINTED, column), gain_by(PRINTED, WANTED))
    assert model.stability(column) == model.stability(WANTED) == "stable"
