"""Find what class-mates have in common: hints for an instructor, never a verdict. No mark depends on them.

Three things are compared: wrong numbers that fit a class-mate's bench, recordings with equal samples, and equal files.
Students who hand in together share a bench and are not compared with each other. Code and words are not compared.
"""

from __future__ import annotations

import hashlib
import math
from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from enum import StrEnum
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labcourse.answers import answers
from labcourse.benches import OWN, REAL
from labcourse.errors import AnswerError
from labcourse.files import ANSWERS_FILE, COURSE_FILE
from labcourse.grading.course import Course
from labcourse.grading.gradebook import Gradebook, Graded
from labcourse.grading.graded_run import answers_of, facts_of, marking_job
from labcourse.grading.reports.templating import templates
from labcourse.grading.verdicts import Key, OwnBench, Status
from labcourse.messages import plural
from labcourse.student_id import caseless

Where = tuple[str, str]  # question and part
Samples = tuple[tuple[str, ...], NDArray[np.float32]]  # names of n channels, and their samples, shape (n, samples)

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
_DECIDED = (Status.RIGHT, Status.WRONG)


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
class Work:
    """What is compared of a student.

    Attributes
    ----------
    student : the ID
    group : equal for all who hand in together
    bench : the true value of each measured part, on the student's bench; empty where it cannot be known
    given : the student's answers to these parts
    right, wrong : parts that were marked so
    recordings : part → its recordings, each channel scaled to a largest sample of 1
    files : digest → name of each file of the student's own
    """

    student: str
    group: str = ""
    bench: Mapping[Where, float] = field(default_factory=dict)
    given: Mapping[Where, float] = field(default_factory=dict)
    right: frozenset[Where] = frozenset()
    wrong: frozenset[Where] = frozenset()
    recordings: Mapping[Where, Sequence[Samples]] = field(default_factory=dict)
    files: Mapping[str, str] = field(default_factory=dict)


# --- the class --------------------------------------------------------------------------------------------------------


def works(book: Gradebook, course: Course) -> Callable[[Graded], Work]:
    """Return a function that gathers what is compared of a student, from the run that counts."""
    given = course.data.rglob("*") if course.data.is_dir() else ()
    handed_out = frozenset(digest(path.read_bytes()) for path in given if path.is_file())

    def work(graded: Graded) -> Work:
        delivered = {file.name: file.content for file in book.delivered(graded.run.student, notebooks=False)}
        return replace(handed_in(graded, delivered, handed_out), **measured(graded, course))

    return work


def compared(everybody: Sequence[Work], course: Course) -> list[Hint]:
    """Compare all students of a class."""
    by_numbers = fitting_numbers(everybody, measured_parts(course.key))
    return [*by_numbers, *equal_recordings(everybody), *equal_files(everybody)]


def by_students(hints: Iterable[Hint]) -> dict[tuple[str, ...], list[Hint]]:
    """Group hints by students; groups with more sorts of hints come first."""
    groups: dict[tuple[str, ...], list[Hint]] = defaultdict(list)
    for hint in hints:
        groups[tuple(sorted(hint.students, key=caseless))].append(hint)
    return dict(sorted(groups.items(), key=lambda group: (-len({hint.about for hint in group[1]}), group[0])))


def as_markdown(hints: Iterable[Hint]) -> str:
    """Write the text of ``hints.md``."""
    return templates().get_template("hints.md").render(groups=by_students(hints))


def read(path: Path) -> dict[tuple[str, ...], list[str]]:
    """Return students → evidence, as ``hints.md`` has them; nothing without the file."""
    found: dict[tuple[str, ...], list[str]] = {}
    for line in path.read_text(encoding="utf-8").splitlines() if path.exists() else ():
        if line.startswith("## "):
            found[tuple(line.removeprefix("## ").split(", "))] = []
        elif line.startswith("* ") and found:
            found[next(reversed(found))].append(line.removeprefix("* "))
    return found


# --- numbers that fit a class-mate's bench ----------------------------------------------------------------------------


def measured_parts(key: Key) -> dict[Where, OwnBench]:
    """List the parts that are measured on a student's own bench: those whose check has an ``own_bench``."""
    checks = {(question, part): check for question, parts in key.items() for part, check in parts.items()}
    benches = {where: getattr(check, "own_bench", None) for where, check in checks.items()}
    return {where: own for where, own in benches.items() if own is not None}


