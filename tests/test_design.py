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
WANTED_POLYNOMIAL = [1, 94, 3280, 56800, 480000]
ROUTES = pytest.mark.parametrize("gain_by", [design.gain_by_companion, design.gain_by_place])


def same_poles(found: np.ndarray, wanted: list[complex], atol: float) -> bool:
    """Whether two sets of distinct poles agree, each with its own nearest."""
    distance = np.abs(np.asarray(found)[:, np.newaxis] - wanted)
    return bool(np.all(distance.min(axis=0) <= atol) and np.all(distance.min(axis=1) <= atol))


def off_by(A: np.ndarray, B: np.ndarray, K: np.ndarray, wanted: list[complex]) -> float:
    """How far the closed loop's characteristic polynomial is from the wanted one, in its own size."""
    found = np.poly(np.asarray(A) - np.reshape(B, (-1, 1)) @ K)
    return float(np.max(np.abs(found - np.poly(wanted)) / np.poly(-np.abs(wanted))))


def test_desired_poles_and_their_polynomial():
    poles = design.desired_poles(zeta=0.6, omega_n=20, p_3=-30, p_4=-40)
    assert_allclose(poles, WANTED, rtol=1e-12)
    assert_allclose(design.characteristic_polynomial(poles), WANTED_POLYNOMIAL, rtol=1e-12)


def test_open_loop_polynomial():
    printed = [1, 35.043, 1098.81, 14966.1, 0]
    assert_allclose(design.characteristic_polynomial(PRINTED.A), printed, atol=0.05, rtol=5e-5)
    assert design.characteristic_polynomial(PRINTED.A)[-1] == 0  # the servo may stand anywhere


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


def test_gain_in_companion_form():
    K_tilde = design.companion_gain(design.characteristic_polynomial(PRINTED.A), WANTED_POLYNOMIAL)
    assert K_tilde.shape == (1, 4)
    assert_allclose(K_tilde, [[480000, 41833.9, 2181.19, 58.957]], rtol=2e-5)


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
    assert design.check_placement(system.A, system.B, found, WANTED)


def test_workbooks_example_in_companion_form():
    A, B = [[0, 1, 0], [0, 0, 1], [3, -1, -5]], [0, 0, 1]
    assert_allclose(design.characteristic_polynomial([-1, -2, -3]), [1, 6, 11, 6])
    assert_allclose(design.companion_gain([1, 5, 1, -3], [1, 6, 11, 6]), [[9, 10, 1]])
    for gain_by in (design.gain_by_companion, design.gain_by_place):
        assert_allclose(gain_by(A, B, [-1, -2, -3]), [[9, 10, 1]], rtol=1e-10)


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


@ROUTES
@settings(max_examples=40, deadline=None)
@given(placement=placements())
def test_placement_places(gain_by, placement):
    A, B, wanted = placement
    K = gain_by(A, B, wanted)
    assert off_by(A, B, K, wanted) < 1e-6
    assert design.check_placement(A, B, K, wanted, rtol=1e-6)


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


@ROUTES
@settings(max_examples=40, deadline=None)
@given(placement=placements(), seed=st.integers(0, 10**6))
def test_gain_changes_with_the_states_as_a_gain_should(gain_by, placement, seed):
    A, B, wanted = placement
    n = len(A)
    rng = np.random.default_rng(seed)
    S = np.linalg.qr(rng.standard_normal((n, n)))[0] * rng.uniform(0.5, 2, n)  # x = S z
    K = gain_by(A, B, wanted)
    K_z = gain_by(np.linalg.solve(S, A @ S), np.linalg.solve(S, B), wanted)
    assert_allclose(K_z, K @ S, rtol=1e-5, atol=1e-5 * np.abs(K @ S).max())


@settings(max_examples=40, deadline=None)
@given(controllable_pairs())
def test_w_takes_the_system_to_companion_form(pair):
    A, B = pair
    T, T_tilde, W = design.transformation(A, B)
    A_tilde, B_tilde = design.companion(design.characteristic_polynomial(A))
    assert_allclose(T, control.ctrb(A, B), rtol=1e-9)
    assert_allclose(T_tilde, control.ctrb(A_tilde, B_tilde), rtol=1e-9)
    assert_allclose(W @ T_tilde, T, rtol=1e-7, atol=1e-9 * np.abs(T).max())
    assert_allclose(A @ W, W @ A_tilde, rtol=1e-6, atol=1e-8 * np.abs(A @ W).max())
    assert_allclose(W @ B_tilde, B, rtol=1e-8, atol=1e-10)


@settings(deadline=None)
@given(st.lists(st.floats(-5, 5), min_size=1, max_size=6))
def test_companion_matrix_has_its_polynomial(coefficients):
    polynomial = [1, *coefficients]
    A_tilde, B_tilde = design.companion(polynomial)
    s = 0.7 + 1.3j
    assert np.linalg.det(s * np.eye(len(A_tilde)) - A_tilde) == pytest.approx(np.polyval(polynomial, s), rel=1e-9)
    # From its input, the first state sees the reciprocal of the polynomial.
    first = np.linalg.solve(s * np.eye(len(A_tilde)) - A_tilde, B_tilde)[0, 0]
    assert first * np.polyval(polynomial, s) == pytest.approx(1, rel=1e-9)


