"""Find what class-mates have in common: hints for an instructor, never a verdict. No mark depends on them.

Three things are compared: wrong numbers that fit a class-mate's bench, recordings with equal samples, and equal files.
Students who hand in together share a bench and are not compared with each other. Code and words are not compared.
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

from labcourse.answers import answers
from labcourse.benches import OWN, REAL
from labcourse.errors import AnswerError
from labcourse.files import ANSWERS_FILE, COURSE_FILE
from labcourse.grading.course import Course
from labcourse.grading.gradebook import Gradebook, Graded
from labcourse.grading.graded_run import answers_of, submission_of
from labcourse.grading.marks import Status
from labcourse.grading.reports.templating import templates
from labcourse.grading.verdicts import Key, OwnBench
from labcourse.messages import plural
from labcourse.problems import Where
from labcourse.student_id import caseless

DIGITS = 3  #: a number with no more significant digits may be equal to a class-mate's by chance
FEWEST_TOGETHER = 2  #: wrong numbers that have to fit another bench, where none is a hint by itself
MOST_MATES = 2  #: class-mates whom a number may fit and still be a hint
MOST_ALIKE = 5  #: students or groups who may have an equal file; more probably got it from the instructor
_KIND, _BENCH = "recording", "bench"  # kind of an answer, and the metadata that any measured recording has
_NOTEBOOK = ".ipynb"
_DECIDED = (Status.RIGHT, Status.WRONG)


class Likeness(StrEnum):
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
    about: Likeness
    evidence: str


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
    """Return a function that gathers what is compared of a student, from the run that counts."""
    given = course.data.rglob("*") if course.data.is_dir() else ()
    handed_out = frozenset(digest(path.read_bytes()) for path in given if path.is_file())

    def work(graded: Graded) -> ComparedWork:
        delivered = {file.name: file.content for file in book.delivered(graded.run.student, notebooks=False)}
        return replace(handed_in(graded, delivered, handed_out), **measured(graded, course))

    return work


def compared(everybody: Sequence[ComparedWork], course: Course) -> list[Hint]:
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
    """Read a student's measured numbers from the run that counts: fields of :class:`ComparedWork`, or none."""
    parts = measured_parts(course.key)
    submission = submission_of(graded.run)
    try:
        bench = course.true_bench(submission.bench_of, submission.policy, submission.evidence)
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


def fitting_numbers(everybody: Sequence[ComparedWork], parts: Mapping[Where, OwnBench]) -> list[Hint]:
    """Find wrong numbers that are a class-mate's right ones, or that together fit a class-mate's bench.

    What fits several class-mates is no hint.

    Parameters
    ----------
    everybody : of the class
    parts : from :func:`measured_parts`
    """
    return [
        Hint((student.student, mate.student), Likeness.NUMBERS, f"{student.student}: {what.format(mate.student)}.")
        for student in everybody
        for what, mates in _fitting(student, everybody, parts)
        if len(mates) <= MOST_MATES
        for mate in mates
    ]


def _fitting(
    student: ComparedWork, everybody: Sequence[ComparedWork], parts: Mapping[Where, OwnBench]
) -> Iterator[tuple[str, list[ComparedWork]]]:
    """Yield what of a student's numbers fits class-mates, and whom; ``{}`` stands for a class-mate's ID."""
    others = [mate for mate in everybody if mate.bench and mate.bench != student.bench]
    for where in sorted(where for where in student.wrong if parts[where].is_discriminating):
        value = student.given[where]
        if value != float(f"{value:.{DIGITS}g}"):
            mates = [mate for mate in others if where in mate.right and mate.given[where] == value]
            yield f"{_numbers({where: value})} is wrong on their own bench, and the right answer of {{}}", mates
    if len(student.wrong) >= FEWEST_TOGETHER and not _fits(student, student, parts):
        mates = [mate for mate in others if _fits(student, mate, parts)]
        yield f"{_numbers(student.given)} fit the bench of {{}} together, and not their own", mates


