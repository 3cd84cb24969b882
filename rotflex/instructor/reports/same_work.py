"""What class-mates have in common, in one list with its evidence: hints for an instructor, and never a verdict.

===========================  ===========================================================================================
:mod:`.similar`              numbers that fit a class-mate's bench
:mod:`.shared_files`         the same files
:mod:`.same_recordings`      the same samples
:mod:`.same_code`            code, and words, that hardly anybody else has
===========================  ===========================================================================================

Each pair or group of students has one entry. Whoever hands in together is left out.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum

from rotflex.courseware.files import ANSWERS_FILE
from rotflex.courseware.messages import _
from rotflex.courseware.student_id import caseless
from rotflex.errors import RotflexError
from rotflex.instructor.course import Course
from rotflex.instructor.gradebook import Delivery, Gradebook, Graded
from rotflex.instructor.graded_run import facts_of, words_of
from rotflex.instructor.release import student_course
from rotflex.instructor.reports import same_code, same_recordings, shared_files, similar
from rotflex.instructor.reports.overlaps import Author


class About(StrEnum):
    """What is the same."""

    NUMBERS = _("Answers that fit a class-mate's bench")
    MEASURED = _("Measurements that several handed in")
    CODE = _("Code that two have in common and hardly anybody else")
    WORDS = _("Words that two have in common and hardly anybody else")


@dataclass(frozen=True)
class Hint:
    """Something that class-mates have in common.

    Attributes
    ----------
    students : who, by ID
    about : what is the same
    evidence : a line for people, which names them
    """

    students: tuple[str, ...]
    about: About
    evidence: str


class Compared:
    """A class's work, as it is compared. Add everybody, then ask for the :meth:`hints`.

    Parameters
    ----------
    course : whose questions these are
    """

    def __init__(self, course: Course) -> None:
        self._course = course
        self._given = _handed_out(course)
        self._data = _data(course)
        self._answered: list[similar.Student] = []
        self._files: list[shared_files.Measured] = []
        self._recorded: list[same_recordings.Recorded] = []
        self._coders: list[Author] = []
        self._writers: list[Author] = []

    def add(self, graded: Graded, delivered: Iterable[Delivery]) -> None:
        """A student's run that counts, and what they handed in last."""
        student, content = graded.run.student, {one.name: one.content for one in delivered}
        group = caseless(facts_of(graded.run).bench_of or student)
        self._answered += filter(None, [similar.student(graded, self._course)])
        self._files.append(shared_files.measured(graded, content, self._data))
        self._recorded.append(same_recordings.recorded(graded, group, content.get(ANSWERS_FILE)))
        self._coders.append(same_code.coder(student, group, content, self._given))
        self._writers.append(same_code.writer(student, group, words_of(graded.run)))

    def hints(self) -> list[Hint]:
        """What they have in common."""
        numbers = similar.hints(self._answered, similar.measured_parts(self._course.key))
        same = [*same_recordings.hints(self._recorded), *shared_files.hints(self._files)]
        code = same_code.in_code(self._coders, self._given)
        words = same_code.in_words(self._writers, self._given)
        return [
            *(Hint(one.students, About.NUMBERS, str(one)) for one in numbers),
            *(Hint(students, About.MEASURED, line) for students, line in same),
            *(Hint(one.students, About.CODE, same_code.told(one, of_code=True)) for one in code),
            *(Hint(one.students, About.WORDS, same_code.told(one, of_code=False)) for one in words),
        ]


def of_class(book: Gradebook, course: Course) -> list[Hint]:
    """What the students in a gradebook have in common."""
    compared = Compared(course)
    for graded in book.all_current():
        compared.add(graded, book.delivered(graded.run.student))
    return compared.hints()


def _handed_out(course: Course) -> same_code.HandedOut:
    try:
        solutions = [path.read_bytes() for path in course.notebooks]
        return same_code.HandedOut([text.encode() for text in student_course.derived(course).values()], solutions)
    except (RotflexError, OSError):  # a fault of the course is told where it is released, and is not worth a report
        return same_code.HandedOut([])


def _data(course: Course) -> Collection[str]:
    """Digests of the files that may be handed out with the notebooks."""
    there = course.data.rglob("*") if course.data.is_dir() else ()
    return frozenset(shared_files.digest(path.read_bytes()) for path in there if path.is_file())


def by_students(found: Iterable[Hint]) -> dict[tuple[str, ...], list[Hint]]:
    """Each pair or group of students, with what they have in common; those with the most sorts of it first."""
    groups: dict[tuple[str, ...], list[Hint]] = {}
    for hint in found:
        groups.setdefault(tuple(sorted(hint.students, key=caseless)), []).append(hint)
    sorts = {who: len({one.about for one in those}) for who, those in groups.items()}
    return dict(sorted(groups.items(), key=lambda item: (-sorts[item[0]], item[0])))


def text(found: Sequence[Hint]) -> str:
    """The file for instructors."""
    head = _(
        "# What class-mates have in common\n\n"
        "**A hint, never a verdict.** Numbers that are wrong on a student's own bench may fit somebody else's by "
        "chance, above all in a large class, or through a name typed wrongly, or through help that you allow. Two who "
        "worked at one bench together have the same files; so has whoever took them from somebody. Code and words may "
        "come from one book, or from working together. No mark depends on it. Ask before you conclude anything.\n"
    )
    lines = [head]
    for students, those in by_students(found).items():
        lines += [f"## {', '.join(students)}", "", *(f"* {one.evidence}" for one in those), ""]
    return "\n".join(lines)
