"""Show an instructor the class at a glance, as a page and in the terminal, and what changed since feedback was given.

Page and terminal are made of the same sections. What ``drop`` in ``course.toml`` leaves out is in nothing of it, but
for requests and for changes of marks.
"""

from __future__ import annotations

import io
from collections import Counter, defaultdict
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence, Sized
from dataclasses import dataclass
from datetime import datetime
from itertools import chain, groupby
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

from labcourse import clock, program
from labcourse.grading.accounts import Account, AssignmentGrade, in_full, points, worth
from labcourse.grading.assignments import State, asked_of_persons, last_dues, short
from labcourse.grading.counting import notebook_of, received
from labcourse.grading.course import Course
from labcourse.grading.gradebook import Answer, CommentRecord, Gradebook, Graded
from labcourse.grading.marks import Mark, Status
from labcourse.grading.reports import hints, intake_table
from labcourse.grading.reports.changes import ChangedMark, changed_in, state_text
from labcourse.grading.reports.result import (
    account_in,
    lapse,
    moment,
    not_counted,
    state_of,
    with_marks,
    without_numbers,
)
from labcourse.grading.reports.templating import templates
from labcourse.grading.scoring.desk import link
from labcourse.grading.settings import Assignment, MarkSettings
from labcourse.grading.submission import OWNER
from labcourse.grading.todo import NOTHING_THERE, Class, Student, Task, causes, todo
from labcourse.messages import number_of, shortened
from labcourse.problems import Code, Problem, Where
from labcourse.safe_text import no_escapes
from labcourse.sentences import sentence, sentences
from labcourse.student_id import INTAKE_FILE, caseless

OVERVIEW_FILE = "class.html"  #: in the folder of results
FAR_BELOW, FEWEST = 1 / 2, 5  #: of the class's median share of points, of at least so many students
MANY, SEVERAL = 0.2, 2  #: share of the judged answers, and students, for whom a part went wrong
_WIDTH, _MOST_ROWS = 100, 60  # of a terminal: columns, and rows of a table
_MOST_LINES = 5  # of one reason
_MOST_NAMED = 4  # students in a row; of more, the first three
_HINTS = (
    "As {program} grade or report wrote them into hints.md. It may be chance, or help that you allow. No mark depends "
    "on it. Ask before you conclude anything."
)
_WENT_WRONG = (Status.WRONG, Status.PARTLY)
_JUDGED = (*_WENT_WRONG, Status.RIGHT, Status.FOLLOW_THROUGH)


class Waiting(NamedTuple):
    """The answers to a part that wait for a person, and the number of all answers to it."""

    where: Where
    answers: list[Answer]
    of: int


class Slip(NamedTuple):
    """A part that went wrong for many; ``reasons`` are reason without numbers, and how often, the commonest first."""

    where: Where
    wrong: int
    judged: int
    lost: float
    reasons: list[tuple[str, int]]


class CellPiece(NamedTuple):
    """A piece of a cell: its text, how they look ("strong" or "code"), and (student, question, part) it leads to."""

    text: str
    look: str = ""
    leads_to: tuple[str, str, str] | None = None


#: What stands in a table: a text, a number, or pieces one after the other.
TableCell = str | float | Sequence[CellPiece]


class PageTable(NamedTuple):
    """A table; ``numbers`` are the headings of columns that are aligned at the right."""

    label: str
    headings: Sequence[str]
    rows: Sequence[Sequence[TableCell]]
    numbers: Collection[str] = ()


class Section(NamedTuple):
    """A section: what there is to say of it in a sentence, and its tables; those without rows are not shown."""

    title: str
    summary: str
    tables: Sequence[PageTable] = ()
    notes: Sequence[str] = ()


@dataclass(frozen=True)
class Overview:
    """What there is to know of a class now."""

    of: Class
    now: datetime
    sections: Sequence[Section]


