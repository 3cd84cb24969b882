"""The form of ``answers.json`` and of the reports on cells: sessions write in this form, and grading reads no other.

It is written down as a JSON Schema, ``answers.schema.json``, where each kind of answer has its own definition. A
stranger may have written what is read, so the form is strict and bounded: exactly the fields that are named, finite
numbers, no conversion, nothing evaluated. The library that checks it is pure Python, so that answers can be recorded
in a browser, too.
"""

from __future__ import annotations

import copy
import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import fastjsonschema
import numpy as np
from fastjsonschema import JsonSchemaValueException

from labcourse import files
from labcourse.answers import cell_reports, expressions, json_values
from labcourse.answers.cell_reports import CellError, CellReport, CellReports, Refusal
from labcourse.answers.json_values import FORMAT, SCHEMA, UNWRITABLE, show_number
from labcourse.answers.parts import Part
from labcourse.errors import AnswerError
from labcourse.messages import number_of

MAX_DEPTH = 60  #: lists and objects in each other; an expression may have 40 levels of its own
_MOST_EVENTS = 6_000  # lines: eleven notebooks of at most some hundred cells
_MOST_LACKED = 50  # answers of others that a cell asks for
_UNREAD = {"title": "answer", "type": "object"}  # in the file: a malformed one, read later, does not spoil the others
#: Trees are read by :mod:`labcourse.answers.expressions`, which counts their nodes, too.
_READ_APART = {"Answer": _UNREAD, "Tree": {"type": "array"}}
_TYPES = {kind: kind for kind in ("number", "integer", "string")} | {"array": "list", "object": "dictionary"}
#: What is said of a broken rule of the schema: the rule → words, of the rule's value and of the length that was found.
_WORDS: dict[str, Callable[[Any, int], str]] = {
    "type": lambda kind, _n: f"Input should be a valid {_TYPES[kind[0] if isinstance(kind, list) else kind]}",
    "minItems": lambda least, n: f"List should have at least {number_of(least, 'item')} after validation, not {n}",
    "maxItems": lambda most, n: f"List should have at most {number_of(most, 'item')} after validation, not {n}",
    "maxLength": lambda most, _n: f"String should have at most {number_of(most, 'character')}",
    "pattern": lambda _pattern, _n: "It should be printable text.",
    "enum": lambda values, _n: f"Input should be {' or '.join(map(repr, values))}",
}


def load(data: bytes, max_depth: int = MAX_DEPTH) -> Any:
    """Parse JSON, and refuse what JSON allows and no session writes.

    Raises
    ------
    AnswerError
        If it is not JSON, has NaN, a number beyond all floats, an integer beyond the bounds, or more levels.
    """
    try:
        return files.from_json(data, max_depth, allow_nan=False, parse_int=_integer)
    except ValueError as error:
        raise AnswerError(f"It is not JSON that can be read: {error}.") from None


def _integer(digits: str) -> int:
    """Return an integer. Raises ValueError if it is too large."""
    if len(digits) > 25 or abs(int(digits)) > json_values.MAX_INTEGER:
        raise ValueError("an integer is too large")
    return int(digits)


# --- the schema ------------------------------------------------------------------------------------------------------


@cache
def _validator(name: str) -> Callable[[Any], Any]:
    """Compile a definition of the schema; "" is the whole file."""
    definitions = {**SCHEMA["definitions"], **_READ_APART}
    form = {**SCHEMA, "definitions": definitions}
    if name:
        form = {"$schema": SCHEMA["$schema"], "$ref": f"#/definitions/{name}", "definitions": definitions}
    validate: Callable[[Any], Any] = fastjsonschema.compile(form, use_default=False)
    return validate


def _check(what: str, name: str, content: Any) -> None:
    """Check plain data. Raises AnswerError with the first thing that is wrong, and where it stands."""
    try:
        _validator(name)(content)
    except JsonSchemaValueException as error:
        place, words = _fault(error)
        raise _error(what, words, [*([name] if name else []), *place]) from None


def _error(what: str, words: str, place: Sequence[str]) -> AnswerError:
    shown = ascii(".".join(place))[1:-1]
    return AnswerError(f"{what}: {words[:200]}{f' (at {shown[:80]})' if shown else ''}")


