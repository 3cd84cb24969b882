"""Show an instructor the class at a glance, as a page and in the terminal, and what changed since feedback was given.

Page and terminal are made of the same sections. What ``drop`` in ``course.toml`` leaves out is in nothing of it, but
for requests and for changes of marks.
"""

from __future__ import annotations

import io
from collections import Counter, defaultdict
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence, Sized
from dataclasses import replace
from datetime import datetime
from itertools import chain
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

from labcourse import clock, program
from labcourse.grading.accounts import Account, AssignmentGrade, in_full, points, worth
from labcourse.grading.assignments import State, short
from labcourse.grading.course import Course
from labcourse.grading.gradebook import Act, Answer, Gradebook, Graded
from labcourse.grading.graded_run import key_faults
from labcourse.grading.marks import Mark, Status
from labcourse.grading.reports import hints, intake_table
from labcourse.grading.reports.changes import changed_in, state_text
from labcourse.grading.reports.result import account_in, lapse, received, without_numbers
from labcourse.grading.reports.templating import templates
from labcourse.grading.settings import Assignment, MarkSettings
from labcourse.grading.todo import NOTHING_THERE, Class, Student, Task, causes, todo
from labcourse.messages import plural, shortened
from labcourse.problems import NOT_COUNTED, Code, Problem, Where
from labcourse.safe_text import no_escapes
from labcourse.sentences import sentence, sentences
from labcourse.student_id import HINTS_FILE, INTAKE_FILE, caseless

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


def moment(when: datetime) -> str:
    """Write a time as "2026-03-02 12:00 UTC"."""
    return f"{when:%Y-%m-%d %H:%M} UTC"


def class_overview(book: Gradebook, course: Course, folder: Path | None = None) -> dict[str, Any]:
    """Collect what there is to know of a class now.

    Parameters
    ----------
    book : the class's gradebook
    course : with its catalogue and settings
    folder : of results, with ``intake.csv`` and ``hints.md``; None without one
    """
    marks = course.settings.marks
    students = _students(book, course)
    runs = [student.graded for student in students if student.graded is not None]
    answers = [answer for answer in book.scores.answers() if not marks.dropped_as(*answer.where)]
    requests, publications = [one for one in book.comments() if one.is_open], book.publications()
    decisions = {} if folder is None else intake_table.read(folder / INTAKE_FILE)
    doubts = [doubt for doubt, decision in decisions.items() if not decision]
    of = Class(course, students, answers, requests, publications, changed_in(book, course), doubts)
    return {
        "course": course,
        "now": clock.now(),
        "left_out": _left_out(marks),
        "titles": {number: question.title for number, question in course.catalogue.marked.items()},
        "todo": todo(of),
        "stopped": [(student, said) for student in students if (said := _stopped(student))],
        "details": [(student, said) for student in students if (said := _details(student))],
        "assignments": (rows := [_of_assignment(of, one) for one in of.assignments]),
        "states": [state for state in State if any(one["states"][state] for one in rows)],
        "students": students,
        "behind": far_below(students),
        **waiting(answers, book.scores.acts(), list(course.catalogue.marked)),
        "asked": [(answer, act) for answer in answers if answer.referred and (act := answer.last()) is not None],
        "requests": requests,
        "slips": slips(runs),
        "common": {} if folder is None else hints.read(folder / HINTS_FILE),
        "publications": publications,
        "changes": of.changes,
    }


def _left_out(marks: MarkSettings) -> str:
    what = f"Left out, as course.toml drops it: {', '.join(marks.drop)}."
    return f"{what} Requests and changed marks are still listed for it." if marks.drop else ""


# --- the class at a glance: one table of sections, as a page and in the terminal --------------------------------------


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


def as_page(overview: Mapping[str, Any], answer_link: Callable[[str, str, str], str] | None = None) -> str:
    """Return the overview as an HTML page without scripts, which loads nothing.

    Parameters
    ----------
    overview : from :func:`class_overview`
    answer_link : student, question, part → address of the answer, or of all of the student's if question and part are
        empty. With it, the page has links, and must not be written to a file.
    """
    page = templates("templates").get_template("overview.html")
    about = {name: overview[name] for name in ("course", "now", "left_out")}
    return page.render(**about, sections=[*sections(overview)], answer_link=answer_link, moment=moment, text_of=text_of)