def class_overview(book: Gradebook, course: Course, folder: Path | None = None) -> Overview:
    """Collect what there is to know of a class now.

    Parameters
    ----------
    book : the class's gradebook
    course : with its catalogue and settings
    folder : of results, with ``intake.csv`` and ``hints.json``; None without one

    Raises
    ------
    GradingError
        If one of these two files exists and cannot be read.
    """
    students = _students(book, course)
    asked = asked_of_persons(book, course.catalogue)
    answers = [one for one in asked if not course.settings.marks.dropped_as(*one.where)]
    requests, publications = [one for one in book.comments() if one.is_open], book.publications()
    decisions = {} if folder is None else intake_table.read(folder / INTAKE_FILE)
    doubts = [doubt for doubt, decision in decisions.items() if not decision]
    of = Class(course, students, answers, requests, publications, changed_in(book, course), doubts)
    acts = [act for act in book.scores.acts() if act.undoes is None]
    scorers = Counter(act.actor for act in acts if not course.settings.marks.dropped_as(act.question, act.part))
    sections = [
        *(_to_do(of), _the_term(of), _far_below_the_class(of), _messages(of), _not_counted(of)),
        *(_waiting_for_a_person(of, scorers), _asked_of_the_instructor(of), _requests(of)),
        *(_went_wrong(of), _stopped_cells(of), _same_work([] if folder is None else hints.read(folder))),
        _given_back(of),
    ]
    return Overview(of, clock.now(), sections)


def _left_out(marks: MarkSettings) -> str:
    what = f"Left out, as course.toml drops it: {', '.join(marks.drop)}."
    return f"{what} Requests and changed marks are still listed for it." if marks.drop else ""


# --- the class at a glance: one table of sections, as a page and in the terminal --------------------------------------


def as_page(overview: Overview, answer_link: Callable[[str, str, str], str] | None = None) -> str:
    """Return the overview as an HTML page without scripts, which loads nothing.

    Parameters
    ----------
    overview : from :func:`class_overview`
    answer_link : student, question, part → address of the answer, or of all of the student's if question and part are
        empty. With it, the page has links, and must not be written to a file.
    """
    page = templates("templates").get_template("overview.html")
    about = {"course": overview.of.course, "left_out": _left_out(overview.of.course.settings.marks)}
    return page.render(**vars(overview), **about, answer_link=answer_link, text_of=text_of)


def as_text(overview: Overview) -> str:
    """Return the overview for a terminal, without characters that control it."""
    from rich.box import SIMPLE_HEAD
    from rich.console import Console
    from rich.padding import Padding
    from rich.table import Table as Grid
    from rich.text import Text

    console = Console(file=(text := io.StringIO()), width=_WIDTH, color_system=None)

    def say(content: Any, indent: int = 2) -> None:
        shown = Text(no_escapes(content)) if isinstance(content, str) else content
        console.print(Padding(shown, (0, 0, 0, indent)))

    course = overview.of.course
    say(", ".join(filter(None, (course.title, course.settings.term))) + f"; {moment(overview.now)}")
    if left_out := _left_out(course.settings.marks):
        say(left_out)
    for section in overview.sections:
        say(f"\n{section.title.upper()}", 0)
        for line in (section.summary, *section.notes):
            say(line)
        for table in section.tables:
            if table.rows:
                say(f"\n{table.label}")
                grid = Grid(box=SIMPLE_HEAD, pad_edge=False, show_edge=False)
                for heading in table.headings:
                    grid.add_column(heading, justify="right" if heading in table.numbers else "left")
                for row in table.rows[:_MOST_ROWS]:
                    grid.add_row(*(Text(no_escapes(text_of(cell)) or "–") for cell in row))
                say(grid)
            if (left := len(table.rows) - _MOST_ROWS) > 0:
                say(f"{left} more rows are on the page.")
    return "\n".join(line.rstrip() for line in text.getvalue().strip().splitlines())


def text_of(cell: TableCell) -> str:
    """Return what stands in a cell as text."""
    if isinstance(cell, str):
        return cell
    return points(cell) if isinstance(cell, int | float) else "".join(piece.text for piece in cell)


# --- the sections -----------------------------------------------------------------------------------------------------


def _to_do(of: Class) -> Section:
    tasks = todo(of)
    some = f"{number_of(len(tasks), 'thing')} to do. What is worth most comes first."
    summary = some if tasks else "Nothing is to do today."
    table = PageTable("By the points at stake", ["Points", "What to do"], [*map(_of_task, tasks)], ["Points"])
    return Section("To do today", summary, [table])


