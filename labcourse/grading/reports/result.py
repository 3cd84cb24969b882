"""What came out for a student, as reports show it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from labcourse.grading.accounts import Account, account_of
from labcourse.grading.course import Course
from labcourse.grading.gradebook import Arrival, CommentRecord, GivenMark, Gradebook, Graded, Request, StudentRecord
from labcourse.grading.graded_run import facts_of
from labcourse.grading.marking.marking import Mark
from labcourse.grading.verdicts import UNDECIDED, Status
from labcourse.student_id import caseless


def points(number: float) -> str:
    """Points for people: "2", "1.5"."""
    return f"{round(number, 2):g}"


def worth(number: float) -> str:
    """Points with the word: "1 point", "1.5 points"."""
    shown = points(number)
    return "1 point" if shown == "1" else f"{shown} points"


@dataclass(frozen=True)
class Result:
    """What came out for a student.

    Attributes
    ----------
    student : ID
    marks : for every part of every question in the key
    problems : what went wrong with the submission
    notes : what else is worth knowing
    stamp : how it was run
    name, email, section : from the roster; empty where it does not say
    comments : by persons, in order
    lapsed : marks by persons that do not hold any more
    requests : what the student asked to have looked at again, in order
    account : what the marks come to by the course's settings; None where these were not asked
    """

    student: str
    marks: tuple[Mark, ...]
    problems: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    stamp: str = ""
    name: str = ""
    email: str = ""
    section: str = ""
    comments: tuple[CommentRecord, ...] = ()
    lapsed: tuple[GivenMark, ...] = ()
    requests: tuple[Request, ...] = ()
    account: Account | None = None

    @property
    def total(self) -> float:
        """Points earned so far."""
        return sum(mark.points for mark in self.marks)

    @property
    def out_of(self) -> float:
        """Points that there are."""
        return sum(mark.out_of for mark in self.marks)

    @property
    def awaiting(self) -> float:
        """Points that a person has yet to give or not."""
        return sum(mark.awaiting for mark in self.marks)

    @property
    def not_marked(self) -> float:
        """Points that could not be marked, through a fault of the key."""
        return sum(mark.out_of for mark in self.marks if mark.status is Status.NOT_MARKED)

    @property
    def not_graded(self) -> bool:
        """Whether nothing could be marked, through no fault of the student's: then there are no points, and not 0."""
        worth_points = [mark for mark in self.marks if mark.out_of]
        return bool(worth_points) and all(mark.status is Status.NOT_MARKED for mark in worth_points)

    def undecided(self) -> list[Mark]:
        """What is worth points that nobody has given or refused yet."""
        return [mark for mark in self.marks if mark.out_of and mark.status in UNDECIDED]

    def by_question(self) -> dict[str, tuple[float | None, float]]:
        """Points earned and possible, for each question that has any; earned is None where nothing is decided yet."""
        found: dict[str, tuple[float | None, float]] = {}
        for mark in self.marks:
            if not mark.out_of:
                continue
            earned, possible = found.get(mark.question, (None, 0.0))
            if mark.status not in UNDECIDED:
                earned = (earned or 0.0) + mark.points
            found[mark.question] = (earned, possible + mark.out_of)
        return found


def result_of(
    graded: Graded,
    about: StudentRecord | None = None,
    comments: Sequence[CommentRecord] = (),
    requests: Sequence[Request] = (),
) -> Result:
    """What the gradebook holds of a student, as a result.

    Parameters
    ----------
    graded : the run that counts, and its marks
    about : what the roster says of the student
    comments : by persons
    requests : of the student
    """
    run = graded.run
    about = about or StudentRecord(run.student)
    marks = tuple(
        Mark(one.question, one.part, Status(one.status), one.points, one.out_of, one.reason, one.given)
        for one in graded.marks
    )
    return Result(
        about.student,
        marks,
        run.problems,
        run.notes,
        run.isolation,
        about.name,
        about.email,
        about.section,
        tuple(comments),
        graded.lapsed,
        tuple(requests),
    )


def asked(request: Request) -> str:
    """What there is to say of a request of the student's."""
    if request.answered is None:
        return f"Asked on {request.made:%Y-%m-%d} to be looked at again; not answered yet."
    return (
        f"Asked on {request.made:%Y-%m-%d} to be looked at again; answered on {request.answered:%Y-%m-%d} by "
        f"{request.answered_by}."
    )


def result_in(book: Gradebook, course: Course, graded: Graded, about: StudentRecord | None = None) -> Result:
    """All that a gradebook holds of a student, as a result with its account.

    Parameters
    ----------
    book : that it comes from
    course : with its settings
    graded : the run that counts, and its marks
    about : what the roster says of the student
    """
    student = graded.run.student
    requests = [one for one in book.requests.all() if caseless(one.student) == caseless(student)]
    found = result_of(graded, about, book.comments(student), requests)
    came = received(book, student, graded) if course.settings.deadlines else {}
    account = account_of(found.marks, course, about or StudentRecord(student), came, graded.run)
    return replace(found, account=account)


def received(book: Gradebook, student: str, graded: Graded | None) -> dict[str, Arrival]:
    """When each notebook of a student came. What is theirs by a partner's word alone is kept as the partner's.

    Parameters
    ----------
    book : that knows it
    student : whose
    graded : their run that counts, which says whose partner they are; None without
    """
    partner = "" if graded is None else facts_of(graded.run).bench_of
    theirs = book.received(partner) if partner and caseless(partner) != caseless(student) else {}
    return {**theirs, **book.received(student)}


def lapse(given: GivenMark) -> str:
    """What there is to say of a person's mark that does not hold any more."""
    mark = given.mark
    return (
        f"{mark.question}, {mark.part}: {given.actor} gave {mark.points:g} of {mark.out_of:g} points on "
        f"{given.when:%Y-%m-%d} for another answer than there is now, or when there were other points for it. "
        "They do not count; a person has to look again."
    )
