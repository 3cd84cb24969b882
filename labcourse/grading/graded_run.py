"""The facts of a run that the gradebook stores besides its answers, and the marking of a stored run.

All of it is plain data, so that answers can be marked again, and reasons given again, without running anything.
"""

from __future__ import annotations

import zlib
from base64 import b64decode, b64encode
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, PlainSerializer

from labcourse.answers import answers
from labcourse.answers.cell_reports import CellReports
from labcourse.answers.report_files import ReportFile
from labcourse.answers.words import TextAnswer
from labcourse.benches import BenchPolicy
from labcourse.errors import AnswerError
from labcourse.grading.gradebook import Graded, RunRecord
from labcourse.grading.marking.marking import Context
from labcourse.grading.marking.marking_processes import Marker, MarkingJob
from labcourse.grading.marks import Mark, Status
from labcourse.problems import Code, Problem, Where, as_json, from_json, has

#: Bytes that are written to JSON as base64 of their compressed form.
_Compressed = Annotated[
    bytes,
    BeforeValidator(lambda data: zlib.decompress(b64decode(data)) if isinstance(data, str) else data),
    PlainSerializer(lambda data: b64encode(zlib.compress(data)).decode("ascii"), when_used="json"),
]
#: A problem, or a text of the course's, written to JSON as plain data.
_Stored = Annotated[Any, BeforeValidator(from_json), PlainSerializer(as_json)]


class Facts(BaseModel):
    """The facts of a run.

    Attributes
    ----------
    reports : what its cells reported
    ended : what went wrong with the run as a whole
    problems, notes : all but those of marking
    missing : question, part, and why there is no answer, of each missing answer with a known reason
    asked : (question, part) that the student's release asks; None if it is the course's
    bench_of : ID of the student on whose bench it was run
    policy : which bench each student had; None if it is not known
    evidence : what the course's function read from the student's files in the sandbox, JSON: a claim
    reports_in_pdf : number of a report → the PDF that was handed in
    untouched : names of notebooks, without ending, in which the student changed nothing
    waits : (question, part) of notebooks that are missing, while nobody has confirmed a partner who handed in
    """

    model_config = ConfigDict(frozen=True)

    reports: CellReports = CellReports()
    ended: tuple[_Stored, ...] = ()
    problems: tuple[_Stored, ...] = ()
    notes: tuple[_Stored, ...] = ()
    missing: list[tuple[str, str, _Stored]] = []
    asked: list[Where] | None = None
    bench_of: str = ""
    policy: BenchPolicy | None = None
    evidence: _Compressed = b""
    reports_in_pdf: dict[str, ReportFile] = {}
    untouched: tuple[str, ...] = ()
    waits: list[Where] = []

    def as_json(self) -> tuple[dict[str, Any], ...]:
        """Return the facts as :attr:`RunRecord.cells` stores them."""
        return (self.model_dump(mode="json", exclude_defaults=True),)


def facts_of(run: RunRecord) -> Facts:
    """Read the facts of a run from its record. For a record that stores no facts, return those with its messages."""
    if not run.cells:
        return Facts(problems=run.problems, notes=run.notes, bench_of=run.student)
    return Facts.model_validate(run.cells[0])


def answers_of(run: RunRecord) -> dict[str, Any]:
    """Return the content of a run's ``answers.json``, which is not to be changed; nothing if it cannot be read."""
    try:
        return _parsed(run.answers or b"")
    except AnswerError:
        return {}


_parsed = lru_cache(maxsize=2)(answers.parse)  # a student's page and the hints read it one after the other


def words_as_json(words: Mapping[Where, TextAnswer]) -> dict[str, dict[str, Any]]:
    """Return answers in words as :attr:`RunRecord.words` stores them."""
    stored: dict[str, dict[str, Any]] = {}
    for (question, part), answer in words.items():
        stored.setdefault(question, {})[part] = answer.as_json()
    return stored


def recorded_in(data: bytes | None) -> set[Where]:
    """Return the (question, part) of all that an ``answers.json`` claims to hold; none if it cannot be read."""
    try:
        content = answers.parse(data or b"")
    except AnswerError:
        return set()
    return {(question, part) for question, parts in content["answers"].items() for part in parts}


def supplied_parts(run: RunRecord) -> set[Where]:
    """Return the (question, part) of the values that an instructor supplied."""
    return {(question, part) for question, _dot, part in (name.rpartition(".") for name in run.supplied)}


def marking_job(run: RunRecord) -> MarkingJob:
    """Return the job of marking a stored run: all that marking needs of it."""
    facts = facts_of(run)
    missing = {(question, part): reason for question, part, reason in facts.missing}
    context = Context(missing, supplied_parts(run), facts.asked, facts.reports_in_pdf)
    words = {
        (question, part): TextAnswer.from_json(content)
        for question, parts in run.words.items()
        for part, content in parts.items()
    }
    student = facts.bench_of or run.student
    return MarkingJob(student, run.answers, run.probe_seed, words, context, facts.policy, facts.evidence)


def mark(run: RunRecord, marker: Marker, key_digest: str) -> Graded:
    """Mark a stored run by the key. Messages of this marking replace those of an earlier one; each is there once.

    Parameters
    ----------
    run : with the answers
    marker : of the course
    key_digest : from :func:`labcourse.grading.marking.marking_processes.marking_digest`, to store with the marks

    Raises
    ------
    GradingError
        If the answers cannot be marked.
    """
    facts, marked = facts_of(run), marker.mark(marking_job(run))
    problems = dict.fromkeys((*facts.problems, *marked.problems))
    notes = dict.fromkeys((*facts.notes, *marked.notes))
    marks = with_unconfirmed(marked.marks, facts)
    return Graded(replace(run, problems=tuple(problems), notes=tuple(notes)), marks, key_digest)


def with_unconfirmed(marks: tuple[Mark, ...], facts: Facts) -> tuple[Mark, ...]:
    """Return the marks; while nobody has confirmed a partner who handed in for the student, missing answers wait."""
    waiting, why = {*facts.waits}, Problem.of(Code.PARTNER_NOT_CONFIRMED)
    return tuple(
        replace(mark, status=Status.UNCONFIRMED, reason=why)
        if mark.where in waiting and mark.status == Status.MISSING
        else mark
        for mark in marks
    )


def is_failed(run: RunRecord) -> bool:
    """Return whether a record stands for a failed grading, without a run."""
    return has(Code.GRADING_FAILED, run.problems)


def key_faults(graded: Graded) -> dict[Where, Problem]:
    """Return (question, part) → problem of each part that a fault of the key left unmarked."""
    unmarked = {mark.where for mark in graded.marks if mark.status == Status.NOT_MARKED}
    failed = (one for one in graded.run.problems if isinstance(one, Problem) and one.code is Code.KEY_FAILED)
    faults = {(one.parameters["question"], one.parameters["part"]): one for one in failed}
    return {where: fault for where, fault in faults.items() if where in unmarked}
