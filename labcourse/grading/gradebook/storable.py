"""Untrusted text and numbers, in the form in which every database takes them and every report can show them.

Text stays as it is, but for what PostgreSQL refuses (NUL, halves of surrogate pairs) and what a terminal obeys (control
characters): these are written out, as ``\\x00`` or ``\\ud800``. Line ends become ``\\n``; tabs stay. Twice is as once,
so that what was read can be recorded again.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping
from dataclasses import replace
from datetime import UTC
from typing import Any

from labcourse import student_id
from labcourse.errors import GradebookError, StudentIDError
from labcourse.grading.gradebook.records import Delivery, Graded, MarkRecord, RunRecord

MOST_CHARACTERS = 2**26  #: of a run's words, claim, reports of cells, ... each, as JSON
MOST_BYTES = 2**28  #: of a file that was handed in; more than any zip of a student's that is taken in
_DEEPEST = 30  # levels of plain data
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
        If a number is not finite, the probe seed does not fit into 64 bits, a part is marked twice, or what came with
        the run is not plain data of a bounded size.
    """
    return Graded(_run(given.run), marks(given.marks), text(given.key_digest))


def _run(given: RunRecord) -> RunRecord:
    if given.probe_seed not in _INTEGERS:
        raise GradebookError(f"The probe seed {given.probe_seed} does not fit into 64 bits: choose a smaller one.")
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
        cells=tuple(_bounded("cells", list(given.cells))),
        claim=_bounded("claim", given.claim),
        words=_bounded("words", given.words),
        supplied=_bounded("supplied", given.supplied),
        release=text(given.release),
        files=tuple(_bounded("files", list(given.files))),
    )


def _bounded(name: str, given: Any) -> Any:
    kept = _plain(name, given, _DEEPEST)
    size = len(json.dumps(kept))
    if size > MOST_CHARACTERS:
        raise GradebookError(
            f"What is to be recorded of a run as {name} takes {size} characters, of which there may be "
            f"{MOST_CHARACTERS}."
        )
    return kept


def _plain(name: str, given: Any, levels: int) -> Any:
    """Data as JSON has it, its text as :func:`text` keeps it."""
    if isinstance(given, str):
        return text(given)
    if isinstance(given, Mapping) and levels and all(isinstance(key, str) for key in given):
        return {text(key): _plain(name, value, levels - 1) for key, value in given.items()}
    if isinstance(given, list | tuple) and levels:
        return [_plain(name, value, levels - 1) for value in given]
    if given is None or (isinstance(given, int) and given in _INTEGERS):
        return given
    if isinstance(given, float) and math.isfinite(given):
        return given
    raise GradebookError(
        f"What is to be recorded of a run as {name} holds what is not plain data, or too deep in it: "
        f"{type(given).__name__}."
    )


def delivery(given: Delivery) -> Delivery:
    """A file that was handed in as it is kept, its time in UTC. Raises GradebookError if it is too large."""
    if len(given.content) > MOST_BYTES:
        raise GradebookError(f"{given.name} has {len(given.content)} bytes, of which there may be {MOST_BYTES}.")
    return Delivery(
        name=text(given.name),
        digest=text(given.digest),
        content=bytes(given.content),
        received=given.received.astimezone(UTC),
        source=text(given.source),
        clock=given.clock,
    )


def marks(given: tuple[MarkRecord, ...]) -> tuple[MarkRecord, ...]:
    """Marks as they are kept. Raises as :func:`graded` does."""
    kept = tuple(map(_mark, given))
    seen = set()
    for mark in kept:
        if mark.where in seen:
            raise GradebookError(f"Question {mark.question}, {mark.part} has two marks.")
        seen.add(mark.where)
    return kept


def _mark(given: MarkRecord) -> MarkRecord:
    if not (math.isfinite(given.points) and math.isfinite(given.out_of)):
        raise GradebookError(
            f"Question {given.question}, {given.part}: {given.points} of {given.out_of} points is not a mark."
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
