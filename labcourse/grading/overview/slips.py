"""Which questions went wrong for many, and the commonest slips, by what the key said."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from labcourse.grading.gradebook import Graded, MarkRecord
from labcourse.grading.overview.section import Section, Table, share
from labcourse.grading.verdicts import Status
from labcourse.messages import plural

MANY = 0.2  #: of those whose answer the key judged
FEWEST = 2  #: students; one alone is not many
_MOST_REASONS = 3  # of a part
_LONGEST = 200  # characters of a reason
_WENT_WRONG = (Status.WRONG, Status.PARTLY)
_JUDGED = (*_WENT_WRONG, Status.RIGHT, Status.FOLLOW_THROUGH)
#: No digit of a name, as in K_2 or q3, and no full stop that ends a sentence.
_NUMBER = re.compile(r"(?<![\w.])[-+\u2212]?\d+(?:[.,]\d+)*(?:[eE][-+]?\d+)?(?:[·×]10[⁻⁺⁰¹²³⁴⁵⁶⁷⁸⁹]+)?j?(?!\w)")


@dataclass(frozen=True)
class Slips:
    """What went wrong in one part.

    Attributes
    ----------
    question, part : which
    wrong, judged : students whose answer was wrong or partly so, and all whose answer the key judged
    lost : points, of them together
    reasons : what the key said, without numbers, and to how many; the commonest first
    """

    question: str
    part: str
    wrong: int
    judged: int
    lost: float
    reasons: tuple[tuple[str, int], ...]


def slips(everybody: Sequence[Graded]) -> list[Slips]:
    """What went wrong for many, that with the largest share first."""
    marks: dict[tuple[str, str], list[MarkRecord]] = {}
    for graded in everybody:
        for one in graded.marks:
            if one.status in _JUDGED:
                marks.setdefault(one.where, []).append(one)
    found = [_slips(where, those) for where, those in marks.items()]
    many = [one for one in found if one.wrong >= FEWEST and one.wrong >= MANY * one.judged]
    return sorted(many, key=lambda one: (-one.wrong / one.judged, -one.lost, one.question, one.part))


def _slips(where: tuple[str, str], marks: Sequence[MarkRecord]) -> Slips:
    wrong = [one for one in marks if one.status in _WENT_WRONG]
    reasons = Counter(without_numbers(one.reason) for one in wrong)
    lost = sum(one.out_of - one.points for one in wrong)
    return Slips(*where, len(wrong), len(marks), lost, tuple(reasons.most_common()))


def without_numbers(reason: str) -> str:
    """A reason as it is the same for all who made this slip: each number of it as "…"."""
    words = _NUMBER.sub("…", " ".join(reason.split()))
    return words if len(words) <= _LONGEST else f"{words[:_LONGEST]}…"


def section(everybody: Sequence[Graded], titles: Mapping[str, str]) -> Section:
    """The same, to be shown.

    Parameters
    ----------
    everybody : the runs that count
    titles : question → what it is called
    """
    found = slips(everybody)
    rows = tuple(
        (f"{one.question} {one.part}", titles.get(one.question, ""), share(one.wrong, one.judged), _reasons(one))
        for one in found
    )
    first = (
        (
            f"{plural(len(found), '{count} part', '{count} parts')} went wrong for many; most of all "
            f"{found[0].question} {found[0].part}, for {share(found[0].wrong, found[0].judged)} who answered it."
        )
        if found
        else "No part went wrong for many."
    )
    more = (f"Many are {100 * MANY:.0f} % or more of those whose answer the key judged.",) if found else ()
    head = ("Part", "Question", "Went wrong for", "Commonest reasons")
    return Section("Went wrong for many", first, more, (Table(head, rows),))


def _reasons(one: Slips) -> str:
    shown = [f"{count} × {reason}" for reason, count in one.reasons[:_MOST_REASONS]]
    left = sum(count for _reason, count in one.reasons[_MOST_REASONS:])
    return "\n".join([*shown, *([f"{left} × other reasons"] if left else [])])
