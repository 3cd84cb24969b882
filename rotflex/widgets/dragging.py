"""Where desired poles come to lie when they are dragged, or set by numbers."""

from __future__ import annotations

import math
from dataclasses import replace

from rotflex.widgets.placement import Dominant

ZETA, OMEGA, REAL = (-1.0, 3.0), (5.0, 40.0), (-80.0, 10.0)  #: damping ratio; rad/s; rad/s: how far each may go
_ON_AXIS = 1.2  # rad/s; a pair that is so near to the real axis is two real poles
_SLOWEST = -0.5  # rad/s, of two real poles of the pair


def within(wanted: Dominant) -> Dominant:
    """The nearest poles that the explorer takes: a pair's faster real pole is no further left than the others."""
    omega_n = _clamped(wanted.omega_n, OMEGA)
    fastest = -REAL[0] / omega_n
    zeta = _clamped(wanted.zeta, (ZETA[0], min(ZETA[1], (fastest + 1 / fastest) / 2)))
    return Dominant(zeta, omega_n, _clamped(wanted.p3, REAL), _clamped(wanted.p4, REAL))


def dragged(wanted: Dominant, name: str, x: float, y: float) -> Dominant:
    """The poles, after the one with a name ("pair", "partner", "p3", "p4") was dragged to (x, y), rad/s.

    A pair that comes to the real axis becomes two real poles there, each of which then moves along it; away from the
    axis they are a pair again.
    """
    if name not in ("pair", "partner"):
        return within(replace(wanted, **{name: x}))
    if abs(y) > _ON_AXIS or x > _SLOWEST:
        size = math.hypot(x, y) or 1.0
        return within(replace(wanted, zeta=-x / size, omega_n=size))
    if wanted.zeta < 1:
        return within(replace(wanted, zeta=1.0, omega_n=-x))
    slow, fast = wanted.pair.real, wanted.partner.real
    slow, fast = (max(x, fast), fast) if name == "pair" else (slow, min(x, slow))
    omega_n = math.sqrt(slow * fast)
    return within(replace(wanted, zeta=max(1.0, -(slow + fast) / (2 * omega_n)), omega_n=omega_n))


def _clamped(value: float, limits: tuple[float, float]) -> float:
    return min(max(float(value), limits[0]), limits[1])
