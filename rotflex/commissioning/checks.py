"""The first steps of a commissioning: does the board work? ``rotflex doctor --bench`` takes these steps alone.

To the motor's output 0 V is written, and nothing else; only :func:`leave_alone` can be asked to drive the motor.
"""

from __future__ import annotations

import platform
import time
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np

from rotflex import __version__, doubts, hil, unanswered
from rotflex.errors import BenchError, ConfigurationError, HILError, LimitExceeded, RotflexError
from rotflex.hil import bench_file, drivers
from rotflex.hil.bench import Bench, Measurement
from rotflex.hil.bench_file import BenchFile
from rotflex.hil.board import WATCHDOG_TIMEOUT
from rotflex.hil.loop import listen
from rotflex.hil.real import CAREFUL
from rotflex.specifications import SAMPLE_TIME
from rotflex.units import DEG

_SAMPLED = 3.0  # s
_SAMPLES = f"samples at {1 / SAMPLE_TIME:.0f} Hz"
_CABLES = "Switch the amplifier off. Then look at the board's power and cables, and whether another program has it."
_TEST_VOLTAGES = (-2.0, 0.0, 2.0)  # V, at the loopback
_TOLERANCE = 0.1  # V, there
_END = WATCHDOG_TIMEOUT + 0.3  # s; the servo must stand by then
_SPAN = 0.1  # s, over which motion is compared. What follows was measured on 41 virtual benches
_STANDS = 0.4  # of the driven motion, at the end: 0.15 at most where the board stopped the motor, else 1.1 at least
_COASTS = 2.0  # of it, from the watchdog's time on: 1.2 at most where the board stopped the motor, else 3.4 at least
_TURNED = 1 * DEG
_PERIOD_OFF = 0.02  # of the period: what its median may be off by
_NOTHING_STOPS = (
    "Nothing would stop the motor of a program that is killed: do not switch the amplifier on, and ask the board's "
    "maker."
)


class Level(StrEnum):
    """How good it is."""

    OK = "ok"
    WARN = "warn"
    FAIL = "fail"


@dataclass(frozen=True)
class Diagnosis:
    """One thing that was looked at: whether it is as it should be, what was found, and what to do about it."""

    what: str
    level: Level
    message: str
    advice: str = ""

    def __str__(self) -> str:
        advice = f"\n{'':25}→ {self.advice}" if self.advice else ""
        return f"{self.level:5}{self.what:20}{self.message}{advice}"


def examine(uri: str, seconds: float = _SAMPLED) -> Iterator[Diagnosis]:
    """Look at a bench, one thing after the other, whether it was commissioned or not.

    Parameters
    ----------
    uri : its address, see :func:`rotflex.hil.open`
    seconds : for how long it is sampled

    Raises
    ------
    RotflexError
        If the bench cannot be opened, or not be closed.
    """
    bench = hil.open(uri)
    if bench.connection.recorded is not None:
        raise ConfigurationError(f"{uri} is a recording: there is no board to be looked at.")
    is_file = uri.endswith(".toml") and not uri.startswith("virtual:")
    file = bench_file.load(uri) if is_file else BenchFile(uri if ":" in uri else f"{uri}:")
    driver = drivers.find(file.address)
    own = "" if driver is None else f", {driver.software()}"
    yield Diagnosis("software", Level.OK, f"rotflex {__version__}, Python {platform.python_version()}{own}.")
    bench.recorder.folder = None  # what is sampled here is of no use to anybody later
    with bench:
        yield from look(bench, file, seconds)
        if bench.safety.commissioned is not None:
            yield from _allowed(bench, bench.safety.commissioned(), file)


def _allowed(bench: Bench, why_not: str | None, file: BenchFile) -> Iterator[Diagnosis]:
    """Return what the bench may do."""
    if why_not:
        advice = "rotflex bench setup --watchdog bench.toml" if "--watchdog" in why_not else "rotflex bench setup"
        yield Diagnosis("commissioned", Level.WARN, why_not, advice)
    else:
        yield Diagnosis("commissioned", Level.OK, f"On {file.record.get('date')}, as it is wired now.")
    limits = bench.safety.limits
    message = (
        f"{limits.voltage:g} V, theta ±{limits.theta / DEG:.0f} deg, alpha ±{limits.alpha / DEG:.0f} deg, "
        f"{limits.rate:g} rad/s, {limits.duration:g} s a run"
    )
    yield Diagnosis("limits", Level.OK, f"{message}, until it is commissioned." if limits.why else f"{message}.")


