"""Untrusted text and data, in a form that every database accepts and every report can show.

Text stays as it is, but for what PostgreSQL refuses (NUL, halves of surrogate pairs) and what a terminal obeys (control
characters): these are written out, as ``\\x00`` or ``\\ud800``. Line ends become ``\\n``; tabs stay. Cleaning twice
gives the same as cleaning once, so that what was read can be recorded again.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping
from dataclasses import fields
from datetime import UTC, datetime
from typing import Any, TypeVar

from labcourse import student_id
from labcourse.errors import GradebookError, StudentIDError
from labcourse.grading.gradebook.records import Delivery, Graded, MarkRecord, RunRecord

MOST_CHARACTERS = 2**26  #: of a run's words, claim, reports of cells, ... each, as JSON
MOST_BYTES = 2**28  #: of a file that was handed in; more than any zip of a student's that is taken in
_DEEPEST = 30  # levels of plain data
_INTEGERS = range(-(2**63), 2**63)
_LINE_END = re.compile(r"\r\n?")
_UNFIT = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\ud800-\udfff]")
_Record = TypeVar("_Record", RunRecord, Delivery, MarkRecord)


def text(given: str) -> str:
    """Clean a text. Of an enumeration's string, take its value."""
    return _UNFIT.sub(_written_out, _LINE_END.sub("\n", str.__str__(given)))


def _written_out(match: re.Match[str]) -> str:
    code = ord(match[0])
    return f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}"


def student(given: str) -> str:
    """Return a student's ID in the form in which it is stored.

    Raises
    ------
    GradebookError
        If it cannot be an ID.
    """
    try:
        return student_id.normalised(given)
    except StudentIDError as error:
        raise GradebookError(str(error)) from None


def graded(given: Graded) -> Graded:
    """Clean a run and its marks.

    Raises
    ------
    GradebookError
        If a number is not finite, the probe seed does not fit into 64 bits, a part is marked twice, or what came with
        the run is not plain data of a bounded size.
    """
    if given.run.probe_seed not in _INTEGERS:
        raise GradebookError(f"The probe seed {given.run.probe_seed} does not fit into 64 bits: choose a smaller one.")
    run = cleaned(given.run)
    run.student = student(given.run.student)
    return Graded(run, marks(given.marks), text(given.key_digest))


def marks(given: tuple[MarkRecord, ...]) -> tuple[MarkRecord, ...]:
    """Clean marks. Raises as :func:`graded` does."""
    seen = set()
    for mark in (clean := tuple(map(cleaned, given))):
        if not (math.isfinite(mark.points) and math.isfinite(mark.out_of)):
            raise GradebookError(
                f"Question {mark.question}, {mark.part}: {mark.points} of {mark.out_of} points is not a mark."
            )
        if mark.where in seen:
            raise GradebookError(f"Question {mark.question}, {mark.part} has two marks.")
        seen.add(mark.where)
    return clean


def delivery(given: Delivery) -> Delivery:
    """Clean a file that was handed in, its time in UTC. Raises GradebookError if it is too large."""
    if len(given.content) > MOST_BYTES:
        raise GradebookError(f"{given.name} has {len(given.content)} bytes, of which there may be {MOST_BYTES}.")
    return cleaned(given)


def cleaned(record: _Record) -> _Record:
    """Return a new record with clean text and data. Raises GradebookError where data is not plain, or too large."""
    return type(record)(*(_value(field.name, getattr(record, field.name)) for field in fields(record)))


def _value(name: str, value: Any) -> Any:
    if isinstance(value, str):
        return text(value)
    if isinstance(value, float):
        return value + 0.0  # of zero and minus zero, zero
    if isinstance(value, datetime):
        return value.astimezone(UTC)
    if isinstance(value, tuple):
        return tuple(_bounded(name, list(value)))
    return _bounded(name, value) if isinstance(value, Mapping) else value


def _bounded(name: str, given: Any) -> Any:
    clean = _plain(name, given, _DEEPEST)
    size = len(json.dumps(clean))
    if size > MOST_CHARACTERS:
        raise GradebookError(f"The {name} of a run have {size} characters, of which there may be {MOST_CHARACTERS}.")
    return clean


def _plain(name: str, given: Any, levels: int) -> Any:
    """Return data as JSON has it, its text as :func:`text` returns it."""
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
        f"The {name} of a run hold data that JSON cannot have, or that is nested too deep: {type(given).__name__}."
    )
