"""Checks that compare answers of each kind. A course's key is a table of these, and of checks that know its plant.

A check is given a decoded answer (:mod:`labcourse.grading.marking.decoding`: finite numbers, bounded in size) and the
case, and returns a verdict: a status, the share of the points, and the reason, on which a student can act and which an
instructor can defend. Reasons do not give the expected value away.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labcourse.answers.forms import Sampled
from labcourse.answers.json_values import thin
from labcourse.answers.parts import WHOLE, Part
from labcourse.errors import CourseError
from labcourse.grading import verdicts
from labcourse.grading.verdicts import OWN_ANSWERS, Case, NothingFollows, Own, OwnBench, Status, Verdict

MOST_RUNS = 1000  #: of an experiment, far more than anybody makes: a bench repeats none beyond
_FIRST_RUN = 1  # counted as people count
_LONGEST_SHOWN = 40  # characters of what a recording says

#: Errors that a calculation with a student's own answers may raise: then nothing follows from them.
EVALUATION_ERRORS = (LookupError, ArithmeticError, ValueError, RuntimeError, CourseError)


@dataclass(frozen=True)
class ForAPerson:
    """An answer in words, or a report as a whole. The course's rubric says what to look for in it."""

    kinds = ("prose", WHOLE)

    def verdict(self, part: Part, value: Any, case: Case) -> Verdict:
        """Leave it to a person."""
        return verdicts.for_a_person("A person will read this.")


def led_to(follow: Callable[..., Any] | None, *given: Any) -> tuple[Any, str]:
    """Work out what follows from the student's own answers.

    Parameters
    ----------
    follow : a function of ``given``; None where nothing comes before
    given : the student's own answers, and what else it takes

    Returns
    -------
    Any
        What it returns; None where nothing follows, as where all of it is zero.
    str
        Why nothing follows, with a space before it; empty where that is not known.
    """
    if follow is None:
        return None, ""
    try:
        result = follow(*given)
        numbers = _flat(result)
    except NothingFollows as why:
        return None, f" {why}"
    except EVALUATION_ERRORS:
        return None, ""
    return (result if np.any(numbers) and np.all(np.isfinite(numbers)) else None), ""


def _flat(value: Any) -> NDArray[Any]:
    """Return all numbers of an array, or of a list of arrays of several shapes, as one vector."""
    return np.concatenate([*map(_flat, value)]) if isinstance(value, list | tuple) and value else np.ravel(value)


@dataclass(frozen=True)
class _Numbers:
    """The common part of the checks of numbers; :class:`Number` documents the parameters."""

    what: str
    expected: Callable[[Any], Any]
    rtol: float = 0.02
    atol: float = 0.0
    follow: Callable[[Own], Any] | None = None
    follow_what: str = OWN_ANSWERS
    follow_rtol: float = 0.02
    slips: Callable[[Any], Mapping[str, Any]] = field(default=lambda bench: {})

    def verdict(self, part: Part, value: Any, case: Case) -> Verdict:
        """Compare with the bench, then with the student's own answers, then with usual mistakes."""
        room = _room(self.rtol, self.atol, part.unit or part.usual.unit)
        if self._agrees(value, self.expected(case.bench), self.rtol):
            return verdicts.right(f"Within {room} of {self.what}.")
        own, why = led_to(self.follow, case.own)
        if own is not None and self._agrees(value, own, self.follow_rtol):
            return verdicts.follow_through(f"Not {self.what}, but it agrees with {self.follow_what}.")
        for slip, numbers in self._all_slips(case.bench).items():
            if self._agrees(value, numbers, self.rtol):
                return verdicts.wrong(f"Not {self.what}: {slip}.")
        disagrees = f" It does not agree with {self.follow_what} either." if own is not None else why
        return verdicts.wrong(f"More than {room} off {self.what}.{disagrees}")

    def _agrees(self, value: Any, wanted: Any, rtol: float) -> bool:
        return same_entries(value, wanted, rtol, self.atol)

    def _all_slips(self, bench: Any) -> Mapping[str, Any]:
        return self.slips(bench)


def _room(rtol: float, atol: float, unit: str) -> str:
    """Write a tolerance as "5 %", "0.02 s" or "5 % or 0.02 s"."""
    return " or ".join([f"{100 * rtol:g} %"] * bool(rtol) + [f"{atol:g} {unit}".rstrip()] * bool(atol))


