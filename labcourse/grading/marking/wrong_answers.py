"""Wrong answers, made from right ones: a key must not mark them as right."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from labcourse.answers.parts import Part

_FACTOR, _OFFSET = 1.37, 0.11  # nobody's unit, and no rounding
_OF_RANGE = 0.05  # of what is plausible for a number: what is nearly zero is not wrong by a factor


def wrong_answer(part: Part, value: Any) -> Any:
    """Return an answer of the same form that is wrong where the given one is right.

    Parameters
    ----------
    part : part of a question, not prose
    value : a decoded answer (:func:`labcourse.answers.forms.decode`)
    """
    return _WRONG[part.kind](part, value)


def _number(part: Part, value: Any) -> Any:
    low, high = part.plausible or (0.0, 0.0)
    return value * _FACTOR + max(_OFFSET, _OF_RANGE * (high - low))


def _equation(part: Part, value: Any) -> Any:
    import sympy

    return sympy.Eq(value.lhs + sympy.Symbol(part.symbols[0]) + 1, value.rhs, evaluate=False)


def _recording(part: Part, value: Any) -> Any:
    return {**value, "channels": {name: _backwards(channel, "values") for name, channel in value["channels"].items()}}


def _figure(part: Part, value: Any) -> Any:
    axes = [{**axis, "lines": [_backwards(line, "y") for line in axis["lines"]]} for axis in value["axes"]]
    return {**value, "axes": axes}


def _backwards(samples: dict[str, Any], name: str) -> dict[str, Any]:
    return {**samples, name: samples[name][::-1] * _FACTOR}


_WRONG: dict[str, Callable[[Part, Any], Any]] = {
    "number": _number,
    "matrix": _number,
    "poles": lambda part, value: value * _FACTOR - _OFFSET,
    "choice": lambda part, value: next(other for other in part.choices if other != value),
    "expression": lambda part, value: value * 3 + 1,
    "equation": _equation,
    "symbolic_matrix": lambda part, value: value.applyfunc(lambda entry: entry * 3 + 1),
    "function": lambda part, value: [tuple(_number(part, array) for array in output) for output in value],
    "recording": _recording,
    "figure": _figure,
}
