"""Figures: their labels, and their curves as far as they are seen.

Of a curve, the points within the limits of its axes are kept, so that what was zoomed out of sight does not count.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labcourse.answers.json_values import (
    FormError,
    NotAnswered,
    clean,
    read_dict,
    read_list,
    read_text,
    read_vector,
    rounded,
    thin,
)
from labcourse.answers.kinds.axis_labels import unit_places
from labcourse.answers.parts import Part
from labcourse.errors import AnswerError
from labcourse.messages import plural

MOST_AXES = 8  #: four rows of two
MOST_LINES = 24  #: curves and marks of a diagram; curves alone are told apart up to a dozen
MOST_POINTS = 200  #: of a curve as it is kept
_MOST_IN_ALL, _FEWEST_POINTS = 4400, 60  # of all curves together, for which each is thinned out more; of each
MOST_SAMPLES = 10**9  #: two weeks at 1 kHz
_LONGEST_LABEL = 200  # characters: two lines
_ROUNDING = 1e-9  # of an axis: a point on its limit is within
_SAME_PLACE = 1e-6  # of a figure's width: diagrams above each other


def encode_figure(part: Part, value: Any) -> tuple[dict[str, Any], list[str]]:
    """A figure's axes with their curves, each thinned to 200 points (``json_values.thin``) of 6 significant digits.

    To fewer where there are many curves, so that they do not grow too large to be kept.
    """
    diagrams = seen_diagrams(value)
    if len(diagrams) > MOST_AXES:
        raise FormError(f"it has {len(diagrams)} diagrams; {MOST_AXES} at most are kept")
    each = max(_FEWEST_POINTS, _MOST_IN_ALL // sum(min(len(lines), MOST_LINES) for _axis, lines in diagrams))
    axes: list[dict[str, Any]] = []
    hints: dict[str, list[int]] = {}  # hint -> the diagrams that it is about
    for index, (axis, lines) in enumerate(diagrams, start=1):
        texts = {"title": axis.get_title(), "xlabel": _label(axis, "x"), "ylabel": _label(axis, "y")}
        texts = {name: clean(text).strip()[:_LONGEST_LABEL] for name, text in texts.items()}
        axes.append({**texts, "lines": [_thinned(line, each) for line in most_of(lines)]})
        for hint in _hints(texts["xlabel"], texts["ylabel"], lines):
            hints.setdefault(hint, []).append(index)
    if len(axes) == 1:
        return {"axes": axes}, list(hints)
    return {"axes": axes}, [f"in diagram {', '.join(map(str, where))}: {hint}" for hint, where in hints.items()]


def seen_diagrams(value: Any) -> list[tuple[Any, list[dict[str, Any]]]]:
    """The axes of a figure that show a curve, each with all its curves: label, n, x (n,), y (n,).

    Raises
    ------
    NotAnswered
        If nothing is given yet.
    FormError
        If it is no figure, or shows no curve.
    """
    figure = _figure(value)
    diagrams = [(axis, lines) for axis in figure.axes if axis.get_visible() and (lines := list(_lines(axis)))]
    diagrams = [(axis, lines) for axis, lines in diagrams if any(_is_curve(line) for line in lines)]
    if not diagrams:
        raise FormError(
            "there is no curve on the figure, within the limits of its axes: plot something first, and give the "
            "figure you plotted on"
        )
    return diagrams


def _figure(value: Any) -> Any:
    """The figure meant: a Figure, Axes, what ``plt.subplots`` returns, or what ``plot`` returns."""
    if value is None or value is Ellipsis:
        raise NotAnswered("nothing yet")
    from matplotlib.artist import Artist
    from matplotlib.figure import Figure

    if isinstance(value, np.ndarray | list | tuple):
        artists = [item for item in np.asarray(value, dtype=object).ravel() if isinstance(item, Artist)]
        if not artists:
            raise FormError("there is no figure in it: give the figure, as in fig, ax = plt.subplots()")
        value = artists[0]
    if isinstance(value, Figure):
        return value
    figure = value.figure if isinstance(value, Artist) else None
    if figure is None:
        raise FormError(
            f"it is a {type(value).__name__}, not a figure: give the figure, as in fig, ax = plt.subplots()"
        )
    return figure.figure  # of a subfigure, the whole; older versions have no get_figure(root=True)


def _is_curve(line: dict[str, Any]) -> bool:
    """Whether a line is more than a mark across the diagram."""
    return bool(line["n"] > 2)


def most_of(lines: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Those with most points, in their order: of many lines, most are marks."""
    longest = sorted(range(len(lines)), key=lambda place: -lines[place]["n"])[:MOST_LINES]
    return [lines[place] for place in sorted(longest)]


