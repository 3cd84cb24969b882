"""Checks of figures, by their curves and labels."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotflex.courseware.json_values import thin
from rotflex.courseware.kinds.recordings import Sampled
from rotflex.courseware.messages import _
from rotflex.courseware.parts import Part
from rotflex.instructor.marking.checks import misfit
from rotflex.instructor.verdicts import Case, Verdict, follow_through, for_a_person, partly, right, wrong
from rotflex.units import DEG

Vector = NDArray[np.float64]
Samples = tuple[Vector, Vector]  # times (s) and values

_WHOSE = {right: "", follow_through: " It is that of your own recording, which is not what your bench gives."}
_HALF = 0.5  # of the points, for what is right but for its labels or its height
_LONGEST_SAMPLE_TIME = 1.0  # s
_FEWEST_POINTS = 20  # of a curve; what has fewer is a mark
_MOST_CURVES = 12  # looked at in a figure
#: How units are written, after TeX is out of the way: in brackets, after a comma or a solidus, or after "in".
_UNIT = r"(?:[(\[,]\s*|/\s*|\bin\s+)(?:{})(?![a-z])"
SECONDS, _HERTZ = "s|sec|secs|seconds?", "hz|hertz|1/s"
DEGREES, RADIANS = "deg|degs|degrees?|°", "rad|rads|radians?"
#: The units that an angle may be drawn in: name → (how it is written, times what of the SI unit).
ANGLE = {"deg": (DEGREES, 1 / DEG), "rad": (RADIANS, 1.0)}


@dataclass(frozen=True)
class FigureFollows:
    """A figure with a curve that follows a channel of a recording over time, with units.

    Parameters
    ----------
    recording : of the student's own bench
    own : (question, part) of the student's own recording, which is just as good to plot
    channel : which
    rtol : largest RMS difference, relative
    units : that the channel may be drawn in: name → (regular expression for its symbol, times what of the SI unit)
    largest : in the channel's SI unit; what is larger in the student's own recording is from no bench
    """

    recording: Callable[[Any], Sampled]
    own: tuple[str, str]
    channel: str
    rtol: float = 0.1
    units: Mapping[str, tuple[str, float]] = field(default_factory=lambda: ANGLE)
    largest: float = 10.0
    kinds = ("figure",)

    def verdict(self, part: Part, value: Any, case: Case) -> Verdict:
        """Look for a curve that follows, then at the labels of its axes."""
        if not case.virtual:
            return for_a_person(_("It does not come from the virtual bench; a person will look at it."))
        expected = self.recording(case.bench)
        own = own_samples(case, self.own, self.channel, self.largest)
        for samples, verdict in ((_samples(expected, self.channel), right), (own, follow_through)):
            found = samples and self._curve(value, samples)
            if found:
                axis, unit = found
                missing = [] if has_unit(axis["xlabel"], SECONDS) else [_("the horizontal axis lacks its unit, s")]
                if not has_unit(axis["ylabel"], self.units[unit][0]):
                    missing.append(
                        _("the vertical axis lacks its unit, {unit}, or has another one than the curve").format(
                            unit=unit
                        )
                    )
                if missing:
                    return partly(
                        _HALF, _("The curve is there, but {missing}.").format(missing=_(" and ").join(missing))
                    )
                return verdict(
                    _("A curve of {channel} over time, with units.{whose}").format(
                        channel=self.channel, whose=_WHOSE[verdict]
                    )
                )
        return wrong(
            _("No curve in the figure follows {channel} over the whole of the recording.").format(channel=self.channel)
        )

    def _curve(self, figure: dict[str, Any], samples: Samples) -> tuple[dict[str, Any], str] | None:
        """The axes on which a curve follows the samples, and the unit it is drawn in."""
        time, values = samples
        for axis, x, y in curves(figure):
            if np.ptp(x) < 0.8 * (time[-1] - time[0]):
                continue
            wanted = _interpolated(x, time, values)
            for unit, (_pattern, scale) in self.units.items():
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
    channel : which
    band : Hz, in which the peak is sought
    peak_rtol : tolerance of where the peak is, relative
    rtol : largest RMS difference in shape, relative
    largest : in the channel's SI unit; what is larger in the student's own recording is from no bench
    """

    recording: Callable[[Any], Sampled]
    own: tuple[str, str]
    channel: str
    band: tuple[float, float]
    peak_rtol: float = 0.05
    rtol: float = 0.15
    largest: float = 10.0
    kinds = ("figure",)

    def verdict(self, part: Part, value: Any, case: Case) -> Verdict:
        """Look for a curve with the right peak, then at the label of its frequency axis."""
        if not case.virtual:
            return for_a_person(_("It does not come from the virtual bench; a person will look at it."))
        expected = self.recording(case.bench)
        own = own_samples(case, self.own, self.channel, self.largest)
        for samples, verdict in ((_samples(expected, self.channel), right), (own, follow_through)):
            axis = samples and self._axis(value, samples)
            if axis:
                if not has_unit(axis["xlabel"], _HERTZ):
                    return partly(_HALF, _("The spectrum is there, but the horizontal axis lacks its unit, Hz."))
                if not axis["ylabel"]:
                    return partly(_HALF, _("The spectrum is there, but the vertical axis has no label."))
                return verdict(
                    _("A spectrum with its peak in the right place, in Hz.{whose}").format(whose=_WHOSE[verdict])
                )
        return wrong(_("No curve in the figure has its peak, in Hz, where the spectrum of your recording has it."))

    def _axis(self, figure: dict[str, Any], samples: Samples) -> dict[str, Any] | None:
        """The axes on which a curve is the spectrum of the samples."""
        time, values = samples
        grid = np.arange(*self.band, 0.01)
        peak = grid[np.argmax(amplitude_spectrum(grid, time, values))]
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
            wanted, given = amplitude_spectrum(x[swinging], time, values), y[swinging]
            scale = (given @ wanted) / (wanted @ wanted)
            if scale > 0 and misfit(given, scale * wanted) <= self.rtol:
                return axis
        return None


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


def _samples(recording: Sampled, channel: str) -> Samples:
    values = recording.channels[channel].values
    return np.arange(values.size, dtype=np.float64) * recording.sample_time, values


def own_samples(case: Case, where: tuple[str, str], channel: str, largest: float) -> Samples | None:
    """Times and values of a channel of the student's own recording, as far as they are kept; None if it can be none."""
    try:
        recording = case.own(*where)
    except LookupError:
        return None
    values = recording["channels"][channel]["values"]
    if np.abs(values).max() > largest or recording["sample_time"] > _LONGEST_SAMPLE_TIME:
        return None
    return thin(recording["n"], values.size) * recording["sample_time"], values


def _interpolated(at: Vector, time: Vector, values: Vector) -> Vector:
    from scipy.interpolate import CubicSpline

    return np.asarray(CubicSpline(time, values)(np.clip(at, time[0], time[-1])))


def amplitude_spectrum(f: Vector, time: Vector, values: Vector) -> Vector:
    """Amplitude at any frequencies (Hz) by the Fourier sum; an FFT, padded or not, gives samples of just this."""
    swinging = values - values.mean()
    return np.array([2 * abs(np.exp(-2j * np.pi * one * time) @ swinging) / time.size for one in f.tolist()])


def has_unit(label: str, unit: str) -> bool:
    plain = re.sub(r"\\circ\b", "°", label)
    plain = re.sub(r"\\(?:mathrm|mathit|text|rm|,|;|:)\s*|[${}^~]", "", plain).lower()
    return re.search(_UNIT.format(unit), plain) is not None
