"""The form of an answer: from what a student gives to plain data and back, by the kind of the part. Never its value.

What is stored, and what is read of an untrusted file, is one schema (:mod:`labcourse.answers.schema`). It is imported
when the first answer is given or read: pydantic takes a moment. Hints teach; none gives away the value, or the range in
which it is expected.
"""

from __future__ import annotations

import copy
import json
import math
import numbers
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from labcourse.answers import expressions, figures, json_values, units
from labcourse.answers.expressions import is_symbolic
from labcourse.answers.json_values import FormError, NotAnswered, check_given, clean, rounded, thin
from labcourse.answers.parts import YES_NO, Part
from labcourse.errors import AnswerError
from labcourse.patterns import SHORT, pattern
from labcourse.problems import Code, Problem
from labcourse.sentences import sentence

__all__ = ["MAX_BYTES", "Encoded", "FormError", "NotAnswered", "Sampled", "decode", "encode", "show"]

MAX_BYTES = 120_000  #: of one answer, as JSON; a recording of 400 points in a dozen channels
_ABOVE = 3  # levels of answers.json above an answer
#: What a notebook may leave where a text is to be written.
STUBS = ("", "...", "your answer here", "your text here")

_NUMBER_AND_UNIT = pattern(r"\s*([-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?)\s*(?![eE][-+]?\d|j\s*$)[^\W\d_].*")
_BETWEEN_WORDS = pattern(r"[\s_-]+")
_FORMULA_OR_PICTURE = pattern(r"[$=]|!\[|\\\(|\\\[")
_FEWEST_WORDS, _SHORT = 3, 30  # of an explanation: with fewer, and as few characters, it is asked whether that is all
_LEAST_PERCENTAGE = 0.06  # below, and above 0, a fraction is likelier; a coarse encoder gives a tenth of a per cent
_LONGEST_MESSAGE = 200  # characters of a function's error: two lines

Fields = dict[str, Any]
Hints = list[str]


@dataclass(frozen=True)
class Encoded:
    """An answer as plain data, with its kind, and hints on what is worth a second look."""

    content: dict[str, Any]
    hints: tuple[str, ...]


def encode(part: Part, value: Any, probe_seed: int) -> Encoded:
    """Turn what a student gives for a part into plain data.

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
    from labcourse.answers import schema

    check_given(value)
    unit = part.unit or part.usual.unit
    value = [units.plain(entry, unit) for entry in value] if isinstance(value, list) else units.plain(value, unit)
    if part.kind == "function":
        fields, hints = _encode_function(part, value, probe_seed)
    else:
        fields, hints = _ENCODERS[part.kind](part, value)
    try:
        text = json.dumps({"kind": part.kind, **fields}, allow_nan=False)
        content = schema.load(text.encode(), schema.MAX_DEPTH - _ABOVE)
    except (TypeError, ValueError, RecursionError):  # all else that is encoded is plain
        raise FormError("the recording's metadata is not plain data (text, numbers, lists)") from None
    size = len(text)
    if size > MAX_BYTES:
        raise FormError(
            f"it is too large to be recorded ({size} of at most {MAX_BYTES} bytes): leave out what is not needed"
        )
    try:
        schema.read_answer(part, content)
    except AnswerError as error:
        raise FormError(f"it cannot be recorded. {error}") from None
    return Encoded(content, tuple(hints))


def decode(part: Part, content: Any) -> Any:
    """Read a stored answer strictly, and return its value.

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
    from labcourse.answers import schema

    return schema.read_answer(part, content).decode(part)


def show(part: Part, content: dict[str, Any]) -> str:
    """Describe a stored answer in a few words: "speed = 19.9 rad/s". The same on every machine."""
    from labcourse.answers import schema

    return f"{part.name}{schema.read_answer(part, content).show(part)}"


def _entry(place: str, value: Any, read: Callable[[Any], Any]) -> Any:
    """Read an entry of a list or matrix. Its errors name the place."""
    try:
        return read(value)
    except NotAnswered:
        raise FormError(f"{place} is still empty") from None
    except FormError as error:
        raise FormError(f"look at {place}: {error}") from None


