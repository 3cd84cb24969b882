"""A student's figure, drawn again from its curves: plain numbers in, an SVG picture out, with a description in words.

What a student handed in is data (:mod:`labcourse.answers.figures`), and bounded there: curves of 200 points. The
picture is drawn here, so that nothing of theirs but numbers and escaped text gets onto the page. Whether an axis was
logarithmic was not kept: one whose points stand evenly on a logarithmic axis is drawn so.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from labcourse.answers.labels import describe, evenly_logarithmic, readable
from labcourse.safe_text import no_escapes

_WIDTH, _HEIGHT = 720, 270  # of a diagram
_LEFT, _RIGHT, _TOP, _BOTTOM = 76, 12, 10, 46  # around the plot
_TICKS = 6  # about so many on an axis
_LOOKS = 6  # of curves, in the page's style: a colour and a dash each
_LARGEST = 1e300  # no axis goes so far; beyond, differences are infinite

_SVG = Markup('<svg class="drawn" viewBox="0 0 {width} {height}" role="img" aria-label="{alt}">{inside}</svg>')
_GRID = Markup('<path class="grid" d="{path}"/>')
_CURVE = Markup('<path class="curve look{look}" d="{path}"/>')
_CURVES = Markup('<g transform="scale(0.1)">{curves}</g>')
_WORD = Markup('<text x="{x:.0f}" y="{y:.0f}" text-anchor="{anchor}">{word}</text>')
_UPRIGHT = Markup('<text transform="translate({x} {y}) rotate(-90)" text-anchor="middle">{word}</text>')
_SWATCH = Markup(
    '<li><svg class="swatch" viewBox="0 0 40 8" aria-hidden="true"><path class="curve look{look}" d="M0 4H40"/></svg> '
    "{label}</li>"
)


@dataclass(frozen=True)
class _Axis:
    """From a quantity to a place on the page."""

    low: float
    high: float
    start: float
    end: float
    logarithmic: bool = False

    def at(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Where values are."""
        if self.logarithmic:
            share = (np.log10(values) - math.log10(self.low)) / (math.log10(self.high) - math.log10(self.low))
        else:
            share = (values - self.low) / (self.high - self.low)
        return np.asarray(self.start + share * (self.end - self.start), dtype=float)

    def ticks(self) -> list[tuple[float, str]]:
        """Places and numbers of the marks on it."""
        if self.logarithmic:
            first, last = math.ceil(math.log10(self.low) - 1e-9), math.floor(math.log10(self.high) + 1e-9)
            values = [10.0**power for power in range(first, last + 1)]
        else:
            step = _round_step((self.high - self.low) / _TICKS)
            count = math.floor((self.high - self.low) / step) + 2
            first = math.ceil(self.low / step - 1e-9)
            values = [
                step * (first + index) for index in range(count) if step * (first + index) <= self.high + step * 1e-6
            ]
        return [(float(self.at(np.array(value))), f"{value + 0.0:.6g}") for value in values]


def drawn(axes: Sequence[Mapping[str, Any]]) -> Markup:
    """All diagrams of a figure, below each other.

    Parameters
    ----------
    axes : as :func:`labcourse.answers.forms.decode` gives them
    """
    return Markup("").join(_diagram(axis, index, len(axes)) for index, axis in enumerate(axes, start=1))


def _diagram(axis: Mapping[str, Any], index: int, count: int) -> Markup:
    number = f"Diagram {index}" if count > 1 else ""
    heading = ": ".join(filter(None, (number, _plain(axis["title"]))))
    parts = [Markup("<p>{}</p>").format(heading)] if heading else []
    lines = [line for line in axis["lines"] if line["x"].size]
    x, y = (_axis([line[name] for line in lines], name) for name in ("x", "y"))
    if x is None or y is None:
        return Markup("").join([*parts, Markup("<p>{}</p>").format("Its curves cannot be drawn.")])
    curves = (_CURVE.format(look=look % _LOOKS, path=_path(line, x, y)) for look, line in enumerate(lines))
    inside = Markup("").join([*_frame(x, y, axis), _CURVES.format(curves=Markup("").join(curves))])
    parts.append(
        _SVG.format(width=_WIDTH, height=_HEIGHT, alt=no_escapes(describe(axis, lines, x.low, x.high)), inside=inside)
    )
    labels = [(look, _plain(line["label"])) for look, line in enumerate(lines)]
    if any(label for _look, label in labels):
        swatches = (_SWATCH.format(look=look % _LOOKS, label=label or "no label") for look, label in labels)
        parts.append(Markup('<ul class="legend">{}</ul>').format(Markup("").join(swatches)))
    return Markup("").join(parts)


def _plain(label: str) -> str:
    """A label as it is shown."""
    return no_escapes(readable(label))


def _axis(of_lines: Sequence[NDArray[np.float64]], name: str) -> _Axis | None:
    """The axis that holds all values; None where there are none that can be drawn."""
    if not of_lines:
        return None
    values = np.concatenate(of_lines)
    low, high = float(values.min()), float(values.max())
    if max(-low, high) > _LARGEST:
        return None
    start, end = (_LEFT, _WIDTH - _RIGHT) if name == "x" else (_HEIGHT - _BOTTOM, _TOP)
    if name == "x" and evenly_logarithmic(max(of_lines, key=len)) and low > 0:
        return _Axis(low, high, start, end, True)
    margin = 0.05 * (high - low) if name == "y" else 0.0
    if high - low <= 1e-9 * max(abs(low), abs(high)):  # a flat line, or a single point
        margin = abs(high) / 2 or 1.0
    return _Axis(low - margin, high + margin, start, end)


def _round_step(step: float) -> float:
    power = 10.0 ** math.floor(math.log10(step))
    return next(nice * power for nice in (1, 2, 2.5, 5, 10, 20) if nice * power >= step * (1 - 1e-9))


def _frame(x: _Axis, y: _Axis, axis: Mapping[str, Any]) -> list[Markup]:
    """Grid, numbers, and the labels of both axes."""
    bottom, top, left, right = y.start, y.end, x.start, x.end
    x_ticks, y_ticks = x.ticks(), y.ticks()
    grid = "".join(f"M{at:.0f} {bottom}V{top}" for at, _word in x_ticks)
    grid += "".join(f"M{left} {at:.0f}H{right}" for at, _word in y_ticks)
    return [
        _GRID.format(path=grid),
        *(_WORD.format(x=at, y=bottom + 18, anchor="middle", word=word) for at, word in x_ticks),
        *(_WORD.format(x=left - 8, y=at + 4, anchor="end", word=word) for at, word in y_ticks),
        _WORD.format(x=(left + right) / 2, y=_HEIGHT - 8, anchor="middle", word=_plain(axis["xlabel"])),
        _UPRIGHT.format(x=14, y=(bottom + top) / 2, word=_plain(axis["ylabel"])),
    ]


def _path(line: Mapping[str, Any], x: _Axis, y: _Axis) -> str:
    """A curve, in tenths: whole numbers, which nobody takes for a value."""
    points = [
        (round(10 * across), round(10 * down)) for across, down in zip(x.at(line["x"]), y.at(line["y"]), strict=True)
    ]
    if len(points) == 1:  # a cross
        ((across, down),) = points
        return f"M{across - 40} {down}h80M{across} {down - 40}v80"
    return "M" + "L".join(f"{across} {down}" for across, down in points)
