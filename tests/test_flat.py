"""Commands from the flat output against the differential equation of the model."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from rotflex import design, model, simulation
from rotflex.config import joint, srv02
from rotflex.errors import DesignError
from rotflex.hil.controllers import StateFeedback, TwoDegreesOfFreedom
from rotflex.hil.student_benches import student_bench
from rotflex.plant import PlantParameters
from rotflex.signals.flat import turn
from rotflex.units import DEG

SERVO, JOINT = srv02(), joint()
PLANT = model.state_space(SERVO, JOINT, 1.4, link_damping=0.0)
K = design.gain_by_place(PLANT, design.desired_poles(0.6, 20, -30, -40))
TIME = np.arange(501) * 0.002


def test_the_planned_voltage_turns_the_model_along_the_planned_states_and_leaves_no_swing():
    plan = turn(PLANT, 40 * DEG, 0.5, TIME, start=0.1)

    def flow(t, x):
        return PLANT.A @ x + PLANT.B[:, 0] * turn(PLANT, 40 * DEG, 0.5, [t], start=0.1).volts[0]

    moved = solve_ivp(flow, (0, 1), np.zeros(4), t_eval=TIME, rtol=1e-9, atol=1e-11, max_step=0.02).y
    assert_allclose(moved, plan.states, atol=1e-6)
    assert_allclose(plan.states[:, TIME >= 0.6], np.array([[40 * DEG, 0, 0, 0]]).T @ np.ones((1, 201)), atol=1e-12)
    assert not plan.volts[TIME <= 0.1].any() and np.abs(np.diff(plan.volts)).max() < 0.05  # no jump


def test_with_the_feedforward_a_state_feedback_sets_the_planned_voltage_and_helps_against_friction():
    plan = turn(PLANT, 40 * DEG, 0.5, TIME)
    command = plan.states[0] + plan.feedforward(K, friction=0.07)
    set_there = K[0, 0] * command - (K @ plan.states)[0]
    moving = np.abs(plan.states[2]) > 0.01
    assert_allclose((set_there - plan.volts)[moving], 0.07 * np.sign(plan.states[2][moving]), atol=1e-12)
    assert_allclose(set_there[-1], 0, atol=1e-12)


def test_feedback_and_feedforward_follow_the_plan_where_feedback_alone_lags():
    plan = turn(PLANT, 40 * DEG, 0.5, TIME)
    bench = PlantParameters.of(SERVO, JOINT, 1.4)
    swings = []
    for controller in (TwoDegreesOfFreedom(StateFeedback(K), plan.feedforward(K)), StateFeedback(K)):
        run = simulation.run(bench, controller, plan.states[0])
        swings.append(np.abs(run["theta"] - plan.states[0]).max() / DEG)
    assert swings[0] < 1 and swings[1] > 5


def test_the_damping_that_is_neglected_is_at_most_4_percent_of_the_largest_spring_torque():
    bench = student_bench(276)  # of the first 400 benches, the one with the largest share
    plan = turn(model.state_space(srv02(), bench.joint, bench.parameters.K_s), 40 * DEG, 0.5, TIME)
    neglected, spring = bench.parameters.B_l * plan.states[3], bench.parameters.K_s * plan.states[1]
    assert 0.03 < np.abs(neglected).max() / np.abs(spring).max() < 0.04


def test_a_turn_needs_time_and_a_spring():
    for duration, A in ((0.0, PLANT.A), (float("nan"), PLANT.A), (0.5, np.zeros((4, 4)))):
        with pytest.raises(DesignError, match="positive duration"):
            turn(A, PLANT.B, 1.0, duration, TIME)