# --- numbers ---------------------------------------------------------------------------------------------------------


def _real(value: Any) -> float:
    """Return one finite real number, as :func:`_complex` does."""
    number = _complex(value)
    if abs(number.imag) > 1e-9 * abs(number):
        raise FormError("it is complex; a real number is asked for")
    return number.real


def _complex(value: Any) -> complex:
    """Return one finite number, real or complex, from whatever a student may have it in."""
    value = getattr(value, "nominal_value", value)  # of the package uncertainties
    if is_symbolic(value) and getattr(value, "free_symbols", None):
        left = ", ".join(sorted(str(symbol) for symbol in value.free_symbols))
        raise FormError(f"it still contains {left}: substitute numbers for them")
    if callable(value):
        raise FormError("it is a function: call it, and give the result")
    if not is_symbolic(value) or hasattr(value, "shape"):
        try:
            array = np.asarray(value)
        except ValueError:
            raise FormError("it is not one number") from None
        if array.size != 1:
            raise FormError(f"one number is asked for; this has {array.size} values")
        value = array.item()
    check_given(value)
    if isinstance(value, bool):
        raise FormError("it is True or False, not a number")
    if isinstance(value, str | bytes):
        match = _NUMBER_AND_UNIT.fullmatch(str(value)[:SHORT])
        how = f"write the number alone, without quotes and unit: {match[1]}" if match else "leave out the quotes"
        raise FormError(f"it is text; {how}")
    try:
        number = complex(value)
    except (TypeError, ValueError, OverflowError):
        raise FormError(f"it is a {type(value).__name__}, not a number") from None
    if not (math.isfinite(number.real) and math.isfinite(number.imag)):
        raise FormError("it is not finite (NaN or infinite): look for a division by zero or a missing sample before it")
    return number


def _encode_number(part: Part, value: Any) -> tuple[Fields, Hints]:
    number, spread = _real(value), getattr(value, "std_dev", None)
    uncertain = isinstance(spread, float) and 0 < spread < math.inf
    return {"value": number, **({"uncertainty": spread} if uncertain else {})}, _plausibility(part, number)


def _plausibility(part: Part, number: float) -> Hints:
    """Return a hint where a number is outside the plausible range: a likely slip of units, or just unusual."""
    if part.unit == "%" and 0 < number < _LEAST_PERCENTAGE:
        return [f"it looks like it is a fraction; give {part.unit}, unless it is really that small"]
    hints = _out_of_range(number, part.plausible, part.unit, "", *units.rough_slips(part.unit))
    if hints and not _out_of_range(-number, part.plausible, part.unit, ""):
        return ["it is negative: check the sign"]
    return hints


def _out_of_range(
    number: float, plausible: tuple[float, float] | None, unit: str, noun: str, *more: list[units.UnitSlip]
) -> Hints:
    """Return a hint if a number is out of its plausible range: at a slip of units that explains it, if there is one.

    Likely slips of a unit are tried first, then ``more`` of them.
    """
    if plausible is None or plausible[0] <= number <= plausible[1]:
        return []
    for slips in (*units.slips(unit), *more):
        names = [name for factor, offset, name in slips if plausible[0] <= number * factor + offset <= plausible[1]]
        if names:
            return [f"it looks like it is {' or '.join(names)}{f'; give {unit}' if unit else ''}"]
    return [f"{noun}unusually {'large' if number > plausible[1] else 'small'} for this plant: check"]


# --- matrices and poles ----------------------------------------------------------------------------------------------


def _objects(value: Any, message: str) -> NDArray[Any]:
    """Return an array of whatever a list has in it. Raises FormError with the message if it is not a regular one."""
    try:
        array = np.asarray(value, dtype=object)
    except ValueError:
        raise FormError(message) from None
    if array.size and all(entry is None or entry is Ellipsis for entry in array.flat):
        raise NotAnswered("nothing yet")
    return array


