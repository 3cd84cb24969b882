"""The check of the spectrum function (question 2.10)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labcourse.answers.parts import Part
from labcourse.grading.verdicts import Case, Verdict, partly, right, wrong
from rotflex.course.probes import COMPOUND_SINES

Vector = NDArray[np.float64]
_HALF = 0.5  # of the points, for peaks in the right places whose heights are not


@dataclass(frozen=True)
class SpectrumFunction:
    """``spectrum(x, dt) -> (f_hz, amplitude)``, tried on sums of three sines (the probe "compound sines").

    Peaks are compared, so that any method will do that shows a sine where it is: with zeros appended or not, with a
    window or not, with the last bin or not. A value between bins is lower than the sine, by how much depends on the
    method: no lower than it is without a window at the same frequency, and no higher than the sine.

    Parameters
    ----------
    rtol : tolerance of the heights, relative
    """

    rtol: float = 0.05
    kinds = ("function",)

    def verdict(self, part: Part, value: Any, case: Case) -> Verdict:
        """Compare places and heights of the peaks."""
        heights = []
        for (x, dt), (f, amplitude) in zip(COMPOUND_SINES.inputs(case.probe_seed), value, strict=True):
            for place, height in _three_peaks(x, dt):
                found = _peak_near(f, amplitude, place)
                if found is None or abs(found[0] - place) > 1 / (x.size * dt):
                    return wrong("Called with a sum of sines, it has no peaks at their frequencies (in Hz).")
                here = [_height(x, dt, np.array([found[0]]), window).item() for window in (1.0, np.hanning(x.size))]
                heights.append((found[1], *here, height, x.size))
        found, plain, windowed, most, samples = np.transpose(heights)
        # A little of the other sines is in a spectrum without a window.
        low, high = (1 - self.rtol) * np.minimum(plain, windowed), (1 + self.rtol) * np.maximum(plain, most)

        def fit(factor: Vector | float) -> bool:
            return bool(np.all((low <= found / factor) & (found / factor <= high)))

        if fit(1.0):
            return right("Sines show at their frequencies, as high as their amplitudes.")
        places = "Sines show at their frequencies"
        for factor, hint in (
            (0.5, "half as high as they should: the other half is at the negative frequencies"),
            (samples, "too high by the number of samples"),
            (samples / 2, "too high by half the number of samples: divide by it"),
            (
                samples / 2 ** np.ceil(np.log2(samples)),
                "too low where zeros are appended: divide by the number of samples without them",
            ),
        ):
            if fit(factor):
                return partly(_HALF, f"{places}, but {hint}.")
        if fit(float(np.median(found / plain))):
            return partly(_HALF, f"{places}, but all too high or too low by the same factor.")
        return partly(_HALF, f"{places}, but their heights are not their amplitudes.")


def _three_peaks(x: Vector, dt: float) -> list[tuple[float, float]]:
    """Places (Hz) and amplitudes of the sines in a probe's signal, which are more than 1 Hz apart."""
    # With this window, what a sine adds at another's place is less than 1 % of the smallest.
    f, window = np.fft.rfftfreq(x.size, dt), np.hanning(x.size)
    remaining = np.where((f > 0.5) & (f < 10), np.abs(np.fft.rfft(window * x)), 0.0)
    around = np.linspace(-0.5, 0.5, 21) * f[1]
    peaks = []
    for _time in range(3):
        place = float(f[np.argmax(remaining)])
        peaks.append((place, float(_height(x, dt, place + around, window).max())))
        remaining[np.abs(f - place) < 0.5] = 0.0
    return peaks


def _height(x: Vector, dt: float, f: Vector, window: Vector | float) -> Vector:
    """How high the amplitude spectrum of a signal is at frequencies (n,), Hz, be they bins or not."""
    window = window * np.ones(x.size)
    turning = np.exp(-2j * np.pi * dt * np.outer(f, np.arange(x.size)))
    return np.asarray(2 * np.abs(turning @ (window * x)) / window.sum())


def _peak_near(f: Vector, amplitude: Vector, place: float) -> tuple[float, float] | None:
    """Place and height of the highest point within half a hertz."""
    near = np.flatnonzero(np.abs(f - place) <= 0.5)
    if near.size < 3:
        return None
    top = near[np.argmax(amplitude[near])]
    return float(f[top]), float(amplitude[top])
