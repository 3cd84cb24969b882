"""Find what class-mates have in common: hints for an instructor, never a verdict. No mark depends on them.

Three things are compared: wrong numbers that fit a class-mate's bench, recordings with equal samples, and equal files.
Students who hand in together share a bench and are not compared with each other. Code and words are not compared.

To compare a class takes time: all answers and files are read. So hints are stored as data, in ``hints.json``, for pages
that show them. ``hints.md`` beside it is for instructors, and nothing reads it.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from labcourse import program
from labcourse.answers import answers
from labcourse.benches import OWN, REAL
from labcourse.errors import GradingError
from labcourse.files import ANSWERS_FILE, COURSE_FILE
from labcourse.grading.counting import bench_of
from labcourse.grading.course import Course
from labcourse.grading.gradebook import Gradebook, Graded
from labcourse.grading.graded_run import answers_of, submission_of
from labcourse.grading.marks import Status
from labcourse.grading.reports.templating import templates
from labcourse.grading.verdicts import Key, OwnBench
from labcourse.messages import number_of
from labcourse.problems import Where
from labcourse.safe_text import no_escapes
from labcourse.student_id import HINTS_DATA_FILE, HINTS_FILE, caseless

DIGITS = 3  #: a number with no more significant digits may be equal to a class-mate's by chance
FEWEST_TOGETHER = 2  #: wrong numbers that have to fit another bench, where none is a hint by itself
MOST_MATES = 2  #: class-mates whom a number may fit and still be a hint
MOST_ALIKE = 5  #: students or groups who may have an equal file; more probably got it from the instructor


class Likeness(StrEnum):
    """What is the same."""

    RIGHT_ELSEWHERE = "right_elsewhere"
    FITS_BENCH = "fits_bench"
    RECORDINGS = "recordings"
    FILES = "files"


@dataclass(frozen=True)
class Hint:
    """Something that class-mates have in common.

    Attributes
    ----------
    kind : what is the same
    students : their IDs; of numbers, the student who gave them and the class-mate whom they fit
    names : of the answers, recordings or files that are the same
    values : the numbers, one for each name; none of recordings and files
    """

    kind: Likeness
    students: tuple[str, ...]
    names: tuple[str, ...]
    values: tuple[float, ...] = ()

    @property
    def sort(self) -> str:
        """The sort of likeness, by which hints are counted."""
        return "Answers that fit a class-mate's bench" if self.values else "Measurements that several handed in"

    @property
    def evidence(self) -> str:
        """A sentence for instructors, which names the students."""
        first, last, everybody = self.students[0], self.students[-1], ", ".join(self.students)
        numbers = ", ".join(f"{name} = {value:g}" for name, value in zip(self.names, self.values, strict=False))
        match self.kind:
            case Likeness.RIGHT_ELSEWHERE:
                return f"{first}: {numbers} is wrong on their own bench, and the right answer of {last}."
            case Likeness.FITS_BENCH:
                return f"{first}: {numbers} fit the bench of {last} together, and not their own."
            case Likeness.RECORDINGS:
                names = ", ".join(self.names)
                return f"{everybody} have the same samples in {names}, though each has a bench of their own."
            case Likeness.FILES:
                others = " and others" if self.names[1:] else ""
                return f"{everybody} handed in the same {number_of(len(self.names), 'file')}: {self.names[0]}{others}."


_STORED = TypeAdapter(list[Hint])


@dataclass(frozen=True)
class ComparedWork:
    """What is compared of a student.

    Attributes
    ----------
    student : the ID
    group : equal for all who hand in together
    bench : the true value of each measured part, on the student's bench; empty where it cannot be known
    given : the student's answers to these parts
    right, wrong : parts that were marked so
    recordings : digest → question and part of each recording
    files : digest → name of each file of the student's own
    """

    student: str
    group: str = ""
    bench: Mapping[Where, float] = field(default_factory=dict)
    given: Mapping[Where, float] = field(default_factory=dict)
    right: frozenset[Where] = frozenset()
    wrong: frozenset[Where] = frozenset()
    recordings: Mapping[str, str] = field(default_factory=dict)
    files: Mapping[str, str] = field(default_factory=dict)


# --- the class --------------------------------------------------------------------------------------------------------


def works(book: Gradebook, course: Course) -> Callable[[Graded], ComparedWork]:
    """Return a function that gathers what is compared of a student, from the run that counts.

    Files that the course hands out are read at once; raises OSError if one cannot be read.
    """
    given = course.data.rglob("*") if course.data.is_dir() else ()
    handed_out = frozenset(digest(path.read_bytes()) for path in given if path.is_file())

    def work(graded: Graded) -> ComparedWork:
        # Notebooks that were not changed are equal.
        delivered = {file.name: file.content for file in book.delivered(graded.run.student, notebooks=False)}
        return replace(handed_in(graded, delivered, handed_out), **measured(graded, course))

    return work


def compared(everybody: Sequence[ComparedWork], course: Course) -> list[Hint]:
    """Compare all students of a class."""
    by_numbers = fitting_numbers(everybody, measured_parts(course.key))
    return [*by_numbers, *equal_recordings(everybody), *equal_files(everybody)]


def by_students(hints: Iterable[Hint]) -> dict[tuple[str, ...], list[Hint]]:
    """Return students (IDs in order) → their hints; groups with more sorts of hints come first, then by ID."""
    groups: dict[tuple[str, ...], list[Hint]] = defaultdict(list)
    for hint in hints:
        groups[tuple(sorted(hint.students, key=caseless))].append(hint)
    return dict(sorted(groups.items(), key=lambda group: (-len({hint.sort for hint in group[1]}), group[0])))


def as_files(hints: Sequence[Hint]) -> dict[str, str]:
    """Return name → content of the files in the folder of results: the page, and the data that :func:`read` reads."""
    page = templates().get_template("hints.md").render(groups=by_students(hints))
    data = json.dumps(_STORED.dump_python([*hints], mode="json"), indent=1)
    return {HINTS_FILE: no_escapes(page), HINTS_DATA_FILE: f"{data}\n"}


def read(folder: Path) -> list[Hint]:
    """Read the hints in a folder of results; none if none were written.

    Raises
    ------
    GradingError
        If the file cannot be read, or holds something else.
    """
    path = folder / HINTS_DATA_FILE
    try:
        return _STORED.validate_json(path.read_bytes()) if path.exists() else []
    except (OSError, ValueError):
        raise GradingError(f"{path} cannot be read: delete it; {program.name()} report writes it anew.") from None


# --- numbers that fit a class-mate's bench ----------------------------------------------------------------------------


def measured_parts(key: Key) -> dict[Where, OwnBench]:
    """List the parts that are measured on a student's own bench: those whose check has an ``own_bench``."""
    checks = {(question, part): check for question, parts in key.items() for part, check in parts.items()}
    benches = {where: getattr(check, "own_bench", None) for where, check in checks.items()}
    return {where: own for where, own in benches.items() if own is not None}


