"""Find the curves of a figure that follow a channel of a recording over time, in the units that their axes name."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labcourse.answers.figures import unit_places
from labcourse.answers.json_values import thin
from labcourse.answers.units import Unit
from labcourse.grading.marking.checks import misfit
from labcourse.grading.marking.units import TIME, Quantity, units_in_label
from labcourse.grading.verdicts import Case

Vector = NDArray[np.float64]
HALF = 0.5  # of the points, for a curve with a fault in its labels or its height
FEWEST_POINTS = 20  # of a curve; with fewer it is a mark
SMALLEST_SWING = 0.25  # of the channel's, from its lowest value to its highest: with less, nothing happens in it
ENOUGH_TIME = 0.98  # of the time that is asked for: the last sample is one before its end
_FEWEST_OF_A_PIECE = 2
_MOST_CURVES = 48  # looked at in a figure
_MOST_SAMPLES = 16384  # of a trace
_FLAT = 1e-3  # of a channel's variance: a window with less is flat
_REFINEMENT = np.linspace(-1, 1, 5)  # samples, about the best whole one
_LIKELY_SWING = (0.1, 10.0)  # times the channel's swing: of a curve if its axis may have another unit than it says
_SAMPLE_TIMES = (1e-6, 86_400.0)  # s: a day
_SAME_STRETCH = 0.02  # of both, by which their ends may differ


@dataclass(frozen=True)
class Curve:
    """A curve of a figure.

    Attributes
    ----------
    axis : the axes that it is on, as decoded
    x, y : (n,) its points, in the units of the axes
    lines : lines of the figure that it consists of: (number of the axes, place on them)
    """

    axis: dict[str, Any]
    x: Vector
    y: Vector
    lines: frozenset[tuple[int, int]]


def curves_of(figure: dict[str, Any], fewest: int = FEWEST_POINTS) -> list[Curve]:
    """Return the lines of a figure with ``fewest`` points or more as curves; of very many, those with most points."""
    curves = [
        Curve(axis, line["x"], line["y"], frozenset([(row, place)]))
        for row, axis in enumerate(figure["axes"])
        for place, line in enumerate(axis["lines"])
        if line["x"].size >= fewest
    ]
    return sorted(curves, key=lambda curve: -curve.x.size)[:_MOST_CURVES]


class Trace:
    """A channel of a recording, on an even grid from time 0.

    Parameters
    ----------
    time, values : (n,) samples, time (s) rising
    n : number of samples of the whole recording, of which these may be some; None if these are all
    smooth : whether the channel has no jumps, so that a spline interpolates between its samples

    Attributes
    ----------
    step : of the grid, s
    sample_count : number of samples that were given
    duration : of the recording, s
    swing : from the lowest value to the highest, in the channel's unit
    """

    def __init__(self, time: Vector, values: Vector, n: int | None = None, smooth: bool = True) -> None:
        from scipy.interpolate import CubicSpline

        self.time, self.values = time, values
        if n is not None and n > time.size:
            self.time = np.linspace(0, time[-1], min(n, _MOST_SAMPLES))
            self.values = CubicSpline(time, values)(self.time) if smooth else np.interp(self.time, time, values)
        self.sample_count, self.duration, self.swing = time.size, float(self.time[-1]), float(np.ptp(self.values))
        self.step = self.duration / (self.time.size - 1)

    def is_covered(self, x: Vector, shift: float) -> NDArray[np.bool_]:
        """Return which of the times ``x`` lie in the recording if ``shift`` is added to them (both in s)."""
        time = x + shift
        return (time >= -self.step) & (time <= self.duration + self.step)

    def shape_misfit(self, x: Vector, y: Vector, shift: float = 0.0) -> float:
        """Return how much the shape of a curve differs from the channel, by :func:`.checks.misfit`.

        Parameters
        ----------
        x : (n,) times of the curve, s
        y : (n,) values of the curve, in the channel's unit
        shift : added to the times, s

        Returns
        -------
        float
            inf if fewer than :data:`FEWEST_POINTS` points lie in the recording, or the channel is flat there
        """
        within = self.is_covered(x, shift)
        if within.sum() < FEWEST_POINTS:
            return math.inf
        with np.errstate(all="ignore"):  # numbers may be as large as they come, and the channel may be flat there
            return misfit(y[within], self._value_at(x[within] + shift))

    def is_near(self, x: Vector, y: Vector, rtol: float) -> bool:
        """Return whether a piece of a curve is on the channel: all of it in the recording, at the channel's values.

        Its RMS difference must not be larger than ``rtol`` of the standard deviation of the whole channel.
        """
        difference = y - self._value_at(x)
        return bool(self.is_covered(x, 0.0).all() and np.mean(difference**2) <= rtol**2 * self.values.var())

    def shown_length_and_swing(self, x: Vector, shift: float) -> tuple[float, float]:
        """Return how long a curve is in the recording (s), and which share of the channel's swing it shows."""
        seen = x[self.is_covered(x, shift)]
        return float(np.ptp(seen)), float(np.ptp(self._value_at(seen + shift))) / self.swing

    def best_shift(self, x: Vector, y: Vector) -> float | None:
        """Return the shift (s) at which a curve fits the channel best; None if it is longer than the recording.

        For shifts by whole samples, the misfit is computed for all at once, as a correlation: the points of the curve,
        rounded to the grid, are a comb over which values, their squares and their products with y are summed.
        """
        if not np.ptp(x) <= self.duration + self.step:
            return None
        places = np.round((x - x.min()) / self.step).astype(np.intp)
        count = self.values.size - int(places.max())  # of shifts, in whole samples
        if count < 1:
            return float(-x.min())
        comb, heights = np.bincount(places, minlength=1), np.bincount(places, weights=y - y.mean())
        size, of_values, of_squares = self._spectra
        of_comb = np.fft.rfft(comb, size).conj()
        sums, squares = (np.fft.irfft(spectrum * of_comb, size)[:count] for spectrum in (of_values, of_squares))
        products = np.fft.irfft(of_values * np.fft.rfft(heights, size).conj(), size)[:count]
        spread = squares - sums**2 / x.size
        swinging = spread > _FLAT * x.size * self.values.var()
        ratio = np.full(count, math.inf)
        np.divide((y - y.mean()) @ (y - y.mean()) - 2 * products + spread, spread, out=ratio, where=swinging)
        best = float(np.argmin(np.where(np.isnan(ratio), math.inf, ratio)) * self.step - x.min())
        shifts: list[float] = [best + part * self.step for part in _REFINEMENT.tolist()]
        return min(shifts, key=lambda shift: self.shape_misfit(x, y, shift))

    @cached_property
    def _spectra(self) -> tuple[int, NDArray[np.complex128], NDArray[np.complex128]]:
        """A length with room for a correlation; FFTs of that length, of values less their mean, and their squares."""
        size = 2 ** (2 * self.values.size - 1).bit_length()
        swinging = self.values - self.values.mean()
        return size, np.fft.rfft(swinging, size), np.fft.rfft(swinging**2, size)

    def _value_at(self, time: Vector) -> Vector:
        """Return the channel's values at times (s)."""
        return np.interp(time, self.time, self.values)


