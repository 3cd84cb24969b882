"""A recorded figure drawn anew for paper: an SVG from its numbers, whose curves differ in grey as well."""

from __future__ import annotations

import io
import math
from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from labcourse import pictures
from labcourse.answers.labels import describe, evenly_logarithmic, readable

_WIDTH, _HEIGHTS = 6.3, (2.5, 1.6, 1.25)  # inches: as wide as the text; of one diagram, of each of two, of each of more
_SIZES: Any = {
    "axes.labelsize": 9.5,
    "font.size": 9.0,
    "legend.fontsize": 9.0,
    "xtick.labelsize": 9.0,
    "ytick.labelsize": 9.0,
}
#: A colour, a dash and a mark for each curve, in turn: what one reader does not see, another does.
_LOOKS = (
    {"color": pictures.BLACK, "linestyle": "-", "marker": ""},
    {"color": pictures.VERMILLION, "linestyle": (0, (5, 2)), "marker": "o"},
    {"color": pictures.BLUE, "linestyle": (0, (1, 1.2)), "marker": "s"},
    {"color": pictures.GREEN, "linestyle": (0, (6, 1.5, 1.5, 1.5)), "marker": "^"},
    {"color": pictures.PURPLE, "linestyle": "-", "marker": "D"},
)
_BELOW, _LETTER = 0.25, 0.068  # inches: of a diagram's height that its axis lacks, and of a letter's width on average
_MARKS = 12  # on a curve
_FEW = 3  # points; fewer than these, and each is a mark of its own
_LARGEST = 1e300  # no axis goes so far; beyond, differences are infinite


def drawn(axes: Sequence[Mapping[str, Any]], fine: Sequence[Mapping[str, Any]] | None = None) -> tuple[str, str]:
    """A figure as SVG, and in words.

    Parameters
    ----------
    axes : as :func:`labcourse.answers.forms.decode` gives them
    fine : more points of their curves, see :mod:`labcourse.report.fine_curves`; None where there are none
    """
    curves = [_curves(axis, fine[place] if _fits(axes, fine) and fine else None) for place, axis in enumerate(axes)]
    height = _HEIGHTS[min(len(axes), len(_HEIGHTS)) - 1] * len(axes) + 0.3
    with pictures.style(), mpl.rc_context(_SIZES):
        figure = Figure(figsize=(_WIDTH, height), layout="constrained")
        shared = len(axes) > 1 and len({axis["xlabel"] for axis in axes}) == 1 and len(set(map(_span, curves))) == 1
        for place, (axis, lines) in enumerate(zip(axes, curves, strict=True)):
            named = [line["label"] for line in lines]
            legend = any(named) and (place == 0 or named != [line["label"] for line in curves[place - 1]])
            _draw(figure.add_subplot(len(axes), 1, place + 1), axis, lines, shared and place + 1 < len(axes), legend)
        svg = _svg(figure)
    words = [
        describe(axis, [line for line in lines if line["x"].size], *_span(lines))
        for axis, lines in zip(axes, curves, strict=True)
    ]
    return svg, " ".join(words)


def _fits(axes: Sequence[Mapping[str, Any]], fine: Sequence[Mapping[str, Any]] | None) -> bool:
    return fine is not None and [len(one["lines"]) for one in fine] == [len(one["lines"]) for one in axes]


def _curves(axis: Mapping[str, Any], fine: Mapping[str, Any] | None) -> list[dict[str, Any]]:
    """The curves of a diagram: label, x and y, from the more points that there are."""
    return [
        {"label": line["label"], **{name: np.clip((finer or line)[name], -_LARGEST, _LARGEST) for name in ("x", "y")}}
        | {"scales": (fine or {}).get("scales")}
        for line, finer in zip(axis["lines"], fine["lines"] if fine else [None] * len(axis["lines"]), strict=True)
    ]


def _span(lines: Sequence[Mapping[str, Any]]) -> tuple[float, float]:
    values = np.concatenate([line["x"] for line in lines])
    return (float(values.min()), float(values.max())) if values.size else (0.0, 0.0)


def _draw(ax: Any, axis: Mapping[str, Any], lines: Sequence[Mapping[str, Any]], shared: bool, legend: bool) -> None:
    for place, line in enumerate(lines):
        look: dict[str, Any] = dict(_LOOKS[place % len(_LOOKS)])
        size = line["x"].size
        if size < _FEW:
            look |= {"marker": look["marker"] or "x"} if size == 1 else {"marker": ""}
        ax.plot(
            line["x"],
            line["y"],
            **look,
            label=line["label"] or None,
            linewidth=1.0 if size > 400 else 1.3,
            markersize=4,
            markevery=max(1, math.ceil(size / _MARKS)),
            markerfacecolor="white",
        )
    longest = max((line["x"] for line in lines), key=len)
    scales = lines[0]["scales"]
    if scales[0] == "log" if scales else evenly_logarithmic(longest):
        ax.set_xscale("log")
    if scales and scales[1] == "log":
        ax.set_yscale("log")
    low, high = _span(lines)
    if high > low:
        ax.set_xlim(low, high)
    if not shared:
        ax.set_xlabel(axis["xlabel"])
    else:
        ax.tick_params(labelbottom=False)
    ax.set_ylabel(_in_lines(axis["ylabel"], ax.get_subplotspec().get_gridspec().nrows))
    ax.set_title(axis["title"], fontsize=9.5)
    if legend:
        ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, borderaxespad=0.1)


def _in_lines(label: str, diagrams: int) -> str:
    """A label with its unit on a line of its own, where it is longer than the axis in a figure of so many diagrams."""
    room = _HEIGHTS[min(diagrams, len(_HEIGHTS)) - 1] - _BELOW
    before, bracket, unit = label.rpartition(" (")
    fits = len(readable(label)) * _LETTER <= room
    return label if fits or not before else f"{before}\n{bracket.strip()}{unit}"


def _svg(figure: Figure) -> str:
    """The figure's SVG, always the same. Where a label is no formula that matplotlib knows, labels are plain text."""
    drawing = io.StringIO()
    try:
        _save(figure, drawing)
    except ValueError:
        for ax in figure.axes:
            legend = ax.get_legend()
            for text in (ax.xaxis.label, ax.yaxis.label, ax.title, *(legend.get_texts() if legend else ())):
                text.set_text(readable(text.get_text()).replace("$", r"\$"))
        drawing = io.StringIO()
        _save(figure, drawing)
    return drawing.getvalue()


def _save(figure: Figure, drawing: io.StringIO) -> None:
    with mpl.rc_context({"svg.hashsalt": "report", "svg.fonttype": "path"}):  # no font is asked of the reader's machine
        figure.savefig(drawing, format="svg", metadata={"Date": None, "Creator": None})
