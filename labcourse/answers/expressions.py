"""Expressions as plain data: a sympy expression to a tree of lists and back, by a list of what is allowed.

A tree is one of ``["int", 3]``, ``["rational", 1, 2]``, ``["float", 0.5]``, ``["pi"]``, ``["symbol", "x_0"]``,
``["add", TREE, ...]``, ``["mul", TREE, ...]``, ``["pow", TREE, TREE]`` (the exponent a number), and ``["sqrt", TREE]``,
``["sin", TREE]``, ``["cos", TREE]``, ``["exp", TREE]``. Trees are bounded in size, depth and exponents, so that one
read back from an untrusted file cannot be built into something huge. Nothing is ever evaluated from text.
"""

from __future__ import annotations

import json
import math
import sys
import unicodedata
from typing import Any

from labcourse.answers import json_values
from labcourse.answers.json_values import FormError, check_given, read_number
from labcourse.errors import AnswerError
from labcourse.patterns import ANSWER, pattern

MAX_NODES = 1000  #: a page of formula
MAX_DEPTH = 40  #: deeper than anybody can read
MAX_EXPONENT = 64  #: of a power, and of powers within powers multiplied together
#: How many arguments there are to each kind: fewest and most.
ARGUMENTS = {"symbol": (1, 1), "int": (1, 1), "rational": (2, 2), "float": (1, 1), "pi": (0, 0), "pow": (2, 2)}
ARGUMENTS |= {"add": (1, MAX_NODES), "mul": (1, MAX_NODES)} | dict.fromkeys(("sqrt", "sin", "cos", "exp"), (1, 1))
#: Kinds with plain arguments, and what makes one in sympy; then those with arguments that are trees. It has no sqrt of
#: its own, but a power.
_LEAVES = {"symbol": "Symbol", "int": "Integer", "rational": "Rational", "float": "Float"}
_MAKERS = {"add": "Add", "mul": "Mul", "pow": "Pow", "sin": "sin", "cos": "cos", "exp": "exp", "sqrt": "sqrt"}
NAME = pattern(r"[A-Za-z][A-Za-z0-9_]{0,30}", ANSWER)
_DOTTED = pattern(r"\\(d?dot)\s*(?:\{\s*\\?(\w+)\s*\}|\\?(\w+))")  # \dot{x}, \ddot\mu, \dot x
_RATE = pattern(r"(.+?)(d?)dot")
_ABOVE = {"\N{COMBINING DOT ABOVE}": "dot", "\N{COMBINING DIAERESIS}": "ddot"}
_GREEK = pattern(r"GREEK (SMALL|CAPITAL) LETTER (?:FINAL )?([A-Z]+)")


def is_symbolic(value: Any) -> bool:
    """Check whether a value is one of sympy's (without importing it where nobody else has)."""
    sympy = sys.modules.get("sympy")
    return sympy is not None and isinstance(value, sympy.Basic | sympy.MatrixBase)


# --- from sympy to a tree --------------------------------------------------------------------------------------------


def encode(value: Any, symbols: tuple[str, ...], name: str = "") -> list[Any]:
    """Return the tree of a sympy expression (or a number) in the given symbols.

    Functions of time and their derivatives are taken as the symbols that are meant, and symbols as the given ones,
    however they are spelt (:func:`spelling`, :func:`without_time`). With ``name``, an equation of the symbol of that
    name and an expression stands for the expression; so does a dictionary in which it is a key, as ``sympy.solve``
    gives it.

    Raises
    ------
    NotAnswered
        If there is nothing yet.
    FormError
        If it is not such an expression; the message says what is wrong with it.
    """
    names = Names(symbols)
    tree = _tree(without_time(_one_expression(value, name, names), names), names)
    try:
        check(tree, symbols)
    except AnswerError:
        raise FormError("it is too large to be recorded: simplify it first") from None
    return tree


def encode_equation(value: Any, symbols: tuple[str, ...]) -> dict[str, list[Any]]:
    """Return the trees ``lhs`` and ``rhs`` of ``sympy.Eq``, of a pair (left, right), or of an expression that is 0.

    Raises
    ------
    NotAnswered
        If there is nothing yet.
    FormError
        If it is not such an equation; the message says what is wrong with it.
    """
    import sympy

    if isinstance(value, bool | sympy.logic.boolalg.BooleanAtom):
        raise FormError(
            "it is just True or False: two sides compared with == are decided on the spot; write sympy.Eq(left, right)"
        )
    if isinstance(value, tuple | list) and len(value) == 1:
        value = value[0]
    if isinstance(value, tuple | list):
        if len(value) != 2:
            raise FormError(
                f"an equation has two sides; this is a sequence of {len(value)}: write sympy.Eq(left, right)"
            )
        left, right = value
    elif isinstance(value, sympy.Eq):
        left, right = value.lhs, value.rhs
    else:
        left, right = value, 0
    return {"lhs": encode(left, symbols), "rhs": encode(right, symbols)}


