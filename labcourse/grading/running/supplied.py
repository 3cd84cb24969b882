"""Values that an instructor supplies in place of missing answers, so that later cells can run.

``ada:1.2.speed=19.5`` binds, just before the cell that records question 1.2, the variable that this cell records,
and records the value. The part earns nothing; answers that build on it can earn points.
"""

from __future__ import annotations

import contextlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from labcourse import student_id
from labcourse.answers import forms
from labcourse.answers.catalogue import Catalogue
from labcourse.errors import AnswerError, GradingError, StudentIDError
from labcourse.run.recorders import recorded

_KINDS = ("number", "choice", "matrix", "poles")
_EXAMPLE = "ada:1.2.speed=19.5"


@dataclass(frozen=True)
class Supplied:
    """A value for one part.

    Attributes
    ----------
    student : ID of the student who gets it
    question, part : which
    value : a number, a text, or lists of them; plain data. None takes an earlier value back
    """

    student: str
    question: str
    part: str
    value: Any

    @property
    def name(self) -> str:
        """As in "1.2.speed"."""
        return f"{self.question}.{self.part}"

    @property
    def source(self) -> str:
        """Python for the value."""
        return f"__import__('numpy').array({_numbers(self.value)!r})" if _is_array(self.value) else repr(self.value)


def read(text: str, catalogue: Catalogue) -> Supplied:
    """Read what an instructor supplies, ``STUDENT:QUESTION.PART=VALUE``.

    Raises
    ------
    GradingError
        If it is not of that form, if there is no such part, or if the value does not fit the part.
    """
    student, colon, rest = text.partition(":")
    name, equals, value = rest.partition("=")
    question, dot, part = name.strip().rpartition(".")
    if not (colon and equals and dot):
        raise GradingError(f"{text!r} should be STUDENT:QUESTION.PART=VALUE, as {_EXAMPLE}.")
    try:
        kind = catalogue.find(question).part(part).kind
        parsed = _parsed(value.strip(), part, kind) if value.strip() else None
        return _checked(Supplied(student_id.normalised(student), question, part, parsed), catalogue)
    except (AnswerError, StudentIDError, forms.FormError, forms.NotAnswered, ValueError) as error:
        raise GradingError(f"{text!r} cannot be supplied: {error}") from None


def values_for(
    student: str, earlier: Mapping[str, Any], now: Iterable[Supplied], catalogue: Catalogue
) -> list[Supplied]:
    """Return the values that count for a student. A value that is supplied now replaces or takes back an earlier one.

    Parameters
    ----------
    student : ID
    earlier : "1.2.speed" → value, from the gradebook; values that the course no longer takes are left out
    now : of all students
    catalogue : of the course
    """
    values: dict[str, Supplied] = {}
    for name, value in earlier.items():
        question, _dot, part = name.rpartition(".")
        with contextlib.suppress(AnswerError, forms.FormError, ValueError):
            values[name] = _checked(Supplied(student, question, part, value), catalogue)
    values |= {one.name: one for one in now if student_id.caseless(one.student) == student_id.caseless(student)}
    return [one for one in values.values() if one.value is not None]


def cells(pristine: Mapping[str, dict[str, Any]], supplied: Iterable[Supplied]) -> dict[str, dict[str, str]]:
    """Write the code that binds and records supplied values.

    Returns
    -------
    dict
        notebook's file name → id of a cell → source to run before it

    Raises
    ------
    GradingError
        If no cell of the course records such a part.
    """
    sources: dict[str, dict[str, str]] = {}
    for one in supplied:
        notebook, cell, variable = _recording_cell(pristine, one)
        lines = [f"{variable} = {one.source}"] if variable else []
        lines.append(f"lab.answer({one.question!r}, {one.part}={one.source})")
        before = sources.setdefault(notebook, {})
        before[cell] = "\n".join([*filter(None, [before.get(cell)]), *lines])
    return sources


def _parsed(text: str, part: str, kind: str) -> Any:
    if kind not in _KINDS:
        raise ValueError(f"{part} is of the kind {kind}; numbers, choices and arrays can be supplied.")
    if kind == "choice":
        return text.strip("\"'")
    try:
        return json.loads(text)
    except ValueError:
        how = 'write a number as 19.5, an array as [[1, 2], [3, 4]], and complex poles as ["-12+16j", -30].'
        raise ValueError(how) from None


def _checked(supplied: Supplied, catalogue: Catalogue) -> Supplied:
    """Return the value if it fits its part; raise AnswerError, FormError or ValueError if not."""
    part, value = catalogue.find(supplied.question).part(supplied.part), supplied.value
    if value is not None:
        forms.encode(part, np.array(_numbers(value)) if _is_array(value) else value, 0)
    return supplied


def _is_array(value: Any) -> bool:
    return isinstance(value, list)


def _numbers(value: Any) -> Any:
    """Return nested lists of numbers, with complex numbers in place of their texts."""
    if isinstance(value, list):
        return [_numbers(one) for one in value]
    return complex(value.replace(" ", "")) if isinstance(value, str) else value


def _recording_cell(pristine: Mapping[str, dict[str, Any]], wanted: Supplied) -> tuple[str, str, str | None]:
    """Find the notebook and the cell that records a part, and the variable that it records, if it is a plain name."""
    for name, notebook in pristine.items():
        for one in recorded(notebook["cells"]):
            if one.question == wanted.question and (one.names is None or wanted.part in one.names):
                return name, one.cell, (one.names or {}).get(wanted.part)
    raise GradingError(f"{wanted.name} cannot be supplied: no cell of the course records it.")
