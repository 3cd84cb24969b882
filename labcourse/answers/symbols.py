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


def plain(name: str) -> str:
    """A name in one spelling, without underscores, braces and blanks; Greek letters, LaTeX and dots above in words.

    ``x_{max}``, ``xmax`` and ``x_max`` are one, and so are ``ẋ``, ``\\dot{x}`` and ``x_dot``; ``μ`` is ``mu``.
    """
    name = _DOTTED.sub(lambda found: f"{found[2] or found[3]}_{found[1]}", unicodedata.normalize("NFKD", name))
    return re.sub(r"[_{}\\ ]", "", "".join(map(_in_words, name)))


def _in_words(letter: str) -> str:
    greek = _GREEK.fullmatch(unicodedata.name(letter, ""))
    if greek:
        return greek[2].capitalize() if greek[1] == "CAPITAL" else greek[2].lower()
    return _ABOVE.get(letter, letter)


def listed(symbols: tuple[str, ...]) -> str:
    """Names for a message."""
    return ", ".join(symbols)


class Names:
    """The given symbols, however their names are written."""

    def __init__(self, symbols: tuple[str, ...]) -> None:
        self.symbols = symbols
        self._by_plain_name = {plain(symbol): symbol for symbol in symbols}

    def __contains__(self, name: str) -> bool:
        return plain(name) in self._by_plain_name

    def __getitem__(self, name: str) -> str:
        """The given symbol of this name. Raises FormError where there is none."""
        if name not in self:
            raise FormError(f"it contains {name}, which is not among the given symbols: {listed(self.symbols)}")
        return self._by_plain_name[plain(name)]


def without_time(expression: Any, names: Names) -> Any:
    """A sympy expression with symbols in place of functions of time and of derivatives by it.

    ``x(t)`` becomes ``x``, its second derivative ``x_ddot``, and so does the first of ``x_dot(t)``. What is
    differentiated by a symbol that is not given, such as ``t``, and is made of plain symbols is taken for functions of
    it: else a derivative of ``x`` by ``t`` would be zero.
    """
    import sympy
    from sympy.core.function import AppliedUndef

    if expression.has(sympy.Derivative):
        derivatives = expression.atoms(sympy.Derivative)
        expression = expression.xreplace({one: _of_functions(one, names) for one in derivatives}).doit()
    meant = {one: _rate(one) for one in expression.atoms(sympy.Derivative)}
    expression = expression.xreplace(meant)
    return expression.xreplace(
        {function: sympy.Symbol(function.func.__name__) for function in expression.atoms(AppliedUndef)}
    )


def _of_functions(derivative: Any, names: Names) -> Any:
    """A derivative, with functions of time in place of the symbols in it that have a rate."""
    import sympy

    counts = derivative.variable_count
    by_time = [(x, n) for x, n in counts if isinstance(x, sympy.Symbol) and x.name not in names]
    if not by_time:
        return derivative
    partial = [one for one in counts if tuple(one) not in by_time]
    inside = sympy.diff(derivative.expr.doit(), *map(tuple, partial)) if partial else derivative.expr
    time = by_time[0][0]
    moving = {x: sympy.Function(x.name)(time) for x in inside.free_symbols - {time} if _has_rate(x.name, names)}
    return sympy.Derivative(inside.xreplace(moving), *by_time)


def _has_rate(name: str, names: Names) -> bool:
    quantity, dots = _dots(name)
    return _named(quantity, dots + 1) in names or (dots > 0 and name in names)


def _rate(derivative: Any) -> Any:
    """The symbol that a derivative stands for, or the derivative as it is."""
    import sympy
    from sympy.core.function import AppliedUndef

    if not isinstance(derivative.expr, AppliedUndef) or len(derivative.variable_count) != 1:
        return derivative
    quantity, dots = _dots(derivative.expr.func.__name__)
    order = dots + int(derivative.derivative_count)
    return sympy.Symbol(_named(quantity, order)) if order <= 2 else derivative


def _dots(name: str) -> tuple[str, int]:
    """The quantity of a name, and how many dots are on it."""
    rate = _RATE.fullmatch(plain(name))
    return (rate[1], len(rate[2]) + 1) if rate else (name, 0)


def _named(quantity: str, dots: int) -> str:
    return f"{quantity}_{'d' * dots}ot" if dots else quantity
