"""How scoring is going: tallies, what is left and how long it takes, who reads what, how well two agree."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from rotflex.courseware.messages import _
from rotflex.instructor.gradebook import FIRST, SECOND, Act, Answer
from rotflex.instructor.scoring import pace
from rotflex.instructor.scoring.agreement import Agreement, agreement
from rotflex.instructor.scoring.desk import Desk, Where, key_of

LEVELS = (4, 3, 2, 1, 0)


@dataclass(frozen=True)
class Tally:
    """How far the answers to a part are.

    Attributes
    ----------
    total, done, waiting, asked : answers: all, decided, to be read, left to the instructor
    levels : level → how many have it; points without a level, also those of ``rotflex mark``, count as ``other``
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
    given = Counter(act.level if (act := one.decision) else None for one in done)
    levels = {level: given[level] for level in LEVELS}
    return Tally(
        len(answers), len(done), len(answers) - len(done) - asked, asked, levels, len(done) - sum(levels.values())
    )


def time_left(own: Iterable[Act], where: Where, left: int, round: int = FIRST) -> float | None:
    """Seconds that the rest of a part takes a scorer, by the times of their own acts; None where too few are known."""
    found = pace.readings(own)
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
class Differ:
    """An answer on which two readers differ: its key, what it is called, and in words what each gave."""

    key: str
    label: str
    told: str


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
    differ : answers on which they differ
    """

    where: Where
    title: str
    tally: Tally
    readers: list[str]
    sampled: int
    twice: int
    agreement: Agreement
    differ: list[Differ]


def rows(desk: Desk) -> tuple[list[Row], Agreement]:
    """All parts that a person reads, in the catalogue's order, and how well the rounds agree over all of them."""
    by_part: dict[Where, list[Answer]] = {}
    for one in desk.book.scores.answers():
        by_part.setdefault(one.where, []).append(one)
    found, all_pairs = [], []
    for where in desk.in_order(list(by_part)):
        answers = by_part[where]
        question = desk.catalogue.marked.get(where[0])
        twice = [(one, *both) for one in answers if not one.waiting and (both := one.read_twice)]
        pairs = [(desk.level_of(first), desk.level_of(second)) for _one, first, second in twice]
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
                sum(one.read_twice is not None for one in sample),
                agreement(pairs),
                [_differ(desk, *one) for one, (level, other) in zip(twice, pairs, strict=True) if level != other],
            )
        )
    return found, agreement(all_pairs)


def _differ(desk: Desk, answer: Answer, first: Act, second: Act) -> Differ:
    told = _("{first} {level}, {second} {other}").format(
        first=first.actor, level=desk.level_of(first), second=second.actor, other=desk.level_of(second)
    )
    if answer.decision != first:
        told += _("; scored anew since")
    return Differ(key_of(answer.student, answer.where), desk.label(answer.student, answer.where), told)
