"""What there is to tell of a class, in the form that a terminal and a page both show."""

from __future__ import annotations

import re
from dataclasses import dataclass
from datetime import datetime

from labcourse.grading.gradebook import StudentRecord


@dataclass(frozen=True)
class Table:
    """Rows of one kind.

    Attributes
    ----------
    head : of the columns
    rows : a text for each column; lines of one text are told one below the other
    numbers : which columns hold numbers
    caption : what the rows are
    """

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    numbers: frozenset[int] = frozenset()
    caption: str = ""


@dataclass(frozen=True)
class Section:
    """What there is to tell of one thing.

    Attributes
    ----------
    title : what it is about
    first : the most important, in one sentence, for the top of the page
    more : further sentences
    tables : those that have rows are shown
    urgent : whether somebody should do something
    """

    title: str
    first: str
    more: tuple[str, ...] = ()
    tables: tuple[Table, ...] = ()
    urgent: bool = False

    @property
    def place(self) -> str:
        """By which the page links to it."""
        return re.sub(r"\W+", "-", self.title.casefold()).strip("-")


def moment(when: datetime) -> str:
    """A time as "2026-03-02 12:00 UTC"."""
    return f"{when:%Y-%m-%d %H:%M} UTC"


def named(about: StudentRecord) -> str:
    """A student, as "ada (Ada Lovelace)"."""
    return f"{about.student} ({about.name})" if about.name else about.student


def share(part: int, of: int) -> str:
    """As "12 of 60 (20 %)"; nothing of nothing is no share."""
    return f"{part} of {of} ({100 * part / of:.0f} %)" if of else f"{part} of {of}"
