"""Recorded results as a report shows them: numbers and matrices as formulas with units, and rows of a table."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np

from labcourse.answers import forms
from labcourse.answers.labels import readable
from labcourse.answers.parts import Part, Question
from labcourse.errors import AnswerError

_NOISE = 1e-9  # of a matrix's largest entry: below, it is what rounding has left of a zero
_LONGEST_SYMBOL = 3  # letters of a name that is a symbol, and no word
HEADINGS = ("Description", "Symbol", "Value", "Unit")  #: of a results table
_MARKDOWN = re.compile(r"([\\`*_{}\[\]<>()#+.!|$~-])")


def symbol(part: Part) -> str:
    """Return the name of a part as LaTeX: ``mu_n`` as ``\\mu_{n}``. A unit at its end is left out."""
    first, *rest = part.name.split("_")
    rest = [word for word in rest if word != part.unit or len(word) == 1]
    if len(readable(rf"$\{first}$")) == 1 < len(first):  # a Greek letter
        head = f"\\{first}"
    elif len(first) > _LONGEST_SYMBOL:
        return rf"\text{{{' '.join([first, *rest])}}}"
    else:
        head = first if len(first) == 1 else rf"\mathrm{{{first}}}"
    below = r",\,".join(word if len(word) == 1 else rf"\mathrm{{{word}}}" for word in rest)
    return f"{head}_{{{below}}}" if rest else head


def number(value: float) -> str:
    """Return a number as LaTeX, with four significant digits: ``1.2 \\cdot 10^{-3}``."""
    digits, _e, power = f"{value + 0.0:.4g}".partition("e")
    return rf"{digits} \cdot 10^{{{int(power)}}}" if power else digits


def unit_of(part: Part) -> str:
    """Return the unit of a part; "" if it has none, or several."""
    return part.unit or part.usual.unit or ("1/s" if part.kind == "poles" else "")


def formula(part: Part, content: Any) -> str | None:
    """Return a stored answer as LaTeX; None for a kind that is not a formula, and for an answer that cannot be read."""
    try:
        value = forms.decode(part, content)
    except AnswerError:
        return None
    if part.kind in ("expression", "equation", "symbolic_matrix"):
        import sympy

        return str(sympy.latex(value))
    shown: dict[str, Callable[[Any], str]] = {"number": number, "matrix": _matrix, "poles": _poles}
    return shown[part.kind](value) if part.kind in shown else None


def _matrix(value: Any) -> str:
    values = np.atleast_2d(value)
    noise = _NOISE * np.abs(values).max()
    rows = [" & ".join(number(entry if abs(entry) > noise else 0.0) for entry in row) for row in values]
    return r"\begin{bmatrix} " + r" \\ ".join(rows) + r" \end{bmatrix}"


def _poles(values: Any) -> str:
    """Return poles (n,), a conjugate pair in one row."""
    rows, left = [], list(values)
    while left:
        value = left.pop(0)
        pair = next((other for other in left if value.imag and np.isclose(other, value.conjugate())), None)
        if pair is not None:
            left.remove(pair)
        sign = r"\pm" if pair is not None else "+" if value.imag > 0 else "-"
        rows.append(number(value.real) + (f" {sign} {number(abs(value.imag))}j" if value.imag else ""))
    return r"\begin{matrix} " + r" \\ ".join(rows) + r" \end{matrix}"


def equation(part: Part, content: Any) -> str | None:
    """Return a stored answer as an equation in LaTeX, with its unit; None if it cannot be shown as one."""
    latex = formula(part, content)
    if latex is None or part.kind == "equation":
        return latex
    unit = unit_of(part)
    return f"{symbol(part)} = {latex}" + (rf"\ \text{{{unit}}}" if unit else "")


def rows(table: Question, contents: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    """Yield the rows of a results table in Markdown: description, symbol, value, unit.

    The value of an entry that is not filled in, or cannot be read, is "".
    """
    for part in table.parts:
        latex = formula(part, contents[part.name])
        value = f"${latex}$" if latex is not None else ""
        if latex is None and contents[part.name]:
            shown = forms.show(part, contents[part.name]).removeprefix(part.name)
            value = _MARKDOWN.sub(r"\\\1", shown.removeprefix(" = ").removeprefix(": "))
        unit = unit_of(part) or ("SI" if part.kind == "matrix" else "–")  # entries of a matrix may have several
        yield part.prompt.rstrip(".").replace("|", r"\|"), f"${symbol(part)}$", value, unit
