"""Show an instructor the class at a glance, as a page and in the terminal, and what changed since feedback was given.

The texts are in ``templates/overview.html``; the terminal shows what this page has. What ``drop`` in ``course.toml``
leaves out is in nothing of it, but for requests and for changes of marks.
"""

from __future__ import annotations

import io
from collections import Counter, defaultdict
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from datetime import datetime
from html.parser import HTMLParser
from itertools import chain
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

from labcourse import clock, program
from labcourse.answers.parts import Where
from labcourse.grading.accounts import Account, AssignmentGrade, in_full
from labcourse.grading.assignments import State, short
from labcourse.grading.course import Course
from labcourse.grading.gradebook import Act, Answer, Gradebook, Graded, MarkRecord
from labcourse.grading.graded_run import key_faults
from labcourse.grading.reports import hints, intake_table
from labcourse.grading.reports.changes import changed_in, state_text
from labcourse.grading.reports.result import account_in, lapse, points, received, shortened, without_numbers, worth
from labcourse.grading.reports.templating import templates
from labcourse.grading.settings import Assignment, MarkSettings
from labcourse.grading.todo import NOTHING_THERE, Class, Student, causes, todo
from labcourse.grading.verdicts import Status
from labcourse.messages import listed, plural
from labcourse.problems import Code, codes
from labcourse.safe_text import no_escapes
from labcourse.sentences import sentence, sentences
from labcourse.student_id import HINTS_FILE, INTAKE_FILE, caseless

PAGE_FILE = "class.html"  #: in the folder of results
FAR_BELOW, FEWEST = 1 / 2, 5  #: of the class's median share of points, of at least so many students
MANY, SEVERAL = 0.2, 2  #: share of the judged answers, and students, for whom a part went wrong
_WIDTH, _MOST_ROWS = 100, 60  # of a terminal: columns, and rows of a table
_STOPS = {Code.CELL_STOPPED, Code.STOPPED_WITHOUT_COST, Code.STOPPED_ON_UNANSWERED}
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
    """Collect what there is to know of a class now: the values of the template.

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
        "asked": [(answer, act) for answer in answers if answer.asked and (act := answer.last()) is not None],
        "requests": requests,
        "slips": slips(runs),
        "common": {} if folder is None else hints.read(folder / HINTS_FILE),
        "publications": publications,
        "changes": of.changes,
    }


def _left_out(marks: MarkSettings) -> str:
    what = f"Left out, as course.toml drops it: {', '.join(marks.drop)}."
    return f"{what} Requests and changed marks are still listed for it." if marks.drop else ""


def as_page(overview: Mapping[str, Any], answer_link: Callable[[str, str, str], str] | None = None) -> str:
    """Return the overview as an HTML page without scripts, which loads nothing.

    Parameters
    ----------
    overview : from :func:`class_overview`
    answer_link : student, question, part → address of the answer, or of all of the student's if question and part are
        empty. With it, the page has links, and must not be written to a file.
    """
    environment = templates("templates")
    texts = {"moment": moment, "worth": worth, "shortened": shortened, "state": state_text, "points": points}
    texts |= {"work": work_text, "so_far": so_far_text}
    page = environment.get_template("overview.html")
    about = {"listed": listed, "many": MANY, "program": program.name(), "answer_link": answer_link}
    return page.render(**overview, **texts, **about)


def as_text(page: str) -> str:
    """Return the page for a terminal, without characters that control it."""
    from rich.console import Console

    text = io.StringIO()
    _Terminal(Console(file=text, width=_WIDTH, color_system=None)).feed(page)
    return "\n".join(line.rstrip() for line in text.getvalue().strip().splitlines())


class _Terminal(HTMLParser):
    """Print headings, paragraphs and tables of an own page; ``nav`` and ``head`` have nothing that is not below."""

    def __init__(self, console: Any) -> None:
        super().__init__()
        self._console, self._text, self._rows, self._numbers = console, "", list[list[str]](), set[int]()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag not in ("a", "code", "strong"):
            self._text = ""
        if tag in ("table", "tr"):
            self._rows = [] if tag == "table" else [*self._rows, []]
        if ("class", "number") in attrs:
            self._numbers.add(len(self._rows[-1]))

    def handle_data(self, data: str) -> None:
        self._text += data

    def handle_endtag(self, tag: str) -> None:
        text = no_escapes(self._text.strip())
        if tag in ("th", "td"):
            self._rows[-1].append(text or "–")
        elif tag in ("p", "caption"):
            self._print(f"\n{text}" if tag == "caption" else text, 2)
        elif tag == "h2":
            self._print(f"\n{text.upper()}", 0)
        elif tag == "table":
            self._table()

    def _print(self, content: Any, indent: int) -> None:
        from rich.padding import Padding
        from rich.text import Text

        self._console.print(Padding(Text(content) if isinstance(content, str) else content, (0, 0, 0, indent)))

    def _table(self) -> None:
        from rich.box import SIMPLE_HEAD
        from rich.table import Table
        from rich.text import Text

        table = Table(box=SIMPLE_HEAD, pad_edge=False, show_edge=False)
        for place, heading in enumerate(self._rows[0]):
            table.add_column(heading, justify="right" if place in self._numbers else "left")
        for row in self._rows[1 : _MOST_ROWS + 1]:
            table.add_row(*map(Text, row))
        self._print(table, 2)
        if (left := len(self._rows) - 1 - _MOST_ROWS) > 0:
            self._print(f"{left} more rows are on the page.", 2)
        self._numbers.clear()


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
    return sentences(one for one in problems if codes(one) & _STOPS)


def _of_assignment(of: Class, one: Assignment) -> dict[str, Any]:
    """Return what the class did of an assignment: how many students are in each state, late, or excused."""
    grades = [grade for student in of.students for grade in student.assignments if grade.title == one.title]
    back, points, settings = of.given_back(one), of.of_assignment(one), of.course.settings
    rules = [(rule.due, settings.notebooks_of(rule)) for rule in settings.dues]
    return {
        "title": one.title,
        "due": max((due for due, names in rules if not names or names & {*one.notebooks}), default=None),
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
    return float(sum(item.weighted * (1 - item.taken) for item in decided) / possible) if possible else None


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
    judged: dict[Where, list[MarkRecord]] = defaultdict(list)
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
