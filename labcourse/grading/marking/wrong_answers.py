"""Wrong answers, made of right ones: what a key must not take for right."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from labcourse.answers.parts import Part

_FACTOR, _OFFSET = 1.37, 0.11  # nobody's unit, and no rounding
_OF_RANGE = 0.05  # of what is plausible for a number: what is nearly zero is not wrong by a factor


def wrong_answer(part: Part, value: Any) -> Any:
    """An answer of the same form that is wrong where the given one is right.

    Parameters
    ----------
    part : what is asked for; not prose
    value : a decoded answer (:func:`labcourse.answers.forms.decode`)
    """
    return _WRONG[part.kind](part, value)


def _number(part: Part, value: Any) -> Any:
    low, high = part.plausible or (0.0, 0.0)
    return value * _FACTOR + max(_OFFSET, _OF_RANGE * (high - low))


def _poles(part: Part, value: Any) -> Any:
    return value * _FACTOR - _OFFSET


def _choice(part: Part, value: Any) -> Any:
    return next(other for other in part.choices if other != value)


def _expression(part: Part, value: Any) -> Any:
    return value * 3 + 1


def _equation(part: Part, value: Any) -> Any:
    import sympy

    return sympy.Eq(value.lhs + sympy.Symbol(part.symbols[0]) + 1, value.rhs, evaluate=False)


def _symbolic_matrix(part: Part, value: Any) -> Any:
    return value.applyfunc(lambda entry: entry * 3 + 1)


def _function(part: Part, value: Any) -> Any:
    return [tuple(_number(part, array) for array in output) for output in value]


def _recording(part: Part, value: Any) -> Any:
    backwards = {
        name: {**channel, "values": channel["values"][::-1] * _FACTOR} for name, channel in value["channels"].items()
    }
    return {**value, "channels": backwards}


def _figure(part: Part, value: Any) -> Any:
    axes = [
        {**axis, "lines": [{**line, "y": line["y"][::-1] * _FACTOR} for line in axis["lines"]]}
        for axis in value["axes"]
    ]
    return {**value, "axes": axes}


_WRONG: dict[str, Callable[[Part, Any], Any]] = {
    "number": _number,
    "matrix": _number,
    "poles": _poles,
    "choice": _choice,
    "expression": _expression,
    "equation": _equation,
    "symbolic_matrix": _symbolic_matrix,
    "function": _function,
    "recording": _recording,
    "figure": _figure,
}