def _one_expression(value: Any, name: str, names: Names) -> Any:
    """Return the sympy expression meant by a value, without wrappers that a student's code may leave around it."""
    check_given(value)
    import sympy

    if isinstance(value, str):
        raise FormError("it is text: write it with sympy symbols, without quotes")
    if isinstance(value, bool | sympy.logic.boolalg.BooleanAtom):
        raise FormError("it is just True or False, not an expression")
    inside = _unwrapped(value, name, names)
    if inside is not value:
        return _one_expression(inside, name, names)
    if isinstance(value, sympy.MatrixBase | sympy.MatrixExpr):
        raise FormError("it is a matrix: give a single expression")
    if callable(value) and not isinstance(value, sympy.Basic):
        raise FormError("it is a function: give the expression itself")
    try:
        expression = sympy.sympify(value, strict=True)
    except (sympy.SympifyError, TypeError, ValueError, AttributeError):
        raise FormError(f"it is a {type(value).__name__}, not a sympy expression") from None
    if not isinstance(expression, sympy.Expr):
        raise FormError(f"it is a {type(value).__name__}, not a single sympy expression")
    if expression.has(sympy.nan, sympy.oo, -sympy.oo, sympy.zoo):
        raise FormError("it contains something infinite or undefined: look for a division by zero")
    return expression


def _unwrapped(value: Any, name: str, names: Names) -> Any:
    """Return what is in a list or matrix of one, in a solution of ``sympy.solve``, or on the right of an equation."""
    import sympy

    if isinstance(value, list | tuple | set | sympy.MatrixBase) and len(value) == 1:
        return next(iter(value))
    if isinstance(value, dict):
        formulas = [formula for key, formula in value.items() if _means(key, name, names)]
        if len(formulas) != 1:
            raise FormError("it is a dict: give one expression, solution[symbol] for a solution of sympy.solve")
        return formulas[0]
    if isinstance(value, sympy.Eq):
        if not _means(value.lhs, name, names):
            raise FormError("it is an equation: give the expression alone")
        return value.rhs
    return value


def _means(value: Any, name: str, names: Names) -> bool:
    """Check whether a symbol, or a derivative, is the one of a name."""
    import sympy

    return bool(name) and isinstance(value, sympy.Expr) and spelling(str(without_time(value, names))) == spelling(name)


def _tree(expression: Any, names: Names) -> list[Any]:
    """Return the tree of a sympy expression. Raises FormError if it contains what is not allowed."""
    import sympy

    if not expression.args:
        return _leaf(expression, names)
    kinds = {getattr(sympy, maker): kind for kind, maker in _MAKERS.items() if kind != "sqrt"}
    if expression.func not in kinds:
        name = expression.func.__name__
        if isinstance(expression, sympy.Integral | sympy.Sum | sympy.Limit | sympy.UnevaluatedExpr):
            raise FormError(f"it contains {name}, which is not carried out: add .doit() to it")
        raise _foreign(name)
    if expression.is_Pow and not expression.exp.is_Number:
        raise FormError(f"it contains a power whose exponent is not a number: {expression.exp}")
    return [kinds[expression.func], *(_tree(argument, names) for argument in expression.args)]


def _leaf(expression: Any, names: Names) -> list[Any]:
    """Return the tree of a symbol or a number."""
    import sympy

    match expression:
        case sympy.Symbol():
            return ["symbol", names[expression.name]]
        case sympy.Integer():
            return ["int", int(expression)]
        case sympy.Rational():
            return ["rational", int(expression.p), int(expression.q)]
        case sympy.Float():
            return ["float", float(expression)]
        case sympy.pi:
            return ["pi"]
        case sympy.E:
            return ["exp", ["int", 1]]
    raise _foreign(str(expression))


def _foreign(what: str) -> FormError:
    allowed = "sums, products, powers, sqrt, sin, cos and exp"
    return FormError(f"it contains {what[:40]}, which does not belong here: use {allowed}")


# --- from a tree to sympy --------------------------------------------------------------------------------------------


def decode(tree: Any, symbols: tuple[str, ...] | None = None) -> Any:
    """Return the sympy expression of a tree, its symbols plain ``sympy.Symbol`` of their names.

    Raises
    ------
    AnswerError
        If it is not a tree, too large, or has symbols other than the given ones.
    """
    import sympy

    check(tree, symbols)
    expression = _build(tree)
    if expression.has(sympy.nan, sympy.oo, -sympy.oo, sympy.zoo):
        raise AnswerError("The expression is infinite or undefined.")
    return expression


def _build(tree: list[Any]) -> Any:
    """Return the sympy expression of a tree that was checked."""
    import sympy

    kind, *arguments = tree
    if kind == "pi":
        return sympy.pi
    if kind in _LEAVES:
        return getattr(sympy, _LEAVES[kind])(*arguments)
    return getattr(sympy, _MAKERS[kind])(*map(_build, arguments))


