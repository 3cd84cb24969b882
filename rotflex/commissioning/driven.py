"""The steps in which the motor drives: slowly, with little, and within a few degrees."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.optimize import least_squares
from scipy.signal import lfilter

from rotflex import experiments, unanswered
from rotflex.errors import BenchError
from rotflex.hil.bench import Bench, Measurement
from rotflex.hil.board import Vector
from rotflex.identification import frequency_response, resonance
from rotflex.link import natural_frequency
from rotflex.recording import Recording
from rotflex.specifications import SAMPLE_TIME
from rotflex.units import DEG, HZ

_SLOPE = 0.25  # V/s
_LEAST = 4  # counts, from which on a motion is one
_FAR = 3 * DEG
_SWEEP = {"f_start": 2.0, "f_stop": 5.0, "duration": 6.0, "amplitude": 0.6}  # Hz, s, V: the servo turns by 5 to 20 deg
_NATURAL, _SPACING = (1.5, 6.0), 0.05  # Hz; no arm position and spring of the joint is outside
_DAMPING = 0.6  # 1/s, B_l/J_l; it says little of where the best frequency is
_LEFT = 0.25  # of the arm's motion, that may be left over; 0.02 to 0.12 is usual
_STEP, _STEPS, _STEP_FOR = 1.5, 8, 0.06  # V; how many, by turns either way; s, each
_FINELY = 20  # parts of a sample
_SWEEPS = 3  # tries of a sweep, until few enough of its samples come late
_TRIES = 10  # of a step, until all its samples come in time


def _drive(
    bench: Bench, voltage: Callable[[float], float], until: Callable[[Measurement], bool], longest: float
) -> bool:
    """Drive from rest until something is seen; whether it was. The motor is at 0 V afterwards."""
    experiments.rest(bench)
    bench.start(SAMPLE_TIME)
    try:
        for _sample in range(round(longest / SAMPLE_TIME)):
            measured = bench.read()
            if until(measured):
                return True
            bench.write(voltage(measured.time))
    finally:
        bench.stop()
    return False


def motor_sign(bench: Bench) -> int:
    """Which way a positive voltage turns the servo, once its encoder's sign is known: 1 or -1.

    The voltage rises slowly from zero, and goes off as soon as the servo has turned by 3 degrees.

    Raises
    ------
    BenchError
        If it does not turn.
    """
    _breakaway(bench, 1, _FAR)
    return 1 if bench.latest.theta > 0 else -1


def breakaway(bench: Bench) -> tuple[float, float]:
    """The voltages (V, both positive) at which the servo begins to move, the positive and the negative way.

    Raises
    ------
    BenchError
        If it does not move, or the wrong way.
    """
    found = []
    for way in (1, -1):
        found.append(_breakaway(bench, way, _LEAST * bench.servo.K_enc))
        if bench.latest.theta * way < 0:
            raise BenchError("The servo moved against the voltage: motor_sign is wrong, or somebody pushed the arm.")
    return found[0], found[1]


def _breakaway(bench: Bench, way: int, far: float) -> float:
    """The voltage at which the servo had moved so far, rad."""
    if not _drive(
        bench,
        lambda time: way * min(_SLOPE * time, bench.limits.voltage),
        lambda measured: abs(measured.theta) >= far,
        bench.limits.voltage / _SLOPE,
    ):
        raise BenchError(
            f"The servo did not move at {way * bench.limits.voltage:g} V: is the amplifier on, its emergency "
            "stop released, the motor's cable plugged in, and is the amplifier on the output that bench.toml "
            "names as motor?"
        )
    return _SLOPE * bench.latest.time


def _return(bench: Bench) -> None:
    """Turn the servo slowly back to its mark, if it has drifted away: limits are counted from there."""
    experiments.rest(bench)
    away = bench.begun + bench.latest.theta
    if abs(away) > _FAR:
        _breakaway(bench, -1 if away > 0 else 1, abs(away))


def _step(bench: Bench, voltage: float) -> Vector:
    """theta and alpha (2, n) in the first moments of a step from rest, rad, one in which every sample came in time.

    Raises
    ------
    BenchError
        If none did.
    """
    for attempt in range(_TRIES):
        way = -1 if attempt % 2 else 1  # to and fro, so that the arm stays near its mark
        taken = _taken(bench, way * voltage)
        if not unanswered.in_words(bench.timing, len(taken)):
            return np.array(taken).T * way
    raise BenchError(
        f"Samples came late in {_TRIES} steps of {_STEP_FOR * 1e3:g} ms, one after the other, so that the delay "
        "cannot be told: close other programs, and begin again."
    )


def _taken(bench: Bench, voltage: float) -> list[tuple[float, float]]:
    """theta and alpha of each sample of a step, rad."""
    taken: list[tuple[float, float]] = []

    def seen(measured: Measurement) -> bool:
        taken.append((measured.theta, measured.alpha))
        return measured.time >= _STEP_FOR

    _drive(bench, lambda _time: voltage, seen, 2 * _STEP_FOR)
    return taken


def loop_delay(bench: Bench, stiffness: float) -> float:
    """The time from writing a voltage to its effect, s, from the first moments of steps from rest.

    The spring (stiffness in N·m/rad) pulls as the measured deflection says. The motor's effect and the braking are
    found along with the delay, and the servo's inertia is taken as nominal. A step is a few dozen counts, so that the
    delay is told within 0.8 ms; ``rotflex bench fit`` tells it better.
    """
    _return(bench)
    ways = itertools.islice(itertools.cycle((1, -1)), _STEPS)
    theta, alpha = np.mean([way * _step(bench, way * _STEP) for way in ways], axis=0)
    time = np.arange(theta.size) * SAMPLE_TIME
    finely = np.arange((theta.size - 1) * _FINELY + 1) * SAMPLE_TIME / _FINELY
    pulled = np.interp(finely, time, alpha) * stiffness / bench.servo.J_eq

    def left(unknown: Vector) -> Vector:
        pull, delay, braking = unknown
        driven = pull * np.clip((finely - delay) / finely[1] + 1, 0, 1)
        fading = math.exp(-braking * finely[1])
        rate = lfilter([0, (1 - fading) / braking], [1, -fading], pulled + driven)
        turned = cumulative_trapezoid(rate, finely, initial=0)[::_FINELY]
        counts: Vector = (turned - theta) / bench.servo.K_enc
        return counts

    guess = [2 * float(theta[-1]) / time[-1] ** 2, 0.001, bench.servo.back_emf_damping / bench.servo.J_eq]
    bounds = ([0, 0, guess[2] / 3], [math.inf, 0.02, guess[2] * 3])
    return float(least_squares(left, guess, x_scale=[10, 1e-3, guess[2]], bounds=bounds).x[1])


def _sweep(bench: Bench, say: Callable[[str], object], **settings: Any) -> Recording:
    """A sweep in which few enough samples came late.

    Raises
    ------
    BenchError
        If too many did each time.
    """
    for _each in range(_SWEEPS):
        if "drive" in settings:  # a loop brings it back by itself
            _return(bench)
        recording = experiments.sweep(bench, **settings, progress=False)
        words = unanswered.in_words(recording.metadata, len(recording))
        if not unanswered.too_many(recording.metadata, len(recording)):
            if words:
                say(words)
            return recording
        say(f"{words} The sweep comes again, at most {_SWEEPS} times in all.")
    raise BenchError(f"{words} It was so in {_SWEEPS} sweeps. Nothing was recorded: begin again.")


def link(bench: Bench, say: Callable[[str], object]) -> float:
    """The link's natural frequency with the servo clamped, rad/s, from a sweep of the voltage: no loop is closed yet.

    Raises
    ------
    BenchError
        If the arm bends the other way than its inertia bends it, so that a sign of an encoder is wrong; or if it does
        not move as an arm on the springs of such a joint; or if too many samples came late.
    """
    recording = _sweep(bench, say, **_SWEEP, drive="voltage")
    theta, alpha, dt = recording["theta"], recording["alpha"], recording.sample_time
    sought: dict[str, Any] = {
        "damping": _DAMPING,
        "within": (_NATURAL[0] * HZ, _NATURAL[1] * HZ),
        "spacing": _SPACING * HZ,
    }
    omega, left = natural_frequency(theta, alpha, dt, **sought)
    if left < _LEFT:
        return omega
    if natural_frequency(theta, -alpha, dt, **sought)[1] < left:
        raise BenchError(
            "The arm bends the other way than its inertia bends it when the servo turns: the sign of one encoder "
            "was found the wrong way round. Begin again, and turn servo and arm both counter-clockwise."
        )
    raise BenchError(
        f"The arm does not swing as one on the springs of such a joint, between {_NATURAL[0]:g} and "
        f"{_NATURAL[1]:g} Hz: {left:.0%} of its motion is left over. Look at the springs, at what else is on the "
        "arm, at the link's encoder, and whether something touches the arm."
    )


def short_sweep(bench: Bench, say: Callable[[str], object]) -> tuple[Recording, float]:
    """A short sweep in closed loop, the guard on: the recording, and the link's natural frequency in it, Hz."""
    recording = _sweep(bench, say, duration=8.0)
    response = frequency_response(recording)
    return recording, resonance(response).value / HZ
