"""How scoring is going: tallies, what is left and how long it takes, who reads what."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from labcourse.grading.gradebook import Act, Answer
from labcourse.grading.scoring import pace
from labcourse.grading.scoring.desk import Desk, Where

LEVELS = (4, 3, 2, 1, 0)


@dataclass(frozen=True)
class Tally:
    """How far the answers to a part are.

    Attributes
    ----------
    total, done, waiting, asked : answers: all, decided, to be read, left to the instructor
    levels : level → how many have it; points without a level, also those of ``labcourse mark``, count as ``other``
    """

    total: int
    done: int
    waiting: int
    asked: int
    levels: dict[int, int]
    other: int


def tally(answers: Sequence[Answer]) -> Tally:
    """Count how far some answers are."""
    done = [one for one in answers if not one.waiting]
    asked = sum(one.asked for one in answers)
    given = Counter(act.level if (act := one.decision) else None for one in done)
    levels = {level: given[level] for level in LEVELS}
    return Tally(
        len(answers), len(done), len(answers) - len(done) - asked, asked, levels, len(done) - sum(levels.values())
    )


def time_left(own: Iterable[Act], where: Where, left: int) -> float | None:
    """Seconds that the rest of a part takes a scorer, by the times of their own acts; None where too few are known."""
    found = pace.readings(own)
    each = pace.usual([one for one in found if one.where == where])
    return None if each is None else each * left


def in_words(seconds: float | None) -> str:
    """A time that something takes, as people say it."""
    if seconds is None:
        return ""
    minutes = round(seconds / 60)
    if minutes < 1:
        return "less than a minute left"
    if minutes < 90:
        return f"about {minutes} min left"
    return f"about {seconds / 3600:.1f} h left"


@dataclass(frozen=True)
class Row:
    """A part on the overview.

    Attributes
    ----------
    where, title : question and part, and the question's title
    tally : of its answers
    readers : who is reading an answer to it
    """

    where: Where
    title: str
    tally: Tally
    readers: list[str]


def rows(desk: Desk) -> list[Row]:
    """List all parts that a person reads, in the catalogue's order."""
    by_part: dict[Where, list[Answer]] = {}
    for one in desk.book.scores.answers():
        by_part.setdefault(one.where, []).append(one)
    found = []
    for where in desk.in_order(list(by_part)):
        question = desk.catalogue.marked.get(where[0])
        readers = sorted({actor for actor, _until in desk.book.scores.claimed(where).values()})
        found.append(Row(where, question.title if question is not None else "", tally(by_part[where]), readers))
    return found