def polynomial(value: Any) -> Any:
    """Return the polynomial that an expression in one unknown is, for its coefficients; any other value as it is."""
    import sympy

    if isinstance(value, sympy.Expr) and len(value.free_symbols) == 1 and value.is_polynomial(*value.free_symbols):
        return sympy.Poly(value, *value.free_symbols)
    return value


def describe(noun: str, symbols: tuple[str, ...], data: Any) -> str:
    """Describe trees by their symbols, as in "expression in k, x": the same on every machine."""
    text = json.dumps(data)
    used = [symbol for symbol in symbols if json.dumps(["symbol", symbol]) in text]
    return f"{noun} in {', '.join(used)}" if used else f"{noun} without symbols"


def check(tree: Any, symbols: tuple[str, ...] | None = None) -> None:
    """Check that plain data is a tree, within the bounds, and in the given symbols (any, if None).

    Raises
    ------
    AnswerError
        If it is not.
    """
    _Check(symbols).node(tree, MAX_DEPTH, MAX_EXPONENT)


class _Check:
    def __init__(self, symbols: tuple[str, ...] | None) -> None:
        self.symbols = symbols
        self.nodes = 0

    def node(self, tree: Any, depth: int, power: float, steep: bool = True) -> None:
        """Check a node and what is below it.

        ``depth`` is how many levels are left; ``power`` the largest exponent that is left for the powers below;
        ``steep`` whether there may be an exponential. Within another, or within a sine, it would be a number whose
        digits no computer can hold or reduce.
        """
        self.nodes += 1
        if self.nodes > MAX_NODES or depth <= 0:
            raise AnswerError("The expression is too large.")
        if not isinstance(tree, list) or not tree or not isinstance(tree[0], str):
            raise AnswerError("An expression is a list that begins with its kind.")
        kind, *arguments = tree
        fewest, most = ARGUMENTS.get(kind, (1, 0))
        if not fewest <= len(arguments) <= most:
            raise AnswerError(f"There is no {kind[:20]!r} with {len(arguments)} arguments in an expression.")
        match kind:
            case "symbol":
                self._symbol(arguments[0])
            case "int" | "rational":
                if not all(_is_integer(number) for number in arguments) or arguments[-1] <= 0 < len(arguments) - 1:
                    raise AnswerError(f"{kind!r} should be made of integers of at most {json_values.MAX_INTEGER:.0e}.")
            case "float":
                read_number("A float", arguments[0])
            case "pow":
                self.node(arguments[0], depth - 1, power / self._exponent(arguments[1], power), steep)
            case _:
                if kind == "exp" and not steep:
                    raise AnswerError("An exponential within an exponential or a sine is too large.")
                for argument in arguments:
                    self.node(argument, depth - 1, power, steep and kind not in ("exp", "sin", "cos"))

    def _symbol(self, name: Any) -> None:
        """Check the name of a symbol."""
        if not isinstance(name, str) or not NAME.fullmatch(name):
            raise AnswerError("A symbol should have a name.")
        if self.symbols is not None and name not in self.symbols:
            raise AnswerError(f"The symbol {name} is not among {', '.join(self.symbols)}.")

    def _exponent(self, tree: Any, power: float) -> float:
        """Return by how much an exponent uses up ``power``; at least 1."""
        self.node(tree, 1, 1)
        kind, *numbers = tree
        if kind not in ("int", "rational", "float"):
            raise AnswerError("An exponent should be a number.")
        size = max(1.0, *(abs(float(number)) for number in numbers))
        if kind == "float":
            size = max(1.0, math.ceil(size))
        if size > power:
            raise AnswerError("An exponent is too large.")
        return size


def _is_integer(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and abs(value) <= json_values.MAX_INTEGER


# --- symbols as students write them, and those that are meant ---------------------------------------------------------


def spelling(name: str) -> str:
    """Return a name in one spelling, without underscores, braces and blanks; Greek letters, LaTeX and dots as words.

    ``x_{max}``, ``xmax`` and ``x_max`` are one, and so are ``ẋ``, ``\\dot{x}`` and ``x_dot``; ``μ`` is ``mu``.
    """
    name = _DOTTED.sub(lambda match: f"{match[2] or match[3]}_{match[1]}", unicodedata.normalize("NFKD", name))
    return "".join(map(_in_words, name)).translate(dict.fromkeys(map(ord, "_{}\\ ")))


def _in_words(letter: str) -> str:
    """Return a letter or an accent as a word, if it is Greek or a dot."""
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

    ``x(t)`` becomes ``x``; its second derivative and the first derivative of ``x_dot(t)`` become ``x_ddot``. In a
    derivative by a symbol that is not given, such as ``t``, plain symbols are read as functions of that symbol.
    Otherwise the derivative of ``x`` by ``t`` would be zero.
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
