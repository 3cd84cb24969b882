"""Margins and loop gain, held against python-control and against the eigenvalues of the sampled loop."""

import control
import numpy as np
import pytest
from delay_margin import spectral_radius

from rotflex.config import joint, srv02
from rotflex.hil.controllers import DERIVATIVE_CUTOFF
from rotflex.model import state_space
from rotflex.plant import PlantParameters
from rotflex.widgets.margins import bode, margins
from rotflex.widgets.optimal import lqr
from rotflex.widgets.placement import Dominant, design, with_gain

PLANT = PlantParameters.of(srv02(), joint(1), 1.4)
SYSTEM = state_space(srv02(), joint(1), 1.4, input="voltage")
A, B = np.asarray(SYSTEM.A), np.asarray(SYSTEM.B)
H = 0.002  # s
DESIGNS = {
    "the workbook's": design(A, B, Dominant().poles),
    "partial": design(A, B, Dominant().poles, "partial"),
    "slow": design(A, B, Dominant(0.8, 12.0, -20.0, -25.0).poles),
    "fast": design(A, B, Dominant(0.3, 35.0, -60.0, -70.0).poles),
    "two real poles": design(A, B, Dominant(1.5, 20.0).poles),
    "LQR": with_gain(A, B, lqr(A, B)),
    "weak link": with_gain(A, B, [18.2, 40.0, 1.59, 0.633]),
    "only the filters make it unstable": design(A, B, Dominant(0.3, 35.0, -60.0, -70.0).poles, "partial"),
}
GAINS = {name: found.applied.ravel() for name, found in DESIGNS.items()}
STABLE = {name: k for name, k in GAINS.items() if spectral_radius(PLANT, k, DERIVATIVE_CUTOFF, H) < 1}


def test_some_loops_are_stable_and_some_are_not():
    assert {"the workbook's", "partial", "slow", "fast", "two real poles", "LQR"} <= set(STABLE)
    for name in GAINS.keys() - STABLE.keys():
        assert margins(A, B, GAINS[name]) is None
    assert "only the filters make it unstable" not in STABLE


def opened(k, samples_late=1):
    """The loop by transfer functions of python-control: sampled plant, Euler's filters, whole samples of delay."""
    plant = control.sample_system(control.ss(A, B, np.eye(4)[:2], 0), H, "zoh")
    derivative = control.tf(DERIVATIVE_CUTOFF * np.array([1, -1]), [1, DERIVATIVE_CUTOFF * H - 1], H)
    law = [k[0] + k[2] * derivative, k[1] + k[3] * derivative]
    late = control.tf([1], [1] + [0] * samples_late, H)
    return control.ss(late) * (control.ss(law[0]) * plant[0, 0] + control.ss(law[1]) * plant[1, 0])


@pytest.mark.parametrize("name", STABLE)
def test_the_margins_are_those_of_python_control(name):
    found = margins(A, B, STABLE[name], delay=H)
    omega = np.geomspace(0.1, np.pi / H, 3000)
    response = control.frd(opened(STABLE[name])(np.exp(1j * omega * H)), omega)
    factors, phases, _, at_phase, at_gain, _ = control.stability_margins(response, returnall=True)
    up = [(one, at) for one, at in zip(factors, at_phase, strict=True) if 1 < one < 1e3]
    down = [(one, at) for one, at in zip(factors, at_phase, strict=True) if 0 < one < 1]
    assert (found.gain_up, found.gain_up_at) == pytest.approx(min(up, default=(np.inf, np.nan)), rel=1e-3, nan_ok=True)
    assert (found.gain_down, found.gain_down_at) == pytest.approx(
        max(down, default=(0.0, np.nan)), rel=1e-3, nan_ok=True
    )
    assert (found.phase, found.phase_at) == pytest.approx(min(zip(np.abs(phases), at_gain, strict=True)), rel=1e-3)


@pytest.mark.parametrize("delay", [0.0, 0.0013, 0.002, 0.0035])
@pytest.mark.parametrize("name", STABLE)
def test_beyond_its_gain_margins_and_its_delay_the_loop_is_unstable_and_before_it_is_not(name, delay):
    k = STABLE[name]
    found = margins(A, B, k, delay)

    def unstable(factor, late=delay):
        return spectral_radius(PLANT, factor * k, DERIVATIVE_CUTOFF, late) > 1 + 1e-9

    for factor, beyond in ((found.gain_up, 1.02), (found.gain_down, 0.98)):
        if np.isfinite(factor) and factor > 0:
            assert unstable(factor * beyond)
            assert not unstable(factor / beyond)
    assert unstable(1, delay + found.delay + 2e-4)
    assert not unstable(1, delay + found.delay - 2e-4)
    assert margins(A, B, k, delay + found.delay + 1e-5) is None


def test_the_loop_gain_is_that_of_python_control():
    omega = np.geomspace(0.5, 400, 60)
    k = STABLE["the workbook's"]
    magnitude, phase = bode(A, B, k, omega, delay=H)
    expected = opened(k)(np.exp(1j * omega * H))
    assert magnitude == pytest.approx(20 * np.log10(np.abs(expected)), abs=1e-6)
    assert np.exp(1j * np.radians(phase)) == pytest.approx(expected / np.abs(expected), abs=1e-6)
    assert np.abs(np.diff(phase)).max() < 90