def _matrix_rows(part: Part, value: Any, read: Callable[[Any], Any]) -> list[list[Any]]:
    """Read the entries of a matrix, by rows. A vector may lie or stand."""
    rows, columns = part.rows_and_columns
    if _is_zero(value):
        return [[0.0] * columns for _row in range(rows)]
    value = _coefficients(value)
    if callable(value) and not hasattr(value, "__array__"):  # a polynomial of numpy's is both
        raise FormError("it is a function: call it, and give the result")
    ragged = "its rows differ in length"
    is_one_expression = is_symbolic(value) and not hasattr(value, "shape")  # a symbolic matrix has a shape
    array = _objects([value] if is_one_expression else value, ragged)
    entries = array.ravel().tolist()
    if any(isinstance(entry, list | tuple | np.ndarray) for entry in entries):
        raise FormError(ragged)
    if _has_all_rows(part, array):
        array = array.reshape(-1, columns)[:rows]
        entries = array.ravel().tolist()
    lying_or_standing = 1 in (rows, columns) and array.size == rows * columns and sum(n > 1 for n in array.shape) <= 1
    if array.shape != (rows, columns) and not lying_or_standing:
        given = " × ".join(map(str, array.shape)) if array.ndim > 1 else f"a row of {array.size}"
        given = given if array.ndim else f"a {type(value).__name__}"
        wanted = f"{rows * columns} numbers" if 1 in (rows, columns) else f"a {rows} × {columns} matrix"
        wanted += f", for {_asked_rows(part)}" if part.row_names else ""
        raise FormError(f"it should be {wanted}; it is {given}")
    places = [f"the entry in row {i + 1}, column {j + 1}" for i in range(rows) for j in range(columns)]
    numbers = [_entry(place, entry, read) for place, entry in zip(places, entries, strict=True)]
    return [numbers[columns * row : columns * (row + 1)] for row in range(rows)]


def _is_zero(value: Any) -> bool:
    """Check whether a value is the number 0, which stands for a matrix of zeros."""
    return isinstance(value, numbers.Real) and not isinstance(value, bool) and value == 0


def _has_all_rows(part: Part, value: Any) -> bool:
    """Check whether a matrix has all rows that it may have, and not only those that are asked for."""
    rows, columns = part.rows_and_columns
    shape, all_rows = np.shape(value), len(part.row_names)
    return all_rows > rows and shape in ((all_rows, columns), *[(all_rows,), (1, all_rows)] * (columns == 1))


def _asked_rows(part: Part) -> str:
    return " and ".join(part.row_names[: part.rows_and_columns[0]])


def _coefficients(value: Any) -> Any:
    """Return the coefficients of a polynomial of sympy's or numpy's, highest power first; any other value as it is."""
    if hasattr(value, "all_coeffs"):
        return value.all_coeffs()
    if hasattr(value, "convert") and hasattr(value, "coef"):  # numpy's have the lowest first, and other bases
        return value.convert(kind=np.polynomial.Polynomial).coef[::-1]
    return value


def _encode_matrix(part: Part, value: Any) -> tuple[Fields, Hints]:
    """Encode a matrix or a vector, or the coefficients of a polynomial."""
    if is_symbolic(value) and not _is_zero(value):
        value = expressions.polynomial(value)
    numbers = _matrix_rows(part, value, _real)
    hints = list(_unusual(part, [number for row in numbers for number in row if number]))
    if _has_all_rows(part, value):
        hints.append(f"the rows for {_asked_rows(part)} are recorded; the others are not asked for")
    return {"value": numbers}, hints


def _unusual(part: Part, numbers: list[float]) -> Iterator[str]:
    """Give hints on a matrix, by its entries that are not zero."""
    digits = part.usual.digits
    if digits > 1 and numbers and all(float(f"{number:.{digits - 2}e}") == number for number in numbers):
        yield (
            f"its entries have {digits - 1} digits or fewer: give what you computed, for what comes next builds on it"
        )
    if numbers:
        yield from _out_of_range(max(map(abs, numbers)), part.usual.largest, part.usual.unit, "its entries are ")


