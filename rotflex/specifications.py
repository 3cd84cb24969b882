"""The control task (Section 3.1): the command, the limits that the response must keep, and the desired poles.

Each number stands here, and nowhere else in the code.
"""

from __future__ import annotations

from dataclasses import dataclass

from rotflex.units import DEG

# --- the command: a square wave, its slope limited (Section 3.4) ----------------------------------------------------

AMPLITUDE = 20 * DEG  #: rad
FREQUENCY = 0.33  #: Hz
RATE = 100.0  #: 1/s, limit on the slope of the unit wave
DURATION = 10.0  #: s
SAMPLE_TIME = 0.002  #: s

# --- the limits -------------------------------------------------------------------------------------------------------

SETTLING_BAND = 0.04  #: half width, of the final angle


@dataclass(frozen=True)
class Specification:
    """A limit: ``quantity``, of :class:`rotflex.response.Summary`, must not exceed ``limit``, in ``unit``."""

    number: int
    name: str
    quantity: str
    limit: float
    unit: str


SPECIFICATIONS = (
    Specification(1, f"servo angle {100 * SETTLING_BAND:g} % settling time", "settling_time", 0.5, "s"),
    Specification(2, "servo angle overshoot", "overshoot", 5.0, "%"),
    Specification(3, "largest link deflection", "max_alpha", 12.5 * DEG, "rad"),
    Specification(4, "largest motor voltage", "max_vm", 10.0, "V"),
)
#: quantity → limit
LIMITS = {one.quantity: one.limit for one in SPECIFICATIONS}

# --- the desired poles (Equations 3.11 and 3.12) ----------------------------------------------------------------------

ZETA = 0.6  #: damping ratio of the dominant pair
OMEGA_N = 20.0  #: natural frequency of the dominant pair, rad/s
P_3, P_4 = -30.0, -40.0  #: the other two, rad/s
