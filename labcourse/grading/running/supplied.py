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

from labcourse.answers import forms
from labcourse.answers.catalogue import Catalogue
from labcourse.errors import AnswerError, GradingError, StudentIDError
from labcourse.run.alignment import recorded
from labcourse.student_id import caseless, normalised

_SINGLE, _LISTS = ("number", "choice"), ("matrix", "poles")  # kinds of parts that can be supplied
_EXAMPLE = "ada:1.2.speed=19.5"


@dataclass(frozen=True)
class Supplied:
    """A value that an instructor supplies for one part of a question.

    Attributes
    ----------
    student : ID of the student who gets it
    question, part : number of the question, and name of the part
    value : a number, a text, or lists of them; plain data. None takes an earlier value back
    """

    student: str
    question: str
    part: str
    value: Any

    @property
    def name(self) -> str:
        """Name of the part, as "1.2.speed"."""
        return f"{self.question}.{self.part}"

    @property
    def source(self) -> str:
        """Python expression for the value, to be put into a cell; a list becomes an array of numpy's."""
        value = self.value
        return f"__import__('numpy').array({_as_numbers(value)!r})" if isinstance(value, list) else repr(value)


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
        parsed = _parse_value(value.strip(), part, kind) if value.strip() else None
        return _check_fits(Supplied(normalised(student), question, part, parsed), catalogue)
    except (AnswerError, StudentIDError, forms.FormError, forms.NotAnswered, ValueError) as error:
        raise GradingError(f"{text!r} cannot be supplied: {error}") from None


def of_earlier(values: Mapping[str, Mapping[str, Any]]) -> list[Supplied]:
    """Return the values that instructors supplied in an earlier gradebook; ``values`` have them by student and name."""
    given = ((one, name.rpartition("."), value) for one in values for name, value in values[one].items())
    return [Supplied(student, question, part, value) for student, (question, _dot, part), value in given]


def values_for(
    student: str, earlier: Mapping[str, Any], supplied_now: Iterable[Supplied], catalogue: Catalogue
) -> list[Supplied]:
    """Return the values that count for a student. A value that is supplied now replaces or takes back an earlier one.

    Parameters
    ----------
    student : ID
    earlier : "1.2.speed" → value, from the gradebook; values that the course no longer takes are left out
    supplied_now : values for all students that are given for this grading
    catalogue : of the course
    """
    values: dict[str, Supplied] = {}
    for name, value in earlier.items():
        question, _dot, part = name.rpartition(".")
        with contextlib.suppress(AnswerError, forms.FormError, ValueError):
            values[name] = _check_fits(Supplied(student, question, part, value), catalogue)
    values |= {value.name: value for value in supplied_now if caseless(value.student) == caseless(student)}
    return [value for value in values.values() if value.value is not None]


def code_to_insert(pristine: Mapping[str, dict[str, Any]], supplied: Iterable[Supplied]) -> dict[str, dict[str, str]]:
    """Write the code that binds and records supplied values.

    Parameters
    ----------
    pristine : notebook's file name → notebook as released
    supplied : the values that count for a student

    Returns
    -------
    dict
        notebook's file name → id of a cell → source to run before it

    Raises
    ------
    GradingError
        If no cell of the course records the part of a value.
    """
    sources: dict[str, dict[str, str]] = {}
    for value in supplied:
        notebook, cell, variable = _recording_cell(pristine, value)
        lines = [f"{variable} = {value.source}"] if variable else []
        lines.append(f"lab.answer({value.question!r}, {value.part}={value.source})")
        before = sources.setdefault(notebook, {})
        before[cell] = "\n".join([*filter(None, [before.get(cell)]), *lines])
    return sources


def _parse_value(text: str, part: str, kind: str) -> Any:
    """Read a value as plain data from what an instructor wrote for a part; raise ValueError if it cannot be one."""
    if kind not in _SINGLE + _LISTS:
        raise ValueError(f"{part} is of the kind {kind}; numbers, choices and arrays can be supplied.")
    if kind == "choice":
        return text.strip("\"'")
    try:
        return json.loads(text)
    except ValueError:
        advice = 'write a number as 19.5, an array as [[1, 2], [3, 4]], and complex poles as ["-12+16j", -30].'
        raise ValueError(advice) from None


def _check_fits(supplied: Supplied, catalogue: Catalogue) -> Supplied:
    """Return what is supplied if its value fits the part; raise AnswerError, FormError or ValueError if not."""
    part, value = catalogue.find(supplied.question).part(supplied.part), supplied.value
    if value is not None:
        if isinstance(value, list) and part.kind in _SINGLE:
            raise ValueError(f"{part.name} is one value; this is a list.")
        forms.encode(part, np.array(_as_numbers(value)) if isinstance(value, list) else value, 0)
    return supplied


def _as_numbers(value: Any) -> Any:
    """Return plain data with complex numbers in place of texts such as "-12+16j"; lists may be nested."""
    if isinstance(value, list):
        return [_as_numbers(entry) for entry in value]
    return complex(value.replace(" ", "")) if isinstance(value, str) else value


def _recording_cell(pristine: Mapping[str, dict[str, Any]], wanted: Supplied) -> tuple[str, str, str | None]:
    """Find the cell of the course that records a part.

    Returns
    -------
    tuple
        File name of the notebook; id of the cell; and the variable that it records, None if that is not a plain name.

    Raises
    ------
    GradingError
        If no cell records the part.
    """
    for name, notebook in pristine.items():
        for entry in recorded(notebook["cells"]):
            if entry.question == wanted.question and (entry.names is None or wanted.part in entry.names):
                return name, entry.cell, (entry.names or {}).get(wanted.part)
    raise GradingError(f"{wanted.name} cannot be supplied: no cell of the course records it.")
