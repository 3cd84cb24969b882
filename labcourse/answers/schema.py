"""The schema of ``answers.json`` and of the reports on cells: sessions write in this form, and grading reads no other.

Each kind of answer is a model, known by its ``kind``. A stranger may have written what is read, so the models are
strict and bounded: exactly the fields that are named, finite numbers, no conversion, nothing evaluated. The JSON Schema
made of them is ``docs/reference/answers.schema.json`` (``tools/write_schema.py``).
"""

from __future__ import annotations

import contextlib
import json
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, FailFast, Field, TypeAdapter, ValidationError, WithJsonSchema
from pydantic.functional_validators import AfterValidator, WrapValidator, model_validator

from labcourse import files
from labcourse.answers import cell_reports, expressions, json_values
from labcourse.answers.cell_reports import CellError, CellReport, CellReports, Refusal
from labcourse.answers.json_values import UNWRITABLE, show_number
from labcourse.answers.parts import Part
from labcourse.errors import AnswerError
from labcourse.messages import number_of

MAX_DEPTH = 60  #: lists and objects in each other; an expression may have 40 levels of its own
_CURVE_SAMPLES = 10**9  # two weeks at 1 kHz
_MOST_ITEMS = 1000  # of a list of any other sort
_MOST_EVENTS = 6_000  # lines: eleven notebooks of at most some hundred cells
_MOST_LACKED = 50  # answers of others that a cell asks for
_LATEST = 2**33  # s since 1970, in 2242; no platform can write years of many digits


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


def validated(adapter: TypeAdapter[Any], what: str, content: Any) -> Any:
    """Validate plain data. Raises AnswerError with the first thing that is wrong, and where it stands."""
    try:
        return adapter.validate_python(content)
    except ValidationError as error:
        if error.error_count() > _MOST_ITEMS:  # to describe them all would take longer than to read the file
            raise AnswerError(f"{what}: it has {error.error_count()} faults.") from None
        first = error.errors(include_url=False, include_input=False, include_context=False)[0]
        place = ascii(".".join(map(str, first["loc"])))[1:-1]
        message = first["msg"].removeprefix("Value error, ")
        raise AnswerError(f"{what}: {message[:200]}{f' (at {place[:80]})' if place else ''}") from None


# --- answers ---------------------------------------------------------------------------------------------------------


def _printable(text: str) -> str:
    if UNWRITABLE.search(text):
        raise ValueError("It should be printable text.")
    return text


def _small(metadata: dict[str, Any]) -> dict[str, Any]:
    """Check that JSON data, which :func:`load` gave, is short and printable."""
    text = json.dumps(metadata, allow_nan=False, ensure_ascii=False)
    if len(text) > json_values.LONGEST_METADATA:
        raise ValueError(f"The metadata should have at most {json_values.LONGEST_METADATA} characters.")
    _printable(text)
    return metadata


def _tree(tree: list[Any]) -> list[Any]:
    expressions.check(tree)
    return tree


Finite = Annotated[float, Field(allow_inf_nan=False)]
FigureLabel = Annotated[str, Field(max_length=json_values.LONGEST_LABEL), AfterValidator(_printable)]
CurvePoints = Annotated[list[Finite], FailFast(), Field(max_length=json_values.CURVE_POINTS)]
Pair = Annotated[list[Finite], Field(min_length=2, max_length=2)]
MatrixRow = Annotated[list[Finite], FailFast(), Field(min_length=1, max_length=_MOST_ITEMS)]
Tree = Annotated[list[Any], AfterValidator(_tree), WithJsonSchema({"type": "array", "format": "tree"})]
Trees = Annotated[list[Tree], FailFast(), Field(min_length=1, max_length=_MOST_ITEMS)]


class Model(BaseModel):
    """A form with exactly its fields, each of exactly its type."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


class NumberAnswer(Model):
    """One real number, in the part's unit."""

    kind: Literal["number"]
    value: Finite
    uncertainty: Annotated[Finite, Field(gt=0.0)] | None = None

    def decode(self, _part: Part) -> Any:
        """Return a float, without the uncertainty."""
        return self.value

    def show(self, part: Part) -> str:
        """Describe it, as in " = 19.9 rad/s", or " = 19.9 ± 0.2 rad/s"."""
        within = f" ± {show_number(self.uncertainty)}" if self.uncertainty else ""
        return f" = {show_number(self.value)}{within} {part.unit}".rstrip()


