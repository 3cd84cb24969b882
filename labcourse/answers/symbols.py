"""Symbols as students write them, and those that are meant: other spellings, functions of time, derivatives by it."""

from __future__ import annotations

import re
import unicodedata
from typing import Any

from labcourse.answers.json_values import FormError

_DOTTED = re.compile(r"\\(d?dot)\s*(?:\{\s*\\?(\w+)\s*\}|\\?(\w+))")  # \dot{x}, \ddot\mu, \dot x
_RATE = re.compile(r"(.+?)(d?)dot")
_ABOVE = {"\N{COMBINING DOT ABOVE}": "dot", "\N{COMBINING DIAERESIS}": "ddot"}
_GREEK = re.compile(r"GREEK (SMALL|CAPITAL) LETTER (?:FINAL )?([A-Z]+)")


def spelling(name: str) -> str:
    """Return a name in one spelling, without underscores, braces and blanks; Greek letters, LaTeX and dots as words.

    ``x_{max}``, ``xmax`` and ``x_max`` are one, and so are ``ẋ``, ``\\dot{x}`` and ``x_dot``; ``μ`` is ``mu``.
    """
    name = _DOTTED.sub(lambda match: f"{match[2] or match[3]}_{match[1]}", unicodedata.normalize("NFKD", name))
    return re.sub(r"[_{}\\ ]", "", "".join(map(_in_words, name)))


def _in_words(letter: str) -> str:
    greek = _GREEK.fullmatch(unicodedata.name(letter, ""))
    if greek:
        return greek[2].capitalize() if greek[1] == "CAPITAL" else greek[2].lower()
    return _ABOVE.get(letter, letter)


class Names:
    """The given symbols, however their names are written."""

    def __init__(self, symbols: tuple[str, ...]) -> None:
        self.symbols = symbols
        self._by_spelling = {spelling(symbol): symbol for symbol in symbols}

    def __contains__(self, name: str) -> bool:
        return spelling(name) in self._by_spelling

    def __getitem__(self, name: str) -> str:
        """Return the given symbol of this name. Raises FormError where there is none."""
        if name not in self:
            raise FormError(f"it contains {name}, which is not among the given symbols: {', '.join(self.symbols)}")
        return self._by_spelling[spelling(name)]


def without_time(expression: Any, names: Names) -> Any:
    """Return a sympy expression with symbols in place of functions of time and of derivatives by it.

    ``x(t)`` becomes ``x``, its second derivative ``x_ddot``, and so does the first of ``x_dot(t)``. What is
    differentiated by a symbol that is not given, such as ``t``, and is made of plain symbols is taken for functions of
    it: else a derivative of ``x`` by ``t`` would be zero.
    """
    import sympy
    from sympy.core.function import AppliedUndef

    if expression.has(sympy.Derivative):
        derivatives = expression.atoms(sympy.Derivative)
        expression = expression.xreplace(
            {derivative: _of_functions(derivative, names) for derivative in derivatives}
        ).doit()
    expression = expression.xreplace({rate: _rate(rate) for rate in expression.atoms(sympy.Derivative)})
    return expression.xreplace(
        {function: sympy.Symbol(function.func.__name__) for function in expression.atoms(AppliedUndef)}
    )


def _of_functions(derivative: Any, names: Names) -> Any:
    """Return a derivative, with functions of time in place of the symbols in it that have a rate."""
    import sympy

    counts = derivative.variable_count
    by_time = [(x, n) for x, n in counts if isinstance(x, sympy.Symbol) and x.name not in names]
    if not by_time:
        return derivative
    partial = [by for by in counts if tuple(by) not in by_time]
    inside = sympy.diff(derivative.expr.doit(), *map(tuple, partial)) if partial else derivative.expr
    time = by_time[0][0]
    moving = {x: sympy.Function(x.name)(time) for x in inside.free_symbols - {time} if _has_rate(x.name, names)}
    return sympy.Derivative(inside.xreplace(moving), *by_time)


def _has_rate(name: str, names: Names) -> bool:
    quantity, dots = _dots(name)
    return _named(quantity, dots + 1) in names or (dots > 0 and name in names)


def _rate(derivative: Any) -> Any:
    """Return the symbol that a derivative stands for, or the derivative as it is."""
    import sympy
    from sympy.core.function import AppliedUndef

    if not isinstance(derivative.expr, AppliedUndef) or len(derivative.variable_count) != 1:
        return derivative
    quantity, dots = _dots(derivative.expr.func.__name__)
    order = dots + int(derivative.derivative_count)
    return sympy.Symbol(_named(quantity, order)) if order <= 2 else derivative


def _dots(name: str) -> tuple[str, int]:
    """Return the quantity of a name, and how many dots are on it."""
    rate = _RATE.fullmatch(spelling(name))
    return (rate[1], len(rate[2]) + 1) if rate else (name, 0)


def _named(quantity: str, dots: int) -> str:
    return f"{quantity}_{'d' * dots}ot" if dots else quantity
