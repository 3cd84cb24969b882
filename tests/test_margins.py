"""Margins of a sampled loop, against the definition: how far gain and delay may grow until a pole leaves the circle."""

import control
import numpy as np
import pytest

from rotflex import design, model, sampled
from rotflex.config import joint, srv02
from rotflex.errors import DesignError
from rotflex.hil.controllers import StateFeedback

SYSTEM = model.state_space(srv02(), joint(1), 1.4, link_damping=0.0)
K = design.gain_by_place(SYSTEM.A, SYSTEM.B, design.desired_poles(0.6, 20, -30, -40))


def emulated(sample_time):
    return StateFeedback(K, sample_time=sample_time, cutoff=1 / sample_time).system()


def growth(loop):
    return np.abs(control.feedback(loop, 1).poles()).max()


@pytest.mark.parametrize("sample_time", [0.002, 0.01, 0.02])
def test_at_the_margins_a_pole_lies_on_the_unit_circle(sample_time):
    plant, controller = sampled.sample(SYSTEM, sample_time, 0.002), emulated(sample_time)
    found, loop = sampled.margins(plant, controller), -(controller * plant)
    assert growth(0.999 * found.gain * loop) < 1 < growth(1.001 * found.gain * loop)
    z = np.exp(1j * np.linspace(1e-3, np.pi, 2001))
    assert found.sensitivity_peak == pytest.approx(np.max(np.abs(1 / (1 + np.ravel(loop(z))))), rel=1e-4)


def test_a_loop_that_leaves_the_circle_at_the_nyquist_frequency_has_its_gain_margin_there():
    h = 1.0  # a plant 1/(z - 0.9) under u = -y: its pole 0.9 - k passes -1 at k = 1.9, with z = -1
    plant = control.StateSpace([[0.9]], [[1]], [[1], [0]], [[0], [0]], h)
    controller = control.StateSpace([], [], [], [[-1.0, 0.0]], h)
    assert sampled.margins(plant, controller).gain == pytest.approx(1.9)


def test_the_margins_of_an_integrator_with_a_delay_of_one_sample_are_those_of_the_formulas():
    """L = k/(z (z − 1)): |L| = 1 where 2 sin(ω/2) = k, and the phase there is −90° − 1.5 ω."""
    k, h = 0.6, 0.1
    plant = control.StateSpace([[1, 1], [0, 0]], [[0], [1]], [[1, 0], [0, 0]], [[0], [0]], h)
    found = sampled.margins(plant, control.StateSpace([], [], [], [[-k, 0.0]], h))
    crossing = 2 * np.arcsin(k / 2)  # rad a sample
    phase = np.pi / 2 - 1.5 * crossing
    assert found.gain == pytest.approx(1 / k, rel=1e-4)  # z² − z + k has its roots on the circle at k = 1
    assert found.phase == pytest.approx(np.rad2deg(phase), rel=1e-4)
    assert found.delay == pytest.approx(phase / crossing * h, rel=1e-4)


def test_a_loop_near_instability_has_its_peak_and_no_sample_time_gives_a_warning(recwarn):
    for h in np.linspace(0.004, 0.03, 14):
        plant = control.StateSpace([[1, 1], [0, 0]], [[0], [1]], [[1, 0], [0, 0]], [[0], [0]], h)
        found = sampled.margins(plant, control.StateSpace([], [], [], [[-0.98, 0.0]], h))
        z = np.exp(1j * np.linspace(0.5, 2, 300_001))
        assert found.sensitivity_peak == pytest.approx(np.max(np.abs(z * (z - 1) / (z**2 - z + 0.98))), rel=1e-3)
    assert not recwarn


def test_an_unstable_loop_has_no_margins():
    with pytest.raises(DesignError, match="unstable"):
        sampled.margins(sampled.sample(SYSTEM, 0.03, 0.002), emulated(0.03))
