"""Numbers in the texts: units, digits, and whether they are those of a table.

Only what is certain is told. A number may have no unit for a good reason, or be another's; so it is looked at only
where the report itself says what its unit and its value are, or where the sentence ends behind it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation

from rotflex.courseware.messages import _
from rotflex.courseware.report.checks import units
from rotflex.courseware.report.checks.faults import Fault
from rotflex.courseware.report.checks.languages import Language
from rotflex.courseware.report.checks.prose import Reading, spelt, symbol, typed
from rotflex.courseware.report.document import Document, Table

MOST_DIGITS = 6  #: of a number in a text; hardly anything is measured better
MOST_DOUBTED = 2  #: digits of an uncertainty, of which the second is hardly known
_APART = 2  # digits behind the point between the ends of a value and its uncertainty, which are too many
_MINUS = str.maketrans("−⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "--0123456789")
_POWER = r"\s?(?:·|×|\*|x)\s?10(?:\^?\(?[-−]?\d{1,2}\)?|[⁻⁰¹²³⁴-⁹]{1,3})|[eE][-+−]?\d{1,2}(?!\w)"
_NUMBER = rf"[-−]?(?:\d+[.,]\d+|\d+)(?:{_POWER})?"
_UNIT = (
    r"(?:%|‰|°C?|per cent|percent|Prozent|[µμmkM]?(?:Hz|rad|V|A|W|N|J|Pa|Ω|F|H)|[µμmkc]?[msg]|deg(?:rees)?|Grad|min|h|K"
    r"|rpm|dB|1/s)(?![A-Za-z])"
)
_SPACED_UNIT = r"(?:Hz|kHz|mHz|rad|deg|kg|mm|cm|ms|V|mV|mA|N|Nm|N·m|Pa|kPa|s|rpm)(?![A-Za-z0-9])"
_LONGEST_UNIT = 14  # characters of one
_MISSPELT = re.compile(rf"(?<![\w.,]){_NUMBER}\s?(hz|HZ|KHz|KHZ|khz|Khz|secs?|Secs?|msecs?|KG|Kg|Volts?/s|RAD|Rad)\b")
_DEG = re.compile(rf"{_NUMBER}\s?(deg|°)(?![A-Za-z])")
_CLOSE = re.compile(rf"(?<![\w.,^_-])\d+(?:[.,]\d+)?{_SPACED_UNIT}")
_COMMA = re.compile(rf"(?<![\w.,])(\d+,\d+)\s?{_UNIT}")
_POINT = re.compile(r"(?<![\w.,])\d+\.\d+(?![\w.])")
_LONG = re.compile(r"(?<![\w.,/])\d+\.\d+(?![\w.])")
_END = (
    r"(?=\s*(?:[.;:)]\s*(?:$|\n|[^\d\s])|,\s+\D"
    r"|\((?:(?:see|siehe)\s)?(?:Figure|Fig\.|Table|Tab\.|Abbildung|Abb\.|Tabelle)))"
)
_DOUBTED = re.compile(r"(?<![\w.,])(\d+(?:\.\d+)?)\s*(?:±|\+/-)\s*(\d+(?:\.\d+)?)(?![\w.,]*\d)")
_IS = (
    r"\s*(?:=|≈|:|is|was|of|equals|ist|war|beträgt|von|(?<=every))\s*(?:about |approximately |etwa |rund |ca\. |≈\s*)?"
)
#: What stands before a symbol that is no part of a formula, as in "With a = 3 V": a word, or nothing.
_BEFORE = re.compile(r"(?:^|[^\W\d_]{2,}|[,;:])\s*\Z")
_LATER_UNIT = re.compile(rf"^\s*(?:±|\+/-|to|and|or|bis|und|oder|[,–-])\s*{_NUMBER}")


@dataclass(frozen=True)
class Entry:
    """A number of a table: its digits as written, its unit, and the table."""

    digits: str
    unit: str
    table: Table


def faults(document: Document, readings: Sequence[Reading], language: Language | None) -> Iterator[Fault]:
    """What is wrong with numbers and units in the texts."""
    entries = _entries(document.tables)
    for reading in readings:
        text = spelt(reading.running)
        yield from _written(reading, text)
        if close := _CLOSE.search(text):
            yield _close(reading, close[0])
        yield from _without_unit(reading, text, entries, language)
        if language is not None:
            yield from _other_than_table(reading, entries, language)
    yield from _mixed(readings, language)


def of_pages(readings: Sequence[Reading], language: Language | None) -> Iterator[Fault]:
    """What is wrong with numbers and units on the pages of a document, whose formulas are not known."""
    for reading in readings:
        yield from _written(reading, spelt(reading.running))
    yield from _mixed(readings, language)


# --- how they are written ---------------------------------------------------------------------------------------------


def _written(reading: Reading, text: str) -> Iterator[Fault]:
    if wrong := _MISSPELT.search(text):
        yield Fault(
            "unit spelt",
            _("{where}: the unit “{unit}” is not written so.").format(where=reading.where, unit=wrong[1]),
            _("Capitals tell units apart: m is milli, M is mega; s is a second, S another unit."),
            _("Write Hz, kHz, s, ms, kg, rad."),
            reading.place,
        )
    for match in _LONG.finditer(text):
        digits = match[0].replace(".", "").lstrip("0")
        if len(digits) > MOST_DIGITS:
            yield Fault(
                "digits",
                _("{where}: {number} has {count} digits.").format(
                    where=reading.where, number=match[0], count=len(digits)
                ),
                _("Digits claim an accuracy. A reader who believes them is misled, and others smile."),
                _("Round it to what you can stand for: the uncertainty has one digit, or two."),
                reading.place,
            )
            break
    for match in _DOUBTED.finditer(text):
        if _doubtful(match[1], match[2]):
            yield Fault(
                "uncertainty",
                _("{where}: value and uncertainty do not go together in “{written}”.").format(
                    where=reading.where, written=match[0]
                ),
                _("The uncertainty says which digits of the value are known; here they say different things."),
                _("Give the uncertainty one digit, or two, and end the value at the same place: 2.02 ± 0.06."),
                reading.place,
            )
            return


def _doubtful(value: str, uncertainty: str) -> bool:
    """Whether an uncertainty has too many digits, or its value ends far from where it does."""
    places = [len(one.partition(".")[2]) for one in (value, uncertainty)]
    digits = uncertainty.replace(".", "").lstrip("0")
    known = len(digits if "." in uncertainty else digits.rstrip("0"))
    return known > MOST_DOUBTED or abs(places[0] - places[1]) >= _APART


def _close(reading: Reading, number: str) -> Fault:
    return Fault(
        "unit close",
        _("{where}: there is no space in “{number}”.").format(where=reading.where, number=number),
        _("Number and unit run together, and a digit is easily misread."),
        _("Put a space between a number and its unit, as in “15 s”."),
        reading.place,
    )


def _mixed(readings: Sequence[Reading], language: Language | None) -> Iterator[Fault]:
    """Decimal commas among points, and degrees written in two ways."""
    commas = [(reading, match[1]) for reading in readings for match in _COMMA.finditer(reading.running)]
    points = any(_POINT.search(reading.running) for reading in readings)
    # In English a comma stands between thousands.
    thousands = language is not None and language.name == "English"
    commas = [(one, number) for one, number in commas if not (thousands and re.fullmatch(r"\d{1,3},\d{3}", number))]
    if commas and (points or thousands):
        reading, number = commas[0]
        yield Fault(
            "comma",
            _("{where}: “{number}” has a decimal comma.").format(where=reading.where, number=number)
            + (_(" Elsewhere there are decimal points.") if points else ""),
            _("A reader may take it for two numbers, or for thousands."),
            _("Write all numbers of the report in one way; in English with a point."),
            reading.place,
        )
    signs: dict[str, Reading] = {}
    for reading in readings:
        for sign in _DEG.findall(reading.running):
            signs.setdefault(sign, reading)
    if len(signs) > 1:
        yield Fault(
            "mixed units",
            _("Degrees are written as “deg” in one place, and as “°” in another."),
            _("A reader asks whether there is a difference."),
            _("Write a unit in one way through all of the report, figures and tables included."),
            [*signs.values()][-1].place,
        )


# --- units ------------------------------------------------------------------------------------------------------------


def _without_unit(
    reading: Reading, text: str, entries: Mapping[str, Entry], language: Language | None
) -> Iterator[Fault]:
    """A number at the end of a clause after what has a unit: by a table, or by what the word means."""
    for name, number in _ended(text, entries, language):
        if float(_value(number) or 0) == 0:
            continue
        yield Fault(
            "no unit",
            _("{where}: “{name} … {number}” has no unit.").format(where=reading.where, name=name, number=number),
            _("The same digits are another size in another unit."),
            _("Write the unit behind the number."),
            reading.place,
        )
        return


def _ended(text: str, entries: Mapping[str, Entry], language: Language | None) -> Iterator[tuple[str, str]]:
    joins = rf"|(?=\s+(?:{language.joins.pattern}))" if language else ""
    for name, entry in entries.items():
        if entry.unit:
            said = rf"(?<![\w_^\\]){re.escape(name)}\s*(?:=|≈)\s*({_NUMBER})(?:{_END}|(?=\s*$){joins})"
            yield from ((name, match[1]) for match in re.finditer(said, text) if _is_alone(text, match.end()))
    if language is not None:
        said = rf"({language.quantities.pattern}){_IS}({_NUMBER})(?:{_END}|(?=\s*$){joins})"
        for match in re.finditer(said, text, re.IGNORECASE):
            if _is_alone(text, match.end()):
                yield match[1], match[2]


def _is_alone(text: str, end: int) -> bool:
    """Whether no further number follows, whose unit would be this one's: "2 to 5 Hz"."""
    return not _LATER_UNIT.match(text[end:])