def _lines(axis: Any) -> Iterator[dict[str, Any]]:
    """The lines of a diagram, and what is drawn of points alone (``scatter``) or of steps (``stairs``)."""
    from matplotlib.collections import PathCollection
    from matplotlib.lines import Line2D
    from matplotlib.patches import StepPatch

    for artist in axis.get_children():
        if not artist.get_visible():
            continue
        if isinstance(artist, Line2D):
            x, y = artist.get_xdata(orig=False), artist.get_ydata(orig=False)
        elif isinstance(artist, PathCollection):
            x, y = np.ma.asarray(artist.get_offsets())[:, 0], np.ma.asarray(artist.get_offsets())[:, 1]
        elif isinstance(artist, StepPatch):
            y, edges, _baseline = artist.get_data()
            x = (edges[:-1] + edges[1:]) / 2
        else:
            continue
        yield _line(axis, artist, _numbers(x), _numbers(y))


def _numbers(values: Any) -> NDArray[np.float64]:
    return np.asarray(np.ma.filled(np.ma.asarray(values, dtype=float), np.nan))


def _line(axis: Any, artist: Any, x: NDArray[np.float64], y: NDArray[np.float64]) -> dict[str, Any]:
    label = clean(str(artist.get_label()))
    shown = np.isfinite(x) & np.isfinite(y)
    if shown.sum() > 2 and axis.name == "rectilinear":  # a mark across the diagram may end outside of it
        shown &= _within(x, axis.get_xlim()) & _within(y, axis.get_ylim())
    return {
        "label": "" if label.startswith("_") else label[:_LONGEST_LABEL],
        "n": int(shown.sum()),
        "x": x[shown],
        "y": y[shown],
    }


def _thinned(line: dict[str, Any], points: int) -> dict[str, Any]:
    kept = thin(line["n"], min(points, MOST_POINTS))
    return {**line, "x": rounded(line["x"][kept]), "y": rounded(line["y"][kept])}


def _within(values: NDArray[np.float64], limits: tuple[float, float]) -> NDArray[np.bool_]:
    low, high = sorted(limits)
    room = _ROUNDING * (high - low)
    return np.asarray((values >= low - room) & (values <= high + room))


def _label(axis: Any, which: str) -> str:
    """The label of an axis ("x" or "y"), or of what stands for it.

    That of another diagram that shares the axis, that of a diagram below with the same limits, or the whole figure's.
    """
    label: str = getattr(axis, f"get_{which}label")()
    if label:
        return label
    shared = list(getattr(axis, f"get_shared_{which}_axes")().get_siblings(axis))
    others = shared if which == "y" else [*shared, *(other for other in axis.figure.axes if _same_column(axis, other))]
    texts = (getattr(other, f"get_{which}label")() for other in others)
    of_figure: str = getattr(axis.figure.figure, f"get_sup{which}label")()
    return next((text for text in texts if text), of_figure)


def _same_column(axis: Any, other: Any) -> bool:
    """Whether another diagram stands above or below, as wide and over the same stretch."""
    places = np.array([one.get_position().intervalx for one in (axis, other)])
    limits = np.array([one.get_xlim() for one in (axis, other)])
    return bool(
        np.ptp(places, axis=0).max() <= _SAME_PLACE and np.allclose(limits[0], limits[1], rtol=_SAME_PLACE, atol=0)
    )


def _hints(x_label: str, y_label: str, lines: list[dict[str, Any]]) -> list[str]:
    hints = []
    for name, label in (("x", x_label), ("y", y_label)):
        if not label:
            hints.append(f"the {name} axis has no label: say what it shows, and in which unit")
        elif not unit_places(label):
            hints.append(f"the {name} axis has no unit: write it in brackets after the name")
    if len(lines) > MOST_LINES:
        hints.append(f"it has {len(lines)} curves; the {MOST_LINES} with most points are kept")
    curves = [line for line in lines if _is_curve(line)]
    if len(curves) > 1 and not all(line["label"] for line in curves):
        hints.append("with more than one curve, say which is which: give each a label, and a legend")
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
        raise AnswerError("The number of points of a curve should be a whole number.")
    x = read_vector("x", line["x"], 0, MOST_POINTS)
    y = read_vector("y", line["y"], x.size, x.size)
    return {"label": read_text("label", line["label"], _LONGEST_LABEL), "n": n, "x": x, "y": y}


def show_figure(part: Part, content: dict[str, Any]) -> str:
    curves = sum(len(axis["lines"]) for axis in content["axes"])
    diagrams = plural(len(content["axes"]), "{count} diagram", "{count} diagrams")
    return f": {diagrams}, {plural(curves, '{count} curve', '{count} curves')}"
