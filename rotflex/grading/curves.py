"""Checks of figures, by their curves and labels, and of the spectrum function."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotflex.grading.checks import Case, Verdict, follow_through, for_a_person, misfit, partly, right, wrong
from rotflex.grading.truth import TrueBench
from rotflex.recording import Recording
from rotflex.units import DEG
from rotflex.workbook.parts import Part
from rotflex.workbook.plain import thin
from rotflex.workbook.probes import inputs

Vector = NDArray[np.float64]
Samples = tuple[Vector, Vector]  # times (s) and values (rad)

_WHOSE = {right: "", follow_through: " It is that of your own recording, which is not what your bench gives."}
_HALF = 0.5  # of the points, for what is right but for its labels or its height
_LARGEST_ANGLE = 10.0  # rad
_LONGEST_SAMPLE_TIME = 1.0  # s
_FEWEST_POINTS = 20  # of a curve; what has fewer is a mark
_MOST_CURVES = 12  # looked at in a figure
#: How units are written, after TeX is out of the way: in brackets, after a comma or a solidus, or after "in".
_UNIT = r"(?:[(\[,]\s*|/\s*|\bin\s+)(?:{})(?![a-z])"
SECONDS, _HERTZ = "s|sec|secs|seconds?", "hz|hertz|1/s"
DEGREES, RADIANS = "deg|degs|degrees?|°", "rad|rads|radians?"


@dataclass(frozen=True)
class FigureFollows:
    """A figure with a curve that follows a channel of a recording over time, in degrees or radians, with units.

    Parameters
    ----------
    recording : of the student's own bench
    own : (question, part) of the student's own recording, which is just as good to plot
    channel : an angle
    rtol : largest RMS difference, relative
    """

    recording: Callable[[TrueBench], Recording]
    own: tuple[str, str]
    channel: str
    rtol: float = 0.1
    kinds = ("figure",)

    def verdict(self, part: Part, value: Any, case: Case) -> Verdict:
        """Look for a curve that follows, then at the labels of its axes."""
        if not case.virtual:
            return for_a_person("It does not come from the virtual bench; a person will look at it.")
        expected = self.recording(case.bench)
        own = _own_samples(case, self.own, self.channel)
        for samples, verdict in (((expected.time, expected[self.channel]), right), (own, follow_through)):
            found = samples and self._curve(value, samples)
            if found:
                axis, unit = found
                missing = [] if has_unit(axis["xlabel"], SECONDS) else ["the horizontal axis lacks its unit, s"]
                if not has_unit(axis["ylabel"], DEGREES if unit == "deg" else RADIANS):
                    missing.append(f"the vertical axis lacks its unit, {unit}, or has another one than the curve")
                if missing:
                    return partly(_HALF, f"The curve is there, but {' and '.join(missing)}.")
                return verdict(f"A curve of {self.channel} over time, with units.{_WHOSE[verdict]}")
        return wrong(f"No curve in the figure follows {self.channel} over the whole of the recording.")

    def _curve(self, figure: dict[str, Any], samples: Samples) -> tuple[dict[str, Any], str] | None:
        """The axes on which a curve follows the samples, and the unit it is drawn in."""
        time, angle = samples
        for axis, x, y in curves(figure):
            if np.ptp(x) < 0.8 * (time[-1] - time[0]):
                continue
            wanted = _interpolated(x, time, angle)
            for unit, scale in (("deg", 1 / DEG), ("rad", 1.0)):
                if misfit(y, scale * wanted) <= self.rtol:
                    return axis, unit
        return None


@dataclass(frozen=True)
class FigureOfSpectrum:
    """A figure with the amplitude spectrum of a channel of a recording against frequency in Hz, with its unit.

    Any scale of the amplitude will do, and any padding: a curve passes by its shape, or by where its peak is.

    Parameters
    ----------
    recording : of the student's own bench
    own : (question, part) of the student's own recording, whose spectrum is just as good
    channel : an angle
    band : Hz, in which the peak is sought
    peak_rtol : tolerance of where the peak is, relative
    rtol : largest RMS difference in shape, relative
    """

    recording: Callable[[TrueBench], Recording]
    own: tuple[str, str]
    channel: str
    band: tuple[float, float]
    peak_rtol: float = 0.05
    rtol: float = 0.15
    kinds = ("figure",)

    def verdict(self, part: Part, value: Any, case: Case) -> Verdict:
        """Look for a curve with the right peak, then at the label of its frequency axis."""
        if not case.virtual:
            return for_a_person("It does not come from the virtual bench; a person will look at it.")
        expected = self.recording(case.bench)
        own = _own_samples(case, self.own, self.channel)
        for samples, verdict in (((expected.time, expected[self.channel]), right), (own, follow_through)):
            axis = samples and self._axis(value, samples)
            if axis:
                if not has_unit(axis["xlabel"], _HERTZ):
                    return partly(_HALF, "The spectrum is there, but the horizontal axis lacks its unit, Hz.")
                if not axis["ylabel"]:
                    return partly(_HALF, "The spectrum is there, but the vertical axis has no label.")
                return verdict(f"A spectrum with its peak in the right place, in Hz.{_WHOSE[verdict]}")
        return wrong("No curve in the figure has its peak, in Hz, where the spectrum of your recording has it.")

    def _axis(self, figure: dict[str, Any], samples: Samples) -> dict[str, Any] | None:
        """The axes on which a curve is the spectrum of the samples."""
        time, angle = samples
        grid = np.arange(*self.band, 0.01)
        peak = grid[np.argmax(_amplitude(grid, time, angle))]
        bin_width = 1 / (time[-1] - time[0])
        near = max(bin_width, self.peak_rtol * peak)  # a window, say, moves the peak a little
        for axis, x, y in curves(figure):
            swept = (x >= self.band[0]) & (x <= self.band[1])
            if swept.sum() < 3 or y.min() < 0:
                continue
            f, amplitude = x[swept], y[swept]
            fine = np.diff(np.sort(f)).max() <= 2 * bin_width
            if fine and abs(f[np.argmax(amplitude)] - peak) <= near:
                return axis
            # Of a curve far beyond the band, few points are kept in it: compare the shape of all of it, as far as
            # the samples tell (the student's own recording is thinned out).
            swinging = (x >= self.band[0] / 2) & (x <= time.size * bin_width / 2)
            wanted, given = _amplitude(x[swinging], time, angle), y[swinging]
            scale = (given @ wanted) / (wanted @ wanted)
            if scale > 0 and misfit(given, scale * wanted) <= self.rtol:
                return axis
        return None


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
        for (x, dt), (f, amplitude) in zip(inputs(part.probe, case.probe_seed), value, strict=True):
            on_bins = x.size & (x.size - 1) == 0
            for place, height in _three_peaks(x, dt):
                found = _peak_near(f, amplitude, place)
                if found is None or abs(found[0] - place) > 1 / (x.size * dt):
                    return wrong("Called with a sum of sines, it has no peaks at their frequencies (in Hz).")
                if on_bins:
                    heights.append((found[1] / height, x.size))
        ratio = np.array([ratio for ratio, _ in heights])
        samples = np.array([size for _, size in heights])
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


# --- curves -----------------------------------------------------------------------------------------------------------


def curves(figure: dict[str, Any]) -> Iterator[tuple[dict[str, Any], Vector, Vector]]:
    """The curves of a figure with the axes that they are on."""
    found = [
        (axis, line["x"], line["y"])
        for axis in figure["axes"]
        for line in axis["lines"]
        if line["x"].size >= _FEWEST_POINTS
    ]
    return iter(found[:_MOST_CURVES])


def _own_samples(case: Case, where: tuple[str, str], channel: str) -> Samples | None:
    """Times and values of a channel of the student's own recording, as far as they are kept; None if it can be none."""
    try:
        recording = case.own(*where)
    except LookupError:
        return None
    values = recording["channels"][channel]["values"]
    if np.abs(values).max() > _LARGEST_ANGLE or recording["sample_time"] > _LONGEST_SAMPLE_TIME:
        return None
    return thin(recording["n"], values.size) * recording["sample_time"], values


