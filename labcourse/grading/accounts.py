"""Compute final grades: weights, what is left out, lateness and rounding, and explain each step.

Points are fractions as they are written, so 0.1 is a tenth. Only the final grade is rounded, once.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from datetime import datetime, timedelta
from decimal import Decimal, localcontext
from fractions import Fraction
from typing import Any

from labcourse.answers import answers, reflection
from labcourse.errors import AnswerError
from labcourse.grading.course import Course
from labcourse.grading.gradebook import Arrival, MarkRecord, RunRecord, StudentRecord
from labcourse.grading.marking.marking import Mark
from labcourse.grading.settings import CourseSettings, Deadline, Extension, LateSettings, MarkSettings
from labcourse.grading.verdicts import UNDECIDED
from labcourse.messages import plural
from labcourse.student_id import caseless

_DAY = timedelta(days=1)
_DIGITS = 100  # of an exact decimal number; points, weights and per cents have at most a dozen each
_SHOWN = 6  # decimals of a number that has no exact decimal form, such as 1/3


def exact(number: float) -> Fraction:
    """Return a number as it is written: 0.1 is a tenth."""
    return Fraction(str(number))


def half_up(number: Fraction, decimals: int) -> Fraction:
    """Round a number that is not negative; halves are rounded up."""
    scale = 10**decimals
    return Fraction((number * scale + Fraction(1, 2)) // 1, scale)


def in_full(number: Fraction) -> str:
    """Write a number with all its decimals, as "2.25"; with six of them and "…" if they do not end."""
    if 10**_DIGITS % number.denominator:
        return f"{in_full(Fraction(number * 10**_SHOWN // 1, 10**_SHOWN))}…"
    with localcontext(prec=_DIGITS):
        return f"{(Decimal(number.numerator) / Decimal(number.denominator)).normalize():f}"


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
    taken : share (0 to 1) of the earned points that lateness costs
    extended : whether it would be late, or later, without an extension
    clock : how the time is known; "" if only the student's computer wrote it, so that an instructor has to decide
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


def timing(settings: CourseSettings, student: StudentRecord, notebook: str, arrival: Arrival | None) -> Timing | None:
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
        return not rule.notebooks or notebook in rule.notebooks

    def in_section(rule: Deadline | Extension) -> bool:
        return bool(rule.section) and caseless(rule.section) == caseless(student.section)

    dues = [rule.due for rule in settings.deadlines if applies(rule) and (not rule.section or in_section(rule))]
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
    taken = min(days * exact(late.per_day), exact(late.cap)) / 100
    return Timing(notebook, due, until, received, days, taken, days < without_extension, clock)


def _days_late(received: datetime | None, due: datetime, grace_hours: float) -> int:
    """Count the days from the end of the grace; each day that has begun counts."""
    return 0 if received is None else max(0, -((due + timedelta(hours=grace_hours) - received) // _DAY))


def unknown_names(settings: CourseSettings, students: Iterable[StudentRecord]) -> tuple[list[str], list[str]]:
    """Find names in the settings that a class does not have; such a slip would cost somebody a mark.

    Parameters
    ----------
    settings : of the course
    students : the class

    Returns
    -------
    list[str]
        Sections in deadlines.
    list[str]
        Students and sections in extensions.
    """
    students = list(students)
    known = {caseless(name) for student in students for name in (student.student, *student.aliases)}
    sections = {caseless(student.section) for student in students} | {""}

    def unknown(rules: Iterable[Deadline | Extension]) -> list[str]:
        return [rule.section for rule in rules if caseless(rule.section) not in sections]

    named = [name for rule in settings.extensions for name in rule.students if caseless(name) not in known]
    return list(dict.fromkeys(unknown(settings.deadlines))), list(dict.fromkeys(named + unknown(settings.extensions)))


# --- final grades -----------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Item:
    """A mark, and how it counts.

    Attributes
    ----------
    question, part : which
    notebook : in which it is asked, and with which it is due; "" if the course does not ask it any more
    points : earned; None if they are not decided
    out_of : possible points
    dropped_as : the name by which the settings leave it out; "" if it counts
    weighted_as : the name by which the settings give it another weight; "" if they do not
    weight : factor of the points and of what they are out of
    taken : share (0 to 1) of the points that lateness costs
    """

    question: str
    part: str
    notebook: str
    points: Fraction | None
    out_of: Fraction
    dropped_as: str = ""
    weighted_as: str = ""
    weight: Fraction = Fraction(1)
    taken: Fraction = Fraction(0)

    @property
    def weighted(self) -> Fraction:
        """Points with their weight, before lateness."""
        return self.weight * (self.points or 0)

    @property
    def possible(self) -> Fraction:
        """What the weighted points are out of."""
        return self.weight * self.out_of


@dataclass(frozen=True)
class FinalGrade:
    """A student's final grade, and how it is computed.

    Attributes
    ----------
    items : each mark that is worth points, also those that do not count
    timings : notebooks that came late, in time only by an extension, or at an unknown time
    predictions : how many predictions were made; each may earn additional points
    marks, late : the settings
    """

    items: tuple[Item, ...]
    timings: tuple[Timing, ...]
    predictions: int
    marks: MarkSettings
    late: LateSettings

    @property
    def counting(self) -> list[Item]:
        """The marks that count."""
        return [item for item in self.items if not item.dropped_as]

    @property
    def undecided(self) -> list[Item]:
        """The marks that count and are not decided."""
        return [item for item in self.counting if item.points is None]

    @property
    def earned(self) -> Fraction:
        """Points as they count, as far as they are decided."""
        bonus = self.predictions * exact(self.marks.predictions)
        return sum((item.weighted * (1 - item.taken) for item in self.counting), bonus)

    @property
    def out_of(self) -> Fraction:
        """What these points are out of, undecided ones included."""
        return sum((item.possible for item in self.counting), Fraction(0))

    @property
    def scaled(self) -> Fraction:
        """Earned points on the scale of the final grade, not rounded. ``out_of`` must not be 0."""
        return self.earned if self.marks.out_of is None else self.earned / self.out_of * exact(self.marks.out_of)

    @property
    def final(self) -> float | None:
        """The final grade; None while a mark that counts is not decided, and if nothing counts."""
        if self.undecided or not self.out_of:
            return None
        return float(half_up(self.scaled, self.marks.decimals))

    @property
    def final_text(self) -> str:
        """The final grade with all of its decimals, as "72.30"; "" without one."""
        return "" if self.final is None else f"{self.final:.{self.marks.decimals}f}"

    @property
    def final_out_of(self) -> float:
        """The scale of the final grade."""
        return float(self.out_of) if self.marks.out_of is None else self.marks.out_of

    @property
    def is_plain(self) -> bool:
        """Whether the final grade is only the sum of the points."""
        usual, marks = MarkSettings(), self.marks
        special = any(item.dropped_as or item.weighted_as for item in self.items) or self.timings or marks.predictions
        return not special and (marks.out_of, marks.decimals) == (usual.out_of, usual.decimals)

    def as_data(self) -> dict[str, Any]:
        """Return it for JSON."""
        return {
            "earned": float(self.earned),
            "out_of": float(self.out_of),
            "final": self.final,
            "final_out_of": self.final_out_of,
            "how": self.how(),
            "steps": self.steps(),
        }

    def how(self) -> list[str]:
        """List what is special about it, in a few words each and without points."""
        dropped = ", ".join(_grouped(self.items, "dropped_as"))
        weighted = _grouped(self.counting, "weighted_as").items()
        lines = [f"not counted: {dropped}"] if dropped else []
        lines += [f"{name} counts {in_full(items[0].weight)} times" for name, items in weighted]
        lines += [f"{entry.notebook}: {_lateness(entry)}" for entry in self.timings]
        return lines + ([f"{self.predictions} predictions made"] if self.marks.predictions else [])

    def steps(self) -> list[str]:
        """Explain the final grade step by step, so that it can be computed again by hand."""
        return [*self._steps(), *self._last_steps()]

    def _steps(self) -> Iterator[str]:
        counting, each = self.counting, exact(self.marks.predictions)
        yield f"All answers: {_points(self.items)}."
        if dropped := _grouped(self.items, "dropped_as"):
            names = ", ".join(f"{name} ({_points(items)}{_so_far(items)})" for name, items in dropped.items())
            yield f"Not counted: {names}. Left: {_points(counting)}."
        for name, items in _grouped(counting, "weighted_as").items():
            after = _of(sum(item.weighted for item in items), sum(item.possible for item in items))
            yield f"{name} counts {in_full(items[0].weight)} times: {_points(items)} become {after}."
        yield from map(self._timing_step, self.timings)
        if each:
            more = in_full(self.predictions * each)
            yield f"{self.predictions} predictions made, {_worth(each)} each: {more} more."
        if not self.is_plain:
            yield f"Together: {_of(self.earned, self.out_of)}."

    def _timing_step(self, entry: Timing) -> str:
        due, until = _when(entry.due, entry.until), _when(entry.until, entry.until)
        if entry.received is None:
            rest = "It is not known when it was handed in; it is taken as in time."
            if entry.waits:
                rest = "Only the computer that it was written on says when it was saved; "
                rest += "your instructor decides when it was handed in."
            return f"{entry.notebook} was due on {until}. {rest}"
        start = f"{entry.notebook} was handed in on {_when(entry.received, entry.until)}"
        start += f" ({entry.clock})" if entry.clock else ""
        if not entry.days:
            return f"{start}. It was due on {due}; by an extension until {until} it is in time."
        late = self.late
        extended = " by an extension" if entry.extended else ""
        grace = f" with {in_full(exact(late.grace_hours))} h of grace" if late.grace_hours else ""
        what = f"{start}, due on {until}{extended}{grace}: {_days(entry.days)} late (one that has begun counts)."
        if not entry.taken:
            return f"{what} That costs nothing."
        capped = entry.days * exact(late.per_day) > exact(late.cap)
        most = f", and {in_full(exact(late.cap))} % at most" if capped else ""
        points = sum(item.weighted for item in self.counting if item.notebook == entry.notebook)
        cost = f"{in_full(entry.taken * 100)} % of its {_worth(points)} are taken, {in_full(points * entry.taken)}."
        return f"{what} {in_full(exact(late.per_day))} % a day{most}: {cost}"

    def _last_steps(self) -> Iterator[str]:
        marks = self.marks
        if self.undecided:
            waiting = _worth(sum(item.possible for item in self.undecided))
            yield f"There is no final grade yet: still to be decided are {waiting}."
        elif self.final is None:
            yield "Nothing of this counts, so that there is no final grade."
        else:
            if marks.out_of is not None:
                scale = in_full(exact(marks.out_of))
                share = f"{in_full(self.earned)} / {in_full(self.out_of)}"
                yield f"On the scale of {scale}: {share} × {scale} = {in_full(self.scaled)}."
            decimals = plural(marks.decimals, "{count} decimal", "{count} decimals")
            final = f"{self.final_text} of {in_full(exact(self.final_out_of))}"
            yield f"Final grade: {final}, rounded to {decimals} (half up)."


def final_grade(
    marks: Iterable[MarkRecord | Mark],
    course: Course,
    student: StudentRecord,
    received: Mapping[str, Arrival],
    run: RunRecord | None = None,
) -> FinalGrade:
    """Compute a student's final grade by the settings of a course.

    Parameters
    ----------
    marks : all of the student's, also those by persons
    course : with its settings and its catalogue
    student : as the roster has them
    received : file name of a notebook → when it was handed in
    run : the run that counts, for the predictions in it; without one there are none
    """
    settings, asked = course.settings, course.catalogue.marked
    worth = [(mark, asked[mark.question].notebook if mark.question in asked else "") for mark in marks if mark.out_of]
    due = {name: timing(settings, student, name, received.get(f"{name}.ipynb")) for _mark, name in worth if name}
    timings = {name: entry for name, entry in due.items() if entry is not None}
    items = tuple(_item(mark, notebook, timings.get(notebook), settings) for mark, notebook in worth)
    there = {item.notebook for item in items if not item.dropped_as and item.points != 0}
    shown = tuple(
        entry
        for name, entry in timings.items()
        if name in there and (entry.days or entry.extended or entry.received is None)
    )
    made = _predictions_made(run, course) if settings.marks.predictions else 0
    return FinalGrade(items, shown, made, settings.marks, settings.late)


def _item(mark: MarkRecord | Mark, notebook: str, due: Timing | None, settings: CourseSettings) -> Item:
    """Return a mark as it counts. While an unknown time of receipt may cost points, it is not decided."""
    marks, where = settings.marks, (mark.question, mark.part)
    undecided = mark.status in UNDECIDED or (due is not None and due.waits and settings.late.per_day)
    return Item(
        *where,
        notebook,
        None if undecided else exact(mark.points),
        exact(mark.out_of),
        marks.dropped_as(*where),
        marks.weighted_as(*where),
        exact(marks.weight(*where)),
        Fraction(0) if due is None else due.taken,
    )


def _predictions_made(run: RunRecord | None, course: Course) -> int:
    """Count a run's predictions for questions that count; each is read as strictly as an answer."""
    try:
        made = answers.parse(b"" if run is None else run.answers or b"").get(reflection.SECTION, {})
    except AnswerError:
        return 0
    asked = ((number, what) for number, what in course.catalogue.predictions.items())
    return sum(
        len([*reflection.read(what, made.get(number, {}))])
        for number, what in asked
        if number not in course.settings.marks.drop
    )


