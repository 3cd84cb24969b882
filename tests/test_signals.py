"""Signals against their definitions, at the samples where rounding would show."""

import control
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rotflex import signals
from rotflex.errors import ConfigurationError


def test_ten_seconds_at_two_milliseconds_are_5001_samples_with_both_ends():
    t = signals.time_axis(10, 0.002)
    assert t.size == 5001
    assert t[0] == 0
    assert t[-1] == pytest.approx(10, abs=1e-12)


def test_chirp_agrees_with_scipy():
    from scipy.signal import chirp

    t = signals.time_axis(15, 0.002)
    expected = 2.0 * chirp(t, f0=1, t1=t[-1], f1=5, method="linear", phi=-90)
    np.testing.assert_allclose(signals.chirp(t, 1, 5, 2.0), expected, atol=1e-10)


@given(
    half_period=st.integers(1, 1000),
    sample_time=st.sampled_from([0.001, 0.002, 0.004, 0.01, 0.1, 1 / 3, 0.7e-3]),
    built=st.sampled_from(["product", "sum", "linspace"]),
)
def test_square_wave_turns_exactly_on_the_sample_of_its_edge(half_period, sample_time, built):
    n = 10 * half_period + 1
    t = {
        "product": lambda: np.arange(n) * sample_time,
        "sum": lambda: np.concatenate([[0.0], np.cumsum(np.full(n - 1, sample_time))]),
        "linspace": lambda: np.linspace(0, (n - 1) * sample_time, n),
    }[built]()
    wave = signals.square_wave(t, 1 / (2 * half_period * sample_time), 3.0)
    expected = np.where(np.arange(n) // half_period % 2 == 0, 3.0, -3.0)
    np.testing.assert_array_equal(wave, expected)


def test_step_has_its_new_value_on_the_sample_of_the_step():
    t = signals.time_axis(1, 0.1)
    for at in (0.3, 0.25):
        assert signals.step(t, 5.0, at=at).tolist() == [0, 0, 0, 5, 5, 5, 5, 5, 5, 5, 5]
    assert signals.step(t, 5.0).tolist() == [5.0] * 11
    wave = signals.smooth_square_wave(signals.time_axis(1, 0.002), 0.33, 20.0, 100)  # starts from zero
    np.testing.assert_allclose(wave[:6], [4, 8, 12, 16, 20, 20])


@given(
    x=st.lists(st.floats(-50, 50), min_size=1, max_size=60),
    rate=st.floats(0.1, 1e4),
    sample_time=st.floats(1e-3, 1.0),
    initial=st.floats(-50, 50),
)
def test_rate_limit_never_moves_faster_never_overshoots_and_heads_for_its_input(x, rate, sample_time, initial):
    y = signals.rate_limit(x, rate, sample_time, initial)
    before = np.concatenate([[initial], y[:-1]])
    x = np.array(x)
    assert np.all(np.abs(y - before) <= rate * sample_time * (1 + 1e-6) + 1e-12)
    assert np.all((y - before) * (x - before) >= 0)
    assert np.all(np.abs(x - y) <= np.abs(x - before))
    limited = y != x
    np.testing.assert_allclose(np.abs(y - before)[limited], rate * sample_time, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(("rate", "samples"), [(100, 10), (50, 20), (25, 40)])
def test_smooth_square_wave_crosses_from_peak_to_peak_in_two_over_its_rate(rate, samples):
    t = signals.time_axis(5, 0.002)
    wave = signals.smooth_square_wave(t, 0.33, 20.0, rate)
    edge = int(np.ceil(1 / 0.66 / 0.002))
    assert wave[edge - 1] == 20
    assert wave[edge] == pytest.approx(20 - 20 * rate * 0.002)
    assert wave[edge + samples - 2] > -20
    assert np.all(wave[edge + samples - 1 : 2 * edge - 2] == -20)
    assert np.all(np.diff(wave[edge - 1 : edge + samples]) < 0)


def test_signals_refuse_impossible_arguments():
    t = signals.time_axis(1, 0.002)
    for call in (
        *(lambda f=f: signals.square_wave(t, f) for f in (0, -1, np.inf)),
        lambda: signals.square_wave(t.reshape(-1, 1), 0.33),
        lambda: signals.chirp(t, 0, 5),
        lambda: signals.chirp(t[:1], 1, 5),
        lambda: signals.rate_limit(t, 0, 0.002),
        lambda: signals.rate_limit(t, 100, 0),
        *(lambda x=x: signals.rate_limit(x, 100, 0.002) for x in ([0.0, np.nan], ["on", "off"])),
        lambda: signals.smooth_square_wave(t, 0.33, 1, -100),
        *(lambda x=x: signals.smooth_square_wave(x, 0.33, 1, 100) for x in (t[::-1], t**2)),
        *(lambda h=h: signals.time_axis(1, h) for h in (0, -0.002)),
        *(lambda d=d: signals.time_axis(d, 0.002) for d in (0, 0.001, np.nan)),
    ):
        with pytest.raises(ConfigurationError):
            call()
    with pytest.raises(ConfigurationError, match="250 Hz"):
        signals.chirp(t, 1, 260)


@pytest.mark.parametrize(("zeta", "sample_time"), [(0.0, 0.002), (0.1, 0.002), (0.1, 0.02), (0.4, 0.03)])
def test_a_shaped_step_leaves_a_tenth_or_less_of_the_swing_and_ends_where_the_step_does(zeta, sample_time):
    omega_n = 20.0
    command = signals.step(signals.time_axis(2, sample_time), 1.0, at=0.1)
    shaped = signals.shaped(command, omega_n, zeta, sample_time)
    assert shaped[0] == 0 and shaped[-1] == pytest.approx(1)
    half = np.pi / (omega_n * np.sqrt(1 - zeta**2))
    since = round((0.1 + half) / sample_time) + 2
    left = []
    for given_command in (command, shaped):
        link = control.c2d(control.tf([omega_n**2], [1, 2 * zeta * omega_n, omega_n**2]), sample_time)
        angle = control.forced_response(link, np.arange(command.size) * sample_time, given_command).outputs
        left.append(np.abs(angle[since:] - 1).max())
    assert left[1] < 0.1 * left[0]


def test_what_is_shaped_has_a_frequency_and_a_damping_below_1():
    for wrong in ((0.0, 0.1, 0.002), (20.0, 1.0, 0.002), (20.0, -0.1, 0.002), (20.0, 0.1, 0.0)):
        with pytest.raises(ConfigurationError):
            signals.shaped([0.0, 1.0], *wrong)