# --- what a figure shows --------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Reading:
    """A unit that an axis may be in.

    Attributes
    ----------
    unit : the unit
    fault : what is wrong with the label if the axis is in this unit, as text; "" if the label names the unit
    says_another : whether the label names another unit
    """

    unit: Unit
    fault: str = ""
    says_another: bool = False


@dataclass(frozen=True)
class Wanted:
    """What a curve should follow: a channel, and how closely.

    Attributes
    ----------
    trace : the channel
    quantity : of the channel; its units are those in which it may be drawn
    rtol : largest misfit in shape (:func:`.checks.misfit`)
    shortest : shortest time over which the curve should follow, s
    """

    trace: Trace
    quantity: Quantity
    rtol: float
    shortest: float


@dataclass(frozen=True)
class Match:
    """A curve that follows the wanted channel.

    Attributes
    ----------
    curve : the curve
    shift : time in the recording at which the curve's time is zero, s
    misfit : misfit in shape (:func:`.checks.misfit`)
    faults : of its labels, as text; with them it earns half of the points
    lacking : why it earns nothing, as text; "" if it earns something
    """

    curve: Curve
    shift: float
    misfit: float
    faults: tuple[str, ...] = ()
    lacking: str = ""

    @property
    def share(self) -> float:
        """The share (0 to 1) of the points that it earns."""
        return 0.0 if self.lacking else HALF if self.faults else 1.0