def _fault(error: JsonSchemaValueException) -> tuple[list[str], str]:
    """Return the place of a fault, and what is wrong there."""
    place, rule, form, value = error.path[1:], str(error.rule), error.definition, error.value
    if rule == "required":
        missing = next(name for name in form["required"] if name not in value)
        return [*place, missing], "Field required"
    if rule == "additionalProperties":
        extra = next(name for name in value if name not in form["properties"])
        return [*place, extra], "Extra inputs are not permitted"
    if form == _UNREAD:
        return place, "An answer should be an object."
    if rule in ("minimum", "maximum"):
        than, strictly = ("greater", "exclusiveMinimum") if rule == "minimum" else ("less", "exclusiveMaximum")
        return place, f"Input should be {than} than {'' if form.get(strictly) else 'or equal to '}{form[rule]}"
    length = len(value) if isinstance(value, list) else 0
    return place, _WORDS[rule](form[rule], length)


def check_file(content: Any) -> None:
    """Check the content of an ``answers.json``; answers in it are read with :func:`read_answer`.

    Raises
    ------
    AnswerError
        If it is not such a file, or a newer one.
    """
    what = "It is not a file of answers"
    number = content.get("format") if isinstance(content, dict) else None
    if type(number) is int and number > FORMAT:
        words = f"It has format {number}; this version reads format {FORMAT}: install the newer one."
        raise _error(what, words, ["format"])
    _check(what, "", content)


# --- answers ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class NumberAnswer:
    """One real number, in the part's unit."""

    value: float
    uncertainty: float | None = None

    def decode(self, _part: Part) -> Any:
        """Return a float, without the uncertainty."""
        return float(self.value)

    def show(self, part: Part) -> str:
        """Describe it, as in " = 19.9 rad/s", or " = 19.9 ± 0.2 rad/s"."""
        within = f" ± {show_number(self.uncertainty)}" if self.uncertainty else ""
        return f" = {show_number(self.value)}{within} {part.unit}".rstrip()


@dataclass(frozen=True)
class MatrixAnswer:
    """Real numbers, by rows; a vector is one row or, if the part says so, one column."""

    value: list[list[float]]

    def decode(self, part: Part) -> Any:
        """Return an array of the part's shape."""
        _check_shape(part, self.value)
        return np.array(self.value, dtype=np.float64).reshape(part.shape)

    def rows(self) -> list[list[float]]:
        """Return the rows with zeros for what rounding leaves of them, which differs between machines."""
        noise = 1e-9 * max(abs(number) for row in self.value for number in row)
        return [[number if abs(number) > noise else 0.0 for number in row] for row in self.value]

    def show(self, _part: Part) -> str:
        """Describe it: a vector by its numbers, a matrix by its shape."""
        rows, columns = len(self.value), len(self.value[0])
        if 1 in (rows, columns):
            return f" = [{', '.join(show_number(number) for row in self.rows() for number in row)}]"
        return f": {rows} × {columns} matrix"


@dataclass(frozen=True)
class PolesAnswer:
    """Complex numbers, each as [real part, imaginary part], sorted."""

    value: list[list[float]]

    def decode(self, part: Part) -> Any:
        """Return a complex array (count,)."""
        if len(self.value) != part.count:
            raise AnswerError(f"{part.name} should be {part.count} poles.")
        return np.array([complex(*pair) for pair in self.value], dtype=np.complex128)

    def show(self, _part: Part) -> str:
        """Describe them, as in " = -18.9, -8 + 27j"."""
        noise = 1e-6 * max(abs(complex(*pair)) for pair in self.value)
        shown = []
        for real, imag in self.value:
            text = show_number(real if abs(real) > noise else 0.0)
            sign = "-" if imag < 0 else "+"
            shown.append(f"{text} {sign} {show_number(abs(imag))}j" if abs(imag) > noise else text)
        return f" = {', '.join(shown)}"


@dataclass(frozen=True)
class ChoiceAnswer:
    """One of the part's choices."""

    value: str

    def decode(self, part: Part) -> Any:
        """Return the choice."""
        if self.value not in part.choices:
            raise AnswerError(f"{part.name} should be one of {', '.join(part.choices)}.")
        return self.value

    def show(self, _part: Part) -> str:
        """Describe it."""
        return f" = {self.value}"


@dataclass(frozen=True)
class ProseAnswer:
    """Text for a person to read."""

    value: str

    def decode(self, _part: Part) -> Any:
        """Return the text."""
        return self.value

    def show(self, _part: Part) -> str:
        """Count its words."""
        return f": {number_of(len(self.value.split()), 'word')}"