def _encode_poles(part: Part, value: Any) -> tuple[Fields, Hints]:
    """Encode poles, sorted; hint at those without a conjugate."""
    if isinstance(value, dict):  # sympy's eigenvalues: pole -> how often
        value = [pole for pole, times in value.items() for _repeat in range(times if isinstance(times, int) else 1)]
    if isinstance(value, set | frozenset):
        value = list(value)
    if isinstance(value, str) or not hasattr(value, "__len__"):
        raise FormError(f"it is a {type(value).__name__}; give a list of {part.count} poles")
    given = _objects(value, f"give one list of {part.count} poles").ravel().tolist()
    if len(given) != part.count:
        raise FormError(
            f"{part.count} poles are asked for (count multiple ones as often as they occur); there are {len(given)}"
        )
    poles = [_entry(f"pole {index}", pole, _complex) for index, pole in enumerate(given, start=1)]
    poles.sort(key=lambda pole: (float(f"{pole.real:.6g}"), pole.imag))
    hints = [] if _in_pairs(poles) else ["the complex poles of a real system come in conjugate pairs; these do not"]
    return {"value": [[pole.real, pole.imag] for pole in poles]}, hints


def _in_pairs(poles: list[complex]) -> bool:
    """Check whether the poles with an imaginary part are their own conjugates, within rounding to three digits."""
    scale = max(map(abs, poles))
    left = [pole for pole in poles if abs(pole.imag) > 1e-6 * scale]
    return all(any(abs(pole.conjugate() - other) <= 5e-3 * scale for other in left) for pole in left)


# --- words -----------------------------------------------------------------------------------------------------------


def _plain_word(text: str) -> str:
    return _BETWEEN_WORDS.sub(" ", text[:SHORT].strip().casefold()).rstrip(".")


def _encode_choice(part: Part, value: Any) -> tuple[Fields, Hints]:
    """Encode a choice, however it is capitalised and spaced."""
    if isinstance(value, numbers.Real):
        value = next((choice for choice in part.choices if choice.isdigit() and int(choice) == value), value)
    if isinstance(value, bool | np.bool_) and part.choices == YES_NO:
        value = "yes" if value else "no"
    listed = ", ".join(map(repr, part.choices))
    if not isinstance(value, str):
        raise FormError(f"it is none of {listed}")
    if _plain_word(value) in STUBS:
        raise NotAnswered("nothing yet")
    for choice in part.choices:
        if _plain_word(value) == _plain_word(choice):
            return {"value": choice}, []
    raise FormError(f"it is none of {listed}")


def _encode_prose(_part: Part, value: Any) -> tuple[Fields, Hints]:
    """Encode text that was given in quotes."""
    if not isinstance(value, str):
        raise FormError(f"it is a {type(value).__name__}; write text in quotes")
    text = clean(value).strip()
    if text.casefold().rstrip(".") in STUBS or text in STUBS:
        raise NotAnswered("nothing yet")
    if len(text) > json_values.LONGEST_PROSE:
        raise FormError(
            f"it has {len(text)} characters; {json_values.LONGEST_PROSE} at most are recorded, so shorten it"
        )
    return {"value": text}, [sentence(question).rstrip(".") for question in of_few_words(text)]


def of_few_words(text: str) -> list[Problem]:
    """Return a question about an explanation of a word or two; none if it is longer, or has a formula or a picture."""
    count = len(text.split())
    if count >= _FEWEST_WORDS or len(text) > _SHORT or _FORMULA_OR_PICTURE.search(text):
        return []
    return [Problem.of(Code.TEXT_OF_FEW_WORDS, count=count)]


# --- expressions, functions, recordings ------------------------------------------------------------------------------


def _encode_symbolic_matrix(part: Part, value: Any) -> tuple[Fields, Hints]:
    return {"value": _matrix_rows(part, value, lambda entry: expressions.encode(entry, part.symbols))}, []


def _encode_function(part: Part, value: Any, probe_seed: int) -> tuple[Fields, Hints]:
    """Call a function on its probe's inputs and keep the outputs, as the probe says."""
    probe = part.probe
    if probe is None:
        raise TypeError(f"{part.name}: a part of kind function needs a probe.")
    if not callable(value):
        raise FormError(
            f"it is a {type(value).__name__}: give the function {probe.signature} itself, not what it returns"
        )
    outputs = []
    for arguments in probe.inputs(probe_seed):
        try:
            output = value(*copy.deepcopy(arguments))
        except Exception as error:  # whatever a student's function may raise is theirs to read
            message = str(error)[:_LONGEST_MESSAGE]
            raise FormError(f"calling {probe.signature} raised {type(error).__name__}: {message}") from None
        if output is None and _is_written(value):
            raise FormError(f"{probe.signature} gave None: end it by return, with what it should give")
        check_given(output)
        outputs.append(probe.keep(output))
    return {"outputs": outputs}, []


