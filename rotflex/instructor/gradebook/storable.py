"""Untrusted text and numbers, in the form in which every database takes them and every report can show them.

Text stays as it is, but for what PostgreSQL refuses (NUL, halves of surrogate pairs) and what a terminal obeys (control
characters): these are written out, as ``\\x00`` or ``\\ud800``. Line ends become ``\\n``; tabs stay. Twice is as once,
so that what was read can be recorded again.
"""

from __future__ import annotations

import math
import re
from dataclasses import replace

from rotflex.courseware import student_id
from rotflex.courseware.messages import _
from rotflex.errors import GradebookError, StudentIDError
from rotflex.instructor.gradebook.records import Graded, MarkRecord, RunRecord

_INTEGERS = range(-(2**63), 2**63)
_LINE_END = re.compile(r"\r\n?")
_UNFIT = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\ud800-\udfff]")


def text(given: str) -> str:
    """Text as it is kept. Of an enumeration's string, its value."""
    plain = _LINE_END.sub("\n", str.__str__(given))
    return _UNFIT.sub(_written_out, plain)


def _written_out(found: re.Match[str]) -> str:
    code = ord(found[0])
    return f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}"


def student(given: str) -> str:
    """A student's ID as it is kept.

    Raises
    ------
    GradebookError
        If it cannot be one.
    """
    try:
        return student_id.normalised(given)
    except StudentIDError as error:
        raise GradebookError(str(error)) from None


def graded(given: Graded) -> Graded:
    """A run and its marks as they are kept.

    Raises
    ------
    GradebookError
        If a number is not finite, the probe seed does not fit into 64 bits, or a part is marked twice.
    """
    return Graded(_run(given.run), marks(given.marks), text(given.key_digest))


def _run(given: RunRecord) -> RunRecord:
    if given.probe_seed not in _INTEGERS:
        raise GradebookError(
            _("The probe seed {probe_seed} does not fit into 64 bits: choose a smaller one.").format(
                probe_seed=given.probe_seed
            )
        )
    return replace(
        given,
        student=student(given.student),
        key=text(given.key),
        submission=text(given.submission),
        master=text(given.master),
        software=text(given.software),
        isolation=text(given.isolation),
        problems=tuple(map(text, given.problems)),
        notes=tuple(map(text, given.notes)),
    )


def marks(given: tuple[MarkRecord, ...]) -> tuple[MarkRecord, ...]:
    """Marks as they are kept. Raises as :func:`graded` does."""
    kept = tuple(map(_mark, given))
    seen = set()
    for mark in kept:
        if mark.where in seen:
            raise GradebookError(
                _("Question {question}, {part} has two marks.").format(question=mark.question, part=mark.part)
            )
        seen.add(mark.where)
    return kept


def _mark(given: MarkRecord) -> MarkRecord:
    if not (math.isfinite(given.points) and math.isfinite(given.out_of)):
        raise GradebookError(
            _("Question {question}, {part}: {points} of {out_of} points is not a mark.").format(
                question=given.question, part=given.part, points=given.points, out_of=given.out_of
            )
        )
    return MarkRecord(
        question=text(given.question),
        part=text(given.part),
        status=text(given.status),
        points=float(given.points) + 0.0,  # of zero and minus zero, zero
        out_of=float(given.out_of) + 0.0,
        reason=text(given.reason),
        given=text(given.given),
    )
