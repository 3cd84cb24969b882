"""Units as they are typed in a text: of which quantity they can be, and of what size they are."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

_NONE = (0, 0, 0, 0)
#: Unit → powers of kilogram, metre, second and ampere; and its size in these. An angle has no power, only a size.
_KNOWN: dict[str, tuple[tuple[int, int, int, int], float]] = {
    "1": (_NONE, 1.0),
    "rad": (_NONE, 1.0),
    "deg": (_NONE, math.radians(1)),
    "°": (_NONE, math.radians(1)),
    "g": ((1, 0, 0, 0), 1e-3),
    "m": ((0, 1, 0, 0), 1.0),
    "s": ((0, 0, 1, 0), 1.0),
    "min": ((0, 0, 1, 0), 60.0),
    "A": ((0, 0, 0, 1), 1.0),
    "Hz": ((0, 0, -1, 0), math.tau),  # of a sine, as rad/s
    "N": ((1, 1, -2, 0), 1.0),
    "Nm": ((1, 2, -2, 0), 1.0),
    "J": ((1, 2, -2, 0), 1.0),
    "W": ((1, 2, -3, 0), 1.0),
    "Pa": ((1, -1, -2, 0), 1.0),
    "V": ((1, 2, -3, -1), 1.0),
    "Ω": ((1, 2, -3, -2), 1.0),
}
_PREFIXES = {"µ": 1e-6, "μ": 1e-6, "m": 1e-3, "c": 1e-2, "k": 1e3, "M": 1e6}
_RAISED = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹−", "-0123456789-")
_FACTOR = re.compile(r"(?P<unit>[A-Za-zµμΩ°]+|1)(?:\^?\(?(?P<power>-?\d)\)?)?")
_OVER_BRACKETS = re.compile(r"(?P<over>[^()]+)/\((?P<under>[^()]+)\)")
_TIMES = re.compile(r"[·⋅*]")


@dataclass(frozen=True)
class Unit:
    """A unit.

    Attributes
    ----------
    powers : of kilogram, metre, second and ampere
    size : in these; a frequency's as of an angular one
    """

    powers: tuple[int, ...]
    size: float


def parsed(text: str) -> Unit | None:
    """A unit as it is typed, as "N·m/rad" and "kg·m^2"; None where it is not understood, or can be read in two ways."""
    plain = text.strip().translate(_RAISED)
    if within := _OVER_BRACKETS.fullmatch(plain):
        over, under = parsed(within["over"]), parsed(within["under"])
    elif "/" in plain:
        before, _slash, behind_it = plain.rpartition("/")
        if _TIMES.search(behind_it):  # N·m/rad·s
            return None
        over, under = parsed(before), _product(behind_it)
    else:
        return _product(plain)
    if over is None or under is None:
        return None
    powers = tuple(have - less for have, less in zip(over.powers, under.powers, strict=True))
    return Unit(powers, over.size / under.size)


def behind(text: str) -> str:
    """The unit at the beginning of a text, "·" for spaces within it; "" where none is understood there."""
    found: list[str] = []
    for word in text.split():
        plain = word.rstrip(".,;:)") if "(" not in word else word.rstrip(".,;:")
        if parsed(plain) is None or plain == "1":
            break
        found.append(plain)
        if plain != word:
            break
    return "·".join(found)


def _product(text: str) -> Unit | None:
    powers, size = list(_NONE), 1.0
    for factor in _TIMES.split(text):
        match = _FACTOR.fullmatch(factor.strip())
        known = _named(match["unit"]) if match else None
        if match is None or known is None:
            return None
        power = int(match["power"] or 1)
        powers = [have + power * more for have, more in zip(powers, known[0], strict=True)]
        size *= known[1] ** power
    return Unit(tuple(powers), size)


def _named(name: str) -> tuple[tuple[int, int, int, int], float] | None:
    if name in _KNOWN:
        return _KNOWN[name]
    prefix, rest = name[:1], name[1:]
    if prefix in _PREFIXES and rest in _KNOWN and rest not in ("1", "rad", "deg", "°", "min"):
        powers, size = _KNOWN[rest]
        return powers, size * _PREFIXES[prefix]
    return None