# --- texts ------------------------------------------------------------------------------------------------------------


def _grouped(items: Iterable[Item], attribute: str) -> dict[str, list[Item]]:
    """Group items by a name that the settings have for them; leave out items without one."""
    groups: dict[str, list[Item]] = {}
    for item in items:
        if name := getattr(item, attribute):
            groups.setdefault(name, []).append(item)
    return groups


def _lateness(entry: Timing) -> str:
    if entry.received is None:
        return f"not known when it came, {'to be decided' if entry.waits else 'taken as in time'}"
    if not entry.days:
        return "in time by an extension"
    return f"{_days(entry.days)} late, {in_full(entry.taken * 100)} % taken"


def _points(items: Iterable[Item]) -> str:
    """Write the points of items without weights, as "2 of 3 points"."""
    items = list(items)
    return _of(sum(item.points or 0 for item in items), sum(item.out_of for item in items))


def _so_far(items: Iterable[Item]) -> str:
    return " so far" if any(item.points is None for item in items) else ""


def _of(points: Fraction | int, out_of: Fraction | int) -> str:
    return f"{in_full(Fraction(points))} of {in_full(Fraction(out_of))} points"


def _worth(points: Fraction | int) -> str:
    return "1 point" if points == 1 else f"{in_full(Fraction(points))} points"


def _days(number: int) -> str:
    return plural(number, "{count} day", "{count} days")


def _when(moment: datetime, zone_of: datetime) -> str:
    """Write a time to the minute, in the time zone of another."""
    return f"{moment.astimezone(zone_of.tzinfo):%Y-%m-%d %H:%M %Z}"
