"""Controllers against scipy's digital filters and plain arithmetic."""

from __future__ import annotations

import math

import control
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import cont2discrete, lfilter

from rotflex import experiments, hil, simulation
from rotflex.controller import runnable
from rotflex.errors import BenchError, ConfigurationError, DesignError
from rotflex.hil.controllers import (
    DERIVATIVE_CUTOFF,
    BandLimitedDerivative,
    ObserverFeedback,
    OpenLoop,
    PositionServo,
    StateFeedback,
    TwoDegreesOfFreedom,
)
from rotflex.hil.loop import run
from rotflex.hil.student_benches import student_bench

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
    column = np.array(GAIN)[:, np.newaxis] + 1e-17j  # as pole placement may leave it
    for K in (np.array(GAIN), [GAIN], np.array([GAIN]), tuple(GAIN), column, np.array(GAIN).view(np.matrix)):
        np.testing.assert_array_equal(respond(StateFeedback(K), samples), first)
    np.testing.assert_array_equal(respond(controller, samples), first)
    assert StateFeedback([18, -17, 2, 1])(1, 0, 0) == 18
    open_loop = OpenLoop()
    assert open_loop(1.25, 3.0, -2.0) == 1.25


def test_gains_are_finite_numbers_and_feedback_full_or_partial():
    shapes = [None, 1.0, [], GAIN[:3], [*GAIN, 1.0], [[18, -17], [1.6, 0.6]]]
    for K in [*shapes, [1, 2, 3, math.nan], "gain", np.array(GAIN) * (1 + 0.1j)]:
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
    for wrong, named in (("gain", "numbers"), (np.array(K_5) * 1j, "complex"), ([math.nan] * 5, "not finite")):
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


# --- systems of python-control ---

THETA_REF, THETA, ALPHA = np.random.default_rng(5).normal(0, 0.1, (3, 50))
A_2, B_3 = [[0.9, 0.1], [-0.2, 0.7]], [[1.0, 0.5, -0.3], [0.2, -1.0, 0.8]]


def state_space(inputs: int, names: list[str] | None = None, dt: float | bool | None = 0.002) -> control.StateSpace:
    B, D = np.array(B_3)[:, :inputs], [[3.0, -2.0, 0.5][:inputs]]
    return control.StateSpace(A_2, B, [[2.0, -1.0]], D, dt, inputs=names)


IN_ANY_ORDER = ["alpha", "theta_ref", "theta"]
LAG = control.tf([3.0, -2.8], [1.0, -0.6], 0.002)
ROW = control.tf([[[2.0, -1.0], [0.5]]], [[[1.0, 0.3], [1.0, -0.2, 0.1]]], 0.002, inputs=["theta_ref", "alpha"])
SYSTEMS = {
    "three by name": (state_space(3, IN_ANY_ORDER), [ALPHA, THETA_REF, THETA]),
    "three without": (state_space(3), [THETA_REF, THETA, ALPHA]),
    "two with the minus inside": (state_space(2, ["alpha", "theta"]), [ALPHA, THETA - THETA_REF]),
    "the error": (state_space(1), [THETA_REF - THETA]),
    "of any sample time": (state_space(1, ["e"], dt=True), [THETA_REF - THETA]),
    "a gain": (control.ss([], [], [], [[5.0]]), [THETA_REF - THETA]),
    "a transfer function": (LAG, [THETA_REF - THETA]),
    "a row of them": (ROW, [THETA_REF, ALPHA]),
}


@pytest.mark.parametrize("name", SYSTEMS)
def test_a_system_as_a_controller_does_what_python_control_says(name):
    system, signals = SYSTEMS[name]
    time = 0.002 * np.arange(THETA.size)
    columns = [system[0, place] for place in range(system.ninputs)]  # of a row, python-control would need Slycot
    parts = [control.forced_response(one, time, given).outputs for one, given in zip(columns, signals, strict=True)]
    controller = runnable(system, 0.002)
    for _run in range(2):  # from a state of zero, again after a reset
        found = respond(controller, zip(THETA_REF, THETA, ALPHA, strict=True))
        np.testing.assert_allclose(found, np.sum(parts, axis=0), atol=1e-12)


