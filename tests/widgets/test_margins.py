"""Margins and loop gain, held against python-control."""

import control
import numpy as np
import pytest

from rotflex.config import joint, srv02
from rotflex.instructor.model import state_space
from rotflex.widgets.margins import bode, margins
from rotflex.widgets.optimal import lqr
from rotflex.widgets.placement import Dominant, design, with_gain

SYSTEM = state_space(srv02(), joint(1), 1.4, input="voltage")
A, B = np.asarray(SYSTEM.A), np.asarray(SYSTEM.B)
DESIGNS = {
    "the workbook's": design(A, B, Dominant().poles),
    "partial": design(A, B, Dominant().poles, "partial"),
    "slow": design(A, B, Dominant(0.8, 12.0, -20.0, -25.0).poles),
    "fast": design(A, B, Dominant(0.3, 35.0, -60.0, -70.0).poles),
    "two real poles": design(A, B, Dominant(1.5, 20.0).poles),
    "LQR": with_gain(A, B, lqr(A, B)),
    "weak link": with_gain(A, B, [18.2, 40.0, 1.59, 0.633]),
}
STABLE = {name: found for name, found in DESIGNS.items() if found.runaway is None}


def opened(found):
    return control.ss(A, B, found.applied, 0)


@pytest.mark.parametrize("name", STABLE)
def test_the_margins_are_those_of_python_control(name):
    found = margins(A, B, STABLE[name].applied)
    factors, phases, _, at_phase, at_gain, _ = control.stability_margins(opened(STABLE[name]), returnall=True)
    up = [(one, omega) for one, omega in zip(factors, at_phase, strict=True) if 1 < one < 1e6]
    down = [(one, omega) for one, omega in zip(factors, at_phase, strict=True) if 0 < one < 1 and omega > 1e-3]
    assert (found.gain_up, found.gain_up_at) == pytest.approx(min(up, default=(np.inf, np.nan)), rel=1e-5, nan_ok=True)
    assert (found.gain_down, found.gain_down_at) == pytest.approx(
        max(down, default=(0.0, np.nan)), rel=1e-5, nan_ok=True
    )
    least = min(zip(np.abs(phases), at_gain, strict=True))
    assert (found.phase, found.phase_at) == pytest.approx(least, rel=1e-5)
    delays = [(np.radians(angle % 360) / omega, omega) for angle, omega in zip(phases, at_gain, strict=True)]
    assert (found.delay, found.delay_at) == pytest.approx(min(delays), rel=1e-5)


@pytest.mark.parametrize("name", STABLE)
def test_beyond_its_gain_margins_and_its_delay_the_loop_is_unstable_and_before_it_is_not(name):
    applied = STABLE[name].applied
    found = margins(A, B, applied)

    def growth(gain, delay=0.0):
        if not delay:
            return np.linalg.eigvals(A - B @ gain).real.max()
        late = control.ss(*control.ssdata(control.tf(*control.pade(delay, 8))))
        return control.feedback(opened_of(gain) * late, 1).poles().real.max()

    def opened_of(gain):
        return control.ss(A, B, gain, 0)

    for factor, beyond in ((found.gain_up, 1.02), (found.gain_down, 0.98)):
        if np.isfinite(factor) and factor > 0:
            assert growth(factor * beyond * applied) > 0
            assert growth(factor / beyond * applied) < 0
    assert growth(applied, 1.05 * found.delay) > 0
    assert growth(applied, 0.95 * found.delay) < 1e-6


def test_the_loop_gain_is_that_of_python_control():
    omega = np.geomspace(0.5, 400, 60)
    magnitude, phase = bode(A, B, DESIGNS["the workbook's"].applied, omega)
    expected = opened(DESIGNS["the workbook's"])(1j * omega)
    assert magnitude == pytest.approx(20 * np.log10(np.abs(expected)), abs=1e-6)
    assert np.exp(1j * np.radians(phase)) == pytest.approx(expected / np.abs(expected), abs=1e-6)
    assert np.abs(np.diff(phase)).max() < 90
