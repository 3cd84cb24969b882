"""Figures as plain data: their labels, and the points of their curves that lie within the limits of the axes.

Points outside these limits are ignored. Labels are read as people write them: without TeX, and with the places where a
unit may stand.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterator, Mapping, Sequence
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labcourse.answers import json_values
from labcourse.answers.json_values import FormError, clean, rounded, show_number, thin
from labcourse.patterns import pattern

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
    shown = [(axis, list(_lines(axis))) for axis in figure_of(value).axes if axis.get_visible()]
    diagrams = [(axis, lines) for axis, lines in shown if _curves(lines)]
    if not diagrams:
        raise FormError(
            "there is no curve on the figure, within the limits of its axes: plot something first, and give the "
            "figure you plotted on"
        )
    if len(diagrams) > json_values.MOST_AXES:
        raise FormError(f"it has {len(diagrams)} diagrams; {json_values.MOST_AXES} at most are recorded")
    curves = sum(min(len(lines), json_values.MOST_LINES) for _axis, lines in diagrams)
    each = max(_FEWEST_POINTS, _MOST_IN_ALL // curves)
    axes: list[dict[str, Any]] = []
    hints: dict[str, list[int]] = {}  # hint -> the diagrams that it is about
    for index, (axis, lines) in enumerate(diagrams, start=1):
        texts = {"title": axis.get_title(), "xlabel": _label(axis, "x"), "ylabel": _label(axis, "y")}
        texts = {name: clean(text).strip()[: json_values.LONGEST_LABEL] for name, text in texts.items()}
        axes.append({**texts, "lines": [_thinned(line, each) for line in _most_of(lines)]})
        for hint in _hints(texts["xlabel"], texts["ylabel"], lines):
            hints.setdefault(hint, []).append(index)
    if len(axes) == 1:
        return {"axes": axes}, list(hints)
    return {"axes": axes}, [f"in diagram {', '.join(map(str, where))}: {hint}" for hint, where in hints.items()]


def figure_of(value: Any) -> Any:
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


def _most_of(lines: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return the lines with most points, in their order: of many lines, most are marks."""
    longest = sorted(range(len(lines)), key=lambda place: -lines[place]["n"])[: json_values.MOST_LINES]
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
        "label": "" if label.startswith("_") else label[: json_values.LONGEST_LABEL],
        "n": int(shown.sum()),
        "x": x[shown],
        "y": y[shown],
    }


def _thinned(line: dict[str, Any], points: int) -> dict[str, Any]:
    places = thin(line["n"], min(points, json_values.CURVE_POINTS))
    return {**line, "x": rounded(line["x"][places]), "y": rounded(line["y"][places])}


def _within(values: NDArray[np.float64], limits: tuple[float, float]) -> NDArray[np.bool_]:
    low, high = sorted(limits)
    room = _ROUNDING * (high - low)
    return np.asarray((values >= low - room) & (values <= high + room))


def _label(axis: Any, which: str) -> str:
    """Return the label of an axis ("x" or "y"), or what stands for it.

    This is the label of another diagram that shares the axis, that of one below with the same limits, or the figure's.
    """
    shared = getattr(axis, f"get_shared_{which}_axes")().get_siblings(axis)
    below = (other for other in axis.figure.axes if which == "x" and _same_column(axis, other))
    labels = (getattr(diagram, f"get_{which}label")() for diagram in chain([axis], shared, below))
    of_figure: str = getattr(axis.figure.figure, f"get_sup{which}label")()
    return next(filter(None, labels), of_figure)


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
    if len(lines) > json_values.MOST_LINES:
        hints.append(f"it has {len(lines)} curves; the {json_values.MOST_LINES} with most points are recorded")
    if len(curves := _curves(lines)) > 1 and not all(line["label"] for line in curves):
        hints.append("with more than one curve, say which is which: give each a label, and a legend")
    return hints


# --- labels -----------------------------------------------------------------------------------------------------------


#: Characters that stand for others; with them, what Unicode's compatibility forms do not bring together.
_ALIKE = str.maketrans("º˚∘−‐‑–—∕⁄÷⋅•،、؛【〔〈《「『】〕〉》」』", "°°°-----///··,,;(((((())))))")
_SUPERSCRIPT = pattern("[⁺⁻⁰¹²³⁴-⁹]+")
_FONT = pattern(
    r"\\(?:math(?:rm|it|sf|bf|tt|regular|default)|text(?:rm|it|sf|bf|up|normal)?|operatorname|mbox|rm|it)\b\s*"
    r"(?:\{([^{}]*)\})?"
)
_QUANTITY = pattern(r"\\(?:unit|si)\s*(?:\[[^\]]*\])?\s*\{([^{}]*)\}")  # as the package siunitx has it
_FRACTION = pattern(r"\\[dt]?frac\s*\{([^{}]*)\}\s*\{([^{}]*)\}")
_SPACE = pattern(r"\\[,;:! ]|~|\\q?quad\b")
_NO_SIGN = pattern(r"\\(?:left|right|[bB]igg?[lrm]?)\b")
_MACRO = pattern(r"\\([A-Za-z]+)")
_SIGNS = {"circ": "°", "degree": "°", "mu": "μ", "micro": "μ", "cdot": "·", "times": "×", "per": "/"}
_RAISED, _LOWERED = pattern(r"\^\s*[({]([^(){}]*)[)}]"), pattern(r"_\s*\{([^{}]*)\}")
_INNERMOST = pattern(r"[(\[<]([^()\[\]<>]*)[)\]>]")
_NESTED = 3  # brackets within brackets
_MOST_PLACES = 16  # looked at in a label; three are many
#: Words before a unit: "time in s", "Zeit in s", "tiempo en s", "czas w s", "время в с", "χρόνος σε s" ...
_IN = pattern(r"(?<!\w)(?:in|en|em|w|v|ve|в|у|σε|i|u|în|bằng|dalam)\s+(?=\S)")
_AFTER = pattern(r"[,;:|(\[]|\s-\s")


