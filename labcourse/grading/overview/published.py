"""Feedback that was given back: when, by whom, what changed since, and what was not ready."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

from labcourse import program
from labcourse.grading.gradebook import AuditRecord, Gradebook, MarkState, Publication
from labcourse.grading.overview import counted
from labcourse.grading.overview.section import Section, Table, moment
from labcourse.grading.reports.result import points
from labcourse.grading.settings import CourseSettings
from labcourse.grading.verdicts import UNDECIDED
from labcourse.messages import plural


@dataclass(frozen=True)
class Changed:
    """A mark that is another than when feedback was last given back.

    Attributes
    ----------
    student, question, part : whose, and which
    before, after : as it was given back, and as it is; None for no mark
    """

    student: str
    question: str
    part: str
    before: MarkState | None
    after: MarkState | None


def changed_since(trail: Sequence[AuditRecord], when: datetime) -> list[Changed]:
    """Marks with other points than at a time, or decided since; what went back to what it was is none of them."""
    first: dict[tuple[str, str, str], AuditRecord] = {}
    last: dict[tuple[str, str, str], AuditRecord] = {}
    for entry in trail:
        if entry.when > when:
            mark = (entry.student, entry.question, entry.part)
            first.setdefault(mark, entry)
            last[mark] = entry
    found = [Changed(*mark, entry.before, last[mark].after) for mark, entry in first.items()]
    return [one for one in found if _told(one.before) != _told(one.after)]


def _told(mark: MarkState | None) -> tuple[float, float] | None:
    """What a student is told of a mark; None where nothing is decided, or it is worth nothing."""
    if mark is None or not mark.out_of or mark.status in UNDECIDED:
        return None
    return mark.points, mark.out_of


def section(publications: Sequence[Publication], trail: Sequence[AuditRecord]) -> Section:
    """When feedback was given back, and who has to be told of what changed since."""
    title = "Feedback given back"
    if not publications:
        return Section(title, f"Feedback was not given back yet ({program.name()} publish).")
    last = publications[-1]
    found = changed_since(trail, last.when)
    by_student: dict[str, list[Changed]] = {}
    for one in found:
        by_student.setdefault(one.student, []).append(one)
    first = f"Last given back on {moment(last.when)}, by {last.actor}."
    first += (
        " Marks of {students} have changed since; publish again, so that they see it ({command} publish).".format(
            command=program.name(), students=plural(len(by_student), "{count} student", "{count} students")
        )
        if found
        else " No mark has changed since."
    )
    changes = tuple(
        (student, "\n".join(f"{one.question} {one.part}: {_of(one.before)} → {_of(one.after)}" for one in those))
        for student, those in sorted(by_student.items())
    )
    times = tuple((moment(one.when), one.actor, one.note) for one in publications)
    tables = (
        Table(("Student", "Changed"), changes, caption="Changed since"),
        Table(("When", "By", "Note"), times, caption="Given back"),
    )
    return Section(title, first, (), tables, urgent=bool(found))


def _of(mark: MarkState | None) -> str:
    if mark is None:
        return "no mark"
    if mark.status in UNDECIDED:
        return "not decided"
    return f"{points(mark.points)} of {points(mark.out_of)}"


def not_ready(book: Gradebook, settings: CourseSettings, now: datetime) -> list[str]:
    """What whoever gives feedback back should know: what waits, what is asked, and whether pages are closed now."""
    everything = [one for one in book.scores.answers() if one.waiting]
    waiting = counted.of_answers(everything, settings.marks)
    students = len({one.student for one in waiting})
    open_ones = len(book.requests.all(open_only=True))
    found = []
    if waiting:
        found.append(
            "Still to be read by a person: {answers} of {students}; their pages say so.".format(
                answers=plural(len(waiting), "{count} answer", "{count} answers"),
                students=plural(students, "{count} student", "{count} students"),
            )
        )
    if len(waiting) < len(everything):
        found.append(counted.left_out(settings.marks))
    if open_ones:
        found.append(
            "{requests} not answered yet ({command} requests list).".format(
                command=program.name(), requests=plural(open_ones, "{count} request", "{count} requests")
            )
        )
    seen = settings.feedback
    if seen.opens is not None and not seen.is_open(now):
        found.append(
            f"Feedback opens on {seen.opens:%Y-%m-%d %H:%M %Z} (course.toml), and the pages say so and no more. "
            f"So nothing is given back: say {program.name()} publish again then."
        )
    return found
