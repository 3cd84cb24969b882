"""Show an instructor the class at a glance, as a page and in the terminal, and what changed since feedback was given.

The texts are in ``templates/overview.html``; the terminal shows what this page has. What ``drop`` in ``course.toml``
leaves out is in nothing of it, but for requests and for changes of marks.
"""

from __future__ import annotations

import io
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from html.parser import HTMLParser
from statistics import median
from typing import Any, NamedTuple

from labcourse import program
from labcourse.answers.parts import Where
from labcourse.grading.assignments import short, timing
from labcourse.grading.course import Course
from labcourse.grading.gradebook import (
    Act,
    Answer,
    Arrival,
    Gradebook,
    Graded,
    MarkRecord,
    StudentRecord,
)
from labcourse.grading.graded_run import FAILED, facts_of, key_faults
from labcourse.grading.intake import is_unread
from labcourse.grading.reports import hints
from labcourse.grading.reports.changes import changed_in, state_text
from labcourse.grading.reports.result import lapse, points, received, result_in, shortened, without_numbers, worth
from labcourse.grading.reports.templating import templates
from labcourse.grading.scoring import progress
from labcourse.grading.settings import CourseSettings, MarkSettings
from labcourse.grading.verdicts import UNDECIDED, Status
from labcourse.messages import listed, plural
from labcourse.safe_text import no_escapes
from labcourse.student_id import caseless

PAGE_FILE = "class.html"  #: in the folder of results
MUCH = 1 / 3  #: of the points; a student who misses more is in trouble
FAR_BELOW, FEWEST = 1 / 2, 5  #: of the class's median share of points, of at least so many students
MANY, SEVERAL = 0.2, 2  #: share of the judged answers, and students, for whom a part went wrong
_MOST_PROBLEMS = 3  # of a student that are shown; all are in their feedback
_WIDTH = 100  # columns of a terminal
_WENT_WRONG = (Status.WRONG, Status.PARTLY)
_JUDGED = (*_WENT_WRONG, Status.RIGHT, Status.FOLLOW_THROUGH)


@dataclass(frozen=True)
class Student:
    """A student, as the gradebook knows them.

    Attributes
    ----------
    about : what the roster says
    graded : the run that counts, with the marks that count; None if nothing was graded
    received : file name of a notebook → when it was handed in, and how that is known
    unread : file names of notebooks that were handed in and cannot be read
    late : notebook, without ending → days late
    overdue : notebooks, without ending, that are missing after their deadline
    """

    about: StudentRecord
    graded: Graded | None = None
    received: Mapping[str, Arrival] = field(default_factory=dict)
    unread: Sequence[str] = ()
    late: Mapping[str, int] = field(default_factory=dict)
    overdue: Sequence[str] = ()

    @property
    def name(self) -> str:
        """ID and name, as "ada (Ada Lovelace)"."""
        return f"{self.about.student} ({self.about.name})" if self.about.name else self.about.student

    @property
    def handed_in(self) -> bool:
        """Whether there is anything of them."""
        return bool(self.received) or self.graded is not None

    @property
    def behind(self) -> bool:
        """Whether something came late, or is missing after its deadline."""
        return bool(self.late or self.overdue)

    @property
    def last(self) -> str:
        """When the last notebook was handed in, with "?" if only the student's computer says so."""
        arrival = max(self.received.values(), default=None, key=lambda arrival: arrival.received)
        return "" if arrival is None else f"{moment(arrival.received)}{'?' if arrival.clock == '' else ''}"


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