def _of_task(task: Task) -> Sequence[TableCell]:
    """Return the row of something to do. Few students are named; of many their number, and the first."""
    many = len(task.who) > _MOST_NAMED
    first = [CellPiece(f"{_students_text(task.who)}: "), *_each(task.who[: _MOST_NAMED - 1]), CellPiece(", …")]
    who = first if many else _each(task.who)
    worth = "not known" if task.worth is None else points(float(task.worth)) if task.worth else ""
    what = [CellPiece(sentence(task.what), "strong"), CellPiece("\n"), *who, *([CellPiece("\n")] if who else [])]
    return worth, [*what, CellPiece(task.command, "code")]


def _the_term(of: Class) -> Section:
    there = [student for student in of.students if student.handed_in]
    summary = f"{len(there)} of {_students_text(of.students)} handed something in."
    by_title: dict[str, list[AssignmentGrade]] = {one.title: [] for one in of.assignments}
    for grade in (grade for student in of.students for grade in student.assignments):
        by_title[grade.title].append(grade)
    numbers = ["Out of", "Late", "Excused"]
    columns = ["Assignment", "Due", *numbers, "Given back"]
    assignments = [_assignment_row(of, one, by_title[one.title]) for one in of.assignments]
    counted = {title: [one.state for one in grades if not one.is_excused] for title, grades in by_title.items()}
    states = [state for state in State if any(state in those for those in counted.values())]
    counts = [(title, *(those.count(state) or "" for state in states)) for title, those in counted.items() if states]
    by_student = "Students; what is not due is left out until it is there"
    students = [(_named(one), work_text(one), _points_so_far(one), one.last) for one in of.students]
    tables = [
        PageTable("Assignments", columns, assignments, numbers),
        PageTable("Students in each state", ["Assignment", *states], counts, states),
        PageTable(by_student, ["Student", "Work", "Points so far", "Last handed in"], students),
    ]
    return Section("The term", summary, tables, [*_term_notes(of)])


def _assignment_row(of: Class, assignment: Assignment, grades: Sequence[AssignmentGrade]) -> Sequence[TableCell]:
    """Return what the class did of an assignment: how many students were late, or excused."""
    due = last_dues(of.course.settings, [assignment])[assignment]
    late = sum(bool(grade.days_late) for grade in grades if not grade.is_excused)
    excused, back = sum(grade.is_excused for grade in grades), of.given_back(assignment)
    is_due, is_back = f"{due:%Y-%m-%d %H:%M}" if due else "", moment(back.when) if back else ""
    return assignment.title, is_due, float(of.of_assignment(assignment)), late or "", excused or "", is_back


def _term_notes(of: Class) -> Iterator[str]:
    if not any(student.about.enrolled for student in of.students):
        yield f"The gradebook has no roster, so nobody is missed here who handed in nothing ({program.name()} roster)."
    if not of.course.settings.dues:
        yield "course.toml has no due dates. So everything is due, and nobody is behind."
    for student in of.students:
        if student.graded and student.graded.run.supplied:
            yield f"Values were supplied for {student.id}: {', '.join(student.graded.run.supplied)}."


def _far_below_the_class(of: Class) -> Section:
    behind, summary = far_below(of.students), "Nobody is far below the class."
    if behind:
        least = f"less than half the class's median, {100 * behind[0][2]:.0f} % of the points that are due and decided"
        summary = f"{_students_text(behind)} with {least}."
    rows = [(_named(student), f"{100 * share:.0f} %") for student, share, _usual in behind]
    table = PageTable("Points of what is due and decided", ["Student", "Share"], rows, ["Share"])
    return Section("Far below the class", summary, [table])


def _messages(of: Class) -> Section:
    rows = [(_named(one), "\n".join(messages)) for one in of.students if (messages := _details(one))]
    some = f"The messages behind the list of what to do, in full. They are about {_students_text(rows)}."
    summary = (
        some if rows else "No run, no file and no lapsed mark is known to cost points; cells that stopped are below."
    )
    return Section("What may have cost points", summary, [PageTable("Messages", ["Student", "Messages"], rows)])