class SymbolicAnswer:
    """What answers that are made of trees (:mod:`labcourse.answers.expressions`) have in common."""

    def show(self, part: Part) -> str:
        """Name the kind, and the symbols in it."""
        noun = "{} × {} matrix".format(*part.shape) if part.shape else part.kind
        return f": {expressions.describe(noun, part.symbols, list(vars(self).values()))}"


@dataclass(frozen=True)
class ExpressionAnswer(SymbolicAnswer):
    """An expression, as a tree."""

    value: list[Any]

    def __post_init__(self) -> None:
        _check_tree(self.value, "expression.value")

    def decode(self, part: Part) -> Any:
        """Return a sympy expression in plain symbols."""
        return expressions.decode(self.value, part.symbols)


@dataclass(frozen=True)
class EquationAnswer(SymbolicAnswer):
    """The two sides of an equation, as trees."""

    lhs: list[Any]
    rhs: list[Any]

    def __post_init__(self) -> None:
        _check_tree(self.lhs, "equation.lhs")
        _check_tree(self.rhs, "equation.rhs")

    def decode(self, part: Part) -> Any:
        """Return a ``sympy.Eq``."""
        import sympy

        sides = (expressions.decode(side, part.symbols) for side in (self.lhs, self.rhs))
        return sympy.Eq(*sides, evaluate=False)


@dataclass(frozen=True)
class SymbolicMatrixAnswer(SymbolicAnswer):
    """A matrix of trees, by rows."""

    value: list[list[Any]]

    def __post_init__(self) -> None:
        for i, row in enumerate(self.value):
            for j, tree in enumerate(row):
                _check_tree(tree, f"symbolic_matrix.value.{i}.{j}")

    def decode(self, part: Part) -> Any:
        """Return a ``sympy.Matrix``."""
        import sympy

        _check_shape(part, self.value)
        return sympy.Matrix([[expressions.decode(tree, part.symbols) for tree in row] for row in self.value])


@dataclass(frozen=True)
class FunctionAnswer:
    """What a function returned for each input of the part's probe, in the probe's form."""

    outputs: list[Any]

    def decode(self, part: Part) -> Any:
        """Return a tuple of arrays for each input."""
        if part.probe is None or len(self.outputs) != part.probe.count:
            raise AnswerError(f"{part.name} should have an output for each input.")
        return [part.probe.read(output) for output in self.outputs]

    def show(self, _part: Part) -> str:
        """Count the inputs."""
        return f": a function, tried on {number_of(len(self.outputs), 'input')}"


@dataclass(frozen=True)
class FigureAnswer:
    """The diagrams of a figure, as they are stored: labels, and for each curve n, x and y."""

    axes: list[dict[str, Any]]

    def __post_init__(self) -> None:
        for i, axis in enumerate(self.axes):
            for j, line in enumerate(axis["lines"]):
                if len(line["x"]) != len(line["y"]):
                    raise _Fault("A curve should have as many x as y.", f"figure.axes.{i}.lines.{j}")

    def decode(self, _part: Part) -> Any:
        """Return ``{"axes": [...]}`` as it is stored, with arrays for x and y."""
        lines = ([_with_arrays(line, "x", "y") for line in axis["lines"]] for axis in self.axes)
        return {"axes": [{**axis, "lines": of_axis} for axis, of_axis in zip(self.axes, lines, strict=True)]}

    def show(self, _part: Part) -> str:
        """Count diagrams and curves."""
        curves = number_of(sum(len(axis["lines"]) for axis in self.axes), "curve")
        return f": {number_of(len(self.axes), 'diagram')}, {curves}"


@dataclass(frozen=True)
class RecordingAnswer:
    """Signals that were sampled together: ``n`` samples, every ``sample_time`` s."""

    metadata: dict[str, Any]
    n: int
    sample_time: float
    channels: dict[str, dict[str, Any]]

    def __post_init__(self) -> None:
        text = json.dumps(self.metadata, allow_nan=False, ensure_ascii=False)
        if len(text) > json_values.LONGEST_METADATA:
            words = f"The metadata should have at most {json_values.LONGEST_METADATA} characters."
            raise _Fault(words, "recording.metadata")
        if UNWRITABLE.search(text):
            raise _Fault("It should be printable text.", "recording.metadata")

    def decode(self, part: Part) -> Any:
        """Return a dict of all fields, with an array for the values of a channel."""
        if not set(part.channels) <= self.channels.keys() <= part.units.keys():
            raise AnswerError(f"The channels should be some of {', '.join(part.units)}, with {part.channels}.")
        points = min(self.n, json_values.RECORDING_POINTS)
        for name, channel in self.channels.items():
            if channel["unit"] != part.units[name] or len(channel["values"]) != points:
                raise AnswerError(f"{name} should be {points} values in {part.units[name]}.")
        channels = {name: _with_arrays(channel, "values") for name, channel in self.channels.items()}
        return {**vars(self), "metadata": copy.deepcopy(self.metadata), "channels": channels}

    def show(self, _part: Part) -> str:
        """Describe it, as in ": 15 s, 3 channels"."""
        channels = number_of(len(self.channels), "channel")
        return f": {show_number((self.n - 1) * self.sample_time)} s, {channels}"


