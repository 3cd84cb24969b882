"""How near two own answers must be to agree, and how numbers are said.

Wide: an answer may be rounded to two digits, and what is built on it worked out from all of them. What asks must be
beyond all that honest work gives (``tests/course/test_reflection.py`` holds it to the right ways on several benches).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotflex.units import DEG, HZ

Array = NDArray[Any]

CARRIED = 0.06  #: relative: a number that is repeated, perhaps with two digits
BUILT = 0.12  #: relative: a number that follows from others of two digits, one of them squared
_LOST = 0.005  # of a power of the fastest pole: a coefficient that is smaller is lost in rounding


def hertz(omega: float) -> str:
    """A frequency (rad/s) in Hz, for people."""
    return f"{omega / HZ:.3g} Hz"


def alike(one: ArrayLike, other: ArrayLike, rtol: float, atol: float = 0.0) -> bool:
    """Whether two numbers or arrays are the same, entry by entry; of 0 only ``atol`` is near."""
    a, b = np.ravel(one), np.ravel(other)
    return a.shape == b.shape and bool(np.all(np.abs(a - b) <= atol + rtol * np.maximum(np.abs(a), np.abs(b))))


def same_polynomial(one: ArrayLike, other: ArrayLike, rtol: float = CARRIED) -> bool:
    """Whether two polynomials, highest power first and 1, have the same coefficients."""
    a, b = np.ravel(np.real(one)), np.ravel(np.real(other))
    if a.shape != b.shape:
        return False
    fastest = max(1.0, float(np.abs(np.roots(b)).max(initial=0.0)))
    room = rtol * np.abs(b) + _LOST * fastest ** np.arange(b.size)
    return bool(np.all(np.abs(a - b) <= room))


def same_poles(one: ArrayLike, other: ArrayLike, rtol: float = CARRIED) -> bool:
    """Whether two sets of poles are the same, each within a part of the fastest one of the second."""
    left, right = list(np.ravel(one)), list(np.ravel(other))
    room = rtol * max(np.abs(right).max(), 1e-9)
    for pole in right:
        nearest = min(left, key=lambda candidate: abs(candidate - pole), default=None)
        if nearest is None or abs(nearest - pole) > room:
            return False
        left.remove(nearest)
    return not left


def listed(poles: ArrayLike) -> str:
    """Poles for people, slowest first."""
    return ", ".join(f"{complex(p):.3g}" if abs(p.imag) > 1e-6 else f"{p.real:.3g}" for p in _sorted(poles))


def _sorted(poles: ArrayLike) -> list[Any]:
    return sorted(np.ravel(np.asarray(poles, dtype=complex)), key=lambda p: (round(-p.real, 6), p.imag))


#: Ratio of what is given to what is expected → what that ratio is usually due to.
UNITS = (
    (1 / HZ, "hertz in place of rad/s"),
    (HZ, "rad/s in place of hertz"),
    (DEG, "radians in place of degrees"),
    (1 / DEG, "degrees in place of radians"),
    (1e3, "a thousandth of the unit that is asked for: g for kg, mm for m, ms for s, mN for N"),
    (1e-3, "a thousand times the unit that is asked for: kg for g, m for mm, s for ms"),
    (1e7, "g·cm² in place of kg·m²"),
    (1e4, "kg·cm² in place of kg·m²"),
    (HZ**-2, "the frequency in hertz, squared"),
)


def unit_of(ratio: float, room: float = BUILT) -> str:
    """What a number that is so many times too large may be due to; "" if no unit is that."""
    return next((why for factor, why in UNITS if abs(ratio / factor - 1) <= room), "")
