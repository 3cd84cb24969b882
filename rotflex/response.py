"""Measure the response to a square wave, and hold it against the specifications (Section 3.1).

Conventions, which the workbook leaves open; figures can only be compared when they share them:

* A step begins at the first sample at which the *command* moves; with a rate limiter, at the start of the ramp.
* The settling band is ±4 % of the **final value**: ±0.8 deg for the ±20 deg wave, which is 2 % of its 40 deg step. For
  a step that ends nearer to zero than it began, 20 → 0 deg for example, it is 4 % of the value it came from.
* The final value is the commanded one, so that a servo that sticks outside the band has not settled.
* The settling time runs to the first sample from which on the angle stays inside the band.
* The overshoot is per cent **of the step** (40 deg; of 20 deg when the wave starts from 0), beyond the final value.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotflex.doubts import Doubt, require_reliable
from rotflex.errors import ConfigurationError, IdentificationError
from rotflex.recording import Recording
from rotflex.specifications import SETTLING_BAND, SPECIFICATIONS, Specification
from rotflex.units import DEG

__all__ = ["Finding", "StepResponse", "Summary", "measure", "swing", "verdict", "voltage_noise", "worst"]


def __dir__() -> list[str]:
    return __all__


_REST = 1e-6  # of the wave's height: slower changes from sample to sample are rounding, not movement
_STEADY_PART = 0.2  # the last part of a step in which the angle is taken to be at rest
_SHORTEST_PART = 0.75  # of the usual time between steps: with less of it, a last step is not measured
_START_UP = 0.1  # of the wave's height: a servo that begins so far from the first commanded level is on its way there
_ON_COMMAND = 0.01  # of the wave's height: an angle so near is where its command is
_FOLLOWED = 0.5  # of the step: with less, the servo has not followed the command at all
_QUANTITIES = ("settling_time", "overshoot", "steady_state_error", "max_alpha", "max_vm")  # of a summary
_FULL_SIZE = 0.99  # of the largest step


@dataclass(frozen=True)
class StepResponse:
    """One step of the command, and what the servo, the link and the motor did until the next.

    Attributes
    ----------
    start : time at which the command begins to move, s
    before, after : commanded angle before and after, rad
    settling_time : from ``start``, s; ``math.inf`` if the angle is not in the band for good
        by the last fifth of the time until the next step
    peak_time : from ``start`` to the angle's largest value in the step's direction, s
    overshoot : per cent of the step; 0 without any
    steady_state_error : commanded minus measured angle at rest, rad
    max_alpha, max_vm : largest magnitude of the link's deflection, rad, and of the motor voltage, V
    remark : in words, what kept a figure from being measured; empty when all is well
    doubts : about the recording, see :mod:`rotflex.doubts`

    A figure that cannot be measured is ``None``, and ``remark`` says why.
    """

    start: float
    before: float
    after: float
    settling_time: float | None = None
    peak_time: float | None = None
    overshoot: float | None = None
    steady_state_error: float | None = None
    max_alpha: float | None = None
    max_vm: float | None = None
    remark: str = ""
    doubts: tuple[Doubt, ...] = ()

    @property
    def size(self) -> float:
        """Height of the commanded step, rad, positive."""
        return abs(self.after - self.before)

    @property
    def direction(self) -> int:
        """1 for a step up, -1 for a step down."""
        return 1 if self.after > self.before else -1

    @property
    def measurable(self) -> bool:
        """Whether the record is long enough after the step to measure it."""
        return self.steady_state_error is not None


@dataclass(frozen=True)
class Summary:
    """The worst of several steps: what the specifications are about.

    Attributes
    ----------
    settling_time, overshoot, steady_state_error, max_alpha, max_vm :
        the largest magnitude of each, in the units of :class:`StepResponse`; ``None`` where it was not measured
    steps : how many steps this is the worst of
    left_out : how many were left out: smaller ones (the first, from 0) and those that could not be measured
    remarks : what was said about the steps, each with its time
    doubts : about the recordings, see :mod:`rotflex.doubts`
    """

    settling_time: float | None
    overshoot: float | None
    steady_state_error: float | None
    max_alpha: float | None
    max_vm: float | None
    steps: int
    left_out: int
    remarks: tuple[str, ...]
    doubts: tuple[Doubt, ...] = ()


@dataclass(frozen=True)
class Finding:
    """Whether one specification is met (``None``: it was not measured), and the same in words."""

    specification: Specification
    value: float | None
    met: bool | None
    words: str


def measure(recording: Recording, band: float = SETTLING_BAND) -> list[StepResponse]:
    """Find the steps of the command and measure the response to each.

    Every step of ``theta_ref`` is listed, measurable or not. A recording that opens with the servo on its way to the
    command (a wave that starts at 20 deg, a servo at 0) opens with a step from where the servo was.

    Parameters
    ----------
    recording : with theta_ref and theta; alpha and vm are measured where they are there. For arrays:
        ``Recording.of(t, theta_ref=..., theta=..., alpha=..., vm=...)``, in rad and V
    band : half width of the settling band, as a fraction of the final value

    Raises
    ------
    RecordingError
        If the recording lacks theta_ref or theta.
    IdentificationError
        If the recording is not to be relied on: more than 1 % of its samples came late, never or unevenly. Or if the
        command has no steps: it is constant, or is no square wave.
    ConfigurationError
        If ``band`` is not between 0 and 1.
    """
    if not 0 < band < 1:
        raise ConfigurationError(f"band is {band!r}; it is a fraction of the final value, 0.04 for 4 %.")
    require_reliable(recording.doubts)
    moves = _find_moves(recording["theta_ref"], recording["theta"])
    starts = [move.start for move in moves]
    usual = float(np.median(np.diff(starts))) if len(starts) > 1 else 0.0
    responses = []
    for move, stop in zip(moves, [*starts[1:], len(recording)], strict=True):
        step = StepResponse(float(recording.time[move.start]), move.before, move.after, doubts=recording.doubts)
        if stop == len(recording) and (move.at_rest >= stop or stop - move.start < _SHORTEST_PART * usual):
            held = (stop - move.start) * recording.sample_time
            responses.append(replace(step, remark=f"not measurable: the recording ends {held:.3g} s after this step"))
        else:
            responses.append(_measure_step(recording, slice(move.start, stop), step, band))
    return responses


def worst(steps: Sequence[StepResponse]) -> Summary:
    """The worst of the measurable steps of full size.

    The first step of a wave that starts from 0 is half as large and would flatter: it does not count beside full ones.

    Raises
    ------
    IdentificationError
        If none of the steps could be measured.
    """
    measurable = [step for step in steps if step.measurable]
    if not measurable:
        steps_text = "; ".join(_at(step) for step in steps) or "there are no steps"
        raise IdentificationError(f"Nothing could be measured: {steps_text}. Record for longer.")
    largest = max(step.size for step in measurable)
    full = [step for step in measurable if step.size >= _FULL_SIZE * largest]
    values = {name: [getattr(step, name) for step in full] for name in _QUANTITIES}
    return Summary(
        **{name: None if None in found else max(map(abs, found)) for name, found in values.items()},
        steps=len(full),
        left_out=len(steps) - len(full),
        remarks=tuple(_at(step) for step in steps if step.remark),
        doubts=tuple({doubt.code: doubt for step in steps for doubt in step.doubts}.values()),
    )


def verdict(summary: Summary, specifications: Sequence[Specification] = SPECIFICATIONS) -> list[Finding]:
    """Hold a summary against specifications, one finding each. Doubts about the recording are named in its words."""
    doubted = "".join(f" Doubt: {doubt.code}." for doubt in summary.doubts)
    found = (_judge(getattr(summary, one.quantity), one) for one in specifications)
    return [replace(one, words=f"{one.words}{doubted}") for one in found]


# --- finding the steps -----------------------------------------------------------------------------------------------


class _Move(NamedTuple):
    """A move of the command: it begins at sample ``start`` and rests from ``at_rest``; its value before and after."""

    start: int
    at_rest: int
    before: float
    after: float


def _find_moves(reference: NDArray[np.float64], theta: NDArray[np.float64]) -> list[_Move]:
    """The moves of the command. One that still goes on when the record ends rests at ``reference.size``."""
    height = float(np.ptp(reference))
    if height == 0:
        raise IdentificationError(
            f"The command is constant, {reference[0] / DEG:.4g} deg: there is no step to measure the response to."
        )
    change = np.diff(reference)
    heading = np.where(np.abs(change) > _REST * height, np.sign(change), 0.0)
    if np.count_nonzero(heading) > 0.5 * heading.size:
        raise IdentificationError(
            "The command moves most of the time: it is not a square wave. Step responses can be measured on a "
            "square wave, rate-limited or not; for a sweep see rotflex.identification."
        )
    turns = (np.flatnonzero(np.diff(heading)) + 1).tolist()
    moves = []
    for first, stop in zip([0, *turns], [*turns, heading.size], strict=True):
        if heading[first]:
            at_rest = stop if stop < heading.size else reference.size
            moves.append(_Move(first + 1, at_rest, float(reference[first]), float(reference[stop])))
    return _with_start_up(moves, reference, theta, height)


def _with_start_up(
    moves: list[_Move], reference: NDArray[np.float64], theta: NDArray[np.float64], height: float
) -> list[_Move]:
    """Put the servo's way to the first commanded level before the moves, where the record opens with one."""
    ramp_is_running = moves[0].start == 1  # from the first sample on, which may hold its first stair
    if ramp_is_running and abs(theta[0] - reference[0]) <= _ON_COMMAND * height:
        return moves
    at_rest, level = (moves[0].at_rest, moves[0].after) if ramp_is_running else (0, float(reference[0]))
    if abs(theta[0] - level) <= _START_UP * height:
        return moves
    return [_Move(0, at_rest, float(theta[0]), level), *(moves[1:] if ramp_is_running else moves)]


