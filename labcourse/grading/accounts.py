"""Compute final grades: weights, what is left out, lateness and rounding, and explain each step.

Points are fractions as they are written, so 0.1 is a tenth. Only the final grade is rounded, once.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass, replace
from datetime import datetime
from decimal import Decimal, localcontext
from fractions import Fraction
from functools import cached_property
from typing import Any

from labcourse.answers import reflection
from labcourse.grading.assignments import Handed, State, Timing, Work, exact, least, of_course, works
from labcourse.grading.course import Course
from labcourse.grading.gradebook import MarkRecord, RunRecord, StudentRecord
from labcourse.grading.graded_run import answers_of
from labcourse.grading.marking.marking import Mark
from labcourse.grading.settings import Assignment, CourseSettings, Deadline, Extension, LateSettings, MarkSettings
from labcourse.grading.verdicts import UNDECIDED
from labcourse.messages import plural
from labcourse.student_id import caseless

_DIGITS = 100  # of an exact decimal number; points, weights and per cents have at most a dozen each
_SHOWN = 6  # decimals of a number that has no exact decimal form, such as 1/3


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


# --- names in the settings --------------------------------------------------------------------------------------------


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
class AssignmentGrade:
    """A student's points of an assignment.

    Attributes
    ----------
    assignment : which; with title "" for marks that are in no assignment
    works : its notebooks, as they are now
    all_items : each mark in it that is worth points, also those that do not count
    bonus : points for predictions
    decimals : of its points in a column, which are rounded half up
    is_given_back : whether the reader may see its marks
    """

    assignment: Assignment
    works: tuple[Work, ...]
    all_items: tuple[Item, ...]
    bonus: Fraction
    decimals: int
    is_given_back: bool = True

    @property
    def title(self) -> str:
        """Title of the assignment."""
        return self.assignment.title

    @cached_property
    def state(self) -> State:
        """The least advanced state of its notebooks; if some are not excused, of these."""
        counting = [work for work in self.works if work.excuse is None] or self.works
        return least([work.state for work in counting] or [State.MARKED])

    @property
    def is_excused(self) -> bool:
        """Whether the student is excused from all of it."""
        return bool(self.works) and all(work.excuse for work in self.works)

    @property
    def is_due(self) -> bool:
        """Whether all of it is due."""
        return all(work.is_due for work in self.works)

    @cached_property
    def counts(self) -> bool:
        """Whether it counts so far: it is due and given back, and the student is not excused."""
        return self.is_due and self.is_given_back and not self.is_excused

    @property
    def is_empty(self) -> bool:
        """Whether it has no points yet, which is not the same as none: it is not due, graded or given back."""
        open_yet = self.state is State.UNTOUCHED and not self.is_due
        return open_yet or not self.is_given_back or self.state in (State.NOT_DUE, State.HANDED_IN)

    @property
    def until(self) -> datetime | None:
        """When the last of it is due; None without any date."""
        return max((work.until for work in self.works if work.until is not None), default=None)

    @property
    def days_late(self) -> int:
        """Days by which the latest of its notebooks came late."""
        return max((work.days_late for work in self.works), default=0)

    @property
    def items(self) -> list[Item]:
        """The marks from which the student is not excused."""
        excused = {work.notebook for work in self.works if work.excuse is not None}
        return [item for item in self.all_items if item.notebook not in excused]

    @cached_property
    def counting(self) -> list[Item]:
        """The marks that count."""
        return [item for item in self.items if not item.dropped_as]

    @property
    def undecided(self) -> list[Item]:
        """The marks that count and are not decided."""
        return [item for item in self.counting if item.points is None]

    @cached_property
    def earned(self) -> Fraction:
        """Points of its notebooks with weights and lateness, as far as they are decided."""
        return sum((item.weighted * (1 - item.taken) for item in self.counting), self.bonus)

    @cached_property
    def possible(self) -> Fraction:
        """What these points are out of, undecided ones included."""
        return sum((item.possible for item in self.counting), Fraction(0))

    @cached_property
    def out_of(self) -> Fraction:
        """What its column is out of; that does not depend on whether the student is excused from all of it."""
        if self.assignment.out_of is not None:
            return exact(self.assignment.out_of)
        items = self.all_items if self.is_excused else self.items
        return sum((item.possible for item in items if not item.dropped_as), Fraction(0))

    @property
    def points(self) -> Fraction:
        """Points in its column, not rounded, as far as they are decided."""
        return self.earned * ratio(self.out_of, self.possible)

    @property
    def points_text(self) -> str:
        """Points in its column, rounded, as "9.50"; "" while they are not decided, and if the student is excused."""
        unknown = self.is_empty or self.undecided or self.state is State.NOT_GRADED
        if unknown or self.is_excused or not self.possible:
            return ""
        return f"{float(half_up(self.points, self.decimals)):.{self.decimals}f}"

    @property
    def weight(self) -> Fraction:
        """Its share of the final grade; 0 if the student is excused."""
        weight = self.assignment.weight
        return Fraction(0) if self.is_excused else self.out_of if weight is None else exact(weight)

    @property
    def weighted(self) -> Fraction:
        """What it adds to the final grade."""
        return self.earned * ratio(self.weight, self.possible)

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
            "weight": float(self.weight),
        }


def ratio(part: Fraction, whole: Fraction) -> Fraction:
    """Divide; what is out of nothing keeps its points, as those for predictions, if nothing replaces their scale."""
    return part / whole if whole else Fraction(part == whole)


@dataclass(frozen=True)
class FinalGrade:
    """A student's grade so far, which is final when everything is due, and how it is computed.

    Attributes
    ----------
    assignments : all of the class, in order, and marks that are in none of them last
    predictions : how many predictions were made in what is due; each may earn additional points
    marks, late : the settings
    """

    assignments: tuple[AssignmentGrade, ...]
    predictions: int
    marks: MarkSettings
    late: LateSettings

    @cached_property
    def so_far(self) -> list[AssignmentGrade]:
        """The assignments that count so far."""
        return [one for one in self.assignments if one.counts]

    @property
    def is_over(self) -> bool:
        """Whether everything counts from which the student is not excused."""
        return all(one.counts or one.is_excused for one in self.assignments)

    def given_back(self, notebooks: Collection[str] | None) -> FinalGrade:
        """Return it as the student may see it, when the marks of some notebooks were given back (None: of all)."""
        if notebooks is None:
            return self
        back = [replace(one, is_given_back={*one.assignment.notebooks} <= {*notebooks}) for one in self.assignments]
        return replace(self, assignments=tuple(back))

    @cached_property
    def items(self) -> list[Item]:
        """Each mark of :attr:`so_far` that is worth points, also those that do not count."""
        return [item for one in self.so_far for item in one.items]

    @cached_property
    def counting(self) -> list[Item]:
        """The marks that count so far."""
        return [item for one in self.so_far for item in one.counting]

    @cached_property
    def undecided(self) -> list[Item]:
        """The marks that count so far and are not decided."""
        return [item for one in self.so_far for item in one.undecided]

    @property
    def timings(self) -> list[Timing]:
        """Notebooks that earned something and came late, in time only by an extension, or at an unknown time."""
        there = {item.notebook for item in self.counting if item.points != 0}
        read = [work for one in self.so_far for work in one.works if not work.is_unread]
        times = [work.timing for work in read if work.notebook in there]
        return [time for time in times if time and (time.days or time.extended or time.received is None)]

    @cached_property
    def earned(self) -> Fraction:
        """Points as they count so far, as far as they are decided."""
        return sum((one.weighted for one in self.so_far), Fraction(0))

    @property
    def so_far_text(self) -> str:
        """These points with all decimals of the final grade, as "7.30"."""
        return f"{float(half_up(self.earned, self.marks.decimals)):.{self.marks.decimals}f}"

    @cached_property
    def out_of(self) -> Fraction:
        """What these points are out of, undecided ones included."""
        return sum((one.weight for one in self.so_far), Fraction(0))

    @property
    def scaled(self) -> Fraction:
        """Earned points on the scale of the final grade, not rounded. ``out_of`` must not be 0."""
        return self.earned if self.marks.out_of is None else self.earned / self.out_of * exact(self.marks.out_of)

    @property
    def final(self) -> float | None:
        """The final grade; None until all is due, while a mark that counts is not decided, and if nothing counts."""
        if self.undecided or not self.out_of or not self.is_over:
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
        scaled = any(one.weight != one.possible or one.is_excused for one in self.assignments) or not self.is_over
        return not special and not scaled and (marks.out_of, marks.decimals) == (usual.out_of, usual.decimals)

    def as_data(self) -> dict[str, Any]:
        """Return it for JSON."""
        return {
            "earned": float(self.earned),
            "out_of": float(self.out_of),
            "final": self.final,
            "final_out_of": self.final_out_of,
            "assignments": [one.as_data() for one in self.assignments if one.title],
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
        lines += [f"excused: {one.title}" for one in self.assignments if one.is_excused]
        lines += [f"not counted so far: {self.later}"] if self.later else []
        return lines + ([f"{self.predictions} predictions made"] if self.marks.predictions else [])

    def steps(self) -> list[str]:
        """Explain the final grade step by step, so that it can be computed again by hand."""
        return [*self._steps(), *self._last_steps()]

    @property
    def later(self) -> str:
        """The titles of what does not count yet."""
        return ", ".join(one.title for one in self.assignments if not one.counts and not one.is_excused)

    def _steps(self) -> Iterator[str]:
        counting, each = self.counting, exact(self.marks.predictions)
        for one in self.assignments:
            for act in (work.excuse for work in one.works if work.excuse is not None):
                yield f"{act.notebook} does not count: {act.actor} excused you on {act.when:%Y-%m-%d} ({act.reason})."
        if self.later:
            yield f"Not counted so far, as it is not due or not given back: {self.later}."
        if self.items:
            work = "" if self.is_over else " in the work that counts so far"
            yield f"All answers{work}: {_points(self.items)}."
        if dropped := _grouped(self.items, "dropped_as"):
            names = ", ".join(f"{name} ({_points(items)}{_so_far(items)})" for name, items in dropped.items())
            yield f"Not counted: {names}. Left: {_points(counting)}."
        for name, items in _grouped(counting, "weighted_as").items():
            after = _of(sum(item.weighted for item in items), sum(item.possible for item in items))
            yield f"{name} counts {in_full(items[0].weight)} times: {_points(items)} become {after}."
        yield from map(self._timing_step, self.timings)
        if each:
            more = in_full(self.predictions * each)
            yield f"{self.predictions} predictions made, {_worth(each)} each: {more} points more."
        for one in self.so_far:
            if one.out_of != one.possible:
                yield f"{one.title}: {_of(one.earned, one.possible)} become {_of(one.points, one.out_of)}."
            if one.weight != one.out_of:
                yield f"{one.title}: {_of(one.points, one.out_of)} count as {_of(one.weighted, one.weight)}."
        if not self.is_plain and self.is_over and not self.undecided:
            yield f"Together: {_of(self.earned, self.out_of)}."

    def _timing_step(self, entry: Timing) -> str:
        due, until = _when(entry.due, entry.until), _when(entry.until, entry.until)
        if entry.received is None:
            rest = "Nobody knows when it was handed in. It counts as in time."
            if entry.waits:
                rest = "Only the computer on which it was written says when it was saved. "
                rest += "Your instructor decides when it was handed in."
            return f"{entry.notebook} was due on {until}. {rest}"
        start = f"{entry.notebook} was handed in on {_when(entry.received, entry.until)}"
        start += f" ({entry.clock})" if entry.clock else ""
        if not entry.days:
            return f"{start}. It was due on {due}. You have an extension until {until}, so it is in time."
        late = self.late
        extended = " by an extension" if entry.extended else ""
        grace = f" with {in_full(exact(late.grace_hours))} h of grace" if late.grace_hours else ""
        what = f"{start}, due on {until}{extended}{grace}: {_days(entry.days)} late (a day that has begun counts)."
        if not entry.taken:
            return f"{what} That costs nothing."
        capped = entry.days * exact(late.per_day) > exact(late.cap)
        most = f", and {in_full(exact(late.cap))} % at most" if capped else ""
        points = sum(item.weighted for item in self.counting if item.notebook == entry.notebook)
        cost = f"{in_full(entry.taken * 100)} % of its {_worth(points)}, which is {in_full(points * entry.taken)}."
        return f"{what} {in_full(exact(late.per_day))} % a day{most}: it loses {cost}"

    def _last_steps(self) -> Iterator[str]:
        marks = self.marks
        if self.undecided or not self.is_over:
            waiting = _worth(sum(item.possible for item in self.undecided))
            open_yet = f" Answers worth {waiting} are not decided yet." if self.undecided else ""
            so_far = f"So far: {_of(self.earned, self.out_of)}.{open_yet}" if self.out_of else "Nothing counts so far."
            known = "due" if all(one.is_given_back for one in self.assignments) else "due, given back"
            yield f"{so_far} The final grade comes when everything is {known} and decided."
        elif self.final is None:
            yield "Nothing counts, so there is no final grade."
        else:
            if marks.out_of is not None:
                scale = in_full(exact(marks.out_of))
                share = f"{in_full(self.earned)} / {in_full(self.out_of)}"
                yield f"On the scale of {scale}: {share} × {scale} = {in_full(self.scaled)}."
            decimals = plural(marks.decimals, "{count} decimal", "{count} decimals")
            final = f"{self.final_text} of {in_full(exact(self.final_out_of))}"
            yield f"Final grade: {final}, rounded to {decimals} (half up)."


def final_grade(course: Course, handed: Handed, when: datetime | None = None) -> FinalGrade:
    """Compute a student's grade by the settings of a course.

    Parameters
    ----------
    course : with its settings and its catalogue
    handed : what there is of the student: all marks, also those by persons
    when : the time by which work is due or not; now, if it is None
    """
    settings, work = course.settings, works(course, handed, when)
    items = defaultdict[str, list[Item]](list)
    for mark in handed.marks:
        if mark.out_of:
            name = course.notebook_of(mark.question)
            items[name].append(_item(mark, name, work.get(name), settings))
    run = None if handed.graded is None else handed.graded.run
    made = _predictions_made(run, course) if settings.marks.predictions else {}
    rest = Assignment("", tuple({*items, *made} - {*work}))
    grades = []
    for one in [*of_course(course), rest]:
        bonus = sum(made.get(name, 0) for name in one.notebooks) * exact(settings.marks.predictions)
        there = tuple(work[name] for name in one.notebooks if name in work)
        own = tuple(item for name in one.notebooks for item in items[name])
        grades.append(AssignmentGrade(one, there, own, bonus, settings.marks.decimals))
    grade = FinalGrade(tuple(grades), 0, settings.marks, settings.late)
    due = [name for one in grade.so_far for name in one.assignment.notebooks]
    return replace(grade, predictions=sum(made.get(name, 0) for name in due))


def _item(mark: MarkRecord | Mark, notebook: str, work: Work | None, settings: CourseSettings) -> Item:
    """Return a mark as it counts. It is not decided if the file cannot be read, or while its time may cost points."""
    marks, where, due = settings.marks, (mark.question, mark.part), None if work is None else work.timing
    unread = work is not None and work.is_unread
    undecided = mark.status in UNDECIDED or unread or (due is not None and due.waits and settings.late.per_day)
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


def _predictions_made(run: RunRecord | None, course: Course) -> dict[str, int]:
    """Count a run's predictions by notebook, if they earn points and their questions count.

    Each is read as strictly as an answer.
    """
    if run is None or not course.settings.marks.predictions:
        return {}
    made = answers_of(run).get(reflection.SECTION, {})
    counts = Counter[str]()
    for number, what in course.catalogue.predictions.items():
        if number not in course.settings.marks.drop:
            counts[course.catalogue.everything[number].notebook] += len([*reflection.read(what, made.get(number, {}))])
    return counts


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
