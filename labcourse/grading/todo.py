"""What a person must do something about today: for whom, how many points it is worth, and the command that does it.

Nothing here is cut, so that whoever reads only this learns of all that cost points through no fault of the student.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from itertools import chain
from shlex import quote
from typing import NamedTuple

from labcourse import program
from labcourse.grading.accounts import Account, AssignmentGrade, account_of, ratio, unknown_names
from labcourse.grading.assignments import Handed, State, Work, exact, of_course
from labcourse.grading.counting import to_be_run
from labcourse.grading.course import Course
from labcourse.grading.gradebook import ON_DISK, Answer, Arrival, CommentRecord, Graded, Publication, StudentRecord
from labcourse.grading.graded_run import is_failed, key_faults, submission_of
from labcourse.grading.marking.marking_processes import marking_digest
from labcourse.grading.marks import Status
from labcourse.grading.reports.changes import ChangedMark
from labcourse.grading.reports.result import moment, nothing_given
from labcourse.grading.scoring.rubric import for_a_person
from labcourse.grading.settings import Assignment
from labcourse.grading.submission import OWNER, TIME_RECEIVED, Doubt
from labcourse.problems import Code, Problem, Where, codes
from labcourse.student_id import caseless

#: States of work that needs nothing more.
DONE = (State.MARKED, State.MISSING, State.UNTOUCHED)
#: States of work of which there is nothing, or nothing of the student's own.
NOTHING_THERE = (State.MISSING, State.NOT_DUE, State.UNTOUCHED)
_STUDENT = "STUDENT"  # in a command: the ID of the first student
_GRADE = "grade MARKS SUBMISSIONS"
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
        if arrival is None:
            return ""
        mark = {"": "?", ON_DISK: " (file)", None: ""}.get(arrival.clock, "")
        return f"{moment(arrival.received)}{mark}"

    @property
    def handed_in(self) -> bool:
        """Whether there is anything of their own."""
        return any(work.state not in NOTHING_THERE for one in self.assignments for work in one.works)


@dataclass(frozen=True)
class Task:
    """Something to do: what, the command, the IDs of the students, and the points at stake; None if nobody knows."""

    what: Problem
    command: str
    who: tuple[str, ...] = ()
    worth: Fraction | None = None


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
    changes: Sequence[ChangedMark] = ()
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
        """Return the points of a notebook that count, in the column of its assignment; 0 if it is in none."""
        parts = (where for where in self.worths if self.course.notebook_of(where[0]) == name)
        return sum((self.worths[where] for where in parts), Fraction(0))

    def of_assignment(self, assignment: Assignment) -> Fraction:
        """Return what the column of an assignment is out of."""
        return sum(map(self.of_notebook, assignment.notebooks), Fraction(0))

    def assignment_of(self, question: str) -> Assignment | None:
        """Return the assignment of a question; None if it is in none."""
        return next((one for one in self.assignments if self.course.notebook_of(question) in one.notebooks), None)

    def at_stake(self, student: Student, wheres: Iterable[Where]) -> Fraction:
        """Add up the points of some answers, without those that do not count or from which the student is excused."""
        there = (one for one in wheres if one in self.worths and self.course.notebook_of(one[0]) in student.work)
        return sum((self.worths[one] for one in there), Fraction(0))

    def given_back(self, assignment: Assignment) -> Publication | None:
        """Return the last publication that gave back all of an assignment; None without one."""
        names = {*assignment.notebooks}
        return next(
            (one for one in reversed(self.publications) if not one.notebooks or names <= {*one.notebooks}), None
        )


def todo(of: Class) -> list[Task]:
    """Return what to do in a class: what is worth most first, then what is of unknown worth, then the rest."""
    groups = defaultdict[Problem, list[Task]](list)
    for task in chain(_by_state(of), _by_run(of), _by_mark(of), _by_answer(of), _by_class(of)):
        groups[task.what].append(task)
    tasks = [_joined(those) for those in groups.values()]
    return sorted(tasks, key=lambda task: (task.worth is None or not task.worth, task.worth == 0, -(task.worth or 0)))


def _joined(tasks: Sequence[Task]) -> Task:
    """Return one task for all students for whom there is the same thing to do."""
    who = tuple(dict.fromkeys(student for task in tasks for student in task.who))
    worths = [task.worth for task in tasks if task.worth is not None]
    command = tasks[0].command.replace(_STUDENT, quote(who[0]) if who else _STUDENT)
    return Task(tasks[0].what, f"{program.name()} {command}", who, sum(worths, Fraction(0)) if worths else None)


def _mark(question: str, part: str) -> str:
    return f'mark MARKS {_STUDENT} {quote(question)} {quote(part)} POINTS --reason "..." --by NAME'


# --- by the calendar --------------------------------------------------------------------------------------------------


def _by_state(of: Class) -> Iterator[Task]:
    """Yield what is missing after its due date, is not graded yet, or came at a time that nobody knows."""
    for student in of.students:
        for grade in student.assignments:
            excuse = f'excuse MARKS {_STUDENT} {quote(grade.title)} --reason "..." --by NAME'
            for work in grade.works:
                found = _of_work(grade, work, excuse, bool(of.course.settings.late.per_day))
                points = of.of_notebook(work.notebook)
                if found is not None and work.excuse is None and points:
                    yield Task(*found, (student.id,), points)


def _of_work(grade: AssignmentGrade, work: Work, excuse: str, late_costs: bool) -> tuple[Problem, str] | None:
    """Return what to do about a piece of work, and the command; None for nothing."""
    is_overdue = work.is_due and work.until is not None  # without any date, nobody is behind
    match work.state:
        case State.MISSING if is_overdue:
            return Problem.of(Code.TODO_ASK_FOR_WORK, title=grade.title), excuse
        case State.UNTOUCHED if is_overdue:
            return Problem.of(Code.TODO_ASK_FOR_CHANGES, title=grade.title), excuse
        case State.HANDED_IN:
            return Problem.of(Code.TODO_GRADE), _GRADE
        case State.WAITS if late_costs and work.timing is not None and work.timing.waits:
            return Problem.of(Code.TODO_DECIDE_TIME, title=grade.title), _GRADE
    return None


# --- by what a run says -----------------------------------------------------------------------------------------------


class Mishap(NamedTuple):
    """Something that may cost points through no fault of the student.

    Attributes
    ----------
    codes : of the problems that say it
    todo, command : what to do
    cost : codes of the reasons of the missing marks that it cost
    costs_all : whether it cost every missing mark
    in_full : whether what to do names the problem
    """

    codes: tuple[Code, ...]
    todo: Code
    command: str
    cost: tuple[Code, ...] = ()
    costs_all: bool = False
    in_full: bool = False


_FILES = (Code.OWN_FILE_REFUSED, Code.MORE_OWN_FILES_REFUSED, Code.FILE_AND_FOLDER, Code.OUTSIDE_THE_FOLDER)
_TEXTS = (Code.TEXT_TOO_LONG, Code.TEXT_BESIDE_NOT_READ, Code.CELL_TOO_LONG)
_PICTURES = (Code.PICTURE_LEFT_OUT, Code.TOO_MANY_PICTURES, Code.PASTED_PICTURE_LEFT_OUT)
_UNREAD = (Code.NOTEBOOK_UNREAD, Code.SUBMISSION_UNREAD, Code.NO_NOTEBOOK)
_LONGER, _LONGER_CELL = f"{_GRADE} --deadline 1200", f"{_GRADE} --cell-timeout 120"
_LONGER_TOO, _MORE_MEMORY = f"{_GRADE} --cell-timeout 90", f"{_GRADE} --memory 4096"
_MARK = _mark("QUESTION", "PART")
#: The first that fits a problem counts.
CAUSES = (
    Mishap((Code.GRADING_FAILED,), Code.TODO_FAILED, _GRADE, costs_all=True, in_full=True),
    Mishap((Code.UNKNOWN,), Code.TODO_FAILED, _GRADE, in_full=True),
    Mishap((Code.EARLIER_MARKS_STAY,), Code.TODO_FAILED_AGAIN, _GRADE, in_full=True),
    Mishap((Code.RUN_TIMED_OUT,), Code.TODO_RUN_TIMED_OUT, _LONGER, costs_all=True),
    Mishap((Code.PYTHON_DIED,), Code.TODO_OUT_OF_MEMORY, _MORE_MEMORY, costs_all=True),
    Mishap((Code.PRINTED_TOO_MUCH,), Code.TODO_PRINTED_TOO_MUCH, _GRADE, costs_all=True),
    Mishap((Code.RUN_ENDED_EARLY,), Code.TODO_RUN_ENDED_EARLY, _LONGER_TOO, costs_all=True),
    Mishap((Code.ANSWERS_UNREAD, Code.RESULT_UNREAD), Code.TODO_ANSWERS_UNREAD, _GRADE, costs_all=True),
    Mishap((Code.CELL_TIMED_OUT, Code.TOOK_TOO_LONG), Code.TODO_CELL_TIMED_OUT, _LONGER_CELL, (Code.TOOK_TOO_LONG,)),
    Mishap((Code.MODULE_MISSING,), Code.TODO_INSTALL_MODULE, _LONGER_TOO, (Code.MODULE_MISSING,)),
    Mishap((Code.NEWER_PYTHON_NEEDED,), Code.TODO_NEWER_PYTHON, _GRADE, (Code.NEWER_PYTHON_NEEDED,)),
    Mishap(_FILES, Code.TODO_FILE_LEFT_OUT, _GRADE, (Code.FILE_NOT_FOUND,)),
    Mishap((Code.RECORDED_AT_HOME,), Code.TODO_RECORDED_AT_HOME, _MARK, (Code.MISSING_HERE,)),
    Mishap((Code.REPORT_UNREAD, Code.MAY_ASK_FOR_PASSWORD), Code.TODO_READ_REPORT, _GRADE),
    Mishap((Code.OLDER_NOTEBOOK_COUNTS,), Code.TODO_OLDER_FILE_COUNTS, _GRADE, in_full=True),
    Mishap(_UNREAD, Code.TODO_ASK_AGAIN, _GRADE, in_full=True),
    Mishap((Code.OTHER_STUDENT_NAMED, Code.PARTNERS_UNCONFIRMED), Code.TODO_DECIDE_OWNER, _GRADE),
    Mishap((Code.ANSWERS_OF_ANOTHER_BENCH,), Code.TODO_OTHER_BENCH, _GRADE),
    Mishap((Code.RELEASE_UNKNOWN,), Code.TODO_ADD_RELEASE, _GRADE),
    Mishap((Code.DOUBTED_BY_COURSE,), Code.TODO_LOOK_AT_RECORDING, _MARK),
    Mishap((Code.EMPTY_BESIDE_ANSWERED,), Code.TODO_NEWER_FILE_EMPTY, _GRADE),
    Mishap((*_TEXTS, *_PICTURES), Code.TODO_LOOK_AT_TEXT, _MARK),
)


def causes(student: Student) -> dict[tuple[Mishap, Problem], list[Problem]]:
    """Return the causes that the problems of a student's run name, each with what to do → the problems.

    Of several causes that fit a problem, the first counts; problems that no cause fits are left out.
    """
    found: dict[tuple[Mishap, Problem], list[Problem]] = {}
    if student.graded is not None:
        run = student.graded.run
        for problem in dict.fromkeys((*submission_of(run).ended, *run.problems, *run.notes)):
            known = codes(problem)
            cause = next((one for one in CAUSES if known & {*one.codes}), None)
            if cause is not None and isinstance(problem, Problem):
                what = Problem.of(cause.todo, problem=problem) if cause.in_full else Problem.of(cause.todo)
                found.setdefault((cause, what), []).append(problem)
    return found


def cost(of: Class, student: Student, cause: Mishap, problems: Sequence[Problem]) -> Fraction | None:
    """Return the points that a cause cost a student, by their marks, or by the files it names; None if unknown."""
    if not (cause.cost or cause.costs_all):
        about = [one for one in problems if "part" in one.parameters]
        whole = {one.where for one in problems if one.code in _ABOUT_FILES}
        files = [name for name in student.work if f"{name}.ipynb" in whole]
        named = [(one.parameters["question"], one.parameters["part"]) for one in about]
        parts = [where for where in named if of.course.notebook_of(where[0]) not in files]
        return sum(map(of.of_notebook, files), of.at_stake(student, parts)) if files or parts else None
    if (graded := student.graded) is None:
        return None
    if is_failed(graded.run):
        return of.at_stake(student, (mark.where for mark in graded.marks))
    there = {name for name, work in student.work.items() if work.state not in NOTHING_THERE}
    missing = (mark for mark in graded.marks if mark.status == Status.MISSING)
    lost = (mark for mark in missing if cause.costs_all or codes(mark.reason) & {*cause.cost})
    return of.at_stake(student, (mark.where for mark in lost if of.course.notebook_of(mark.question) in there))


def _by_run(of: Class) -> Iterator[Task]:
    """Yield what failed, could not be read, or stopped, and what else a run says that may cost points."""
    for student in of.students:
        for (cause, what), problems in causes(student).items():
            worth = cost(of, student, cause, problems)
            if worth is None or worth:
                yield Task(what, cause.command, (student.id,), worth)


# --- by marks and answers ---------------------------------------------------------------------------------------------


def _by_mark(of: Class) -> Iterator[Task]:
    """Yield faults of the key, marks of an older key, and marks by persons that do not hold any more.

    Students without a run, or with a run that failed, are left out.
    """
    digest = marking_digest(of.course)
    for student in of.students:
        graded = student.graded
        if graded is None or is_failed(graded.run):
            continue
        faults = key_faults(graded)
        for where in (mark.where for mark in graded.marks if mark.status == Status.NOT_MARKED):
            what = Problem.of(Code.TODO_MEND_KEY, problem=faults.get(where, f"{', '.join(where)}."))
            regrade = f"regrade MARKS --question {quote(where[0])}"
            yield Task(what, regrade, (student.id,), of.at_stake(student, [where]))
        for name in to_be_run(graded.run.versions):
            yield Task(Problem.of(Code.TODO_GRADE_VERSION, name), _GRADE, (student.id,))
        if graded.key_digest not in ("", digest):
            yield Task(Problem.of(Code.TODO_OLDER_KEY), "regrade MARKS", (student.id,))
        for where in (given.mark.where for given in graded.lapsed):
            what = Problem.of(Code.TODO_MARK_LAPSED, answer=" ".join(where))
            yield Task(what, _mark(*where), (student.id,), of.at_stake(student, [where]))


def _by_answer(of: Class) -> Iterator[Task]:
    """Yield the answers that wait in what is due; those whose mark lapsed are above."""
    by_persons = {*for_a_person(of.course.catalogue)}
    for answer in of.answers:
        student, assignment = of.by_id[caseless(answer.student)], of.assignment_of(answer.question)
        work = student.work.get(of.course.notebook_of(answer.question))
        lapsed = {given.mark.where for given in student.graded.lapsed} if student.graded else set()
        if not answer.waiting or work is None or not work.is_due or assignment is None or answer.where in lapsed:
            continue
        command, what = "score MARKS --by NAME", Problem.of(Code.TODO_SCORER_ASKS)
        if not answer.referred and answer.where in by_persons:
            what = Problem.of(Code.TODO_READ_ANSWERS, title=assignment.title)
        elif not answer.referred:
            command, about = _mark(*answer.where), " ".join(answer.where)
            what = Problem.of(Code.TODO_DECIDE_ANSWER, answer=about, reason=answer.mark.reason)
        yield Task(what, command, (answer.student,), of.at_stake(student, [answer.where]))


# --- by the class -----------------------------------------------------------------------------------------------------


def _by_class(of: Class) -> Iterator[Task]:
    """Yield requests, marks that moved, what can be given back, and what names nobody."""
    for request in of.requests:
        student, (question, part) = of.by_id[caseless(request.student)], request.where
        marks = student.graded.marks if student.graded else ()
        mark = next((mark for mark in marks if mark.where == request.where and mark.out_of), None)
        lost = Fraction(0) if mark is None else 1 - exact(mark.points) / exact(mark.out_of)
        answer = f'comment MARKS {_STUDENT} "TEXT" --question {quote(question)} --part {quote(part)} --by NAME'
        what = Problem.of(Code.TODO_ANSWER_REQUEST, answer=f"{question} {part}")
        yield Task(what, answer, (student.id,), lost * of.worths.get(request.where, Fraction(0)))
    for change in of.changes:
        one = of.assignment_of(change.question)
        title = one.title if one else "what is not asked any more"
        what = Problem.of(Code.TODO_MARKS_MOVED, title=title)
        yield Task(what, _publish(one), (change.student,), _moved(of, change))
    for one in of.assignments:
        yield from _handed_in_again(of, one)
        grades = [grade for student in of.students for grade in student.assignments if grade.title == one.title]
        counted = [grade for grade in grades if not grade.is_excused]
        is_done = all(grade.state in DONE and grade.is_due for grade in counted)
        if is_done and any(grade.state is State.MARKED for grade in counted) and of.given_back(one) is None:
            yield Task(Problem.of(Code.TODO_GIVE_BACK, title=one.title), _publish(one), worth=Fraction(0))
    yield from _names_nobody(of)


def _handed_in_again(of: Class, assignment: Assignment) -> Iterator[Task]:
    """Yield who handed in a version after an assignment was given back: it counts only if the instructor takes it."""
    for student in of.students:
        for entry in student.graded.run.versions if student.graded else ():
            if entry["notebook"] in assignment.notebooks and entry["why"] == "given back":
                what = Problem.of(Code.TODO_HANDED_IN_AGAIN, title=assignment.title)
                yield Task(what, f"take MARKS {_STUDENT} {entry['notebook']}", (student.id,))


def _publish(assignment: Assignment | None) -> str:
    only = f" --assignment {quote(assignment.title)}" if assignment else ""
    return f"publish MARKS{only} --by NAME"


def _moved(of: Class, change: ChangedMark) -> Fraction:
    """Return by how many points of its assignment's column a mark changed."""
    before, after = (exact(state.points) if state else Fraction(0) for state in (change.before, change.after))
    out_of = next((exact(state.out_of) for state in (change.after, change.before) if state), Fraction(0))
    return abs(after - before) * ratio(of.worths.get((change.question, change.part), Fraction(0)), out_of)


