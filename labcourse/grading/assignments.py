"""Assignments, and the calendar: when a student's work is due, and which state it is in.

A piece of work is one notebook of one student. An assignment is one notebook or several: it has a column of its own,
and the least advanced state of its notebooks. The table of states is in ``docs/assignments.md``.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from enum import StrEnum
from fractions import Fraction
from functools import lru_cache
from typing import TYPE_CHECKING

from labcourse import clock
from labcourse.answers.catalogue import Catalogue
from labcourse.errors import GradingError
from labcourse.grading.gradebook import DECIDED, Answer, Arrival, Excuse, Gradebook, Graded, Publication, StudentRecord
from labcourse.grading.graded_run import is_failed, submission_of
from labcourse.grading.intake import is_unread
from labcourse.grading.marks import UNDECIDED, Mark, Status
from labcourse.grading.settings import Assignment, CourseSettings, Deadline, Extension
from labcourse.problems import Code, Problem, Where
from labcourse.student_id import caseless

if TYPE_CHECKING:
    from labcourse.grading.course import Course

_DAY = timedelta(days=1)
#: Statuses of marks from which it does not follow that there is work of the student's.
_SHOWS_NO_WORK = {Status.MISSING, Status.NOT_MARKED, Status.SUPPLIED}


@lru_cache(maxsize=1000)  # a class has the same few points, in thousands of marks
def exact(number: float) -> Fraction:
    """Return a number as it is written: 0.1 is a tenth."""
    return Fraction(str(number))


# --- assignments ------------------------------------------------------------------------------------------------------


def of_course(course: Course) -> list[Assignment]:
    """Return the assignments of a class by date (:func:`last_dues`).

    Those without a date come last. Those that are due at the same time are in the order of their notebooks. A notebook
    that no assignment of the settings names is an assignment of its own, if it has a part that is worth points and that
    the settings do not drop.
    """
    asked = course.asked_catalogue
    parts = [(question, part) for question in asked.marked.values() for part in question.parts if part.points]
    dropped_as = course.settings.marks.dropped_as
    counting = {question.notebook for question, part in parts if not dropped_as(question.number, part.name)}
    named = {name: assignment for assignment in course.settings.assignments for name in assignment.notebooks}
    whole = {name: Assignment(name.replace("_", " "), (name,)) for name in counting} | named
    in_order = list(dict.fromkeys(whole[name] for name in asked.notebooks if name in whole))
    dues = last_dues(course.settings, in_order)
    return sorted(in_order, key=lambda one: (dues[one] is None, dues[one]))


def last_dues(settings: CourseSettings, assignments: Iterable[Assignment]) -> dict[Assignment, datetime | None]:
    """Return assignment → the latest date on which it is due for a section or for all; None if it has no date."""
    rules = [(rule.due, settings.notebooks_of(rule)) for rule in settings.dues]
    return {
        one: max((due for due, names in rules if not names or not names.isdisjoint(one.notebooks)), default=None)
        for one in assignments
    }


def short(notebook: str) -> str:
    """Return the number of a notebook, as "02" of "02_speed"; for a name without a number, the name without ending."""
    number = notebook.partition("_")[0]
    return number if number.isdigit() else notebook.removesuffix(".ipynb")


def find(course: Course, name: str) -> Assignment:
    """Return the assignment that ``name`` means, without regard to capitals.

    Parameters
    ----------
    course : with its settings
    name : title of the assignment, or else the name (without ending) or the number (as "02") of one of its notebooks

    Raises
    ------
    GradingError
        If there is none.
    """
    assignments = of_course(course)
    for names_of in (lambda one: [one.title], lambda one: one.notebooks, lambda one: map(short, one.notebooks)):
        for one in assignments:
            if caseless(name) in map(caseless, names_of(one)):
                return one
    raise GradingError(f"There is no assignment {name!r}. There are: {', '.join(one.title for one in assignments)}.")


def notebook(course: Course, name: str) -> str:
    """Return the notebook, without ending, that a name or a number (as "02") means. Raises GradingError without one."""
    names = [notebook for assignment in of_course(course) for notebook in assignment.notebooks]
    for one in names:
        if caseless(name.removesuffix(".ipynb")) in (caseless(one), caseless(short(one))):
            return one
    raise GradingError(f"No assignment has a notebook {name!r}. They have: {', '.join(names)}.")


def given_back(publications: Iterable[Publication]) -> frozenset[str] | None:
    """Return the notebooks, without ending, of which students may see the marks; None for all notebooks.

    They are all notebooks without any publication, and if one of the publications is of all notebooks.
    """
    notebooks = [publication.notebooks for publication in publications]
    if not all(notebooks) or not notebooks:
        return None
    return frozenset(name for names in notebooks for name in names)


def asked_of_persons(book: Gradebook, catalogue: Catalogue, parts: Collection[Where] | None = None) -> list[Answer]:
    """Return the answers that persons read or have marked, without those from which the student is excused.

    Parameters
    ----------
    book, catalogue : the class's gradebook, and the course's questions
    parts : only the answers to these; to all if it is None
    """
    excused = {(act.student, act.notebook): act.excused for act in book.decisions() if isinstance(act, Excuse)}
    notebooks, answers = {one.number: one.notebook for one in catalogue.marked.values()}, book.scores.answers(parts)
    return [one for one in answers if not excused.get((one.student, notebooks.get(one.question, "")))]


# --- deadlines --------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Timing:
    """When a notebook was due, and when it was handed in.

    Attributes
    ----------
    notebook : name without ending
    due : the last moment that is in time, by the deadlines
    until : the same for this student, with their extensions
    received : when it was handed in; None if that is not known
    days : days late; each day that has begun counts
    lost_share : share (0 to 1) of the earned points that lateness costs
    extended : whether it would be late, or later, without an extension
    clock : how the time is known; "" if only the student's computer wrote it, so that an instructor has to decide
    """

    notebook: str
    due: datetime
    until: datetime
    received: datetime | None
    days: int
    lost_share: Fraction
    extended: bool
    clock: str | None = None

    @property
    def waits(self) -> bool:
        """Whether an instructor has to decide when it was handed in."""
        return self.clock == ""

    @property
    def is_special(self) -> bool:
        """Whether it was late, in time only by an extension, or at a time that a person decided or has to decide."""
        return bool(self.days) or self.extended or self.clock in ("", DECIDED)


def lateness(settings: CourseSettings, student: StudentRecord, notebook: str, arrival: Arrival | None) -> Timing | None:
    """Compare the arrival of a student's notebook with its deadline; return None if it has no deadline.

    Of several deadlines and extensions that apply, the latest counts. A time that only the student's computer wrote is
    not used as the time of receipt.

    Parameters
    ----------
    settings : of the course
    student : as the roster has them
    notebook : name without ending
    arrival : when it was handed in; None if it was not
    """
    names = {caseless(name) for name in (student.student, *student.aliases)}

    def applies(rule: Deadline | Extension) -> bool:
        notebooks = settings.notebooks_of(rule)
        return not notebooks or notebook in notebooks

    def in_section(rule: Deadline | Extension) -> bool:
        return bool(rule.section) and caseless(rule.section) == caseless(student.section)

    dues = [rule.due for rule in settings.dues if applies(rule) and (not rule.section or in_section(rule))]
    if not dues:
        return None
    mine = (
        rule.until
        for rule in settings.extensions
        if applies(rule) and (in_section(rule) or names & set(map(caseless, rule.students)))
    )
    due, until, late = max(dues), max([*dues, *mine]), settings.late
    clock = None if arrival is None else arrival.clock
    received = None if arrival is None or clock == "" else arrival.received
    days, without_extension = (_days_late(received, moment, late.grace_hours) for moment in (until, due))
    lost_share = min(days * exact(late.per_day), exact(late.cap)) / 100
    return Timing(notebook, due, until, received, days, lost_share, days < without_extension, clock)


def _days_late(received: datetime | None, due: datetime, grace_hours: float) -> int:
    """Count the days from the end of the hours of grace to the receipt; a day that has begun counts as one.

    Return 0 if it was received before, and if ``received`` is None.
    """
    return 0 if received is None else max(0, -((due + timedelta(hours=grace_hours) - received) // _DAY))


# --- states -----------------------------------------------------------------------------------------------------------


class State(StrEnum):
    """The state of a piece of work, from the least advanced on."""

    NOT_GRADED = "could not be graded"
    MISSING = "missing"
    UNTOUCHED = "untouched"
    NOT_DUE = "not due"
    HANDED_IN = "handed in"
    WAITS = "waits for a person"
    MARKED = "marked"


def least(states: Iterable[State]) -> State:
    """Return the least advanced of some states."""
    return min(states, key=list(State).index)


@dataclass(frozen=True)
class Work:
    """A piece of work: a notebook of a student.

    Attributes
    ----------
    notebook : name without ending
    state : of it
    is_due : whether it is due, so that it counts; extensions and hours of grace are in it
    until : when it is due for this student, without hours of grace; None if no notebook has a deadline
    timing : when it was due, and handed in; None without a deadline
    excuse : the act that excuses the student; None if they are not excused
    is_unread : whether a file came that cannot be read, and no person has given points for it
    """

    notebook: str
    state: State
    is_due: bool
    until: datetime | None = None
    timing: Timing | None = None
    excuse: Excuse | None = None
    is_unread: bool = False

    @property
    def counts(self) -> bool:
        """Whether it counts so far."""
        return self.is_due and self.excuse is None

    @property
    def is_blank(self) -> bool:
        """Whether there is nothing of the student's, and nothing is owed: it is not due, or they are excused."""
        return not self.counts and self.state in (State.MISSING, State.UNTOUCHED, State.NOT_DUE)

    @property
    def days_late(self) -> int:
        """Days by which it was handed in late."""
        return self.timing.days if self.timing is not None else 0


