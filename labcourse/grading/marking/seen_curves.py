"""What is seen on a figure: curves that follow a channel over time, in the units that their axes name."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labcourse.answers.json_values import thin
from labcourse.answers.kinds.axis_labels import unit_places
from labcourse.grading.marking.curve_following import ENOUGH, FEWEST_POINTS, SMALLEST_SWING, Curve, Trace, curves
from labcourse.grading.marking.named_units import named
from labcourse.grading.marking.unit_words import TIME, Named, Quantity
from labcourse.grading.verdicts import Case

Vector = NDArray[np.float64]
HALF = 0.5  # of the points, for what is right but for its labels or its height
_FEWEST_OF_A_PIECE = 2
_LIKELY = (0.1, 10.0)  # times the channel's swing: of a curve whose axis may have another unit than it says
_SAMPLE_TIMES = (1e-6, 1.0)  # s
_SAME_STRETCH = 0.02  # of both, by which their ends may differ


@dataclass(frozen=True)
class Reading:
    """A unit that an axis may be in. It has a fault, in words, where the label does not say so."""

    unit: Named
    fault: str = ""
    says_another: bool = False


@dataclass(frozen=True)
class Wanted:
    """What a curve should follow.

    Parameters
    ----------
    trace : the channel
    quantity : what it is, in whose units it may be drawn
    rtol : largest RMS difference, relative
    shortest : s, over which it should follow
    """

    trace: Trace
    quantity: Quantity
    rtol: float
    shortest: float


@dataclass(frozen=True)
class Seen:
    """A curve that follows.

    Attributes
    ----------
    shift : what its time is counted from, s
    misfit : RMS difference, relative
    faults : of its labels, in words; it earns half with them
    lacking : in words; with it, it earns nothing
    """

    curve: Curve
    shift: float
    misfit: float
    faults: tuple[str, ...] = ()
    lacking: str = ""

    @property
    def share(self) -> float:
        """Of the points."""
        return 0.0 if self.lacking else HALF if self.faults else 1.0


def best(seen: Iterable[Seen]) -> Seen | None:
    """The one that earns most; of equal ones, the nearest."""
    return min(seen, key=lambda one: (-one.share, len(one.faults), one.misfit), default=None)


def own_trace(case: Case, where: tuple[str, str], channel: str, largest: float, smooth: bool = True) -> Trace | None:
    """A channel of the student's own recording, from the samples that are kept; None if it can be none."""
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
    """Return the units that an axis may be in: those that its label names, then others. ``which`` as "horizontal"."""
    said = named(label, quantity)
    names = ", ".join(unit.name for unit in said)
    what = "names no unit that is known for it" if unit_places(label) else "lacks its unit"
    lacking = f"the {which} axis {what}: write a symbol or an English word, such as {quantity.example}"
    found = [Reading(unit) for unit in said]
    for unit in quantity.usual:
        if not any(math.isclose(unit.size, one.size) for one in said):
            another = f"the {which} axis says {names}, and the curve is in {unit.name}: let one follow the other"
            found.append(Reading(unit, another if said else lacking, says_another=bool(said)))
    return tuple(found)


def find(
    figure: dict[str, Any], wanted: Wanted, search: bool = True, origins: Sequence[tuple[Curve, float]] = ()
) -> list[Seen]:
    """The curves of a figure that follow, whole or in pieces.

    Parameters
    ----------
    search : for windows of the recording whose time is counted from somewhere else
    origins : curves of which that is known, and from where: one over the same stretch has the same
    """
    if not wanted.trace.swing > 0:
        return []
    found = [seen for curve in curves(figure) if (seen := _look(curve, wanted, search, origins))]
    for row, _axis in enumerate(figure["axes"]):
        pieces = [one for one in curves(figure, _FEWEST_OF_A_PIECE) if all(line[0] == row for line in one.lines)]
        if len(pieces) > 1 and not any(seen.share == 1 for seen in found if seen.curve.axis is figure["axes"][row]):
            found += filter(None, [_look_at_pieces(pieces, wanted)])
    return found