# --- measuring one ---------------------------------------------------------------------------------------------------


def _measure_step(recording: Recording, part: slice, step: StepResponse, band: float) -> StepResponse:
    theta = recording["theta"][part]
    rest = float(np.mean(theta[-max(1, round(_STEADY_PART * theta.size)) :]))
    there = [name for name in ("alpha", "vm") if name in recording]
    measured: dict[str, Any] = {f"max_{name}": float(np.abs(recording[name][part]).max()) for name in there}
    measured["steady_state_error"] = step.after - rest
    moved = (rest - theta[0]) * step.direction
    if moved < _FOLLOWED * step.size:
        seconds = theta.size * recording.sample_time
        return replace(step, **measured, settling_time=math.inf, remark=_did_not_follow(moved, seconds, step))

    beyond = (theta - step.after) * step.direction
    peak = int(np.argmax(beyond))
    half_width = band * max(abs(step.before), abs(step.after))
    outside = np.flatnonzero(np.abs(beyond) > half_width)
    settled = int(outside[-1]) + 1 if outside.size else 0
    measured["peak_time"] = peak * recording.sample_time
    measured["overshoot"] = 100 * max(0.0, float(beyond[peak])) / step.size
    if settled > (1 - _STEADY_PART) * theta.size:
        error = abs(step.after - rest) / DEG
        seen = (1 - _STEADY_PART) * theta.size * recording.sample_time
        words = f"not settled within ±{half_width / DEG:.3g} deg of {step.after / DEG:.4g} deg after {seen:.3g} s"
        if abs(step.after - rest) > half_width:
            words += f": it comes to rest {error:.3g} deg from the command"
        return replace(step, **measured, settling_time=math.inf, remark=words)
    return replace(step, **measured, settling_time=settled * recording.sample_time)


