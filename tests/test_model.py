"""The linear model against the printed matrices, the nonlinear plant, and python-control."""

from dataclasses import replace

import control
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.linalg import block_diag, expm

from rotflex import model
from rotflex.config import joint, srv02
from rotflex.errors import ConfigurationError, DesignError
from rotflex.hil.student_benches import student_bench
from rotflex.plant import REST, SUBSTEP, Plant, PlantParameters, State, driven

SERVO, JOINT = srv02(), joint()
K_S = 1.400  #: behind the printed matrices

parts = st.tuples(st.floats(1e-4, 1e-2), st.floats(0, 0.05), st.sampled_from([1, 2, 3])).map(
    lambda drawn: (replace(SERVO, J_eq=drawn[0], B_eq=drawn[1]), joint(drawn[2]))
)
stiffnesses = st.floats(0.1, 20)


def rotation(seed: int, n: int = 4) -> np.ndarray:
    return np.linalg.qr(np.random.default_rng(seed).standard_normal((n, n)))[0]


def test_torque_model_is_the_printed_one():
    system = model.state_space(SERVO, JOINT, K_S, input="torque")
    printed = [[0, 0, 1, 0], [0, 0, 0, 1], [0, 671.7, -1.9192, 0], [0, -1098.8, 1.9192, 0]]
    assert_allclose(system.A, printed, atol=0.05, rtol=0)
    assert_allclose(system.A[:, 2:], np.array(printed)[:, 2:], atol=5e-5, rtol=0)
    assert_allclose(system.B, [[0], [0], [479.8052], [-479.8052]], atol=1e-4, rtol=0)
    assert_array_equal(system.C, [[1, 0, 0, 0], [0, 1, 0, 0]])
    assert_array_equal(system.D, [[0], [0]])


@pytest.mark.parametrize(("input", "label"), [("voltage", "vm"), ("torque", "tau")])
def test_states_inputs_and_outputs_have_their_names(input, label):
    system = model.state_space(SERVO, JOINT, K_S, input=input)
    assert isinstance(system, control.StateSpace)
    assert system.state_labels == ["theta", "alpha", "theta_dot", "alpha_dot"]
    assert system.input_labels == [label]
    assert system.output_labels == ["theta", "alpha"]
    assert system.isctime(strict=True)


@settings(deadline=None)
@given(parts, stiffnesses, st.floats(0, 0.02), st.lists(st.floats(-3, 3), min_size=4, max_size=4), st.floats(-5, 5))
def test_voltage_model_moves_as_the_frictionless_plant_does(parts, K_s, B_l, x, voltage):
    servo, arm = parts
    plant = replace(PlantParameters.of(servo, arm, K_s), B_l=B_l, V_max=np.inf, I_max=np.inf)
    system = model.state_space(servo, arm, K_s, link_damping=B_l)
    moved = np.array(Plant(plant, State(*x)).advance(voltage, SUBSTEP))
    held = np.block([[system.A, system.B], [np.zeros((1, 5))]]) * SUBSTEP
    expected = (expm(held) @ [*x, voltage])[:4]
    scale = expm(np.abs(held)) @ np.abs([*x, voltage])
    smallest = np.finfo(float).tiny  # below it, numbers have no such precision
    assert np.all(np.abs(moved - expected) <= 1e-12 * scale[:4] + smallest)


def test_a_plants_linear_model_is_that_of_its_parts_and_comes_late_on_request():
    nominal, fitted = model.state_space(SERVO, JOINT, K_S), model.of_plant(PlantParameters.of(SERVO, JOINT, K_S))
    assert_allclose(fitted.A, nominal.A, rtol=1e-13)
    assert_allclose(fitted.B, nominal.B, rtol=1e-13)
    late = model.of_plant(PlantParameters.of(SERVO, JOINT, K_S), delay=0.004)
    assert (late.state_labels[:4], late.input_labels) == (nominal.state_labels, ["vm"])
    s = 1j * 2 * np.pi * np.array([0.5, 3.0, 20.0])
    assert_allclose(late(s), nominal(s) * np.exp(-0.004 * s), rtol=1e-3)
    with pytest.raises(ConfigurationError, match="delay"):
        model.of_plant(PlantParameters.of(SERVO, JOINT, K_S), delay=-0.001)


@pytest.mark.parametrize("plant", [student_bench(7).parameters, replace(student_bench(3).parameters, K_3=20.0)])
def test_the_nonlinear_system_moves_as_the_plant_to_the_last_bit(plant):
    system, rng = model.nonlinear(plant), np.random.default_rng(1)
    time = 0.002 * np.arange(800)
    volts = np.repeat(rng.uniform(-4, 4, 8), 100) * (rng.random(800) < 0.8)  # with rests, in which friction holds
    for _again in range(2):
        moved = control.input_output_response(system, time, volts)
        assert_array_equal(moved.states.T, driven(plant, REST, volts, 0.002))
    assert_array_equal(moved.outputs, moved.states[:2])
    assert (system.input_labels, system.output_labels, system.dt) == (["vm"], ["theta", "alpha"], 0.002)


def test_link_damping_is_the_joints_unless_told_otherwise():
    damped = replace(JOINT, B_l=0.003)
    of_joint = model.state_space(SERVO, damped, K_S).A
    assert_array_equal(of_joint, model.state_space(SERVO, JOINT, K_S, link_damping=0.003).A)
    assert_array_equal(
        model.state_space(SERVO, damped, K_S, link_damping=0.0).A, model.state_space(SERVO, JOINT, K_S).A
    )
    assert not np.array_equal(of_joint, model.state_space(SERVO, JOINT, K_S).A)


