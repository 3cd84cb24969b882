"""Checks that compare answers of each kind. A course's key is a table of these, and of checks that know its plant.

A check is given a decoded answer (:mod:`labcourse.grading.marking.decoding`: finite numbers, bounded in size) and the
case, and returns a verdict: a status, the share of the points, and the reason, on which a student can act and which an
instructor can defend. Reasons do not give the expected value away.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labcourse.answers import units
from labcourse.answers.forms import Sampled
from labcourse.answers.json_values import thin
from labcourse.answers.parts import WHOLE, Part
from labcourse.errors import CourseError
from labcourse.grading import verdicts
from labcourse.grading.marks import Status
from labcourse.grading.verdicts import EARLIER_ANSWERS, Case, NothingFollows, OwnAnswers, OwnBench, Verdict
from labcourse.messages import number_of

MOST_RUNS = 1000  #: of an experiment, far more than anybody makes: a bench repeats none beyond
_FIRST_RUN = 1  # counted as people count
_LONGEST_SHOWN = 40  # characters of a recording's metadata in a message

#: Errors that a calculation with a student's own answers may raise: then nothing follows from them.
EVALUATION_ERRORS = (LookupError, ArithmeticError, ValueError, RuntimeError, CourseError)


@dataclass(frozen=True)
class ForAPerson:
    """An answer in words, or a report as a whole. The course's rubric says what to look for in it.

    Attributes
    ----------
    compare : Markdown, which students read beside their answer when a person has marked it; "" for nothing
    """

    compare: str = ""
    kinds = ("prose", WHOLE)

    def verdict(self, part: Part, value: Any, case: Case) -> Verdict:
        """Leave it to a person."""
        return verdicts.for_a_person("A person will read this.")


def value_from_own(follow: Callable[..., Any] | None, *arguments: Any) -> tuple[Any, str]:
    """Compute the answer that follows from the student's own other answers.

    Parameters
    ----------
    follow : a function of the arguments; None if the answer follows from no other answers
    arguments : the student's own answers, and what else the function takes

    Returns
    -------
    Any
        What the function returns; None if nothing follows: it raises, or its numbers are all zero or not all finite.
    str
        Why nothing follows, with a space before it; "" if something does, or if the reason is not known.
    """
    if follow is None:
        return None, ""
    try:
        result = follow(*arguments)
        numbers = _all_numbers(result)
    except NothingFollows as why:
        return None, f" {why}"
    except EVALUATION_ERRORS:
        return None, ""
    return (result if np.any(numbers) and np.all(np.isfinite(numbers)) else None), ""


def _all_numbers(value: Any) -> NDArray[Any]:
    """Return all numbers of an array, or of lists of arrays of several shapes, as one vector."""
    return np.concatenate([*map(_all_numbers, value)]) if isinstance(value, list | tuple) and value else np.ravel(value)


@dataclass(frozen=True)
class _Numbers:
    """The common part of the checks of numbers; :class:`Number` documents the parameters."""

    what: str
    expected: Callable[[Any], Any]
    rtol: float = 0.02
    atol: float = 0.0
    follow: Callable[[OwnAnswers], Any] | None = None
    follow_what: str = EARLIER_ANSWERS
    follow_rtol: float = 0.02
    slips: Callable[[Any], Mapping[str, Any]] = field(default=lambda bench: {})

    def verdict(self, part: Part, value: Any, case: Case) -> Verdict:
        """Compare an answer with the expected one, with what follows from own answers, then with usual mistakes.

        Raises
        ------
        TypeError
            If the expected one is not as many finite numbers.
        """
        tolerance = _tolerance_text(self.rtol, self.atol, part.unit or part.usual.unit)
        expected = self.expected(case.bench)
        if not _are_numbers(expected) or np.size(expected) != np.size(value):
            asked = number_of(np.size(value), "finite number")
            raise TypeError(f"the key expects {expected!r}, and the answer is {asked}")
        if self._agrees(value, expected, self.rtol):
            return verdicts.right(f"Within {tolerance} of {self.what}.")
        own, why = value_from_own(self.follow, case.own)
        if own is not None and self._agrees(value, own, self.follow_rtol):
            return verdicts.follow_through(f"Not {self.what}, but it agrees with {self.follow_what}.")
        for slip, numbers in self._all_slips(case.bench).items():
            if self._agrees(value, numbers, self.rtol):
                return verdicts.wrong(f"Not {self.what}: {slip}.")
        for factor, offset, unit in itertools.chain(*units.slips(part.unit)) if part.kind == "number" else ():
            if self._agrees(value * factor + offset, expected, self.rtol):
                return verdicts.wrong(f"Not {self.what}: it looks like it is {unit}.")
        disagrees = f" It does not agree with {self.follow_what} either." if own is not None else why
        return verdicts.wrong(f"More than {tolerance} off {self.what}.{disagrees}")

    def compared(self, part: Part, bench: Any) -> str:
        """Return as text what answers on a bench are compared with, for an instructor: students must not see it."""
        wanted = np.array2string(np.asarray(self.expected(bench)), precision=5, separator=", ")
        tolerance = _tolerance_text(self.rtol, self.atol, part.unit or part.usual.unit)
        follows = f" An answer that agrees with {self.follow_what} counts, too." if self.follow else ""
        return f"{self.what}: {wanted} {part.unit or part.usual.unit}".rstrip() + f", within {tolerance}.{follows}"

    def _agrees(self, value: Any, wanted: Any, rtol: float) -> bool:
        """Return whether an answer is within the tolerance (``rtol``, and :attr:`atol`) of a value."""
        return same_entries(value, wanted, rtol, self.atol)

    def _all_slips(self, bench: Any) -> Mapping[str, Any]:
        """Return common mistakes: what was done → the value that it leads to on this bench."""
        return self.slips(bench)


def _are_numbers(value: Any) -> bool:
    """Return whether a value is numbers, real or complex, all of them finite."""
    try:
        return bool(np.all(np.isfinite(np.asarray(value, dtype=complex))))
    except (TypeError, ValueError):
        return False


def _tolerance_text(rtol: float, atol: float, unit: str) -> str:
    """Return a tolerance as text: "5 %", "0.02 s" or "5 % or 0.02 s"; "" if both are 0."""
    return " or ".join([f"{100 * rtol:g} %"] * bool(rtol) + [f"{atol:g} {unit}".rstrip()] * bool(atol))


@dataclass(frozen=True)
class Number(_Numbers):
    """A number near what the student's own bench gives, or else near what their own earlier answers give.

    Parameters
    ----------
    what : the quantity, as in "the time constant of your bench"
    expected : function of the bench
    rtol : tolerance, relative
    atol : tolerance in the part's unit; the larger of the two counts
    follow : function of the student's own answers; None if the number follows from no others
    follow_what : name of that for messages, as "the product of your own two factors"
    follow_rtol : relative tolerance for it; ``atol`` holds for it, too
    slips : function of the bench that returns common mistakes: what was done → the value that it leads to
    fewest_digits : the expected number is right, too, when it is rounded to so many significant digits; 0 for never
    own_bench : how to recognise the number of another bench; None where that is not looked for
    """

    fewest_digits: int = 0
    own_bench: OwnBench | None = None
    kinds = ("number",)

    def verdict(self, part: Part, value: Any, case: Case) -> Verdict:
        """Compare an answer within the tolerances, and with the expected number rounded."""
        verdict = super().verdict(part, value, case)
        if verdict.status is not Status.RIGHT and self.fewest_digits:
            rounded = float(f"{self.expected(case.bench):.{self.fewest_digits}g}")
            if _near(value, rounded, 1e-9):
                return verdicts.right(f"It is {self.what}, rounded.")
        return verdict


@dataclass(frozen=True)
class MatrixIs(_Numbers):
    """A matrix or a vector, each entry within the tolerance; the parameters are those of :class:`Number`."""

    kinds = ("matrix",)


@dataclass(frozen=True)
class PolesAre(_Numbers):
    """Poles in any order, each within the tolerance; the parameters are those of :class:`Number`."""

    kinds = ("poles",)

    def _agrees(self, value: Any, wanted: Any, rtol: float) -> bool:
        return same_poles(value, wanted, rtol, self.atol)

    def _all_slips(self, bench: Any) -> Mapping[str, Any]:
        return {MIRRORED: mirrored(np.asarray(self.expected(bench))), **self.slips(bench)}


@dataclass(frozen=True)
class FunctionIs:
    """A function that returns the same as the expected one, for all inputs of the part's probe.

    Parameters
    ----------
    what : as in "the flow out of your tank"
    expected : function of the bench and the inputs, as ``lambda bench, h: bench.c * math.sqrt(h)``: a number or an
        array, or a tuple of these where the probe keeps several
    rtol, atol : tolerance, relative and absolute; the larger of the two counts. Outputs are kept to six digits.
    follow : function of the student's own answers and the inputs; None if it follows from no others
    follow_what : what that is, as in "your own constant"
    slips : usual mistakes: what was done → a function of the bench and the inputs, for what it leads to
    """

    what: str
    expected: Callable[..., Any]
    rtol: float = 1e-4
    atol: float = 0.0
    follow: Callable[..., Any] | None = None
    follow_what: str = EARLIER_ANSWERS
    slips: Mapping[str, Callable[..., Any]] = field(default_factory=dict)
    kinds = ("function",)

    def verdict(self, part: Part, value: Any, case: Case) -> Verdict:
        """Compare the outputs of the answer with those of the expected function, then of the others."""
        assert part.probe is not None
        inputs = part.probe.inputs(case.probe_seed)

        def outputs(function: Callable[..., Any], source: Any) -> list[Any]:
            """Return what a function of a bench, or of own answers, returns for each of the inputs."""
            return [function(source, *arguments) for arguments in inputs]

        if self._same(value, outputs(self.expected, case.bench)):
            return verdicts.right(f"Called with other inputs, it gives {self.what}.")
        own, why = value_from_own(self.follow and partial(outputs, self.follow), case.own)
        if own is not None and self._same(value, own):
            return verdicts.follow_through(f"Not {self.what}, but it agrees with {self.follow_what}.")
        for slip, function in self.slips.items():
            if self._same(value, outputs(function, case.bench)):
                return verdicts.wrong(f"Not {self.what}: {slip}.")
        return verdicts.wrong(f"Called with other inputs, it gives something else than {self.what}.{why}")

    def _same(self, value: Any, expected: list[Any]) -> bool:
        """Return whether an answer has the expected outputs, within the tolerance.

        Parameters
        ----------
        value : per input, the answered outputs
        expected : per input, the output, or the tuple of outputs, of the function

        Raises
        ------
        ValueError
            If the two are not for the same number of inputs.
        """
        tuples = [_as_tuple(output) for output in expected]
        return all(
            len(answered) == len(wanted)
            and all(same_entries(*pair, self.rtol, self.atol) for pair in zip(answered, wanted, strict=True))
            for answered, wanted in zip(value, tuples, strict=True)
        )


_ZERO_ROOM = 1e-3  # an entry that should be zero may be off by this share of the tolerance of the largest entry


def same_entries(value: Any, expected: Any, rtol: float, atol: float = 0.0) -> bool:
    """Return whether two arrays have the same entries, within a tolerance; a vector may be a row or a column.

    Parameters
    ----------
    value, expected : of any shape
    rtol : relative to the expected entry
    atol : absolute; the larger of the two counts, and a thousandth of ``rtol`` of the largest entry if that is more
    """
    answered, wanted = np.ravel(value), np.ravel(np.asarray(expected, dtype=float))
    return answered.shape == wanted.shape and bool(np.all(np.abs(answered - wanted) <= _tolerances(wanted, rtol, atol)))


def same_poles(value: Any, expected: Any, rtol: float, atol: float = 0.0) -> bool:
    """Return whether two sets of poles are the same, in any order; the tolerance is that of :func:`same_entries`."""
    from scipy.optimize import linear_sum_assignment

    answered, wanted = np.ravel(value).astype(complex), np.ravel(expected).astype(complex)
    if answered.shape != wanted.shape:
        return False
    tolerances = np.maximum(_tolerances(wanted, rtol, atol), np.finfo(float).tiny)
    distance = np.abs(answered[:, None] - wanted[None, :]) / tolerances
    return bool(distance[linear_sum_assignment(distance)].max() <= 1)


def _tolerances(wanted: NDArray[Any], rtol: float, atol: float) -> NDArray[np.float64]:
    """Return the absolute tolerance of each entry; parameters as for :func:`same_entries`."""
    sizes = np.abs(wanted)
    return np.asarray(np.maximum(np.maximum(rtol * sizes, atol), _ZERO_ROOM * rtol * sizes.max(initial=0.0)))


MIRRORED = "the signs of the real parts are turned round"


def mirrored(poles: NDArray[Any]) -> NDArray[Any]:
    """Return poles with the signs of their real parts changed."""
    return np.asarray(-np.conj(poles))


def _near(value: float, target: float, rtol: float) -> bool:
    """Return whether a value is within a relative tolerance of a target."""
    return abs(value - target) <= rtol * abs(target)


@dataclass(frozen=True)
class ChoiceIs:
    """One of several words.

    Parameters
    ----------
    expected : the right choice; or a function of the bench that returns it
    reason : why it is right
    follow : a function of the student's own answers and the bench: the choice that they make right
    follow_what : what these answers are, as in "your own two factors"
    """

    expected: str | Callable[[Any], str]
    reason: str
    follow: Callable[[OwnAnswers, Any], str] | None = None
    follow_what: str = EARLIER_ANSWERS
    kinds = ("choice",)

    def verdict(self, part: Part, value: Any, case: Case) -> Verdict:
        """Compare a choice with the right one, then with the one that own answers make right.

        Raises
        ------
        TypeError
            If the right one is none of the choices, as "Yes" is not where "yes" is one.
        """
        expected = self.expected(case.bench) if callable(self.expected) else self.expected
        if expected not in part.choices:
            raise TypeError(f"the key expects {expected!r}, and the choices are {', '.join(map(repr, part.choices))}")
        if value == expected:
            return verdicts.right(self.reason)
        if self.follow is not None:
            try:
                if value == self.follow(case.own, case.bench):
                    return verdicts.follow_through(f"It agrees with {self.follow_what}.")
            except EVALUATION_ERRORS:
                pass  # no own answer to compare with
        return verdicts.wrong("Look again at what decides it.")


@dataclass(frozen=True)
class RecordingOf:
    """A recording that the student's own bench gives again when the experiment is repeated.

    Parameters
    ----------
    recording : a function of the bench, and of the number of the run where ``runs``
    channel : to compare
    rtol : largest misfit in shape (:func:`misfit`). A whole channel is moved a little by where the bench came to rest
        before, so means are not compared.
    slips : usual mistakes that the metadata of the recording shows: (name, right value) → what was done
    runs : whether the runs of a bench differ: then a recording is compared with the run that it claims to be
        (:func:`claimed_run`)
    """

    recording: Callable[..., Sampled]
    channel: str
    rtol: float
    slips: Mapping[tuple[str, str], str] = field(default_factory=dict)
    runs: bool = False
    kinds = ("recording",)

    def verdict(self, part: Part, value: Any, case: Case) -> Verdict:
        """Compare the samples of the channel with those that the bench gives again."""
        refused = refused_recording(part, value, case)
        if refused is not None:
            return refused
        of_run = (claimed_run(value["metadata"]),) if self.runs else ()
        expected = self.recording(case.bench, *of_run)
        if value["n"] != len(expected) or not _near(value["sample_time"], expected.sample_time, 1e-3):
            return verdicts.wrong(
                "It has another length or sample time than the experiment as the notebook describes it."
            )
        if self.channel not in expected.channels:
            channels = ", ".join(expected.channels)
            raise TypeError(f"the key compares {self.channel}, and its experiment records {channels}")
        samples = value["channels"][self.channel]["values"]
        wanted = expected.channels[self.channel].values
        difference = misfit(samples, wanted[thin(len(expected), samples.size)])
        if difference <= self.rtol:
            return verdicts.right(f"Your {case.bench_word} gives the same when the experiment is run again.")
        for (name, usual), slip in self.slips.items():
            if value["metadata"].get(name, usual) != usual:
                return verdicts.wrong(slip)
        return verdicts.wrong(
            f"Not a recording of your {case.bench_word}: run again as the notebook describes it, on your own, the "
            f"experiment gives another {self.channel}."
        )


def of_unknown_bench(case: Case) -> Verdict:
    """Return the verdict on what was measured where the truth is not known: a person has to look at it."""
    return verdicts.for_a_person(f"It comes from no {case.bench_word} that is known here; a person will look at it.")


def refused_recording(part: Part, value: dict[str, Any], case: Case) -> Verdict | None:
    """Return the verdict on a recording that must not be compared, or is of another experiment; None otherwise."""
    if not case.truth_is_known:
        return of_unknown_bench(case)
    for name, wanted in part.settings:
        if value["metadata"].get(name, wanted) != wanted:
            return verdicts.wrong(f"It is not the recording that is asked for: its {name} should be {wanted!r}.")
    try:
        claimed_run(value["metadata"])
    except ValueError as error:
        return verdicts.wrong(str(error))
    return None


def claimed_run(metadata: Mapping[str, Any]) -> int:
    """Return the number of the run that a recording claims to be, ``metadata["bench"]["run"]``; 1 if it has none.

    Raises
    ------
    ValueError
        If it is not the number of a run; the message is for the student.
    """
    bench = metadata.get("bench")
    run = bench.get("run", _FIRST_RUN) if isinstance(bench, Mapping) else _FIRST_RUN
    if isinstance(run, int) and not isinstance(run, bool) and _FIRST_RUN <= run <= MOST_RUNS:
        return run
    raise ValueError(
        f"It says that it is run {repr(run)[:_LONGEST_SHOWN]}. Runs have whole numbers from "
        f"{_FIRST_RUN} to {MOST_RUNS}: record it again with one of these."
    )


def misfit(values: NDArray[np.float64], reference: NDArray[np.float64]) -> float:
    """Return how much the shape of a signal differs from that of a reference, both (n,).

    Each signal's own mean is taken away. The RMS difference is relative to the standard deviation of the reference; it
    is inf if that is 0.
    """
    signal, wanted = values - values.mean(), reference - reference.mean()
    ratio = float(np.sqrt(np.mean((signal - wanted) ** 2) / np.mean(wanted**2)))
    return ratio if math.isfinite(ratio) else math.inf


# --- wrong answers, made from right ones: a key must not mark them as right -------------------------------------------

_FACTOR, _OFFSET = 1.37, 0.11  # no factor between units, and more than any rounding
# Added to a number, as a share of its plausible range: a number that is nearly zero is not made wrong by a factor.
_SHARE_OF_RANGE = 0.05


def wrong_answers(part: Part, value: Any) -> Iterator[tuple[str, Any]]:
    """Yield wrong answers of the same form as a right one, each with its description.

    Parameters
    ----------
    part : part of a question, not prose
    value : the right answer, decoded (:func:`labcourse.answers.forms.decode`)
    """
    yield "a wrong answer", _WRONG_BY_KIND[part.kind](part, value)
    low, high = part.plausible or (0.0, 0.0)
    if part.kind in ("number", "matrix", "poles") and np.abs(value).max() > _SHARE_OF_RANGE * (high - low):
        yield "the right answer with its sign turned", -value
        yield "ten times the right answer", 10 * value


def slips_of(check: Any, part: Part, case: Case) -> Iterator[tuple[str, Any]]:
    """Yield the usual mistakes that a check of numbers or of a function knows: what was done, and the answer."""
    if isinstance(check, _Numbers):
        for slip, numbers in check._all_slips(case.bench).items():
            yield f"the slip {slip!r}", np.asarray(numbers)
    elif isinstance(check, FunctionIs) and part.probe is not None:
        inputs = part.probe.inputs(case.probe_seed)
        for slip, function in check.slips.items():
            yield f"the slip {slip!r}", [_as_tuple(function(case.bench, *arguments)) for arguments in inputs]


def value_that_follows(check: Any, part: Part, case: Case) -> Any:
    """Return what a check of this module lets follow from own answers; None if nothing follows. Raise what it raises.

    For a function, it is what follows for the first of the inputs.
    """
    if not isinstance(check, _Numbers | ChoiceIs | FunctionIs) or check.follow is None:
        return None
    more = (case.bench,) if isinstance(check, ChoiceIs) else part.probe.inputs(case.probe_seed)[0] if part.probe else ()
    return check.follow(case.own, *more)


def _as_tuple(output: Any) -> tuple[Any, ...]:
    """Return the output of a function as a tuple of outputs."""
    return output if isinstance(output, tuple) else (output,)


def _wrong_number(part: Part, value: Any) -> Any:
    """Return a number, or an array, that is off by a factor and an offset."""
    low, high = part.plausible or (0.0, 0.0)
    return value * _FACTOR + max(_OFFSET, _SHARE_OF_RANGE * (high - low))


def _wrong_equation(part: Part, value: Any) -> Any:
    """Return the equation with more on its left side."""
    import sympy

    return sympy.Eq(value.lhs + sympy.Symbol(part.symbols[0]) + 1, value.rhs, evaluate=False)


def _wrong_recording(part: Part, value: Any) -> Any:
    """Return the recording with each channel backwards and scaled."""
    return {**value, "channels": {name: _reverse(channel, "values") for name, channel in value["channels"].items()}}


def _wrong_figure(part: Part, value: Any) -> Any:
    """Return the figure with each line backwards and scaled."""
    axes = [{**axis, "lines": [_reverse(line, "y") for line in axis["lines"]]} for axis in value["axes"]]
    return {**value, "axes": axes}


def _reverse(samples: dict[str, Any], name: str) -> dict[str, Any]:
    """Return a copy of a channel or a line, with the array of this name reversed and scaled."""
    return {**samples, name: samples[name][::-1] * _FACTOR}


_WRONG_BY_KIND: dict[str, Callable[[Part, Any], Any]] = {
    "number": _wrong_number,
    "matrix": _wrong_number,
    "poles": lambda part, value: value * _FACTOR - _OFFSET,
    "choice": lambda part, value: next(other for other in part.choices if other != value),
    "expression": lambda part, value: value * 3 + 1,
    "equation": _wrong_equation,
    "symbolic_matrix": lambda part, value: value.applyfunc(lambda entry: entry * 3 + 1),
    "function": lambda part, value: [tuple(_wrong_number(part, array) for array in output) for output in value],
    "recording": _wrong_recording,
    "figure": _wrong_figure,
}