@dataclass(frozen=True)
class Handed:
    """What a gradebook has of a student, from which the states of their work follow.

    Attributes
    ----------
    student : as the roster has them
    marks : that count
    received : file name of a notebook → when it was handed in
    graded : the run that counts; None without one
    excuses : notebook, without ending → the act that excuses the student
    """

    student: StudentRecord
    marks: Sequence[Mark] = ()
    received: Mapping[str, Arrival] = field(default_factory=dict)
    graded: Graded | None = None
    excuses: Mapping[str, Excuse] = field(default_factory=dict)


def works(course: Course, handed: Handed, when: datetime | None = None) -> dict[str, Work]:
    """Determine the state of each notebook of a student.

    A notebook without a deadline of its own is due with the last one that has one. If no notebook has a deadline, all
    are due.

    Parameters
    ----------
    course : with its settings
    handed : what there is of the student
    when : the time at which it is asked what is due; now, if it is None

    Returns
    -------
    dict
        Name, without ending, of each notebook of an assignment → the student's work in it.
    """
    settings, when, graded = course.settings, when or clock.now(), handed.graded
    names = [name for assignment in of_course(course) for name in assignment.notebooks]
    untouched = submission_of(graded.run).untouched if graded is not None else ()
    arrivals = {name: None if name in untouched else handed.received.get(f"{name}.ipynb") for name in names}
    timings = {name: lateness(settings, handed.student, name, arrivals[name]) for name in names}
    last = max((timing.until for timing in timings.values() if timing is not None), default=None)
    grace = timedelta(hours=settings.late.grace_hours)
    problems = () if graded is None else graded.run.problems
    unread = [one for one in problems if isinstance(one, Problem) and one.code is Code.SUBMISSION_UNREAD]
    statuses = _statuses(course, handed.marks)
    found = {}
    for name, timing in timings.items():
        until = last if timing is None else timing.until
        is_due = until is None or when > until + grace
        undecided_time = bool(timing and timing.waits and settings.late.per_day)
        state = _state_if_there(handed, name, statuses[name], undecided_time)
        if state is None:
            may_be_there = any(f"{name}.ipynb" in one.parameters.get("notebooks", [f"{name}.ipynb"]) for one in unread)
            absent = State.NOT_GRADED if may_be_there else State.MISSING
            state = absent if is_due else State.NOT_DUE
        elif name in untouched:
            state = State.UNTOUCHED
        shows_work = f"{name}.ipynb" in handed.received or statuses[name] - _SHOWS_NO_WORK
        is_unread = state is State.NOT_GRADED and not shows_work
        found[name] = Work(name, state, is_due, until, timing, handed.excuses.get(name), is_unread)
    return found