def _did_not_follow(moved: float, seconds: float, step: StepResponse) -> str:
    if moved < -(1 - _FOLLOWED) * step.size:
        return (
            f"the servo moved {-moved / DEG:.3g} deg against the command: look at the sign of the angle, of the "
            "voltage and of the gain"
        )
    moved_deg = moved / DEG + 0.0  # no "-0"
    return f"the servo did not follow: it moved {moved_deg:.3g} deg of {step.size / DEG:.3g} deg in {seconds:.3g} s"


def _at(step: StepResponse) -> str:
    return f"step at {step.start:.4g} s, {step.before / DEG:.4g} to {step.after / DEG:.4g} deg: {step.remark}"


# --- the specifications ----------------------------------------------------------------------------------------------


def _judge(value: float | None, asked: Specification) -> Finding:
    title = f"Specification {asked.number}, {asked.name}"
    allowed = f"at most {with_unit(asked.limit, asked.unit)}"
    if value is None:
        return Finding(asked, None, None, f"{title}: not measured ({allowed}).")
    if math.isinf(value):
        return Finding(asked, value, False, f"{title}: not met, the angle does not settle; {allowed}.")
    met = bool(value <= asked.limit * (1 + 1e-9))
    words = f"{title}: {'met' if met else 'not met'}, {with_unit(value, asked.unit)}; {allowed}."
    if asked.quantity == "max_vm" and math.isclose(value, asked.limit):
        words += " The voltage was at its limit: the controller may have asked for more."
    return Finding(asked, value, met, words)


def with_unit(value: float, unit: str) -> str:
    """A value for people: angles in degrees."""
    return f"{value / DEG:.3g} deg" if unit == "rad" else f"{value:.3g} {unit}"


# --- what the specifications do not cover -----------------------------------------------------------------------------


def swing(recording: Recording, after: float = 0.5) -> float:
    """Largest deflection (rad) later than ``after`` (s) from the start of each full-size turn until the next one."""
    return max(float(np.abs(part["alpha"]).max()) for part in _later(recording, after))


def voltage_noise(recording: Recording, after: float = 0.2) -> float:
    """Root mean square (V) of the voltage's change from sample to sample, later than ``after`` (s) in each turn."""
    changes = np.concatenate([np.diff(part["vm"]) for part in _later(recording, after)])
    return float(np.sqrt(np.mean(changes**2)))


def _later(recording: Recording, after: float) -> list[Recording]:
    """The part of each full-size turn that is later than a time (s) from its start."""
    turns = measure(recording)
    ends = [*(turn.start for turn in turns[1:]), float(recording.time[-1])]
    largest = max(turn.size for turn in turns)
    full = [(turn, end) for turn, end in zip(turns, ends, strict=True) if turn.size >= _FULL_SIZE * largest]
    parts = [recording.between(turn.start + after, end) for turn, end in full if end > turn.start + after]
    if not parts:
        raise IdentificationError(f"No turn lasts longer than {after:g} s, so there is nothing to look at.")
    return parts
