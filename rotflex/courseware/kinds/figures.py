"""Figures: their labels and curves."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotflex.courseware.json_values import (
    FormError,
    NotAnswered,
    clean,
    plural,
    read_dict,
    read_list,
    read_text,
    read_vector,
    rounded,
    thin,
)
from rotflex.courseware.messages import _
from rotflex.courseware.parts import Part
from rotflex.errors import AnswerError

MOST_AXES = 8
MOST_LINES = 12
MOST_POINTS = 200
MOST_SAMPLES = 10**9
_LONGEST_LABEL = 200
#: A unit is in brackets, or after a solidus or "in": "t (s)", "t [s]", "t / s", "time in s".
_UNIT = re.compile(r"\(.*\S.*\)|\[.*\S.*\]|\S\s*/\s*\S|\bin\s+\S")


def encode_figure(part: Part, value: Any) -> tuple[dict[str, Any], list[str]]:
    """A figure's axes with their curves, each thinned to 200 points (``json_values.thin``) of 6 significant digits."""
    figure = _figure(value)
    diagrams = [(axis, lines) for axis in figure.axes if (lines := [_line(line) for line in axis.lines])]
    diagrams = [(axis, lines) for axis, lines in diagrams if any(_is_curve(line) for line in lines)]
    if not diagrams:
        raise FormError(_("there is no curve on the figure: plot something first, and give the figure you plotted on"))
    if len(diagrams) > MOST_AXES:
        raise FormError(
            _("it has {count} diagrams; {most_axes} at most are kept").format(count=len(diagrams), most_axes=MOST_AXES)
        )
    axes: list[dict[str, Any]] = []
    hints: dict[str, list[int]] = {}  # hint -> the diagrams that it is about
    for index, (axis, lines) in enumerate(diagrams, start=1):
        if len(lines) > MOST_LINES:
            raise FormError(
                _("diagram {index} has {count} curves; {most_lines} at most are kept").format(
                    index=index, count=len(lines), most_lines=MOST_LINES
                )
            )
        texts = {"title": axis.get_title(), "xlabel": _x_label(axis), "ylabel": axis.get_ylabel()}
        texts = {name: clean(text).strip()[:_LONGEST_LABEL] for name, text in texts.items()}
        axes.append({**texts, "lines": lines})
        for hint in _hints(texts["xlabel"], texts["ylabel"], lines):
            hints.setdefault(hint, []).append(index)
    if len(axes) == 1:
        return {"axes": axes}, list(hints)
    return {"axes": axes}, [
        _("in diagram {where}: {hint}").format(where=", ".join(map(str, where)), hint=hint)
        for hint, where in hints.items()
    ]


def _figure(value: Any) -> Any:
    """The figure meant: a Figure, Axes, what ``plt.subplots`` returns, or what ``plot`` returns."""
    if value is None or value is Ellipsis:
        raise NotAnswered("nothing yet")
    from matplotlib.artist import Artist
    from matplotlib.figure import Figure

    if isinstance(value, np.ndarray | list | tuple):
        artists = [item for item in np.asarray(value, dtype=object).ravel() if isinstance(item, Artist)]
        if not artists:
            raise FormError(_("there is no figure in it: give the figure, as in fig, ax = plt.subplots()"))
        value = artists[0]
    if isinstance(value, Figure):
        return value
    figure = value.get_figure(root=True) if isinstance(value, Artist) else None
    if figure is None:
        raise FormError(
            _("it is a {type_name}, not a figure: give the figure, as in fig, ax = plt.subplots()").format(
                type_name=type(value).__name__
            )
        )
    return figure


def _is_curve(line: dict[str, Any]) -> bool:
    """Whether a line is more than a mark across the diagram."""
    return bool(line["n"] > 2)


def _line(line: Any) -> dict[str, Any]:
    x: NDArray[np.float64] = np.ma.filled(np.ma.asarray(line.get_xdata(orig=False), dtype=float), np.nan)
    y: NDArray[np.float64] = np.ma.filled(np.ma.asarray(line.get_ydata(orig=False), dtype=float), np.nan)
    label = clean(str(line.get_label()))
    shown = np.isfinite(x) & np.isfinite(y)
    kept = thin(int(shown.sum()), MOST_POINTS)
    return {
        "label": "" if label.startswith("_") else label[:_LONGEST_LABEL],
        "n": int(shown.sum()),
        "x": rounded(x[shown][kept]),
        "y": rounded(y[shown][kept]),
    }


def _x_label(axis: Any) -> str:
    """The label of the x axis, or of another diagram that shares it."""
    label: str = axis.get_xlabel()
    if label:
        return label
    shared = (other.get_xlabel() for other in axis.get_shared_x_axes().get_siblings(axis))
    return next((text for text in shared if text), "")


def _hints(x_label: str, y_label: str, lines: list[dict[str, Any]]) -> list[str]:
    hints = []
    for name, label in (("x", x_label), ("y", y_label)):
        if not label:
            hints.append(_("the {name} axis has no label: say what it shows, and in which unit").format(name=name))
        elif not _UNIT.search(label):
            hints.append(_("the {name} axis has no unit: write it in brackets after the name").format(name=name))
    curves = [line for line in lines if _is_curve(line)]
    if len(curves) > 1 and not all(line["label"] for line in curves):
        hints.append(_("with more than one curve, say which is which: give each a label, and a legend"))
    return hints


def decode_figure(part: Part, content: Any) -> dict[str, Any]:
    axes = []
    for item in read_list("axes", read_dict(part.name, content, {"kind", "axes"})["axes"], 1, MOST_AXES):
        axis = read_dict("A diagram", item, {"title", "xlabel", "ylabel", "lines"})
        texts = {name: read_text(name, axis[name], _LONGEST_LABEL) for name in ("title", "xlabel", "ylabel")}
        lines = [_read_line(line) for line in read_list("lines", axis["lines"], 1, MOST_LINES)]
        axes.append({**texts, "lines": lines})
    return {"axes": axes}


def _read_line(item: Any) -> dict[str, Any]:
    line = read_dict("A curve", item, {"label", "n", "x", "y"})
    n = line["n"]
    if isinstance(n, bool) or not isinstance(n, int) or not 0 <= n <= MOST_SAMPLES:
        raise AnswerError(_("The number of points of a curve should be one."))
    x = read_vector("x", line["x"], 0, MOST_POINTS)
    y = read_vector("y", line["y"], x.size, x.size)
    return {"label": read_text("label", line["label"], _LONGEST_LABEL), "n": n, "x": x, "y": y}


def show_figure(part: Part, content: dict[str, Any]) -> str:
    curves = sum(len(axis["lines"]) for axis in content["axes"])
    return f": {plural(len(content['axes']), 'diagram')}, {plural(curves, 'curve')}"