def best_match(matches: Iterable[Match]) -> Match | None:
    """Return the match that earns most, and of equal ones that with fewest faults, then least misfit; or None."""
    return min(matches, key=lambda match: (-match.share, len(match.faults), match.misfit), default=None)


def own_trace(case: Case, where: tuple[str, str], channel: str, largest: float, smooth: bool = True) -> Trace | None:
    """Return a channel of the student's own recording, from its stored samples; None without a usable one.

    Parameters
    ----------
    case : with the student's own answers
    where : (question, part) of the recording
    channel : name of the channel
    largest : in the channel's SI unit; a recording with larger values is not usable
    smooth : as for :class:`Trace`
    """
    try:
        recording = case.own(*where)
        values = recording["channels"][channel]["values"]
    except LookupError:
        return None
    sampled = _SAMPLE_TIMES[0] <= recording["sample_time"] <= _SAMPLE_TIMES[1]
    if values.size < FEWEST_POINTS or np.abs(values).max() > largest or not sampled:
        return None
    time = thin(recording["n"], values.size) * recording["sample_time"]
    return Trace(time, values, recording["n"], smooth)


def readings(label: str, quantity: Quantity, which: str) -> tuple[Reading, ...]:
    """Return the units that an axis may be in: those that its label names, then other usual ones, each with a fault.

    Parameters
    ----------
    label : of the axis
    quantity : that is drawn along it
    which : axis, for messages: "horizontal" or "vertical"
    """
    labelled = units_in_label(label, quantity)
    names = ", ".join(unit.name for unit in labelled)
    what = "names no unit that is known for it" if unit_places(label) else "lacks its unit"
    lacking = f"the {which} axis {what}: write a symbol or an English word, such as {quantity.example}"
    result = [Reading(unit) for unit in labelled]
    for unit in quantity.usual:
        if not any(math.isclose(unit.size, other.size) for other in labelled):
            another = f"the {which} axis says {names}, and the curve is in {unit.name}: let one follow the other"
            result.append(Reading(unit, another if labelled else lacking, says_another=bool(labelled)))
    return tuple(result)


def find_matches(
    figure: dict[str, Any], wanted: Wanted, search: bool = True, origins: Sequence[tuple[Curve, float]] = ()
) -> list[Match]:
    """Find the curves of a figure that follow a channel, whole or in pieces.

    Parameters
    ----------
    figure : a decoded figure
    wanted : the channel, and how closely
    search : whether to look for curves with any shift in time; if not, the shift is 0
    origins : curves with known shifts (s): another curve over the same stretch of the axis has the same shift

    Returns
    -------
    list
        The curves that follow; some may lack what they need to earn anything.
    """
    if not wanted.trace.swing > 0:
        return []
    result = [seen for curve in curves_of(figure) if (seen := _match_curve(curve, wanted, search, origins))]
    for axis in figure["axes"]:
        pieces = [curve for curve in curves_of(figure, _FEWEST_OF_A_PIECE) if curve.axis is axis]
        if len(pieces) > 1 and not any(seen.share == 1 for seen in result if seen.curve.axis is axis):
            result += filter(None, [_match_pieces(pieces, wanted)])
    return result


def _match_curve(curve: Curve, wanted: Wanted, search: bool, origins: Sequence[tuple[Curve, float]]) -> Match | None:
    """Return the best match of a curve over all units that its axes may be in; None if it follows in none of them.

    Parameters as for :func:`find_matches`.
    """
    known = [shift for other, shift in origins if _same_stretch(curve, other)]
    result = []
    for x, y, faults in _possible_readings(curve, wanted):
        seen = _match_at_shifts(replace(curve, x=x, y=y), wanted, known or [0.0], search and not known)
        if seen is not None:
            result.append(replace(seen, curve=curve, faults=faults))
            if result[-1].share == 1:
                break
    return best_match(result)


