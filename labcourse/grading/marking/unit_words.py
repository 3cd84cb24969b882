"""Units as they are written on axes: symbols, which are the same in every language, and English words.

Symbols take the letters of prefixes (ms), names take their words (milliseconds). All are written in small letters here.
:mod:`labcourse.grading.marking.named_units` reads them off a label.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

DEG = math.pi / 180  # rad per degree


@dataclass(frozen=True)
class Unit:
    """A unit, its size in the SI's, and how it is written.

    Attributes
    ----------
    name : for people
    size : one of it, in the SI's unit
    symbols, names : in small letters, with spaces between
    prefixed : whether there are thousandths of it, and thousands
    """

    name: str
    size: float
    symbols: str
    names: str = ""
    prefixed: bool = False


@dataclass(frozen=True)
class Named:
    """What a label names: a unit, perhaps with a prefix or a factor, and its size in the SI's."""

    name: str
    size: float


@dataclass(frozen=True)
class Quantity:
    """The units of a quantity.

    Attributes
    ----------
    units : that it may be drawn in
    usual : that a curve is tried in whose label does not say
    per_time : units of which so many in a time are units of it, too; None where there are none
    """

    units: tuple[Unit, ...]
    usual: tuple[Named, ...]
    per_time: tuple[Unit, ...] = ()

    @property
    def example(self) -> str:
        """Return a symbol and, if there is one, an English word: “deg” or “degrees”."""
        return " or ".join(f"“{text}”" for text in (self.usual[0].name, *self.units[0].names.split()[-1:]))


def quantity(symbol: str, symbols: str = "", names: str = "") -> Quantity:
    """Return a quantity that is drawn in one SI unit.

    Parameters
    ----------
    symbol : of the unit, as in "K"
    symbols, names : other ways to write it, in small letters, with spaces between
    """
    return Quantity((Unit(symbol, 1.0, f"{symbol.lower()} {symbols}", names),), (Named(symbol, 1.0),))


_SECOND = Unit("s", 1.0, "s sec secs", "second seconds", prefixed=True)
_MINUTE = Unit("min", 60.0, "min mins", "minute minutes")
_RADIAN = Unit("rad", 1.0, "rad rads", "radian radians", prefixed=True)
_DEGREE = Unit("deg", DEG, "° deg degs", "degree degrees")
TURN = Unit("rev", 2 * math.pi, "rev revs", "turn turns revolution revolutions")
_VOLT = Unit("V", 1.0, "v", "volt volts", prefixed=True)
_HERTZ = Unit("Hz", 1.0, "hz", "hertz", prefixed=True)

TIME = Quantity((_SECOND, _MINUTE), (Named("s", 1.0), Named("ms", 1e-3), Named("min", 60.0), Named("μs", 1e-6)))
ANGLE = Quantity((_DEGREE, _RADIAN, TURN), (Named("deg", DEG), Named("rad", 1.0), Named("mrad", 1e-3)))
VOLTAGE = Quantity((_VOLT,), (Named("V", 1.0), Named("mV", 1e-3)))
FREQUENCY = Quantity(
    (_HERTZ,),
    (Named("Hz", 1.0), Named("rad/s", 0.5 / math.pi), Named("kHz", 1e3)),
    per_time=(
        Unit("1", 1.0, "1", "cycles periods"),
        *(replace(unit, size=unit.size / TURN.size) for unit in (_RADIAN, _DEGREE, TURN)),
    ),
)

#: Size → letters before symbols, of which the first is shown, and the word before names.
PREFIXES = {1e-3: ("m", "milli"), 1e-6: ("μ u", "micro"), 1e3: ("k", "kilo")}