def measured(graded: Graded, course: Course) -> dict[str, Any]:
    """Read a student's measured numbers from the run that counts, as fields of :class:`Work`; none if unreadable."""
    parts = measured_parts(course.key)
    job = marking_job(graded.run)
    try:
        bench = course.true_bench(job.student, job.policy, job.evidence)
        content = answers_of(graded.run)["answers"]
        expected = {where: float(own.expected(bench)) for where, own in parts.items()}
        numbers = {where: content.get(where[0], {}).get(where[1], {}).get("value") for where in parts}
        given = {where: float(number) for where, number in numbers.items() if _is_number(number)}
    except Exception:  # a fault of the course's own code, or an unknown bench: a hint is not worth losing a report
        return {}
    status = {mark.where: mark.status for mark in graded.marks}
    right, wrong = (frozenset(where for where in given if status.get(where) == one) for one in _DECIDED)
    return {"bench": expected, "given": given, "right": right, "wrong": wrong}


def _is_number(value: object) -> bool:
    return type(value) in (int, float) and bool(value) and math.isfinite(value)  # type: ignore[arg-type]


def fitting_numbers(everybody: Sequence[Work], parts: Mapping[Where, OwnBench]) -> list[Hint]:
    """Find wrong numbers that are a class-mate's right ones, or that together fit a class-mate's bench.

    A number with few digits, and one that fits several class-mates, is no hint. Students with the same bench are not
    compared.

    Parameters
    ----------
    everybody : of the class
    parts : from :func:`measured_parts`
    """
    return [hint for student in everybody for hint in _fitting(student, everybody, parts)]


def _fitting(student: Work, everybody: Iterable[Work], parts: Mapping[Where, OwnBench]) -> Iterator[Hint]:
    others = [mate for mate in everybody if mate.bench and mate.bench != student.bench]
    for where in sorted(where for where in student.wrong if parts[where].is_discriminating):
        number = _numbers({where: student.given[where]})
        for mate in _with_that_number(student, where, others):
            yield _hint(student, mate, f"{number} is wrong on their own bench, and the right answer of {mate.student}")
    if len(student.wrong) >= FEWEST_TOGETHER and not _fits(student, student, parts):
        mates = [mate for mate in others if _fits(student, mate, parts)]
        for mate in mates if len(mates) <= MOST_MATES else ():
            together = f"{_numbers(student.given)} fit the bench of {mate.student} together, and not their own"
            yield _hint(student, mate, together)


def _with_that_number(student: Work, where: Where, others: Sequence[Work]) -> list[Work]:
    """List class-mates whose right number is a student's wrong number, to its digits; none if it may be chance."""
    value = student.given[where]
    digits = len(Decimal(str(value)).normalize().as_tuple().digits)
    half_a_digit = 10.0 ** (math.floor(math.log10(abs(value))) + 1 - digits) / 2
    room = max(half_a_digit * (1 + _EXACT), _EXACT * abs(value))
    away = [(abs(mate.given[where] - value), mate) for mate in others if where in mate.right]
    near = [mate for distance, mate in away if distance <= NEIGHBOURHOOD * room]
    if digits < FEWEST_DIGITS or len(near) > MOST_MATES:
        return []
    return [mate for distance, mate in away if distance <= room]


def _fits(student: Work, mate: Work, parts: Mapping[Where, OwnBench]) -> bool:
    """Decide whether all numbers of a student are near what another's bench gives."""
    return all(
        math.isclose(value, mate.bench[where], rel_tol=0, abs_tol=parts[where].rtol * abs(mate.bench[where]))
        for where, value in student.given.items()
    )


def _numbers(given: Mapping[Where, float]) -> str:
    return ", ".join(f"{question} {part} = {value:g}" for (question, part), value in given.items())


def _hint(student: Work, mate: Work, what: str) -> Hint:
    return Hint((student.student, mate.student), About.NUMBERS, f"{student.student}: {what}.")


# --- recordings and files ---------------------------------------------------------------------------------------------


