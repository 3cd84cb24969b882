"""Draw a student's figure again from its curves, as SVG with a description in words.

What a student handed in is data (:mod:`labcourse.answers.figures`), and bounded there: curves of 200 points. Nothing of
it gets onto the page but numbers and escaped text. The data do not say whether an axis was logarithmic: it is drawn so
if its points stand evenly on a logarithmic axis.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from labcourse.answers.figures import describe, evenly_logarithmic, readable
from labcourse.grading.reports.templating import templates

_WIDTH, _HEIGHT = 720, 270  #: of a diagram
LEFT, RIGHT, TOP, BOTTOM = 76, 708, 10, 224  #: of the plot in it
_TICKS = 6  # about so many on an axis
_LARGEST = 1e300  # no axis goes so far; beyond, differences are infinite


@dataclass(frozen=True)
class Axis:
    """Where values stand in a diagram.

    Attributes
    ----------
    low, high : values at its ends, or their decimal logarithms
    start, end : places of its ends
    logarithmic : whether it is
    """

    low: float
    high: float
    start: float
    end: float
    logarithmic: bool = False

    @property
    def limits(self) -> tuple[float, float]:
        """The values at its ends."""
        return (10.0**self.low, 10.0**self.high) if self.logarithmic else (self.low, self.high)

    def at(self, values: NDArray[np.floating[Any]]) -> NDArray[np.float64]:
        """Return the places of values (n,)."""
        scaled = np.log10(values) if self.logarithmic else values
        return np.asarray(self.start + (scaled - self.low) / (self.high - self.low) * (self.end - self.start))

    def ticks(self) -> list[tuple[float, str]]:
        """Return place and number of each mark on it."""
        step = 1.0 if self.logarithmic else _round_step((self.high - self.low) / _TICKS)
        scaled = step * np.arange(math.ceil(self.low / step - 1e-9), math.floor(self.high / step + 1e-6) + 1)
        values = 10.0**scaled if self.logarithmic else scaled
        return [(place, f"{value + 0.0:.6g}") for place, value in zip(self.at(values), values, strict=True)]


def drawn(axes: Sequence[Mapping[str, Any]]) -> Markup:
    """Draw all diagrams of a figure, below each other.

    Parameters
    ----------
    axes : as :func:`labcourse.answers.forms.decode` returns them
    """
    size = {"width": _WIDTH, "height": _HEIGHT, "left": LEFT, "right": RIGHT, "top": TOP, "bottom": BOTTOM}
    diagrams = list(map(_diagram, axes))
    return Markup(templates().get_template("figure.html").render(diagrams=diagrams, readable=readable, **size))


def _diagram(axis: Mapping[str, Any]) -> dict[str, Any]:
    """Return what the template needs of a diagram."""
    lines = [line for line in axis["lines"] if line["x"].size]
    x = make_axis([line["x"] for line in lines], LEFT, RIGHT, may_be_logarithmic=True)
    y = make_axis([line["y"] for line in lines], BOTTOM, TOP, margin=0.05)
    if x is None or y is None:
        return {"axis": axis, "curves": []}
    return {
        "axis": axis,
        "curves": [(curve(line, x, y), line["label"]) for line in lines],
        "x_ticks": x.ticks(),
        "y_ticks": y.ticks(),
        "description": describe(axis, lines, *x.limits),
    }


def make_axis(
    of_lines: Sequence[NDArray[np.float64]],
    start: float,
    end: float,
    margin: float = 0.0,
    may_be_logarithmic: bool = False,
) -> Axis | None:
    """Return the axis that holds all values of some curves; None if there are none that can be drawn.

    Parameters
    ----------
    of_lines : values (n,) of each curve
    start, end : places of the axis's ends
    margin : share of its length that is left free at either end
    may_be_logarithmic : whether it is logarithmic if the points of the longest curve stand so
    """
    if not of_lines:
        return None
    values = np.concatenate(of_lines)
    low, high = float(values.min()), float(values.max())
    if max(-low, high) > _LARGEST:
        return None
    if may_be_logarithmic and low > 0 and evenly_logarithmic(max(of_lines, key=len)):
        return Axis(math.log10(low), math.log10(high), start, end, True)
    room = margin * (high - low)
    if high - low <= 1e-9 * max(abs(low), abs(high)):  # a flat line, or a single point
        room = abs(high) / 2 or 1.0
    return Axis(low - room, high + room, start, end)


def _round_step(step: float) -> float:
    """Return the least round number that is not below a step: 1, 2, 2½ or 5 times a power of ten."""
    power = 10.0 ** math.floor(math.log10(step))
    return next(nice * power for nice in (1, 2, 2.5, 5, 10, 20) if nice * power >= step * (1 - 1e-9))


def curve(line: Mapping[str, Any], x: Axis, y: Axis) -> str:
    """Return the path of a curve in whole tenths, which nobody takes for values; a single point is a cross."""
    places = np.rint(10 * np.column_stack([x.at(line["x"]), y.at(line["y"])])).astype(int).tolist()
    if len(places) == 1:
        ((across, down),) = places
        return f"M{across - 40} {down}h80M{across} {down - 40}v80"
    return "M" + "L".join(f"{across} {down}" for across, down in places)