#: Code of what does not count → what takes it in; else the student has to hand it in again.
_DECIDE, _ASK = "decide in MARKS/intake.csv, then grade again", "ask for it again, then grade it"
_TAKES_IT = {
    Code.ONE_OF_SEVERAL: _DECIDE,
    Code.VERSION_AFTER_GIVEN_BACK: "take it: take MARKS STUDENT NOTEBOOK",
    Code.TEXT_BESIDE_NOT_READ: "give points with mark",
}


def _not_counted(of: Class) -> Section:
    rows, concerned = [], set()
    for student in of.students:
        problems = not_counted(student.graded.run) if student.graded else []
        for code, same in groupby(problems, key=lambda one: one.code):
            those = [*same]
            more = [f"and {len(those) - _MOST_LINES} more"] if len(those) > _MOST_LINES else []
            shown = [*sentences(those[:_MOST_LINES]), *more]
            rows.append((_named(student), "\n".join(shown), _TAKES_IT.get(code, _ASK)))
            concerned.add(student.id)
    some = f"Some of what {_students_text(concerned)} made does not count."
    summary = some if rows else "Everything that was made counts."
    table = PageTable("Made by students, and not counted", ["Student", "What, and why", "What takes it in"], rows)
    return Section("What does not count", summary, [table])


def _waiting_for_a_person(of: Class, scorers: Mapping[str, int]) -> Section:
    waits = waiting(of)
    to_read = [answer for one in waits for answer in one.answers]
    answers = number_of(len(to_read), "answer")
    summary = f"To be read: {answers}, worth {worth(_out_of(to_read))}." if to_read else "No answer waits for a person."
    numbers = ["Waiting", "Of", "Points"]
    rows = [(*_question(of, one.where), len(one.answers), one.of, _out_of(one.answers)) for one in waits]
    tables = [
        PageTable("Answers that wait", ["Part", "Question", *numbers], rows, numbers),
        PageTable("Scoring", ["Scorer", "Answers"], sorted(scorers.items()), ["Answers"]),
    ]
    return Section("Waiting for a person", summary, tables)


def _asked_of_the_instructor(of: Class) -> Section:
    asked = [(answer, act) for answer in of.answers if answer.referred and (act := answer.last()) is not None]
    answers = number_of(len(asked), "answer")
    summary = f"For you to decide, as a scorer asked: {answers}." if asked else "No scorer asks you."
    rows = [(*_both(answer), act.actor, moment(act.when), shortened(act.remark)) for answer, act in asked]
    table = PageTable("Questions of scorers", ["Student", "Part", "Asked by", "When", "What"], rows)
    return Section("Asked of the instructor", summary, [table])


def _requests(of: Class) -> Section:
    some = f"{number_of(len(of.requests), 'request')} not answered yet."
    summary = some if of.requests else "Nobody asks to have anything looked at again."
    rows = [(*_both(one), moment(one.when), shortened(one.text)) for one in of.requests]
    table = PageTable("Requests of students", ["Student", "Part", "Since", "What"], rows)
    return Section("Requests to look again", summary, [table])


def _went_wrong(of: Class) -> Section:
    runs = (student.graded for student in of.students if student.graded is not None)
    found, summary, notes = slips(runs), "No part went wrong for many.", list[str]()
    if found:
        parts, most = number_of(len(found), "part"), " ".join(found[0].where)
        summary = f"{parts} went wrong for many; most of all {most}, for {_share(found[0])} who answered it."
        share = f"{100 * MANY:.0f} %"
        notes = [f"A part is listed if at least {share} of the answers went wrong, by the key or a person's points."]
    rows = [(*_question(of, one.where), _share(one), _commonest(one)) for one in found]
    table = PageTable("Slips", ["Part", "Question", "Went wrong for", "Commonest reasons"], rows)
    return Section("Went wrong for many", summary, [table], notes)


