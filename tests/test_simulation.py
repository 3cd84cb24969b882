"""The closed loop against python-control, an adaptive integrator at tight tolerance, and the checked figures."""

import warnings

import control
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from rotflex import experiments, hil, response, signals
from rotflex.config import srv02
from rotflex.errors import ConfigurationError, DesignError, RecordingError
from rotflex.hil.controllers import StateFeedback
from rotflex.hil.student_benches import preset
from rotflex.plant import PlantParameters
from rotflex.simulation import closed_loop, run, with_actuator
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


@pytest.mark.parametrize("shape", [(4,), (4, 1)])
def test_the_motor_turns_the_torque_model_into_the_printed_voltage_model(shape):
    A_torque, B_torque = A.copy(), np.array([0, 0, 1 / J_EQ, -1 / J_EQ])
    A_torque[2:, 2] = [-0.004 / J_EQ, 0.004 / J_EQ]  # B_eq of the printed model
    given = A_torque.copy(), B_torque.copy()
    with_motor, B_with_motor = with_actuator(A_torque, B_torque.reshape(shape), srv02())
    np.testing.assert_allclose(with_motor, A, rtol=1e-5)
    np.testing.assert_allclose(B_with_motor, B.reshape(4, 1), rtol=1e-5)
    np.testing.assert_array_equal(A_torque, given[0])
    np.testing.assert_array_equal(B_torque, given[1])


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


def adaptive(t, gain, saturation, theta_d=0.0, x0=(0, 0, 0, 0)):
    """theta and alpha by a general-purpose integrator."""

    def plant(_, x):
        return A @ x + B * np.clip(gain[0] * theta_d - gain @ x, -saturation, saturation)

    return solve_ivp(plant, (0, t[-1]), x0, "DOP853", t, rtol=1e-11, atol=1e-13, max_step=5e-4).y[:2]


@pytest.mark.parametrize(
    ("amplitude_deg", "gain", "saturation"),
    [(70, K, 10.0), (34, K * PARTIAL, 3.0), (57, K * [3, 1, 1, 1], 5.0)],
)
def test_saturated_response_equals_an_adaptive_integrator(amplitude_deg, gain, saturation):
    t, theta_d = signals.time_axis(0.8, 0.002), amplitude_deg * DEG
    expected = adaptive(t, gain, saturation, theta_d)
    simulated = closed_loop(A, B, gain, np.full(t.size, theta_d), saturation=saturation)
    assert np.any(np.abs(simulated["vm"]) == saturation)
    np.testing.assert_allclose([simulated["theta"], simulated["alpha"]], expected, atol=1e-9)


def test_a_voltage_that_passes_its_limit_between_two_samples_is_clipped_there():
    # From this state the controller asks for 0 V, after 0.05 s for -5.0 V, and after 0.1 s, a sample, for -3.5 V.
    x0 = np.array([0, 1, 10.8, 0])
    expected = adaptive(np.arange(6) * 0.1, K, 4.5, x0=x0)
    unlimited = closed_loop(A, B, K, np.zeros(6), 0.1, saturation=None, x0=x0)
    simulated = closed_loop(A, B, K, np.zeros(6), 0.1, saturation=4.5, x0=x0)
    assert np.abs(unlimited["vm"]).max() < 4.5
    assert np.abs(unlimited["theta"] - expected[0]).max() > 1e-3
    np.testing.assert_allclose([simulated["theta"], simulated["alpha"]], expected, atol=1e-9)


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


def test_it_takes_the_shapes_that_matrices_come_in_and_says_how_it_was_made():
    reference = np.full(50, 0.2)
    choices = {"fidelity": "workbook", "feedback": "partial", "sample_time": 0.004}
    plain = closed_loop(A, B, K, reference, **choices)
    shaped = closed_loop(
        A.tolist(), B.reshape(4, 1), K.reshape(1, 4) + 0j, reference.tolist(), x0=np.zeros((4, 1)), **choices
    )
    np.testing.assert_array_equal(plain["theta"], shaped["theta"])
    assert set(plain.channels) == {"theta_ref", "theta", "alpha", "vm"}
    assert (plain.channels["theta"].unit, plain.channels["vm"].unit) == ("rad", "V")
    assert plain.sample_time == pytest.approx(0.004)
    made = {"source": "simulation", "fidelity": "workbook", "feedback": "partial", "saturation": 10.0}
    assert made.items() <= plain.metadata.items()


