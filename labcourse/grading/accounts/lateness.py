"""What is due when for a student, and how late it came."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from datetime import datetime, timedelta
from fractions import Fraction

from labcourse.grading.accounts.exact import exact
from labcourse.grading.gradebook import Arrival, StudentRecord
from labcourse.grading.settings import CourseSettings, Deadline, Extension
from labcourse.student_id import caseless

_DAY = timedelta(days=1)


@dataclass(frozen=True)
class Timing:
    """When a notebook was due, and when it came.

    Attributes
    ----------
    notebook : its name, without ending
    due : the last moment that is in time, by the deadlines
    until : the same for this student, with what extensions they have
    received : when it was handed in; None if that is not known
    clock : how that is known, in words; "" where only the student's computer says it, so that it has to be decided
    days : by how many days it is late, those that have begun counted as whole
    taken : the share (0 to 1) of what it earned that this costs
    extended : whether it would be late, or later, without an extension
    """

    notebook: str
    due: datetime
    until: datetime
    received: datetime | None
    days: int
    taken: Fraction
    extended: bool
    clock: str | None = None

    @property
    def waits(self) -> bool:
        """Whether an instructor has to decide when it was handed in."""
        return self.clock == ""


def timing(settings: CourseSettings, about: StudentRecord, notebook: str, arrival: Arrival | None) -> Timing | None:
    """How a student's notebook stands to what is due; None where nothing is.

    Of several deadlines and extensions that apply, the latest counts. A time that only the student's computer wrote is
    not taken for the time of receipt.

    Parameters
    ----------
    settings : of the course
    about : the student, as the roster has them
    notebook : name without ending
    arrival : when it was handed in; None if it was not
    """
    received, clock = arrival if arrival is not None and arrival.clock != "" else (None, arrival and arrival.clock)
    dues = [one.due for one in settings.deadlines if _is_for(one.notebooks, notebook) and _in(one.section, about, True)]
    if not dues:
        return None
    due = max(dues)
    mine = (one for one in settings.extensions if _is_for(one.notebooks, notebook) and _has(one, about))
    until = max([due, *(one.until for one in mine)])
    late = settings.late
    days = _started_days(received, until, late.grace_hours)
    taken = min(days * exact(late.per_day), exact(late.cap)) / 100
    extended = days < _started_days(received, due, late.grace_hours)
    return Timing(notebook, due, until, received, days, taken, extended, clock)


def _started_days(received: datetime | None, due: datetime, grace_hours: float) -> int:
    """Days, from the end of the grace on; one that has begun is a whole one."""
    return 0 if received is None else max(0, -((due + timedelta(hours=grace_hours) - received) // _DAY))


def _is_for(notebooks: Iterable[str], notebook: str) -> bool:
    return not notebooks or notebook in notebooks


def _in(section: str, about: StudentRecord, anybody: bool) -> bool:
    """Whether a student is in a section; where none is named, that is as told."""
    return caseless(section) == caseless(about.section) if section else anybody


def _has(extension: Extension, about: StudentRecord) -> bool:
    names = {caseless(one) for one in (about.student, *about.aliases)}
    named = not names.isdisjoint(map(caseless, extension.students))
    return named or _in(extension.section, about, False)


@dataclass(frozen=True)
class Unknown:
    """What settings name of a class that is not there.

    Attributes
    ----------
    due : sections, in deadlines: nobody has these
    more_time : students and sections, in extensions: nobody has more time by these
    """

    due: tuple[str, ...] = ()
    more_time: tuple[str, ...] = ()


def unknown_names(settings: CourseSettings, students: Iterable[StudentRecord]) -> Unknown:
    """Students and sections that the settings name and a class does not have: a slip there would cost somebody a mark.

    Parameters
    ----------
    settings : of the course
    students : the class
    """
    there = list(students)
    known = {caseless(name) for one in there for name in (one.student, *one.aliases)}
    sections = {caseless(one.section) for one in there}
    named = [student for one in settings.extensions for student in one.students]
    missing = [name for name in named if caseless(name) not in known]

    def without(those: Iterable[Deadline | Extension]) -> list[str]:
        return [one.section for one in those if one.section and caseless(one.section) not in sections]

    missing += without(settings.extensions)
    return Unknown(tuple(dict.fromkeys(without(settings.deadlines))), tuple(dict.fromkeys(missing)))
