"""What a person must do something about today: for whom, how many points it is worth, and the command that does it.

Nothing here is cut, so that whoever reads only this learns of all that cost points through no fault of the student.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from itertools import chain
from shlex import quote
from typing import NamedTuple

from labcourse import program
from labcourse.answers.parts import Where
from labcourse.grading.accounts import Account, AssignmentGrade, account_of, ratio, unknown_names
from labcourse.grading.assignments import Handed, State, Work, exact, of_course
from labcourse.grading.course import Course
from labcourse.grading.gradebook import ON_DISK, Answer, Arrival, CommentRecord, Graded, Publication, StudentRecord
from labcourse.grading.graded_run import facts_of, is_failed, key_faults
from labcourse.grading.intake import OWNER, TIME, Doubt
from labcourse.grading.marking.marking_processes import marking_digest
from labcourse.grading.reports.changes import Change
from labcourse.grading.reports.result import nothing_given, shortened
from labcourse.grading.settings import Assignment
from labcourse.grading.verdicts import Status
from labcourse.messages import listed
from labcourse.problems import Code, Problem, codes
from labcourse.sentences import sentence
from labcourse.student_id import caseless

#: States of work that needs nothing more.
DONE = (State.MARKED, State.MISSING, State.UNTOUCHED)
#: States of work of which there is nothing, or nothing of the student's own.
NOTHING_THERE = (State.MISSING, State.NOT_DUE, State.UNTOUCHED)
_STUDENT = "STUDENT"  # in a command: the ID of the first student
_GRADE = "grade MARKS SUBMISSIONS"
_MARK = f'mark MARKS {_STUDENT} QUESTION PART POINTS --reason "..." --by NAME'
_SHOWN = 3  # names in a sentence
_ABOUT_FILES = (Code.OLDER_NOTEBOOK_COUNTS, Code.NOTEBOOK_UNREAD, Code.EMPTY_BESIDE_ANSWERED)


@dataclass(frozen=True)
class Student:
    """A student, as the gradebook knows them.

    Attributes
    ----------
    about : what the roster says
    account : their points and the states of their work
    graded : the run that counts, with the marks that count; None if nothing was graded
    received : file name of a notebook → when it was handed in, and how that is known
    """

    about: StudentRecord
    account: Account
    graded: Graded | None = None
    received: Mapping[str, Arrival] = field(default_factory=dict)

    @property
    def id(self) -> str:
        """The student's ID."""
        return self.about.student

    @property
    def name(self) -> str:
        """ID and name, as "ada (Ada Lovelace)"."""
        return f"{self.id} ({self.about.name})" if self.about.name else self.id

    @property
    def assignments(self) -> list[AssignmentGrade]:
        """Each assignment, with the states of its notebooks."""
        return [one for one in self.account.assignments if one.title]

    @cached_property
    def work(self) -> dict[str, Work]:
        """Notebook, without ending → the work from which the student is not excused."""
        return {work.notebook: work for one in self.assignments for work in one.works if work.excuse is None}

    @property
    def last(self) -> str:
        """When the last notebook was handed in: "?" by the student's computer alone, "(file)" by a file on the disk."""
        arrival = max(self.received.values(), default=None, key=lambda arrival: arrival.received)
        clock = {"": "?", ON_DISK: " (file)"}.get(arrival.clock or "-", "") if arrival is not None else ""
        return "" if arrival is None else f"{arrival.received:%Y-%m-%d %H:%M} UTC{clock}"

    @property
    def handed_in(self) -> bool:
        """Whether there is anything of their own."""
        return any(work.state not in NOTHING_THERE for one in self.assignments for work in one.works)


class Finding(NamedTuple):
    """Something to do for one student, or for nobody in particular; worth None if nobody knows how many points."""

    what: str
    command: str
    who: str = ""
    worth: Fraction | None = None


@dataclass(frozen=True)
class Task:
    """Something to do: what, the command, the IDs of the students, and the points at stake; None if nobody knows."""

    what: str
    command: str
    who: tuple[str, ...]
    worth: Fraction | None