def _is_written(function: Any) -> bool:
    """Check whether a function has more in it than a docstring, as the notebooks leave it."""
    code = getattr(function, "__code__", None)
    return code is not None and len(code.co_code) > len((lambda x: x).__code__.co_code)


@runtime_checkable
class Sampled(Protocol):
    """What counts as a recording: signals sampled together at a fixed rate, and where they come from.

    A channel has ``values`` (n,) in ``unit``.
    """

    @property
    def channels(self) -> Mapping[str, Any]: ...
    @property
    def metadata(self) -> Mapping[str, Any]: ...
    @property
    def sample_time(self) -> float: ...  # s
    def __len__(self) -> int: ...


def encode_recording(part: Part, value: Any) -> tuple[Fields, Hints]:
    """Summarise a recording: its metadata, and its channels, thinned to 400 points of 6 significant digits.

    Raises
    ------
    FormError
        If it is not a recording, lacks a channel, is unfit or too long.
    """
    value = part.read(value)
    if not isinstance(value, Sampled):
        raise FormError(f"it is a {type(value).__name__}, not a recording: give what the experiment returned")
    if why := part.unfit(value):
        raise FormError(why)
    missing = [name for name in part.channels if name not in value.channels]
    if missing:
        raise FormError(f"the recording lacks {' and '.join(missing)}; it has {', '.join(value.channels)}")
    if len(value) > json_values.MOST_SAMPLES:
        raise FormError("the recording is too long: cut out the part that matters with recording.between(start, stop)")
    places = thin(len(value), json_values.RECORDING_POINTS)
    channels = {
        name: {"unit": channel.unit, "values": rounded(channel.values[places])}
        for name, channel in value.channels.items()
        if name in part.units
    }
    hints = [
        f"is it the right one? Its {name} is {str(value.metadata[name])[:40]!r}, where {wanted!r} is asked for"
        for name, wanted in (*part.settings, *part.usual.settings)
        if value.metadata.get(name, wanted) != wanted
    ]
    fields = {"metadata": dict(value.metadata), "n": len(value), "sample_time": value.sample_time, "channels": channels}
    return fields, hints


_ENCODERS: dict[str, Callable[[Part, Any], tuple[Fields, Hints]]] = {
    "number": _encode_number,
    "matrix": _encode_matrix,
    "poles": _encode_poles,
    "choice": _encode_choice,
    "prose": _encode_prose,
    "expression": lambda part, value: ({"value": expressions.encode(value, part.symbols, part.name)}, []),
    "equation": lambda part, value: (expressions.encode_equation(value, part.symbols), []),
    "symbolic_matrix": _encode_symbolic_matrix,
    "figure": lambda _part, value: figures.encode(value),
    "recording": encode_recording,
}


@dataclass(frozen=True)
class Channel:
    """One signal: ``values`` (n,) in a ``unit``."""

    values: NDArray[np.float64]
    unit: str


@dataclass(frozen=True)
class Recording:
    """Signals sampled together at a fixed rate.

    Attributes
    ----------
    channels : by name
    sample_time : s
    metadata : JSON data: the experiment and its settings
    """

    channels: Mapping[str, Channel]
    sample_time: float
    metadata: Mapping[str, Any]

    @property
    def time(self) -> NDArray[np.float64]:
        """Return the times (n,) of the samples in s, from 0 on."""
        return np.arange(len(self)) * np.float64(self.sample_time)

    def __getitem__(self, channel: str) -> NDArray[np.float64]:
        """Return the values (n,) of a channel."""
        return self.channels[channel].values

    def __len__(self) -> int:
        return len(next(iter(self.channels.values())).values)
