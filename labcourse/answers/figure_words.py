"""What is to be said of a recorded figure: labels without TeX, a diagram in words, and which axis was logarithmic."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

_FONTS = {"mathrm", "mathbf", "mathit", "text", "rm", "left", "right"}  # in formulas; not shown


def plain_label(label: str) -> str:
    """A label without what matplotlib would have set as a formula: ``$\\beta$ / $^\\circ$`` as "β / °"."""

    def symbol(found: re.Match[str]) -> str:
        name = found[1]
        case = "CAPITAL" if name[0].isupper() else "SMALL"
        try:
            return "°" if name == "circ" else unicodedata.lookup(f"GREEK {case} LETTER {name.upper()}")
        except KeyError:
            return "" if name in _FONTS else name

    def formula(found: re.Match[str]) -> str:
        return re.sub(r"[{}^]", "", re.sub(r"\\([A-Za-z]+) ?", symbol, found[1]))

    return re.sub(r"\$([^$]*)\$", formula, label)


def in_words(axis: Mapping[str, Any], lines: Sequence[Mapping[str, Any]], low: float, high: float) -> str:
    """A diagram for who does not see it.

    Parameters
    ----------
    axis : its labels, as :func:`labcourse.answers.forms.decode` gives them
    lines : its curves that are drawn, each with points
    low, high : of the axis across
    """
    curves = [
        "{label} (from {low:.3g} to {high:.3g})".format(
            label=plain_label(line["label"]) or "a curve without a label",
            low=float(np.min(line["y"])),
            high=float(np.max(line["y"])),
        )
        for line in lines
    ]
    return "Diagram of {y} against {x}, from {low:.3g} to {high:.3g}. Curves: {curves}.".format(
        y=plain_label(axis["ylabel"]) or "an axis without a label",
        x=plain_label(axis["xlabel"]) or "an axis without a label",
        low=low,
        high=high,
        curves=", ".join(curves),
    )


def evenly_logarithmic(values: NDArray[np.float64]) -> bool:
    """Whether points (n,) stand evenly on a logarithmic axis, over a decade at least."""
    if values.size < 5 or values.min() <= 0 or values.max() < 10 * values.min():
        return False
    steps = np.diff(np.log(values))
    return bool(np.all(steps > 0) and np.ptp(steps) < 0.5 * steps.mean())