def as_text(overview: Mapping[str, Any]) -> str:
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

    course = overview["course"]
    say(", ".join(filter(None, (course.title, course.settings.term))) + f"; {moment(overview['now'])}")
    say(overview["left_out"]) if overview["left_out"] else None
    for section in sections(overview):
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
    return f"{cell:g}" if isinstance(cell, int | float) else "".join(piece.text for piece in cell)


def sections(overview: Mapping[str, Any]) -> Iterator[Section]:
    """Yield the sections of an overview; ``overview`` is from :func:`class_overview`."""
    students, titles = overview["students"], overview["titles"]
    todo_now, count = overview["todo"], plural(len(overview["todo"]), "{count} thing", "{count} things")
    yield Section(
        "To do today",
        f"{count} to do. What is worth most comes first." if todo_now else "Nothing is to do today.",
        [PageTable("By the points at stake", ["Points", "What to do"], [*map(_of_task, todo_now)], ["Points"])],
    )
    there = [student for student in students if student.handed_in]
    columns = ["Assignment", "Due", "Out of", "Late", "Excused", "Given back"]
    states = ["Assignment", *overview["states"]]
    by_student = "Students; what is not due is left out until it is there"
    yield Section(
        "The term",
        f"{len(there)} of {_students_text(students)} handed something in.",
        [
            PageTable(
                "Assignments", columns, [*map(_assignment_row, overview["assignments"])], ["Out of", "Late", "Excused"]
            ),
            PageTable(
                "Students in each state",
                states,
                [(one["title"], *(one["states"][name] or "" for name in states[1:])) for one in overview["assignments"]]
                if states[1:]
                else [],
                states[1:],
            ),
            PageTable(
                by_student,
                ["Student", "Work", "Points so far", "Last handed in"],
                [(_named(one), work_text(one), so_far_text(one), one.last) for one in students],
            ),
        ],
        [*_term_notes(overview)],
    )
    behind = overview["behind"]
    far = "with less than half the class's median"
    yield Section(
        "Far below the class",
        f"{_students_text(behind)} {far}, {100 * behind[0][2]:.0f} % of the points that are due and decided."
        if behind
        else "Nobody is far below the class.",
        [
            PageTable(
                "Points of what is due and decided",
                ["Student", "Share"],
                [(_named(student), f"{100 * share:.0f} %") for student, share, _usual in behind],
                ["Share"],
            )
        ],
    )
    details = overview["details"]
    yield Section(
        "What may have cost points",
        f"The messages behind the list of what to do, in full. They are about {_students_text(details)}."
        if details
        else "No run, no file and no lapsed mark cost anybody points.",
        [PageTable("Messages", ["Student", "Messages"], [(_named(one), "\n".join(said)) for one, said in details])],
    )
    yield from _of_not_counted(students)
    yield from _of_answers(overview, titles)
    yield from _of_work(overview, titles)


#: Code of what does not count → what takes it in; else the student has to hand it in again.
_DECIDE, _ASK = "decide in MARKS/intake.csv, then grade again", "ask for it again, then grade it"
_TAKES_IT = {
    Code.ONE_OF_SEVERAL: _DECIDE,
    Code.OTHER_ASSIGNMENT: "grade MARKS SUBMISSIONS without --assignment",
    Code.TEXT_BESIDE_NOT_READ: "give points with mark",
}


