"""Remarks that are used again: those of the rubric, and those that scorers wrote before on the same part."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import islice

from rotflex.instructor.gradebook import Act

KEYS = "abcdefg"  #: by which remarks are put in; "h" is help


def used(of_rubric: Sequence[str], acts: Iterable[Act], where: tuple[str, str]) -> list[tuple[str, str]]:
    """Key and text of remarks for a part: the rubric's first, then those that were written most often before.

    A remark that was put together of several lines counts line by line; of two that were written as often, the later
    one comes first.
    """
    counted: dict[str, int] = {}
    for act in acts:
        if act.where == where and not act.asked and act.undoes is None:
            for line in filter(None, map(str.strip, act.remark.split("\n"))):
                counted[line] = counted.pop(line, 0) + 1
    written = sorted(reversed(counted), key=lambda line: -counted[line])
    texts = dict.fromkeys([*of_rubric, *written])
    return list(zip(KEYS, islice(texts, len(KEYS)), strict=False))
