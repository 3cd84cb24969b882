"""The closed loop against python-control, an adaptive integrator at tight tolerance, and the checked figures."""

import warnings

import control
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from rotflex import response, signals
from rotflex.config import srv02
from rotflex.errors import ConfigurationError, DesignError, RecordingError
from rotflex.simulation import closed_loop, with_actuator
from rotflex.units import DEG

# The plant of the printed design: K_s = 1.400 N·m/rad, in SI units.
J_EQ, J_L, K_S = 2.0841792e-3, 3.27834e-3, 1.400
TORQUE_PER_VOLT, DAMPING = 0.1284533, 0.0730352
A = np.array(
    [
        [0, 0, 1, 0],
        [0, 0, 0, 1],
        [0, K_S / J_EQ, -DAMPING / J_EQ, 0],
        [0, -K_S * (J_EQ + J_L) / (J_EQ * J_L), DAMPING / J_EQ, 0],
    ]
)
B = np.array([0, 0, TORQUE_PER_VOLT / J_EQ, -TORQUE_PER_VOLT / J_EQ])
K = np.asarray(control.place(A, B.reshape(4, 1), [-12 + 16j, -12 - 16j, -30, -40])).ravel()
PARTIAL = np.array([1.0, 0, 1, 0])


def tracking(rate=None, sample_time=0.002, duration=6.2, **choices):
    """The ±20 deg wave at 0.33 Hz, followed by the loop."""
    t = signals.time_axis(duration, sample_time)
    if rate is None:
        reference = signals.square_wave(t, 0.33, 20 * DEG)
    else:
        reference = signals.smooth_square_wave(t, 0.33, 20 * DEG, rate)
    return closed_loop(A, B, K, reference, sample_time, **choices)


def test_the_gain_used_here_is_the_one_of_the_checked_figures():
    np.testing.assert_allclose(K, [18.2356, -17.1547, 1.5893, 0.6327], atol=2e-3)


# --- the motor -------------------------------------------------------------------------------------------------------


def torque_model(B_eq):
    """The printed model before its motor is added: A and B for the torque as input."""
    A_torque = A.copy()
    A_torque[2:, 2] = [-B_eq / J_EQ, B_eq / J_EQ]
    return A_torque, np.array([0, 0, 1 / J_EQ, -1 / J_EQ])


@pytest.mark.parametrize("shape", [(4,), (4, 1)])
def test_the_motor_turns_the_torque_model_into_the_printed_voltage_model(shape):
    A_torque, B_torque = torque_model(B_eq=0.004)
    given = A_torque.copy(), B_torque.copy()
    with_motor, B_with_motor = with_actuator(A_torque, B_torque.reshape(shape), srv02())
    np.testing.assert_allclose(with_motor, A, rtol=1e-5)
    np.testing.assert_allclose(B_with_motor, B.reshape(4, 1), rtol=1e-5)
    np.testing.assert_array_equal(A_torque, given[0])
    np.testing.assert_array_equal(B_torque, given[1])


@given(volts=st.floats(-10, 10), x=st.lists(st.floats(-20, 20), min_size=4, max_size=4))
def test_the_voltage_acts_through_the_torque_of_equation_2_8(volts, x):
    servo = srv02()
    A_torque, B_torque = torque_model(B_eq=0.004)
    current = (volts - servo.K_g * servo.k_m * x[2]) / servo.R_m
    tau = servo.eta_g * servo.K_g * servo.eta_m * servo.k_t * current
    with_motor, B_with_motor = with_actuator(A_torque, B_torque, servo)
    np.testing.assert_allclose(
        with_motor @ x + B_with_motor[:, 0] * volts, A_torque @ x + B_torque * tau, rtol=1e-9, atol=1e-6
    )


# --- the table of checked figures ------------------------------------------------------------------------------------


# The command is sampled every 0.5 ms here, so that its ramp is nearly the continuous one. The checked figures agree
# with Euler steps of 0.1 ms, which overshoot 0.02 % and deflect 0.03 deg more than the exact solution: hence these two
# tolerances. That the solution is exact is tested below, against other solvers.
@pytest.mark.parametrize(
    ("rate", "settling_time", "overshoot", "alpha_deg", "voltage"),
    [
        (None, 0.390, 3.43, 10.5, 12.7),
        (100, 0.399, 3.40, 10.35, 7.6),
        (50, 0.409, 3.34, 9.86, 5.1),
        (25, 0.429, 3.08, 8.1, 3.5),
    ],
)
def test_exact_simulation_gives_the_checked_figures(rate, settling_time, overshoot, alpha_deg, voltage):
    summary = response.worst(response.measure(tracking(rate, sample_time=0.0005, saturation=None)))
    assert summary.settling_time == pytest.approx(settling_time, abs=0.001)
    assert summary.overshoot == pytest.approx(overshoot, abs=0.03)
    assert summary.max_alpha / DEG == pytest.approx(alpha_deg, abs=0.03)
    assert summary.max_vm == pytest.approx(voltage, abs=0.05)