def _stopped_cells(of: Class) -> Section:
    rows = [(_one(one.id), "\n".join(messages)) for one in of.students if (messages := _stopped(one))]
    some = f"Cells of {_students_text(rows)} stopped with an error of their own."
    summary = some if rows else "No cell of a student stopped with an error of its own."
    table = PageTable("Cells that stopped, and what builds on them", ["Student", "What stopped"], rows)
    return Section("Cells that stopped", summary, [table])


def _same_work(of_class: Sequence[hints.Hint]) -> Section:
    common = hints.by_students(of_class)
    groups = number_of(len(common), "group")
    some = f"{groups} of students with equal numbers, recordings or files. A hint, never a verdict."
    summary = some if common else "Nobody has the numbers, recordings or files of a class-mate."
    rows = [(_each(students), "\n".join(one.evidence for one in those)) for students, those in common.items()]
    table = PageTable("Hints", ["Students", "What they have in common"], rows)
    notes = [_HINTS.format(program=program.name())] if common else []
    return Section("Hints of the same work", summary, [table], notes)


def _given_back(of: Class) -> Section:
    given, moved = of.publications, defaultdict[str, list[ChangedMark]](list)
    for change in of.changes:
        moved[change.student].append(change)
    summary = f"Feedback was not given back yet ({program.name()} publish)."
    if given:
        since = f"Marks of {_students_text(moved)} have changed since." if moved else "No mark has changed since."
        summary = f"Last given back on {moment(given[-1].when)}, by {given[-1].actor}. {since}"
    changed = [(_one(student), _moved(those)) for student, those in moved.items()]
    publications = [(moment(one.when), one.actor, one.note) for one in given]
    tables = [
        PageTable("Changed since", ["Student", "Changed"], changed),
        PageTable("Given back", ["When", "By", "Note"], publications),
    ]
    return Section("Feedback given back", summary, tables)


# --- pieces of the sections -------------------------------------------------------------------------------------------


def _students_text(students: Sized) -> str:
    return number_of(len(students), "student")


def _named(student: Student) -> list[CellPiece]:
    return [CellPiece(student.name, leads_to=(student.id, "", ""))]


def _one(student: str, where: Where | None = None) -> list[CellPiece]:
    """Return a student's ID, or the name of an answer of theirs, which leads there."""
    question, part = where or ("", "")
    return [CellPiece(f"{question} {part}" if where else student, leads_to=(student, question, part))]


def _each(students: Sequence[str]) -> list[CellPiece]:
    pieces = [piece for student in students for piece in (CellPiece(", "), *_one(student))]
    return pieces[1:]


def _both(about: Answer | CommentRecord) -> tuple[TableCell, TableCell]:
    """Return the cells of a student, and of the answer that something is about."""
    return _one(about.student), _one(about.student, about.where)


def _question(of: Class, where: Where) -> tuple[str, str]:
    """Return the cells of a part, and of the title of its question; "" if the course does not ask it any more."""
    question = of.course.catalogue.marked.get(where[0])
    return " ".join(where), question.title if question else ""


def _out_of(answers: Iterable[Answer]) -> float:
    return sum(answer.mark.out_of for answer in answers)


def _share(slip: Slip) -> str:
    return f"{slip.wrong} of {slip.judged} ({100 * slip.wrong / slip.judged:.0f} %)"


def _commonest(slip: Slip) -> str:
    return "\n".join(f"{times} × {reason}" for reason, times in slip.reasons[:3])


def _moved(changes: Iterable[ChangedMark]) -> list[CellPiece]:
    """Return the marks of a student that changed, each in a line."""
    pieces: list[CellPiece] = []
    for one in changes:
        pieces += [CellPiece("\n"), *_one(one.student, (one.question, one.part))]
        pieces.append(CellPiece(f": {state_text(one.before)} → {state_text(one.after)}"))
    return pieces[1:]


# --- students and assignments -----------------------------------------------------------------------------------------


def _students(book: Gradebook, course: Course) -> list[Student]:
    """Return everybody in the gradebook with the states of their work now; of runs, without marks that are dropped."""
    students, notebooks = [], {path.name for path in course.notebooks}
    marks = course.settings.marks
    for about in book.students():
        graded = book.current(about.student)
        counting = graded and with_marks(graded, lambda mark: not marks.dropped_as(*mark.where)).without_answers()
        came = {name: when for name, when in received(book, about.student, graded).items() if name in notebooks}
        account = account_in(book, course, graded, about)
        students.append(Student(about, account, counting, came))
    return students


