"""Units: how they are written, how large they are, and which of them are easily taken for each other."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import pi
from typing import Any

from labcourse.answers.json_values import FormError
from labcourse.patterns import SHORT


@dataclass(frozen=True)
class Unit:
    """A unit, and how it is written.

    Attributes
    ----------
    name : shown to people; with its prefix or factor if a label names it so
    size : of one such unit, in the SI unit of its quantity
    symbols, names : ways to write it, in lower case, with spaces between; of names, the singular is first
    prefixed : whether it takes prefixes on the axis of a figure, as in ms
    quantity : what it measures; "" for one that only figures have
    zero : value of its zero, in the SI unit
    """

    name: str
    size: float
    symbols: str = ""
    names: str = ""
    prefixed: bool = False
    quantity: str = ""
    zero: float = 0.0


_TABLE = (
    Unit("s", 1.0, "s sec secs", "second seconds", prefixed=True, quantity="time"),
    Unit("ms", 1e-3, "ms", "millisecond milliseconds", quantity="time"),
    Unit("min", 60.0, "min mins", "minute minutes", quantity="time"),
    Unit("h", 3600.0, "h hr hrs", "hour hours", quantity="time"),
    Unit("d", 86_400.0, "d", "day days", quantity="time"),
    Unit("rad", 1.0, "rad rads", "radian radians", prefixed=True, quantity="angle"),
    Unit("deg", pi / 180, "° deg degs", "degree degrees", quantity="angle"),
    Unit("rev", 2 * pi, "rev revs", "turn turns revolution revolutions", quantity="angle"),
    Unit("Hz", 1.0, "hz", "hertz", prefixed=True, quantity="frequency"),
    Unit("kHz", 1e3, "khz", "kilohertz", quantity="frequency"),
    Unit("m", 1.0, "m", "metre metres", prefixed=True, quantity="length"),
    Unit("cm", 1e-2, "cm", "centimetre centimetres", quantity="length"),
    Unit("mm", 1e-3, "mm", "millimetre millimetres", quantity="length"),
    Unit("kg", 1.0, "kg", "kilogram kilograms", quantity="mass"),
    Unit("g", 1e-3, "g", "gram grams", quantity="mass"),
    Unit("K", 1.0, "k", "kelvin", quantity="temperature"),
    Unit("°C", 1.0, "°c", "celsius", quantity="temperature", zero=273.15),
    Unit("V", 1.0, "v", "volt volts", prefixed=True, quantity="voltage"),
    Unit("mV", 1e-3, "mv", "millivolt millivolts", quantity="voltage"),
    Unit("A", 1.0, "a", "ampere amperes", prefixed=True, quantity="current"),
    Unit("mA", 1e-3, "ma", "milliampere milliamperes", quantity="current"),
    Unit("Pa", 1.0, "pa", "pascal pascals", prefixed=True, quantity="pressure"),
    Unit("kPa", 1e3, "kpa", "kilopascal kilopascals", quantity="pressure"),
    Unit("bar", 1e5, "bar", "bar", prefixed=True, quantity="pressure"),
    Unit("1", 1.0, "1", "fraction", quantity="ratio"),
    Unit("%", 1e-2, "%", "percent", quantity="ratio"),
)
UNITS = {unit.name: unit for unit in _TABLE}  #: name → unit
#: (factor, offset, name): the number times the factor, plus the offset, is in the unit.
UnitSlip = tuple[float, float, str]
_POWERS = {"²": 2, "³": 3}
_FAR = 1000.0  # ratio of units that nobody takes for each other in a quotient that has another slip already


def slips(text: str) -> Iterator[list[UnitSlip]]:
    """Yield groups of what a number may have been given in if it is not in a unit, likelier groups first.

    Parameters
    ----------
    text : the unit, a product or a quotient of products, as in "rad/s" or "kg·m²"; "" for a number without one
    """
    over, _, under = (text or "1").partition("/")
    tops, bottoms = list(_others(over)), list(_others(under))
    yield [(ratio, 0.0 if under else zero, _in(name, under)) for ratio, zero, name in tops if ratio != 1 or not under]
    squared = [((2 * pi) ** 2, 0.0, "computed from a frequency in hertz")] if under == "rad" else []  # as k = J ω²
    yield squared + [(1 / ratio, 0.0, f"per {_word(name)}") for ratio, _zero, name in bottoms if ratio != 1]
    near = [(size, name) for size, _zero, name in bottoms if 1 / _FAR <= size <= _FAR]
    yield [(top / bottom, 0.0, _in(name, below)) for top, _zero, name in tops for bottom, below in near]


def rough_slips(text: str) -> Iterator[list[UnitSlip]]:
    """Yield groups of factors by which a number in a unit is often off, wherever they come from."""
    angles = {180 / pi: "180/pi, as between degrees and radians", 2 * pi: "2 pi, as between hertz and rad/s"}
    for factors in (angles if "rad" in text or "deg" in text else {}, {1000.0: "a factor of 1000 (milli, kilo)"}):
        yield [(by, 0.0, f"off by {name}") for factor, name in factors.items() for by in (factor, 1 / factor)]


def plain(value: Any, unit: str) -> Any:
    """Return the magnitude in a unit of a quantity of the package pint; any other value as it is.

    Without a unit, as of a matrix with several, it is that in SI units. Raises FormError if it cannot be converted.
    """
    if not hasattr(value, "to_base_units"):
        return value
    try:
        return (value.to(unit) if unit else value.to_base_units()).magnitude
    except Exception as error:  # pint's, which is not imported here
        raise FormError(f"it cannot be turned into {unit or 'SI units'}: {str(error)[:SHORT]}") from None


def _others(product: str) -> Iterator[tuple[float, float, str]]:
    """Yield products that are easily taken for another one: (size, zero, product), both in that product."""
    factors = product.split("·")
    for place, factor in enumerate(factors):
        name = factor.rstrip("²³")
        unit, power = UNITS.get(name), factor.removeprefix(name)
        for other in UNITS.values():
            if unit and other is not unit and other.quantity == unit.quantity:
                named = "·".join([*factors[:place], other.name + power, *factors[place + 1 :]])
                zero = (other.zero - unit.zero) / unit.size if factor == product else 0.0
                yield (other.size / unit.size) ** _POWERS.get(power, 1), zero, named


def _in(over: str, under: str) -> str:
    """Return a unit in words: "in degrees per second", "in kg·cm²"."""
    if over not in UNITS or (under and under not in UNITS):
        return f"in {over}/{under}" if under else f"in {over}"
    words = UNITS[over].names.split()[-1] + (f" per {_word(under)}" if under else "")
    return f"in {words}".replace("revolutions per second", "hertz").replace("in fraction", "a fraction")


def _word(name: str) -> str:
    """Return the singular of a unit in words, or the unit as it is."""
    return UNITS[name].names.split()[-2:][0] if name in UNITS else name
