"""What a question is made of: parts, each with a name, a kind and its points.

The kinds, and what an answer of each looks like to a student:

===================  =============================================================================================
``number``           one real number in ``unit``
``matrix``           real numbers of ``shape``; with one row or column, or a one-dimensional shape, a vector
``poles``            ``count`` real or complex numbers, in any order
``choice``           one of ``choices``
``prose``            text
``expression``       a sympy expression in ``symbols``
``equation``         ``sympy.Eq``, or a pair (left, right), or an expression that is zero, in ``symbols``
``symbolic_matrix``  a sympy Matrix of ``shape``, in ``symbols``
``function``         a function, called on the inputs of ``probe``
``figure``           a matplotlib figure with curves
``recording``        signals sampled together (:class:`~labcourse.answers.forms.Sampled`), with ``channels``
``whole``            nothing: a person judges a report by all of its texts
===================  =============================================================================================
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labcourse.answers.json_values import FormError, check_given, read_vector, rounded
from labcourse.errors import AnswerError
from labcourse.problems import Where


@dataclass(frozen=True)
class Probe:
    """Inputs for a function and the form of its outputs.

    A function of several arguments takes another ``draw`` than one of :meth:`scalar`, for example of h and u::

        flow = Probe.scalar("flow(h, u)", (0.1, 1.0), "q in m³/s")
        flow = replace(flow, draw=lambda rng: [*map(tuple, rng.uniform((0.1, 0.0), (1.0, 5.0), (8, 2)).tolist())])

    Attributes
    ----------
    name : of the probe; with the seed, it fixes the inputs
    signature : of the function, for messages
    count : how many inputs there are
    draw : the inputs, a list of argument tuples, from a numpy Generator
    keep : an output as plain data; raises FormError or NotAnswered where it is none
    read : an output's plain data as a tuple of arrays; raises AnswerError where it is none
    """

    name: str
    signature: str
    count: int
    draw: Callable[[np.random.Generator], list[tuple[Any, ...]]]
    keep: Callable[[Any], list[Any]]
    read: Callable[[Any], tuple[NDArray[np.float64], ...]]

    @classmethod
    def scalar(cls, signature: str, span: tuple[float, float], returns: str, count: int = 8) -> Probe:
        """Try a function of one number that gives one number.

        Parameters
        ----------
        signature : of the function, as in "outflow(h)"; also the name of the probe
        span : from which the inputs are drawn
        returns : what it gives, with its unit, as in "q in m³/s"
        count : how many inputs there are
        """

        def draw(rng: np.random.Generator) -> list[tuple[Any, ...]]:
            return [(value,) for value in rng.uniform(*span, count).tolist()]

        def keep(output: Any) -> list[Any]:
            (array,) = pieces((output,), (returns,))
            if array.size != 1:
                raise FormError(f"it should return one number, {returns}; it returned {array.size}")
            return rounded(array.ravel())

        def read(data: Any) -> tuple[NDArray[np.float64], ...]:
            return (read_vector(signature, data, 1, 1),)

        return cls(signature, signature, count, draw, keep, read)

    def inputs(self, seed: int) -> list[tuple[Any, ...]]:
        """Return the argument tuples for a probe seed; probes of one seed do not depend on each other."""
        return self.draw(np.random.default_rng([seed, zlib.crc32(self.name.encode())]))


def pieces(output: Any, names: tuple[str, ...]) -> list[NDArray[np.float64]]:
    """Return a function's output as so many arrays of finite numbers.

    Raises
    ------
    NotAnswered
        If there is nothing yet.
    FormError
        If it is anything else; the message is a hint for the student.
    """
    wanted = f"it should return ({', '.join(names)})"
    check_given(output)
    if isinstance(output, np.ndarray) and output.ndim > 1 and len(output) == len(names):  # its rows
        output = list(output)
    if not isinstance(output, tuple | list) or len(output) != len(names):
        length = f" of {len(output)}" if isinstance(output, tuple | list) else ""
        raise FormError(f"{wanted}; it returned a {type(output).__name__}{length}")
    arrays = []
    for name, piece in zip(names, output, strict=True):
        check_given(piece)
        array = _array(piece)
        if array is None:
            raise FormError(f"{wanted}, all numbers; {name} is not")
        if array.dtype.kind == "c":
            raise FormError(f"{name} is complex: take the magnitude, or drop an imaginary part that is zero")
        if not np.isfinite(array).all():
            raise FormError(f"{name} has values that are not finite (NaN or infinite)")
        arrays.append(array.astype(np.float64))
    return arrays


def _array(piece: Any) -> NDArray[Any] | None:
    """Return a piece as an array of numbers, or None."""
    try:
        array = np.asarray(piece)
        if array.dtype.kind == "O":  # sympy's numbers and the like
            array = array.astype(np.float64)
    except (TypeError, ValueError):
        return None
    return array if array.dtype.kind in "iufc" else None


@dataclass(frozen=True)
class Usual:
    """What an answer usually is. Other answers are recorded, too, with a hint.

    Attributes
    ----------
    largest : the range of the size of a matrix's largest entry, in ``unit``
    unit : in which entries of a matrix, or poles, are to be given
    digits : significant digits that at least one entry of a matrix has
    settings : (name, value) pairs of a recording's metadata
    """

    largest: tuple[float, float] | None = None
    unit: str = ""
    digits: int = 0
    settings: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True)
class Part:
    """One thing asked for. ``lab.answer`` takes it by its name.

    Attributes
    ----------
    name, kind, points, prompt : what every part has
    outcome : the code of the outcome that it gives evidence of; empty where the course names none
    marked : "auto", or "person" where somebody has to read it
    unit : of a number; what the student is asked to give
    plausible : the range (in ``unit``) outside which a number is worth a second look
    shape : of a matrix; (n,) is a vector for which row or column does not matter
    row_names : of a matrix that may be given with more rows than its shape has: all rows, those of the shape first
    count : how many poles
    symbols : the symbols that are given
    choices : the allowed values
    probe : the inputs on which a function is tried
    channels : the channels that a recording must have
    units : of all channels that are stored of a recording: name → unit
    settings : (name, value) pairs that are expected in a recording's metadata
    unfit : of a recording, why it cannot be an answer; None if it can
    read : turns what a student may have a recording in into a recording; raises FormError
    usual : what draws a hint where it is otherwise, and no more
    shows : for the entry of a results table, the (question, part) that it carries over
    """

    name: str
    kind: str
    points: float
    prompt: str
    outcome: str = ""
    marked: str = "auto"
    unit: str = ""
    plausible: tuple[float, float] | None = None
    shape: tuple[int, ...] = ()
    row_names: tuple[str, ...] = ()
    count: int = 0
    symbols: tuple[str, ...] = ()
    choices: tuple[str, ...] = ()
    probe: Probe | None = None
    channels: tuple[str, ...] = ()
    units: Mapping[str, str] = field(default_factory=dict)
    settings: tuple[tuple[str, str], ...] = ()
    unfit: Callable[[Any], str | None] = lambda _recording: None
    read: Callable[[Any], Any] = lambda given: given
    usual: Usual = Usual()
    shows: Where | None = None

    def __post_init__(self) -> None:
        """Check what is easily mistyped. Raises TypeError if the points are no number, or the choices are one text."""
        is_number = isinstance(self.points, int | float) and not isinstance(self.points, bool)
        if not (is_number and 0 <= self.points < math.inf):
            raise TypeError(f"{self.name}: points should be a number, 0 or more, without quotes; it is {self.points!r}")
        if isinstance(self.choices, str):
            raise TypeError(f'{self.name}: choices should be several texts, as ("yes", "no"); it is {self.choices!r}')

    @property
    def rows_and_columns(self) -> tuple[int, ...]:
        """The shape in which a matrix is stored: a vector (n,) as one row."""
        return (1, *self.shape)[-2:]


@dataclass(frozen=True)
class Question:
    """One of the course's questions, a results table, or the text of a report.

    Attributes
    ----------
    number : as in "1.2", "Table 1" or "First report"
    section : of the course's text
    notebook : where it is asked
    title : in a few words
    outcomes : the codes that the course gives it
    parts : in the order in which they are asked
    """

    number: str
    section: str
    notebook: str
    title: str
    outcomes: tuple[str, ...]
    parts: tuple[Part, ...]

    @property
    def points(self) -> float:
        """Points of all its parts."""
        return sum(part.points for part in self.parts)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of its parts."""
        return tuple(part.name for part in self.parts)

    def part(self, name: str) -> Part:
        """Return the part of a name.

        Raises
        ------
        AnswerError
            If there is none; the message names those that there are.
        """
        for part in self.parts:
            if part.name == name:
                return part
        raise AnswerError(f"Question {self.number} has no part {name!r}; it has {', '.join(self.names)}.")


