"""The runs that a gradebook stores: a submission written as plain data and read again, and marking it once more.

Answers can be marked again, and reasons given again, without running anything.
"""

from __future__ import annotations

import zlib
from base64 import b64decode, b64encode
from collections.abc import Collection, Mapping
from dataclasses import replace
from functools import lru_cache
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, PlainSerializer

import labcourse
from labcourse.answers import answers
from labcourse.answers.cell_reports import CellReports
from labcourse.answers.report_files import ReportFile
from labcourse.answers.words import TextAnswer
from labcourse.benches import BenchPolicy
from labcourse.grading.gradebook import Gradebook, Graded, RunRecord
from labcourse.grading.marking.marking_processes import Marker
from labcourse.grading.marks import Mark, Status
from labcourse.grading.submission import Submission
from labcourse.problems import Code, Problem, Where, as_json, from_json, has

ISOLATED, NOT_ISOLATED = "Run in isolation.", "Run without isolation."

#: Bytes that are written to JSON as base64 of their compressed form.
_Compressed = Annotated[
    bytes,
    BeforeValidator(lambda data: zlib.decompress(b64decode(data)) if isinstance(data, str) else data),
    PlainSerializer(lambda data: b64encode(zlib.compress(data)).decode("ascii")),
]
#: A problem, or a text of the course's, written to JSON as plain data.
_Stored = Annotated[Any, BeforeValidator(from_json), PlainSerializer(as_json)]
#: Reasons by (question, part), written to JSON as lists of three.
_Reasons = Annotated[
    Any,
    BeforeValidator(
        lambda given: given if isinstance(given, dict) else {(q, p): from_json(why) for q, p, why in given}
    ),
    PlainSerializer(lambda reasons: [[*where, as_json(why)] for where, why in reasons.items()]),
]


class _Facts(BaseModel):
    """What :attr:`RunRecord.cells` stores of a submission, by the names of its attributes."""

    cell_reports: CellReports
    ended: tuple[_Stored, ...]
    problems: list[_Stored]
    notes: list[_Stored]
    missing: _Reasons
    asked: list[Where] | None = None
    bench_of: str
    policy: BenchPolicy | None = None
    evidence: _Compressed
    documents: dict[str, ReportFile]
    untouched: tuple[str, ...]
    waits: list[Where]


def facts_as_json(submission: Submission) -> tuple[dict[str, Any], ...]:
    """Return what :attr:`RunRecord.cells` stores of a submission."""
    return (_Facts.model_validate(submission, from_attributes=True).model_dump(mode="json"),)


def record_of(submission: Submission, *, isolated: bool) -> RunRecord:
    """Return the record for the gradebook of a submission that was prepared; it may have been run or not.

    Parameters
    ----------
    submission : all but its marks
    isolated : whether it was run in a sandbox
    """
    bundle = submission.bundle
    return RunRecord(
        key=submission.key,
        student=submission.student,
        submission=submission.digest,
        master=bundle.digest,
        software=f"labcourse {labcourse.__version__}",
        probe_seed=submission.probe_seed,
        isolation=ISOLATED if isolated else NOT_ISOLATED,
        answers=submission.answers,
        problems=tuple(dict.fromkeys(submission.problems)),
        notes=tuple(dict.fromkeys(submission.notes)),
        cells=facts_as_json(submission),
        claim=dict(submission.claim or {}),
        words=words_as_json(submission.words),
        supplied=submission.supplied,
        release=bundle.release,
        files=tuple(submission.files),
        prepared_from=submission.prepared_from,
        ran=submission.ran,
    )


def submission_of(run: RunRecord) -> Submission:
    """Return the submission that a record stores: without its files and marks, and without the messages of its marking.

    If the record stores no facts (``cells`` is empty), its problems and notes are all there are.
    """
    messages = {"problems": [*run.problems], "notes": [*run.notes]}
    facts = dict(_Facts.model_validate(run.cells[0])) if run.cells else messages
    words = {
        (question, part): TextAnswer.from_json(content)
        for question, parts in run.words.items()
        for part, content in parts.items()
    }
    return Submission(
        student=run.student,
        key=run.key,
        ran=run.ran,
        digest=run.submission,
        prepared_from=run.prepared_from,
        probe_seed=run.probe_seed,
        answers=run.answers,
        words=words,
        supplied=run.supplied,
        **facts,
    )


def answers_of(run: RunRecord) -> dict[str, Any]:
    """Return the content of a run's ``answers.json``, which is not to be changed; {} if it cannot be read."""
    return _content_of(run.answers)


_content_of = lru_cache(maxsize=2)(answers.content_of)  # a student's page and the hints read it one after the other


def words_as_json(words: Mapping[Where, TextAnswer]) -> dict[str, dict[str, Any]]:
    """Return answers in words as :attr:`RunRecord.words` stores them."""
    stored: dict[str, dict[str, Any]] = {}
    for (question, part), answer in words.items():
        stored.setdefault(question, {})[part] = answer.as_json()
    return stored


def recorded_in(data: bytes | None) -> set[Where]:
    """Return the (question, part) of all that an ``answers.json`` claims to hold; none if it cannot be read."""
    return {*answers.by_part(answers.content_of(data))}


def mark(run: RunRecord, marker: Marker, key_digest: str) -> Graded:
    """Mark a stored run by the key, without storing it. The messages of this marking replace those of an earlier one.

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
    submission = submission_of(run)
    marker.mark(submission)
    problems, notes = (tuple(dict.fromkeys(said)) for said in (submission.problems, submission.notes))
    marks = with_unconfirmed(submission.marks, submission.waits)
    return Graded(replace(run, problems=problems, notes=notes), marks, key_digest)


def with_unconfirmed(marks: tuple[Mark, ...], waits: Collection[Where]) -> tuple[Mark, ...]:
    """Return the marks; those of missing answers in ``waits`` are unconfirmed.

    ``waits`` are the (question, part) of notebooks that somebody handed in who names the student as a partner, while
    nobody has confirmed that.
    """
    why = Problem.of(Code.PARTNER_NOT_CONFIRMED)
    return tuple(
        replace(mark, status=Status.UNCONFIRMED, reason=why)
        if mark.where in waits and mark.status == Status.MISSING
        else mark
        for mark in marks
    )


def is_failed(run: RunRecord) -> bool:
    """Return whether a record stands for a failed grading, without a run."""
    return has(Code.GRADING_FAILED, run.problems)


def key_faults(graded: Graded) -> dict[Where, Problem]:
    """Return (question, part) → problem that names the fault of the key, for each part that the fault left unmarked."""
    unmarked = {mark.where for mark in graded.marks if mark.status == Status.NOT_MARKED}
    failed = (one for one in graded.run.problems if isinstance(one, Problem) and one.code is Code.KEY_FAILED)
    faults = {(one.parameters["question"], one.parameters["part"]): one for one in failed}
    return {where: fault for where, fault in faults.items() if where in unmarked}


# --- marking again ----------------------------------------------------------------------------------------------------


def store(gradebook: Gradebook, graded: Graded, actor: str, reason: str) -> Graded:
    """Store a run and its marks in one transaction. Return them as they count: marks by persons stay.

    Parameters
    ----------
    gradebook : where they are stored
    graded : the run and its marks
    actor : who changes marks, for the audit trail
    reason : why they change, for the audit trail
    """
    gradebook.record(graded, actor=actor, reason=reason)
    return gradebook.current(graded.run.student) or graded