class _Fault(AnswerError):
    """What the schema cannot say is broken: words, and the place."""

    def __init__(self, words: str, place: str) -> None:
        super().__init__(words)
        self.words, self.place = words, place


def _check_tree(tree: list[Any], place: str) -> None:
    try:
        expressions.check(tree)
    except ValueError as error:
        raise _Fault(str(error), place) from None


def _check_shape(part: Part, rows: Sequence[Sequence[Any]]) -> None:
    if [len(row) for row in rows] != [part.rows_and_columns[1]] * part.rows_and_columns[0]:
        raise AnswerError("{} should be a {} × {} matrix.".format(part.name, *part.rows_and_columns))


def _with_arrays(stored: dict[str, Any], *names: str) -> dict[str, Any]:
    return {**stored, **{name: np.array(stored[name], dtype=np.float64) for name in names}}


KINDS: dict[str, Callable[..., Any]] = {
    "number": NumberAnswer,
    "matrix": MatrixAnswer,
    "poles": PolesAnswer,
    "choice": ChoiceAnswer,
    "prose": ProseAnswer,
    "expression": ExpressionAnswer,
    "equation": EquationAnswer,
    "symbolic_matrix": SymbolicMatrixAnswer,
    "function": FunctionAnswer,
    "figure": FigureAnswer,
    "recording": RecordingAnswer,
}


def read_answer(part: Part, content: Any) -> Any:
    """Check a stored answer to a part, plain data as :func:`load` gives it, and return it as an object of its kind.

    Raises
    ------
    AnswerError
        If it is of another kind or form; whether it fits the part is seen when it is decoded.
    """
    if not isinstance(content, dict) or content.get("kind") != part.kind:
        raise AnswerError(f"{part.name} should be of kind {part.kind}.")
    _check(part.name, part.kind, content)
    try:
        return KINDS[part.kind](**{name: value for name, value in content.items() if name != "kind"})
    except _Fault as fault:
        raise _error(part.name, fault.words, [fault.place]) from None


# --- the reports on cells --------------------------------------------------------------------------------------------


def read_reports(data: bytes) -> CellReports:
    """Read the reports on cells that a run left. Lines of another form, and all beyond the bounds, are ignored."""
    cells: dict[tuple[str, str], CellReport] = {}
    refusals: dict[tuple[str, str], Refusal] = {}
    unused: dict[tuple[str, str, str], None] = {}
    latest = ("", "")
    for kind, event in _events(data):
        if kind == "started":
            latest = event["notebook"], event["cell"]
            cells[latest] = CellReport(*latest, finished=False)
        elif kind == "ended":
            where = event["notebook"], event["cell"]
            error = None if event["error"] is None else CellError(**event["error"])
            cells[where] = replace(cells.get(where, CellReport(*where, False)), finished=True, error=error)
        elif kind == "refused":
            where = event["question"], event["part"]
            refusals[where] = Refusal(*where, event["why"])
        elif kind == "unused":
            unused[event["notebook"], event["name"], event["value"]] = None
        elif latest in cells:
            lacked = dict.fromkeys((*cells[latest].lacked, (event["question"], event["part"])))
            cells[latest] = replace(cells[latest], lacked=tuple(lacked)[:_MOST_LACKED])
    return CellReports(tuple(cells.values()), tuple(refusals.values()), tuple(unused))


def _events(data: bytes) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield kind and fields of each event."""
    kinds = ("started", "ended", "lacked", "refused", "unused")
    for line in data[: cell_reports.MAX_BYTES].splitlines()[:_MOST_EVENTS]:
        try:
            event = load(line)
            kind = event.get("event") if isinstance(event, dict) else None
            if kind in kinds:
                _check("event", kind, event)
                yield kind, event
        except AnswerError:
            continue
