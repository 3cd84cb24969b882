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

from collections.abc import Collection, Iterable
from dataclasses import dataclass
from enum import StrEnum

from rotflex.courseware.files import ANSWERS_FILE
from rotflex.courseware.messages import _
from rotflex.courseware.student_id import caseless
from rotflex.errors import RotflexError
from rotflex.instructor.course import Course
from rotflex.instructor.gradebook import Gradebook
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


@dataclass(frozen=True)
class Found:
    """What a class has in common.

    Attributes
    ----------
    hints : in the order of what is the same
    left_out : what was not compared, and why; "" where all was
    """

    hints: tuple[Hint, ...]
    left_out: str = ""


def of_class(book: Gradebook, course: Course) -> Found:
    """What the students in a gradebook have in common, by their runs that count and what they handed in last."""
    given, left_out = _handed_out(course)
    data = _data(course)
    answered: list[similar.Student] = []
    measured: list[shared_files.Measured] = []
    recorded: list[same_recordings.Recorded] = []
    coders: list[Author] = []
    writers: list[Author] = []
    for graded in book.all_current():
        student = graded.run.student
        content = {one.name: one.content for one in book.delivered(student)}
        group = caseless(facts_of(graded.run).bench_of or student)
        answered += filter(None, [similar.student(graded, course)])
        measured.append(shared_files.measured(graded, content, data))
        recorded.append(same_recordings.recorded(graded, group, content.get(ANSWERS_FILE)))
        if given is not None:
            coders.append(same_code.coder(student, group, content, given))
            writers.append(same_code.writer(student, group, words_of(graded.run)))
    numbers = similar.hints(answered, similar.measured_parts(course.key))
    same = [*same_recordings.hints(recorded), *shared_files.hints(measured)]
    code, words = ([], []) if given is None else (same_code.in_code(coders, given), same_code.in_words(writers, given))
    hints = (
        *(Hint(one.students, About.NUMBERS, str(one)) for one in numbers),
        *(Hint(students, About.MEASURED, line) for students, line in same),
        *(Hint(one.students, About.CODE, same_code.told(one, of_code=True)) for one in code),
        *(Hint(one.students, About.WORDS, same_code.told(one, of_code=False)) for one in words),
    )
    return Found(hints, left_out)


def _handed_out(course: Course) -> tuple[same_code.HandedOut | None, str]:
    """What students were given; or None, and in words what that costs: all that was given would be in common."""
    try:
        solutions = [path.read_bytes() for path in course.notebooks]
        notebooks = [text.encode() for text in student_course.derived(course).values()]
    except (RotflexError, OSError) as error:
        return None, _(
            "Code and words were not compared, as it is not known what was handed out, which all have in common: {why} "
            "Mend that, and say rotflex report."
        ).format(why=error)
    return same_code.HandedOut(notebooks, solutions), ""


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


def text(found: Found) -> str:
    """The file for instructors."""
    head = _(
        "# What class-mates have in common\n\n"
        "**A hint, never a verdict.** Numbers that are wrong on a student's own bench may fit somebody else's by "
        "chance, above all in a large class, or through a name typed wrongly, or through help that you allow. Two who "
        "worked at one bench together have the same files; so has whoever took them from somebody. Code and words may "
        "come from one book, or from working together. No mark depends on it. Ask before you conclude anything.\n"
    )
    lines = [head, *([f"{found.left_out}\n"] if found.left_out else [])]
    for students, those in by_students(found.hints).items():
        lines += [f"## {', '.join(students)}", "", *(f"* {one.evidence}" for one in those), ""]
    return "\n".join(lines)
