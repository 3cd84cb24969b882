"""Find what class-mates have in common: hints for an instructor, never a verdict. No mark depends on them.

Three things are compared: wrong numbers that fit a class-mate's bench, recordings with equal samples, and equal files.
Students who hand in together share a bench and are not compared with each other. Code and words are not compared.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from enum import StrEnum
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labcourse.answers import answers
from labcourse.benches import OWN, REAL
from labcourse.errors import AnswerError
from labcourse.files import ANSWERS_FILE, COURSE_FILE
from labcourse.grading.course import Course
from labcourse.grading.gradebook import Gradebook, Graded
from labcourse.grading.graded_run import facts_of, marking_job
from labcourse.grading.verdicts import Key, OwnBench, Status
from labcourse.student_id import caseless

Where = tuple[str, str]  # question and part
Samples = tuple[tuple[str, ...], NDArray[np.float64]]  # names of n channels, and their samples, shape (n, samples)

FEWEST_DIGITS = 3  #: significant digits of a number that may be taken for a class-mate's
FEWEST_TOGETHER = 2  #: wrong numbers that have to fit another bench, where none is a hint by itself
MOST_MATES = 2  #: class-mates whom a number may fit and still be a hint
#: A rounded number may be near another by chance: class-mates are counted in a neighbourhood this many times as wide.
NEIGHBOURHOOD = 10
SAME = 0.002  #: of a channel's largest sample: less than a step of a sensor
MOST_ALIKE = 5  #: students or groups who may have an equal file; more probably got it from the instructor
_EXACT = 1e-9  # relative; of numbers that were not rounded
_MATLAB, _HEAD = b"MATLAB 5.0 MAT-file", 128  # how such a file begins, and the bytes of its head with the date
_KIND, _BENCH = "recording", "bench"  # kind of an answer, and the metadata that any measured recording has
_NOTEBOOK = ".ipynb"


class About(StrEnum):
    """What is the same."""

    NUMBERS = "Answers that fit a class-mate's bench"
    MEASURED = "Measurements that several handed in"


@dataclass(frozen=True)
class Hint:
    """Something that class-mates have in common.

    Attributes
    ----------
    students : their IDs
    about : what is the same
    evidence : a sentence for instructors, which names the students
    """

    students: tuple[str, ...]
    about: About
    evidence: str


@dataclass(frozen=True)
class Measured:
    """The numbers that a student measured on their own bench.

    Attributes
    ----------
    student : the ID
    bench : the true value of each measured part, on the student's bench
    given : the student's answers
    right, wrong : parts that were marked so
    """

    student: str
    bench: Mapping[Where, float]
    given: Mapping[Where, float]
    right: frozenset[Where]
    wrong: frozenset[Where]


@dataclass(frozen=True)
class HandedIn:
    """The recordings and files that a student handed in.

    Attributes
    ----------
    student : the ID
    group : equal for all who hand in together
    recordings : part → its recordings, each channel scaled to a largest sample of 1
    files : digest → name of each file of the student's own
    """

    student: str
    group: str
    recordings: Mapping[Where, Sequence[Samples]] = field(default_factory=dict)
    files: Mapping[str, str] = field(default_factory=dict)


# --- the class --------------------------------------------------------------------------------------------------------


def of_class(book: Gradebook, course: Course) -> list[Hint]:
    """Compare all students of a gradebook, by the runs that count and by what they handed in last."""
    given = course.data.rglob("*") if course.data.is_dir() else ()
    handed_out = frozenset(digest(path.read_bytes()) for path in given if path.is_file())
    numbers: list[Measured] = []
    everybody: list[HandedIn] = []
    for graded in book.all_current():
        delivered = {one.name: one.content for one in book.delivered(graded.run.student)}
        numbers += filter(None, [measured(graded, course)])
        everybody.append(handed_in(graded, delivered, handed_out))
    return [
        *fitting_numbers(numbers, measured_parts(course.key)),
        *equal_recordings(everybody),
        *equal_files(everybody),
    ]


def by_students(hints: Iterable[Hint]) -> dict[tuple[str, ...], list[Hint]]:
    """Group hints by students; groups with more sorts of hints come first."""
    groups: dict[tuple[str, ...], list[Hint]] = {}
    for hint in hints:
        groups.setdefault(tuple(sorted(hint.students, key=caseless)), []).append(hint)
    sorts = {students: len({one.about for one in those}) for students, those in groups.items()}
    return dict(sorted(groups.items(), key=lambda item: (-sorts[item[0]], item[0])))


def as_markdown(hints: Iterable[Hint]) -> str:
    """Write the text of ``hints.md``."""
    lines = [
        "# What class-mates have in common\n\n"
        "**A hint, never a verdict.** Numbers that are wrong on a student's own bench may fit somebody else's by "
        "chance, above all in a large class, or through a name typed wrongly, or through help that you allow. Two who "
        "worked at one bench together have the same files; so has whoever took them from somebody. No mark depends on "
        "it. Ask before you conclude anything.\n"
    ]
    for students, those in by_students(hints).items():
        lines += [f"## {', '.join(students)}", "", *(f"* {one.evidence}" for one in those), ""]
    return "\n".join(lines)


# --- numbers that fit a class-mate's bench ----------------------------------------------------------------------------


def measured_parts(key: Key) -> dict[Where, OwnBench]:
    """List the parts that are measured on a student's own bench: those whose check has an ``own_bench``."""
    return {
        (question, part): own
        for question, parts in key.items()
        for part, check in parts.items()
        if (own := getattr(check, "own_bench", None)) is not None
    }