def measured(graded: Graded, course: Course) -> dict[str, Any]:
    """Read a student's measured numbers from the run that counts, as fields of :class:`ComparedWork`.

    Return no fields if the course's own code fails, or the bench is not known.
    """
    parts = measured_parts(course.key)
    submission = submission_of(graded.run)
    try:
        about, run = (submission.policy, submission.evidence), graded.run
        content = answers_of(run)["answers"]
        owners = {where: bench_of(run, course.notebook_of(where[0])) for where in parts}
        benches = {owner: course.true_bench(owner, *about) for owner in owners.values()}
        expected = {where: float(own.expected(benches[owners[where]])) for where, own in parts.items()}
        numbers = {where: content.get(where[0], {}).get(where[1], {}).get("value") for where in parts}
        given = {where: float(number) for where, number in numbers.items() if _is_number(number)}
    except Exception:  # a fault of the course's own code, or an unknown bench: a hint is not worth losing a report
        return {}
    status = {mark.where: mark.status for mark in graded.marks}
    right = frozenset(where for where in given if status.get(where) == Status.RIGHT)
    wrong = frozenset(where for where in given if status.get(where) == Status.WRONG)
    return {"bench": expected, "given": given, "right": right, "wrong": wrong}


def _is_number(value: object) -> bool:
    """Return whether a value is a finite number other than 0; True and False are none."""
    return type(value) in (int, float) and bool(value) and math.isfinite(value)  # type: ignore[arg-type]


def fitting_numbers(everybody: Sequence[ComparedWork], parts: Mapping[Where, OwnBench]) -> list[Hint]:
    """Find wrong numbers that are a class-mate's right ones, or that together fit a class-mate's bench.

    What fits several class-mates is no hint.

    Parameters
    ----------
    everybody : of the class
    parts : from :func:`measured_parts`
    """
    return [
        Hint(kind, (student.student, mate.student), tuple(map(" ".join, numbers)), tuple(numbers.values()))
        for student in everybody
        for kind, numbers, mates in _fitting(student, everybody, parts)
        if len(mates) <= MOST_MATES
        for mate in mates
    ]


