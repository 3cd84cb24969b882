"""What came out for a student, as reports show it."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from functools import cached_property

from labcourse.grading.accounts import Account, AssignmentGrade, account_of, points
from labcourse.grading.assignments import Handed
from labcourse.grading.counting import received
from labcourse.grading.course import Course
from labcourse.grading.gradebook import CommentRecord, GivenMark, Gradebook, Graded, RunRecord, StudentRecord
from labcourse.grading.gradebook.records import AuditRecord, Excuse, Take
from labcourse.grading.graded_run import key_faults
from labcourse.grading.marks import UNDECIDED, Mark, Status
from labcourse.grading.reports.changes import ChangedMark, state_text
from labcourse.messages import number_of, shortened
from labcourse.patterns import pattern
from labcourse.problems import NOT_COUNTED, Problem
from labcourse.student_id import caseless

#: No digit of a name, as in K_2 or q3, and no full stop that ends a sentence.
_NUMBER = pattern(r"(?<![\w.])[-+\u2212]?\d+(?:[.,]\d+)*(?:[eE][-+]?\d+)?(?:[·×]10[⁻⁺⁰¹²³⁴⁵⁶⁷⁸⁹]+)?j?(?!\w)")


_AWAITING = (Status.FOR_A_PERSON, Status.UNCONFIRMED)


@dataclass(frozen=True)
class Sums:
    """Points of several marks.

    Attributes
    ----------
    earned : so far; None if nothing is decided yet
    out_of : possible
    awaiting : that a person has yet to give or refuse, or to confirm
    not_marked : that could not be marked, through a fault of the key
    """

    earned: float | None
    out_of: float
    awaiting: float
    not_marked: float

    @property
    def is_not_graded(self) -> bool:
        """Whether nothing that is worth points could be marked."""
        return bool(self.out_of) and self.not_marked == self.out_of


def sums(marks: Iterable[Mark]) -> Sums:
    """Add up the points of marks. What is not decided yet is not earned as 0."""
    marks = list(marks)
    decided = [mark.points for mark in marks if mark.out_of and mark.status not in UNDECIDED]
    return Sums(
        sum(decided) if decided else None,
        sum(mark.out_of for mark in marks),
        sum((mark.out_of for mark in marks if mark.status in _AWAITING), 0.0),
        sum(mark.out_of for mark in marks if mark.status == Status.NOT_MARKED),
    )


@dataclass(frozen=True)
class Result:
    """What came out for a student.

    Attributes
    ----------
    graded : the run that counts, and its marks
    about : what the roster says of the student
    account : what the marks come to by the course's settings
    comments : by persons, and the student's requests to look again, in order
    changes : marks that moved since they were first given back; only in a student's copy
    """

    graded: Graded
    about: StudentRecord
    account: Account
    comments: Sequence[CommentRecord] = ()
    changes: Sequence[ChangedMark] = ()

    @property
    def run(self) -> RunRecord:
        """The run that counts."""
        return self.graded.run

    @property
    def marks(self) -> tuple[Mark, ...]:
        """The marks that count; in a student's copy, only those that were given back."""
        return self.graded.marks

    @property
    def requests(self) -> list[CommentRecord]:
        """What the student asked to have looked at again."""
        return [comment for comment in self.comments if comment.asks]

    @cached_property
    def counted(self) -> list[Mark]:
        """The marks that are worth points, in what counts so far; also those that the settings drop."""
        counted = {(item.question, item.part) for item in self.account.items}
        return [mark for mark in self.marks if mark.where in counted]

    @cached_property
    def sums(self) -> Sums:
        """Points of the marks in :attr:`counted`."""
        return sums(self.counted)

    @property
    def not_graded(self) -> bool:
        """Whether nothing could be marked, through no fault of the student's: then there are no points, and not 0."""
        return sums(self.marks).is_not_graded

    def undecided(self) -> list[Mark]:
        """Return the marks in :attr:`counted` of which nobody has given or refused the points yet."""
        return [mark for mark in self.counted if mark.out_of and mark.status in UNDECIDED]

    def given_back(self, course: Course, notebooks: Collection[str] | None) -> Result:
        """Return the student's copy, without what was not given back.

        Of other notebooks, and of questions that the course does not ask any more, leave out marks, marks that lapsed,
        comments by persons, and problems of the key. Requests and comments on the whole work stay.

        Parameters
        ----------
        course : with its questions
        notebooks : that were given back, without ending; None for all
        """
        if notebooks is None:
            return self

        def is_shown(about: Mark | CommentRecord) -> bool:
            return course.notebook_of(about.question) in notebooks

        return replace(
            self,
            graded=with_marks(self.graded, is_shown),
            comments=[one for one in self.comments if one.asks or one.question is None or is_shown(one)],
            account=self.account.given_back(notebooks),
        )


def with_marks(graded: Graded, is_shown: Callable[[Mark], bool]) -> Graded:
    """Return a run with some of its marks, also of those that lapsed, and without problems of the key in the others."""
    faults = key_faults(replace(graded, marks=tuple(mark for mark in graded.marks if not is_shown(mark)))).values()
    problems = tuple(problem for problem in graded.run.problems if problem not in faults)
    marks = tuple(mark for mark in graded.marks if is_shown(mark))
    lapsed = tuple(given for given in graded.lapsed if is_shown(given.mark))
    return replace(graded, run=replace(graded.run, problems=problems), marks=marks, lapsed=lapsed)