def class_overview(book: Gradebook, course: Course) -> dict[str, Any]:
    """Collect what there is to know of a class now: the values of the template.

    Parameters
    ----------
    book : the class's gradebook
    course : with its catalogue and settings
    """
    marks, names = course.settings.marks, [path.name for path in course.notebooks]
    now = datetime.now(UTC)
    students = [_student(book, course, about, now) for about in book.students()]
    runs = [student.graded for student in students if student.graded is not None]
    answers = [answer for answer in book.scores.answers() if not marks.dropped_as(*answer.where)]
    publications = book.requests.publications()
    return {
        "course": course,
        "now": now,
        "left_out": _left_out(marks),
        "titles": {number: question.title for number, question in course.catalogue.marked.items()},
        "students": students,
        "shown": [name for name in names if any(name in (*one.received, *one.unread) for one in students)],
        "troubled": in_trouble(students),
        **waiting(answers, book.scores.acts(), list(course.catalogue.marked)),
        "asked": [(answer, act) for answer in answers if answer.asked and (act := answer.last()) is not None],
        "requests": book.requests.all(),
        **faults(runs),
        "slips": slips(runs),
        "common": hints.by_students(hints.of_class(book, course)),
        "publications": publications,
        "changes": changed_in(book, course),
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
    environment.filters["short"] = short
    functions = {
        "moment": moment,
        "worth": worth,
        "shortened": shortened,
        "state": state_text,
        "left": progress.time_text,
    }
    page = environment.get_template("overview.html")
    about = {"listed": listed, "many": MANY, "program": program.name(), "answer_link": answer_link}
    return page.render(**overview, **functions, **about)


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
        for row in self._rows[1:]:
            table.add_row(*map(Text, row))
        self._print(table, 2)
        self._numbers.clear()


# --- students ---------------------------------------------------------------------------------------------------------


def _student(book: Gradebook, course: Course, about: StudentRecord, now: datetime) -> Student:
    """Return a student, with what came late or is missing after its deadline."""
    graded, names = book.current(about.student), [path.name for path in course.notebooks]
    came = {name: arrival for name, arrival in received(book, about.student, graded).items() if name in names}
    unread, late, counting = [], {}, None
    if graded is not None:
        account, counting = result_in(book, course, graded, about).account, _counting(graded, course.settings.marks)
        unread = [name for name in names if name not in came and is_unread(name, graded.run.problems)]
        late = {entry.notebook: entry.days for entry in account.timings if entry.days} if account is not None else {}
        if not came and not unread:
            return Student(about, counting)  # nobody knows when anything came
    missing = [name for name in _counting_notebooks(course) if f"{name}.ipynb" not in (*came, *unread)]
    would = ((name, timing(course.settings, about, name, Arrival(now))) for name in missing)
    return Student(about, counting, came, unread, late, [name for name, entry in would if entry and entry.days])


def _counting(graded: Graded, settings: MarkSettings) -> Graded:
    """Return a run with the marks that count, and without faults of the key in others."""
    dropped = tuple(mark for mark in graded.marks if settings.dropped_as(*mark.where))
    marks = tuple(mark for mark in graded.marks if mark not in dropped)
    faults_of_dropped = key_faults(replace(graded, marks=dropped))
    problems = tuple(problem for problem in graded.run.problems if problem not in faults_of_dropped)
    lapsed = tuple(given for given in graded.lapsed if not settings.dropped_as(*given.mark.where))
    return replace(graded, run=replace(graded.run, problems=problems), marks=marks, lapsed=lapsed).without_answers()


def _counting_notebooks(course: Course) -> list[str]:
    """Return the notebooks of which not everything that is worth points is dropped."""
    parts = [(question, part) for question in course.asked.marked.values() for part in question.parts if part.points]
    dropped_as = course.settings.marks.dropped_as
    counts = {question.notebook for question, part in parts if not dropped_as(question.number, part.name)}
    dropped = {question.notebook for question, _part in parts} - counts
    return [name for name in course.asked.notebooks if name not in dropped]


def in_trouble(students: Iterable[Student]) -> list[tuple[Student, list[str]]]:
    """Find the students in trouble, and why; those with the most reasons first."""
    graded = [(student, student.graded) for student in students if student.graded is not None]
    shares = [share for _student, run in graded if (share := _decided_share(run.marks)) is not None]
    usual = median(shares) if len(shares) >= FEWEST else None
    troubled = [(student, why) for student, run in graded if (why := troubles(run, usual))]
    return sorted(troubled, key=lambda entry: (-len(entry[1]), caseless(entry[0].about.student)))


def troubles(graded: Graded, usual: float | None = None) -> list[str]:
    """List why a student is in trouble, in sentences.

    Parameters
    ----------
    graded : their run that counts
    usual : the class's median share of the decided points; None without a class to compare with
    """
    ended, faults = facts_of(graded.run).ended, key_faults(graded)
    problems = [problem for problem in graded.run.problems if problem not in (*faults, *ended)]
    reasons = [*(f"Their run stopped: {why}" for why in ended), *problems[:_MOST_PROBLEMS]]
    if (left := len(problems) - _MOST_PROBLEMS) > 0:
        reasons.append(f"{plural(left, '{count} problem', '{count} problems')} more, in their feedback.")
    missing = [mark.out_of for mark in graded.marks if mark.status == Status.MISSING]
    everything, own = sum(mark.out_of for mark in graded.marks), _decided_share(graded.marks)
    if everything and sum(missing) > MUCH * everything:
        parts = plural(len(missing), "{count} part", "{count} parts")
        reasons.append(f"Missing: {parts}, worth {points(sum(missing))} of {worth(everything)}.")
    if graded.run.supplied:
        reasons.append(f"Values were supplied for them: {', '.join(graded.run.supplied)}.")
    reasons += map(lapse, graded.lapsed)
    if usual is not None and own is not None and own < FAR_BELOW * usual:
        share = f"{100 * own:.0f} % of the points that are decided; the median is {100 * usual:.0f} %."
        reasons.append(f"Far below the class: {share}")
    return reasons


def _decided_share(marks: Sequence[MarkRecord]) -> float | None:
    """Return earned points of decided points; None if nothing is decided."""
    decided = [mark for mark in marks if mark.out_of and mark.status not in UNDECIDED]
    return sum(mark.points for mark in decided) / sum(mark.out_of for mark in decided) if decided else None


# --- answers and marks ------------------------------------------------------------------------------------------------


def waiting(answers: Sequence[Answer], acts: Sequence[Act], order: Sequence[str]) -> dict[str, Any]:
    """Return which answers wait, how long scorers take for one, and how long the rest will take.

    Parameters
    ----------
    answers : all that persons read
    acts : of the scorers
    order : the questions in the order of the course

    Returns
    -------
    dict
        ``waiting``, a list of :class:`Waiting`; ``seconds_left`` for one person, None if too few times are known; and
        ``scorers``, a list of name, number of answers, and median seconds of an answer or None.
    """
    places = {question: place for place, question in enumerate(order)}
    by_part: dict[Where, list[Answer]] = {}
    for answer in sorted(answers, key=lambda one: (places.get(one.question, len(places)), one.where)):
        by_part.setdefault(answer.where, []).append(answer)
    parts = []
    for where, those in by_part.items():
        if left := [answer for answer in those if answer.waiting]:
            parts.append(Waiting(where, left, len(those)))
    actors = sorted({act.actor for act in acts})
    readings = {who: progress.readings([act for act in acts if act.actor == who]) for who in actors}
    every = [reading for those in readings.values() for reading in those]
    if (usual := progress.usual(every)) is not None:
        each = {
            part.where: progress.usual([one for one in every if one.where == part.where]) or usual for part in parts
        }
        usual = sum(len(part.answers) * each[part.where] for part in parts)
    counts = Counter(act.actor for act in acts if act.undoes is None)
    scorers = [(who, counts[who], progress.usual(those)) for who, those in readings.items()]
    return {"waiting": parts, "seconds_left": usual, "scorers": scorers}


def faults(runs: Iterable[Graded]) -> dict[str, Any]:
    """Return the parts that a fault of the key left unmarked, each with the number of students, and the messages."""
    unmarked, messages = Counter[Where](), list[str]()
    for graded in runs:
        messages += key_faults(graded)
        if not graded.run.key.startswith(FAILED):
            unmarked.update(mark.where for mark in graded.marks if mark.status == Status.NOT_MARKED)
    return {"unmarked": unmarked, "key_faults": list(dict.fromkeys(messages))}


def slips(runs: Iterable[Graded]) -> list[Slip]:
    """Find the parts that many students got wrong, among the answers that the key judged; the largest share first."""
    judged: dict[Where, list[MarkRecord]] = defaultdict(list)
    for mark in (mark for graded in runs for mark in graded.marks if mark.status in _JUDGED):
        judged[mark.where].append(mark)
    judged_parts = []
    for where, marks in judged.items():
        wrong = [mark for mark in marks if mark.status in _WENT_WRONG]
        reasons = Counter(without_numbers(mark.reason) for mark in wrong).most_common()
        lost = sum(mark.out_of - mark.points for mark in wrong)
        judged_parts.append(Slip(where, len(wrong), len(marks), lost, reasons))
    many = (slip for slip in judged_parts if slip.wrong >= max(SEVERAL, MANY * slip.judged))
    return sorted(many, key=lambda slip: (-slip.wrong / slip.judged, -slip.lost, slip.where))


# --- feedback that was given back -------------------------------------------------------------------------------------


def not_ready(book: Gradebook, settings: CourseSettings, now: datetime) -> Iterator[str]:
    """Yield what to know before feedback is published: what waits, what was asked, and whether pages are closed now."""
    everything = [answer for answer in book.scores.answers() if answer.waiting]
    waiting = [answer for answer in everything if not settings.marks.dropped_as(*answer.where)]
    if waiting:
        answers = plural(len(waiting), "{count} answer", "{count} answers")
        students = plural(len({answer.student for answer in waiting}), "{count} student", "{count} students")
        yield f"Still to be read by a person: {answers} of {students}; their pages say so."
    if len(waiting) < len(everything):
        yield _left_out(settings.marks)
    if asked := len(book.requests.all(open_only=True)):
        requests = plural(asked, "{count} request", "{count} requests")
        yield f"{requests} not answered yet ({program.name()} requests list)."
    opens = settings.feedback.opens
    if opens is not None and not settings.feedback.is_open(now):
        when = f"Feedback opens on {opens:%Y-%m-%d %H:%M %Z} (course.toml), and the pages say so and no more."
        yield f"{when} So nothing is given back: say {program.name()} publish again then."