def test_the_real_time_models_arithmetic_gives_the_workbooks_figures():
    summary = response.worst(response.measure(tracking(100, fidelity="workbook")))
    assert summary.settling_time == pytest.approx(0.378, abs=0.0005)
    assert summary.overshoot == pytest.approx(3.38, abs=0.005)
    assert summary.max_alpha / DEG == pytest.approx(10.90, abs=0.005)
    assert summary.max_vm == pytest.approx(8.6, abs=0.05)


def test_an_accurate_solver_does_not_give_the_printed_deflection():
    summary = response.worst(response.measure(tracking(100)))
    assert summary.max_alpha / DEG == pytest.approx(10.3, abs=0.05)


def test_partial_feedback_gives_the_checked_figures():
    summary = response.worst(response.measure(tracking(100, feedback="partial")))
    assert summary.settling_time == pytest.approx(0.646, abs=0.001)
    assert summary.overshoot == pytest.approx(2.49, abs=0.03)
    assert summary.max_alpha / DEG == pytest.approx(11.7, abs=0.05)


def test_an_unlimited_step_is_saturated_when_the_drive_ends_at_ten_volts():
    free, limited = tracking(saturation=None), tracking()
    assert np.abs(free["vm"]).max() == pytest.approx(K[0] * 40 * DEG, rel=1e-4)
    assert np.abs(limited["vm"]).max() == 10


# --- exactness -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("feedback", ["full", "partial"])
def test_unsaturated_response_equals_python_controls_zero_order_hold(feedback):
    t = signals.time_axis(4, 0.002)
    reference = signals.smooth_square_wave(t, 0.33, 20 * DEG, 100)
    gain = K if feedback == "full" else K * PARTIAL
    loop = control.ss(A - np.outer(B, gain), (B * gain[0]).reshape(4, 1), np.eye(4), np.zeros((4, 1)))
    expected = control.forced_response(control.sample_system(loop, 0.002, "zoh"), t, reference)
    for saturation in (None, 10.0):
        simulated = closed_loop(A, B, K, reference, feedback=feedback, saturation=saturation)
        np.testing.assert_allclose(simulated["theta"], expected.outputs[0], atol=1e-9)
        np.testing.assert_allclose(simulated["alpha"], expected.outputs[1], atol=1e-9)
        np.testing.assert_allclose(simulated["vm"], gain[0] * reference - gain @ expected.outputs, atol=1e-7)


@pytest.mark.parametrize(
    ("amplitude_deg", "gain", "saturation"),
    [(70, K, 10.0), (34, K, 10.0), (34, K * PARTIAL, 3.0), (57, K * [3, 1, 1, 1], 5.0), (29, K * PARTIAL * 5, 10.0)],
)
def test_saturated_response_equals_an_adaptive_integrator(amplitude_deg, gain, saturation):
    t = signals.time_axis(0.8, 0.002)
    theta_d = amplitude_deg * DEG

    def plant(_, x):
        return A @ x + B * np.clip(gain[0] * theta_d - gain @ x, -saturation, saturation)

    expected = solve_ivp(plant, (0, 0.8), np.zeros(4), "DOP853", t, rtol=1e-11, atol=1e-13, max_step=5e-4).y
    simulated = closed_loop(A, B, gain, np.full(t.size, theta_d), saturation=saturation)
    assert np.any(np.abs(simulated["vm"]) == saturation)
    np.testing.assert_allclose(simulated["theta"], expected[0], atol=1e-9)
    np.testing.assert_allclose(simulated["alpha"], expected[1], atol=1e-9)


def test_a_voltage_that_passes_its_limit_between_two_samples_is_clipped_there():
    # From this state the controller asks for 0 V, after 0.05 s for -5.0 V, and after 0.1 s, a sample, for -3.5 V.
    x0, t = np.array([0, 1, 10.8, 0]), np.arange(6) * 0.1

    def plant(_, x):
        return A @ x + B * np.clip(-K @ x, -4.5, 4.5)

    expected = solve_ivp(plant, (0, 0.5), x0, "DOP853", t, rtol=1e-11, atol=1e-13, max_step=5e-4).y
    unlimited = closed_loop(A, B, K, np.zeros(6), 0.1, saturation=None, x0=x0)
    simulated = closed_loop(A, B, K, np.zeros(6), 0.1, saturation=4.5, x0=x0)
    assert np.abs(unlimited["vm"]).max() < 4.5
    assert np.abs(unlimited["theta"] - expected[0]).max() > 1e-3
    np.testing.assert_allclose(simulated["theta"], expected[0], atol=1e-9)
    np.testing.assert_allclose(simulated["alpha"], expected[1], atol=1e-9)


