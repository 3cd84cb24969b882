"""How long reading takes, by when each scorer's acts were written: by median, and only where enough is known.

An act says when it was written, and not for how long the answer was read. So a time of reading is from one act of a
scorer to their next; what came in one burst was read before, at a time that nobody knows.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from statistics import median

from labcourse.grading.gradebook import Act
from labcourse.grading.scoring.desk import MOST_TOGETHER, Where

PAUSE = 600.0  #: s between two acts; whoever does nothing for longer is not reading; the longest report is read in less
AT_ONCE = 1.0  #: s; acts nearer to each other were not read one after the other
FEWEST = 5  #: times that a median is taken of; one of fewer says nothing


@dataclass(frozen=True)
class Reading:
    """What one key decided, and the time since its scorer's act before.

    Attributes
    ----------
    where : question and part
    seconds : since the act before
    answers : how many there were: those that are alike are decided together
    """

    where: Where
    seconds: float
    answers: int


def readings(acts: Iterable[Act]) -> list[Reading]:
    """One scorer's times of reading.

    Left out are pauses, what was taken back, and what came from a table: several answers at once that one key does not
    decide. What comes next after a table is left out, too, for nobody knows when that reading began.
    """
    bursts = list(_bursts(sorted(acts, key=lambda act: (act.when, act.number))))
    return [
        Reading(later[0].where, _apart(before[-1], later[0]), len(later))
        for before, later in pairwise(bursts)
        if _apart(before[-1], later[0]) < PAUSE
        and later[0].undoes is None
        and _is_one_key(later)
        and _is_one_key(before)
    ]


def _apart(one: Act, other: Act) -> float:
    return (other.when - one.when).total_seconds()


def _bursts(acts: Sequence[Act]) -> Iterator[list[Act]]:
    """Acts that came at once, together; taking back is apart from what was given after it."""
    burst: list[Act] = []
    for act in acts:
        if burst and (_apart(burst[-1], act) > AT_ONCE or (act.undoes is None) != (burst[-1].undoes is None)):
            yield burst
            burst = []
        burst.append(act)
    if burst:
        yield burst


def _is_one_key(burst: Sequence[Act]) -> bool:
    """Whether one key can have done it: the same to each of a few answers to one part."""
    if burst[0].undoes is not None:
        return True
    same = {(act.where, act.level, act.points, act.remark, act.asked) for act in burst}
    return len(same) == 1 and len(burst) <= MOST_TOGETHER


def usual(found: Collection[Reading]) -> float | None:
    """Seconds of an answer: the median from key to key, shared among what a key decides; None of too few."""
    if len(found) < FEWEST:
        return None
    return median(one.seconds for one in found) * len(found) / sum(one.answers for one in found)