@dataclass(frozen=True)
class Number(_Numbers):
    """A number near what the student's own bench gives, or else near what their own earlier answers give.

    Parameters
    ----------
    what : the quantity, as in "the time constant of your bench"
    expected : of the bench
    rtol : tolerance, relative
    atol : tolerance in the part's unit; the larger of the two counts
    follow : from the student's own answers; None where nothing comes before
    follow_what : what that is, as in "the product of your own two factors"
    follow_rtol : relative tolerance for it; ``atol`` holds for it, too
    slips : of the bench: usual mistakes, what was done → what it leads to
    fewest_digits : the expected number is right, too, when it is rounded to so many significant digits; 0 for never
    own_bench : how to recognise the number of another bench; None where that is not looked for
    """

    fewest_digits: int = 0
    own_bench: OwnBench | None = None
    kinds = ("number",)

    def verdict(self, part: Part, value: Any, case: Case) -> Verdict:
        """Compare within the tolerance, and with the expected number rounded."""
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
    expected : of the bench and the inputs, as in ``lambda bench, h: bench.c * math.sqrt(h)``: a number or an array, or
        a tuple of these where the probe keeps several
    rtol, atol : tolerance, relative and absolute; the larger of the two counts. Outputs are kept to six digits.
    follow : of the student's own answers and the inputs; None where nothing comes before
    follow_what : what that is, as in "your own constant"
    slips : usual mistakes: what was done → a function of the bench and the inputs, for what it leads to
    """

    what: str
    expected: Callable[..., Any]
    rtol: float = 1e-4
    atol: float = 0.0
    follow: Callable[..., Any] | None = None
    follow_what: str = OWN_ANSWERS
    slips: Mapping[str, Callable[..., Any]] = field(default_factory=dict)
    kinds = ("function",)

    def verdict(self, part: Part, value: Any, case: Case) -> Verdict:
        """Compare the outputs."""
        assert part.probe is not None
        inputs = part.probe.inputs(case.probe_seed)

        def outputs(function: Callable[..., Any], of: Any) -> list[Any]:
            return [function(of, *arguments) for arguments in inputs]

        if self._same(value, outputs(self.expected, case.bench)):
            return verdicts.right(f"Called with other inputs, it gives {self.what}.")
        own, why = led_to(self.follow and partial(outputs, self.follow), case.own)
        if own is not None and self._same(value, own):
            return verdicts.follow_through(f"Not {self.what}, but it agrees with {self.follow_what}.")
        for slip, function in self.slips.items():
            if self._same(value, outputs(function, case.bench)):
                return verdicts.wrong(f"Not {self.what}: {slip}.")
        return verdicts.wrong(f"Called with other inputs, it gives something else than {self.what}.{why}")

    def _same(self, value: Any, expected: list[Any]) -> bool:
        tuples = [output if isinstance(output, tuple) else (output,) for output in expected]
        return all(
            len(given) == len(wanted)
            and all(same_entries(*pair, self.rtol, self.atol) for pair in zip(given, wanted, strict=True))
            for given, wanted in zip(value, tuples, strict=True)
        )


_ZERO = 1e-3  # of the relative tolerance, of the largest entry: the room for what should be zero


def same_entries(value: Any, expected: Any, rtol: float, atol: float = 0.0) -> bool:
    """Return whether two arrays have the same entries, within a tolerance; a vector may be a row or a column.

    Parameters
    ----------
    value, expected : of any shape
    rtol : relative to the entry
    atol : absolute; the larger of the two counts
    """
    given, wanted = np.ravel(value), np.ravel(np.asarray(expected, dtype=float))
    return given.shape == wanted.shape and bool(np.all(np.abs(given - wanted) <= _rooms(wanted, rtol, atol)))


def same_poles(value: Any, expected: Any, rtol: float, atol: float = 0.0) -> bool:
    """Return whether two sets of poles are the same, in any order; the tolerance is that of :func:`same_entries`."""
    from scipy.optimize import linear_sum_assignment

    given, wanted = np.ravel(value).astype(complex), np.ravel(expected).astype(complex)
    if given.shape != wanted.shape:
        return False
    rooms = np.maximum(_rooms(wanted, rtol, atol), np.finfo(float).tiny)
    distance = np.abs(given[:, None] - wanted[None, :]) / rooms
    return bool(distance[linear_sum_assignment(distance)].max() <= 1)


def _rooms(wanted: NDArray[Any], rtol: float, atol: float) -> NDArray[np.float64]:
    """Return the tolerance of each entry."""
    sizes = np.abs(wanted)
    return np.asarray(np.maximum(np.maximum(rtol * sizes, atol), _ZERO * rtol * sizes.max(initial=0.0)))


MIRRORED = "the signs of the real parts are turned round"


def mirrored(poles: NDArray[Any]) -> NDArray[Any]:
    """Return poles with the other sign of their real parts."""
    return np.asarray(-np.conj(poles))


def _near(value: float, target: float, rtol: float) -> bool:
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
    follow: Callable[[Own, Any], str] | None = None
    follow_what: str = OWN_ANSWERS
    kinds = ("choice",)

    def verdict(self, part: Part, value: Any, case: Case) -> Verdict:
        """Compare choices."""
        if value == (self.expected(case.bench) if callable(self.expected) else self.expected):
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
    rtol : largest RMS difference, relative. Where a bench came to rest before moves a whole channel a little, so means
        are not compared.
    slips : usual mistakes that the metadata of the recording shows: (name, right value) → what was done
    runs : whether the runs of a bench differ: then a recording is compared with the run that it claims to be
        (:func:`said_run`)
    """

    recording: Callable[..., Sampled]
    channel: str
    rtol: float
    slips: Mapping[tuple[str, str], str] = field(default_factory=dict)
    runs: bool = False
    kinds = ("recording",)

    def verdict(self, part: Part, value: Any, case: Case) -> Verdict:
        """Compare samples."""
        refused = refused_recording(part, value, case)
        if refused is not None:
            return refused
        of_run = (said_run(value["metadata"]),) if self.runs else ()
        expected = self.recording(case.bench, *of_run)
        if value["n"] != len(expected) or not _near(value["sample_time"], expected.sample_time, 1e-3):
            return verdicts.wrong(
                "It has another length or sample time than the experiment as the notebook describes it."
            )
        samples = value["channels"][self.channel]["values"]
        wanted = expected.channels[self.channel].values
        difference = misfit(samples, wanted[thin(len(expected), samples.size)])
        if difference <= self.rtol:
            return verdicts.right("Your bench gives the same when the experiment is run again.")
        for (name, usual), slip in self.slips.items():
            if value["metadata"].get(name, usual) != usual:
                return verdicts.wrong(slip)
        return verdicts.wrong(
            "Not a recording of your bench: run again on your own bench as the notebook describes it, the "
            f"experiment gives another {self.channel}."
        )