def measured(graded: Graded, course: Course) -> Measured | None:
    """Read a student's measured numbers from the run that counts; None where they cannot be read."""
    parts = measured_parts(course.key)
    asked = marking_job(graded.run)
    try:
        bench = course.true_bench(asked.student, asked.policy, asked.evidence)
        content = answers.parse(graded.run.answers or b"")["answers"]
        expected = {where: float(own.expected(bench)) for where, own in parts.items()}
        given = {where: number for where in parts if (number := _number(content, where)) is not None}
    except Exception:  # a fault of the course's own code, or an unknown bench: a hint is not worth losing a report
        return None
    status = {one.where: one.status for one in graded.marks}
    return Measured(
        graded.run.student,
        expected,
        given,
        frozenset(where for where in given if status.get(where) == Status.RIGHT),
        frozenset(where for where in given if status.get(where) == Status.WRONG),
    )


def _number(content: Mapping[str, Any], where: Where) -> float | None:
    question, part = where
    value = content.get(question, {}).get(part, {}).get("value")
    if isinstance(value, bool) or not isinstance(value, int | float) or not value or not math.isfinite(value):
        return None
    return float(value)


def fitting_numbers(everybody: Sequence[Measured], parts: Mapping[Where, OwnBench]) -> list[Hint]:
    """Find wrong numbers that are a class-mate's right ones, or that together fit a class-mate's bench.

    A number with few digits, and one that fits several class-mates, is no hint. Students with the same bench are not
    compared.

    Parameters
    ----------
    everybody : of the class
    parts : from :func:`measured_parts`
    """
    hints: list[Hint] = []
    for one in everybody:
        others = [other for other in everybody if other.bench != one.bench]
        for where in sorted(where for where in one.wrong if parts[where].is_discriminating):
            mates = _with_that_number(one, where, others)
            number = f"{_numbers({where: one.given[where]})} is wrong on their own bench, and the right answer of"
            hints += [_hint(one, mate, f"{number} {mate.student}") for mate in mates]
        if len(one.wrong) >= FEWEST_TOGETHER and not _fits(one, one, parts):
            mates = [other for other in others if _fits(one, other, parts)]
            if len(mates) <= MOST_MATES:
                numbers = _numbers(one.given)
                hints += [
                    _hint(one, mate, f"{numbers} fit the bench of {mate.student} together, and not their own")
                    for mate in mates
                ]
    return hints


def _with_that_number(one: Measured, where: Where, others: Sequence[Measured]) -> list[Measured]:
    """List class-mates whose right number is one's wrong number, to its digits; none if it may be chance."""
    value = one.given[where]
    digits = len(Decimal(str(value)).normalize().as_tuple().digits)
    half_a_digit = 10.0 ** (math.floor(math.log10(abs(value))) + 1 - digits) / 2
    room = max(half_a_digit * (1 + _EXACT), _EXACT * abs(value))
    near = [
        other for other in others if where in other.right and abs(other.given[where] - value) <= NEIGHBOURHOOD * room
    ]
    if digits < FEWEST_DIGITS or len(near) > MOST_MATES:
        return []
    return [other for other in near if abs(other.given[where] - value) <= room]


def _fits(one: Measured, mate: Measured, parts: Mapping[Where, OwnBench]) -> bool:
    """Decide whether all numbers of a student are near what another's bench gives."""
    return all(
        abs(value - mate.bench[where]) <= parts[where].rtol * abs(mate.bench[where])
        for where, value in one.given.items()
    )


def _numbers(given: Mapping[Where, float]) -> str:
    return ", ".join(f"{question} {part} = {value:g}" for (question, part), value in given.items())