def look(bench: Bench, file: BenchFile, seconds: float = _SAMPLED) -> Iterator[Diagnosis]:
    """Look at all that is asked of an open board; one thing that fails keeps none of the others from being looked at.

    Parameters
    ----------
    bench : at rest
    file : how it is wired
    seconds : for how long it is sampled
    """
    yield Diagnosis("board", Level.OK, "It opens, and takes 0 V for the motor.")
    looked_at = {
        "encoders": _encoders(bench, file),
        "loopback": _loopback(bench, file),
        _SAMPLES: _samples(bench, seconds),
        "watchdog": watchdog_expires(bench, file),
    }
    for name, found in looked_at.items():
        try:
            yield from found
        except RotflexError as error:
            yield Diagnosis(name, Level.FAIL, str(error), _CABLES)
    for refusal in bench.connection.refused.values():
        yield Diagnosis("board", Level.WARN, refusal)


def _encoders(bench: Bench, file: BenchFile) -> Iterator[Diagnosis]:
    """Read both counters."""
    (servo, link), wired = bench.connection.counts(), file.wiring
    message = f"Servo (encoder {wired['servo_encoder']}) at {servo} counts, link (encoder {wired['link_encoder']}) at "
    yield Diagnosis("encoders", Level.OK, f"{message}{link}.", "Turn the arm and see them count: rotflex bench watch.")


def _loopback(bench: Bench, file: BenchFile) -> Iterator[Diagnosis]:
    """Write voltages to the output that a cable joins to an input, where one is named, and read them there."""
    if file.loopback is None:
        return
    try:
        for volts in _TEST_VOLTAGES:
            _write_loopback(bench, file, volts)
            read = _read_loopback(bench, file)
            if abs(read - volts) > _TOLERANCE:
                raise BenchError(
                    f"{volts:g} V on analog output {file.loopback[0]} came in as {read:.2f} V at analog input "
                    f"{file.loopback[1]}: look at the cable between them, and at the board's ranges."
                )
    finally:
        _write_loopback(bench, file, 0.0)
    yield Diagnosis("loopback", Level.OK, f"What is written comes in, within {_TOLERANCE:g} V.")


def _samples(bench: Bench, seconds: float) -> Iterator[Diagnosis]:
    """Look how steadily samples come."""
    number = max(round(seconds / SAMPLE_TIME), 2)
    recording = listen(bench, number, SAMPLE_TIME, {"experiment": "doctor"}, progress=False)
    yield judge_samples(recording.metadata, number)


def judge_samples(metadata: Mapping[str, Any], number: int) -> Diagnosis:
    """Judge how so many samples came, by their recording's metadata."""
    timing = metadata.get(unanswered.TIMING)
    if timing is None:
        message = "They come, and time waits for the program: there is no period to be measured."
        return Diagnosis(_SAMPLES, Level.OK, message)
    period, late = timing["period"], doubts.of_samples(metadata, number)
    message = (
        f"The period is {period['p50'] * 1e3:.3f} ms (p50), {period['p99'] * 1e3:.3f} ms (p99), "
        f"{period['max'] * 1e3:.3f} ms at most, by a {timing['clock']} clock. {unanswered.of_clock(timing['drift'])}"
    )
    is_off = abs(period["p50"] / SAMPLE_TIME - 1) > _PERIOD_OFF
    level = Level.FAIL if is_off or (late and late.refuses) else Level.WARN if late else Level.OK
    return Diagnosis(_SAMPLES, level, message, str(late) if late else doubts.HELPS if is_off else "")