class MatrixAnswer(Model):
    """Real numbers, by rows; a vector is one row or, if the part says so, one column."""

    kind: Literal["matrix"]
    value: Annotated[list[MatrixRow], FailFast(), Field(min_length=1, max_length=_MOST_ITEMS)]

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


class PolesAnswer(Model):
    """Complex numbers, each as [real part, imaginary part], sorted."""

    kind: Literal["poles"]
    value: Annotated[list[Pair], FailFast(), Field(min_length=1, max_length=_MOST_ITEMS)]

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


class ChoiceAnswer(Model):
    """One of the part's choices."""

    kind: Literal["choice"]
    value: str

    def decode(self, part: Part) -> Any:
        """Return the choice."""
        if self.value not in part.choices:
            raise AnswerError(f"{part.name} should be one of {', '.join(part.choices)}.")
        return self.value

    def show(self, _part: Part) -> str:
        """Describe it."""
        return f" = {self.value}"


class ProseAnswer(Model):
    """Text for a person to read."""

    kind: Literal["prose"]
    value: Annotated[str, Field(max_length=json_values.LONGEST_PROSE), AfterValidator(_printable)]

    def decode(self, _part: Part) -> Any:
        """Return the text."""
        return self.value

    def show(self, _part: Part) -> str:
        """Count its words."""
        return f": {number_of(len(self.value.split()), 'word')}"


class SymbolicAnswer(Model):
    """What answers that are made of trees (:mod:`labcourse.answers.expressions`) have in common."""

    def show(self, part: Part) -> str:
        """Name the kind, and the symbols in it."""
        noun = "{} × {} matrix".format(*part.shape) if part.shape else part.kind
        return f": {expressions.describe(noun, part.symbols, [value for _name, value in self])}"


class ExpressionAnswer(SymbolicAnswer):
    """An expression, as a tree."""

    kind: Literal["expression"]
    value: Tree

    def decode(self, part: Part) -> Any:
        """Return a sympy expression in plain symbols."""
        return expressions.decode(self.value, part.symbols)


class EquationAnswer(SymbolicAnswer):
    """The two sides of an equation, as trees."""

    kind: Literal["equation"]
    lhs: Tree
    rhs: Tree

    def decode(self, part: Part) -> Any:
        """Return a ``sympy.Eq``."""
        import sympy

        sides = (expressions.decode(side, part.symbols) for side in (self.lhs, self.rhs))
        return sympy.Eq(*sides, evaluate=False)


class SymbolicMatrixAnswer(SymbolicAnswer):
    """A matrix of trees, by rows."""

    kind: Literal["symbolic_matrix"]
    value: Annotated[list[Trees], FailFast(), Field(min_length=1, max_length=_MOST_ITEMS)]

    def decode(self, part: Part) -> Any:
        """Return a ``sympy.Matrix``."""
        import sympy

        _check_shape(part, self.value)
        return sympy.Matrix([[expressions.decode(tree, part.symbols) for tree in row] for row in self.value])


class FunctionAnswer(Model):
    """What a function returned for each input of the part's probe, in the probe's form."""

    kind: Literal["function"]
    outputs: Annotated[list[Any], Field(min_length=1, max_length=_MOST_ITEMS)]

    def decode(self, part: Part) -> Any:
        """Return a tuple of arrays for each input."""
        if part.probe is None or len(self.outputs) != part.probe.count:
            raise AnswerError(f"{part.name} should have an output for each input.")
        return [part.probe.read(output) for output in self.outputs]

    def show(self, _part: Part) -> str:
        """Count the inputs."""
        return f": a function, tried on {number_of(len(self.outputs), 'input')}"


class StoredCurve(Model):
    """A curve of a diagram: how many points it shows, and those that are stored."""

    label: FigureLabel
    n: Annotated[int, Field(ge=0, le=_CURVE_SAMPLES)]
    x: CurvePoints
    y: CurvePoints

    @model_validator(mode="after")
    def _as_many(self) -> Self:
        if len(self.x) != len(self.y):
            raise ValueError("A curve should have as many x as y.")
        return self


