"""Recorded results as a report shows them: numbers and matrices as formulas with units, and as rows of a table."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterator
from typing import Any

import numpy as np

from labcourse.answers import forms
from labcourse.answers.parts import Part, Question
from labcourse.errors import AnswerError

_NOISE = 1e-9  # of a matrix's largest entry: below, it is what rounding has left of a zero
_DIGITS = 4  # significant, as a results table in a notebook has them
_LONGEST_SYMBOL = 3  # letters; what has more is a word
_RATE = "1/s"  # unit of poles
_EXPONENT = re.compile(r"^(?P<number>.*)e(?P<sign>[+-])0*(?P<power>\d+)$")


def symbol(name: str, unit: str = "") -> str:
    """The name of a part as a formula: ``mu_n`` as ``\\mu_{n}``; what follows is a subscript, without a unit."""
    first, *rest = name.split("_")
    if len(first) > _LONGEST_SYMBOL and not _is_greek(first):
        return rf"\text{{{' '.join([first, *rest])}}}"
    rest = [one for one in rest if one != unit or len(one) == 1]  # an "s" below may be no unit
    head = rf"\{first}" if _is_greek(first) else first if len(first) == 1 else rf"\mathrm{{{first}}}"
    if not rest:
        return head
    below = r",\,".join(one if len(one) == 1 else rf"\mathrm{{{one}}}" for one in rest)
    return f"{head}_{{{below}}}"


def _is_greek(name: str) -> bool:
    case = "CAPITAL" if name[:1].isupper() else "SMALL"
    try:
        unicodedata.lookup(f"GREEK {case} LETTER {name.upper()}")
    except KeyError:
        return False
    return True


def number(value: float) -> str:
    """A number as a formula, to four significant digits: ``1.2 \\cdot 10^{-3}``."""
    shown = f"{value + 0.0:.{_DIGITS}g}"
    if match := _EXPONENT.match(shown):
        sign = "-" if match["sign"] == "-" else ""
        shown = rf"{match['number']} \cdot 10^{{{sign}{match['power']}}}"
    return shown


def unit_of(part: Part) -> str:
    """The unit of an entry; "" where its entries have several, or none."""
    return part.unit or part.usual.unit or (_RATE if part.kind == "poles" else "")


def formula(part: Part, value: Any) -> str | None:
    """The value of an answer as LaTeX; None for a kind that is no formula.

    Parameters
    ----------
    part : which
    value : as :func:`labcourse.answers.forms.decode` gives it
    """
    if part.kind == "number":
        return number(value)
    if part.kind == "matrix":
        return _matrix(np.atleast_2d(value))
    if part.kind == "poles":
        return r"\begin{matrix} " + r" \\ ".join(_poles(value)) + r" \end{matrix}"
    if part.kind in ("expression", "equation", "symbolic_matrix"):
        import sympy

        return str(sympy.latex(value))
    return None


def _matrix(values: Any) -> str:
    noise = _NOISE * np.abs(values).max()
    rows = [" & ".join(number(one if abs(one) > noise else 0.0) for one in row) for row in values]
    return r"\begin{bmatrix} " + r" \\ ".join(rows) + r" \end{bmatrix}"


def _poles(values: Any) -> Iterator[str]:
    """Poles (n,), a pair of conjugates as one."""
    left = list(values)
    while left:
        value = left.pop(0)
        pair = next((one for one in left if value.imag and np.isclose(one, value.conjugate())), None)
        if pair is not None:
            left.remove(pair)
        if value.imag == 0:
            yield number(value.real)
        else:
            sign = r"\pm" if pair is not None else "+" if value.imag > 0 else "-"
            yield f"{number(value.real)} {sign} {number(abs(value.imag))}j"


def equations(question: Question, names: list[str], contents: dict[str, Any]) -> Iterator[str]:
    """The parts of a question that are shown as equations, as LaTeX.

    Parameters
    ----------
    question : which
    names : of its parts
    contents : name → the stored answer
    """
    for name in names:
        part = question.part(name)
        try:
            shown = formula(part, forms.decode(part, contents[name]))
        except (KeyError, AnswerError):
            continue
        if shown is not None and part.kind == "equation":
            yield shown
        elif shown is not None:
            unit = unit_of(part)
            yield f"{symbol(name, part.unit)} = {shown}" + (rf"\ \text{{{unit}}}" if unit else "")


def head() -> tuple[str, ...]:
    """The headings of a results table."""
    return ("Description", "Symbol", "Value", "Unit")


def rows(table: Question, contents: dict[str, Any]) -> Iterator[tuple[str, ...]]:
    """The rows of a results table, in Markdown; an entry that is not filled in, or cannot be read, is empty."""
    for part in table.parts:
        entry = ""
        try:
            value = forms.decode(part, contents[part.name])
        except (KeyError, AnswerError):
            pass
        else:
            shown = formula(part, value)
            entry = f"${shown}$" if shown is not None else _plain(forms.show(part, contents[part.name]), part)
        unit = unit_of(part) or ("SI" if part.kind == "matrix" else "–")  # entries of a matrix may have several
        yield part.prompt.rstrip("."), f"${symbol(part.name, part.unit)}$", entry, unit


def _plain(shown: str, part: Part) -> str:
    """An entry in words, with nothing in it that Markdown would take for more."""
    said = shown.removeprefix(part.name).removeprefix(" = ").removeprefix(": ")
    return re.sub(r"([\\`*_{}\[\]<>()#+.!|$~-])", r"\\\1", said)