def watchdog_expires(bench: Bench, file: BenchFile) -> Iterator[Diagnosis]:
    """Look whether the watchdog expires when it is left alone, and what becomes of the voltage at the loopback."""
    trouble = leave_alone(bench, file, 0.0)
    if trouble is None:
        untested = "" if bench.safety.commissioned is None else " Only set-up tests whether it stops the motor."
        yield Diagnosis("watchdog", Level.OK, f"It expires when it is left alone.{untested}")
    else:
        level = Level.WARN if "@" in file.address else Level.FAIL  # the maker's simulator harms nobody
        yield Diagnosis("watchdog", level, trouble, _NOTHING_STOPS)


# --- what the board does by itself ------------------------------------------------------------------------------------


def _read_loopback(bench: Bench, file: BenchFile) -> float:
    """Return what comes in at the input that a cable may join to an output, V; 0 where none is named."""
    volts = np.zeros(1)
    if file.loopback is not None:
        bench.board.read_analog(np.array(file.loopback[1:], dtype=np.uint32), 1, volts)
    return float(volts[0])


def _write_loopback(bench: Bench, file: BenchFile, volts: float) -> None:
    """Set the output that a cable may join to an input, V, where it is named."""
    if file.loopback is not None:
        bench.board.write_analog(np.array(file.loopback[:1], dtype=np.uint32), 1, np.array([volts]))


def leave_alone(bench: Bench, file: BenchFile, volts: float) -> str | None:
    """Leave the motor, driven or at 0 V, to the watchdog, and return what was not as it must be.

    Raises
    ------
    BenchError
        If the driven servo did not turn.
    """
    seen: list[Measurement] = []
    left = 0.0  # V, at the loopback's input
    expired = ran_away = locked = False
    try:
        with suppress(HILError):  # what it refuses, the bench has noted already
            outputs = np.array([file.wiring["motor"], *(file.loopback or ())[:1]], dtype=np.uint32)
            bench.board.watchdog_set_analog_expiration_state(outputs, len(outputs), np.zeros(len(outputs)))
        bench.start(SAMPLE_TIME)
        first = bench.connection.counts()[0]
        seen.append(bench.read())
        _write_loopback(bench, file, CAREFUL.voltage)
        bench.write(volts)
        bench.is_left_alone = True
        try:
            while seen[-1].time < _END:
                measured = bench.read()
                seen += [*bench.late, measured]
        except LimitExceeded:
            ran_away = True
        except HILError:  # an expired watchdog may lock the inputs: then the counter is read once it is cleared
            locked = True
            time.sleep(max(_END - seen[-1].time, 0.0))
        if not ran_away:
            expired = bench.board.watchdog_is_expired()
            if locked:
                bench.board.watchdog_clear()
                moved = (bench.connection.counts()[0] - first) * file.wiring["servo_sign"] * bench.servo.K_enc
                seen.append(Measurement(_END, seen[0].theta + moved, 0.0))
            with suppress(HILError):  # its inputs may still be locked
                left = _read_loopback(bench, file)
    finally:
        try:
            bench.stop()
        finally:
            _write_loopback(bench, file, 0.0)
    if volts and (ran_away or not _stood(seen, locked)):
        return f"The watchdog did not stop the motor: the servo still turned {_END:g} s after the last sign of life."
    if not expired:
        return f"The watchdog had not expired {_END:g} s after the last sign of life."
    if abs(left) > _TOLERANCE:
        return f"The watchdog left {left:.2f} V on the loopback's output."
    return None


def _stood(seen: list[Measurement], locked: bool) -> bool:
    """Return whether the servo stood at the end, by how it moved before; raise BenchError if it never turned."""
    times, theta = [sample.time for sample in seen], [sample.theta for sample in seen]

    def turned(begin: float, end: float) -> float:
        return abs(float(np.interp(end, times, theta) - np.interp(begin, times, theta)))

    driven = turned(WATCHDOG_TIMEOUT - _SPAN, WATCHDOG_TIMEOUT)
    if driven < _TURNED:
        raise BenchError(
            f"The servo did not turn at {CAREFUL.voltage:g} V, so nothing was tested: is the amplifier on, its "
            "emergency stop released, and the arm free?"
        )
    if locked:
        return turned(WATCHDOG_TIMEOUT, _END) < _COASTS * driven
    return turned(_END - _SPAN, _END) < _STANDS * driven
