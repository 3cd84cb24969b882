"""Whether two stored answers say the same, but for the last digits."""

from __future__ import annotations

from typing import Any

CLOSE = 1e-4  #: relative: answers are kept to six digits, and another library may differ in the last of them


def alike(one: Any, other: Any) -> bool:
    """Whether two pieces of plain data are equal, numbers to within :data:`CLOSE` of the largest beside them."""
    return _alike(one, other, 0.0)


def _alike(one: Any, other: Any, scale: float) -> bool:
    if _is_number(one) and _is_number(other):
        return bool(abs(one - other) <= CLOSE * max(abs(one), abs(other), scale))
    if type(one) is not type(other):
        return False
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(_alike(one[key], other[key], 0.0) for key in one)
    if isinstance(one, list):
        largest = max((abs(number) for number in (*one, *other) if _is_number(number)), default=scale)
        return len(one) == len(other) and all(_alike(a, b, largest) for a, b in zip(one, other, strict=True))
    return bool(one == other)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