def normalized(label: str) -> str:
    """Return a label in small letters and without TeX: ``$t\\ [\\mathrm{ms}]$`` as "t [ms]", an exponent as "10^-3"."""
    text = _SUPERSCRIPT.sub(lambda match: "^" + unicodedata.normalize("NFKC", match[0]), label.translate(_ALIKE))
    text = unicodedata.normalize("NFKC", text).translate(_ALIKE)
    text = "".join(sign for sign in text if unicodedata.category(sign) != "Cf")  # marks of writing direction
    if "\\" in text or "$" in text:
        text = _without_tex(text)
    text = _RAISED.sub(r"^\1", text)
    text = " ".join(text.replace("{", "(").replace("}", ")").split())
    return text.replace("^°", "°").replace("^ °", "°").replace("μ ", "μ").lower()


def _without_tex(text: str) -> str:
    """Replace commands of TeX by what they stand for."""
    text = _NO_SIGN.sub("", _SPACE.sub(" ", text.replace(r"\{", "(").replace(r"\}", ")")))
    for _time in range(_NESTED):
        text = _FONT.sub(r"\1", text)
    text = _QUANTITY.sub(r"(\1)", _FRACTION.sub(r"\1/\2", text))
    text = _MACRO.sub(lambda match: _SIGNS.get(match[1], match[1]), text)
    return _LOWERED.sub(r"_\1", _RAISED.sub(r"^\1", text)).replace("$", "")


def unit_places(label: str) -> list[str]:
    """Return what stands where a unit may: in brackets, after a comma, a colon or a solidus, or after "in".

    As in :func:`normalized`; it need not be a unit: "time (second run), s" has "second run" and "s".
    """
    text, places = normalized(label), []
    for _depth in range(_NESTED):
        for inside in _INNERMOST.findall(text):
            places += [inside, *_AFTER.split(inside)[:1], *_after_in(inside)]
        text = _INNERMOST.sub(" ", text)
    first, *others = _AFTER.split(text)
    places += others
    for piece in (first, *others):
        places += [*piece.split("/", 1)[1:], *_after_in(piece)]
    return list(dict.fromkeys(filter(None, (place.strip(" .*") for place in places))))[:_MOST_PLACES]


def _after_in(text: str) -> list[str]:
    return [text[match.end() :] for match in _IN.finditer(text)]


# --- for people who read, or hear, what a figure shows ----------------------------------------------------------------

_IN_DOLLARS, _NOT_SHOWN = pattern(r"\$([^$]*)\$"), pattern(r"[{}^]")
_SPACED_MACRO = pattern(r"\\([A-Za-z]+) ?")
_FONTS = {"mathrm", "mathbf", "mathit", "text", "rm", "left", "right"}  # in formulas; not shown


def readable(label: str) -> str:
    """Return a label without what matplotlib would have set as a formula: ``$\\beta$ / $^\\circ$`` as "β / °"."""

    def formula(match: re.Match[str]) -> str:
        return _NOT_SHOWN.sub("", _SPACED_MACRO.sub(lambda macro: _sign(macro[1]), match[1]))

    return _IN_DOLLARS.sub(formula, label)


def _sign(name: str) -> str:
    """Return the sign that a command of TeX stands for."""
    case = "CAPITAL" if name[0].isupper() else "SMALL"
    try:
        return "°" if name == "circ" else unicodedata.lookup(f"GREEK {case} LETTER {name.upper()}")
    except KeyError:
        return "" if name in _FONTS else name


def describe(axis: Mapping[str, Any], lines: Sequence[Mapping[str, Any]], low: float, high: float) -> str:
    """Describe a diagram for people who do not see it.

    Parameters
    ----------
    axis : its labels, as :func:`labcourse.answers.forms.decode` gives them
    lines : its curves that are drawn, each with points
    low, high : of the axis across
    """
    curves = ", ".join(
        f"{readable(line['label']) or 'a curve without a label'} "
        f"(from {show_number(np.min(line['y']))} to {show_number(np.max(line['y']))})"
        for line in lines
    )
    x, y = (readable(axis[name]) or "an axis without a label" for name in ("xlabel", "ylabel"))
    return f"Diagram of {y} against {x}, from {show_number(low)} to {show_number(high)}. Curves: {curves}."


def evenly_logarithmic(values: NDArray[np.float64]) -> bool:
    """Check whether points (n,) stand evenly on a logarithmic axis, over a decade at least."""
    if values.size < 5 or values.min() <= 0 or values.max() < 10 * values.min():
        return False
    steps = np.diff(np.log(values))
    return bool(np.all(steps > 0) and np.ptp(steps) < 0.5 * steps.mean())