@dataclass(frozen=True)
class Class:
    """A class as it is now, and what it asks for.

    ``requests`` are the students' open requests, and ``doubts`` the rows of ``intake.csv`` without a decision.
    """

    course: Course
    students: Sequence[Student]
    answers: Sequence[Answer] = ()
    requests: Sequence[CommentRecord] = ()
    publications: Sequence[Publication] = ()
    changes: Sequence[Change] = ()
    doubts: Sequence[Doubt] = ()

    @cached_property
    def assignments(self) -> list[Assignment]:
        """The assignments of the class."""
        return of_course(self.course)

    @cached_property
    def by_id(self) -> dict[str, Student]:
        """ID in small letters → student."""
        return {caseless(student.id): student for student in self.students}

    @cached_property
    def worths(self) -> dict[Where, Fraction]:
        """Question and part of what counts → its points in the column of its assignment."""
        nobody = account_of(self.course, Handed(StudentRecord(""), nothing_given(self.course)))
        return {
            (item.question, item.part): item.possible * ratio(one.out_of, one.possible)
            for one in nobody.assignments
            for item in one.counting
            if one.title
        }

    def of_notebook(self, name: str) -> Fraction:
        """Return the points of a notebook."""
        parts = (where for where in self.worths if self.course.notebook_of(where[0]) == name)
        return sum((self.worths[where] for where in parts), Fraction(0))

    def of_assignment(self, assignment: Assignment) -> Fraction:
        """Return what the column of an assignment is out of."""
        return sum(map(self.of_notebook, assignment.notebooks), Fraction(0))

    def assignment_of(self, question: str) -> Assignment | None:
        """Return the assignment of a question; None if it is in none."""
        return next((one for one in self.assignments if self.course.notebook_of(question) in one.notebooks), None)

    def at_stake(self, student: Student, wheres: Iterable[Where]) -> Fraction:
        """Add up the points of some answers of a student, without those from which the student is excused."""
        there = (one for one in wheres if one in self.worths and self.course.notebook_of(one[0]) in student.work)
        return sum((self.worths[one] for one in there), Fraction(0))

    def given_back(self, assignment: Assignment) -> Publication | None:
        """Return when an assignment was given back last; None if it was not."""
        names = {*assignment.notebooks}
        return next(
            (one for one in reversed(self.publications) if not one.notebooks or names <= {*one.notebooks}), None
        )


def todo(of: Class) -> list[Task]:
    """Return what to do in a class; what is worth most comes first, and what nobody knows the worth of behind it."""
    groups: dict[str, list[Finding]] = {}
    for finding in chain(_by_state(of), _by_run(of), _by_mark(of), _by_answer(of), _by_class(of)):
        groups.setdefault(finding.what, []).append(finding)
    tasks = []
    for what, those in groups.items():
        who = tuple(dict.fromkeys(finding.who for finding in those if finding.who))
        worths = [finding.worth for finding in those if finding.worth is not None]
        command = those[0].command.replace(_STUDENT, quote(who[0]) if who else _STUDENT)
        tasks.append(Task(what, f"{program.name()} {command}", who, sum(worths, Fraction(0)) if worths else None))
    return sorted(tasks, key=lambda task: (task.worth is None or not task.worth, task.worth == 0, -(task.worth or 0)))


# --- by the calendar --------------------------------------------------------------------------------------------------


def _by_state(of: Class) -> Iterator[Finding]:
    """Yield what is missing after its due date, is not graded yet, or came at a time that nobody knows."""
    for student in of.students:
        for grade in student.assignments:
            excuse = f'excuse MARKS {_STUDENT} {quote(grade.title)} --reason "..." --by NAME'
            for work in grade.works:
                finding = _of_work(grade, work, excuse, bool(of.course.settings.late.per_day))
                points = of.of_notebook(work.notebook)
                if finding is not None and work.excuse is None and points:
                    yield Finding(*finding, student.id, points)


def _of_work(grade: AssignmentGrade, work: Work, excuse: str, late_costs: bool) -> tuple[str, str] | None:
    """Return what to do about a piece of work, and the command; None for nothing."""
    is_overdue = work.is_due and work.until is not None  # without any date, nobody is behind
    match work.state:
        case State.MISSING if is_overdue:
            return f"missing: {grade.title}. Ask for it, excuse them, or give an extension in course.toml.", excuse
        case State.UNTOUCHED if is_overdue:
            what = f"untouched: {grade.title}. The file is as it was handed out. Ask for their work, or excuse them."
            return what, excuse
        case State.HANDED_IN:
            return "handed in: not graded yet.", _GRADE
        case State.WAITS if late_costs and work.timing is not None and work.timing.waits:
            what = f"waits for a person: nobody knows when {grade.title} was handed in. Decide in MARKS/intake.csv."
            return what, _GRADE
    return None