def _statuses(course: Course, marks: Iterable[Mark]) -> dict[str, set[Status]]:
    """Return notebook, without ending → the statuses of its marks that are worth points and are not dropped."""
    found = defaultdict[str, set[Status]](set)
    for mark in marks:
        if mark.out_of and not course.settings.marks.dropped_as(mark.question, mark.part):
            found[course.notebook_of(mark.question)].add(mark.status)
    return found


def _state_if_there(handed: Handed, name: str, statuses: set[Status], undecided_time: bool) -> State | None:
    """Return the state of a notebook of which there is a file, even one that cannot be read, or a mark that shows work.

    Return None if there is neither.

    Parameters
    ----------
    handed : what there is of the student
    name : of the notebook, without ending
    statuses : of its marks that count
    undecided_time : whether an instructor has to decide when it was handed in, and lateness costs points
    """
    file, graded = f"{name}.ipynb", handed.graded
    if file not in handed.received and statuses <= _SHOWS_NO_WORK:
        run = None if graded is None else graded.run
        return State.NOT_GRADED if run and (is_failed(run) or is_unread(file, run.problems)) else None
    if graded is None and not handed.marks:
        return State.HANDED_IN
    if (graded is not None and is_failed(graded.run)) or Status.NOT_MARKED in statuses:
        return State.NOT_GRADED
    return State.WAITS if undecided_time or statuses & {*UNDECIDED} else State.MARKED
