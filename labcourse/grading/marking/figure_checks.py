"""Checks of figures, by their curves and the units that their axes name."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from labcourse.answers.forms import Sampled
from labcourse.answers.parts import Part
from labcourse.grading import verdicts
from labcourse.grading.marking import curves
from labcourse.grading.marking.checks import misfit, of_unknown_bench
from labcourse.grading.marking.curves import HALF, Curve, Reading, Trace, Vector, Wanted
from labcourse.grading.marking.units import Quantity
from labcourse.grading.verdicts import Case, Verdict

_SHORTEST = 0.5  # of the recording, over which a curve should follow
_PADDING = 64  # factor of the length before the FFT: then it can be interpolated linearly
_FEWEST_POINTS = 10  # of a curve of a spectrum, which may show its peak alone
_LEAST_DECIBELS = 20.0  # swing of a curve in dB with a label that does not say so: one with less is not in dB
_VARIES = 0.5  # least swing of the shown piece of a spectrum, relative to its height: a flat piece fits anything


@dataclass(frozen=True)
class _FigureOfChannel:
    """The common part of the checks of figures; :class:`FigureFollows` documents the parameters."""

    recording: Callable[[Any], Sampled]
    own: tuple[str, str]
    channel: str
    largest: float = field(default=10.0, kw_only=True)
    kinds = ("figure",)

    def verdict(self, part: Part, value: Any, case: Case) -> Verdict:
        """Judge a figure; leave it to a person if the truth of the bench is not known."""
        if not case.truth_is_known:
            return of_unknown_bench(case)
        return self._judge(value, case)

    def _judge(self, figure: dict[str, Any], case: Case) -> Verdict:
        """Return the verdict on a figure, given that the truth of the bench is known."""
        raise NotImplementedError

    def _traces(self, case: Case) -> Iterator[tuple[Trace, Callable[[str], Verdict], str]]:
        """Yield the channels that a figure may show: the bench's, then that of the student's own recording, if usable.

        Each comes with the function that makes the verdict on a curve that shows it, and a note to add to the reason.
        """
        expected = self.recording(case.bench)
        values = expected.channels[self.channel].values
        yield Trace(np.arange(values.size, dtype=np.float64) * expected.sample_time, values), verdicts.right, ""
        trace = curves.own_trace(case, self.own, self.channel, self.largest)
        if trace is not None:
            note = f" It is that of your own recording, which is not what your {case.bench_word} gives."
            yield trace, verdicts.follow_through, note


@dataclass(frozen=True)
class FigureFollows(_FigureOfChannel):
    """A figure with a curve that follows a channel over time, over half of the recording or more, with units.

    Parameters
    ----------
    recording : of the student's own bench
    own : (question, part) of the student's own recording, which may be plotted as well
    channel : name of the channel
    quantity : of the channel (:mod:`labcourse.grading.marking.units`); it may be drawn in any of its units
    rtol : largest misfit in shape (:func:`.checks.misfit`)
    largest : in the channel's SI unit; what is larger in the student's own recording is from no bench
    """

    quantity: Quantity
    rtol: float = 0.1

    def _judge(self, figure: dict[str, Any], case: Case) -> Verdict:
        """Look for a curve that follows the channel, then check the labels of its axes."""
        lacking = ""
        for trace, verdict, note in self._traces(case):
            wanted = Wanted(trace, self.quantity, self.rtol, _SHORTEST * trace.duration)
            match = curves.best_match(curves.find_matches(figure, wanted))
            if match is None:
                continue
            if match.faults and not match.lacking:
                return verdicts.partly(HALF, f"The curve is there, but {' and '.join(match.faults)}.")
            if not match.lacking:
                return verdict(f"A curve of {self.channel} over time, with units.{note}")
            lacking = lacking or f" ({match.lacking})"
        return verdicts.wrong(
            f"No curve in the figure follows {self.channel} over half of the recording or more{lacking}. Plot "
            f"the recording of your {case.bench_word} against its time."
        )


@dataclass(frozen=True)
class FigureOfSpectrum(_FigureOfChannel):
    """A figure with the amplitude spectrum of a channel of a recording against frequency, with its unit.

    Any scale of the amplitude will do, and any padding: a curve passes by its shape, or by where its peak is.

    Parameters
    ----------
    recording : of the student's own bench
    own : (question, part) of the student's own recording; its spectrum may be plotted as well
    channel : name of the channel
    frequency : the units of the horizontal axis, 1 Hz being the SI unit
    band : Hz, in which the peak is sought
    peak_rtol : tolerance of where the peak is, relative
    rtol : largest misfit in shape (:func:`.checks.misfit`), to any scale
    largest : in the channel's SI unit; what is larger in the student's own recording is from no bench
    """

    frequency: Quantity
    band: tuple[float, float]
    peak_rtol: float = 0.05
    rtol: float = 0.15

    def _judge(self, figure: dict[str, Any], case: Case) -> Verdict:
        """Look for a curve with the right peak, then check the labels of its axes."""
        elsewhere = ""
        for trace, verdict, note in self._traces(case):
            spectra = sorted(self._readings(figure, trace), key=lambda m: (bool(m[1].fault), m[1].says_another))
            if not spectra:
                continue
            curve, reading, in_decibels = spectra[0]
            if reading.says_another:  # its peak is not where the axis says that it is
                elsewhere = elsewhere or f" ({reading.fault})"
                continue
            if reading.fault:
                return verdicts.partly(HALF, f"The spectrum is there, but {reading.fault}.")
            if not curve.axis["ylabel"]:
                return verdicts.partly(HALF, "The spectrum is there, but the vertical axis has no label.")
            if in_decibels and "db" not in curve.axis["ylabel"].lower():
                return verdicts.partly(HALF, "The spectrum is there, but the vertical axis lacks its unit: write dB.")
            return verdict(f"A spectrum with its peak in the right place.{note}")
        return verdicts.wrong(
            f"No curve in the figure has its peak where the spectrum of your recording has it{elsewhere}. Plot "
            "the amplitude against frequency, its peak in sight."
        )

    def _readings(self, figure: dict[str, Any], trace: Trace) -> Iterator[tuple[Curve, Reading, bool]]:
        """Yield the curves that are the spectrum, each with the unit of its frequency axis, and whether it is in dB.

        A curve comes once for each unit in which it may be read.
        """
        spectrum = _Spectrum(trace)
        peak = spectrum.peak(self.band)
        if peak is None:
            return
        for curve in curves.curves_of(figure, _FEWEST_POINTS):
            for reading in curves.readings(curve.axis["xlabel"], self.frequency, "horizontal"):
                f = reading.unit.size * curve.x
                for amplitude, in_decibels in _amplitudes(curve):
                    if f.min() <= peak <= f.max() and self._is_spectrum(f, amplitude, spectrum, peak):
                        yield curve, reading, in_decibels

    def _is_spectrum(self, f: Vector, amplitude: Vector, spectrum: _Spectrum, peak: float) -> bool:
        """Return whether a curve is the spectrum of a channel, by its peak or by its shape.

        Parameters
        ----------
        f, amplitude : (n,) the curve, Hz and any scale
        spectrum : what it should be
        peak : frequency of the spectrum's peak in the band, Hz
        """
        in_band = (f >= self.band[0]) & (f <= self.band[1])
        if np.unique(f[in_band]).size < 3:
            return False
        near = max(spectrum.bin_width, self.peak_rtol * peak)  # a window function, for example, moves the peak a little
        fine = np.diff(np.sort(f[in_band])).max() <= 2 * spectrum.bin_width
        if fine and _has_peak_near(f[in_band], amplitude[in_band], peak, near):
            return True
        # A curve far beyond the band has few stored points in it: compare the shape of the whole curve, up to the
        # highest frequency that the samples show (the student's own recording is thinned out).
        swinging = (f >= self.band[0] / 2) & (f <= spectrum.fastest)
        wanted, given = spectrum.at(f[swinging]), amplitude[swinging]
        if np.ptp(wanted) < _VARIES * wanted.max():  # anything flat has the shape of a small piece
            return False
        scale = (given @ wanted) / (wanted @ wanted)
        return bool(scale > 0 and misfit(given, scale * wanted) <= self.rtol)


def _has_peak_near(f: Vector, amplitude: Vector, peak: float, near: float) -> bool:
    """Return whether a curve is highest within ``near`` (Hz) of a frequency (Hz), and lower on both sides."""
    top = np.argmax(amplitude)
    lower = f[amplitude < amplitude[top]]
    return bool(abs(f[top] - peak) <= near and lower.size and lower.min() < f[top] < lower.max())


class _Spectrum:
    """Amplitudes of a channel at any frequency; an FFT of it, padded or not, gives samples of this.

    Attributes
    ----------
    bin_width : resolution of an FFT without padding, Hz
    fastest : highest frequency that the given samples show, Hz
    """

    def __init__(self, trace: Trace) -> None:
        swinging = trace.values - trace.values.mean()
        size = 2 ** (_PADDING * swinging.size).bit_length()
        self._f = np.fft.rfftfreq(size, trace.step)
        self._amplitude = 2 * np.abs(np.fft.rfft(swinging, size)) / swinging.size
        self.bin_width = 1 / trace.duration
        self.fastest = trace.sample_count * self.bin_width / 2

    def at(self, f: Vector) -> Vector:
        """Return the amplitudes at frequencies (Hz)."""
        return np.asarray(np.interp(f, self._f, self._amplitude))

    def peak(self, band: tuple[float, float]) -> float | None:
        """Return the frequency (Hz) of the highest point in a band (Hz); None if the samples do not reach the band."""
        within = (self._f >= band[0]) & (self._f <= band[1])
        return float(self._f[within][np.argmax(self._amplitude[within])]) if within.any() else None


def _amplitudes(curve: Curve) -> Iterator[tuple[Vector, bool]]:
    """Yield the amplitudes that a curve may show, to any scale, and whether they are in dB; nothing if none."""
    labelled = "db" in curve.axis["ylabel"].lower()
    if curve.y.min() >= 0 and not labelled:
        yield curve.y, False
    elif labelled or np.ptp(curve.y) >= _LEAST_DECIBELS:
        decibels_below_peak = curve.y - curve.y.max()
        yield 10 ** (decibels_below_peak / 20), True