def _of_not_counted(students: Sequence[Student]) -> Iterator[Section]:
    """Yield the section of what students made and does not count, grouped by reason."""
    rows: list[Sequence[TableCell]] = []
    for student in students:
        run = student.graded.run if student.graded else None
        reported = (*run.problems, *run.notes) if run else ()
        by_code = defaultdict[Code, list[Problem]](list)
        for one in dict.fromkeys(reported):
            if isinstance(one, Problem) and one.code in NOT_COUNTED:
                by_code[one.code].append(one)
        for code, those in by_code.items():
            shown = sentences(those[:_MOST_LINES])
            more = [f"and {len(those) - _MOST_LINES} more"] if len(those) > _MOST_LINES else []
            rows.append((_named(student), "\n".join([*shown, *more]), _TAKES_IT.get(code, _ASK)))
    concerned = {text_of(row[0]) for row in rows}
    yield Section(
        "What does not count",
        f"Some of what {_students_text(concerned)} made does not count."
        if rows
        else "Everything that was made counts.",
        [PageTable("Made by students, and not counted", ["Student", "What, and why", "What takes it in"], rows)],
    )


def _students_text(students: Sized) -> str:
    return plural(len(students), "{count} student", "{count} students")


def _named(student: Student) -> list[CellPiece]:
    return [CellPiece(student.name, leads_to=(student.id, "", ""))]


def _one(student: str, where: Where | None = None) -> list[CellPiece]:
    """Return a student's ID, or the name of an answer of theirs, which leads there."""
    question, part = where or ("", "")
    return [CellPiece(f"{question} {part}" if where else student, leads_to=(student, question, part))]


def _each(students: Sequence[str]) -> list[CellPiece]:
    pieces = [piece for student in students for piece in (CellPiece(", "), *_one(student))]
    return pieces[1:]


def _of_task(task: Task) -> Sequence[TableCell]:
    """Return the row of something to do. Few students are named; of many their number, and the first."""
    many = len(task.who) > _MOST_NAMED
    first = [CellPiece(f"{_students_text(task.who)}: "), *_each(task.who[: _MOST_NAMED - 1]), CellPiece(", …")]
    who = first if many else _each(task.who)
    worth = "not known" if task.worth is None else points(float(task.worth)) if task.worth else ""
    what = [CellPiece(sentence(task.what), "strong"), CellPiece("\n"), *who, *([CellPiece("\n")] if who else [])]
    return worth, [*what, CellPiece(task.command, "code")]


def _assignment_row(row: Mapping[str, Any]) -> Sequence[TableCell]:
    due = f"{row['due']:%Y-%m-%d %H:%M}" if row["due"] else ""
    back = moment(row["given_back"]) if row["given_back"] else ""
    return row["title"], due, row["out_of"], row["late"] or "", row["excused"] or "", back


def _term_notes(overview: Mapping[str, Any]) -> Iterator[str]:
    students = overview["students"]
    if not any(student.about.enrolled for student in students):
        yield f"The gradebook has no roster, so nobody is missed here who handed in nothing ({program.name()} roster)."
    if not overview["course"].settings.dues:
        yield "course.toml has no due dates. So everything is due, and nobody is behind."
    for student in students:
        if student.graded and student.graded.run.supplied:
            yield f"Values were supplied for {student.id}: {', '.join(student.graded.run.supplied)}."


def _of_answers(overview: Mapping[str, Any], titles: Mapping[str, str]) -> Iterator[Section]:
    """Yield the sections about answers that somebody has to read."""
    waits, asked, requests = overview["waiting"], overview["asked"], overview["requests"]
    to_read = [answer for one in waits for answer in one.answers]
    answers = plural(len(to_read), "{count} answer", "{count} answers")
    columns = ["Part", "Question", "Waiting", "Of", "Points"]
    rows = [
        (" ".join(one.where), titles.get(one.where[0], ""), len(one.answers), one.of, _out_of(one.answers))
        for one in waits
    ]
    yield Section(
        "Waiting for a person",
        f"To be read: {answers}, worth {worth(_out_of(to_read))}." if to_read else "No answer waits for a person.",
        [
            PageTable("Answers that wait", columns, rows, columns[2:]),
            PageTable("Scoring", ["Scorer", "Answers"], overview["scorers"], ["Answers"]),
        ],
    )
    columns = ["Student", "Part", "Asked by", "When", "What"]
    answers = plural(len(asked), "{count} answer", "{count} answers")
    yield Section(
        "Asked of the instructor",
        f"For you to decide, as a scorer asked: {answers}." if asked else "No scorer asks you.",
        [
            PageTable(
                "Questions of scorers",
                columns,
                [
                    (
                        *(_one(answer.student), _one(answer.student, answer.where)),
                        *(act.actor, moment(act.when), shortened(act.remark)),
                    )
                    for answer, act in asked
                ],
            )
        ],
    )
    count = plural(len(requests), "{count} request", "{count} requests")
    yield Section(
        "Requests to look again",
        f"{count} not answered yet." if requests else "Nobody asks to have anything looked at again.",
        [
            PageTable(
                "Requests of students",
                ["Student", "Part", "Since", "What"],
                [
                    (_one(one.student), _one(one.student, one.where), moment(one.when), shortened(one.text))
                    for one in requests
                ],
            )
        ],
    )


