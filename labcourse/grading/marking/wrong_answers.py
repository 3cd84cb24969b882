"""Wrong answers, made from right ones: a key must not mark them as right."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from labcourse.answers.parts import Part

_FACTOR, _OFFSET = 1.37, 0.11  # no factor between units, and more than any rounding
# Added to a number, as a share of its plausible range: a number that is nearly zero is not made wrong by a factor.
_SHARE_OF_RANGE = 0.05


def wrong_answer(part: Part, value: Any) -> Any:
    """Return an answer of the same form that is wrong where the given one is right.

    Parameters
    ----------
    part : part of a question, not prose
    value : a decoded answer (:func:`labcourse.answers.forms.decode`)
    """
    return _WRONG_BY_KIND[part.kind](part, value)


def _wrong_number(part: Part, value: Any) -> Any:
    """Return a number, or an array, that is off by a factor and an offset."""
    low, high = part.plausible or (0.0, 0.0)
    return value * _FACTOR + max(_OFFSET, _SHARE_OF_RANGE * (high - low))


def _wrong_equation(part: Part, value: Any) -> Any:
    """Return the equation with more on its left side."""
    import sympy

    return sympy.Eq(value.lhs + sympy.Symbol(part.symbols[0]) + 1, value.rhs, evaluate=False)


def _wrong_recording(part: Part, value: Any) -> Any:
    """Return the recording with each channel backwards and scaled."""
    return {**value, "channels": {name: _reverse(channel, "values") for name, channel in value["channels"].items()}}


def _wrong_figure(part: Part, value: Any) -> Any:
    """Return the figure with each line backwards and scaled."""
    axes = [{**axis, "lines": [_reverse(line, "y") for line in axis["lines"]]} for axis in value["axes"]]
    return {**value, "axes": axes}


def _reverse(samples: dict[str, Any], name: str) -> dict[str, Any]:
    """Return a copy of a channel or a line, with the array of this name reversed and scaled."""
    return {**samples, name: samples[name][::-1] * _FACTOR}


_WRONG_BY_KIND: dict[str, Callable[[Part, Any], Any]] = {
    "number": _wrong_number,
    "matrix": _wrong_number,
    "poles": lambda part, value: value * _FACTOR - _OFFSET,
    "choice": lambda part, value: next(other for other in part.choices if other != value),
    "expression": lambda part, value: value * 3 + 1,
    "equation": _wrong_equation,
    "symbolic_matrix": lambda part, value: value.applyfunc(lambda entry: entry * 3 + 1),
    "function": lambda part, value: [tuple(_wrong_number(part, array) for array in output) for output in value],
    "recording": _wrong_recording,
    "figure": _wrong_figure,
}