def handed_in(graded: Graded, delivered: Mapping[str, bytes], handed_out: Collection[str] = ()) -> Work:
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
    recordings: dict[Where, list[Samples]] = defaultdict(list)
    if facts.policy is None or facts.policy.which in (OWN, REAL):
        for content in (answers_of(graded.run), _at_home(delivered.get(ANSWERS_FILE))):
            for where, samples in _recordings(content.get("answers", {})):
                if not any(_is_equal(samples, known) for known in recordings[where]):
                    recordings[where].append(samples)
    files = {
        digest(content): name
        for name, content in sorted(delivered.items())
        # Notebooks that were not changed are equal, and so are the files that the course itself makes.
        if content and not name.endswith(_NOTEBOOK) and name not in (ANSWERS_FILE, COURSE_FILE)
    }
    own = {known: name for known, name in files.items() if known not in handed_out}
    group = caseless(facts.bench_of or graded.run.student)
    return Work(graded.run.student, group, recordings=recordings, files=own)


def _at_home(data: bytes | None) -> dict[str, Any]:
    """Return the content of the ``answers.json`` that was handed in; nothing if it cannot be read."""
    try:
        return answers.parse(data or b"")
    except AnswerError:
        return {}


def _recordings(content: Mapping[str, Mapping[str, Any]]) -> Iterator[tuple[Where, Samples]]:
    """Yield the scaled channels of each measured recording in answers. They are untrusted."""
    for question, parts in content.items():
        for part, answer in parts.items():
            if isinstance(answer, Mapping) and answer.get("kind") == _KIND:
                samples = _samples(answer)
                if samples is not None:
                    yield (question, part), samples


def _samples(content: Mapping[str, Any]) -> Samples | None:
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
    return names, (rows / np.where(largest > 0, largest, 1.0)).astype(np.float32)


def digest(content: bytes) -> str:
    """Compute what equal files have in common; of a MATLAB file without its head, which has the date of writing."""
    return hashlib.sha256(content[_HEAD:] if content.startswith(_MATLAB) else content).hexdigest()


def equal_recordings(everybody: Sequence[Work]) -> list[Hint]:
    """Find pairs of students, of different groups, with equal samples in the same part."""
    places: dict[tuple[str, str], list[str]] = defaultdict(list)
    for where in dict.fromkeys(where for student in everybody for where in student.recordings):
        # Samples that are the same have nearly the same mean: only neighbours by their mean are compared.
        means = [
            (float(rows.mean()), place, (names, rows))
            for place, student in enumerate(everybody)
            for names, rows in student.recordings.get(where, ())
        ]
        means.sort(key=lambda entry: entry[:2])
        alike = set()
        for start, (mean, one, samples) in enumerate(means, 1):
            for another, other, others in islice(means, start, None):
                if another - mean > 2 * SAME:
                    break
                if _same([samples], [others]):
                    alike.add((min(one, other), max(one, other)))
        for pair in sorted(alike):
            first, second = (everybody[place] for place in pair)
            if first.group != second.group:
                places[first.student, second.student].append(" ".join(where))
    text = "{} have the same samples in {}, though each has a bench of their own."
    return [Hint(pair, About.MEASURED, text.format(", ".join(pair), ", ".join(of))) for pair, of in places.items()]


def _is_equal(samples: Samples, other: Samples) -> bool:
    return samples[0] == other[0] and np.array_equal(samples[1], other[1])


def _same(some: Iterable[Samples], others: Sequence[Samples]) -> bool:
    return any(
        names == theirs and rows.shape == samples.shape and bool((np.abs(rows - samples) <= SAME).all())
        for names, rows in some
        for theirs, samples in others
    )


def equal_files(everybody: Iterable[Work]) -> list[Hint]:
    """Find students, of different groups, with equal files."""
    owners: dict[str, list[Work]] = defaultdict(list)
    for student in everybody:
        for known in student.files:
            owners[known].append(student)
    names: dict[tuple[str, ...], list[str]] = defaultdict(list)
    for known, those in owners.items():
        if 1 < len({student.group for student in those}) <= MOST_ALIKE:
            names[tuple(student.student for student in those)].append(those[0].files[known])
    text = "{} handed in the same {}: {}."
    return [
        Hint(students, About.MEASURED, text.format(", ".join(students), *_counted(files)))
        for students, files in names.items()
    ]


def _counted(files: Sequence[str]) -> tuple[str, str]:
    return plural(len(files), "1 file", "{count} files"), files[0] + (" and others" if files[1:] else "")
