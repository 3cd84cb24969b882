"""How scoring is going: tallies, and how long reading takes by the times at which each scorer's acts were written.

An act tells when it was written, and not for how long the answer was read. So a time of reading is from one act of a
scorer to their next; what came in one burst was read before, at a time that nobody knows.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from statistics import median

from labcourse.grading.gradebook import Act, Answer
from labcourse.grading.scoring.desk import MOST_TOGETHER, Where

LEVELS = (4, 3, 2, 1, 0)
PAUSE = 600.0  #: s between two acts; whoever does nothing for longer is not reading; the longest report is read in less
AT_ONCE = 1.0  #: s; acts nearer to each other were not read one after the other
FEWEST = 5  #: times that a median is taken of; one of fewer says nothing


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
    given = Counter(one.decision.level if one.decision else None for one in done)
    levels = {level: given[level] for level in LEVELS}
    waiting = len(answers) - len(done) - asked
    return Tally(len(answers), len(done), waiting, asked, levels, len(done) - sum(levels.values()))


@dataclass(frozen=True)
class Reading:
    """What one key decided, and the time since its scorer's act before.

    Attributes
    ----------
    where : question and part
    seconds : since the act before
    answers : how many there were: equal ones are decided together
    """

    where: Where
    seconds: float
    answers: int


def readings(acts: Iterable[Act]) -> list[Reading]:
    """Return one scorer's times of reading.

    Left out are pauses, what was taken back, and several answers that were decided at once, but not by one key. What
    comes next after these is left out, too, for nobody knows when that reading began.
    """
    bursts: list[list[Act]] = []
    for act in sorted(acts, key=lambda act: (act.when, act.number)):
        before = bursts[-1][-1] if bursts else None
        if before and _apart(before, act) <= AT_ONCE and (act.undoes is None) == (before.undoes is None):
            bursts[-1].append(act)
        else:
            bursts.append([act])
    times = [(_apart(earlier[-1], later[0]), earlier, later) for earlier, later in pairwise(bursts)]
    return [
        Reading(later[0].where, seconds, len(later))
        for seconds, earlier, later in times
        if seconds < PAUSE and later[0].undoes is None and _is_one_key(later) and _is_one_key(earlier)
    ]


def _apart(one: Act, other: Act) -> float:
    return (other.when - one.when).total_seconds()


def _is_one_key(burst: Sequence[Act]) -> bool:
    """Return whether one key can have done it: the same to each of a few answers to one part."""
    same = {(act.where, act.level, act.points, act.remark, act.asked) for act in burst}
    return burst[0].undoes is not None or (len(same) == 1 and len(burst) <= MOST_TOGETHER)


def usual(found: Collection[Reading]) -> float | None:
    """Return the time of an answer, s: the median from key to key, shared among its answers; None of too few."""
    if len(found) < FEWEST:
        return None
    return median(one.seconds for one in found) * len(found) / sum(one.answers for one in found)


def time_left(own: Iterable[Act], where: Where, left: int) -> float | None:
    """Return the time, s, that the rest of a part takes a scorer, by the times of their own acts; None of too few."""
    each = usual([one for one in readings(own) if one.where == where])
    return None if each is None else each * left


def time_text(seconds: float) -> str:
    """Write how much time is left, rounded."""
    minutes = round(seconds / 60)
    if minutes < 1:
        return "less than a minute left"
    return f"about {minutes} min left" if minutes < 90 else f"about {seconds / 3600:.1f} h left"
