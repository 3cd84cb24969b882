"""Commands from the flat output against the differential equation of the model."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from rotflex import design, model, simulation
from rotflex.config import joint, srv02
from rotflex.errors import DesignError
from rotflex.hil.controllers import StateFeedback, TwoDegreesOfFreedom
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


def test_the_damping_that_is_neglected_is_less_than_5_percent_of_the_largest_spring_torque():
    """On the lightest arm that is drawn, with the least natural frequency and the most damping."""
    sizes = {"m_1": 0.92, "m_2": 0.92, "L_1": 0.97, "L_2": 0.97}
    arm = replace(JOINT, **{name: least * getattr(JOINT, name) for name, least in sizes.items()})
    K_s, B_l = arm.J_l * 18.0**2, 0.0025
    plan = turn(model.state_space(SERVO, arm, K_s), 40 * DEG, 0.5, TIME)
    assert 0.04 < np.abs(B_l * plan.states[3]).max() / np.abs(K_s * plan.states[1]).max() < 0.05


def test_a_turn_needs_time_and_a_spring():
    for duration, A in ((0.0, PLANT.A), (float("nan"), PLANT.A), (0.5, np.zeros((4, 4)))):
        with pytest.raises(DesignError, match="positive duration"):
            turn(A, PLANT.B, 1.0, duration, TIME)
