"""Answers 2.10 to 2.12, for instructors: the spectrum of the sweep, the natural frequency, the joint's stiffness.

The workbook's program calls |Y|/N, doubled, a power spectral density in V²/Hz. It is a single-sided *amplitude*
spectrum in the unit of the signal: a sine of amplitude a that falls on a frequency line gives a line of height a. Two
slips of it are mended: the line at 0 Hz, which has no twin at a negative frequency, is not doubled, and the frequencies
are those of the lines (the workbook's last one is at half the sampling frequency, where there is none, which stretches
them all by 1/(NFFT/2 − 1)).

What is read here is the frequency at which alpha is largest. It is the link's natural frequency only if the servo
follows the sweep; see :mod:`rotflex.identification`.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotflex.courseware.messages import _
from rotflex.errors import IdentificationError
from rotflex.identification import SWEEP_BAND, Estimate
from rotflex.units import HZ

Vector = NDArray[np.float64]


def amplitude_spectrum(x: ArrayLike, dt: float) -> tuple[Vector, Vector]:
    """Single-sided amplitude spectrum (Answer 2.10, Equation 2.24 and its program).

    Parameters
    ----------
    x : (N,) signal
    dt : sample time, s

    Returns
    -------
    f_hz, amplitude : (NFFT/2,) frequencies, Hz, and amplitudes in the unit of ``x``. NFFT is the next power of two: the
        signal is filled up with zeros, so that lines are 1/(NFFT dt) apart.

    Raises
    ------
    IdentificationError
        If ``x`` is not a vector of at least two finite numbers, or ``dt`` is not positive.
    """
    signal = np.asarray(x, dtype=float)
    if signal.ndim != 1 or signal.size < 2 or not np.isfinite(signal).all():
        raise IdentificationError(
            _("The signal must be a vector of at least two finite numbers; its shape is {shape}.").format(
                shape=signal.shape
            )
        )
    if not (math.isfinite(dt) and dt > 0):
        raise IdentificationError(_("The sample time is {dt!r}; it must be a positive number, in s.").format(dt=dt))
    n_fft = 2 ** math.ceil(math.log2(signal.size))
    amplitude = 2 * np.abs(np.fft.fft(signal, n_fft)[: n_fft // 2]) / signal.size
    amplitude[0] /= 2
    return np.arange(n_fft // 2) / (n_fft * dt), amplitude


def natural_frequency(f_hz: ArrayLike, amplitude: ArrayLike, band: tuple[float, float] = SWEEP_BAND) -> Estimate:
    """The frequency of the highest line (Answer 2.11).

    Parameters
    ----------
    f_hz, amplitude : (n,) spectrum, by :func:`amplitude_spectrum`
    band : Hz, to look in; what the sweep went through

    Returns
    -------
    Estimate
        rad/s. The peak may be anywhere within half a line of the line that was read: a uniform distribution, whose
        standard uncertainty is the distance between lines over sqrt(12). (The length of the record, friction and a
        servo that gives way are not in it.)

    Raises
    ------
    IdentificationError
        If the two are no spectrum, or its largest value in the band is at the band's edge.
    """
    f, height = np.asarray(f_hz, dtype=float), np.asarray(amplitude, dtype=float)
    if f.ndim != 1 or f.shape != height.shape or f.size < 3 or not (np.diff(f) > 0).all():
        raise IdentificationError(
            _(
                "A spectrum is two vectors of one length, frequencies rising; their shapes are {frequencies}, "
                "{heights}."
            ).format(frequencies=f.shape, heights=height.shape)
        )
    inside = np.flatnonzero((f >= band[0]) & (f <= band[1]))
    if inside.size < 3:
        raise IdentificationError(
            _(
                "The spectrum has {lines} lines between {low:g} and {high:g} Hz. Is f in Hz, and is the "
                "record long enough?"
            ).format(lines=inside.size, low=band[0], high=band[1])
        )
    peak = int(inside[np.argmax(height[inside])])
    if peak in (inside[0], inside[-1]):
        raise IdentificationError(
            _(
                "There is no peak between {low:g} and {high:g} Hz: the spectrum is largest at its edge, "
                "{peak:.3g} Hz. Look at it over a wider band."
            ).format(low=band[0], high=band[1], peak=f[peak])
        )
    spacing = (f[peak + 1] - f[peak - 1]) / 2
    return Estimate(float(f[peak]) * HZ, float(spacing) * HZ / math.sqrt(12))


def stiffness(J_l: float | Estimate, omega_n: float | Estimate) -> Estimate:
    """K_s = J_l ω_n² (Answer 2.12, from Equation 2.21), N·m/rad.

    Parameters
    ----------
    J_l : moment of inertia of the link, kg·m²
    omega_n : natural frequency, rad/s

    Returns
    -------
    Estimate
        The uncertainties of both, where given, propagated to first order: an error in ω_n counts twice.

    Raises
    ------
    IdentificationError
        If either is not positive.
    """
    inertia, frequency = (x if isinstance(x, Estimate) else Estimate(float(x), 0.0) for x in (J_l, omega_n))
    if not (inertia.value > 0 and frequency.value > 0):
        raise IdentificationError(
            _("J_l and omega_n must be positive; they are {inertia!r}, {frequency!r}.").format(
                inertia=inertia.value, frequency=frequency.value
            )
        )
    K_s = inertia.value * frequency.value**2
    relative = math.hypot(inertia.uncertainty / inertia.value, 2 * frequency.uncertainty / frequency.value)
    return Estimate(K_s, K_s * relative)
