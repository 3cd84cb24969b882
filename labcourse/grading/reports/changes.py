"""What another marking changed: for whom, where, from what to what, and why."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from typing import Any

from labcourse.grading.gradebook import Gradebook, Graded, MarkRecord
from labcourse.grading.graded_run import FAILED
from labcourse.grading.reports.result import points
from labcourse.grading.verdicts import UNDECIDED
from labcourse.student_id import caseless

KEY_CHANGED = "the key has changed"
RUN_AGAIN = "run again, with other notebooks, software or settings"
HANDED_IN_AGAIN = "handed in again"


@dataclass(frozen=True)
class Change:
    """One part's mark before and after; None where the key did not, or does not, have it."""

    question: str
    part: str
    before: MarkRecord | None
    after: MarkRecord | None

    def __str__(self) -> str:
        """As in "1.2, speed: 2 of 2 (right) → 0 of 2 (wrong). Look at the unit."."""
        before, after = map(_in_words, (self.before, self.after))
        reason = "" if self.after is None else self.after.reason
        return f"{self.question}, {self.part}: {before} → {after}. {reason}"

    def as_data(self) -> dict[str, Any]:
        """The same as plain data."""
        return {"question": self.question, "part": self.part, **{side: _data(getattr(self, side)) for side in _SIDES}}


_SIDES = ("before", "after")


def _in_words(mark: MarkRecord | None) -> str:
    if mark is None:
        return "no mark"
    if mark.status in UNDECIDED:
        return f"not decided, of {points(mark.out_of)} ({mark.status})"
    return f"{points(mark.points)} of {points(mark.out_of)} ({mark.status})"


def _data(mark: MarkRecord | None) -> dict[str, Any] | None:
    if mark is None:
        return None
    return {name: value for name, value in asdict(mark).items() if name in ("status", "points", "out_of", "reason")}


@dataclass(frozen=True)
class Changes:
    """What changed for a student.

    Attributes
    ----------
    student : ID
    why : one of the reasons above
    before, after : points of all parts
    out_of : points that there are after it
    parts : parts with another mark; a reason that is only worded differently does not count
    """

    student: str
    why: str
    before: float
    after: float
    out_of: float
    parts: tuple[Change, ...]

    def __str__(self) -> str:
        """A line for the student, and one for each part."""
        head = (
            f"{self.student}: {points(self.before)} → {points(self.after)} of {points(self.out_of)} points; {self.why}"
        )
        return "\n".join([head, *(f"    {part}" for part in self.parts)])

    def as_data(self) -> dict[str, Any]:
        """The same as plain data."""
        return {
            "student": self.student,
            "before": self.before,
            "after": self.after,
            "why": self.why,
            "changes": [part.as_data() for part in self.parts],
        }


def changes(before: Graded, after: Graded) -> Changes:
    """What is different between two gradings of a student."""
    if before.run.submission != after.run.submission:  # other answers in words are not run again
        why = HANDED_IN_AGAIN
    else:
        why = KEY_CHANGED if before.run.key == after.run.key else RUN_AGAIN
    return Changes(
        student=after.run.student,
        why=why,
        before=sum(mark.points for mark in before.marks),
        after=sum(mark.points for mark in after.marks),
        out_of=sum(mark.out_of for mark in after.marks),
        parts=tuple(_parts(before, after)),
    )


def _parts(before: Graded, after: Graded) -> Iterator[Change]:
    old, new = ({mark.where: mark for mark in one.marks} for one in (before, after))
    for where in dict.fromkeys([*new, *old]):
        was, becomes = old.get(where), new.get(where)
        if was is None or becomes is None or _mark(was) != _mark(becomes):
            yield Change(*where, was, becomes)


def _mark(mark: MarkRecord) -> tuple[str, float, float]:
    return mark.status, mark.points, mark.out_of


class Before:
    """What was in a gradebook before a class is graded.

    Parameters
    ----------
    book : as it is now
    """

    def __init__(self, book: Gradebook) -> None:
        self._known = {
            # A class's answers need not be kept in mind.
            caseless(one.run.student): replace(one, run=replace(one.run, answers=None, words={}, cells=()))
            for one in book.all_current()
            if not one.run.key.startswith(FAILED)  # there were no marks yet
        }

    def changes(self, after: Graded) -> Changes | None:
        """What changed for a student since; None for one who had no marks, or has the same."""
        before = self._known.get(caseless(after.run.student))
        if before is None:
            return None
        found = changes(before, after)
        return found if found.parts else None
