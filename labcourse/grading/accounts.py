"""Compute a student's points: of each assignment and so far, with weights, lateness, and what does not count.

Points are fractions as they are written, so 0.1 is a tenth. Only what is shown is rounded, once.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterable
from dataclasses import dataclass, replace
from datetime import datetime
from decimal import Decimal, localcontext
from fractions import Fraction
from functools import cached_property
from typing import Any

from labcourse.grading.assignments import Handed, State, Timing, Work, exact, least, of_course, works
from labcourse.grading.course import Course
from labcourse.grading.gradebook import StudentRecord
from labcourse.grading.marks import UNDECIDED, Mark
from labcourse.grading.settings import Assignment, CourseSettings, Deadline, Extension, LateSettings
from labcourse.messages import number_of
from labcourse.student_id import caseless

_DIGITS = 100  # of an exact decimal number; points, weights and per cents have at most a dozen each


def half_up(number: Fraction, decimals: int) -> Fraction:
    """Round a number that is not negative; halves are rounded up."""
    scale = 10**decimals
    return Fraction((number * scale + Fraction(1, 2)) // 1, scale)


def to_hundredths(number: Fraction) -> str:
    """Write points rounded half up to two decimals, as "9.50"."""
    return f"{float(half_up(number, 2)):.2f}"


def in_full(number: Fraction) -> str:
    """Write a number with all its decimals, as "2.25"; rounded half up to two if they do not end."""
    if 10**_DIGITS % number.denominator:
        return to_hundredths(number)
    with localcontext(prec=_DIGITS):
        return f"{(Decimal(number.numerator) / Decimal(number.denominator)).normalize():f}"


def points(number: float) -> str:
    """Format points with two decimals at most, rounded half up as in exports: "2", "1.5"."""
    return in_full(half_up(exact(number), 2))


def worth(number: float) -> str:
    """Format points with two decimals at most and their word: "1 point", "1.5 points"."""
    text = points(number)
    return "1 point" if text == "1" else f"{text} points"


# --- names in the settings --------------------------------------------------------------------------------------------


def unknown_names(settings: CourseSettings, students: Iterable[StudentRecord]) -> tuple[list[str], list[str]]:
    """Find students and sections that the settings name and the class does not have.

    Such a slip would cost a student points.

    Parameters
    ----------
    settings : of the course
    students : the class

    Returns
    -------
    list[str]
        Sections in deadlines.
    list[str]
        Students, and after them sections, in extensions.
    """
    students = list(students)
    known = {caseless(name) for student in students for name in (student.student, *student.aliases)}
    sections = {caseless(student.section) for student in students} | {""}

    def unknown(rules: Iterable[Deadline | Extension]) -> list[str]:
        return [rule.section for rule in rules if caseless(rule.section) not in sections]

    named = [name for rule in settings.extensions for name in rule.students if caseless(name) not in known]
    return list(dict.fromkeys(unknown(settings.deadlines))), list(dict.fromkeys(named + unknown(settings.extensions)))


# --- points -----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class AccountItem:
    """A mark, and how it counts.

    Attributes
    ----------
    question, part : number of the question, and name of the part
    notebook : in which it is asked, and with which it is due; "" if the course does not ask it any more
    points : earned, without weight and lateness; None if they are not decided
    out_of : possible points, without weight
    dropped_as : the name by which the settings leave it out; "" if it counts
    weighted_as : the name by which the settings give it another weight; "" if they do not
    weight : factor of the points and of what they are out of
    lost_share : share (0 to 1) of the points that lateness costs
    """

    question: str
    part: str
    notebook: str
    points: Fraction | None
    out_of: Fraction
    dropped_as: str = ""
    weighted_as: str = ""
    weight: Fraction = Fraction(1)
    lost_share: Fraction = Fraction(0)

    @cached_property
    def weighted(self) -> Fraction:
        """Points with their weight, before lateness; 0 while they are not decided."""
        return self.weight * (self.points or 0)

    @cached_property
    def earned(self) -> Fraction:
        """Points with their weight and lateness; 0 while they are not decided."""
        return self.weighted * (1 - self.lost_share)

    @cached_property
    def possible(self) -> Fraction:
        """What the weighted points are out of."""
        return self.weight * self.out_of


@dataclass(frozen=True)
class AssignmentGrade:
    """A student's points of an assignment.

    Attributes
    ----------
    assignment : which; with title "" for marks that are in no assignment
    works : the states of its notebooks
    all_items : each mark in it that is worth points, also those that do not count
    is_given_back : whether the reader may see its marks
    """

    assignment: Assignment
    works: tuple[Work, ...]
    all_items: tuple[AccountItem, ...]
    is_given_back: bool = True

    @property
    def title(self) -> str:
        """Title of the assignment."""
        return self.assignment.title

    @cached_property
    def state(self) -> State:
        """The least advanced state of the notebooks from which the student is not excused; if excused from all, of all.

        A notebook that is worth nothing decides only if all are. Marks that are in no assignment are marked.
        """
        worth = {item.notebook for item in self.all_items} or {work.notebook for work in self.works}
        open_to_them = [work for work in self.works if work.excuse is None] or self.works
        counting = [work for work in open_to_them if work.notebook in worth] or open_to_them
        return least([work.state for work in counting] or [State.MARKED])

    @property
    def is_excused(self) -> bool:
        """Whether the student is excused from all of it."""
        return bool(self.works) and all(work.excuse for work in self.works)

    @property
    def is_due(self) -> bool:
        """Whether all of its notebooks are due."""
        return all(work.is_due for work in self.works)

    @cached_property
    def counts(self) -> bool:
        """Whether it counts so far: it is due and given back, and the student is not excused."""
        return self.is_due and self.is_given_back and not self.is_excused

    @property
    def is_empty(self) -> bool:
        """Whether it has no points yet, which is not the same as 0 points.

        Its marks are not given back, or, by the least advanced of its notebooks, it is not due or not graded yet.
        """
        open_yet = self.state is State.UNTOUCHED and not self.is_due
        return open_yet or not self.is_given_back or self.state in (State.NOT_DUE, State.HANDED_IN)

    @property
    def until(self) -> datetime | None:
        """When the last of its notebooks is due; None if none has a date."""
        return max((work.until for work in self.works if work.until is not None), default=None)

    @property
    def days_late(self) -> int:
        """Days by which the latest of its notebooks was late; 0 if none was."""
        return max((work.days_late for work in self.works), default=0)

    @property
    def items(self) -> list[AccountItem]:
        """The marks in the notebooks from which the student is not excused, also those that the settings drop."""
        excused = {work.notebook for work in self.works if work.excuse is not None}
        return [item for item in self.all_items if item.notebook not in excused]

    @cached_property
    def counting(self) -> list[AccountItem]:
        """The marks that count: neither excused nor dropped."""
        return [item for item in self.items if not item.dropped_as]

    @property
    def undecided(self) -> list[AccountItem]:
        """The marks that count and are not decided."""
        return [item for item in self.counting if item.points is None]

    @cached_property
    def earned(self) -> Fraction:
        """Points of its notebooks with weights and lateness, as far as they are decided."""
        return sum((item.earned for item in self.counting), Fraction(0))

    @cached_property
    def possible(self) -> Fraction:
        """What these points are out of, undecided ones included."""
        return sum((item.possible for item in self.counting), Fraction(0))

    @cached_property
    def out_of(self) -> Fraction:
        """The maximum of its column: the one in the settings, else what the marks that count are out of, with weights.

        If the student is excused from the whole assignment, count as if they were not.
        """
        if self.assignment.out_of is not None:
            return exact(self.assignment.out_of)
        items = self.all_items if self.is_excused else self.items
        return sum((item.possible for item in items if not item.dropped_as), Fraction(0))

    @property
    def points(self) -> Fraction:
        """Points on the scale of its column (:attr:`out_of`), not rounded, as far as they are decided."""
        return self.earned * ratio(self.out_of, self.possible)

    @property
    def points_text(self) -> str:
        """Points on the scale of its column, rounded, as "9.50".

        It is "" while some are not decided or it has none yet, if the student is excused, and if it is out of nothing.
        """
        unknown = self.is_empty or self.undecided or self.state is State.NOT_GRADED
        if unknown or self.is_excused or not self.possible:
            return ""
        return to_hundredths(self.points)

    def as_data(self) -> dict[str, Any]:
        """Return it for JSON."""
        excuses = [work.excuse for work in self.works if work.excuse is not None]
        return {
            "title": self.title,
            "notebooks": {work.notebook: work.state for work in self.works},
            "state": self.state,
            "due": self.until,
            "days_late": self.days_late,
            "excused": [{"notebook": e.notebook, "by": e.actor, "reason": e.reason, "when": e.when} for e in excuses],
            "points": self.points_text,
            "out_of": float(self.out_of),
        }


def ratio(part: Fraction, whole: Fraction) -> Fraction:
    """Divide; return 0 if the whole is 0."""
    return part / whole if whole else Fraction(0)


@dataclass(frozen=True)
class Account:
    """A student's points so far, and what is special about them.

    Attributes
    ----------
    assignments : all of the class, in order, and marks that are in none of them last
    late : the settings
    """

    assignments: tuple[AssignmentGrade, ...]
    late: LateSettings

    @cached_property
    def so_far(self) -> list[AssignmentGrade]:
        """The assignments that count so far; one without title has the marks that are in no assignment."""
        return [one for one in self.assignments if one.counts]

    @property
    def later(self) -> str:
        """The titles of the assignments that do not count yet, without those from which the student is excused."""
        later = (one.title for one in self.assignments if not one.counts and not one.is_excused)
        return ", ".join(filter(None, later))

    def given_back(self, notebooks: Collection[str] | None) -> Account:
        """Return the account as the student may see it.

        Parameters
        ----------
        notebooks : names, without ending, of those of which the marks were given back; None for all. An assignment is
            given back when all of its notebooks are. Marks of questions that the course does not ask any more are
            given back only with all
        """
        if notebooks is None:
            return self
        back = [replace(one, is_given_back={*one.assignment.notebooks} <= {*notebooks}) for one in self.assignments]
        return replace(self, assignments=tuple(back))

    @cached_property
    def items(self) -> list[AccountItem]:
        """The marks in :attr:`so_far` that are worth points, also those that the settings drop."""
        return [item for one in self.so_far for item in one.items]

    @cached_property
    def counting(self) -> list[AccountItem]:
        """The marks that count so far: in an assignment that counts so far, and neither excused nor dropped."""
        return [item for one in self.so_far for item in one.counting]

    @cached_property
    def undecided(self) -> list[AccountItem]:
        """The marks that count so far and are not decided."""
        return [item for one in self.so_far for item in one.undecided]

    @property
    def timings(self) -> list[Timing]:
        """The timings of notebooks that came late, in time only by an extension, or at an unknown time.

        Notebooks that earned nothing, or that cannot be read, are left out; those with undecided points are not.
        """
        earning = {item.notebook for item in self.counting if item.points != 0}
        read = [work for one in self.so_far for work in one.works if not work.is_unread]
        timings = [work.timing for work in read if work.notebook in earning]
        return [timing for timing in timings if timing and (timing.days or timing.extended or timing.received is None)]

    @cached_property
    def earned(self) -> Fraction:
        """Points so far, as far as they are decided."""
        return sum((one.points for one in self.so_far), Fraction(0))

    @property
    def so_far_text(self) -> str:
        """Points so far, as far as they are decided, rounded, as "7.30"."""
        return to_hundredths(self.earned)

    @cached_property
    def out_of(self) -> Fraction:
        """What the points so far are out of, undecided ones included; without assignments in which nothing counts."""
        return sum((one.out_of for one in self.so_far if one.possible), Fraction(0))

    def as_data(self) -> dict[str, Any]:
        """Return it for JSON."""
        return {
            "earned": float(self.so_far_text),
            "out_of": float(self.out_of),
            "assignments": [one.as_data() for one in self.assignments if one.title],
            "how": self.explanations(),
        }

    def explanations(self) -> list[str]:
        """Return sentences on what is special about the points so far, so that they can be computed again by hand."""
        lines = [f"Not counted so far, as it is not due or not given back: {self.later}."] if self.later else []
        if dropped := dict.fromkeys(item.dropped_as for item in self.items if item.dropped_as):
            lines.append(f"Not counted: {', '.join(dropped)}.")
        weights = {item.weighted_as: item.weight for item in self.counting if item.weighted_as}
        lines += [f"{name} counts {in_full(weight)} times." for name, weight in weights.items()]
        lines += map(self.timing_text, self.timings)
        for one in self.so_far:
            if one.possible not in (0, one.out_of):
                scale = f"points out of {in_full(one.possible)} are put on the scale of {in_full(one.out_of)}"
                lines.append(f"{one.title}: {scale}.")
        return lines

    def timing_text(self, entry: Timing) -> str:
        """Describe when a notebook was due and handed in, and what lateness costs."""
        due, until = _when(entry.due, entry.until), _when(entry.until, entry.until)
        if entry.received is None:
            rest = "Nobody knows when it was handed in. It counts as in time."
            if entry.waits:
                rest = "Only the computer on which it was written says when it was saved. "
                rest += "An instructor decides when it was handed in."
            return f"{entry.notebook} was due on {until}. {rest}"
        start = f"{entry.notebook} was handed in on {_when(entry.received, entry.until)}"
        start += f" ({entry.clock})" if entry.clock else ""
        if not entry.days:
            extension = f"There is an extension until {until}, so it" if entry.extended else "It"
            return f"{start}. It was due on {due}. {extension} is in time."
        late = self.late
        extended = " by an extension" if entry.extended else ""
        grace = f" with {in_full(exact(late.grace_hours))} h of grace" if late.grace_hours else ""
        days = number_of(entry.days, "day")
        what = f"{start}, due on {until}{extended}{grace}: {days} late (a day that has begun counts)."
        if not entry.lost_share:
            return f"{what} That costs nothing."
        capped = entry.days * exact(late.per_day) > exact(late.cap)
        most = f", and {in_full(exact(late.cap))} % at most" if capped else ""
        per_day, lost = in_full(exact(late.per_day)), in_full(entry.lost_share * 100)
        return f"{what} {per_day} % a day{most}: it loses {lost} % of its points."


def account_of(course: Course, handed: Handed, when: datetime | None = None) -> Account:
    """Compute a student's points by the settings of a course.

    Leave out marks that are worth nothing. Put marks of notebooks in no assignment into a last assignment with the
    title "", in the order of the notebooks' names. A notebook is "" if the course does not ask the question any more.

    Parameters
    ----------
    course : with its settings and its catalogue
    handed : what there is of the student: all marks, also those by persons
    when : the time at which it is asked what is due; now, if it is None
    """
    settings, work = course.settings, works(course, handed, when)
    items = defaultdict[str, list[AccountItem]](list)
    for mark in handed.marks:
        if mark.out_of:
            name = course.notebook_of(mark.question)
            items[name].append(_item(mark, name, work.get(name), settings))
    unassigned = Assignment("", tuple(sorted(items.keys() - work.keys())))
    grades = []
    for one in [*of_course(course), unassigned]:
        own_works = tuple(work[name] for name in one.notebooks if name in work)
        own_items = tuple(item for name in one.notebooks for item in items[name])
        grades.append(AssignmentGrade(one, own_works, own_items))
    return Account(tuple(grades), settings.late)


def _item(mark: Mark, notebook: str, work: Work | None, settings: CourseSettings) -> AccountItem:
    """Make the account item of a mark.

    Leave its points undecided if the mark is not decided, if the file of its notebook cannot be read, or if lateness
    costs points and a person has still to decide when the notebook was handed in.
    """
    marks, where, timing = settings.marks, (mark.question, mark.part), None if work is None else work.timing
    unread = work is not None and work.is_unread
    undecided = mark.status in UNDECIDED or unread or (timing is not None and timing.waits and settings.late.per_day)
    return AccountItem(
        *where,
        notebook,
        points=None if undecided else exact(mark.points),
        out_of=exact(mark.out_of),
        dropped_as=marks.dropped_as(*where),
        weighted_as=marks.weighted_as(*where),
        weight=exact(marks.weight(*where)),
        lost_share=Fraction(0) if timing is None else timing.lost_share,
    )


def _when(moment: datetime, zone_of: datetime) -> str:
    """Write a time to the minute, in the time zone of ``zone_of``."""
    return f"{moment.astimezone(zone_of.tzinfo):%Y-%m-%d %H:%M %Z}"