def _details(student: Student) -> list[str]:
    """Return all messages on a student that may say why points are lost through no fault of theirs."""
    lapsed = student.graded.lapsed if student.graded else ()
    return [*sentences(chain.from_iterable(causes(student).values())), *map(lapse, lapsed)]


def _stopped(student: Student) -> list[str]:
    """Return the messages on cells of a student that stopped, and cost answers."""
    problems = () if student.graded is None else student.graded.run.problems
    return sentences(one for one in problems if isinstance(one, Problem) and one.code is Code.CELL_STOPPED)


def label(grade: AssignmentGrade) -> str:
    """Return a short name of an assignment: the number of its notebook, if it has no title of its own."""
    first, *more = grade.assignment.notebooks
    is_own = not more and grade.title == first.replace("_", " ")
    return short(first) if is_own else grade.title


def work_text(student: Student) -> str:
    """Return the states of a student's assignments, a line each; what is not due is left out until it is there."""
    by_state: dict[str, list[str]] = {}
    for grade in student.assignments:
        if grade.is_excused or grade.is_due or grade.state not in NOTHING_THERE:
            days = 0 if grade.is_excused else grade.days_late
            late = f" ({number_of(days, 'day')} late)" if days else ""
            state = "excused" if grade.is_excused else grade.state
            by_state.setdefault(state, []).append(f"{label(grade)}{late}")
    order = [*State, "excused"]
    return "\n".join(f"{state}: {', '.join(by_state[state])}" for state in order if state in by_state)


def _points_so_far(student: Student) -> str:
    """Return a student's points so far, as "9.50 of 11"; "" if nothing that counts is decided, or worth points."""
    account = student.account
    if not account.out_of or len(account.undecided) == len(account.counting):
        return ""
    return f"{account.so_far_text} of {in_full(account.out_of)}"


def far_below(students: Iterable[Student]) -> list[tuple[Student, float, float]]:
    """Find who has less than half the class's median share of the points that are decided and due.

    Returns
    -------
    list
        Student, their share (0 to 1), and the median; the smallest share first. Students without any decided points
        are left out; the list is empty if fewer than five are left.
    """
    graded = (student for student in students if student.graded is not None)
    shares = [(student, share) for student in graded if (share := _decided_share(student.account)) is not None]
    if len(shares) < FEWEST:
        return []
    usual = median(share for _student, share in shares)
    low = ((student, share, usual) for student, share in shares if share < FAR_BELOW * usual)
    return sorted(low, key=lambda entry: (entry[1], caseless(entry[0].id)))


def _decided_share(account: Account) -> float | None:
    """Return the share (0 to 1) of decided points that was earned, in what counts so far, with weights and lateness.

    Return None if nothing is decided.
    """
    decided = [item for item in account.counting if item.points is not None]
    possible = sum(item.possible for item in decided)
    return float(sum(item.earned for item in decided) / possible) if possible else None


# --- answers and marks ------------------------------------------------------------------------------------------------


def waiting(of: Class) -> list[Waiting]:
    """Return which answers wait, by part in the order of the course; questions that are not asked any more are last."""
    places = {question: place for place, question in enumerate(of.course.catalogue.marked)}
    by_part = defaultdict[Where, list[Answer]](list)
    for answer in sorted(of.answers, key=lambda one: (places.get(one.question, len(places)), one.where)):
        by_part[answer.where].append(answer)
    parts = (Waiting(where, [one for one in those if one.waiting], len(those)) for where, those in by_part.items())
    return [part for part in parts if part.answers]