# --- by what a run says -----------------------------------------------------------------------------------------------


class Cause(NamedTuple):
    """Something that may cost points through no fault of the student.

    Attributes
    ----------
    codes : of the problems that say it
    what, command : to do; "{problem}" stands for the problem in words
    cost : codes of the reasons of the missing marks that it cost; all of them count where it is empty
    costs_all : whether it cost every missing mark
    """

    codes: tuple[Code, ...]
    what: str
    command: str
    cost: tuple[Code, ...] = ()
    costs_all: bool = False


_STOPPED = "the run was stopped"
_INTAKE = "Decide it in MARKS/intake.csv."
#: The first that fits a problem counts.
CAUSES = (
    Cause((Code.GRADING_FAILED,), "could not be graded: {problem}", _GRADE, costs_all=True),
    Cause((Code.UNKNOWN,), "could not be graded: {problem}", _GRADE),
    Cause((Code.EARLIER_MARKS_STAY,), "the last grading failed, and earlier marks stand. {problem}", _GRADE),
    Cause((Code.RUN_TIMED_OUT,), f"{_STOPPED}: it took too long.", f"{_GRADE} --deadline 1200", costs_all=True),
    Cause((Code.PYTHON_DIED,), f"{_STOPPED}: memory ran out, most likely.", f"{_GRADE} --memory 4096", costs_all=True),
    Cause((Code.PRINTED_TOO_MUCH,), f"{_STOPPED}: it printed too much. Look at its cells.", _GRADE, costs_all=True),
    Cause((Code.RUN_ENDED_EARLY,), f"{_STOPPED}. Nobody knows why.", f"{_GRADE} --cell-timeout 90", costs_all=True),
    Cause(
        (Code.ANSWERS_UNREAD, Code.RESULT_UNREAD),
        "the answers of the run cannot be read. Look at its cells.",
        _GRADE,
        costs_all=True,
    ),
    Cause(
        (Code.CELL_TIMED_OUT, Code.TOOK_TOO_LONG),
        "a cell took too long.",
        f"{_GRADE} --cell-timeout 120",
        (Code.TOOK_TOO_LONG,),
    ),
    Cause(
        (Code.MODULE_MISSING,),
        "a module is missing where grading runs. Install it.",
        f"{_GRADE} --cell-timeout 90",
        (Code.MODULE_MISSING,),
    ),
    Cause((Code.NEWER_PYTHON_NEEDED,), "a newer Python is needed. Grade with it.", _GRADE, (Code.NEWER_PYTHON_NEEDED,)),
    Cause(
        (Code.OWN_FILE_REFUSED, Code.MORE_OWN_FILES_REFUSED, Code.FILE_AND_FOLDER, Code.OUTSIDE_THE_FOLDER),
        "a cell needs a file that was left out.",
        _GRADE,
        (Code.FILE_NOT_FOUND,),
    ),
    Cause((Code.RECORDED_AT_HOME,), "answers were recorded at home and are missing.", _MARK, (Code.MISSING_HERE,)),
    Cause((Code.REPORT_UNREAD, Code.MAY_ASK_FOR_PASSWORD), "a report cannot be read, it seems. Look at it.", _GRADE),
    Cause((Code.OLDER_NOTEBOOK_COUNTS,), "an older file counts: {problem}", _GRADE),
    Cause(
        (Code.NOTEBOOK_UNREAD, Code.SUBMISSION_UNREAD, Code.NO_NOTEBOOK),
        "could not be graded: {problem} Ask for it again.",
        _GRADE,
    ),
    Cause(
        (Code.OTHER_STUDENT_NAMED, Code.PARTNERS_UNCONFIRMED), f"there is a doubt about who did it. {_INTAKE}", _GRADE
    ),
    Cause((Code.ANSWERS_OF_ANOTHER_BENCH,), f"the answers are of another bench. {_INTAKE}", _GRADE),
    Cause((Code.RELEASE_UNKNOWN,), "a release is unknown. Put its zip where the message says.", _GRADE),
    Cause((Code.DOUBTED_BY_COURSE,), "a recording does not count until you have looked at it.", _MARK),
    Cause((Code.EMPTY_BESIDE_ANSWERED,), "a newer file is empty, so that an older one counts. Look at both.", _GRADE),
    Cause(
        (
            *(Code.TEXT_TOO_LONG, Code.TEXT_BESIDE_NOT_READ, Code.CELL_TOO_LONG),
            *(Code.PICTURE_LEFT_OUT, Code.TOO_MANY_PICTURES, Code.PASTED_PICTURE_LEFT_OUT),
        ),
        "part of a text is not read. Look at it.",
        _MARK,
    ),
)


