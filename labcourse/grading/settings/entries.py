"""What may stand in ``course.toml``: sections, their entries, what each has to be, and an example."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from datetime import date
from typing import Any

from labcourse.benches import MOST_SEED, WHICH, is_names, is_seed

_LONGEST = 120  # characters of a title; a line
_FACTORS = (0.001, 1000)  # the smallest and the largest number that points are multiplied by
_YEARS = range(2000, 3000)
LEVELS = ("4", "3", "2", "1")  #: as they stand in the file; 0 is worth nothing by its meaning


@dataclass(frozen=True)
class Entry:
    """What may stand under a name.

    Attributes
    ----------
    expected : in words
    example : as it may stand in the file
    fits : a value → whether it may stand there
    needed : whether a section is nothing without it
    """

    expected: str
    example: str
    fits: Callable[[Any], bool]
    needed: bool = False

    def wanted(self, key: str, what: str) -> str:
        """A fault in the entry of a key, with what is expected there, and an example."""
        return f"{key}: {what} {self.expected}, as in: {self.example}"


# --- what values are like ---------------------------------------------------------------------------------------------


def _is_line(value: object) -> bool:
    return isinstance(value, str) and value.isprintable() and len(value) <= _LONGEST and value == value.strip()


def _is_name(value: object) -> bool:
    return _is_line(value) and bool(value)


def _is_version(value: object) -> bool:
    return isinstance(value, str) and re.fullmatch(r"3\.\d{1,2}", value) is not None


def _is_bool(value: object) -> bool:
    return isinstance(value, bool)


def _is_date(value: object) -> bool:
    """A date and time is one, too; of years in which it can be reckoned with hours and zones."""
    return isinstance(value, date) and value.year in _YEARS


def _are_names(value: object) -> bool:
    return isinstance(value, list) and bool(value) and all(map(_is_name, value))


def _is_number(value: object, least: float, most: float) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and least <= value <= most


def _are_weights(value: object) -> bool:
    return isinstance(value, dict) and all(_is_name(name) and _is_number(one, *_FACTORS) for name, one in value.items())


def _are_levels(value: object) -> bool:
    return isinstance(value, dict) and all(name in LEVELS and _is_number(one, 0, 100) for name, one in value.items())


# --- entries of a kind ------------------------------------------------------------------------------------------------


def _line(example: str, fits: Callable[[Any], bool]) -> Entry:
    return Entry(f"a line of text of at most {_LONGEST} characters", example, fits)


def _switch(example: str) -> Entry:
    return Entry("true or false", example, _is_bool)


def _moment(example: str, needed: bool = False) -> Entry:
    expected = f"a date, or a date and time, of the years {_YEARS[0]} to {_YEARS[-1]}"
    return Entry(expected, example, _is_date, needed)


def _names(of: str, example: str) -> Entry:
    return Entry(of, example, _are_names)


def _number(example: str, least: float, most: float, unit: str = "") -> Entry:
    of = f" of {unit}" if unit else ""
    expected = f"a number{of} from {least:g} to {most:g}"
    return Entry(expected, example, lambda value: _is_number(value, least, most))


def _whole(example: str, least: int, most: int) -> Entry:
    return Entry(
        f"a whole number from {least} to {most}",
        example,
        lambda value: isinstance(value, int) and _is_number(value, least, most),
    )


def _of_levels(example: str) -> Entry:
    expected = f"numbers from 0 to 100, in per cent, for levels of {', '.join(LEVELS)}"
    return Entry(expected, example, _are_levels)


_NOTEBOOKS = _names("names of the course's notebooks", 'notebooks = ["01_first_lab"]')
_SECTION = Entry("the name of a section of the roster", 'section = "B"', _is_name)
_QUESTIONS = "names of questions, or of a question and a part"

#: Section → name → what may stand there.
SECTIONS: Mapping[str, Mapping[str, Entry]] = {
    "course": {
        "title": _line('title = "Control laboratory"', _is_name),
        "term": _line('term = "2026 autumn"', _is_line),
        "python": Entry(
            "a version of Python, in quotes",
            f'python = "{sys.version_info.major}.{sys.version_info.minor}"',
            _is_version,
        ),
    },
    "bench": {
        "which": Entry('"own", "same", "preset" or "real"', 'which = "own"', lambda value: value in WHICH),
        "seed": Entry(f"a whole number from 0 to {MOST_SEED}", "seed = 2026", is_seed),
        "preset": Entry("the name of a bench", 'preset = "workshop"', _is_name),
        "benches": Entry(
            "names of the laboratory's benches", 'benches = ["north"]', lambda value: is_names(value) and bool(value)
        ),
    },
    "given": {
        "from": Entry("what is given to a class that begins in the middle", 'from = "speed"', _is_name),
    },
    "feedback": {
        "points": _switch("points = true"),
        "reasons": _switch("reasons = true"),
        "from": _moment("from = 2026-12-01T12:00:00+01:00"),
    },
    "reflect": {
        "asks": _switch("asks = true"),
        "from": _moment("from = 2026-11-02T08:00:00+01:00"),
    },
    "report": {
        "page_limit": _whole("page_limit = 12", 1, 1000),
    },
    "releases": {
        "folder": Entry("the path of a folder", 'folder = "releases"', _is_name),
    },
    "marks": {
        "drop": _names(_QUESTIONS, 'drop = ["1.2", "1.3 speed"]'),
        "weights": Entry(
            f"{_QUESTIONS}, in quotes, each with a number from {_FACTORS[0]:g} to {_FACTORS[1]:g}",
            'weights = {"1.2" = 2.0, "1.3 speed" = 0.5}',
            _are_weights,
        ),
        "out_of": _number("out_of = 100", *_FACTORS),
        "decimals": _whole("decimals = 2", 0, 4),
        "predictions": _number("predictions = 0.5", 0, 100, "points"),
    },
    "levels": {
        "shares": _of_levels("shares = {4 = 100, 3 = 75, 2 = 50, 1 = 25}"),
        "thresholds": _of_levels("thresholds = {4 = 90, 3 = 75, 2 = 50, 1 = 0}"),
    },
    "deadline": {
        "due": _moment("due = 2026-11-21", needed=True),
        "notebooks": _NOTEBOOKS,
        "section": _SECTION,
    },
    "extension": {
        "until": _moment("until = 2026-11-28T12:00:00+01:00", needed=True),
        "students": _names("students' IDs", 'students = ["ada"]'),
        "section": _SECTION,
        "notebooks": _NOTEBOOKS,
    },
    "late": {
        "per_day": _number("per_day = 10", 0, 100, "per cent"),
        "cap": _number("cap = 50", 0, 100, "per cent"),
        "grace_hours": _number("grace_hours = 2", 0, 1000, "hours"),
    },
    "outcomes": {
        "level": _whole("level = 3", 1, 4),
        "share": _number("share = 70", 0, 100, "per cent"),
        "fewest": _whole("fewest = 5", 1, 1000),
    },
}
SEVERAL = ("deadline", "extension")  #: sections of which there may be several, each under [[…]]
#: Entries that earlier versions had → what to do about them.
GONE = {("course", "language"): "messages and notebooks are in English only; delete this line."}


def heading(section: str) -> str:
    """The line that a section begins with."""
    return f"[[{section}]]" if section in SEVERAL else f"[{section}]"


# --- what is not like that --------------------------------------------------------------------------------------------


def misfits(found: Mapping[str, Any]) -> Iterator[str]:
    """Unknown names, and values of another form than is expected."""
    for section, given in found.items():
        entries = SECTIONS.get(section)
        if entries is None:
            places = [heading(name) for name, known in SECTIONS.items() if section in known]
            hint = f"it belongs under {places[0]}" if places else _known(map(heading, SECTIONS))
            yield f"{section}: there is no such section; {hint}."
        elif section in SEVERAL:
            yield from _several(section, given, entries)
        elif not isinstance(given, Mapping):
            yield f"{section}: it should be a section, a line [{section}] with its entries below."
        else:
            yield from _in_section(section, given, entries)


def _several(section: str, given: Any, entries: Mapping[str, Entry]) -> Iterator[str]:
    if not isinstance(given, list) or not all(isinstance(one, Mapping) for one in given):
        yield (
            f"{section}: there may be several, so that each begins with a line [[{section}]], with two brackets "
            "on either side."
        )
        return
    for place, one in enumerate(given, 1):
        key = numbered(section, place)
        yield from _in_section(key, one, entries)
        for name, entry in entries.items():
            if entry.needed and name not in one:
                yield entry.wanted(f"{key}.{name}", "it is missing. It should be")


def _in_section(key: str, given: Mapping[str, Any], entries: Mapping[str, Entry]) -> Iterator[str]:
    for name, value in given.items():
        entry = entries.get(name)
        if (key, name) in GONE:
            yield f"{key}.{name}: {GONE[key, name]}"
        elif entry is None:
            yield f"{key}.{name}: there is no such entry; {_known(entries)}."
        elif not entry.fits(value):
            yield entry.wanted(f"{key}.{name}", f"it is {value!a:.80}, and should be")


def numbered(section: str, place: int) -> str:
    """How one of several sections is named in a message: as "deadline 2", counted as people count."""
    return f"{section} {place}"


def _known(names: Collection[str] | Iterator[str]) -> str:
    return f"there are {', '.join(names)}"
