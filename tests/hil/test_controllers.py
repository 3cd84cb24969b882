"""Controllers against scipy's digital filters and plain arithmetic."""

from __future__ import annotations

import math

import control
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import cont2discrete, lfilter

from rotflex.errors import ConfigurationError, DesignError
from rotflex.hil.controllers import (
    DERIVATIVE_CUTOFF,
    BandLimitedDerivative,
    ObserverFeedback,
    OpenLoop,
    PositionServo,
    StateFeedback,
    TwoDegreesOfFreedom,
)

SAMPLE_TIME = 0.002
GAIN = [18.24, -17.15, 1.59, 0.63]


def filtered(signal: np.ndarray, cutoff: float, sample_time: float) -> np.ndarray:
    """w_c s/(s + w_c), discretised by scipy, from rest at the signal's first value."""
    numerator, denominator, _ = cont2discrete(([cutoff, 0.0], [1.0, cutoff]), sample_time, method="euler")
    return lfilter(np.ravel(numerator), denominator, signal - signal[0])


def derivative(signal: np.ndarray, cutoff: float = DERIVATIVE_CUTOFF, sample_time: float = SAMPLE_TIME) -> np.ndarray:
    follow = BandLimitedDerivative(sample_time, cutoff)
    return np.array([follow(value) for value in signal.tolist()])


@given(st.lists(st.floats(-100, 100), min_size=2, max_size=60), st.floats(1.0, 990.0), st.sampled_from([1e-3, 2e-3]))
def test_the_derivative_is_the_euler_form_of_the_transfer_function(values, cutoff, sample_time):
    signal = np.array(values)
    expected = filtered(signal, cutoff, sample_time)
    np.testing.assert_allclose(
        derivative(signal, cutoff, sample_time), expected, atol=1e-9 * (1 + np.abs(expected).max())
    )


def test_an_unstable_filter_is_refused_and_the_cutoff_is_33_hz():
    assert pytest.approx(2 * np.pi * 33) == DERIVATIVE_CUTOFF
    for sample_time, *cutoff in ((0.01,), (0.002, 1000.0), (0.002, -1.0), (0.002, math.nan)):
        with pytest.raises(DesignError, match="stable"):
            BandLimitedDerivative(sample_time, *cutoff)
    for sample_time in (0.0, -0.002, math.nan, math.inf):
        with pytest.raises(DesignError, match="sample time"):
            BandLimitedDerivative(sample_time)


angles = st.lists(st.tuples(*[st.floats(-3, 3)] * 3), min_size=1, max_size=30)


def respond(controller, samples) -> np.ndarray:
    controller.reset()
    return np.array([controller(*sample) for sample in samples])


@given(angles, st.lists(st.floats(-50, 50), min_size=4, max_size=4))
def test_state_feedback_is_its_equation(samples, K):
    theta_ref, theta, alpha = np.array(samples).T
    rates = [filtered(angle, DERIVATIVE_CUTOFF, SAMPLE_TIME) for angle in (theta, alpha)]
    expected = K[0] * (theta_ref - theta) - K[1] * alpha - K[2] * rates[0] - K[3] * rates[1]
    np.testing.assert_allclose(respond(StateFeedback(K), samples), expected, atol=1e-8, rtol=1e-9)


@given(angles)
def test_partial_feedback_does_not_see_alpha(samples):
    without = respond(StateFeedback([GAIN[0], 0.0, GAIN[2], 0.0]), samples)
    np.testing.assert_array_equal(respond(StateFeedback(GAIN, feedback="partial"), samples), without)


def test_the_gain_may_be_a_row_and_reset_forgets_the_past():
    samples = [(0.1, 0.2, 0.3), (0.4, 0.0, -0.2)]
    controller = StateFeedback(GAIN)
    first = respond(controller, samples)
    assert StateFeedback(GAIN)(0.0, 0.0, 0.1) == pytest.approx(1.715)
    for other in (controller, *map(StateFeedback, (np.array(GAIN), [GAIN], np.array([GAIN]), tuple(GAIN)))):
        np.testing.assert_array_equal(respond(other, samples), first)
    open_loop = OpenLoop()
    assert open_loop(1.25, 3.0, -2.0) == 1.25


def test_gains_are_finite_numbers_and_feedback_full_or_partial():
    shapes = [None, 1.0, [], GAIN[:3], [*GAIN, 1.0], [[18, -17], [1.6, 0.6]], [[k] for k in GAIN]]
    for K in [*shapes, [1, 2, 3, math.nan], "gain"]:
        with pytest.raises(DesignError, match="four"):
            StateFeedback(K)
    for gains in ((math.nan, 1.0), (1.0, math.inf)):
        with pytest.raises(DesignError, match="finite"):
            PositionServo(*gains)
    with pytest.raises(ConfigurationError, match="'full', 'partial'"):
        StateFeedback(GAIN, feedback="some")


def test_the_position_servo_is_proportional_and_derivative_in_the_error():
    samples = [(0.1, 0.0, 9.0), (0.3, 0.1, 9.0), (0.3, 0.2, -9.0), (-0.1, 0.25, 0.0)]
    error = np.array([reference - theta for reference, theta, _ in samples])
    expected = 18.0 * error + 1.6 * filtered(error, DERIVATIVE_CUTOFF, SAMPLE_TIME)
    np.testing.assert_allclose(respond(PositionServo(18.0, 1.6), samples), expected, rtol=1e-12)