def _names_nobody(of: Class) -> Iterator[Task]:
    """Yield names in the settings, submissions and students that belong to nobody of the class, and other doubts.

    Times in doubt are left out; so are students who are not on the roster, if nobody is.
    """
    deadlines, extensions = unknown_names(of.course.settings, (student.about for student in of.students))
    for where, names in (("deadlines", deadlines), ("extensions", extensions)):
        if names:
            yield Task(Problem.of(Code.TODO_CORRECT_SETTINGS, where, names=names), "report MARKS")
    doubts = [doubt for doubt in of.doubts if doubt.about != TIME_RECEIVED]
    unknown = [doubt.submission for doubt in doubts if doubt.about == OWNER and not doubt.assumed]
    if unknown:
        yield Task(Problem.of(Code.TODO_FIND_OWNERS, names=unknown), _GRADE)
    assumed = [f"{doubt.submission} ({doubt.about})" for doubt in doubts if doubt.about != OWNER or doubt.assumed]
    if assumed:
        yield Task(Problem.of(Code.TODO_DOUBTS, names=assumed), _GRADE)
    strangers = [student.id for student in of.students if not student.about.enrolled]
    for who in strangers if len(strangers) < len(of.students) else ():
        yield Task(Problem.of(Code.TODO_NOT_ON_ROSTER), "roster MARKS NAMES.csv", (who,))
