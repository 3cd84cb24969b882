"""The answers about the stiffness against sines of known amplitude, the workbook's figures, and virtual benches."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rotflex import experiments, hil
from rotflex.errors import IdentificationError
from rotflex.hil.student_benches import student_bench
from rotflex.identification import Estimate
from rotflex.instructor.stiffness import amplitude_spectrum, natural_frequency, stiffness
from rotflex.units import HZ

SAMPLE_TIME = 0.002


# --- the spectrum ----------------------------------------------------------------------------------------------------


@given(line=st.integers(1, 2047), amplitude=st.floats(0.01, 100), phase=st.floats(0, 6), mean=st.floats(-50, 50))
def test_a_sine_on_a_line_is_as_high_as_its_amplitude_and_the_mean_stands_at_zero(line, amplitude, phase, mean):
    t = np.arange(4096) * SAMPLE_TIME
    frequency = line / (4096 * SAMPLE_TIME)
    f, height = amplitude_spectrum(mean + amplitude * np.sin(2 * np.pi * frequency * t + phase), SAMPLE_TIME)
    assert f[line] == pytest.approx(frequency)
    expected = np.zeros(2048)
    expected[0], expected[line] = abs(mean), amplitude
    np.testing.assert_allclose(height, expected, atol=1e-9)


def test_the_signal_is_filled_up_to_a_power_of_two_and_the_lines_are_where_they_belong():
    f, height = amplitude_spectrum(np.ones(250), 0.01)
    assert f.shape == height.shape == (128,)
    np.testing.assert_allclose(f, np.fft.fftfreq(256, 0.01)[:128])
    assert height[0] == pytest.approx(1.0)  # over the 250 samples, not over 256


def test_the_workbook_signal_shows_its_three_amplitudes():
    t = np.arange(0, 10.24, 0.01)
    g = 3 * np.sin(2 * np.pi * t) + 2 * np.sin(4 * np.pi * t) + 0.5 * np.sin(10 * np.pi * t)
    f, height = amplitude_spectrum(g, 0.01)
    # 1, 2 and 5 Hz fall between lines here, by at most half of one: a line shows at least 2/pi of an amplitude.
    for frequency, amplitude in ((1, 3), (2, 2), (5, 0.5)):
        peak = height[np.abs(f - frequency) < 0.06].max()
        assert 2 / math.pi * amplitude < peak < 1.05 * amplitude


@pytest.mark.parametrize(
    ("x", "dt", "said"),
    [
        ([1.0], 0.01, "two finite"),
        ([1.0, np.nan], 0.01, "finite"),
        (np.ones((2, 2)), 0.01, "vector"),
        ([1, 2], 0, "time"),
    ],
)
def test_what_is_no_signal_is_refused(x, dt, said):
    with pytest.raises(IdentificationError, match=said):
        amplitude_spectrum(x, dt)


# --- natural frequency and stiffness ---------------------------------------------------------------------------------


def test_the_natural_frequency_is_the_highest_line_in_the_band_with_a_half_line_of_doubt():
    f = np.arange(0, 20, 0.061)
    height = 1 / (1 + (f - 3.17) ** 2 / 0.01) + 5 / (1 + (f - 12) ** 2) + 10 * (f == 0)
    found = natural_frequency(f, height)
    assert abs(found.value - 3.17 * HZ) <= 0.061 / 2 * HZ
    assert found.uncertainty == pytest.approx(0.061 * HZ / math.sqrt(12))


def test_no_peak_in_the_band_is_said():
    f = np.arange(0, 10, 0.05)
    with pytest.raises(IdentificationError, match="no peak between 1 and 5"):
        natural_frequency(f, 1 / (0.1 + f))
    with pytest.raises(IdentificationError, match="lines between 1 and 5 Hz"):
        natural_frequency([0, 2, 7], [1, 1, 1])
    with pytest.raises(IdentificationError, match="shapes"):
        natural_frequency(f, f[1:])


def test_the_workbook_figures_give_its_stiffness():
    K_s = stiffness(0.00328, 19.9)
    assert round(K_s.value, 1) == 1.3
    assert K_s.uncertainty == 0


@given(J_l=st.floats(1e-3, 1e-2), omega_n=st.floats(5, 40), u_J=st.floats(0.0, 0.05), u_omega=st.floats(0.0, 0.05))
@settings(max_examples=50)
def test_uncertainty_propagates_as_the_partial_derivatives_say(J_l, omega_n, u_J, u_omega):
    found = stiffness(Estimate(J_l, u_J * J_l), Estimate(omega_n, u_omega * omega_n))
    by_J = omega_n**2 * u_J * J_l
    by_omega = 2 * J_l * omega_n * u_omega * omega_n
    assert found.value == pytest.approx(J_l * omega_n**2)
    assert found.uncertainty == pytest.approx(math.sqrt(by_J**2 + by_omega**2))


@pytest.mark.parametrize(("J_l", "omega_n"), [(0.0, 20.0), (3e-3, -20.0), (math.nan, 20.0)])
def test_what_is_not_positive_is_refused(J_l, omega_n):
    with pytest.raises(IdentificationError, match="positive"):
        stiffness(J_l, omega_n)


# --- virtual benches -------------------------------------------------------------------------------------------------


def peak_of_sweep(seed, drive):
    """Natural frequency read from alpha's spectrum, relative to the true one."""
    with hil.open(f"virtual:?seed={seed}") as bench:
        recording = experiments.sweep(bench, drive=drive, progress=False)
    parameters = student_bench(seed).parameters
    found = natural_frequency(*amplitude_spectrum(recording["alpha"], recording.sample_time))
    return found.value / math.sqrt(parameters.K_s / parameters.J_l)


@pytest.mark.parametrize("seed", [1, 7])
def test_the_peak_of_a_sweep_that_the_servo_follows_is_the_natural_frequency_within_3_percent(seed):
    assert peak_of_sweep(seed, "position") == pytest.approx(1, abs=0.03)


def test_the_peak_of_a_sweep_in_voltage_misleads():
    assert peak_of_sweep(2, "voltage") > 1.15