# --- with a model ---

#: A sampled model with a voltage as its fifth state, and gains; any stable ones will do.
PHI = np.diag([1.0, 0.9, 0.8, 0.7, 0.0]) + np.diag([0.02, 0.1, -0.1, 0.3], k=1)
GAMMA = np.array([0.0, 0.01, 0.3, -0.2, 1.0])
L_SERVO, L_BOTH = np.array([[0.4], [-0.2], [0.5], [0.3], [0.0]]), np.arange(10).reshape(5, 2) / 20
K_5 = [6.0, -4.0, 0.5, 0.2, 0.1]
CONTROLLERS = {
    "derivatives": StateFeedback(GAIN),
    "partial": StateFeedback(GAIN, feedback="partial"),
    "differences at 20 ms": StateFeedback(GAIN, sample_time=0.02, cutoff=50.0),
    "observer, servo": ObserverFeedback(PHI, GAMMA, L_SERVO, K_5, 0.02),
    "observer, both": ObserverFeedback(PHI, GAMMA, L_BOTH, K_5, 0.02),
}


@pytest.mark.parametrize("controller", CONTROLLERS.values(), ids=CONTROLLERS)
def test_the_system_of_a_controller_is_the_controller_called_sample_by_sample(controller):
    angles = np.random.default_rng(3).normal(0, 0.002, (2, 40))
    angles[:, 0] = 0  # it begins at rest
    system = controller.system()
    expected = np.ravel(control.forced_response(system, np.arange(40) * system.dt, angles).outputs)
    assert system.dt == controller.sample_time and np.abs(expected).max() < 10
    np.testing.assert_allclose(respond(controller, [(0.0, *pair) for pair in angles.T]), expected, atol=1e-10)


def test_poles_of_the_loop_are_those_of_feedback_and_of_observer():
    plant = control.StateSpace(PHI, GAMMA[:, np.newaxis], np.eye(2, 5), 0, 0.02)
    for L in (L_SERVO, L_BOTH):
        loop = control.feedback(-(ObserverFeedback(PHI, GAMMA, L, K_5, 0.02).system() * plant), 1)
        used = np.eye(L.shape[1], 5)
        separate = [PHI - np.outer(GAMMA, K_5), (np.eye(5) - L @ used) @ PHI]
        expected = np.polymul(*(np.poly(np.linalg.eigvals(part)) for part in separate))
        np.testing.assert_allclose(np.poly(loop.poles()), expected, atol=1e-8)


def test_the_observer_on_the_servos_encoder_does_not_see_alpha_and_knows_the_limit_of_the_voltage():
    controller = ObserverFeedback(PHI, GAMMA, L_SERVO, [500.0, 0, 0, 0, 0], 0.02)
    seen = respond(controller, [(1.0, 0.0, 0.1), (1.0, 0.01, -0.3), (0.0, 0.02, 0.4)])
    assert seen[:2].tolist() == [10.0, 10.0]  # V, of the 500 and more that are asked for
    predicted = np.zeros(5)
    for theta in (0.0, 0.01, 0.02):
        state = predicted + L_SERVO[:, 0] * (theta - predicted[0])
        predicted = PHI @ state + GAMMA * 10
    assert seen[2] == pytest.approx(-500 * state[0])


def test_an_observer_that_does_not_fit_its_model_is_refused_with_the_shapes():
    for wrong in ({"K": K_5[:4]}, {"L": L_SERVO[:, 0]}, {"L": np.ones((5, 3))}, {"Gamma": GAMMA[1:]}, {"Phi": None}):
        with pytest.raises(DesignError, match=r"For a model with \d states"):
            ObserverFeedback(**({"Phi": PHI, "Gamma": GAMMA, "L": L_SERVO, "K": K_5, "sample_time": 0.02} | wrong))
    for wrong, named in (("gain", "real numbers"), ([math.nan] * 5, "not finite")):
        with pytest.raises(DesignError, match=named):
            ObserverFeedback(PHI, GAMMA, L_SERVO, wrong, 0.02)


def proportional(reference, theta, alpha):
    return 20.0 * (reference - theta)


def test_a_feedforward_is_added_sample_by_sample_and_again_after_a_reset():
    controller = TwoDegreesOfFreedom(proportional, [0.1, 0.2])
    for _run in range(2):
        np.testing.assert_allclose(respond(controller, [(0.05, 0.0, 0.0)] * 4), [3.0, 5.0, 1.0, 1.0])


def test_the_integrator_takes_its_step_from_the_controller_and_stops_at_the_voltages_limit():
    controller = TwoDegreesOfFreedom(StateFeedback([20.0, 0, 0, 0], sample_time=0.01, cutoff=100.0), rate=2.0)
    np.testing.assert_allclose(respond(controller, [(0.1, 0, 0)] * 3), [2.0, 2.04, 2.08])
    wound = TwoDegreesOfFreedom(proportional, rate=2.0)
    respond(wound, [(1.0, 0, 0)] * 500)  # 20 V are asked for
    assert wound(0.1, 0, 0) == pytest.approx(2.0)  # nothing was summed up
    held = respond(wound, [(0.0, 0.4, 0), (-1.0, -0.9, 0), (0.0, 0.0, 0)])
    assert held[2] == pytest.approx(20 * 0.004 * (-0.4 - 0.1 + 0))