# --- and those of tables ----------------------------------------------------------------------------------------------


def _entries(tables: Iterator[Table]) -> dict[str, Entry]:
    """Symbol → its number, of rows that hold one symbol and one number; a symbol of two rows is not certain."""
    found: dict[str, Entry] = {}
    twice: set[str] = set()
    for table in tables:
        for row in table.rows:
            numbers = [cell for cell in row if re.fullmatch(rf"\$?{_NUMBER}\$?", typed(cell.strip("$ ")).strip())]
            others = [cell.strip() for cell in row if cell not in numbers and cell.strip()]
            names = {symbol(cell) for cell in others if _is_symbol(cell)}
            units = [cell for cell in others if not _is_symbol(cell) and _is_unit(cell)]
            if len(numbers) != 1 or len(names) != 1 or len(units) > 1:
                continue
            (name,) = names
            if name in found:
                twice.add(name)
            found[name] = Entry(typed(numbers[0].strip("$ ")), units[0] if units else "", table)
    return {name: entry for name, entry in found.items() if name not in twice}


def _is_symbol(cell: str) -> bool:
    """Whether a cell holds a symbol, and no word: ``$a_1$``, "a_1", "ω". A unit is none."""
    plain = cell.strip().strip("$`*")
    if cell.strip().startswith("$") or "_" in plain or "\\" in plain:
        return len(symbol(cell)) <= 20
    return len(plain) == 1 and plain.isalpha() and plain not in "smVANJKWgh"


