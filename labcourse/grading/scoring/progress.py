"""Count how far scoring is."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from labcourse.grading.gradebook import Answer

LEVELS = (4, 3, 2, 1, 0)  #: 0 is for what is of no worth, or missing


@dataclass(frozen=True)
class Tally:
    """How far the answers to a part are.

    Attributes
    ----------
    total, done, waiting, referred : answers: all, decided, to be read, left to the instructor
    levels : level → how many have it; points without a level, also those of ``labcourse mark``, count as ``other``
    """

    total: int
    done: int
    waiting: int
    referred: int
    levels: dict[int, int]
    other: int


def tally(answers: Sequence[Answer]) -> Tally:
    """Count how far some answers are."""
    done = [one for one in answers if not one.waiting]
    referred = sum(one.referred for one in answers)
    given = Counter(one.decision.level if one.decision else None for one in done)
    levels = {level: given[level] for level in LEVELS}
    waiting = len(answers) - len(done) - referred
    return Tally(len(answers), len(done), waiting, referred, levels, len(done) - sum(levels.values()))
