"""The units that the label of an axis names."""

from __future__ import annotations

import re
from functools import lru_cache

from labcourse.answers.kinds.axis_labels import plain, unit_places
from labcourse.grading.marking.unit_words import PREFIXES, TIME, Named, Quantity, Unit

_RATE = re.compile(r"(.+?)(?:\s*/\s*|\s+per\s+)(.+)")
_INVERSE = re.compile(r"(.*?)[\s·.*]*(\w+)\s*\^\s*-1")
_FACTOR = re.compile(
    r"[×x*·]?\s*(?:10\s*\^\s*(?P<power>[+-]?\d{1,2})|(?P<number>\d{0,9}\.?\d{1,9}(?:e[+-]?\d{1,2})?))\s*"
    r"[×x*·]?\s*(?P<rest>[^\d/\s^].*)"
)
_RATHER_MORE = re.compile(r"[/·]|\^\s*-|^per\b")  # after a unit: it was but the first of a product
_COLUMN = re.compile(r"[^\W_]{3,}_(\w+)")  # "time_ms", as columns of tables are named


@lru_cache
def named(label: str, quantity: Quantity) -> tuple[Named, ...]:
    """The units of a quantity that a label names, with the prefix or factor that goes with each."""
    found = [_read(place, quantity) for place in unit_places(label)]
    text = plain(label)
    if not any(found):
        columns = (_spelt(quantity.units).get(column[1]) for column in _COLUMN.finditer(text))
        found = [*columns, _at_the_end(text, quantity)]
    return tuple(dict.fromkeys(filter(None, found)))


def _at_the_end(text: str, quantity: Quantity) -> Named | None:
    """A unit that is all of the label, or its full name as the last word, or the sign for degrees at the end."""
    whole, last = text.strip("()[]. "), text.rpartition(" ")[2].strip("().")
    spelt = _spelt(quantity.units)
    return spelt.get(whole) or _spelt(quantity.units, full=True).get(last) or spelt.get("°" if last[-1:] == "°" else "")


def _read(place: str, quantity: Quantity) -> Named | None:
    """The unit that a text is, or begins with as a word of its own."""
    factor, text = 1.0, place
    if (scaled := _FACTOR.fullmatch(place)) is not None:
        factor = 10.0 ** int(scaled["power"]) if scaled["power"] else float(scaled["number"])
        text = scaled["rest"]
    word, _space, more = text.partition(" ")
    found = _spelt(quantity.units).get(text.replace(" ", "")) or _rate(text, quantity.per_time)
    if found is None and not _RATHER_MORE.search(more):
        found = _spelt(quantity.units).get(word.strip(".,;:"))
    if found is None or factor == 1:
        return found
    return Named(f"{factor:g} {found.name}", factor * found.size) if factor > 0 else None


def _rate(text: str, units: tuple[Unit, ...]) -> Named | None:
    """So many of a unit in a time: "rad/s", "rad s^-1", "1/s"."""
    parts = (_RATE.fullmatch(text) or _INVERSE.fullmatch(text)) if units else None
    if parts is None:
        return None
    counted, time = _spelt(units).get(parts[1].strip() or "1"), _spelt(TIME.units).get(parts[2].strip())
    return Named(f"{counted.name}/{time.name}", counted.size / time.size) if counted and time else None


@lru_cache
def _spelt(units: tuple[Unit, ...], full: bool = False) -> dict[str, Named]:
    """How units may be written, with each prefix or without; in full, by their names alone."""
    found: dict[str, Named] = {}
    for unit in units:
        symbols, names = [] if full else unit.symbols.split(), unit.names.split()
        found |= {word: Named(unit.name, unit.size) for word in [*symbols, *names]}
        for size, (letters, prefix) in PREFIXES.items() if unit.prefixed else ():
            prefixed = Named(letters[0] + unit.name, size * unit.size)
            found |= {letter + symbol: prefixed for letter in letters.split() for symbol in symbols}
            found |= {prefix + word: prefixed for word in [*symbols, *names]}
    return found