def _possible_readings(curve: Curve, wanted: Wanted) -> Iterator[tuple[Vector, Vector, tuple[str, ...]]]:
    """Yield the ways to read a curve: times and values (SI), and the faults of the labels if it is read so.

    First in the units that its axes name, without a fault; then in other units, if the result is long enough and its
    swing is likely, with the fault that the label does not name the unit.
    """
    numbered = Reading(
        Unit("", wanted.trace.step),
        "the curve is drawn against the number of the sample: draw it against time, in s",
    )
    vertical = readings(curve.axis["ylabel"], wanted.quantity, "vertical")
    for across in (*readings(curve.axis["xlabel"], TIME, "horizontal"), numbered):
        x = across.unit.size * curve.x
        if across.fault and not np.ptp(x) >= ENOUGH_TIME * wanted.shortest:
            continue
        for up in vertical:
            y = up.unit.size * curve.y
            if not up.fault or _LIKELY_SWING[0] <= np.ptp(y) / wanted.trace.swing <= _LIKELY_SWING[1]:
                yield x, y, tuple(filter(None, (across.fault, up.fault)))


def _match_at_shifts(curve: Curve, wanted: Wanted, shifts: Sequence[float], search: bool) -> Match | None:
    """Return the match of a curve; None if it does not follow. If it follows upside down, its match earns nothing.

    Parameters
    ----------
    curve : in SI units
    wanted : what it should follow
    shifts : to try, s
    search : whether to look for another shift if none of these fits and the curve is long enough
    """
    trace, x, y = wanted.trace, curve.x, curve.y
    tried = [(trace.shape_misfit(x, y, shift), shift) for shift in shifts]
    if search and min(tried)[0] > wanted.rtol and np.ptp(x) >= ENOUGH_TIME * wanted.shortest:
        shift = trace.best_shift(x, y)
        tried += [] if shift is None else [(trace.shape_misfit(x, y, shift), shift)]
    misfit, shift = min(tried)
    if misfit <= wanted.rtol:
        return Match(curve, shift, misfit, lacking=_lack(trace.shown_length_and_swing(x, shift), wanted))
    misfit, shift = min((trace.shape_misfit(x, -y, shift), shift) for shift in shifts)
    if misfit <= wanted.rtol:
        return Match(curve, shift, misfit, lacking="a curve follows it upside down: look at its sign")
    return None


def _lack(shown: tuple[float, float], wanted: Wanted) -> str:
    """Return why a curve that follows earns nothing, as text; "" if it earns something.

    ``shown`` is from :meth:`Trace.shown_length_and_swing`.
    """
    time, swing = shown
    if time < ENOUGH_TIME * wanted.shortest:
        return "a curve follows it, but over too short a time"
    if swing < SMALLEST_SWING:
        return "a curve follows it, but only where hardly anything happens"
    return ""


def _match_pieces(pieces: list[Curve], wanted: Wanted) -> Match | None:
    """Join those pieces of one diagram that are on the channel to one curve; return its match, or None if it has none.

    All pieces have to be read in the same way: with the same faults of the labels.
    """
    result, readings_of_pieces = [], [list(_possible_readings(piece, wanted)) for piece in pieces]
    for faults in dict.fromkeys(faults for of_piece in readings_of_pieces for _x, _y, faults in of_piece):
        on_channel = [
            (piece, x, y)
            for piece, of_piece in zip(pieces, readings_of_pieces, strict=True)
            for x, y, faults_of_reading in of_piece
            if faults_of_reading == faults and wanted.trace.is_near(x, y, wanted.rtol)
        ]
        if len(on_channel) > 1:
            x, y = (np.concatenate(part) for part in list(zip(*on_channel, strict=True))[1:])
            lines = frozenset().union(*(piece.lines for piece, _x, _y in on_channel))
            if (seen := _match_at_shifts(Curve(pieces[0].axis, x, y, lines), wanted, [0.0], search=False)) is not None:
                result.append(replace(seen, faults=faults))
    return best_match(result)


def _same_stretch(curve: Curve, other: Curve) -> bool:
    """Return whether two curves begin and end at about the same places of their horizontal axes."""
    ends = np.array([[each.x.min(), each.x.max()] for each in (curve, other)])
    return bool(np.abs(ends[0] - ends[1]).max() <= _SAME_STRETCH * np.ptp(ends))