@dataclass(frozen=True)
class ReportItem:
    """A row of the scoring sheet of a report.

    Attributes
    ----------
    report : number of the report, as in "First report"
    number : as on the sheet, as in "II.1"
    heading, prompt : what it is about and what it asks for
    outcomes : the codes scored in this row
    shows : the (question, part) that it shows or discusses; a part "" stands for all of the question
    part : name of the report's part that holds its text; "" where answers are shown as they are
    judged : name of the part under which the report as a whole is judged in this row; "" in all other rows
    """

    report: str
    number: str
    heading: str
    prompt: str
    outcomes: tuple[str, ...]
    shows: tuple[Where, ...] = ()
    part: str = ""
    judged: str = ""


# --- parts, briefly, for the catalogue --------------------------------------------------------------------------------

YES_NO = ("yes", "no")
WHOLE = "whole"  #: the kind of what is judged, and not answered


def prose(name: str, outcome: str, prompt: str, points: float = 1) -> Part:
    """Ask for text, which a person reads."""
    return Part(name, "prose", points, prompt, outcome, marked="person")


def number(
    name: str, unit: str, plausible: tuple[float, float] | None, outcome: str, prompt: str, points: float = 1
) -> Part:
    """Ask for a number in a unit."""
    return Part(name, "number", points, prompt, outcome, unit=unit, plausible=plausible)