def test_polynomial_need_not_be_monic():
    assert_array_equal(design.companion([2, 4, 6])[0], design.companion([1, 2, 3])[0])
    assert_allclose(design.companion_gain([2, 4, 6], [1, 3, 5]), [[2, 1]])


@settings(deadline=None)
@given(st.floats(0.05, 1), st.floats(1, 100))
def test_dominant_pair_has_its_damping_ratio_and_natural_frequency(zeta, omega_n):
    p_1, p_2 = design.desired_poles(zeta, omega_n, -30, -40)[:2]
    assert_allclose(design.characteristic_polynomial([p_1, p_2]), [1, 2 * zeta * omega_n, omega_n**2], rtol=1e-12)


@ROUTES
@pytest.mark.parametrize(
    "wanted",
    [[-20] * 4, [-20, -20.001, -20.002, -30], [-12 + 16j, -12 + 16j, -12 - 16j, -12 - 16j], [-1, -1, -300, -300]],
)
def test_repeated_poles_are_placed(gain_by, wanted):
    K = gain_by(PRINTED.A, PRINTED.B, wanted)
    assert off_by(PRINTED.A, PRINTED.B, K, wanted) < 1e-9
    assert design.check_placement(PRINTED.A, PRINTED.B, K, wanted)


@pytest.mark.parametrize("wanted", [WANTED, [-20] * 4], ids=["distinct", "repeated"])
def test_place_keeps_its_digits_for_a_joint_of_steel(wanted):
    stiff = model.state_space(srv02(), joint(), 1e10)
    with pytest.raises(ValueError, match="reachable"):
        control.acker(stiff.A, stiff.B, wanted)  # in raw units
    assert off_by(stiff.A, stiff.B, design.gain_by_place(stiff.A, stiff.B, wanted), wanted) < 1e-5


def test_order_of_the_poles_and_the_shape_of_b_and_k_do_not_matter():
    A, B = PRINTED.A, PRINTED.B
    K = design.gain_by_companion(A, B, WANTED)
    assert_allclose(design.gain_by_companion(A.tolist(), B[:, 0], WANTED[::-1]), K, rtol=1e-9)
    assert_allclose(design.gain_by_place(A, B[:, 0], [-30, -12 - 16j, -40, -12 + 16j]), K, rtol=1e-9)
    assert design.check_placement(A, B[:, 0], K[0], WANTED[::-1])


@settings(deadline=None)
@given(st.sampled_from([0, 1, 2, 3]), st.sampled_from([1.05, 0.95]))
def test_check_notices_five_per_cent_in_any_gain(index, factor):
    K = design.gain_by_place(PRINTED.A, PRINTED.B, WANTED)
    K[0, index] *= factor
    assert not design.check_placement(PRINTED.A, PRINTED.B, K, WANTED, rtol=1e-3)


@pytest.mark.parametrize("seed", range(5))
def test_check_holds_for_a_pole_wanted_at_zero_in_any_states(seed):
    Q = np.linalg.qr(np.random.default_rng(seed).standard_normal((2, 2)))[0]
    A, B, wanted = Q @ [[0.0, 1], [0, -2]] @ Q.T, Q @ [0, 1], [0, -5]
    assert design.check_placement(A, B, [0, 3] @ Q.T, wanted)
    assert not design.check_placement(A, B, [0.5, 3] @ Q.T, wanted)


@pytest.mark.parametrize(
    ("zeta", "omega_n", "p_3", "p_4", "message"),
    [
        (0, 20, -30, -40, "damping ratio"),
        (1.2, 20, -30, -40, "damping ratio"),
        (0.6, 0, -30, -40, "natural frequency"),
        (0.6, 20, 30, -40, "^p_3 "),
        (0.6, 20, -30, 0, "^p_4 "),
        (0.6, 20, -30 + 1j, -40, "real"),
        (np.nan, 20, -30, -40, "finite"),
        (None, 20, -30, -40, "real"),
    ],
)
def test_desired_poles_out_of_range_are_refused(zeta, omega_n, p_3, p_4, message):
    with pytest.raises(DesignError, match=message):
        design.desired_poles(zeta, omega_n, p_3, p_4)


@ROUTES
def test_pair_that_is_not_controllable_is_refused(gain_by):
    A = np.diag([-1.0, -2, -3, -4])
    with pytest.raises(DesignError, match="rank 3"):
        gain_by(A, [1, 1, 0, 1], WANTED)


def test_transformation_of_a_pair_that_is_not_controllable_is_refused():
    with pytest.raises(DesignError, match="not controllable"):
        design.transformation(np.eye(2), [1, 1])