class Diagram(Model):
    """A diagram of a figure: its labels, and its curves."""

    title: FigureLabel
    xlabel: FigureLabel
    ylabel: FigureLabel
    lines: Annotated[list[StoredCurve], FailFast(), Field(min_length=1, max_length=json_values.MOST_LINES)]


class FigureAnswer(Model):
    """The diagrams of a figure."""

    kind: Literal["figure"]
    axes: Annotated[list[Diagram], Field(min_length=1, max_length=json_values.MOST_AXES)]

    def decode(self, _part: Part) -> Any:
        """Return ``{"axes": [...]}`` as it is stored, with arrays for x and y."""
        content = self.model_dump(exclude={"kind"})
        for line in (line for axis in content["axes"] for line in axis["lines"]):
            line.update({name: np.array(line[name], dtype=np.float64) for name in ("x", "y")})
        return content

    def show(self, _part: Part) -> str:
        """Count diagrams and curves."""
        curves = number_of(sum(len(axis.lines) for axis in self.axes), "curve")
        return f": {number_of(len(self.axes), 'diagram')}, {curves}"


class StoredChannel(Model):
    """A channel of a recording."""

    unit: Annotated[str, Field(max_length=10)]
    values: Annotated[list[Finite], FailFast(), Field(max_length=json_values.RECORDING_POINTS)]


class RecordingAnswer(Model):
    """Signals that were sampled together: ``n`` samples, every ``sample_time`` s."""

    kind: Literal["recording"]
    metadata: Annotated[dict[str, Any], AfterValidator(_small)]
    n: Annotated[int, Field(ge=2, le=json_values.MOST_SAMPLES)]
    sample_time: Annotated[Finite, Field(gt=0.0)]
    channels: dict[str, StoredChannel]

    def decode(self, part: Part) -> Any:
        """Return a dict of all fields, with an array for the values of a channel."""
        if not set(part.channels) <= self.channels.keys() <= part.units.keys():
            raise AnswerError(f"The channels should be some of {', '.join(part.units)}, with {part.channels}.")
        points = min(self.n, json_values.RECORDING_POINTS)
        for name, channel in self.channels.items():
            if channel.unit != part.units[name] or len(channel.values) != points:
                raise AnswerError(f"{name} should be {points} values in {part.units[name]}.")
        content = self.model_dump(exclude={"kind"})
        for stored in content["channels"].values():
            stored["values"] = np.array(stored["values"], dtype=np.float64)
        return content

    def show(self, _part: Part) -> str:
        """Describe it, as in ": 15 s, 3 channels"."""
        channels = number_of(len(self.channels), "channel")
        return f": {show_number((self.n - 1) * self.sample_time)} s, {channels}"


def _check_shape(part: Part, rows: Sequence[Sequence[Any]]) -> None:
    if [len(row) for row in rows] != [part.rows_and_columns[1]] * part.rows_and_columns[0]:
        raise AnswerError("{} should be a {} × {} matrix.".format(part.name, *part.rows_and_columns))


OfValues = NumberAnswer | MatrixAnswer | PolesAnswer | ChoiceAnswer | ProseAnswer
OfTrees = ExpressionAnswer | EquationAnswer | SymbolicMatrixAnswer
OfSamples = FunctionAnswer | FigureAnswer | RecordingAnswer
StoredAnswer = Annotated[OfValues | OfTrees | OfSamples, Field(discriminator="kind")]
_ANSWER: TypeAdapter[Any] = TypeAdapter(StoredAnswer)


def read_answer(part: Part, content: Any) -> Any:
    """Validate a stored answer to a part, and return its model.

    Raises
    ------
    AnswerError
        If it is of another kind or form; whether it fits the part is seen when it is decoded.
    """
    if not isinstance(content, dict) or content.get("kind") != part.kind:
        raise AnswerError(f"{part.name} should be of kind {part.kind}.")
    return validated(_ANSWER, part.name, content)


# --- answers.json ----------------------------------------------------------------------------------------------------


def _unread(content: Any, _validate: Any) -> dict[str, Any]:
    """Leave the validation of an answer to :func:`read_answer`, so that a malformed one does not spoil the file."""
    if not isinstance(content, dict):
        raise ValueError("An answer should be an object.")
    return content


