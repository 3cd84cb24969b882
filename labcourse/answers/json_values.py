"""Plain data: the bounds of answers, rounding and thinning, and strict reading of a course's own data."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labcourse.errors import AnswerError
from labcourse.patterns import CELL, pattern

SCHEMA: dict[str, Any] = json.loads(Path(__file__).with_name("answers.schema.json").read_text(encoding="utf-8"))


def _bound(definition: str, name: str, rule: str) -> int:
    """Return what a definition of the schema allows at most, or at least, in a field."""
    return int(SCHEMA["definitions"][definition]["properties"][name][rule])


FORMAT = int(SCHEMA["properties"]["format"]["minimum"])  #: of answers.json
MAX_INTEGER = 10**20  #: what is typed with 15 digits, in millionths
LONGEST_PROSE = _bound("prose", "value", "maxLength")  #: characters; two pages
LONGEST_SENTENCE = _bound("Prediction", "why", "maxLength")  #: characters on a prediction: a sentence, and a few more
LONGEST_LABEL = int(SCHEMA["definitions"]["Label"]["maxLength"])  #: characters: two lines
LONGEST_METADATA = 4000  #: characters of JSON; what a bench says of itself, ten times
MOST_AXES = _bound("figure", "axes", "maxItems")  #: diagrams of a figure: four rows of two
MOST_LINES = _bound("Diagram", "lines", "maxItems")  #: curves and marks of one diagram; a reader can distinguish half
CURVE_POINTS = int(SCHEMA["definitions"]["Points"]["maxItems"])  #: that are stored of a curve
RECORDING_POINTS = _bound("Channel", "values", "maxItems")  #: stored of a channel: half of the width of a plot
MOST_SAMPLES = _bound("recording", "n", "maximum")  #: of a recording: more than an hour at 2 kHz
_DEEPEST = 8  # lists within each other in which ``...`` is looked for; a list may hold itself


class FormError(AnswerError):
    """What was given does not have the form that was asked for; the message is a hint for the student."""


class NotAnswered(AnswerError):
    """Nothing has been given yet: the preset is still there."""


def check_given(value: Any) -> None:
    """Raise NotAnswered for what notebooks have in place of an answer (:func:`is_given`)."""
    if not is_given(value):
        raise NotAnswered("nothing yet")


def is_given(value: Any) -> bool:
    """Check whether a value is there: it is not None, and holds no ``...``, also in lists and the like."""
    return value is not None and not _has_dots(value)


def _has_dots(value: Any, depth: int = 0) -> bool:
    if isinstance(value, np.ndarray) and value.dtype == object:
        value = value.tolist()
    inner = value.values() if isinstance(value, dict) else value if isinstance(value, list | tuple | set) else ()
    return value is Ellipsis or (depth < _DEEPEST and any(_has_dots(item, depth + 1) for item in inner))


#: Characters that are not stored in texts: control characters, halves of surrogate pairs.
UNWRITABLE = pattern("[\x00-\x08\x0b-\x1f\x7f\ud800-\udfff]", CELL)


# --- writing ---------------------------------------------------------------------------------------------------------


def rounded(values: NDArray[np.float64]) -> list[float]:
    """Round the values (n,) of an array, each to 6 significant digits."""
    return [float(f"{value:.6g}") for value in values.tolist()]


def thin(size: int, limit: int) -> NDArray[np.intp]:
    """Return indices of at most ``limit`` of ``size`` samples: evenly spread, the first and the last among them.

    All of them where ``size`` is within the limit; else ``round(i (size − 1)/(limit − 1))`` for i = 0 … limit − 1.
    """
    return np.round(np.linspace(0, size - 1, min(size, limit))).astype(np.intp)


def clean(text: str) -> str:
    """Replace control characters in a text, and let its lines end in a line feed."""
    return UNWRITABLE.sub("\N{REPLACEMENT CHARACTER}", text.replace("\r\n", "\n").replace("\r", "\n"))


def show_number(value: float) -> str:
    """Write a number with 3 significant digits, for people; below a million without an exponent: 1200, not 1.2e+03."""
    return f"{float(f'{value:.3g}'):.6g}" if value else "0"


# --- reading ---------------------------------------------------------------------------------------------------------


def read_number(what: str, value: Any) -> float:
    """Read a finite number from JSON.

    Raises
    ------
    AnswerError
        If it is anything else.
    """
    if type(value) not in (int, float) or not abs(value) <= sys.float_info.max:
        raise AnswerError(f"{what} should be a finite number.")
    return float(value)


def read_text(what: str, value: Any, longest: int) -> str:
    """Read text of at most ``longest`` characters from JSON.

    Raises
    ------
    AnswerError
        If it is anything else.
    """
    if not isinstance(value, str) or len(value) > longest or UNWRITABLE.search(value):
        raise AnswerError(f"{what} should be printable text of at most {longest} characters.")
    return value


def read_list(what: str, value: Any, shortest: int = 0, longest: int = 1000) -> list[Any]:
    """Read a list with so many items from JSON.

    Raises
    ------
    AnswerError
        If it is anything else.
    """
    if not isinstance(value, list) or not shortest <= len(value) <= longest:
        wanted = str(shortest) if shortest == longest else f"{shortest} to {longest}"
        raise AnswerError(f"{what} should be a list of {wanted} items.")
    return value


def read_dict(what: str, value: Any, keys: set[str]) -> dict[str, Any]:
    """Read an object with exactly these keys from JSON.

    Raises
    ------
    AnswerError
        If it is anything else.
    """
    if not isinstance(value, dict) or value.keys() != keys:
        raise AnswerError(f"{what} should be an object with {', '.join(sorted(keys))}.")
    return value


def read_vector(what: str, value: Any, shortest: int = 0, longest: int = 1000) -> NDArray[np.float64]:
    """Read an array (n,) of finite numbers from JSON.

    Raises
    ------
    AnswerError
        If it is anything else.
    """
    return np.array([read_number(what, item) for item in read_list(what, value, shortest, longest)], dtype=np.float64)


def read_matrix(what: str, value: Any, shape: tuple[int, int]) -> NDArray[np.float64]:
    """Read an array of finite numbers of this shape from JSON (a list of rows).

    Raises
    ------
    AnswerError
        If it is anything else.
    """
    rows = read_list(what, value, shape[0], shape[0])
    return np.array([read_vector(what, row, shape[1], shape[1]) for row in rows], dtype=np.float64).reshape(shape)
