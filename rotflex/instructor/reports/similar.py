"""Answers that fit a class-mate's bench and not the student's own: hints for an instructor, and never a verdict.

Each student measures on a bench of their own, so numbers differ. Of the answers that were marked wrong, two sorts are
told: a number that is, to the digits given, the right one of a class-mate; and all that a student measured, taken
together, where it fits the bench of a class-mate. What fits several benches says nothing of any, and is left out, as is
a number rounded so that in this class it may be near somebody's by chance. Left out is, too, whoever has the same
bench, as those have who hand in together. Which parts are measured, the key says: checks with an ``own_bench``.
"""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from typing import Any

from rotflex.courseware import answers
from rotflex.courseware.messages import _
from rotflex.instructor.course import Course
from rotflex.instructor.gradebook import Graded
from rotflex.instructor.graded_run import to_be_marked
from rotflex.instructor.verdicts import Key, OwnBench, Status

Where = tuple[str, str]
FEWEST_DIGITS = 3  #: of a number that is taken for another's
FEWEST_TOGETHER = 2  #: wrong numbers that have to fit another bench, where none says something by itself
MOST_MATES = 2  #: whom a number may fit and yet say something
#: A rounded number may be near somebody's by chance: whoever has one in a neighbourhood so many times as wide counts.
NEIGHBOURHOOD = 10
_EXACT = 1e-9  # relative; numbers that were not rounded


@dataclass(frozen=True)
class Student:
    """What somebody measured.

    Attributes
    ----------
    name : the ID
    bench : what is expected of each part that is measured, on their own bench
    given : what they answered
    right, wrong : parts that were marked so
    """

    name: str
    bench: Mapping[Where, float]
    given: Mapping[Where, float]
    right: frozenset[Where]
    wrong: frozenset[Where]


@dataclass(frozen=True)
class Hint:
    """Answers that fit somebody else's bench."""

    student: str
    mate: str
    given: Mapping[Where, float]
    alone: bool

    @property
    def students(self) -> tuple[str, str]:
        """Both."""
        return self.student, self.mate

    def __str__(self) -> str:
        """As in "bob: 1.2 speed = 19.43 is the right answer of ada"."""
        what = ", ".join(
            _("{question} {part} = {value:g}").format(question=question, part=part, value=value)
            for (question, part), value in self.given.items()
        )
        words = (
            _("{student}: {what} is wrong on their own bench, and the right answer of {mate}.")
            if self.alone
            else _("{student}: {what} fit the bench of {mate} together, and not their own.")
        )
        return words.format(student=self.student, what=what, mate=self.mate)


def measured_parts(key: Key) -> dict[Where, OwnBench]:
    """The parts that are measured on a student's own bench."""
    found = {
        (question, part): getattr(check, "own_bench", None)
        for question, parts in key.items()
        for part, check in parts.items()
    }
    return {where: own for where, own in found.items() if own is not None}


def student(graded: Graded, course: Course) -> Student | None:
    """What somebody measured, by the gradebook; None where nothing of it can be read."""
    parts = measured_parts(course.key)
    asked = to_be_marked(graded.run)
    try:
        bench = course.true_bench(asked.student, asked.policy, asked.evidence)
        content = answers.parse(graded.run.answers or b"")["answers"]
        expected = {where: float(own.expected(bench)) for where, own in parts.items()}
        given = {where: number for where in parts if (number := _number(content, where)) is not None}
    except Exception:  # a fault of the course, or a bench that is drawn no more: a hint is not worth a report
        return None
    status = {one.where: one.status for one in graded.marks}
    return Student(
        graded.run.student,
        expected,
        given,
        frozenset(where for where in given if status.get(where) == Status.RIGHT),
        frozenset(where for where in given if status.get(where) == Status.WRONG),
    )


def _number(content: Mapping[str, Any], where: Where) -> float | None:
    question, part = where
    value = content.get(question, {}).get(part, {}).get("value")
    if isinstance(value, bool) or not isinstance(value, int | float) or not value or not math.isfinite(value):
        return None
    return float(value)


def hints(everybody: Sequence[Student], parts: Mapping[Where, OwnBench]) -> list[Hint]:
    """What fits a class-mate's bench.

    Parameters
    ----------
    everybody : of the class
    parts : from :func:`measured_parts`
    """
    by_answer = {where: _Sorted(everybody, where, right=True) for where, own in parts.items() if own.tells}
    by_bench = {where: _Sorted(everybody, where, right=False) for where in parts}
    return [
        hint for one in everybody if one.wrong for hint in (*_alone(one, by_answer), *_together(one, parts, by_bench))
    ]


class _Sorted:
    """A class by one number of each, so that those near a value are found at once."""

    def __init__(self, everybody: Sequence[Student], where: Where, right: bool) -> None:
        rows = [
            (one.given[where] if right else one.bench[where], index)
            for index, one in enumerate(everybody)
            if not right or where in one.right
        ]
        self._rows, self._everybody = sorted(rows), everybody
        self._values = [value for value, _index in self._rows]

    def near(self, value: float, room: float, other: Student) -> list[Student]:
        low, high = bisect_left(self._values, value - room), bisect_right(self._values, value + room)
        found = (self._everybody[index] for _value, index in self._rows[low:high])
        return [one for one in found if one.bench != other.bench]


def _alone(one: Student, by_answer: Mapping[Where, _Sorted]) -> Iterator[Hint]:
    for where in sorted(one.wrong & by_answer.keys()):
        value = one.given[where]
        digits = _digits(value)
        if digits < FEWEST_DIGITS:
            continue
        room = _half_of_the_last(value, digits)
        mates = by_answer[where].near(value, room, one)
        if len(by_answer[where].near(value, NEIGHBOURHOOD * room, one)) <= MOST_MATES:
            yield from (Hint(one.name, mate.name, {where: value}, alone=True) for mate in mates)


def _together(one: Student, parts: Mapping[Where, OwnBench], by_bench: Mapping[Where, _Sorted]) -> Iterator[Hint]:
    if len(one.wrong) < FEWEST_TOGETHER or _fits(one, one, parts):
        return
    narrowest = min(one.given, key=lambda where: parts[where].rtol)
    value = one.given[narrowest]
    near = by_bench[narrowest].near(value, 2 * parts[narrowest].rtol * abs(value), one)
    mates = [mate for mate in near if _fits(one, mate, parts)]
    if len(mates) <= MOST_MATES:
        yield from (Hint(one.name, mate.name, one.given, alone=False) for mate in mates)


def _fits(one: Student, mate: Student, parts: Mapping[Where, OwnBench]) -> bool:
    """Whether all that somebody measured is near what the bench of another gives."""
    return all(
        abs(value - mate.bench[where]) <= parts[where].rtol * abs(mate.bench[where])
        for where, value in one.given.items()
    )


def _digits(value: float) -> int:
    """To how many significant digits a number is given."""
    return len(Decimal(str(value)).normalize().as_tuple().digits)


def _half_of_the_last(value: float, digits: int) -> float:
    step = 10.0 ** (math.floor(math.log10(abs(value))) + 1 - digits)
    return max(step / 2 * (1 + _EXACT), _EXACT * abs(value))
