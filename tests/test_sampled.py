"""The sampled plant against python-control, an integrator of differential equations, and loops that are simulated."""

import control
import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from rotflex import design, model, sampled
from rotflex.config import joint, srv02
from rotflex.errors import DesignError
from rotflex.hil.controllers import StateFeedback

PLANT = model.state_space(srv02(), joint(), 1.4, link_damping=0.0)
POLES = design.desired_poles(0.6, 20, -30, -40)
K = design.gain_by_place(PLANT, POLES)


def test_without_delay_it_is_python_controls_hold():
    found, expected = sampled.sample(PLANT, 0.02), control.c2d(PLANT, 0.02, "zoh")
    assert_allclose(found.A, expected.A, rtol=1e-10, atol=1e-13)
    assert_allclose(found.B, expected.B, rtol=1e-10, atol=1e-13)
    assert found.dt == 0.02 and found.output_labels == ["theta", "alpha"]


def flow(_t, x, voltage):
    return PLANT.A @ x + PLANT.B[:, 0] * voltage


@pytest.mark.parametrize(("sample_time", "delay"), [(0.03, 0.002), (0.01, 0.01), (0.01, 0.023), (0.002, 0.006)])
def test_a_held_voltage_that_comes_late_moves_the_plant_as_it_moves_the_differential_equation(sample_time, delay):
    volts = [3.0, -2.0, 5.0, 1.0, -4.0, 2.0]
    found = sampled.sample(PLANT, sample_time, delay)
    moved = control.forced_response(found, np.arange(6) * sample_time, volts).outputs

    state, expected, now = np.zeros(4), [], 0.0
    changes = [(k * sample_time + delay, volts[k]) for k in range(6)]
    samples = [(k * sample_time, None) for k in range(6)]
    voltage = 0.0
    for instant, change in sorted(samples + changes, key=lambda one: (round(one[0], 9), one[1] is not None)):
        if instant > now + 1e-12:
            state = solve_ivp(flow, (now, instant), state, args=(voltage,), rtol=1e-10, atol=1e-13).y[:, -1]
            now = instant
        if change is None:
            expected.append(state[:2])
        else:
            voltage = change
    assert_allclose(moved, np.transpose(expected), rtol=1e-6, atol=1e-10)


@pytest.mark.parametrize(("delay", "voltages"), [(0.0, 0), (0.002, 1), (0.01, 1), (0.0101, 2), (0.03, 3)])
def test_as_many_voltages_are_states_as_still_act(delay, voltages):
    assert sampled.sample(PLANT, 0.01, delay).state_labels[4:] == [f"u_{i + 1}" for i in range(voltages)]


@pytest.mark.parametrize("sample_time", [0.001, 0.002, 0.03, 0.05])
def test_the_gain_puts_the_poles_where_the_desired_ones_belong_and_those_of_voltages_at_zero(sample_time):
    plant = sampled.sample(PLANT, sample_time, 0.5 * sample_time)
    found = np.linalg.eigvals(plant.A - plant.B @ sampled.gain_by_place(plant, POLES))
    expected = [*np.exp(sample_time * POLES), 0]
    assert_allclose(np.poly(found), np.real(np.poly(expected)), atol=1e-8)


def grows(sample_time, delay):
    """Whether the loop of plant and emulated controller grows, run sample by sample from a small deflection."""
    plant = sampled.sample(PLANT, sample_time, delay)
    controller = StateFeedback(K, sample_time=sample_time, cutoff=1 / sample_time)
    state, sizes = np.zeros(plant.nstates), []
    state[1] = 1e-3
    for _sample in range(6000):
        sizes.append(np.abs(state).max())
        state = plant.A @ state + plant.B[:, 0] * controller(0.0, *state[:2])
    return max(sizes[-500:]) > max(sizes[2000:2500])


@pytest.mark.parametrize("delay", [0.0, 0.002])
def test_just_below_the_longest_sample_time_the_emulated_loop_dies_away_and_just_above_it_grows(delay):
    limit = sampled.longest_sample_time(PLANT, K, delay)
    assert 0.02 < limit < 0.05
    assert not grows(0.995 * limit, delay) and grows(1.005 * limit, delay)
    for factor, stable in ((0.995, True), (1.005, False)):
        poles = sampled.emulated_poles(sampled.sample(PLANT, factor * limit, delay), K)
        assert (np.abs(poles).max() < 1) is np.bool_(stable)


def test_a_gain_of_the_wrong_sign_has_no_sample_time_and_a_weak_one_has_all():
    assert sampled.longest_sample_time(PLANT, -K) == 0
    assert sampled.longest_sample_time(PLANT, [1.0, 0, 0, 0]) == sampled.LONGEST_SAMPLE_TIME


@pytest.mark.parametrize(
    ("wrong", "named"),
    [
        (lambda: sampled.sample(PLANT, 0.0), "sample time"),
        (lambda: sampled.sample(PLANT, 0.01, -1e-3), "delay"),
        (lambda: sampled.sample(sampled.sample(PLANT, 0.01), 0.01), "continuous time"),
        (lambda: sampled.gain_by_place(PLANT, POLES), "Sample it first"),
        (lambda: sampled.gain_by_place(sampled.sample(PLANT, 0.01, 0.002), POLES[:3]), "4 poles"),
        (lambda: sampled.gain_by_place(sampled.sample(PLANT, 0.01, 0.002), [*POLES, -50]), "4 poles"),
    ],
)
def test_what_cannot_be_designed_is_said(wrong, named):
    with pytest.raises(DesignError, match=named):
        wrong()