Unread = Annotated[StoredAnswer, WrapValidator(_unread)]


def _of_this_version(number: int) -> int:
    if number > json_values.FORMAT:
        raise ValueError(
            f"It has format {number}; this version reads format {json_values.FORMAT}: install the newer one."
        )
    return number


class Prediction(Model):
    """What was predicted of a question's experiment, by name, and a sentence about it afterwards."""

    said: dict[str, Unread] = {}
    why: Annotated[str, Field(max_length=json_values.LONGEST_SENTENCE)] = ""


class AnswersFile(Model):
    """A student's answers, by question and part: ``answers.json``.

    ``cells`` has the id of the cell that recorded an answer, "" if none did; ``when``, of earlier versions alone, the
    time, in s since 1970.
    """

    format: Annotated[int, Field(ge=json_values.FORMAT), AfterValidator(_of_this_version)]
    student: str
    bench: dict[str, Any]
    software: str
    probe_seed: Annotated[int, Field(ge=0)]
    answers: dict[str, dict[str, Unread]]
    cells: dict[str, dict[str, str]] = {}
    when: dict[str, dict[str, Annotated[int, Field(ge=0, lt=_LATEST)]]] = {}
    predictions: dict[str, Prediction] = {}


ANSWERS_ADAPTER: TypeAdapter[AnswersFile] = TypeAdapter(AnswersFile)


# --- the reports on cells --------------------------------------------------------------------------------------------

Name = Annotated[str, Field(max_length=cell_reports.LONGEST)]


class ErrorReport(Model):
    """What stopped a cell: type and message of the exception, and the line of the cell."""

    type: Name
    message: Name
    line: Annotated[int, Field(gt=0, lt=cell_reports.MOST_LINES)] | None


class Event(Model):
    """What happened in a notebook."""

    notebook: Name


class Started(Event):
    """A cell was started."""

    event: Literal["started"]
    cell: Name


class Ended(Event):
    """A cell came to its end, or was stopped by an error."""

    event: Literal["ended"]
    cell: Name
    error: ErrorReport | None


class Lacked(Event):
    """The cell asked for an earlier answer that is not there."""

    event: Literal["lacked"]
    question: Name
    part: Name


class Refused(Event):
    """An answer was not recorded, for its form, or because it had no value."""

    event: Literal["refused"]
    question: Name
    part: Name
    why: Name


class Unused(Event):
    """A notebook gave a student or a bench that is not the job's."""

    event: Literal["unused"]
    name: Literal["student", "bench"]
    value: Name


EVENT = TypeAdapter[Any](Annotated[Started | Ended | Lacked | Refused | Unused, Field(discriminator="event")])


def read_reports(data: bytes) -> CellReports:
    """Read the reports on cells that a run left. Lines of another form, and all beyond the bounds, are ignored."""
    cells: dict[tuple[str, str], CellReport] = {}
    refusals: dict[tuple[str, str], Refusal] = {}
    unused: dict[tuple[str, str, str], None] = {}
    latest = ("", "")
    for event in _events(data):
        if isinstance(event, Started):
            latest = event.notebook, event.cell
            cells[latest] = CellReport(*latest, finished=False)
        elif isinstance(event, Ended):
            where = event.notebook, event.cell
            error = None if event.error is None else CellError(**dict(event.error))
            cells[where] = replace(cells.get(where, CellReport(*where, False)), finished=True, error=error)
        elif isinstance(event, Refused):
            refusals[event.question, event.part] = Refusal(event.question, event.part, event.why)
        elif isinstance(event, Unused):
            unused[event.notebook, event.name, event.value] = None
        elif latest in cells:
            lacked = dict.fromkeys((*cells[latest].lacked, (event.question, event.part)))
            cells[latest] = replace(cells[latest], lacked=tuple(lacked)[:_MOST_LACKED])
    return CellReports(tuple(cells.values()), tuple(refusals.values()), tuple(unused))


def _events(data: bytes) -> Iterator[Any]:
    for line in data[: cell_reports.MAX_BYTES].splitlines()[:_MOST_EVENTS]:
        with contextlib.suppress(ValidationError):
            yield EVENT.validate_json(line)
