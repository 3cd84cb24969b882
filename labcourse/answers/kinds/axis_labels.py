"""Labels of axes as people write them: out of TeX, and the places where a unit may stand."""

from __future__ import annotations

import re
import unicodedata

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


def plain(label: str) -> str:
    """A label in small letters and without TeX: ``$t\\ [\\mathrm{ms}]$`` as "t [ms]", an exponent as "10^-3"."""
    text = _SUPERSCRIPT.sub(lambda found: "^" + unicodedata.normalize("NFKC", found[0]), label.translate(_ALIKE))
    text = unicodedata.normalize("NFKC", text).translate(_ALIKE)
    text = "".join(sign for sign in text if unicodedata.category(sign) != "Cf")  # marks of writing direction
    if "\\" in text or "$" in text:
        text = _without_tex(text)
    text = _RAISED.sub(r"^\1", text)
    text = re.sub(r"\^\s*°", "°", text.replace("{", "(").replace("}", ")"))
    return re.sub(r"μ\s+", "μ", re.sub(r"\s+", " ", text)).strip().lower()


def _without_tex(text: str) -> str:
    text = _NO_SIGN.sub("", _SPACE.sub(" ", text.replace(r"\{", "(").replace(r"\}", ")")))
    for _time in range(_NESTED):
        text = _FONT.sub(r"\1", text)
    text = _QUANTITY.sub(r"(\1)", _FRACTION.sub(r"\1/\2", text))
    text = _MACRO.sub(lambda found: _SIGNS.get(found[1], found[1]), text)
    return _LOWERED.sub(r"_\1", _RAISED.sub(r"^\1", text)).replace("$", "")


def unit_places(label: str) -> list[str]:
    """What stands where a unit may: in brackets, after a comma, a colon or a solidus, or after "in".

    As :func:`plain` has it. It need be no unit: "time (second run), s" has "second run" and "s".
    """
    text, found = plain(label), []
    for _depth in range(_NESTED):
        for inside in _INNERMOST.findall(text):
            found += [inside, *_AFTER.split(inside)[:1], *_after_in(inside)]
        text = _INNERMOST.sub(" ", text)
    first, *others = _AFTER.split(text)
    found += others
    for piece in (first, *others):
        found += [*piece.split("/", 1)[1:], *_after_in(piece)]
    return list(dict.fromkeys(filter(None, (place.strip(" .*") for place in found))))[:_MOST_PLACES]


def _after_in(text: str) -> list[str]:
    return [text[found.end() :] for found in _IN.finditer(text)]
