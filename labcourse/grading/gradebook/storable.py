"""Clean untrusted text and data, so that every database accepts them and every report can show them.

Characters that PostgreSQL refuses (NUL, halves of surrogate pairs) and those that control a terminal are replaced by
their codes, as ``\\x00`` or ``\\ud800``. Line ends become ``\\n``. All other text stays, tabs too. Cleaning twice gives
the same as cleaning once, so that what was read can be stored again.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping
from dataclasses import fields, replace
from datetime import UTC, datetime
from enum import StrEnum
from typing import TYPE_CHECKING, Any, TypeVar

from labcourse import student_id
from labcourse.errors import GradebookError, StudentIDError
from labcourse.patterns import ANSWER, pattern
from labcourse.problems import Problem, as_json

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

MOST_CHARACTERS = 2**26  #: of a run's words, claim, reports of cells, ... each, as JSON
MOST_BYTES = 2**28  #: of a file that was handed in; more than any zip of a student's that is taken in
_DEEPEST = 30  # levels of plain data
_INTEGERS = range(-(2**63), 2**63)
_LINE_END = pattern(r"\r\n?", ANSWER)
_UNFIT = pattern(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\ud800-\udfff]", ANSWER)
_Record = TypeVar("_Record", bound="DataclassInstance")


def text(given: str) -> str:
    """Return a text cleaned, as this module describes it; of a member of a StrEnum, its value."""
    return _UNFIT.sub(_code_of, _LINE_END.sub("\n", str.__str__(given)))


def _code_of(match: re.Match[str]) -> str:
    """Return the code of the matched character, as text."""
    code = ord(match[0])
    return f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}"


def student(given: str) -> str:
    """Return a student's ID as it is stored.

    Raises
    ------
    GradebookError
        If it is not a valid ID.
    """
    try:
        return student_id.normalised(given)
    except StudentIDError as error:
        raise GradebookError(str(error)) from None


def cleaned(record: _Record, name: str) -> _Record:
    """Return a copy of a record with clean text and data, and times in UTC.

    Parameters
    ----------
    record : a dataclass
    name : what the record is called in messages

    Raises
    ------
    GradebookError
        If a number is not finite or does not fit into 64 bits, if a file is too large, or if other data cannot be
        written as JSON, is nested too deep, or is too large.
    """
    values = {}
    for field in fields(record):
        try:
            values[field.name] = _cleaned_value(getattr(record, field.name))
        except ValueError as error:
            raise GradebookError(f"{name} cannot be stored: {field.name} has {error}.") from None
    return replace(record, **values)


def _cleaned_value(value: Any) -> Any:
    """Return the clean value of a field. Raises ValueError, with what is wrong, if it cannot be stored."""
    if isinstance(value, datetime):
        return value.astimezone(UTC)
    if isinstance(value, StrEnum):
        return value
    if isinstance(value, bytes):
        return _bounded(value, len(value), MOST_BYTES, "bytes")
    clean = _plain(value, _DEEPEST)
    if isinstance(clean, list | dict):
        _bounded(clean, len(json.dumps(as_json(clean))), MOST_CHARACTERS, "characters of JSON")
    return tuple(clean) if isinstance(value, tuple) else clean


def _bounded(value: Any, size: int, most: int, unit: str) -> Any:
    """Return a value as it is. Raises ValueError if its size (in ``unit``) is larger than ``most``."""
    if size > most:
        raise ValueError(f"{size} {unit}; at most {most} are allowed")
    return value


def _plain(given: Any, levels: int) -> Any:
    """Return data as JSON has them, with clean text. Raises ValueError for other data and for too many levels."""
    if isinstance(given, str):
        return text(given)
    if isinstance(given, Problem):
        return Problem.from_json(_plain(given.as_json(), levels))
    if isinstance(given, Mapping) and levels and all(isinstance(key, str) for key in given):
        return {text(key): _plain(value, levels - 1) for key, value in given.items()}
    if isinstance(given, list | tuple) and levels:
        return [_plain(value, levels - 1) for value in given]
    if given is None or (isinstance(given, int) and given in _INTEGERS):
        return given
    if isinstance(given, float) and math.isfinite(given):
        return given + 0.0  # of zero and minus zero, zero
    if isinstance(given, int | float):
        raise ValueError("a number that is not finite, or does not fit into 64 bits")
    raise ValueError(f"data that JSON cannot have, or that is nested too deep: {type(given).__name__}")