def matrix(
    name: str, shape: tuple[int, ...], outcome: str, prompt: str, points: float = 1, usual: Usual = Usual()
) -> Part:
    """Ask for a matrix or vector of numbers."""
    return Part(name, "matrix", points, prompt, outcome, shape=shape, usual=usual)


def poles(name: str, count: int, outcome: str, prompt: str, points: float = 1, *, unit: str = "1/s") -> Part:
    """Ask for a set of poles, or of other complex numbers, in a unit; "" is for none, as of poles in z."""
    return Part(name, "poles", points, prompt, outcome, count=count, usual=Usual(unit=unit))


def choice(name: str, choices: tuple[str, ...], outcome: str, prompt: str, points: float = 1) -> Part:
    """Ask for one of a few words."""
    return Part(name, "choice", points, prompt, outcome, choices=choices)


def expression(name: str, symbols: tuple[str, ...], outcome: str, prompt: str, points: float = 2) -> Part:
    """Ask for a sympy expression in given symbols."""
    return Part(name, "expression", points, prompt, outcome, symbols=symbols)


def figure(name: str, outcome: str, prompt: str, points: float = 1) -> Part:
    """Ask for a figure."""
    return Part(name, "figure", points, prompt, outcome)


def recording(
    name: str,
    settings: Mapping[str, str],
    channels: tuple[str, ...],
    outcome: str,
    prompt: str,
    points: float = 1,
    *,
    units: Mapping[str, str],
    unfit: Callable[[Any], str | None] = lambda _recording: None,
    read: Callable[[Any], Any] = lambda given: given,
    usual: Usual = Usual(),
) -> Part:
    """Ask for a recording of an experiment."""
    more: dict[str, Any] = {"units": units, "unfit": unfit, "read": read, "usual": usual}
    more["settings"] = tuple(settings.items())
    return Part(name, "recording", points, prompt, outcome, channels=channels, **more)


def function(name: str, probe: Probe, outcome: str, prompt: str, points: float = 2) -> Part:
    """Ask for a function, which is tried on a probe's inputs."""
    return Part(name, "function", points, prompt, outcome, probe=probe)


def entry(question: Question, name: str, points: float = 0.5) -> Part:
    """Let a results table carry over a part of a question."""
    return replace(question.part(name), points=points, shows=(question.number, name))


@dataclass(frozen=True)
class Predictable:
    """Something that can be predicted of an experiment.

    Attributes
    ----------
    part : its name, kind ("number" or "choice"), unit and choices, and what is asked; it is worth no points
    found_in : answers, (question, part), that show it once the experiment is done
    seen : these answers → what they show, a number in the part's unit or one of its choices
    ask : what to think about when both are there
    """

    part: Part
    found_in: tuple[tuple[str, str], ...]
    seen: Callable[..., Any]
    ask: str