FOUR = r"^{}\b.*\(4,.*{}.*'alpha_dot'"


@pytest.mark.parametrize(
    ("wrong", "named"),
    [
        ({"A": np.eye(3)}, r"^A\b.*\(4, 4\).*\(3, 3\)"),
        ({"A": A * np.nan}, "^A.*not finite"),
        ({"B": B.reshape(1, 4)}, FOUR.format("B", r"\(1, 4\)")),
        ({"K": K.reshape(2, 2)}, r"^K\b.*\(4, 1\).*\(2, 2\)"),
        ({"K": "K"}, "^K must.*'K'"),
        ({"K": K * (1 + 0.1j)}, "^K.*complex.*conjugate"),
        ({"x0": [0, 0]}, FOUR.format("x0", r"\(2,\)")),
    ],
)
def test_a_wrong_matrix_is_named_with_its_shape(wrong, named):
    right = {"A": A, "B": B, "K": K, "reference": np.zeros(9)}
    with pytest.raises(DesignError, match=f"(?s){named}"):
        closed_loop(**right | wrong)


@pytest.mark.parametrize("reference", [[0.1], [0.1, np.nan], np.zeros((10, 2)), "square"])
def test_a_wrong_reference_is_refused(reference):
    with pytest.raises(RecordingError, match="The reference"):
        closed_loop(A, B, K, reference)


CHOICES = [("feedback", "none"), ("fidelity", "ode45"), ("saturation", 0), ("saturation", -10)]


@pytest.mark.parametrize(("choice", "value"), [*CHOICES, ("sample_time", 0), ("sample_time", np.nan)])
def test_a_choice_that_does_not_exist_is_refused(choice, value):
    with pytest.raises(ConfigurationError, match=choice):
        closed_loop(A, B, K, np.zeros(10), **{choice: value})


@pytest.mark.parametrize(
    ("fidelity", "saturation", "gain"), [("exact", None, -1e6 * K), ("exact", 10.0, -K), ("workbook", 10.0, -1e6 * K)]
)
def test_an_unstable_loop_is_reported_with_its_pole(fidelity, saturation, gain):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(DesignError, match=r"ran away.*unstable pole"):
            closed_loop(A, B, gain, np.full(10000, 0.3), fidelity=fidelity, saturation=saturation)


def test_a_loop_that_only_euler_steps_upset_says_so():
    closed_loop(A, B, K, np.full(500, 0.3), 0.012, saturation=None)
    with pytest.raises(DesignError, match="Euler"):
        closed_loop(A, B, K, np.full(500, 0.3), 0.012, fidelity="workbook", saturation=None)


def test_the_nonlinear_plant_without_friction_and_limits_moves_as_python_control_says():
    back_emf = 0.5360352
    plant = PlantParameters(J_EQ, J_L, K_S, DAMPING - TORQUE_PER_VOLT * back_emf, 0.0, TORQUE_PER_VOLT, back_emf, 2.6)
    reference = signals.smooth_square_wave(signals.time_axis(3.0, 0.002), 0.5, 20 * DEG, 100)
    simulated = run(plant, lambda theta_d, theta, alpha: 6 * (theta_d - theta) - alpha, reference, x0=(0.1, 0, 0, 0))
    held = control.sample_system(control.ss(A, B.reshape(4, 1), np.eye(2, 4), 0), 0.002)
    state = np.array([0.1, 0, 0, 0])
    for k, theta_d in enumerate(reference):
        u = 6 * (theta_d - state[0]) - state[1]
        assert (simulated["theta"][k], simulated["alpha"][k]) == pytest.approx(tuple(state[:2]), abs=1e-9)
        assert simulated["vm"][k] == pytest.approx(u, abs=1e-7)
        state = held.A @ state + held.B[:, 0] * u
    assert response.measure(simulated)


