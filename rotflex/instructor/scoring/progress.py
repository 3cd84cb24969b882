"""How scoring is going: tallies, what is left and how long it takes, who reads what, how well two agree."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from rotflex.courseware.messages import _
from rotflex.instructor.gradebook import FIRST, SECOND, Act, Answer
from rotflex.instructor.scoring import pace
from rotflex.instructor.scoring.agreement import Agreement, agreement
from rotflex.instructor.scoring.desk import Desk, Where

LEVELS = (4, 3, 2, 1, 0)


@dataclass(frozen=True)
class Tally:
    """How far the answers to a part are.

    Attributes
    ----------
    total, done, waiting, asked : answers: all, decided, to be read, left to the instructor
    levels : level → how many have it; points without a level count as ``other``
    """

    total: int
    done: int
    waiting: int
    asked: int
    levels: dict[int, int]
    other: int


def tally(answers: Sequence[Answer]) -> Tally:
    """How far some answers are, in the first round."""
    done = [one for one in answers if not one.waiting]
    asked = sum(one.asked for one in answers)
    given = Counter(last.level if (last := one.last()) else None for one in done)
    levels = {level: given[level] for level in LEVELS}
    return Tally(
        len(answers), len(done), len(answers) - len(done) - asked, asked, levels, len(done) - sum(levels.values())
    )


def time_left(acts: Iterable[Act], actor: str, where: Where, left: int, round: int = FIRST) -> float | None:
    """Seconds that the rest of a part takes a scorer, by their own times; None where too little is known."""
    found = pace.readings(act for act in acts if act.actor == actor)
    each = pace.usual([one for one in found if (one.where, one.round) == (where, round)])
    return None if each is None else each * left


def in_words(seconds: float | None) -> str:
    """A time that something takes, as people say it."""
    if seconds is None:
        return ""
    minutes = round(seconds / 60)
    if minutes < 1:
        return _("less than a minute left")
    if minutes < 90:
        return _("about {n} min left").format(n=minutes)
    return _("about {n:.1f} h left").format(n=seconds / 3600)


@dataclass(frozen=True)
class Row:
    """A part on the overview.

    Attributes
    ----------
    where, title : which
    tally : of the first round
    readers : who is reading an answer to it
    sampled, twice : answers of the sample that were scored once, and those of them that were scored twice
    agreement : of the two rounds
    """

    where: Where
    title: str
    tally: Tally
    readers: list[str]
    sampled: int
    twice: int
    agreement: Agreement


def rows(desk: Desk) -> tuple[list[Row], Agreement]:
    """All parts that a person reads, in the catalogue's order, and how well the rounds agree over all of them."""
    by_part: dict[Where, list[Answer]] = {}
    for one in desk.book.scores.answers():
        by_part.setdefault(one.where, []).append(one)
    found, all_pairs = [], []
    for where in desk.in_order(list(by_part)):
        answers = by_part[where]
        question = desk.catalogue.marked.get(where[0])
        pairs = _pairs(desk, answers)
        all_pairs += pairs
        sample = [one for one in answers if desk.in_second_round(one)]
        held = [desk.book.scores.claimed(where, round).values() for round in (FIRST, SECOND)]
        found.append(
            Row(
                where,
                question.title if question is not None else "",
                tally(answers),
                sorted({actor for holders in held for actor, _until in holders}),
                len(sample),
                sum(one.last(SECOND) is not None for one in sample),
                agreement(pairs),
            )
        )
    return found, agreement(all_pairs)


def _pairs(desk: Desk, answers: Iterable[Answer]) -> list[tuple[int, int]]:
    """Levels of the first and the second round, where there are both."""
    both = [(one.last(FIRST), one.last(SECOND)) for one in answers if not one.waiting]
    return [
        (desk.level_of(first), desk.level_of(second))
        for first, second in both
        if first is not None and second is not None and first.points is not None
    ]