def slips(runs: Iterable[Graded]) -> list[Slip]:
    """Find the parts that many students got wrong, the largest share first.

    Only parts that the key judges count. An answer to which a person gave points went wrong if they are not all that
    are possible. Many are at least ``MANY`` of the answers, and at least ``SEVERAL`` students.
    """
    judged = defaultdict[Where, list[Mark]](list)
    for mark in (mark for graded in runs for mark in graded.marks if mark.status in (*_JUDGED, Status.BY_A_PERSON)):
        judged[mark.where].append(mark)
    found = []
    for where, marks in judged.items():
        wrong = [mark for mark in marks if mark.status in _WENT_WRONG or mark.points < mark.out_of]
        if len(wrong) >= max(SEVERAL, MANY * len(marks)) and any(mark.status in _JUDGED for mark in marks):
            reasons = Counter(without_numbers(sentence(mark.reason)) for mark in wrong).most_common()
            found.append(Slip(where, len(wrong), len(marks), sum(one.out_of - one.points for one in wrong), reasons))
    return sorted(found, key=lambda slip: (-slip.wrong / slip.judged, -slip.lost, slip.where))


# --- feedback that was given back -------------------------------------------------------------------------------------


def to_give_back(book: Gradebook, course: Course, notebooks: Collection[str], folder: Path) -> Iterator[str]:
    """Yield what to know before feedback is given back.

    That is who gets what; which answers lost points without a remark; what was handed in and does not count; what
    waits, what was asked, and whether pages are closed now.

    Parameters
    ----------
    book : the class's gradebook
    course : with its questions and settings
    notebooks : that are given back, without ending; all of them if there are none
    folder : of results, with ``intake.csv``
    """
    settings, students, uncounted = course.settings, _students(book, course), list[str]()

    def is_given(notebook: str | None) -> bool:
        return not notebooks or notebook is None or notebook.removesuffix(".ipynb") in notebooks

    for student, run in ((one, one.graded.run) for one in students if one.graded):
        given = [one for one in student.assignments if all(map(is_given, one.assignment.notebooks))]
        grades = [f"{one.title} {one.points_text or '–'} of {in_full(one.out_of)} ({state_of(one)})" for one in given]
        yield f"{student.id}: {', '.join(grades)}"
        problems = [one for one in not_counted(run) if is_given(notebook_of(one, course))]
        uncounted += [f"  {student.id}: {line}" for line in sentences(problems)]
    if absent := [student.id for student in students if student.graded is None]:
        yield f"No page, as nothing of theirs is graded: {', '.join(absent)}."
    read = [one for one in asked_of_persons(book, course.catalogue) if is_given(course.notebook_of(one.question))]
    noted = {(one.student, *one.where) for one in book.comments() if not one.asks}
    silent = [one for one in read if one.given and not one.remark and (one.student, *one.where) not in noted]
    if lost := [one for one in silent if one.mark.points < one.mark.out_of]:
        how = f"to open one, put the end of its line behind the address of the scoring page ({program.name()} score)"
        yield f"Points lost without a remark: {number_of(len(lost), 'answer')}; {how}."
    yield from (f"  {one.student}, {one.question} {one.part}: {link(one.student, *one.where)}" for one in lost)
    doubts = [doubt for doubt, decision in intake_table.read(folder / INTAKE_FILE).items() if not decision]
    if nobodys := [doubt.submission for doubt in doubts if doubt.about == OWNER and not doubt.assumed]:
        uncounted.append(f"  {sentence(Problem.of(Code.TODO_FIND_OWNERS, names=nobodys))}")
    yield from ("Handed in, and does not count:", *uncounted) if uncounted else ()
    everything = [answer for answer in read if answer.waiting]
    waiting = [answer for answer in everything if not settings.marks.dropped_as(*answer.where)]
    if waiting:
        number = number_of(len({answer.student for answer in waiting}), "student")
        yield f"Still to be read by a person: {number_of(len(waiting), 'answer')} of {number}; their pages say so."
    if len(waiting) < len(everything):
        yield _left_out(settings.marks)
    if asked := [one for one in book.comments() if one.is_open and is_given(course.notebook_of(one.where[0]))]:
        yield f"{number_of(len(asked), 'request')} not answered yet ({program.name()} status lists what students ask)."
    opens = settings.feedback.opens
    if opens is not None and not settings.feedback.is_open(clock.now()):
        when = f"Feedback opens on {opens:%Y-%m-%d %H:%M %Z} (course.toml), and the pages say so and no more."
        yield f"{when} So nothing is given back: say {program.name()} publish again then."
