"""Recorded answers as LaTeX: equations, and the rows of a results table."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np

from labcourse.answers import forms
from labcourse.answers.figures import readable
from labcourse.answers.parts import Part, Question
from labcourse.errors import AnswerError

HEADINGS = ("Description", "Symbol", "Value", "Unit")  #: of a results table
_NOISE = 1e-9  # of a matrix's largest entry: below, it is what rounding has left of a zero
_LONGEST_SYMBOL = 3  # letters of a name that is a symbol, and no word
_MARKDOWN = re.compile(r"([\\`*_{}\[\]<>()#+.!|$~-])")


def equation(part: Part, content: Any) -> str:
    """Return a stored answer as an equation in LaTeX, with its unit; "" if it cannot be shown as one."""
    latex = _formula(part, content)
    if not latex or part.kind == "equation":
        return latex
    unit = _unit(part)
    return f"{_symbol(part)} = {latex}" + (rf"\ \text{{{unit}}}" if unit else "")


def rows(table: Question, contents: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    """Yield the rows of a results table in Markdown: description, symbol, value, unit.

    Parameters
    ----------
    table : of the catalogue
    contents : name of a part → the stored answer, or None
    """
    for part in table.parts:
        content = contents[part.name]
        value = f"$${latex}$$" if (latex := _formula(part, content)) else "*not recorded yet*"
        if content and not latex:
            shown = forms.show(part, content).removeprefix(part.name)
            value = _MARKDOWN.sub(r"\\\1", shown.removeprefix(" = ").removeprefix(": "))
        unit = _unit(part) or ("SI" if part.kind == "matrix" else "–")  # entries of a matrix may have several
        yield part.prompt.rstrip(".").replace("|", r"\|"), f"${_symbol(part)}$", value, unit


def _symbol(part: Part) -> str:
    """Return the name of a part as LaTeX: ``mu_n`` as ``\\mu_{n}``. A unit at its end is left out."""
    first, *rest = part.name.split("_")
    rest = [word for word in rest if word != part.unit or len(word) == 1]
    if len(readable(rf"$\{first}$")) == 1 < len(first):  # a Greek letter
        head = f"\\{first}"
    elif len(first) > _LONGEST_SYMBOL:
        return rf"\text{{{'~'.join([first, *rest])}}}"  # browsers do not show a second line of it
    else:
        head = first if len(first) == 1 else rf"\mathrm{{{first}}}"
    below = r",\,".join(word if len(word) == 1 else rf"\mathrm{{{word}}}" for word in rest)
    return f"{head}_{{{below}}}" if rest else head


def _unit(part: Part) -> str:
    """Return the unit of a part; "" if it has none, or several."""
    return part.unit or part.usual.unit


def _formula(part: Part, content: Any) -> str:
    """Return a stored answer as LaTeX; "" for a kind that is not a formula, and for an answer that cannot be read."""
    try:
        value = forms.decode(part, content)
    except AnswerError:
        return ""
    if part.kind in ("expression", "equation", "symbolic_matrix"):
        import sympy

        return str(sympy.latex(value))
    shown: dict[str, Callable[[Any], str]] = {"number": _number, "matrix": _matrix, "poles": _poles}
    within = rf" \pm {_number(content['uncertainty'])}" if content.get("uncertainty") else ""
    return shown[part.kind](value) + within if part.kind in shown else ""


def _number(value: float) -> str:
    """Return a number as LaTeX, with four significant digits: ``1.2 \\cdot 10^{-3}``."""
    digits, _e, power = f"{value + 0.0:.4g}".partition("e")
    return rf"{digits} \cdot 10^{{{int(power)}}}" if power else digits


def _matrix(value: Any) -> str:
    values = np.atleast_2d(value)
    noise = _NOISE * np.abs(values).max()
    lines = [" & ".join(_number(entry if abs(entry) > noise else 0.0) for entry in row) for row in values]
    return r"\begin{bmatrix} " + r" \\ ".join(lines) + r" \end{bmatrix}"


def _poles(values: Any) -> str:
    """Return LaTeX for poles (n,): a column."""
    lines = [
        _number(pole.real) + (f" {'-' if pole.imag < 0 else '+'} {_number(abs(pole.imag))}j" if pole.imag else "")
        for pole in values
    ]
    return r"\begin{matrix} " + r" \\ ".join(lines) + r" \end{matrix}"
