"""Values that an instructor supplies in place of missing ones, so that what builds on them can be run.

``ada:1.2.speed=19.5`` binds, just before the cell that records question 1.2, the variable that this cell records,
and records the value. The part earns nothing; what follows from it can.
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
from labcourse.answers.parts import Part
from labcourse.errors import AnswerError, GradingError, StudentIDError
from labcourse.run.recorders import recorded

_KINDS = ("number", "choice", "matrix", "poles")
_EXAMPLE = "ada:1.2.speed=19.5"


@dataclass(frozen=True)
class Supplied:
    """A value for one part.

    Attributes
    ----------
    student : whose run it is for
    question, part : which
    value : a number, a text, or lists of them; plain data. None takes an earlier one back
    source : Python for the value
    """

    student: str
    question: str
    part: str
    value: Any
    source: str

    @property
    def name(self) -> str:
        """As in "1.2.speed"."""
        return f"{self.question}.{self.part}"


def read(text: str, catalogue: Catalogue) -> Supplied:
    """What an instructor says, as ``STUDENT:QUESTION.PART=VALUE``.

    Raises
    ------
    GradingError
        If it is not of that form, if there is no such part, or if the value is none for it.
    """
    student, colon, rest = text.partition(":")
    name, equals, given = rest.partition("=")
    question, dot, part = name.strip().rpartition(".")
    if not (colon and equals and dot):
        raise GradingError(f"{text!r} should be STUDENT:QUESTION.PART=VALUE, as {_EXAMPLE}.")
    try:
        asked = catalogue.find(question).part(part)
        if not given.strip():
            return Supplied(student_id.normalised(student), question, part, None, "")
        return _supplied(student_id.normalised(student), question, asked, _value(asked, given.strip()))
    except (AnswerError, StudentIDError, forms.FormError, forms.NotAnswered, ValueError) as error:
        raise GradingError(f"{text!r} cannot be supplied: {error}") from None


def together(student: str, earlier: Mapping[str, Any], now: Iterable[Supplied], catalogue: Catalogue) -> list[Supplied]:
    """What counts for a student: what was supplied before, and what is now; that comes first, and can take back.

    Parameters
    ----------
    student : whose
    earlier : "1.2.speed" → value, as the gradebook has it; what the course no longer has is left out
    now : of anybody's
    catalogue : of the course
    """
    found: dict[str, Supplied] = {}
    for name, value in earlier.items():
        question, _dot, part = name.rpartition(".")
        with contextlib.suppress(AnswerError, forms.FormError, ValueError):
            found[name] = _supplied(student, question, catalogue.find(question).part(part), value)
    found |= {one.name: one for one in now if student_id.caseless(one.student) == student_id.caseless(student)}
    return [one for one in found.values() if one.value is not None]


def _supplied(student: str, question: str, part: Part, value: Any) -> Supplied:
    forms.encode(part, _python(part, value), 0)
    return Supplied(student, question, part.name, value, _source(part, value))


def _value(part: Part, text: str) -> Any:
    if part.kind not in _KINDS:
        raise ValueError(f"{part.name} is of the kind {part.kind}; numbers, choices and arrays can be supplied.")
    if part.kind == "choice":
        return text.strip("\"'")
    try:
        return json.loads(text)
    except ValueError:
        what = 'write a number as 19.5, an array as [[1, 2], [3, 4]], and complex poles as ["-12+16j", -30].'
        raise ValueError(what) from None


def _python(part: Part, value: Any) -> Any:
    if part.kind == "choice":
        return value
    if part.kind == "number":
        return value
    return np.array(_numbers(value))


def _numbers(value: Any) -> Any:
    if isinstance(value, list):
        return [_numbers(one) for one in value]
    return complex(value.replace(" ", "")) if isinstance(value, str) else value


def _source(part: Part, value: Any) -> str:
    if part.kind in ("number", "choice"):
        return repr(value)
    return f"__import__('numpy').array({_numbers(value)!r})"


def cells(pristine: Mapping[str, dict[str, Any]], supplied: Iterable[Supplied]) -> dict[str, dict[str, str]]:
    """Notebook's file name → id of a cell → source to be run before it.

    Raises
    ------
    GradingError
        If no cell of the course records such a part.
    """
    found: dict[str, dict[str, str]] = {}
    for one in supplied:
        notebook, cell, variable = _place(pristine, one)
        lines = [f"{variable} = {one.source}"] if variable else []
        lines.append(f"lab.answer({one.question!r}, {one.part}={one.source})")
        before = found.setdefault(notebook, {})
        before[cell] = "\n".join([*filter(None, [before.get(cell)]), *lines])
    return found


def _place(pristine: Mapping[str, dict[str, Any]], wanted: Supplied) -> tuple[str, str, str | None]:
    """Notebook, id of the cell that records it, and the variable that is recorded, if it is a plain name."""
    for name, notebook in pristine.items():
        for one in recorded(notebook["cells"]):
            if one.question == wanted.question and (one.names is None or wanted.part in one.names):
                return name, one.cell, (one.names or {}).get(wanted.part)
    raise GradingError(f"{wanted.name} cannot be supplied: no cell of the course records it.")
