"""How well two who scored the same answers agree, and which answers are scored a second time."""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

from rotflex.courseware.messages import _
from rotflex.courseware.student_id import caseless


@dataclass(frozen=True)
class Agreement:
    """How well two scorers agree.

    Attributes
    ----------
    pairs : answers that both scored
    same : those to which both gave the same level
    kappa : Cohen's kappa: 1 where all levels are the same, 0 where not more are than chance would have it
    weighted : the same with quadratic weights: two levels apart counts four times as much as one

    Both are None where they are not defined: nothing is scored twice, or both gave one and the same level throughout.
    """

    pairs: int
    same: int
    kappa: float | None
    weighted: float | None

    def __str__(self) -> str:
        if not self.pairs:
            return _("Nothing has been scored a second time yet.")
        counted = _("{same} of {pairs} the same").format(same=self.same, pairs=self.pairs)
        if self.kappa is None or self.weighted is None:
            return _(
                "{counted}; kappa is not defined, for both gave one and the same level to all: so would chance"
            ).format(counted=counted)
        return _("{counted}; kappa {kappa:.2f}, with quadratic weights {weighted:.2f}").format(
            counted=counted, kappa=self.kappa, weighted=self.weighted
        )


def agreement(pairs: Iterable[tuple[int, int]]) -> Agreement:
    """How well two scorers agree.

    Parameters
    ----------
    pairs : for each answer the level of the first and of the second

    Returns
    -------
    Agreement
    """
    levels = list(pairs)
    return Agreement(
        len(levels),
        sum(one == other for one, other in levels),
        _kappa(levels, quadratic=False),
        _kappa(levels, quadratic=True),
    )


def _kappa(pairs: list[tuple[int, int]], quadratic: bool) -> float | None:
    """One less the disagreement that there is, as a share of what chance would bring; None where that is none."""

    def apart(one: int, other: int) -> int:
        return (one - other) ** 2 if quadratic else int(one != other)

    first, second = (Counter(side) for side in zip(*pairs, strict=True)) if pairs else (Counter(), Counter())
    by_chance = sum(n * m * apart(one, other) for one, n in first.items() for other, m in second.items())
    if not by_chance:
        return None
    return 1 - len(pairs) * sum(apart(*pair) for pair in pairs) / by_chance


def sampled(student: str, where: tuple[str, str], one_in: int, seed: str = "") -> bool:
    """Whether an answer is among those that are scored a second time.

    It depends on nothing else, and so does not change when others hand in, nor with the order of the class.

    Parameters
    ----------
    student : whose
    where : question and part
    one_in : of so many answers about one is; none where it is 0
    seed : another one draws others
    """
    if one_in < 1:
        return False
    drawn = hashlib.sha256(json.dumps([seed, caseless(student), *where]).encode()).digest()
    return int.from_bytes(drawn[:8]) % one_in == 0