def causes(student: Student) -> dict[tuple[Cause, str], list[Problem]]:
    """Return the causes that the problems of a student's run name, each with what to do → the problems."""
    found: dict[tuple[Cause, str], list[Problem]] = {}
    if student.graded is not None:
        run = student.graded.run
        for problem in dict.fromkeys((*facts_of(run).ended, *run.problems, *run.notes)):
            known = codes(problem)
            cause = next((one for one in CAUSES if known & {*one.codes}), None)
            if cause is not None:
                what = cause.what.format(problem=shortened(sentence(problem).removeprefix("Not graded. ")))
                found.setdefault((cause, what), []).append(problem)
    return found


def cost(of: Class, student: Student, cause: Cause, problems: Sequence[Problem]) -> Fraction | None:
    """Return the points that a cause cost a student, by their marks, or by the files it names; None if unknown."""
    if not (cause.cost or cause.costs_all):
        files = [name for name in student.work if any(one.where == f"{name}.ipynb" for one in problems)]
        whole = [name for name in files if cause.codes[0] in _ABOUT_FILES]
        return sum(map(of.of_notebook, whole), Fraction(0)) if whole else None
    if (graded := student.graded) is None:
        return None
    if is_failed(graded.run):
        return of.at_stake(student, (mark.where for mark in graded.marks))
    there = {name for name, work in student.work.items() if work.state not in NOTHING_THERE}
    missing = (mark for mark in graded.marks if mark.status == Status.MISSING)
    lost = (mark for mark in missing if cause.costs_all or codes(mark.reason) & {*cause.cost})
    return of.at_stake(student, (mark.where for mark in lost if of.course.notebook_of(mark.question) in there))


def _by_run(of: Class) -> Iterator[Finding]:
    """Yield what failed, could not be read, or stopped, and what else a run says that may cost points."""
    for student in of.students:
        for (cause, what), problems in causes(student).items():
            worth = cost(of, student, cause, problems)
            if worth is None or worth:
                yield Finding(what, cause.command, student.id, worth)


# --- by marks and answers ---------------------------------------------------------------------------------------------


def _by_mark(of: Class) -> Iterator[Finding]:
    """Yield faults of the key, marks of an older key, and marks by persons that do not hold any more."""
    digest = marking_digest(of.course)
    for student in of.students:
        graded = student.graded
        if graded is None or is_failed(graded.run):
            continue
        faults = key_faults(graded)
        for question, part in (mark.where for mark in graded.marks if mark.status == Status.NOT_MARKED):
            fault = faults.get((question, part))
            named = f"{question}, {part}" if fault is None else shortened(sentence(fault))
            what = f"could not be graded: {named} Mend the key."
            regrade = f"regrade MARKS --question {quote(question)}"
            yield Finding(what, regrade, student.id, of.at_stake(student, [(question, part)]))
        if graded.key_digest not in ("", digest):
            yield Finding("marks are of an older key, or of an older version.", "regrade MARKS", student.id)
        for question, part in (given.mark.where for given in graded.lapsed):
            what = f"a person's mark for {question} {part} lapsed, as the answer or its points changed."
            again = f'mark MARKS {_STUDENT} {quote(question)} {quote(part)} POINTS --reason "..." --by NAME'
            yield Finding(what, again, student.id, of.at_stake(student, [(question, part)]))


def _by_answer(of: Class) -> Iterator[Finding]:
    """Yield the answers that wait in what is due; those whose mark lapsed are above."""
    questions = of.course.catalogue.marked.values()
    by_persons = {(one.number, part.name) for one in questions for part in one.parts if part.marked == "person"}
    for answer in of.answers:
        student, assignment = of.by_id[caseless(answer.student)], of.assignment_of(answer.question)
        work = student.work.get(of.course.notebook_of(answer.question))
        lapsed = {given.mark.where for given in student.graded.lapsed} if student.graded else set()
        if not answer.waiting or work is None or not work.is_due or assignment is None or answer.where in lapsed:
            continue
        worth, (question, part) = of.at_stake(student, [answer.where]), answer.where
        if answer.asked:
            yield Finding("a scorer asks you to decide.", "score MARKS --by NAME", answer.student, worth)
        elif answer.where in by_persons:
            what = f"waits for a person: answers of {assignment.title}."
            yield Finding(what, "score MARKS --by NAME", answer.student, worth)
        else:
            mark = f'mark MARKS {_STUDENT} {quote(question)} {quote(part)} POINTS --reason "..." --by NAME'
            what = f"waits for a person: {question} {part}. {shortened(sentence(answer.mark.reason))}"
            yield Finding(what, mark, answer.student, worth)