@pytest.mark.parametrize(
    ("wrong", "named"),
    [
        *(({"stiffness": one}, "stiffness") for one in (0, np.nan, np.inf, "1.3")),
        *(({"link_damping": one}, "link_damping") for one in (-1e-6, np.nan, "0")),
        ({"input": "current"}, "allowed: 'voltage', 'torque'"),
    ],
)
def test_what_the_model_is_made_of_must_be_sound(wrong, named):
    with pytest.raises(ConfigurationError, match=named):
        model.state_space(SERVO, JOINT, **({"stiffness": K_S} | wrong))


def test_open_loop_poles_of_the_printed_design():
    found = model.poles(model.state_space(SERVO, JOINT, K_S).A)
    assert_allclose(found, [-18.86, -8.092 - 26.984j, -8.092 + 26.984j, 0], atol=2e-3, rtol=0)


JORDAN = np.array([[0.0, 1.0], [0.0, 0.0]])
SWING = np.array([[0.0, 3.0], [-3.0, 0.0]])
SYSTEMS = {
    "repeated poles in the left half": (block_diag(-0.1 * np.eye(2) + JORDAN, -10 * np.eye(2) + JORDAN), "stable"),
    "one integrator": (np.diag([0.0, -1, -2, -1000]), "marginally stable"),
    "a swing and an integrator": (block_diag(SWING, 0, -1), "marginally stable"),
    "double integrator": (block_diag(JORDAN, -1, -1000), "unstable"),
    "two swings of one frequency": (block_diag(SWING, SWING), "unstable"),  # the workbook's rule
    "a swing that slowly grows": (block_diag(SWING + 1e-4 * np.eye(2), -1, -2), "unstable"),
}


@pytest.mark.parametrize(("A", "verdict"), SYSTEMS.values(), ids=list(SYSTEMS))
def test_stability_is_that_of_the_system_whatever_the_unit_of_time(A, verdict):
    for rate in (1e-4, 1.0, 1e4):
        assert model.stability(rate * A) == verdict


@settings(deadline=None)
@given(parts, stiffnesses)
def test_the_bench_is_marginally_stable_with_either_input(parts, K_s):
    assume(parts[0].B_eq > 1e-6)
    for input in ("voltage", "torque"):
        assert model.stability(model.state_space(*parts, K_s, input=input).A) == "marginally stable"


@pytest.mark.parametrize(
    ("poles", "verdict"),
    [
        ([-18.9, -8.09 + 27j, -8.09 - 27j, 3e-15], "marginally stable"),
        ([-20, -20, -20, -20], "stable"),
        ([1e-3 + 30j, 1e-3 - 30j], "unstable"),
        ([0, 0, -1], "unstable"),  # the workbook's rule, though two separate integrators would not grow
        ([3j, -3j, 3j, -3j], "unstable"),
        ([2e-8, -2e-8, -1], "unstable"),  # a double integrator as it comes out of eig
    ],
)
def test_stability_from_poles_alone(poles, verdict):
    assert model.stability(poles) == verdict
    assert model.stability(np.array(poles)[::-1]) == verdict


@pytest.mark.parametrize(
    "wrong",
    [[], [np.nan], [[1, 2, 3], [4, 5, 6]], [[1, 2], [3]], "stable", 1.0, [[1j]]],
)
def test_stability_refuses_what_is_neither_poles_nor_a_matrix(wrong):
    with pytest.raises(DesignError):
        model.stability(wrong)


@settings(deadline=None)
@given(parts, stiffnesses)
def test_controllability_matrix_is_that_of_python_control_and_has_full_rank(parts, K_s):
    system = model.state_space(*parts, K_s)
    T, rank, controllable = model.controllability(system.A, system.B)
    assert_allclose(T, control.ctrb(system.A, system.B), rtol=1e-12)
    assert (rank, controllable) == (4, True)


def test_a_very_stiff_joint_is_controllable_though_the_raw_matrix_looks_singular():
    system = model.state_space(SERVO, JOINT, 1e10)
    T, rank, controllable = model.controllability(system.A, system.B)
    assert np.linalg.matrix_rank(T) < 4
    assert (rank, controllable) == (4, True)


@settings(deadline=None)
@given(st.integers(1, 5), st.integers(0, 4), st.integers(0, 10**6))
def test_rank_is_the_number_of_states_that_the_input_reaches(reached, beyond, seed):
    rng = np.random.default_rng(seed)
    n = reached + beyond
    chain = np.diag(rng.uniform(1, 2, reached - 1), k=-1) + np.triu(rng.uniform(-1, 1, (reached, reached)))
    A = np.zeros((n, n))
    A[:reached, :reached] = chain
    A[:reached, reached:] = rng.uniform(-1, 1, (reached, beyond))  # the unreached act on the others, not vice versa
    A[reached:, reached:] = rng.uniform(-1, 1, (beyond, beyond))
    B = np.zeros(n)
    B[0] = 1
    Q = rotation(seed, n)
    T, rank, controllable = model.controllability(Q @ A @ Q.T, Q @ B)
    assert rank == reached
    assert controllable == (beyond == 0)
    assert T.shape == (n, n)


@pytest.mark.parametrize(
    ("A", "B", "named"),
    [
        (np.zeros((4, 3)), np.zeros(4), r"^A .*\(4, 3\)"),
        (np.eye(4), np.ones(3), r"^B .*\(3,\)"),
        (np.eye(4), np.ones((1, 4)), r"^B .*\(1, 4\)"),
        (np.eye(2), [np.nan, 1], "^B .*finite"),
        (np.eye(2) * 1j, [0, 1], "^A .*real"),
        ([[1, 2], [3]], [0, 1], "^A .*lengths"),
    ],
)
def test_matrices_that_do_not_fit_are_refused(A, B, named):
    with pytest.raises(DesignError, match=named):
        model.controllability(A, B)
