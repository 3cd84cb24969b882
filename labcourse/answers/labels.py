"""Labels of axes as people write them: without TeX, the places where a unit may stand, and a diagram in words."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

#: Characters that stand for others; with them, what Unicode's compatibility forms do not bring together.
_ALIKE = str.maketrans("º˚∘−‐‑–—∕⁄÷⋅•،、؛【〔〈《「『】〕〉》」』", "°°°-----///··,,;(((((())))))")
_SUPERSCRIPT = re.compile("[⁺⁻⁰¹²³⁴-⁹]+")
_FONT = re.compile(
    r"\\(?:math(?:rm|it|sf|bf|tt|regular|default)|text(?:rm|it|sf|bf|up|normal)?|operatorname|mbox|rm|it)\b\s*"
    r"(?:\{([^{}]*)\})?"
)
_QUANTITY = re.compile(r"\\(?:unit|si)\s*(?:\[[^\]]*\])?\s*\{([^{}]*)\}")  # as the package siunitx has it
_FRACTION = re.compile(r"\\[dt]?frac\s*\{([^{}]*)\}\s*\{([^{}]*)\}")
_SPACE = re.compile(r"\\[,;:! ]|~|\\q?quad\b")
_NO_SIGN = re.compile(r"\\(?:left|right|[bB]igg?[lrm]?)\b")
_MACRO = re.compile(r"\\([A-Za-z]+)")
_SIGNS = {"circ": "°", "degree": "°", "mu": "μ", "micro": "μ", "cdot": "·", "times": "×", "per": "/"}
_RAISED, _LOWERED = re.compile(r"\^\s*[({]([^(){}]*)[)}]"), re.compile(r"_\s*\{([^{}]*)\}")
_INNERMOST = re.compile(r"[(\[<]([^()\[\]<>]*)[)\]>]")
_NESTED = 3  # brackets within brackets
_MOST_PLACES = 16  # looked at in a label; three are many
#: Words before a unit: "time in s", "Zeit in s", "tiempo en s", "czas w s", "время в с", "χρόνος σε s" ...
_IN = re.compile(r"(?<!\w)(?:in|en|em|w|v|ve|в|у|σε|i|u|în|bằng|dalam)\s+(?=\S)")
_AFTER = re.compile(r"[,;:|(\[]|\s-\s")


def normalized(label: str) -> str:
    """Return a label in small letters and without TeX: ``$t\\ [\\mathrm{ms}]$`` as "t [ms]", an exponent as "10^-3"."""
    text = _SUPERSCRIPT.sub(lambda match: "^" + unicodedata.normalize("NFKC", match[0]), label.translate(_ALIKE))
    text = unicodedata.normalize("NFKC", text).translate(_ALIKE)
    text = "".join(sign for sign in text if unicodedata.category(sign) != "Cf")  # marks of writing direction
    if "\\" in text or "$" in text:
        text = _without_tex(text)
    text = _RAISED.sub(r"^\1", text)
    text = re.sub(r"\^\s*°", "°", text.replace("{", "(").replace("}", ")"))
    return re.sub(r"μ\s+", "μ", re.sub(r"\s+", " ", text)).strip().lower()


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

_FONTS = {"mathrm", "mathbf", "mathit", "text", "rm", "left", "right"}  # in formulas; not shown


def readable(label: str) -> str:
    """Return a label without what matplotlib would have set as a formula: ``$\\beta$ / $^\\circ$`` as "β / °"."""

    def formula(match: re.Match[str]) -> str:
        return re.sub(r"[{}^]", "", re.sub(r"\\([A-Za-z]+) ?", lambda macro: _sign(macro[1]), match[1]))

    return re.sub(r"\$([^$]*)\$", formula, label)


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
        f"(from {float(np.min(line['y'])):.3g} to {float(np.max(line['y'])):.3g})"
        for line in lines
    )
    x, y = (readable(axis[name]) or "an axis without a label" for name in ("xlabel", "ylabel"))
    return f"Diagram of {y} against {x}, from {low:.3g} to {high:.3g}. Curves: {curves}."


def evenly_logarithmic(values: NDArray[np.float64]) -> bool:
    """Check whether points (n,) stand evenly on a logarithmic axis, over a decade at least."""
    if values.size < 5 or values.min() <= 0 or values.max() < 10 * values.min():
        return False
    steps = np.diff(np.log(values))
    return bool(np.all(steps > 0) and np.ptp(steps) < 0.5 * steps.mean())