# --- by the class -----------------------------------------------------------------------------------------------------


def _by_class(of: Class) -> Iterator[Finding]:
    """Yield requests, marks that moved, what can be given back, and what names nobody."""
    for request in of.requests:
        student, (question, part) = of.by_id[caseless(request.student)], request.where
        marks = student.graded.marks if student.graded else ()
        left = sum(exact(mark.out_of) - exact(mark.points) for mark in marks if mark.where == request.where)
        answer = f'comment MARKS {_STUDENT} "TEXT" --question {quote(question)} --part {quote(part)} --by NAME'
        yield Finding(f"a request to look again at {question} {part}.", answer, student.id, Fraction(left))
    for change in of.changes:
        one = of.assignment_of(change.question)
        title = one.title if one else "what is not asked any more"
        scale = ratio(of.worths.get((change.question, change.part), Fraction(0)), _out_of(change))
        moved = abs(_points(change.after) - _points(change.before)) * scale
        yield Finding(f"marks of {title} moved since you gave them back.", _publish(one), change.student, moved)
    for one in of.assignments:
        yield from _handed_in_again(of, one)
        grades = [grade for student in of.students for grade in student.assignments if grade.title == one.title]
        counted = [grade for grade in grades if not grade.is_excused]
        is_done = all(grade.state in DONE and grade.is_due for grade in counted)
        if is_done and any(grade.state is State.MARKED for grade in counted) and of.given_back(one) is None:
            yield Finding(f"marked: all of {one.title}, and not given back yet.", _publish(one), worth=Fraction(0))
    yield from _names_nobody(of)


def _handed_in_again(of: Class, one: Assignment) -> Iterator[Finding]:
    """Yield who handed in a version after an assignment was given back: it counts, and may be late."""
    if (back := of.given_back(one)) is None:
        return
    for student in of.students:
        for name in {*one.notebooks} & {*student.work}:
            arrival = student.received.get(f"{name}.ipynb")
            if arrival is not None and back.when < arrival.received:
                what = f"{one.title}: a version came after you gave it back. It counts, late or not."
                yield Finding(what, f"history MARKS {_STUDENT}", student.id)


def _publish(one: Assignment | None) -> str:
    only = f" --assignment {quote(one.title)}" if one else ""
    return f"publish MARKS{only} --by NAME"


def _out_of(change: Change) -> Fraction:
    return exact(getattr(change.after or change.before, "out_of", 0))


def _points(state: object) -> Fraction:
    return exact(getattr(state, "points", 0))


def _names_nobody(of: Class) -> Iterator[Finding]:
    """Yield names in the settings, submissions and students that belong to nobody of the class."""
    deadlines, extensions = unknown_names(of.course.settings, (student.about for student in of.students))
    for where, names in (("deadlines", deadlines), ("extensions", extensions)):
        if names:
            what = f"course.toml has unknown students or sections in {where}: {listed(names, _SHOWN)}. Correct it."
            yield Finding(what, "report MARKS")
    doubts = [doubt for doubt in of.doubts if doubt.about != TIME]
    unknown = [doubt.submission for doubt in doubts if doubt.about == OWNER and not doubt.assumed]
    if unknown:
        what = f"nobody knows who handed in {listed(unknown, _SHOWN)}, so that it is not graded. {_INTAKE}"
        yield Finding(what, _GRADE)
    assumed = [f"{doubt.submission} ({doubt.about})" for doubt in doubts if doubt.about != OWNER or doubt.assumed]
    if assumed:
        yield Finding(f"not certain: {listed(assumed, _SHOWN)}. {_INTAKE}", _GRADE)
    strangers = [student.id for student in of.students if not student.about.enrolled]
    for who in strangers if len(strangers) < len(of.students) else ():
        what = "not on the roster. Take the roster in again, or rename the submission."
        yield Finding(what, "roster MARKS NAMES.csv", who)
