"""A class at a glance, from its gradebook."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime

from labcourse.grading.accounts.lateness import timing
from labcourse.grading.course import Course
from labcourse.grading.gradebook import Arrival, Gradebook, StudentRecord
from labcourse.grading.intake import is_unread
from labcourse.grading.overview import counted, published, slips, students, times, waiting
from labcourse.grading.overview.section import Section, Table, moment
from labcourse.grading.overview.students import Student
from labcourse.grading.reports import hints
from labcourse.grading.reports.result import received, result_in
from labcourse.messages import plural


@dataclass(frozen=True)
class Glance:
    """A class at a glance.

    Attributes
    ----------
    title, term : of the course
    when : it was looked at
    sections : what there is to tell
    left_out : what does not count, and so is not told, in a line; "" where nothing is
    """

    title: str
    term: str
    when: datetime
    sections: tuple[Section, ...]
    left_out: str = ""

    @property
    def about(self) -> str:
        """As "Control laboratory, 2026 autumn; 2026-03-02 12:00 UTC"."""
        return f"{', '.join(filter(None, (self.title, self.term)))}; {moment(self.when)}"


def at(book: Gradebook, course: Course) -> Glance:
    """What there is to tell of a class now.

    Parameters
    ----------
    book : its gradebook
    course : whose questions these are
    """
    titles = {number: question.title for number, question in course.catalogue.marked.items()}
    notebooks, counts = [path.name for path in course.notebooks], course.settings.marks
    now = datetime.now(UTC)
    everybody = [_student(book, course, about, now) for about in book.students()]
    runs = [one.graded for one in everybody if one.graded is not None]
    answers, trail = counted.of_answers(book.scores.answers(), counts), book.audit()
    sections = (
        students.handed_in(everybody, notebooks),
        students.in_trouble(everybody),
        waiting.for_persons(answers, titles),
        waiting.asked(answers),
        waiting.requests(book.requests.all()),
        waiting.faults(runs),
        slips.section(runs, titles),
        _in_common(hints.of_class(book, course)),
        times.section(len(runs), trail, book.scores.acts(), answers),
        published.section(book.requests.publications(), trail),
    )
    return Glance(course.title, course.settings.term, now, sections, counted.left_out(counts))


def _student(book: Gradebook, course: Course, about: StudentRecord, now: datetime) -> Student:
    """What there is of a student, and what came late or is missing after it was due; all of it as far as it counts."""
    graded, counts = book.current(about.student), course.settings.marks
    names = [path.name for path in course.notebooks]
    came = {name: arrival for name, arrival in received(book, about.student, graded).items() if name in names}
    problems = () if graded is None else graded.run.problems
    unread = tuple(name for name in names if name not in came and is_unread(name, problems))
    account = None if graded is None else result_in(book, course, graded, about).account
    late = {} if account is None else {one.notebook: one.days for one in account.timings if one.days}
    counting = None if graded is None else counted.of_run(graded, counts)
    if graded is not None and not came and not unread:
        return Student(about, counting)  # nobody knows when anything came
    due = counted.notebooks(course.asked, counts)
    missing = [name for name in due if f"{name}.ipynb" not in (*came, *unread)]
    # What is not there is overdue if it would be late now.
    would = ((name, timing(course.settings, about, name, Arrival(now))) for name in missing)
    return Student(about, counting, came, unread, late, tuple(name for name, one in would if one and one.days))


def _in_common(found: Sequence[hints.Hint]) -> Section:
    """Make the section of what class-mates have in common."""
    title, groups = "Hints of the same work", hints.by_students(found)
    rows = tuple((", ".join(who), "\n".join(one.evidence for one in those)) for who, those in groups.items())
    table = Table(("Students", "What they have in common"), rows)
    if not groups:
        return Section(title, "Nobody has the numbers, recordings or files of a class-mate.", (), (table,))
    count = plural(len(groups), "{count} group", "{count} groups")
    first = f"{count} of students with equal numbers, recordings or files. A hint, never a verdict."
    never = "It may be chance, or help that you allow. No mark depends on it. Ask before you conclude anything."
    return Section(title, first, (never,), (table,))
