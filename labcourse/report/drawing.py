"""A recorded figure drawn anew for paper: an SVG from its numbers, whose curves differ in grey as well."""

from __future__ import annotations

import io
import math
from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from cycler import cycler
from matplotlib.figure import Figure

from labcourse import pictures
from labcourse.answers.figures import describe, evenly_logarithmic, readable

_WIDTH, _HEIGHTS = 6.3, (2.5, 1.6, 1.25)  # inches: as wide as the text; of one diagram, of each of two, of each of more
#: A colour, a dash and a mark for each curve, in turn: what one reader does not see, another does.
_LOOKS = cycler(
    color=[pictures.BLACK, pictures.VERMILLION, pictures.BLUE, pictures.GREEN, pictures.PURPLE],
    linestyle=["-", (0, (5, 2)), (0, (1, 1.2)), (0, (6, 1.5, 1.5, 1.5)), "-"],
    marker=["None", "o", "s", "^", "D"],
)
#: Letters are drawn as paths, so no font of the reader's computer is needed.
_STYLE: Any = {"axes.prop_cycle": _LOOKS, "svg.hashsalt": "report", "svg.fonttype": "path"}
_STYLE |= {"axes.labelsize": 9.5, "axes.titlesize": 9.5} | dict.fromkeys(
    ("font.size", "legend.fontsize", "xtick.labelsize", "ytick.labelsize"), 9.0
)
_BELOW, _LETTER = 0.25, 0.068  # inches: of a diagram's height that its axis lacks, and of a letter's width on average
_MARKS = 12  # on a curve
_LARGEST = 1e300  # no axis goes so far; beyond, differences are infinite


def draw(axes: Sequence[Mapping[str, Any]]) -> tuple[str, str]:
    """Draw a figure; return its SVG and its description.

    Parameters
    ----------
    axes : as :func:`labcourse.answers.forms.decode` returns them; also "scales" (x, y), if they are known
    """
    spans = [_span(axis["lines"]) for axis in axes]
    names = [[line["label"] for line in axis["lines"]] for axis in axes]
    height = _HEIGHTS[min(len(axes), len(_HEIGHTS)) - 1]
    shared = len(axes) > 1 and len({axis["xlabel"] for axis in axes}) == 1 and len(set(spans)) == 1
    with pictures.style(), mpl.rc_context(_STYLE):
        figure = Figure(figsize=(_WIDTH, height * len(axes) + 0.3), layout="constrained")
        diagrams = figure.subplots(len(axes), squeeze=False)[:, 0]
        for place, (ax, axis) in enumerate(zip(diagrams, axes, strict=True)):
            _draw(ax, axis, spans[place])
            if any(names[place]) and (place == 0 or names[place] != names[place - 1]):
                ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, borderaxespad=0.1)
            ax.set_ylabel(_in_lines(axis["ylabel"], height))
            if shared and place + 1 < len(axes):
                ax.tick_params(labelbottom=False)
            else:
                ax.set_xlabel(axis["xlabel"])
        svg = _svg(figure)
    texts = [
        describe(axis, [line for line in axis["lines"] if line["x"].size], *span)
        for axis, span in zip(axes, spans, strict=True)
    ]
    return svg, " ".join(texts)


def _span(lines: Sequence[Mapping[str, Any]]) -> tuple[float, float]:
    values = np.concatenate([line["x"] for line in lines])
    return (float(values.min()), float(values.max())) if values.size else (0.0, 0.0)


def _draw(ax: Any, axis: Mapping[str, Any], span: tuple[float, float]) -> None:
    for line in axis["lines"]:
        size = line["x"].size
        few = {0: {"marker": ""}, 1: {"marker": "x"}, 2: {"marker": ""}}  # a point, and a mark across the diagram
        ax.plot(
            *(np.clip(line[name], -_LARGEST, _LARGEST) for name in ("x", "y")),
            label=line["label"] or None,
            linewidth=1.0 if size > 400 else 1.3,
            markersize=4,
            markerfacecolor="white",
            markevery=max(1, math.ceil(size / _MARKS)),
            **few.get(size, {}),
        )
    longest = max((line["x"] for line in axis["lines"]), key=len)
    x_scale, y_scale = axis.get("scales") or ("log" if evenly_logarithmic(longest) else "linear", "linear")
    ax.set(title=axis["title"], xscale="log" if x_scale == "log" else "linear")
    ax.set_yscale("log" if y_scale == "log" else "linear")
    if span[1] > span[0]:
        ax.set_xlim(*span)


def _in_lines(label: str, height: float) -> str:
    """Return a label with its unit on a line of its own if it is longer than the axis of a diagram of this height."""
    before, bracket, unit = label.rpartition(" (")
    fits = len(readable(label)) * _LETTER <= height - _BELOW
    return label if fits or not before else f"{before}\n{bracket.strip()}{unit}"


def _svg(figure: Figure) -> str:
    """Return the figure's SVG, always the same. Labels are plain text if one is a formula that matplotlib refuses."""
    try:
        return _saved(figure)
    except ValueError:
        for text in figure.findobj(mpl.text.Text):
            text.set_text(readable(text.get_text()))
            text.set_parse_math(False)
        return _saved(figure)


def _saved(figure: Figure) -> str:
    drawing = io.StringIO()
    figure.savefig(drawing, format="svg", metadata={"Date": None, "Creator": None})
    return drawing.getvalue()
