"""Other ways of reading and rounding rightly, carried on into all that builds on them."""

from collections.abc import Callable
from typing import Any

import numpy as np
from right_ways_types import Ways
from working_through import FULL, Change, Where, digits

from rotflex.course.questions import CATALOGUE
from rotflex.units import HZ

OMEGA_N, K_S = ("2.11", "omega_n"), ("2.12", "K_s")
KINDS = {(q.number, p.name): p.kind for q in CATALOGUE.everything.values() for p in q.parts}
ALL_NUMBERS = [where for where in FULL if KINDS[where] in ("number", "matrix", "poles") and where[0] != "0.1"]
WAYS = Ways("readings")
ROUNDED = Ways("rounding")


def to(step: float, unit: float = 1.0) -> Change:
    """Reads a number off a scale with marks every ``step`` of a unit."""
    return lambda value: round(float(value) / unit / step) * step * unit


WAYS.carry("by eye, 0.05 Hz", lambda lab: {OMEGA_N: to(0.05, HZ)})
WAYS.carry("by eye, 3 % high", lambda lab: {OMEGA_N: lambda omega_n: 1.03 * omega_n})
WAYS.carry("by eye, 3 % low", lambda lab: {OMEGA_N: lambda omega_n: 0.97 * omega_n})
WAYS.carry("J_l in whole tenths of a g·m²", lambda lab: {("2.12", "J_l"): to(1e-5)})


QUESTIONS = ("3.12", "3.14", "3.16")


def rounding(wheres: list[Where], count: int) -> Callable[[Any], dict[Where, Change]]:
    return lambda lab: dict.fromkeys(wheres, digits(count))


ROUNDED.carry("each step to three digits", rounding(ALL_NUMBERS, 3))
for place in ("2.14 A", "2.18 poles", "3.2 polynomial", "3.5 K_c", "3.7 T", "3.7 W", "3.8 K"):
    question, name = place.split()
    ROUNDED.carry(f"{place} to three digits", rounding([(question, name)], 3))
#: What three digits may be off by, of each entry of the companion matrix's last row: it carries on into T_c.
WORST = np.vstack([np.ones((3, 4)), [1, 1.004, 1.004, 0.996]])
ROUNDED.carry(
    "3.3 A_c to three digits, at worst",
    lambda lab: {("3.3", "A_c"): lambda A_c: A_c * WORST},
)
ROUNDED.carry("omega_n to two digits", rounding([OMEGA_N], 2))
ROUNDED.carry("K_s to two digits", rounding([K_S], 2))
ROUNDED.carry("omega_n and K_s to two digits", rounding([OMEGA_N, K_S], 2))
ROUNDED.carry(
    "by eye, 3 % high, then K_s to two digits",
    lambda lab: {OMEGA_N: lambda omega_n: 1.03 * omega_n, **rounding([K_S], 2)(lab)},
)
ROUNDED.carry(
    "measured to two digits, all else to three",
    lambda lab: {**rounding(ALL_NUMBERS, 3)(lab), **rounding([OMEGA_N, K_S], 2)(lab)},
)
ROUNDED.carry(
    "responses to two digits, angles to three",
    lambda lab: {
        **rounding([(q, name) for q in QUESTIONS for name in ("t_s", "PO", "V_max")], 2)(lab),
        **rounding([(q, "alpha_max_deg") for q in QUESTIONS], 3)(lab),
    },
)