def test_it_starts_from_the_given_state_and_lets_it_decay_as_the_closed_loop_does():
    t = signals.time_axis(1, 0.002)
    x0 = np.array([0.1, -0.05, 0.3, 1.0])
    loop = control.ss(A - np.outer(B, K), np.zeros((4, 1)), np.eye(4), np.zeros((4, 1)))
    expected = control.initial_response(loop, t, x0).states
    simulated = closed_loop(A, B, K, np.zeros(t.size), saturation=None, x0=x0)
    np.testing.assert_allclose(simulated["theta"], expected[0], atol=1e-9)
    np.testing.assert_allclose(simulated["alpha"], expected[1], atol=1e-9)


def test_the_result_at_a_sample_does_not_depend_on_the_sample_time():
    coarse = closed_loop(A, B, K, np.full(101, 60 * DEG), 0.01)
    fine = closed_loop(A, B, K, np.full(1001, 60 * DEG), 0.001)
    np.testing.assert_allclose(coarse["theta"], fine["theta"][::10], atol=1e-10)


# --- the workbook's arithmetic ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("feedback", "theta", "alpha"), [("full", 0.0, 0.0), ("partial", 0.0, 0.0), ("full", 0.5, -0.2)]
)
def test_workbook_fidelity_is_forward_euler_of_plant_and_derivative_filters_from_rest(feedback, theta, alpha):
    reference = signals.smooth_square_wave(signals.time_axis(2, 0.002), 0.33, 60 * DEG, 100)
    x0 = (theta, alpha, 0.0, 0.0)
    simulated = closed_loop(A, B, K, reference, fidelity="workbook", feedback=feedback, x0=x0)
    h, w_c = 0.002, 2 * np.pi * 33
    slow_theta, slow_alpha, theta_dot, alpha_dot = x0
    for k, theta_d in enumerate(reference):
        assert simulated["theta"][k] == pytest.approx(theta, abs=1e-10)
        assert simulated["alpha"][k] == pytest.approx(alpha, abs=1e-10)
        theta_rate, alpha_rate = w_c * (theta - slow_theta), w_c * (alpha - slow_alpha)
        u = K[0] * (theta_d - theta) - K[2] * theta_rate
        if feedback == "full":
            u -= K[1] * alpha + K[3] * alpha_rate
        u = min(max(u, -10), 10)
        assert simulated["vm"][k] == pytest.approx(u, abs=1e-7)
        motor = (TORQUE_PER_VOLT * u - DAMPING * theta_dot) / J_EQ
        theta_ddot = motor + K_S / J_EQ * alpha
        alpha_ddot = -motor - K_S * (1 / J_EQ + 1 / J_L) * alpha
        theta, alpha = theta + h * theta_dot, alpha + h * alpha_dot
        theta_dot, alpha_dot = theta_dot + h * theta_ddot, alpha_dot + h * alpha_ddot
        slow_theta, slow_alpha = slow_theta + h * theta_rate, slow_alpha + h * alpha_rate
    assert np.abs(simulated["vm"]).max() == 10


def test_workbook_fidelity_approaches_a_continuous_loop_with_filters_as_its_steps_shrink():
    w_c = 2 * np.pi * 33
    plant = control.ss(A, B.reshape(4, 1), np.eye(2, 4), np.zeros((2, 1)))
    derivative = control.ss(-w_c, w_c, -w_c, w_c)  # w_c s/(s + w_c)
    controller = control.append(K[0] + K[2] * derivative, K[1] + K[3] * derivative)
    inner = control.feedback(plant, control.ss([], [], [], [[1.0, 1.0]]) * controller)
    t = np.arange(0, 0.5, 2e-5)
    expected = control.forced_response(inner * K[0], t, np.full(t.size, 0.3)).outputs
    simulated = closed_loop(A, B, K, np.full(t.size, 0.3), 2e-5, fidelity="workbook", saturation=None)
    np.testing.assert_allclose(simulated["theta"], expected[0], atol=2e-4)
    np.testing.assert_allclose(simulated["alpha"], expected[1], atol=2e-4)


# --- properties ------------------------------------------------------------------------------------------------------