def test_systems_run_wherever_controllers_do_and_set_what_python_control_says():
    system, command = StateFeedback(GAIN).system(), 0.2 * np.sin(3 * np.arange(0, 1, 0.002))
    with hil.open("virtual:?preset=workbook") as bench:
        runs = [
            experiments.tracking(bench, system, duration=2.5, progress=False),
            experiments.follow(bench, system, command, progress=False),
            run(bench, TwoDegreesOfFreedom(system), command, progress=False),
            simulation.run(student_bench(3).parameters, system, command),
        ]
    for recording in runs:
        angles = [recording["theta"] - recording["theta_ref"], recording["alpha"]]
        asked = control.forced_response(system, recording.time, angles).outputs
        np.testing.assert_allclose(recording["vm"], np.clip(np.ravel(asked), -10, 10), atol=1e-9)
        assert np.ptp(recording["theta"]) > 0.1
    assert runs[0].metadata["controller"] == "StateSpace"


def create_statefbk() -> control.StateSpace:
    states = ["theta", "alpha", "theta_dot", "alpha_dot"]
    plant = control.StateSpace(np.diag([1.0, 2, 3, 4]), np.ones((4, 1)), np.eye(4), 0, outputs=states)
    return control.create_statefbk_iosystem(plant, np.array([GAIN]))[0]


MENDED = {
    "continuous": control.tf([2.0, 30.0], [1.0, 60.0]),
    "two without names": state_space(2),
    "three, one of another name": state_space(3, ["theta_ref", "theta", "beta"]),
    "two outputs": control.StateSpace(A_2, [[1.0], [0.0]], np.eye(2), 0, 0.002),
    "not causal": control.tf([1.0, 0, 0], [1.0, 0.5], 0.002),
    "20 ms": state_space(1, dt=0.02),
    "create_statefbk_iosystem": create_statefbk(),
}


@pytest.mark.parametrize("name", MENDED)
def test_a_system_that_cannot_be_run_is_refused_with_the_line_that_makes_it_right(name):
    with hil.open("virtual:?preset=workbook") as bench:
        with pytest.raises(DesignError) as refused:
            experiments.tracking(bench, MENDED[name], duration=0.1, progress=False)
        mended = {"control": control, "controller": MENDED[name].copy(), "K": GAIN}
        mended |= {"experiments": experiments, "bench": bench, "reference": np.zeros(10)}
        exec(str(refused.value).rsplit(": ", 1)[1].partition(", or StateFeedback")[0], mended)
        if name not in ("20 ms", "create_statefbk_iosystem"):  # there the line is the run
            experiments.tracking(bench, mended["controller"], duration=0.1, progress=False)


def test_imaginary_parts_reach_no_motor():
    K, turned = np.array(GAIN) * (1 + 0.1j), np.full(50, 0.1 + 0.2j)
    with_imaginary = state_space(1)
    with_imaginary.C = with_imaginary.C + 1j
    with hil.open("virtual:?preset=workbook") as bench:
        ways = [
            lambda: experiments.tracking(bench, K, progress=False),
            lambda: experiments.tracking(bench, with_imaginary, progress=False),
            lambda: experiments.tracking(bench, lambda *angles: np.complex128(1 + 1j), progress=False),
            lambda: experiments.tracking(bench, GAIN, amplitude=0.1 + 0.1j, progress=False),
            lambda: experiments.follow(bench, StateFeedback(GAIN), turned, progress=False),
            lambda: experiments.sweep(bench, drive="voltage", amplitude=0.5 + 0.5j, progress=False),
            lambda: run(bench, OpenLoop(), turned, progress=False),
            lambda: TwoDegreesOfFreedom(StateFeedback(GAIN), turned),
        ]
        for way in ways:
            with pytest.raises((DesignError, BenchError), match=r"complex|j\b"):
                way()
        bench.start(0.002)
        bench.read()
        with pytest.raises(BenchError, match="real"):
            bench.write(np.complex128(1 + 1j))
        assert bench.board.terminals.commanded[0] == 0.0
