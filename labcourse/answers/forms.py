"""The form of an answer: from a Python value to plain data and back, by the kind of the part. Never its value.

Grading reads untrusted answers with :func:`decode`, which takes nothing but what :func:`encode` can write.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from labcourse.answers.json_values import FormError, NotAnswered
from labcourse.answers.kinds import arrays, figures, functions, recordings, symbolic, values
from labcourse.answers.parts import Part
from labcourse.errors import AnswerError

__all__ = ["MAX_BYTES", "Encoded", "FormError", "NotAnswered", "decode", "encode", "show"]

MAX_BYTES = 120_000  #: of one answer, as JSON; a recording of 400 points in a dozen channels


@dataclass(frozen=True)
class Encoded:
    """An answer as plain data (with its kind), and hints on what is worth a second look."""

    content: dict[str, Any]
    hints: tuple[str, ...] = ()


@dataclass(frozen=True)
class _Kind:
    encode: Callable[[Part, Any], tuple[dict[str, Any], list[str]]] | None  # a function needs a seed as well
    decode: Callable[[Part, Any], Any]
    show: Callable[[Part, dict[str, Any]], str]


_KINDS = {
    "number": _Kind(values.encode_number, values.decode_number, values.show_number_answer),
    "matrix": _Kind(arrays.encode_matrix, arrays.decode_matrix, arrays.show_matrix),
    "poles": _Kind(arrays.encode_poles, arrays.decode_poles, arrays.show_poles),
    "choice": _Kind(values.encode_choice, values.decode_choice, values.show_choice),
    "prose": _Kind(values.encode_prose, values.decode_prose, values.show_prose),
    "expression": _Kind(symbolic.encode_expression, symbolic.decode_expression, symbolic.show_expression),
    "equation": _Kind(symbolic.encode_equation, symbolic.decode_equation, symbolic.show_equation),
    "symbolic_matrix": _Kind(
        symbolic.encode_symbolic_matrix, symbolic.decode_symbolic_matrix, symbolic.show_symbolic_matrix
    ),
    "function": _Kind(None, functions.decode_function, functions.show_function),
    "figure": _Kind(figures.encode_figure, figures.decode_figure, figures.show_figure),
    "recording": _Kind(recordings.encode_recording, recordings.decode_recording, recordings.show_recording),
}


def encode(part: Part, value: Any, probe_seed: int) -> Encoded:
    """What a student gives for a part, as plain data.

    Parameters
    ----------
    part : what is asked for
    value : anything
    probe_seed : from which the inputs of a function are drawn

    Raises
    ------
    NotAnswered
        If there is nothing yet: None, ``...``, or text that a notebook put there.
    FormError
        If it has another form; the message is a hint for the student.
    """
    encoder = _KINDS[part.kind].encode
    content, hints = encoder(part, value) if encoder else functions.encode_function(part, value, probe_seed)
    content = {"kind": part.kind, **content}
    size = len(json.dumps(content, allow_nan=False))
    if size > MAX_BYTES:
        raise FormError(
            f"it is too large to be kept ({size} of at most {MAX_BYTES} bytes): leave out what is not needed"
        )
    return Encoded(content, tuple(hints))


def decode(part: Part, content: Any) -> Any:
    """The value of a stored answer, strictly read.

    Returns
    -------
    number: float · matrix: float array of the part's shape · poles: complex array, sorted · choice, prose: str ·
    expression: sympy expression in plain symbols · equation: ``sympy.Eq`` · symbolic_matrix: ``sympy.Matrix`` ·
    function: a list of tuples of arrays, one for each input of its probe · figure, recording: their summary, as in
    ``answers.json`` with arrays for lists of numbers

    Raises
    ------
    AnswerError
        If the data is not what :func:`encode` could have written for this part.
    """
    if not isinstance(content, dict) or content.get("kind") != part.kind:
        raise AnswerError(f"{part.name} should be of kind {part.kind}.")
    return _KINDS[part.kind].decode(part, content)


def show(part: Part, content: dict[str, Any]) -> str:
    """A few words on a stored answer, with its name: "speed = 19.9 rad/s". The same on every machine."""
    return part.name + _KINDS[part.kind].show(part, content)