def _out_of(answers: Iterable[Answer]) -> float:
    return sum(answer.mark.out_of for answer in answers)


def _of_work(overview: Mapping[str, Any], titles: Mapping[str, str]) -> Iterator[Section]:
    """Yield the sections about what the class did, and what was given back."""
    slips_, stopped, common = overview["slips"], overview["stopped"], overview["common"]
    many = f"A part is listed if at least {100 * MANY:.0f} % of the answers that the key judged went wrong."
    summary = "No part went wrong for many."
    if slips_:
        parts, most = plural(len(slips_), "{count} part", "{count} parts"), " ".join(slips_[0].where)
        summary = f"{parts} went wrong for many; most of all {most}, for {_share(slips_[0])} who answered it."
    yield Section(
        "Went wrong for many",
        summary,
        [
            PageTable(
                "Slips",
                ["Part", "Question", "Went wrong for", "Commonest reasons"],
                [(" ".join(one.where), titles.get(one.where[0], ""), _share(one), _commonest(one)) for one in slips_],
            )
        ],
        [many] if slips_ else [],
    )
    label = "Cells that stopped, and what builds on them"
    yield Section(
        "Cells that stopped",
        f"Cells of {_students_text(stopped)} stopped with an error of their own."
        if stopped
        else "No cell of a student stopped with an error of its own.",
        [PageTable(label, ["Student", "What stopped"], [(_one(one.id), "\n".join(said)) for one, said in stopped])],
    )
    groups = plural(len(common), "{count} group", "{count} groups")
    yield Section(
        "Hints of the same work",
        f"{groups} of students with equal numbers, recordings or files. A hint, never a verdict."
        if common
        else "Nobody has the numbers, recordings or files of a class-mate.",
        [
            PageTable(
                "Hints",
                ["Students", "What they have in common"],
                [(_each(who), "\n".join(evidence)) for who, evidence in common.items()],
            )
        ],
        [_HINTS.format(program=program.name())] if common else [],
    )
    moved = defaultdict[str, list[Any]](list)
    for change in overview["changes"]:
        moved[change.student].append(change)
    given = overview["publications"]
    summary = f"Feedback was not given back yet ({program.name()} publish)."
    if given:
        since = f"Marks of {_students_text(moved)} have changed since." if moved else "No mark has changed since."
        summary = f"Last given back on {moment(given[-1].when)}, by {given[-1].actor}. {since}"
    yield Section(
        "Feedback given back",
        summary,
        [
            PageTable(
                "Changed since", ["Student", "Changed"], [(_one(who), _moved(those)) for who, those in moved.items()]
            ),
            PageTable("Given back", ["When", "By", "Note"], [(moment(one.when), one.actor, one.note) for one in given]),
        ],
    )


def _share(slip: Slip) -> str:
    return f"{slip.wrong} of {slip.judged} ({100 * slip.wrong / slip.judged:.0f} %)"


def _commonest(slip: Slip) -> str:
    return "\n".join(f"{times} × {reason}" for reason, times in slip.reasons[:3])


def _moved(changes: Iterable[Any]) -> list[CellPiece]:
    """Return the marks of a student that changed, each in a line."""
    pieces: list[CellPiece] = []
    for one in changes:
        pieces += [CellPiece("\n"), *_one(one.student, (one.question, one.part))]
        pieces.append(CellPiece(f": {state_text(one.before)} → {state_text(one.after)}"))
    return pieces[1:]


