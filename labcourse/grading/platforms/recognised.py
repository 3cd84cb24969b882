"""Which platform wrote a file, and which of its columns takes the marks, out of how many points. Nothing is guessed."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from decimal import Decimal

from labcourse.errors import GradingError
from labcourse.grading.platforms.their_file import Table
from labcourse.messages import listed

_NUMBER = re.compile(r"-?\d+(?:[.,]\d+)?")
_THOUSANDS = re.compile(r"-?\d{1,3},\d{3}")  # or a number with three decimals
_SHOWN = 12  # headings in a message


@dataclass(frozen=True)
class Column:
    """A column that is not about who a student is.

    Attributes
    ----------
    place : from 0
    heading : as it stands in the file
    names : what ``--column`` may call it besides, as its title or the platform's number
    maximum : points that the file says there are; None where it does not say
    why_not : why it can take no marks; "" where it can
    """

    place: int
    heading: str
    names: tuple[str, ...] = ()
    maximum: Decimal | None = None
    why_not: str = ""


@dataclass(frozen=True)
class Key:
    """A column by which students are known.

    Attributes
    ----------
    place, heading : where, and as it stands there
    internal : whether it holds numbers of the platform's own, which may by chance be another student's ID
    """

    place: int
    heading: str
    internal: bool = False


@dataclass(frozen=True)
class Export:
    """A platform's file, understood.

    Attributes
    ----------
    platform : which
    table : its cells
    students : the rows that are students'
    keys : the columns by which students are known
    names : places of the columns with names, as they are shown to people
    columns : the others
    empty : what a cell says that has no mark; besides, it may be blank
    left : what a cell may say that stays as it is, without regard to capitals → why, in words
    locked : a column that says "No" where the platform takes no mark; its place
    """

    platform: str
    table: Table
    students: tuple[int, ...]
    keys: tuple[Key, ...]
    names: tuple[int, ...]
    columns: tuple[Column, ...]
    empty: Collection[str] = ()
    left: Mapping[str, str] = field(default_factory=dict)
    locked: int | None = None

    def shown(self, row: int) -> str:
        """A student of theirs, for people: the first of what they are known by, and the name."""
        known = next(filter(None, (self.table.cell(row, key.place).strip() for key in self.keys)), "")
        name = self.name(row)
        line = f"line {self.table.line(row)}"
        return f"{known} ({name}, {line})" if name else f"{known or '–'} ({line})"

    def name(self, row: int) -> str:
        """A student's name, its parts in the order of the columns."""
        return " ".join(filter(None, (self.table.cell(row, place).strip() for place in self.names)))

    def column(self, asked: str | None = None) -> Column:
        """The column that the marks go into.

        Parameters
        ----------
        asked : its heading, title or number; None where there is one only

        Raises
        ------
        GradingError
            If it is not there, cannot take marks, or is not the only one.
        """
        open_ones = [one for one in self.columns if not one.why_not]
        if asked is None:
            if len(open_ones) == 1:
                return open_ones[0]
            if not open_ones:
                raise GradingError(f"No column of it takes marks. {self._closed_columns()}")
            raise GradingError(f"Several columns of it take marks: say which by --column. {self._candidates()}")
        named = [one for one in self.columns if _same(asked, one.heading)]
        if not named:
            called = [one for one in self.columns if any(_same(asked, name) for name in one.names)]
            named = [one for one in called if not one.why_not] or called
        if len(named) == 1:
            (found,) = named
            if found.why_not:
                raise GradingError(f"The column {found.heading!r} takes no marks: {found.why_not} {self._candidates()}")
            return found
        if named:
            raise GradingError(f"{asked!r} may be any of {_listed(named)}: give the whole heading.")
        raise GradingError(
            f"It has no column {asked!r}, and none is made: {self.platform} decides what a new one would be. "
            f"{self._candidates()}"
        )

    def _candidates(self) -> str:
        found = [one for one in self.columns if not one.why_not]
        if not found:
            return "There is none in it that does."
        return f"There is: {_listed(found)}."

    def _closed_columns(self) -> str:
        told = (f"{one.heading!r}: {one.why_not}" for one in self.columns[:_SHOWN])
        return " ".join(told) or "It has no columns but those that say who is who."


def _same(one: str, other: str) -> bool:
    return " ".join(one.casefold().split()) == " ".join(other.casefold().split())


def _listed(columns: Sequence[Column]) -> str:
    return listed([repr(one.heading) for one in columns], _SHOWN)


def number(text: str) -> Decimal | None:
    """What a cell says as a number, with a point or a comma before its decimals; None if it says something else."""
    found = text.strip()
    return Decimal(found.replace(",", ".")) if _NUMBER.fullmatch(found) else None


def maximum(column: Column, platform: str, out_of: Decimal | None) -> Decimal:
    """Points that an item is out of: as the file says, or else as told.

    Raises
    ------
    GradingError
        If neither says so, they contradict each other, or there is nothing to have.
    """
    there = column.maximum
    if there is None and out_of is None:
        raise GradingError(
            f"{platform}'s file does not say how many points {column.heading!r} is out of: say so by --out-of."
        )
    if there is not None and out_of is not None and there != out_of:
        raise GradingError(
            f"By the file, {column.heading!r} is out of {plain(there)}, and by --out-of it is {plain(out_of)}. "
            "Leave one of them out."
        )
    found = there if there is not None else out_of
    if found is None or found <= 0:
        raise GradingError(
            f"{column.heading!r} is out of {plain(found or Decimal(0))} points: set its points on {platform}, "
            "and export the file again."
        )
    return found


def stated(text: str, heading: str) -> Decimal | None:
    """The maximum that a file states; None where it states none.

    Raises
    ------
    GradingError
        If it may be read in two ways: 1,000.
    """
    if _THOUSANDS.fullmatch(text.strip()):
        raise GradingError(
            f"{heading!r} is out of {text.strip()!r}, which may be a thousand, or a number with decimals."
        )
    return number(text)


def plain(value: Decimal) -> str:
    """A number without zeros that say nothing: "12.5", "100"."""
    text = f"{value:f}"
    return text.rstrip("0").rstrip(".") if "." in text else text