@pytest.mark.parametrize("unit", [1e-9, 1e-3, 1.0, 1e6])
def test_how_exactly_poles_must_be_conjugate_does_not_depend_on_the_unit_of_time(unit):
    nearly, hardly = ([unit * (-3 + 4j), unit * (-3 - 4j * (1 + off)), -unit] for off in (1e-7, 1e-4))
    assert_array_equal(design.paired(nearly, 3), nearly)
    with pytest.raises(DesignError):
        design.paired(hardly)


@ROUTES
@pytest.mark.parametrize(
    ("wanted", "message"),
    [
        ([-12 + 16j, -12 + 16j, -30, -40], r"-12\+16j"),
        ([-12 + 16j, -20, -30, -40], "conjugate pairs"),
        ([-12 + 16j, -12 - 16.1j, -30, -40], "conjugate pairs"),
        ([-12 + 16j, -12 - 16j, -30], "there are 3"),
        ([-1, -2, -3, -4, -5], "there are 5"),
        ([[-1, -2], [-3, -4]], r"\(2, 2\)"),
        ([-1, -2, -3, np.inf], "finite"),
        ([-1, -2, -3, None], "must hold numbers"),
        ("poles", "must hold numbers"),
    ],
)
def test_poles_that_cannot_be_placed_are_refused(gain_by, wanted, message):
    with pytest.raises(DesignError, match=message):
        gain_by(PRINTED.A, PRINTED.B, wanted)


@ROUTES
@pytest.mark.parametrize(
    ("A", "B"),
    [
        (np.zeros((4, 3)), np.ones(4)),
        (np.eye(4), np.ones(3)),
        (np.eye(4), np.ones((4, 2))),
        (np.eye(4) + 0j, np.ones(4)),
        ([1, 2, 3, 4], np.ones(4)),
    ],
)
def test_matrices_that_do_not_fit_are_refused(gain_by, A, B):
    with pytest.raises(DesignError, match="must"):
        gain_by(A, B, WANTED)


@pytest.mark.parametrize("polynomial", [[], [1], [0, 1, 2], [[1, 2], [3, 4]], [1, np.nan], [1, 2j], "s"])
def test_companion_form_of_what_is_no_polynomial_is_refused(polynomial):
    with pytest.raises(DesignError):
        design.companion(polynomial)


def test_polynomials_of_different_degrees_are_refused():
    with pytest.raises(DesignError, match="2 and 3"):
        design.companion_gain([1, 2, 3], [1, 2, 3, 4])


@pytest.mark.parametrize("wrong", [[1j, -1, -2], [[1, 2, 3]], [[1j]], [], None, [[1, 2], [3]]])
def test_characteristic_polynomial_of_neither_poles_nor_a_matrix_is_refused(wrong):
    with pytest.raises(DesignError):
        design.characteristic_polynomial(wrong)


@pytest.mark.parametrize(
    ("K", "rtol", "message"),
    [
        ([1, 2, 3], 1e-6, r"^K .*\(3,\)"),
        (np.ones((4, 1)), 1e-6, "^K "),
        ([np.nan, 0, 0, 0], 1e-6, "^K .*finite"),
        ([0, 0, 0, 0], 0, "tolerance"),
    ],
)
def test_check_refuses_what_is_no_gain_or_no_tolerance(K, rtol, message):
    with pytest.raises(DesignError, match=message):
        design.check_placement(PRINTED.A, PRINTED.B, K, WANTED, rtol=rtol)


def test_a_system_of_python_control_will_do_in_place_of_the_matrices():
    K = design.gain_by_place(PRINTED, WANTED)
    assert_array_equal(K, design.gain_by_place(PRINTED.A, PRINTED.B, WANTED))
    assert design.check_placement(PRINTED, K, WANTED) and model.controllability(PRINTED).rank == 4


def test_the_closed_loop_is_what_python_control_makes_of_its_feedback():
    K = design.gain_by_place(PRINTED, WANTED)
    closed = design.closed_loop(PRINTED, K)
    assert (closed.input_labels, closed.output_labels) == (["theta_ref"], ["theta", "alpha", "V_m"])
    assert same_poles(closed.poles(), WANTED, 1e-6)
    states = control.ss(PRINTED.A, PRINTED.B, np.eye(4), 0)
    for omega in (0.5, 15.0, 200.0):
        x = states(1j * omega)
        V_m = K[0, 0] / (1 + (K @ x)[0, 0])  # from theta_ref
        assert_allclose(closed(1j * omega), np.vstack([x[:2] * V_m, [[V_m]]]), rtol=1e-8)
    for wrong in (model.state_space(srv02(), joint(), 1.4, "torque"), control.ss(PRINTED.A, PRINTED.B, PRINTED.C, 0)):
        with pytest.raises(DesignError):
            design.closed_loop(wrong, K)
    with pytest.raises(DesignError):
        design.closed_loop(PRINTED, [[1, 2, 3]])
