"""Figures as plain data: their labels, and the points of their curves that lie within the limits of the axes.

Points outside these limits are ignored.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labcourse.answers import bounds
from labcourse.answers.json_values import FormError, clean, rounded, thin
from labcourse.answers.labels import unit_places

_MOST_IN_ALL, _FEWEST_POINTS = 4400, 60  # of all curves together, for which each is thinned out more; of each
_ROUNDING = 1e-9  # of an axis: a point on its limit is within
_SAME_PLACE = 1e-6  # of a figure's width: diagrams above each other


def encode(value: Any) -> tuple[dict[str, Any], list[str]]:
    """Summarise a figure: its axes with their curves, each thinned to 200 points of 6 significant digits, and hints.

    Where there are many curves, each is thinned out more, so that they do not grow too large to be stored.

    Raises
    ------
    FormError
        If it is not a figure, or shows no curve, or has too many diagrams.
    """
    diagrams = seen_diagrams(value)
    if len(diagrams) > bounds.MOST_AXES:
        raise FormError(f"it has {len(diagrams)} diagrams; {bounds.MOST_AXES} at most are recorded")
    each = max(_FEWEST_POINTS, _MOST_IN_ALL // sum(min(len(lines), bounds.MOST_LINES) for _axis, lines in diagrams))
    axes: list[dict[str, Any]] = []
    hints: dict[str, list[int]] = {}  # hint -> the diagrams that it is about
    for index, (axis, lines) in enumerate(diagrams, start=1):
        texts = {"title": axis.get_title(), "xlabel": _label(axis, "x"), "ylabel": _label(axis, "y")}
        texts = {name: clean(text).strip()[: bounds.LONGEST_LABEL] for name, text in texts.items()}
        axes.append({**texts, "lines": [_thinned(line, each) for line in most_of(lines)]})
        for hint in _hints(texts["xlabel"], texts["ylabel"], lines):
            hints.setdefault(hint, []).append(index)
    if len(axes) == 1:
        return {"axes": axes}, list(hints)
    return {"axes": axes}, [f"in diagram {', '.join(map(str, where))}: {hint}" for hint, where in hints.items()]


def seen_diagrams(value: Any) -> list[tuple[Any, list[dict[str, Any]]]]:
    """Return the axes of a figure that show a curve, each with all its curves: label, n, x (n,), y (n,).

    Raises
    ------
    FormError
        If it is no figure, or shows no curve.
    """
    figure = _figure(value)
    diagrams = [(axis, list(_lines(axis))) for axis in figure.axes if axis.get_visible()]
    diagrams = [(axis, lines) for axis, lines in diagrams if _curves(lines)]
    if not diagrams:
        raise FormError(
            "there is no curve on the figure, within the limits of its axes: plot something first, and give the "
            "figure you plotted on"
        )
    return diagrams


def _figure(value: Any) -> Any:
    """Return the figure meant: a Figure, Axes, what ``plt.subplots`` returns, or what ``plot`` returns."""
    from matplotlib.artist import Artist

    values = np.asarray(value, dtype=object).ravel() if isinstance(value, np.ndarray | list | tuple) else [value]
    figure = next((item.figure for item in values if isinstance(item, Artist)), None)
    if figure is None:
        raise FormError(
            f"it is a {type(value).__name__}, not a figure: give the figure, as in fig, ax = plt.subplots()"
        )
    return figure.figure  # of a subfigure, the whole; older versions have no get_figure(root=True)


def _curves(lines: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return the lines that are more than a mark across the diagram."""
    return [line for line in lines if line["n"] > 2]


def most_of(lines: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return the lines with most points, in their order: of many lines, most are marks."""
    longest = sorted(range(len(lines)), key=lambda place: -lines[place]["n"])[: bounds.MOST_LINES]
    return [lines[place] for place in sorted(longest)]


def _lines(axis: Any) -> Iterator[dict[str, Any]]:
    """Give the lines of a diagram, and what is drawn of points alone (``scatter``) or of steps (``stairs``)."""
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
        yield _line(axis, artist, x, y)


def _line(axis: Any, artist: Any, x: Any, y: Any) -> dict[str, Any]:
    """Return an artist's label and its points within the limits of the axes."""
    x, y = np.ma.filled(np.ma.stack([x, y]).astype(float), np.nan)
    label = clean(str(artist.get_label()))
    shown = np.isfinite(x) & np.isfinite(y)
    if shown.sum() > 2 and axis.name == "rectilinear":  # a mark across the diagram may end outside of it
        shown &= _within(x, axis.get_xlim()) & _within(y, axis.get_ylim())
    return {
        "label": "" if label.startswith("_") else label[: bounds.LONGEST_LABEL],
        "n": int(shown.sum()),
        "x": x[shown],
        "y": y[shown],
    }


def _thinned(line: dict[str, Any], points: int) -> dict[str, Any]:
    places = thin(line["n"], min(points, bounds.CURVE_POINTS))
    return {**line, "x": rounded(line["x"][places]), "y": rounded(line["y"][places])}


def _within(values: NDArray[np.float64], limits: tuple[float, float]) -> NDArray[np.bool_]:
    low, high = sorted(limits)
    room = _ROUNDING * (high - low)
    return np.asarray((values >= low - room) & (values <= high + room))


def _label(axis: Any, which: str) -> str:
    """Return the label of an axis ("x" or "y"), or what stands for it.

    This is the label of another diagram that shares the axis, that of one below with the same limits, or the figure's.
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
    """Check whether another diagram stands above or below, as wide and over the same stretch."""
    places = np.array([diagram.get_position().intervalx for diagram in (axis, other)])
    limits = np.array([diagram.get_xlim() for diagram in (axis, other)])
    return bool(
        np.ptp(places, axis=0).max() <= _SAME_PLACE and np.allclose(limits[0], limits[1], rtol=_SAME_PLACE, atol=0)
    )


def _hints(x_label: str, y_label: str, lines: list[dict[str, Any]]) -> list[str]:
    """Return hints on labels, units and the number of curves of a diagram."""
    hints = []
    for name, label in (("x", x_label), ("y", y_label)):
        if not label:
            hints.append(f"the {name} axis has no label: say what it shows, and in which unit")
        elif not unit_places(label):
            hints.append(f"the {name} axis has no unit: write it in brackets after the name")
    if len(lines) > bounds.MOST_LINES:
        hints.append(f"it has {len(lines)} curves; the {bounds.MOST_LINES} with most points are recorded")
    if len(curves := _curves(lines)) > 1 and not all(line["label"] for line in curves):
        hints.append("with more than one curve, say which is which: give each a label, and a legend")
    return hints