def _fitting(
    student: ComparedWork, everybody: Sequence[ComparedWork], parts: Mapping[Where, OwnBench]
) -> Iterator[tuple[Likeness, Mapping[Where, float], list[ComparedWork]]]:
    """Yield kind of a hint, numbers of a student by part, and the class-mates, perhaps none, whom they fit.

    Class-mates on the same bench, or on one that is not known, are left out. A wrong number is compared with right
    answers if it has more than ``DIGITS`` significant digits and its part is discriminating. All numbers together are
    compared with a class-mate's bench if at least ``FEWEST_TOGETHER`` are wrong and they do not fit the student's own.
    """
    others = [mate for mate in everybody if mate.bench and mate.bench != student.bench]
    for where in sorted(where for where in student.wrong if parts[where].is_discriminating):
        value = student.given[where]
        if value != float(f"{value:.{DIGITS}g}"):
            mates = [mate for mate in others if where in mate.right and mate.given[where] == value]
            yield Likeness.RIGHT_ELSEWHERE, {where: value}, mates
    if len(student.wrong) >= FEWEST_TOGETHER and not _fits(student, student, parts):
        yield Likeness.FITS_BENCH, student.given, [mate for mate in others if _fits(student, mate, parts)]


def _fits(student: ComparedWork, mate: ComparedWork, parts: Mapping[Where, OwnBench]) -> bool:
    """Decide whether all numbers of a student are near what another's bench gives."""
    return all(
        math.isclose(value, mate.bench[where], rel_tol=0, abs_tol=parts[where].rtol * abs(mate.bench[where]))
        for where, value in student.given.items()
    )


# --- recordings and files ---------------------------------------------------------------------------------------------


def handed_in(graded: Graded, delivered: Mapping[str, bytes], handed_out: Collection[str] = ()) -> ComparedWork:
    """Gather a student's recordings and files.

    Recordings are those of the run that counts and of the ``answers.json`` that was handed in. Where the course gives
    all students one bench, equal samples say nothing, and no recording is gathered.

    Parameters
    ----------
    graded : the run that counts
    delivered : name → content of what was handed in last, but notebooks
    handed_out : digests (:func:`digest`) of files that all students were given
    """
    submission = submission_of(graded.run)
    recordings: dict[str, str] = {}
    if submission.policy is None or submission.policy.which in (OWN, REAL):
        for content in (answers_of(graded.run), answers.content_of(delivered.get(ANSWERS_FILE))):
            recordings |= dict(_recordings(content))
    files = {
        digest(content): name
        for name, content in sorted(delivered.items())
        if content and name not in (ANSWERS_FILE, COURSE_FILE)  # which the course itself makes
    }
    own = {known: name for known, name in files.items() if known not in handed_out}
    group = caseless(submission.bench_of)
    return ComparedWork(graded.run.student, group, recordings=recordings, files=own)


def _recordings(content: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield digest and place of each measured recording in an ``answers.json``. It is untrusted."""
    for where, answer in answers.by_part(content).items():
        if answer.get("kind") == "recording" and (samples := _samples(answer)):
            yield digest(samples), " ".join(where)


def _samples(content: Mapping[str, Any]) -> bytes:
    """Return what equal recordings have in common; empty where nothing was measured, or nothing moved."""
    try:
        values = {name: channel["values"] for name, channel in content["channels"].items()}
        is_of_bench = isinstance(content["metadata"]["bench"], Mapping)  # as of all that is measured
        moves = any(len(set(samples)) > 1 for samples in values.values())
    except (AttributeError, KeyError, TypeError):
        return b""
    return json.dumps(values, sort_keys=True).encode() if is_of_bench and moves else b""


def digest(content: bytes) -> str:
    """Compute what equal files have in common."""
    return hashlib.sha256(content).hexdigest()


def equal_recordings(everybody: Sequence[ComparedWork]) -> list[Hint]:
    """Find students, of different groups, with recordings of equal samples."""
    return _shared(Likeness.RECORDINGS, [(one, one.recordings) for one in everybody], len(everybody))


def equal_files(everybody: Sequence[ComparedWork]) -> list[Hint]:
    """Find students, of different groups, with equal files."""
    return _shared(Likeness.FILES, [(one, one.files) for one in everybody], MOST_ALIKE)


def _shared(kind: Likeness, having: Iterable[tuple[ComparedWork, Mapping[str, str]]], most: int) -> list[Hint]:
    """Return a hint for each set of students of at least two groups who share something, with the names of all of it.

    Parameters
    ----------
    kind : of the hints
    having : each student, with digest → name of what they have
    most : groups that may have the same; what more of them have is no hint
    """
    owners = defaultdict[str, list[ComparedWork]](list)
    names: dict[str, str] = {}
    for student, theirs in having:
        for known, name in theirs.items():
            owners[known].append(student)
            names.setdefault(known, name)
    shared = defaultdict[tuple[str, ...], list[str]](list)
    for known, those in owners.items():
        if 1 < len({student.group for student in those}) <= most:
            shared[tuple(student.student for student in those)].append(names[known])
    return [Hint(kind, students, tuple(same)) for students, same in shared.items()]