def _hint(one: Measured, mate: Measured, what: str) -> Hint:
    return Hint((one.student, mate.student), About.NUMBERS, f"{one.student}: {what}.")


# --- recordings and files ---------------------------------------------------------------------------------------------


def handed_in(graded: Graded, delivered: Mapping[str, bytes], handed_out: Collection[str] = ()) -> HandedIn:
    """Gather a student's recordings and files.

    Recordings are those of the run that counts and of the ``answers.json`` that was handed in. Where the course gives
    all students one bench, equal samples say nothing, and no recording is gathered.

    Parameters
    ----------
    graded : the run that counts
    delivered : name → content of what was handed in last
    handed_out : digests (:func:`digest`) of files that all students were given
    """
    facts = facts_of(graded.run)
    recordings: dict[Where, list[Samples]] = {}
    if facts.policy is None or facts.policy.which in (OWN, REAL):
        for data in (graded.run.answers, delivered.get(ANSWERS_FILE)):
            for where, samples in _recordings(data):
                recordings.setdefault(where, []).append(samples)
    files = {
        known: name
        for name, content in sorted(delivered.items())
        # Notebooks that were not changed are equal, and so are the files that the course itself makes.
        if content and not name.endswith(_NOTEBOOK) and name not in (ANSWERS_FILE, COURSE_FILE)
        if (known := digest(content)) not in handed_out
    }
    group = caseless(facts.bench_of or graded.run.student)
    return HandedIn(graded.run.student, group, recordings, files)


def _recordings(data: bytes | None) -> Iterator[tuple[Where, Samples]]:
    try:
        content = answers.parse(data or b"")["answers"]
    except AnswerError:
        return
    for question, parts in content.items():
        for part, one in parts.items():
            if isinstance(one, Mapping) and one.get("kind") == _KIND and (samples := _samples(one)) is not None:
                yield (question, part), samples


def _samples(content: Mapping[str, Any]) -> Samples | None:
    """Read the scaled channels of a measured recording; None if it is none. A stranger wrote the content."""
    try:
        if not isinstance(content["metadata"][_BENCH], Mapping):
            return None
        names = tuple(sorted(content["channels"]))
        rows = np.array([content["channels"][name]["values"] for name in names], dtype=float)
    except (KeyError, TypeError, ValueError, OverflowError):
        return None
    if rows.ndim != 2 or not rows.size or not np.isfinite(rows).all() or not np.ptp(rows, axis=1).any():
        return None
    largest = np.abs(rows).max(axis=1, keepdims=True)
    return names, rows / np.where(largest > 0, largest, 1.0)


def digest(content: bytes) -> str:
    """Compute what equal files have in common; of a MATLAB file without its head, which has the date of writing."""
    return hashlib.sha256(content[_HEAD:] if content.startswith(_MATLAB) else content).hexdigest()


def equal_recordings(everybody: Sequence[HandedIn]) -> list[Hint]:
    """Find pairs of students, of different groups, with equal samples in the same part."""
    found: dict[tuple[str, str], list[str]] = {}
    for where in dict.fromkeys(where for one in everybody for where in one.recordings):
        for one, other in combinations((each for each in everybody if where in each.recordings), 2):
            if one.group != other.group and _same(one.recordings[where], other.recordings[where]):
                found.setdefault((one.student, other.student), []).append(" ".join(where))
    return [
        Hint(
            pair,
            About.MEASURED,
            f"{', '.join(pair)} have the same samples in {', '.join(places)}, though each has a bench of their own.",
        )
        for pair, places in found.items()
    ]


def _same(some: Iterable[Samples], others: Sequence[Samples]) -> bool:
    return any(
        names == theirs and rows.shape == samples.shape and bool((np.abs(rows - samples) <= SAME).all())
        for names, rows in some
        for theirs, samples in others
    )


def equal_files(everybody: Iterable[HandedIn]) -> list[Hint]:
    """Find students, of different groups, with equal files."""
    owners: dict[str, list[HandedIn]] = {}
    for one in everybody:
        for known in one.files:
            owners.setdefault(known, []).append(one)
    found: dict[tuple[str, ...], list[str]] = {}
    for known, those in owners.items():
        if 1 < len({one.group for one in those}) <= MOST_ALIKE:
            found.setdefault(tuple(one.student for one in those), []).append(those[0].files[known])
    return [Hint(students, About.MEASURED, _files_line(students, names)) for students, names in found.items()]


def _files_line(students: Iterable[str], names: Sequence[str]) -> str:
    files = "1 file" if len(names) == 1 else f"{len(names)} files"
    return f"{', '.join(students)} handed in the same {files}: {names[0]}{' and others' if names[1:] else ''}."
