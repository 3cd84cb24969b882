"""Units on the axes of figures: symbols, which are the same in every language, and English words.

Symbols take the letters of prefixes (ms), names take their words (milliseconds). All are in lower case here.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

from labcourse.answers.figures import normalized, unit_places
from labcourse.answers.units import UNITS, Unit
from labcourse.patterns import pattern


@dataclass(frozen=True)
class Quantity:
    """The units of a quantity.

    Attributes
    ----------
    units : in which it may be drawn
    usual : units that are tried for a curve if the label of its axis names none
    per_time : units that become units of this quantity when divided by a time, as rad in rad/s
    """

    units: tuple[Unit, ...]
    usual: tuple[Unit, ...]
    per_time: tuple[Unit, ...] = ()

    @property
    def example(self) -> str:
        """A symbol and, if there is one, an English word, for messages: “deg” or “degrees”."""
        return " or ".join(f"“{text}”" for text in (self.usual[0].name, *self.units[0].names.split()[-1:]))


def quantity(symbol: str, symbols: str = "", names: str = "") -> Quantity:
    """Return a quantity that is drawn in one SI unit.

    Parameters
    ----------
    symbol : of the unit, as in "K"
    symbols, names : other ways to write it, in lower case, with spaces between
    """
    return Quantity((Unit(symbol, 1.0, f"{symbol.lower()} {symbols}", names),), (Unit(symbol, 1.0),))


_UNITS_OF_TIME = tuple(UNITS[name] for name in ("s", "min", "h", "d"))
#: That a recording is drawn over: its sample time is in s, whatever the plant.
TIME = Quantity(_UNITS_OF_TIME, (*_UNITS_OF_TIME, Unit("ms", 1e-3), Unit("μs", 1e-6)))

#: Size → letters before symbols, of which the first is shown, and the word before names.
PREFIXES = {1e-3: ("m", "milli"), 1e-6: ("μ u", "micro"), 1e3: ("k", "kilo")}


# --- units that a label names -----------------------------------------------------------------------------------------

_PER_TIME = pattern(r"(.+?)(?:\s*/\s*|\s+per\s+)(.+)")
_INVERSE = pattern(r"(.*?)[\s·.*]*(\w+)\s*\^\s*-1")
_FACTOR = pattern(
    r"[×x*·]?\s*(?:10\s*\^\s*(?P<power>[+-]?\d{1,2})|(?P<number>\d{0,9}\.?\d{1,9}(?:e[+-]?\d{1,2})?))\s*"
    r"[×x*·]?\s*(?P<rest>[^\d/\s^].*)"
)
_PRODUCT = pattern(r"[/·]|\^\s*-|^per\b")  # after a unit: it was only the first of a product
_COLUMN = pattern(r"[^\W_]{3,}_(\w+)")  # "time_ms", as columns of tables are named


@lru_cache
def units_in_label(label: str, quantity: Quantity) -> tuple[Unit, ...]:
    """Return the units of a quantity that an axis label names, each with its prefix or factor; often one or none."""
    units = [_unit_at_start(place, quantity) for place in unit_places(label)]
    if not any(units):
        text = normalized(label)
        columns = (_spellings(quantity.units).get(column[1]) for column in _COLUMN.finditer(text))
        units = [*columns, _unit_of_bare_label(text, quantity)]
    return tuple(dict.fromkeys(filter(None, units)))


def _unit_of_bare_label(text: str, quantity: Quantity) -> Unit | None:
    """Return the unit of a label in which no unit is set apart, for example by brackets; None if it has none.

    The unit is the whole label, or its last word if that is a unit's full name, or a sign for degrees at its end.
    """
    whole, last = text.strip("()[]. "), text.rpartition(" ")[2].strip("().")
    known, full_names = _spellings(quantity.units), _spellings(quantity.units, full=True)
    return known.get(whole) or full_names.get(last) or known.get("°" if last[-1:] == "°" else "")


def _unit_at_start(place: str, quantity: Quantity) -> Unit | None:
    """Return the unit that a text is, or with which it begins as a separate word, with its factor; None without one."""
    factor, text = 1.0, place
    if (scaled := _FACTOR.fullmatch(place)) is not None:
        factor = 10.0 ** int(scaled["power"]) if scaled["power"] else float(scaled["number"])
        text = scaled["rest"]
    word, _space, more = text.partition(" ")
    unit = _spellings(quantity.units).get(text.replace(" ", "")) or _unit_per_time(text, quantity.per_time)
    if unit is None and not _PRODUCT.search(more):
        unit = _spellings(quantity.units).get(word.strip(".,;:"))
    if unit is None or factor == 1:
        return unit
    return Unit(f"{factor:g} {unit.name}", factor * unit.size) if factor > 0 else None


def _unit_per_time(text: str, units: tuple[Unit, ...]) -> Unit | None:
    """Return the unit of a text such as "rad/s", "rad s^-1", "1/s", counted in one of ``units``; None if it is none."""
    parts = (_PER_TIME.fullmatch(text) or _INVERSE.fullmatch(text)) if units else None
    if parts is None:
        return None
    counted, time = _spellings(units).get(parts[1].strip() or "1"), _spellings(TIME.units).get(parts[2].strip())
    return Unit(f"{counted.name}/{time.name}", counted.size / time.size) if counted and time else None


@lru_cache
def _spellings(units: tuple[Unit, ...], full: bool = False) -> dict[str, Unit]:
    """Return spelling → unit, with each prefix and without; of names ("seconds") alone, not of symbols, if ``full``."""
    spellings: dict[str, Unit] = {}
    for unit in units:
        symbols, names = [] if full else unit.symbols.split(), unit.names.split()
        spellings |= {word: Unit(unit.name, unit.size) for word in [*symbols, *names]}
        for size, (letters, prefix) in PREFIXES.items() if unit.prefixed else ():
            prefixed = Unit(letters[0] + unit.name, size * unit.size)
            spellings |= {letter + symbol: prefixed for letter in letters.split() for symbol in symbols}
            spellings |= {prefix + word: prefixed for word in [*symbols, *names]}
    return spellings