# --- students and assignments -----------------------------------------------------------------------------------------


def _students(book: Gradebook, course: Course) -> list[Student]:
    """Return everybody in the gradebook with the states of their work now."""
    students, notebooks = [], {path.name for path in course.notebooks}
    for about in book.students():
        graded = book.current(about.student)
        counting = None if graded is None else _counting(graded, course.settings.marks)
        came = {name: when for name, when in received(book, about.student, graded).items() if name in notebooks}
        students.append(Student(about, account_in(book, course, graded, about), counting, came))
    return students


def _counting(graded: Graded, settings: MarkSettings) -> Graded:
    """Return a run without its answers, with the marks that count, and without faults of the key in others."""
    dropped = tuple(mark for mark in graded.marks if settings.dropped_as(*mark.where))
    marks = tuple(mark for mark in graded.marks if mark not in dropped)
    faults_of_dropped = key_faults(replace(graded, marks=dropped))
    problems = tuple(problem for problem in graded.run.problems if problem not in faults_of_dropped.values())
    lapsed = tuple(given for given in graded.lapsed if not settings.dropped_as(*given.mark.where))
    return replace(graded, run=replace(graded.run, problems=problems), marks=marks, lapsed=lapsed).without_answers()


def _details(student: Student) -> list[str]:
    """Return all messages on a student that may say why points are lost through no fault of theirs."""
    lapsed = student.graded.lapsed if student.graded else ()
    return [*sentences(chain.from_iterable(causes(student).values())), *map(lapse, lapsed)]


def _stopped(student: Student) -> list[str]:
    """Return the messages on cells of a student that stopped, and cost answers."""
    problems = () if student.graded is None else student.graded.run.problems
    return sentences(one for one in problems if isinstance(one, Problem) and one.code is Code.CELL_STOPPED)


def _of_assignment(of: Class, assignment: Assignment) -> dict[str, Any]:
    """Return what the class did of an assignment: how many students are in each state, late, or excused."""
    grades = [grade for student in of.students for grade in student.assignments if grade.title == assignment.title]
    back, points, settings = of.given_back(assignment), of.of_assignment(assignment), of.course.settings
    rules = [(rule.due, settings.notebooks_of(rule)) for rule in settings.dues]
    return {
        "title": assignment.title,
        "due": max((due for due, names in rules if not names or names & {*assignment.notebooks}), default=None),
        "out_of": float(points),
        "states": Counter(grade.state for grade in grades if not grade.is_excused),
        "late": sum(bool(grade.days_late) for grade in grades if not grade.is_excused),
        "excused": sum(grade.is_excused for grade in grades),
        "given_back": None if back is None else back.when,
    }


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
            late = f" ({plural(days, '{count} day late', '{count} days late')})" if days else ""
            state = "excused" if grade.is_excused else grade.state
            by_state.setdefault(state, []).append(f"{label(grade)}{late}")
    order = [*State, "excused"]
    return "\n".join(f"{state}: {', '.join(by_state[state])}" for state in order if state in by_state)


def so_far_text(student: Student) -> str:
    """Return a student's points so far, as "9.50 of 11"; "" if nothing that counts is decided."""
    account = student.account
    if not account.out_of or len(account.undecided) == len(account.counting):
        return ""
    return f"{account.so_far_text} of {in_full(account.out_of)}"


def far_below(students: Iterable[Student]) -> list[tuple[Student, float, float]]:
    """Find who has less than half the class's median share of the points that are decided and due.

    Returns
    -------
    list
        Student, their share (0 to 1), and the median; the smallest share first. Nobody in a class of fewer than five.
    """
    graded = (student for student in students if student.graded is not None)
    shares = [(student, share) for student in graded if (share := _decided_share(student.account)) is not None]
    if len(shares) < FEWEST:
        return []
    usual = median(share for _student, share in shares)
    low = ((student, share, usual) for student, share in shares if share < FAR_BELOW * usual)
    return sorted(low, key=lambda entry: (entry[1], caseless(entry[0].id)))