def refused_recording(part: Part, value: dict[str, Any], case: Case) -> Verdict | None:
    """Return the verdict on a recording that cannot be compared, or is of another experiment; None if it can be."""
    if not case.virtual:
        return verdicts.for_a_person("It does not come from a bench that is known here; a person will look at it.")
    for name, wanted in part.settings:
        if value["metadata"].get(name) != wanted:
            return verdicts.wrong(f"It is not the recording that is asked for: its {name} should be {wanted!r}.")
    try:
        said_run(value["metadata"])
    except ValueError as error:
        return verdicts.wrong(str(error))
    return None


def said_run(metadata: Mapping[str, Any]) -> int:
    """Return the number of the run that a recording claims to be, ``metadata["bench"]["run"]``; 1 where there is none.

    Raises
    ------
    ValueError
        If it is not the number of a run; the message is for the student.
    """
    about = metadata.get("bench")
    run = about.get("run", _FIRST_RUN) if isinstance(about, Mapping) else _FIRST_RUN
    if isinstance(run, int) and not isinstance(run, bool) and _FIRST_RUN <= run <= MOST_RUNS:
        return run
    raise ValueError(
        f"It says that it is run {repr(run)[:_LONGEST_SHOWN]} of the bench. Runs have whole numbers from "
        f"{_FIRST_RUN} to {MOST_RUNS}: record it again with one of these."
    )


def misfit(values: NDArray[np.float64], reference: NDArray[np.float64]) -> float:
    """Return the RMS difference of two signals (n,) about their means, relative to the reference's (inf if 0)."""
    given, wanted = values - values.mean(), reference - reference.mean()
    ratio = float(np.sqrt(np.mean((given - wanted) ** 2) / np.mean(wanted**2)))
    return ratio if math.isfinite(ratio) else math.inf
