"""Remarks that are used again: those of the rubric, and those that scorers wrote before on the same part."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import islice

from labcourse.grading.gradebook import Act, standing

KEYS = "abcdefg"  #: by which remarks are put in; "h" is help


def used(of_rubric: Sequence[str], acts: Sequence[Act], where: tuple[str, str]) -> list[tuple[str, str]]:
    """Key and text of remarks for a part: the rubric's first, then those that were written most often before.

    A remark that was put together of several lines counts line by line; of two that were written as often, the later
    one comes first. What was taken back does not count.
    """
    counted: dict[str, int] = {}
    for act in standing(acts):
        if act.where == where and not act.asked:
            for line in filter(None, map(str.strip, act.remark.split("\n"))):
                counted[line] = counted.pop(line, 0) + 1
    written = sorted(reversed(counted), key=lambda line: -counted[line])
    texts = dict.fromkeys([*of_rubric, *written])
    return list(zip(KEYS, islice(texts, len(KEYS)), strict=False))