def _look(curve: Curve, wanted: Wanted, search: bool, origins: Sequence[tuple[Curve, float]]) -> Seen | None:
    """A curve, by each reading of its axes until it is found without a fault."""
    known = [shift for other, shift in origins if _over_the_same(curve, other)]
    found = []
    for x, y, faults in _read(curve, wanted):
        seen = _follow(Curve(curve.axis, x, y, curve.lines), wanted, known or [0.0], search and not known)
        if seen is not None:
            found.append(Seen(curve, seen.shift, seen.misfit, faults, seen.lacking))
            if not faults and not seen.lacking:
                break
    return best(found)


def _read(curve: Curve, wanted: Wanted) -> Iterable[tuple[Vector, Vector, tuple[str, ...]]]:
    """Times and values (SI) of a curve, by what its axes say; then by what they may be, with faults."""
    numbered = Reading(
        Named("", wanted.trace.step),
        "the curve is drawn against the number of the sample: draw it against time, in s",
    )
    vertical = readings(curve.axis["ylabel"], wanted.quantity, "vertical")
    for across in (*readings(curve.axis["xlabel"], TIME, "horizontal"), numbered):
        x = across.unit.size * curve.x
        if across.fault and not np.ptp(x) >= ENOUGH * wanted.shortest:
            continue
        for up in vertical:
            y = up.unit.size * curve.y
            if not up.fault or _LIKELY[0] <= np.ptp(y) / wanted.trace.swing <= _LIKELY[1]:
                yield x, y, tuple(filter(None, (across.fault, up.fault)))


def _follow(curve: Curve, wanted: Wanted, shifts: Sequence[float], search: bool) -> Seen | None:
    """A curve (SI) that follows from one of these times, or from any; one that does so upside down, too."""
    trace, x, y = wanted.trace, curve.x, curve.y
    tried = [(trace.misfit(x, y, shift), shift) for shift in shifts]
    if search and min(tried)[0] > wanted.rtol and np.ptp(x) >= ENOUGH * wanted.shortest:
        found = trace.best_shift(x, y)
        tried += [] if found is None else [(trace.misfit(x, y, found), found)]
    misfit, shift = min(tried)
    if misfit <= wanted.rtol:
        return Seen(curve, shift, misfit, lacking=_too_little(trace.shows(x, shift), wanted))
    misfit, shift = min((trace.misfit(x, -y, shift), shift) for shift in shifts)
    if misfit <= wanted.rtol:
        return Seen(curve, shift, misfit, lacking="a curve follows it upside down: look at its sign")
    return None


def _too_little(shown: tuple[float, float], wanted: Wanted) -> str:
    time, swing = shown
    if time < ENOUGH * wanted.shortest:
        return "a curve follows it, but over too short a time"
    if swing < SMALLEST_SWING:
        return "a curve follows it, but only where hardly anything happens"
    return ""


def _look_at_pieces(pieces: list[Curve], wanted: Wanted) -> Seen | None:
    """The pieces on one diagram that follow where they are, as one curve."""
    found, read = [], [list(_read(piece, wanted)) for piece in pieces]
    for faults in dict.fromkeys(faults for of_piece in read for _x, _y, faults in of_piece):
        kept = [
            (piece, x, y)
            for piece, of_piece in zip(pieces, read, strict=True)
            for x, y, with_faults in of_piece
            if with_faults == faults and wanted.trace.near(x, y, wanted.rtol)
        ]
        if len(kept) > 1:
            x, y = (np.concatenate(part) for part in list(zip(*kept, strict=True))[1:])
            lines = frozenset().union(*(piece.lines for piece, _x, _y in kept))
            whole = Curve(pieces[0].axis, x, y, lines)
            if (seen := _follow(whole, wanted, [0.0], search=False)) is not None:
                found.append(Seen(whole, seen.shift, seen.misfit, faults, seen.lacking))
    return best(found)


def _over_the_same(curve: Curve, other: Curve) -> bool:
    """Whether two curves begin and end at about the same places of their axes."""
    ends = np.array([[one.x.min(), one.x.max()] for one in (curve, other)])
    return bool(np.abs(ends[0] - ends[1]).max() <= _SAME_STRETCH * np.ptp(ends))
