"""A class at a glance, from its gradebook."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime

from rotflex.courseware.messages import _, plural
from rotflex.courseware.student_id import caseless
from rotflex.instructor.accounts.lateness import timing
from rotflex.instructor.course import Course
from rotflex.instructor.gradebook import Gradebook, Graded, StudentRecord
from rotflex.instructor.graded_run import facts_of
from rotflex.instructor.overview import published, slips, students, times, waiting
from rotflex.instructor.overview.section import Section, Table, moment
from rotflex.instructor.overview.students import Student
from rotflex.instructor.reports import same_work
from rotflex.instructor.reports.result import result_in
from rotflex.instructor.running.intake import is_unread


@dataclass(frozen=True)
class Glance:
    """A class at a glance.

    Attributes
    ----------
    title, term : of the course
    when : it was looked at
    sections : what there is to tell
    """

    title: str
    term: str
    when: datetime
    sections: tuple[Section, ...]

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
    notebooks = [path.name for path in course.notebooks]
    compared = same_work.Compared(course)
    everybody, now = [], datetime.now(UTC)
    for about in book.students():
        graded = book.current(about.student)
        everybody.append(_student(book, course, about, graded, now))
        if graded is not None:
            compared.add(graded, book.delivered(about.student))
    runs = [one.graded for one in everybody if one.graded is not None]
    answers, trail = book.scores.answers(), book.audit()
    sections = (
        students.handed_in(everybody, notebooks),
        students.in_trouble(everybody),
        waiting.for_persons(answers, titles),
        waiting.asked(answers),
        waiting.requests(book.requests.all()),
        waiting.faults(runs),
        slips.section(runs, titles),
        _same_work(compared.hints()),
        times.section(len(runs), trail, book.scores.acts(), answers),
        published.section(book.requests.publications(), trail),
    )
    return Glance(course.title, course.settings.term, now, sections)


def _student(book: Gradebook, course: Course, about: StudentRecord, graded: Graded | None, now: datetime) -> Student:
    """What there is of a student, and what came late or is missing after it was due."""
    notebooks = [path.name for path in course.notebooks]
    received = _received(book, about.student, graded, notebooks)
    problems = () if graded is None else graded.run.problems
    unread = tuple(name for name in notebooks if name not in received and is_unread(name, problems))
    account = None if graded is None else result_in(book, course, graded, about).account
    late = {} if account is None else {one.notebook: one.days for one in account.timings if one.days}
    if graded is not None and not received and not unread:
        return Student(about, graded)  # nobody knows when anything came
    missing = [name for name in course.catalogue.notebooks if f"{name}.ipynb" not in (*received, *unread)]
    # What is not there is overdue if it would be late now.
    would = ((name, timing(course.settings, about, name, now)) for name in missing)
    return Student(about, graded, received, unread, late, tuple(name for name, one in would if one and one.days))


def _received(book: Gradebook, student: str, graded: Graded | None, wanted: Sequence[str]) -> Mapping[str, datetime]:
    """When each notebook came. What is a student's by a partner's word alone is kept as the partner's."""
    partner = "" if graded is None else facts_of(graded.run).bench_of
    theirs = book.received(partner) if partner and caseless(partner) != caseless(student) else {}
    return {name: when for name, when in {**theirs, **book.received(student)}.items() if name in wanted}


def _same_work(found: Sequence[same_work.Hint]) -> Section:
    """What class-mates have in common."""
    groups = same_work.by_students(found)
    first = (
        _(
            "{groups} of students with something in common that hardly anybody else has. A hint, never a verdict."
        ).format(groups=plural(len(groups), _("group")))
        if groups
        else _("Nobody has anything in common that hardly anybody else has.")
    )
    more = (_("It may be chance, or help that you allow. No mark depends on it. Ask before you conclude anything."),)
    rows = tuple((", ".join(who), "\n".join(one.evidence for one in those)) for who, those in groups.items())
    table = Table((_("Students"), _("What they have in common")), rows)
    return Section(_("Hints of the same work"), first, more if groups else (), (table,))