def _interpolated(at: Vector, time: Vector, values: Vector) -> Vector:
    from scipy.interpolate import CubicSpline

    return np.asarray(CubicSpline(time, values)(np.clip(at, time[0], time[-1])))


def _amplitude(f: Vector, time: Vector, values: Vector) -> Vector:
    """Amplitude at any frequencies (Hz) by the Fourier sum; an FFT, padded or not, gives samples of just this."""
    swinging = values - values.mean()
    return np.array([2 * abs(np.exp(-2j * np.pi * one * time) @ swinging) / time.size for one in f.tolist()])


def _three_peaks(x: Vector, dt: float) -> list[tuple[float, float]]:
    """Places (Hz) and heights of the sines in a probe's signal, which are more than 1 Hz apart."""
    f, amplitude = np.fft.rfftfreq(x.size, dt), 2 * np.abs(np.fft.rfft(x)) / x.size
    remaining = np.where((f > 0.5) & (f < 10), amplitude, 0.0)
    peaks = []
    for _ in range(3):
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


def has_unit(label: str, unit: str) -> bool:
    plain = re.sub(r"\\circ\b", "°", label)
    plain = re.sub(r"\\(?:mathrm|mathit|text|rm|,|;|:)\s*|[${}^~]", "", plain).lower()
    return re.search(_UNIT.format(unit), plain) is not None