def test_the_nonlinear_plant_sticks_and_saturates_as_on_the_virtual_bench():
    plant = preset("real_bench").parameters
    with hil.open("virtual:?encoder=EHR", plant=plant) as bench:
        measured = experiments.tracking(bench, K, progress=False)
    simulated = run(plant, StateFeedback(K), measured["theta_ref"])
    assert np.abs(simulated["vm"]).max() <= plant.V_max
    np.testing.assert_allclose(simulated["theta"], measured["theta"], atol=0.5 * DEG)
    np.testing.assert_allclose(simulated["alpha"], measured["alpha"], atol=0.5 * DEG)
    rest = simulated.between(1.3, 1.5)["theta"]
    assert np.ptp(rest) == 0.0 and abs(rest[0] - measured["theta_ref"][700]) > 0.01 * DEG


def test_a_controller_that_asks_for_no_number_of_volts_is_told():
    for law in (lambda *_now: np.nan, lambda *_now: None):
        with pytest.raises(DesignError, match="returned"):
            run(preset("real_bench").parameters, law, np.ones(10))


NAMED = {"states": ["theta", "alpha", "theta_dot", "alpha_dot"], "outputs": ["theta", "alpha"]}


def test_a_system_of_python_control_will_do_in_place_of_the_matrices():
    system = control.ss(A, B.reshape(4, 1), np.eye(2, 4), 0, inputs=["V_m"], **NAMED)
    by_system = closed_loop(system, K, np.full(200, 0.3), fidelity="workbook")
    by_matrices = closed_loop(A, B, K, np.full(200, 0.3), fidelity="workbook")
    np.testing.assert_array_equal(by_system["theta"], by_matrices["theta"])
    with hil.open("virtual:?preset=workbook") as bench:
        validated = experiments.validation(bench, system, "step", progress=False)
        np.testing.assert_array_equal(
            validated["theta_model"], experiments.validation(bench, A, B, "step", progress=False)["theta_model"]
        )


def test_the_motor_in_a_system_is_what_python_control_makes_of_its_feedback():
    servo = srv02()
    A_torque, B_torque = A.copy(), np.array([[0], [0], [1 / J_EQ], [-1 / J_EQ]])
    A_torque[2:, 2] = [-0.004 / J_EQ, 0.004 / J_EQ]
    C, D = np.eye(4)[[0, 2]], np.array([[0.0], [0.5]])
    torque = control.ss(A_torque, B_torque, C, D, states=NAMED["states"], inputs=["tau"], outputs=["theta", "rate"])
    driven = with_actuator(torque, servo)
    assert (driven.input_labels, driven.output_labels) == (["vm"], ["theta", "rate"])
    # tau = a V_m − b θ̇: the same by connecting blocks, with the states as outputs that are fed back.
    whole = control.ss(A_torque, B_torque, np.vstack([C, [[0, 0, 1, 0]]]), np.vstack([D, [[0]]]))
    fed_back = control.feedback(whole, control.ss([], [], [], [[0, 0, servo.back_emf_damping]])) * servo.torque_per_volt
    for omega in (0.1, 20.0, 300.0):
        np.testing.assert_allclose(driven(1j * omega), fed_back(1j * omega)[:2], rtol=1e-8)


def test_a_system_in_discrete_time_or_with_other_states_is_refused():
    mixed = NAMED | {"states": ["theta", "theta_dot", "alpha", "alpha_dot"]}
    for system in (
        control.ss(A, B.reshape(4, 1), np.eye(2, 4), 0, 0.002, **NAMED),
        control.ss(A, B.reshape(4, 1), np.eye(2, 4), 0, **mixed),
    ):
        with pytest.raises(DesignError):
            closed_loop(system, K, np.zeros(10))
