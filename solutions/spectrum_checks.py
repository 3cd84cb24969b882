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

    Peaks are compared, so that any method will do that shows a sine where it is: with zeros appended or not, with the
    last bin or not. Heights are compared where the sines are on bins; between bins they depend on the method.

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
            on_bins = x.size & (x.size - 1) == 0
            for place, height in _three_peaks(x, dt):
                found = _peak_near(f, amplitude, place)
                if found is None or abs(found[0] - place) > 1 / (x.size * dt):
                    return wrong("Called with a sum of sines, it has no peaks at their frequencies (in Hz).")
                if on_bins:
                    heights.append((found[1] / height, x.size))
        ratio = np.array([ratio for ratio, _size in heights])
        samples = np.array([size for _ratio, size in heights])
        if self._all_near(ratio, 1.0):
            return right("Sines show at their frequencies, as high as their amplitudes.")
        places = "Sines show at their frequencies"
        for factor, hint in (
            (0.5, "half as high as they should: the other half is at the negative frequencies"),
            (samples, "too high by the number of samples"),
            (samples / 2, "too high by half the number of samples: divide by it"),
        ):
            if self._all_near(ratio / factor, 1.0):
                return partly(_HALF, f"{places}, but {hint}.")
        if self._all_near(ratio, float(np.median(ratio))):
            return partly(_HALF, f"{places}, but all too high or too low by the same factor.")
        return partly(_HALF, f"{places}, but their heights are not their amplitudes.")

    def _all_near(self, ratio: Vector, target: float) -> bool:
        return bool(np.all(np.abs(ratio - target) <= self.rtol * abs(target)))


def _three_peaks(x: Vector, dt: float) -> list[tuple[float, float]]:
    """Places (Hz) and heights of the sines in a probe's signal, which are more than 1 Hz apart."""
    f, amplitude = np.fft.rfftfreq(x.size, dt), 2 * np.abs(np.fft.rfft(x)) / x.size
    remaining = np.where((f > 0.5) & (f < 10), amplitude, 0.0)
    peaks = []
    for _time in range(3):
        top = int(np.argmax(remaining))
        peaks.append((float(f[top]), float(amplitude[top])))
        remaining[np.abs(f - f[top]) < 0.5] = 0.0
    return peaks


def _peak_near(f: Vector, amplitude: Vector, place: float) -> tuple[float, float] | None:
    """Place and height of the highest point within half a hertz."""
    near = np.flatnonzero(np.abs(f - place) <= 0.5)
    if near.size < 3:
        return None
    top = near[np.argmax(amplitude[near])]
    return float(f[top]), float(amplitude[top])
