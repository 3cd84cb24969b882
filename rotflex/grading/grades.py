"""A class from submissions to marks: ``grades.csv``, and for each student ``marks.json`` and ``feedback.html``.

Submissions are independent of each other. Whatever one does, the others are graded, and what is done is on disk.
"""

from __future__ import annotations

import csv
import io
import json
import os
import secrets
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from pathlib import Path

import rotflex
from rotflex.errors import GradingError
from rotflex.grading import decoding, feedback, intake, marking, runner
from rotflex.grading.feedback import points
from rotflex.grading.intake import Submission
from rotflex.grading.marking import Key, Mark
from rotflex.grading.truth import TrueBench

GRADES_FILE = "grades.csv"
NOT_ISOLATED = "Run without isolation."
PROBE_SEED_BITS = 48
_CELL_BEGINNINGS = ("=", "+", "-", "@", "\t", "\r")  # where a spreadsheet would begin to calculate


@dataclass(frozen=True)
class Result:
    """What came out for a student.

    Attributes
    ----------
    student : ID
    marks : for every part of every question in the key
    problems : what went wrong with the submission
    notes : what else is worth knowing
    stamp : how it was run
    """

    student: str
    marks: tuple[Mark, ...]
    problems: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    stamp: str = NOT_ISOLATED

    @property
    def total(self) -> float:
        """Points earned."""
        return sum(mark.points for mark in self.marks)

    @property
    def out_of(self) -> float:
        """Points that there are."""
        return sum(mark.out_of for mark in self.marks)

    @property
    def awaiting(self) -> float:
        """Points that a person has yet to give or not."""
        return sum(mark.awaiting for mark in self.marks)

    def by_question(self) -> dict[str, tuple[float, float]]:
        """Points earned and possible, for each question that has any."""
        found: dict[str, tuple[float, float]] = {}
        for mark in self.marks:
            earned, possible = found.get(mark.question, (0.0, 0.0))
            found[mark.question] = (earned + mark.points, possible + mark.out_of)
        return {number: sums for number, sums in found.items() if sums[1]}


class Batch:
    """The submissions of a class, to be graded together.

    Parameters
    ----------
    submissions : folder that holds a folder or a zip for each student
    out : where results go; made if needed
    source : a checkout of the course, with ``solutions/key.py``
    limits : on the time that a submission may take
    jobs : how many submissions to run at a time
    probe_seed : for the inputs on which functions are tried; drawn anew unless given

    Attributes
    ----------
    ignored : a word on what lies among the submissions and is none

    Raises
    ------
    GradingError
        If there is nothing to grade, or nothing to grade it by.
    """

    def __init__(
        self,
        submissions: Path,
        out: Path,
        source: Path,
        limits: runner.Limits | None = None,
        jobs: int = 1,
        probe_seed: int | None = None,
    ) -> None:
        if out.resolve().is_relative_to(submissions.resolve()):
            raise GradingError(f"{out} lies among the submissions: choose another folder for the results.")
        self._submissions, self.ignored = intake.submissions(submissions)
        self._key: Key = marking.load_key(source / "solutions" / "key.py")
        self._out, self._source, self._jobs = out, source, jobs
        self._limits = limits or runner.Limits()
        self._probe_seed = secrets.randbits(PROBE_SEED_BITS) if probe_seed is None else probe_seed

    def __len__(self) -> int:
        return len(self._submissions)

    def grade(self) -> Iterator[Result]:
        """Grade all, and give each result as soon as it is there and on disk."""
        self._out.mkdir(parents=True, exist_ok=True)
        results: dict[str, Result] = {}
        cancelled = threading.Event()
        with runner.prepare(self._source) as course, ThreadPoolExecutor(self._jobs) as pool:
            try:
                waiting = [pool.submit(self._grade, one, course, cancelled) for one in self._submissions]
                for done in as_completed(waiting):
                    result = done.result()
                    results[result.student] = result
                    self._write(result)
                    write_grades(self._out / GRADES_FILE, [results[student] for student in sorted(results)])
                    yield result
            finally:  # on an interrupt, too: end what is running, begin nothing more
                cancelled.set()
                pool.shutdown(cancel_futures=True)

    def _grade(self, submission: Submission, course: runner.Course, cancelled: threading.Event) -> Result:
        """Grade one submission, whatever happens."""
        student = submission.student
        try:
            taken = intake.take_in(submission, course.answer_cells)
            if not taken.sources:
                reason = "Nothing of the course could be read in what you handed in."
                marks = marking.nothing_earned(self._key, reason)
                return Result(student, tuple(marks), tuple(taken.problems), tuple(taken.notes))
            run = runner.run(course, student, taken.sources, self._probe_seed, self._limits, cancelled)
            claims = decoding.decode(run.answers, self._probe_seed)
            if claims.student and claims.student.casefold() != student.casefold():
                claims.notes.append(f"The answers say that they are {claims.student[:80]!r}'s.")
            marks = marking.mark(self._key, claims, TrueBench(student), self._probe_seed)
        except Exception as error:  # a fault of ours; it must not cost the others their marks
            fault = f"Grading failed, which is not the student's fault: {type(error).__name__}: {error}"
            return Result(
                student, tuple(marking.nothing_earned(self._key, "Grading failed; ask your instructor.")), (fault,)
            )
        return Result(
            student,
            tuple(marks),
            (*taken.problems, *run.problems, *claims.problems),
            (*taken.notes, *claims.notes, *marking.unmarked(self._key, claims)),
        )

    def _write(self, result: Result) -> None:
        """Put a student's results in place of those of an earlier batch."""
        folder = self._out / result.student
        folder.mkdir(exist_ok=True)
        totals = {"total": result.total, "out_of": result.out_of, "awaiting": result.awaiting}
        record = {**asdict(result), **totals, "software": f"rotflex {rotflex.__version__}"}
        _replace(folder / "marks.json", json.dumps(record, indent=1, sort_keys=True) + "\n")
        _replace(folder / "feedback.html", feedback.page(result))


def write_grades(path: Path, results: list[Result]) -> None:
    """One row for each student, one column for each question that has points."""
    table = io.StringIO(newline="")
    writer = csv.writer(table)
    questions = list(results[0].by_question()) if results else []
    writer.writerow(["student", *questions, "total", "out_of", "awaiting a person", "notes"])
    for result in results:
        earned = result.by_question()
        writer.writerow(
            [
                _plain_cell(result.student),
                *(points(earned[number][0]) for number in questions),
                points(result.total),
                points(result.out_of),
                points(result.awaiting),
                _plain_cell(" ".join((*result.problems, *result.notes, result.stamp))),
            ]
        )
    _replace(path, table.getvalue())


def _plain_cell(text: str) -> str:
    """Text that a spreadsheet takes for text."""
    return f"'{text}" if text.startswith(_CELL_BEGINNINGS) else text


def _replace(path: Path, content: str) -> None:
    """Write a file in one go: it is the old one or the new one, never half."""
    scratch = path.with_name(f".{path.name}.tmp")
    scratch.write_text(content, encoding="utf-8", newline="")
    os.replace(scratch, path)