def _decided_share(account: Account) -> float | None:
    """Return earned points of decided points in what is due; None if nothing is decided."""
    decided = [item for item in account.counting if item.points is not None]
    possible = sum(item.possible for item in decided)
    return float(sum(item.weighted * (1 - item.lost_share) for item in decided) / possible) if possible else None


# --- answers and marks ------------------------------------------------------------------------------------------------


def waiting(answers: Sequence[Answer], acts: Sequence[Act], order: Sequence[str]) -> dict[str, Any]:
    """Return which answers wait, and how many answers each scorer has read.

    Parameters
    ----------
    answers : all that persons read
    acts : of the scorers
    order : the questions in the order of the course

    Returns
    -------
    dict
        ``waiting``, a list of :class:`Waiting`; and ``scorers``, a list of name and number of answers.
    """
    places = {question: place for place, question in enumerate(order)}
    by_part: dict[Where, list[Answer]] = {}
    for answer in sorted(answers, key=lambda one: (places.get(one.question, len(places)), one.where)):
        by_part.setdefault(answer.where, []).append(answer)
    parts = []
    for where, those in by_part.items():
        if left := [answer for answer in those if answer.waiting]:
            parts.append(Waiting(where, left, len(those)))
    scorers = Counter(act.actor for act in acts if act.undoes is None)
    return {"waiting": parts, "scorers": sorted(scorers.items())}


def slips(runs: Iterable[Graded]) -> list[Slip]:
    """Find the parts that many students got wrong, among the answers that the key judged; the largest share first."""
    judged: dict[Where, list[Mark]] = defaultdict(list)
    for mark in (mark for graded in runs for mark in graded.marks if mark.status in _JUDGED):
        judged[mark.where].append(mark)
    judged_parts = []
    for where, marks in judged.items():
        wrong = [mark for mark in marks if mark.status in _WENT_WRONG]
        reasons = Counter(without_numbers(sentence(mark.reason)) for mark in wrong).most_common()
        lost = sum(mark.out_of - mark.points for mark in wrong)
        judged_parts.append(Slip(where, len(wrong), len(marks), lost, reasons))
    many = (slip for slip in judged_parts if slip.wrong >= max(SEVERAL, MANY * slip.judged))
    return sorted(many, key=lambda slip: (-slip.wrong / slip.judged, -slip.lost, slip.where))


# --- feedback that was given back -------------------------------------------------------------------------------------


def not_ready(book: Gradebook, course: Course, notebooks: Collection[str], now: datetime) -> Iterator[str]:
    """Yield what to know before feedback is given back: what waits, what was asked, and whether pages are closed now.

    Parameters
    ----------
    book : the class's gradebook
    course : with its questions and settings
    notebooks : that are given back, without ending; all of them if there are none
    now : when, with a time zone
    """
    settings = course.settings

    def is_given(question: str) -> bool:
        return not notebooks or course.notebook_of(question) in notebooks

    read = [answer for answer in book.scores.answers() if is_given(answer.question)]
    everything = [answer for answer in read if answer.waiting]
    waiting = [answer for answer in everything if not settings.marks.dropped_as(*answer.where)]
    if waiting:
        answers = plural(len(waiting), "{count} answer", "{count} answers")
        students = plural(len({answer.student for answer in waiting}), "{count} student", "{count} students")
        yield f"Still to be read by a person: {answers} of {students}; their pages say so."
    if len(waiting) < len(everything):
        yield _left_out(settings.marks)
    silent = [one for one in read if one.given and one.mark.points < one.mark.out_of and not one.mark.reason]
    if silent:
        have = plural(len(silent), "{count} answer has", "{count} answers have")
        yield f"{have} less than full points from a person, without a remark: the student reads no reason."
    if count := len([one for one in book.comments() if one.is_open and is_given(one.where[0])]):
        requests = plural(count, "{count} request", "{count} requests")
        yield f"{requests} not answered yet ({program.name()} status lists what students ask)."
    opens = settings.feedback.opens
    if opens is not None and not settings.feedback.is_open(now):
        when = f"Feedback opens on {opens:%Y-%m-%d %H:%M %Z} (course.toml), and the pages say so and no more."
        yield f"{when} So nothing is given back: say {program.name()} publish again then."