@settings(max_examples=20, deadline=None)
@given(
    scale=st.floats(0.05, 3) | st.floats(-3, -0.05),
    fidelity=st.sampled_from(["exact", "workbook"]),
    feedback=st.sampled_from(["full", "partial"]),
)
def test_without_saturation_the_loop_is_linear(scale, fidelity, feedback):
    reference = signals.smooth_square_wave(signals.time_axis(1, 0.002), 1.0, 20 * DEG, 100)
    choices = {"fidelity": fidelity, "feedback": feedback, "saturation": None}
    one, other = closed_loop(A, B, K, reference, **choices), closed_loop(A, B, K, scale * reference, **choices)
    for channel in ("theta", "alpha", "vm"):
        np.testing.assert_allclose(other[channel], scale * one[channel], atol=1e-9)


@settings(max_examples=20, deadline=None)
@given(amplitude=st.floats(0.1, 3.0), fidelity=st.sampled_from(["exact", "workbook"]))
def test_with_saturation_the_loop_is_odd_and_stays_within_its_voltage(amplitude, fidelity):
    reference = signals.square_wave(signals.time_axis(1, 0.002), 1.0, amplitude)
    up = closed_loop(A, B, K, reference, fidelity=fidelity, saturation=6.0)
    down = closed_loop(A, B, K, -reference, fidelity=fidelity, saturation=6.0)
    assert np.abs(up["vm"]).max() <= 6.0
    for channel in ("theta", "alpha", "vm"):
        np.testing.assert_allclose(down[channel], -up[channel], atol=1e-9)


# --- shapes, records and refusals ------------------------------------------------------------------------------------


def test_it_returns_a_recording_that_says_how_it_was_made():
    recording = tracking(100, duration=1, fidelity="workbook", feedback="partial")
    assert set(recording.channels) == {"theta_ref", "theta", "alpha", "vm"}
    assert recording.channels["theta"].unit == "rad"
    assert recording.channels["vm"].unit == "V"
    assert recording.sample_time == pytest.approx(0.002)
    made = recording.metadata
    assert (made["source"], made["fidelity"], made["feedback"], made["saturation"]) == (
        "simulation",
        "workbook",
        "partial",
        10.0,
    )


def test_it_takes_the_shapes_that_matrices_come_in():
    reference = np.full(50, 0.2)
    plain = closed_loop(A, B, K, reference)
    shaped = closed_loop(A.tolist(), B.reshape(4, 1), K.reshape(1, 4) + 0j, reference.tolist(), x0=np.zeros((4, 1)))
    np.testing.assert_array_equal(plain["theta"], shaped["theta"])


def test_a_wrong_matrix_is_named_with_its_shape(snapshot):
    wrong = [{"A": np.eye(3)}, {"A": A * np.nan}, {"B": B.reshape(1, 4)}, {"B": None}, {"K": K.reshape(4, 1)}]
    wrong += [{"K": "K"}, {"K": K * (1 + 0.1j)}, {"K": [1, 2, np.inf, 4]}, {"x0": [0, 0]}]
    right = {"A": A, "B": B, "K": K, "reference": np.zeros(9)}
    calls = [lambda changed=changed: closed_loop(**right | changed) for changed in wrong]
    calls += [lambda: with_actuator(np.eye(2), B, srv02()), lambda: with_actuator(A, [1, 2], srv02())]
    messages = []
    for call in calls:
        with pytest.raises(DesignError) as error:
            call()
        messages.append(str(error.value))
    assert messages == snapshot


@pytest.mark.parametrize("reference", [[0.1], [0.1, np.nan], np.zeros((10, 2)), "square", [[0.1], [0.1, 0.2]]])
def test_a_wrong_reference_is_refused(reference):
    with pytest.raises(RecordingError, match="reference must be"):
        closed_loop(A, B, K, reference)


@pytest.mark.parametrize(
    "choice",
    [
        {"feedback": "none"},
        {"fidelity": "ode45"},
        {"saturation": 0},
        {"saturation": -10},
        {"sample_time": 0},
        {"sample_time": np.nan},
    ],
)
def test_a_choice_that_does_not_exist_is_refused(choice):
    with pytest.raises(ConfigurationError, match=next(iter(choice))):
        closed_loop(A, B, K, np.zeros(10), **choice)


@pytest.mark.parametrize("fidelity", ["exact", "workbook"])
@pytest.mark.parametrize("saturation", [None, 10.0])
@pytest.mark.parametrize("gain", [-K, -1e6 * K])
def test_an_unstable_loop_is_reported_with_its_pole(fidelity, saturation, gain):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(DesignError, match=r"ran away.*unstable pole"):
            closed_loop(A, B, gain, np.full(10000, 0.3), fidelity=fidelity, saturation=saturation)


def test_a_loop_that_only_euler_steps_upset_says_so():
    closed_loop(A, B, K, np.full(500, 0.3), 0.012, saturation=None)
    with pytest.raises(DesignError, match="Euler"):
        closed_loop(A, B, K, np.full(500, 0.3), 0.012, fidelity="workbook", saturation=None)