def _is_unit(cell: str) -> bool:
    """Whether a cell holds a unit, and no word."""
    return len(cell) <= _LONGEST_UNIT and bool(re.fullmatch(_UNIT, cell) or re.search(r"[·⋅/²³⁻°]", cell))


def _value(number: str) -> Decimal | None:
    """A number as it is typed."""
    plain = number.translate(_MINUS).replace(",", ".").replace(" ", "").replace("*", "·").replace("×", "·")
    plain = re.sub(r"[·x]10\^?\(?(-?\d+)\)?", r"e\1", plain)
    try:
        return Decimal(plain)
    except InvalidOperation:
        return None


def _step(number: str) -> Decimal:
    """What the last digit of a number is worth."""
    value = _value(number)
    if value is None:
        return Decimal(0)
    return Decimal(1).scaleb(int(value.as_tuple().exponent))


def _same_unit(one: str, other: str) -> bool:
    plain = [re.sub(r"[\s·*()]|\^", "", typed(unit)).replace("⁻", "-").translate(_MINUS) for unit in (one, other)]
    return plain[0] == plain[1]


def _other_than_table(reading: Reading, entries: Mapping[str, Entry], language: Language) -> Iterator[Fault]:
    for sentence in reading.sentences:
        text = spelt(sentence)
        for name, entry in entries.items():
            by_way_of = r"(?:\s*=\s*[^=≈\d\s][^=≈]{0,60}?)?"  # a formula between: "a = b/c = 3"
            said = rf"(?<![\w_^\\]){re.escape(name)}{by_way_of}\s*(?:=|≈)\s*({_NUMBER})\s?([^\s,;]*)"
            for match in re.finditer(said, text):
                unit = match[2].rstrip(".)")
                if not unit:
                    continue
                if not _same_unit(unit, entry.unit):
                    other = units.behind(text[match.start(2) :])
                    if _BEFORE.search(text, 0, match.start()) and _is_another(other, match[1], entry):
                        yield _other_unit(reading, name, other, entry)
                        return
                    continue
                if _differ(match[1], entry.digits) and not language.else_whose.search(text):
                    yield Fault(
                        "other number",
                        _("{where}: {name} is {here} in the text, and {there} in Table {number}.").format(
                            where=reading.where,
                            name=name,
                            here=f"{match[1]} {unit}",
                            there=f"{entry.digits} {entry.unit}",
                            number=entry.table.number,
                        ),
                        _("A reader does not know which of the two to believe, and then believes neither."),
                        _("Find out which one is yours. If both are meant, say what sets them apart."),
                        reading.place,
                    )
                    return


def _is_another(unit: str, digits: str, entry: Entry) -> bool:
    """Whether a unit cannot be that of a table's number: of another quantity, or of another size with its digits."""
    here, there = units.parsed(unit), units.parsed(typed(entry.unit))
    if here is None or there is None:
        return False
    return here.powers != there.powers or (here.size != there.size and not _differ(digits, entry.digits))


def _other_unit(reading: Reading, name: str, unit: str, entry: Entry) -> Fault:
    return Fault(
        "other unit",
        _("{where}: {name} is in {here} in the text, and in {there} in Table {number}.").format(
            where=reading.where, name=name, here=unit, there=entry.unit, number=entry.table.number
        ),
        _("A unit says which quantity it is. With another one, a reader does not know what was measured."),
        _("Find out which unit belongs to it, by its equation, and write that one."),
        reading.place,
    )


def _differ(one: str, other: str) -> bool:
    """Whether two numbers differ by more than rounding does."""
    values = _value(one), _value(other)
    if values[0] is None or values[1] is None:
        return False
    return abs(values[0] - values[1]) > max(_step(one), _step(other))