def not_counted(run: RunRecord) -> list[Problem]:
    """Return what the student made and does not count, each kind of it together."""
    found = [one for one in (*run.problems, *run.notes) if isinstance(one, Problem) and one.code in NOT_COUNTED]
    return sorted(dict.fromkeys(found), key=lambda one: NOT_COUNTED.index(one.code))


def result_in(book: Gradebook, course: Course, graded: Graded, about: StudentRecord) -> Result:
    """Read all that a gradebook has of a student, with the account of their marks.

    Parameters
    ----------
    book : the gradebook
    course : with its settings
    graded : the run that counts, and its marks
    about : what the roster says of the student
    """
    return Result(graded, about, account_in(book, course, graded, about), book.comments(about.student))


def account_in(book: Gradebook, course: Course, graded: Graded | None, about: StudentRecord) -> Account:
    """Return the account of a student.

    Whoever handed in nothing has 0 points for what is due. In a course without any date nobody can say what is due, and
    so they have no points. Whoever handed in something that is not graded yet has no points either.
    """
    arrivals, excuses = received(book, about.student, graded), book.excuses(about.student)
    absent = nothing_given(course) if course.settings.dues and not arrivals else ()
    marks = absent if graded is None else graded.marks
    return account_of(course, Handed(about, marks, arrivals, graded, excuses))


def nothing_given(course: Course) -> tuple[Mark, ...]:
    """Return the marks of somebody who gave no answer: one of 0 points for each part that the class is asked."""
    parts = [(question.number, part) for question in course.asked_catalogue.marked.values() for part in question.parts]
    return tuple(Mark(number, part.name, Status.MISSING, 0.0, part.points, "") for number, part in parts)


def state_of(grade: AssignmentGrade) -> str:
    """Describe the state of an assignment, as "marked, 2 days late"."""
    if grade.is_excused:
        return "excused"
    late = f", {number_of(grade.days_late, 'day')} late" if grade.days_late else ""
    return f"{grade.state}{late}"


def request_text(request: CommentRecord) -> str:
    """Describe a request of the student's."""
    state = "not answered yet" if request.is_open else "answered"
    return f"Asked on {request.when:%Y-%m-%d} to be looked at again; {state}."


def moment(when: datetime) -> str:
    """Write a time as "2026-03-02 12:00 UTC"."""
    return f"{when:%Y-%m-%d %H:%M} UTC"


def history(book: Gradebook, course: Course, student: str | None, question: str | None) -> dict[str, list[str]]:
    """Return heading → lines on how marks came about, each in order of time; what persons decided comes first.

    Points that a person gave are there also where the program took them back, as the answer changed. Leave out what the
    program changed without moving a point.

    Parameters
    ----------
    book, course : the class
    student, question : only what is about these; all if they are None
    """
    notebook, late = question and course.notebook_of(question), list[str]()
    changes = {True: list[AuditRecord](), False: list[AuditRecord]()}
    for change in book.audit(student, question):
        changes[Status.BY_A_PERSON in (one.status for one in (change.before, change.after) if one)].append(change)
    acts = (act for act in book.decisions(student) if notebook in (None, act.notebook))
    for about in book.students():
        if student is None or caseless(student) == caseless(about.student):
            account = account_in(book, course, book.current(about.student), about)
            timings = (work.timing for one in account.assignments for work in one.works)
            own = (one for one in timings if one is not None and notebook in (None, one.notebook) and one.is_special)
            late += (f"{about.student}  {account.timing_text(timing)}" for timing in own)
    return {
        "Decided by persons:": [*map(_entry, sorted([*changes[True], *acts], key=lambda one: one.when))],
        "Late, extended, or at a time that a person decides:": late,
        "Given by the program:": [*map(_entry, filter(_moves_points, changes[False]))],
    }


def _moves_points(change: AuditRecord) -> bool:
    """Return whether a change is one of points, or of whether they are decided."""
    is_nothing = change.before is None and change.after is not None and change.after.status == Status.MISSING
    return not is_nothing and state_text(change.before) != state_text(change.after)


def _entry(done: AuditRecord | Excuse | Take) -> str:
    """Describe what was changed or decided: when, for whom, what, by whom, and why."""
    if isinstance(done, AuditRecord):
        states = ("–" if one is None else f"{points(one.points)} ({one.status})" for one in (done.before, done.after))
        what = f"{done.question} {done.part}: {' → '.join(states)}"
    elif isinstance(done, Excuse):
        what = f"{done.notebook}: {'excused' if done.excused else 'not excused any more'}"
    else:
        version = "the rule decides again" if done.received is None else f"version of {moment(done.received)} taken"
        what = f"{done.notebook}: {version}"
    return f"{moment(done.when)}  {done.student}  {what}  {done.actor}: {done.reason}"


def lapse(given: GivenMark) -> str:
    """Describe a person's mark that does not hold any more."""
    mark = given.mark
    return (
        f"{mark.question}, {mark.part}: {given.actor} gave {points(mark.points)} of {points(mark.out_of)} points on "
        f"{given.when:%Y-%m-%d} for another answer than there is now, or when there were other points for it. "
        "They do not count; a person has to look again."
    )


def without_numbers(reason: str) -> str:
    """Return a reason as it is the same for everybody with the same slip: each number in it as "…"."""
    return shortened(_NUMBER.sub("…", reason))