def _numbers(given: Mapping[Where, float]) -> str:
    return ", ".join(f"{question} {part} = {value:g}" for (question, part), value in given.items())


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
    delivered : name → content of what was handed in last
    handed_out : digests (:func:`digest`) of files that all students were given
    """
    submission = submission_of(graded.run)
    recordings: dict[str, str] = {}
    if submission.policy is None or submission.policy.which in (OWN, REAL):
        for content in (answers_of(graded.run), _at_home(delivered.get(ANSWERS_FILE))):
            recordings |= dict(_recordings(content.get("answers", {})))
    files = {
        digest(content): name
        for name, content in sorted(delivered.items())
        # Notebooks that were not changed are equal, and so are the files that the course itself makes.
        if content and not name.endswith(_NOTEBOOK) and name not in (ANSWERS_FILE, COURSE_FILE)
    }
    own = {known: name for known, name in files.items() if known not in handed_out}
    group = caseless(submission.bench_of)
    return ComparedWork(graded.run.student, group, recordings=recordings, files=own)


def _at_home(data: bytes | None) -> dict[str, Any]:
    """Return the content of the ``answers.json`` that was handed in; nothing if it cannot be read."""
    try:
        return answers.parse(data or b"")
    except AnswerError:
        return {}


def _recordings(content: Mapping[str, Mapping[str, Any]]) -> Iterator[tuple[str, str]]:
    """Yield digest and place of each measured recording in answers. They are untrusted."""
    for question, parts in content.items():
        for part, answer in parts.items():
            if isinstance(answer, Mapping) and answer.get("kind") == _KIND and (samples := _samples(answer)):
                yield digest(samples), f"{question} {part}"


def _samples(content: Mapping[str, Any]) -> bytes:
    """Return what equal recordings have in common; empty where nothing was measured, or nothing moved."""
    try:
        values = {name: channel["values"] for name, channel in content["channels"].items()}
        is_of_bench = isinstance(content["metadata"][_BENCH], Mapping)
        moves = any(len(set(samples)) > 1 for samples in values.values())
    except (AttributeError, KeyError, TypeError):
        return b""
    return json.dumps(values, sort_keys=True).encode() if is_of_bench and moves else b""


def digest(content: bytes) -> str:
    """Compute what equal files have in common."""
    return hashlib.sha256(content).hexdigest()


def equal_recordings(everybody: Sequence[ComparedWork]) -> list[Hint]:
    """Find students, of different groups, with recordings of equal samples."""
    text = "{} have the same samples in {}, though each has a bench of their own."
    same = _shared(everybody, [student.recordings for student in everybody], len(everybody))
    return [Hint(who, Likeness.MEASURED, text.format(", ".join(who), ", ".join(names))) for who, names in same.items()]


def equal_files(everybody: Sequence[ComparedWork]) -> list[Hint]:
    """Find students, of different groups, with equal files."""
    text = "{} handed in the same {}: {}."
    same = _shared(everybody, [student.files for student in everybody], MOST_ALIKE)
    return [Hint(who, Likeness.MEASURED, text.format(", ".join(who), *_counted(names))) for who, names in same.items()]


def _shared(
    everybody: Iterable[ComparedWork], named: Iterable[Mapping[str, str]], most: int
) -> dict[tuple[str, ...], list[str]]:
    """Return students of different groups, at most so many, and the names of what all of them have.

    Parameters
    ----------
    everybody : of the class
    named : of each of them, digest → name
    most : groups
    """
    owners: dict[str, list[ComparedWork]] = defaultdict(list)
    names: dict[str, str] = {}
    for student, theirs in zip(everybody, named, strict=True):
        for known, name in theirs.items():
            owners[known].append(student)
            names.setdefault(known, name)
    shared: dict[tuple[str, ...], list[str]] = defaultdict(list)
    for known, those in owners.items():
        if 1 < len({student.group for student in those}) <= most:
            shared[tuple(student.student for student in those)].append(names[known])
    return shared


def _counted(files: Sequence[str]) -> tuple[str, str]:
    return plural(len(files), "1 file", "{count} files"), files[0] + (" and others" if files[1:] else "")
