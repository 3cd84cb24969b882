"""Test signals, sampled: the commands that drive the bench and the simulation.

Each takes the sample times ``t`` (n,) in seconds and gives (n,) samples in the unit of its ``amplitude``; angles inside
the package are in radians, so a ±20 deg square wave is ``square_wave(t, 0.33, 20 * DEG)``.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from rotflex.config import finite_vector, positive
from rotflex.errors import ConfigurationError
from rotflex.units import Vector

__all__ = ["chirp", "rate_limit", "shaped", "smooth_square_wave", "square_wave", "step", "time_axis"]


def __dir__() -> list[str]:
    return __all__


# A sample time like 0.1 s has no exact binary value, so that an edge meant for a sample may come out just after it.
# An edge is taken to be on a sample when it is within this fraction of it.
_EDGE_TOLERANCE = 1e-9


def time_axis(duration: float, sample_time: float) -> Vector:
    """Sample times (s) from 0 to ``duration``, both ends included: 10 s at 2 ms are 5001 samples.

    Raises
    ------
    ConfigurationError
        If ``sample_time`` is not positive, or ``duration`` is shorter than one sample time.
    """
    sample_time = positive("sample_time", sample_time, "s")
    duration = positive("duration", duration, "s")
    intervals = int(np.floor(duration / sample_time * (1 + _EDGE_TOLERANCE)))
    if intervals < 1:
        raise ConfigurationError(f"A duration of {duration:g} s is shorter than one sample time of {sample_time:g} s.")
    return np.arange(intervals + 1, dtype=np.float64) * sample_time


def chirp(t: Any, f_start: float, f_stop: float, amplitude: float = 1.0) -> Vector:
    """Sine whose frequency runs linearly from ``f_start`` at the first sample to ``f_stop`` at the last (Hz).

    The frequency is the derivative of the phase, and the phase starts at 0: so does the signal.

    Parameters
    ----------
    t : (n,) sample times, s, evenly spaced
    f_start, f_stop : frequencies, Hz, positive; the larger must be below half the sampling frequency
    amplitude : of the sine, in the unit of the result

    Raises
    ------
    ConfigurationError
        If a frequency is not positive or is too high for the sample time, or if ``t`` is not a time axis.
    """
    time = _times(t)
    f_start, f_stop = positive("f_start", f_start, "Hz"), positive("f_stop", f_stop, "Hz")
    highest, sample_time = max(f_start, f_stop), _sample_time(time)
    if highest >= 0.5 / sample_time:
        raise ConfigurationError(
            f"{highest:g} Hz cannot be sampled every {sample_time:g} s: stay below {0.5 / sample_time:g} Hz."
        )
    elapsed = time - time[0]
    acceleration = (f_stop - f_start) / elapsed[-1]  # Hz/s
    signal: Vector = amplitude * np.sin(2 * np.pi * (f_start * elapsed + acceleration * elapsed**2 / 2))
    return signal


def square_wave(t: Any, frequency: float, amplitude: float = 1.0) -> Vector:
    """Square wave between ±``amplitude``, positive in the half period that begins at t = 0.

    A sample on an edge has the new value, whatever the rounding of ``t``.

    Parameters
    ----------
    t : (n,) sample times, s
    frequency : Hz
    amplitude : in the unit of the result

    Raises
    ------
    ConfigurationError
        If ``frequency`` is not positive.
    """
    half_periods = 2 * positive("frequency", frequency, "Hz") * _times(t)
    which = np.floor(half_periods + _EDGE_TOLERANCE * np.maximum(1.0, np.abs(half_periods)))
    return amplitude * np.where(which % 2 == 0, 1.0, -1.0)


def step(t: Any, amplitude: float, at: float = 0.0) -> Vector:
    """Step from 0 to ``amplitude`` at the time ``at`` (s); a sample at that time has the new value."""
    return amplitude * (_times(t) >= at - _EDGE_TOLERANCE * max(1.0, abs(at))).astype(np.float64)


def rate_limit(x: Any, rate: float, sample_time: float, initial: float = 0.0) -> Vector:
    """Follow ``x`` without moving by more than ``rate * sample_time`` from one sample to the next.

    Parameters
    ----------
    x : (n,) samples
    rate : largest slope, in the unit of ``x`` per second
    sample_time : s
    initial : the output before the first sample, from which that sample is limited, too

    Raises
    ------
    ConfigurationError
        If ``rate`` or ``sample_time`` is not positive, or ``x`` is not a vector of numbers.
    """
    largest = positive("rate", rate, "1/s") * positive("sample_time", sample_time, "s")
    limited = []
    y = float(initial)
    for wanted in finite_vector("x", x).tolist():
        change = wanted - y
        # The tolerance lands a ramp of a whole number of steps on its end, not one rounding error short of it.
        y = wanted if abs(change) <= largest * (1 + _EDGE_TOLERANCE) else y + np.copysign(largest, change)
        limited.append(y)
    return np.array(limited)


def smooth_square_wave(t: Any, frequency: float, amplitude: float, rate: float) -> Vector:
    """Square wave of ±1 through a rate limiter that starts from 0, times ``amplitude`` (Section 3.4.2).

    Parameters
    ----------
    t : (n,) sample times, s, evenly spaced
    frequency : Hz
    amplitude : in the unit of the result
    rate : largest slope of the *unit* wave, 1/s: at 100 /s the ±20 deg wave moves at 2000 deg/s, and turns in 20 ms

    Raises
    ------
    ConfigurationError
        If ``frequency`` or ``rate`` is not positive, or ``t`` is not a time axis.
    """
    time = _times(t)
    return amplitude * rate_limit(square_wave(time, frequency), rate, _sample_time(time))


def shaped(x: Any, omega_n: float, zeta: float, sample_time: float) -> Vector:
    """Shape a command so that it leaves no swing of one oscillation (zero-vibration shaper; Singer and Seering, 1990).

    The result is a weighted mean of the command and of the command half a damped period later. Half a period is seldom
    a whole number of samples; between samples the command is interpolated.

    Parameters
    ----------
    x : (n,) command, which starts from ``x[0]``
    omega_n : natural frequency of the oscillation, rad/s
    zeta : its damping ratio, 0 <= zeta < 1
    sample_time : s

    Raises
    ------
    ConfigurationError
        If ``x`` is not a vector of numbers, or another value is out of its range.
    """
    command, omega_n = finite_vector("x", x), positive("omega_n", omega_n, "rad/s")
    if not 0 <= zeta < 1:
        raise ConfigurationError(f"zeta is {zeta!r}; it must be at least 0 and below 1.")
    root = np.sqrt(1 - zeta**2)
    later = np.pi / (omega_n * root) / positive("sample_time", sample_time, "s")
    left = np.exp(-np.pi * zeta / root)  # of a swing, after half a period
    samples = np.arange(command.size)
    delayed = np.interp(samples - later, samples, command)
    return np.asarray((command + left * delayed) / (1 + left))


def _times(t: Any) -> Vector:
    return finite_vector("t, the sample times in s,", t)


def _sample_time(time: Vector) -> float:
    """Spacing of an evenly spaced time axis, s."""
    spacing = np.diff(time)
    if spacing.size == 0 or spacing.min() <= 0 or np.ptp(spacing) > 1e-3 * spacing.min():
        raise ConfigurationError("t must be two or more evenly increasing sample times, in s; see time_axis.")
    return float((time[-1] - time[0]) / spacing.size)
