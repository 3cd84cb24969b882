"""What another marking changed: for whom, where, from what to what, and why."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from datetime import datetime
from functools import cache
from typing import Any, NamedTuple

from labcourse.grading.accounts import points
from labcourse.grading.course import Course
from labcourse.grading.gradebook import AuditRecord, Gradebook, Graded, MarkState
from labcourse.grading.gradebook.store import NO_LONGER
from labcourse.grading.graded_run import is_failed
from labcourse.grading.marks import UNDECIDED, Mark, Status
from labcourse.sentences import sentence

KEY_CHANGED = "the key has changed"
RUN_AGAIN = "run again, with other notebooks, software or settings"
HANDED_IN_AGAIN = "handed in again"


@dataclass(frozen=True)
class Changes:
    """What changed for a student.

    Attributes
    ----------
    student : ID
    why : one of the reasons above
    before, after : points of all parts
    out_of : possible points after it
    parts : question and part of each that has another mark, with its mark before and after; None without one
    """

    student: str
    why: str
    before: float
    after: float
    out_of: float
    parts: tuple[tuple[tuple[str, str], Mark | None, Mark | None], ...]

    def __str__(self) -> str:
        """Return a line for the student, and one for each part."""
        head = f"{points(self.before)} → {points(self.after)} of {points(self.out_of)} points; {self.why}"
        lines = [f"{self.student}: {head}"]
        for where, before, after in self.parts:
            reason = sentence(after.reason) if after else ""
            lines.append(f"    {', '.join(where)}: {_in_words(before)} → {_in_words(after)}. {reason}")
        return "\n".join(lines)

    def as_data(self) -> dict[str, Any]:
        """Return why and what as plain data."""
        changed = [
            {"question": question, "part": part, "before": _as_json(before), "after": _as_json(after)}
            for (question, part), before, after in self.parts
        ]
        return {"why": self.why, "changes": changed}


def _in_words(mark: Mark | None) -> str:
    if mark is None:
        return "no mark"
    earned = "not decided," if mark.status in UNDECIDED else points(mark.points)
    return f"{earned} of {points(mark.out_of)} ({mark.status})"


def _as_json(mark: Mark | None) -> dict[str, Any] | None:
    """Return a mark as plain data, without the answer; None without a mark."""
    if mark is None:
        return None
    return {"status": mark.status, "points": mark.points, "out_of": mark.out_of, "reason": sentence(mark.reason)}


def changes(before: Graded, after: Graded) -> Changes:
    """Compare two gradings of a student. Another reason for the same mark is no change."""
    if before.run.submission != after.run.submission:  # other answers in words are not run again
        why = HANDED_IN_AGAIN
    else:
        why = KEY_CHANGED if before.run.key == after.run.key else RUN_AGAIN
    old, new = ({mark.where: mark for mark in graded.marks} for graded in (before, after))
    pairs = ((where, old.get(where), new.get(where)) for where in {**new, **old})
    return Changes(
        after.run.student,
        why,
        sum(mark.points for mark in before.marks),
        sum(mark.points for mark in after.marks),
        sum(mark.out_of for mark in after.marks),
        tuple(pair for pair in pairs if _decision(pair[1]) != _decision(pair[2])),
    )


def _decision(mark: Mark | None) -> tuple[str, float, float] | None:
    return None if mark is None else (mark.status, mark.points, mark.out_of)


def changes_since(before: Graded | None, after: Graded) -> Changes | None:
    """Return what changed for a student; None if nothing did, or if only a failed run or none counted before."""
    had_marks = before is not None and not is_failed(before.run)
    found = changes(before, after) if before is not None and had_marks else None
    return found if found and found.parts else None


# --- since feedback was given back ------------------------------------------------------------------------------------


class ChangedMark(NamedTuple):
    """A mark that is not the one that was published; no mark is None. ``why`` and ``when`` are of the last change."""

    student: str
    question: str
    part: str
    before: MarkState | None
    after: MarkState | None
    why: str
    when: datetime

    @property
    def reason(self) -> str:
        """The reason for the student: that of a person, or that the work was graded again."""
        if self.after is not None and self.after.status == Status.BY_A_PERSON:
            return sentence(self.after.reason)
        return f"Your work was graded again. {NO_LONGER if NO_LONGER in self.why else ''}".strip()

    def __str__(self) -> str:
        """Return question, part and points before and after."""
        return f"{self.question} {self.part}: {state_text(self.before)} → {state_text(self.after)}"


def changed_in(book: Gradebook, course: Course, since_first: bool = False) -> list[ChangedMark]:
    """Find marks with other points than were given back, or that were decided since.

    Leave out notebooks that were never given back, and those from which the student is excused now; and marks that are
    worth nothing, or decided neither then nor now.

    Parameters
    ----------
    book, course : the class
    since_first : compare with what was given back first, and not with what was given back last
    """
    publications, excuses_of = book.publications(), cache(book.excuses)
    entries: dict[tuple[str, str, str], list[AuditRecord]] = defaultdict(list)
    for entry in book.audit(since=publications[0].when) if publications else ():
        notebook = course.notebook_of(entry.question)
        back = [one.when for one in publications if not one.notebooks or notebook in one.notebooks]
        if back and entry.when > back[0 if since_first else -1] and notebook not in excuses_of(entry.student):
            entries[entry.student, entry.question, entry.part].append(entry)
    changes = [
        ChangedMark(*where, those[0].before, those[-1].after, those[-1].reason, those[-1].when)
        for where, those in entries.items()
    ]
    return [change for change in changes if _shown_points(change.before) != _shown_points(change.after)]


def state_text(mark: MarkState | None) -> str:
    """Describe a mark that was given back, or is there now."""
    if mark is None:
        return "no mark"
    return "not decided" if mark.status in UNDECIDED else f"{points(mark.points)} of {points(mark.out_of)}"


def _shown_points(mark: MarkState | None) -> tuple[float, float] | None:
    """Return what a student sees of a mark; None if nothing is decided or it is worth nothing."""
    decided = mark is not None and mark.out_of and mark.status not in UNDECIDED
    return (mark.points, mark.out_of) if mark is not None and decided else None
