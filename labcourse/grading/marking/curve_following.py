"""Whether a curve follows a channel of a recording over time, and from where its time is counted."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labcourse.grading.marking.checks import misfit

Vector = NDArray[np.float64]
FEWEST_POINTS = 20  # of a curve; what has fewer is a mark
SMALLEST_SWING = 0.25  # of the channel's, from its lowest value to its highest: with less, nothing happens in it
ENOUGH = 0.98  # of the time that is asked for: the last sample is one before its end
_MOST_CURVES = 48  # looked at in a figure
_MOST_SAMPLES = 16384  # of a trace
_NOTHING = 1e-3  # of a channel's variance: a window with less is flat
_REFINED = np.linspace(-1, 1, 5)  # samples, about the best whole one


@dataclass(frozen=True)
class Curve:
    """Points of a figure, with the axes that they are on, and which of the figure's lines they are of."""

    axis: dict[str, Any]
    x: Vector
    y: Vector
    lines: frozenset[tuple[int, int]]


def curves(figure: dict[str, Any], fewest: int = FEWEST_POINTS) -> list[Curve]:
    """The lines of a figure that have so many points; of very many lines, those with most points."""
    found = [
        Curve(axis, line["x"], line["y"], frozenset([(row, place)]))
        for row, axis in enumerate(figure["axes"])
        for place, line in enumerate(axis["lines"])
        if line["x"].size >= fewest
    ]
    return sorted(found, key=lambda curve: -curve.x.size)[:_MOST_CURVES]


class Trace:
    """A channel of a recording, on an even grid from time 0.

    Parameters
    ----------
    time, values : (n,) samples, time (s) rising
    n : samples of the whole recording, of which these may be some
    smooth : whether the channel has no jumps, so that a spline leads from sample to sample

    Attributes
    ----------
    step : of the grid, s
    kept : samples that were given
    """

    def __init__(self, time: Vector, values: Vector, n: int | None = None, smooth: bool = True) -> None:
        from scipy.interpolate import CubicSpline

        self.time, self.values = time, values
        if n is not None and n > time.size:
            self.time = np.linspace(0, time[-1], min(n, _MOST_SAMPLES))
            self.values = CubicSpline(time, values)(self.time) if smooth else np.interp(self.time, time, values)
        self.kept = time.size
        self.step = float(self.time[-1]) / (self.time.size - 1)

    @property
    def duration(self) -> float:
        """Of the recording, s."""
        return float(self.time[-1])

    @property
    def swing(self) -> float:
        """From its lowest value to its highest."""
        return float(np.ptp(self.values))

    def inside(self, x: Vector, shift: float) -> NDArray[np.bool_]:
        """Which times, counted from ``shift``, are within the recording."""
        at = x + shift
        return (at >= -self.step) & (at <= self.duration + self.step)

    def misfit(self, x: Vector, y: Vector, shift: float = 0.0) -> float:
        """RMS difference of a curve (s and the channel's unit) over the recording, relative; inf if too little is."""
        within = self.inside(x, shift)
        if within.sum() < FEWEST_POINTS:
            return math.inf
        with np.errstate(all="ignore"):  # of numbers that nothing follows, and of a channel that is flat there
            return misfit(y[within], self._at(x[within] + shift))

    def near(self, x: Vector, y: Vector, rtol: float) -> bool:
        """Whether a piece of a curve, however short, is on the channel, its RMS difference relative to all of that."""
        difference = y - self._at(x)
        return bool(self.inside(x, 0.0).all() and np.mean(difference**2) <= rtol**2 * self.values.var())

    def shows(self, x: Vector, shift: float) -> tuple[float, float]:
        """How long (s) a curve runs over the recording, and what share of the channel's swing is in that."""
        seen = x[self.inside(x, shift)]
        return float(np.ptp(seen)), float(np.ptp(self._at(seen + shift))) / self.swing

    def best_shift(self, x: Vector, y: Vector) -> float | None:
        """The time (s) at which a curve's time is 0, if it follows anywhere; None if it is longer.

        The misfit is computed for all whole samples at once: the recording is correlated with a comb of the points.
        """
        if not np.ptp(x) <= self.duration + self.step:
            return None
        places = np.round((x - x.min()) / self.step).astype(np.intp)
        count = self.values.size - int(places.max())  # of shifts, in whole samples
        if count < 1:
            return float(-x.min())
        comb, heights = np.bincount(places, minlength=1), np.bincount(places, weights=y - y.mean())
        size, of_values, of_squares = self._spectra
        about = np.fft.rfft(comb, size).conj()
        sums, squares = (np.fft.irfft(of * about, size)[:count] for of in (of_values, of_squares))
        products = np.fft.irfft(of_values * np.fft.rfft(heights, size).conj(), size)[:count]
        spread = squares - sums**2 / x.size
        something = spread > _NOTHING * x.size * self.values.var()
        ratio = np.full(count, math.inf)
        np.divide((y - y.mean()) @ (y - y.mean()) - 2 * products + spread, spread, out=ratio, where=something)
        best = float(np.argmin(np.where(np.isnan(ratio), math.inf, ratio)) * self.step - x.min())
        near: list[float] = [best + part * self.step for part in _REFINED.tolist()]
        return min(near, key=lambda shift: self.misfit(x, y, shift))

    @cached_property
    def _spectra(self) -> tuple[int, NDArray[np.complex128], NDArray[np.complex128]]:
        """A length with room for a correlation, and the transforms of the values and of their squares."""
        size = 2 ** (2 * self.values.size - 1).bit_length()
        swinging = self.values - self.values.mean()
        return size, np.fft.rfft(swinging, size), np.fft.rfft(swinging**2, size)

    def _at(self, time: Vector) -> Vector:
        return np.interp(time, self.time, self.values)
