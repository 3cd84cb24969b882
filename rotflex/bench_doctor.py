"""What a laboratory's engineer asks of a bench at first: is all there, and does it work? The motor is never driven.

Each answer is a :class:`Finding`. What stands on something that has failed is left out. To the motor's output 0 V is
written, and nothing else.
"""

from __future__ import annotations

import contextlib
import math
import platform
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from enum import StrEnum
from functools import partial
from typing import Any

import numpy as np

from rotflex import __version__, hil
from rotflex.commissioning import steps
from rotflex.errors import HILError, RotflexError
from rotflex.hil import bench_file, drivers
from rotflex.hil.bench import Bench, Limits
from rotflex.hil.bench_file import BenchFile
from rotflex.hil.board import Clock
from rotflex.hil.halt import WATCHDOG_TIMEOUT
from rotflex.hil.loop import listen
from rotflex.specifications import SAMPLE_TIME
from rotflex.unanswered import FEW, HELPS, of_clock
from rotflex.units import DEG

__all__ = ["Finding", "Level", "examine"]

FAST = 0.001  #: s: the quicker of the two sample times that are tried
_AS_USUAL = BenchFile("usual:board")  # wired as benches are unless a file says otherwise
_CABLES = "Look at its power and its cables, and whether another program has it."
_PERIOD_OFF = 0.02  # of the period: what its median may be off by
_RELOADED = 0.02  # s, from one reload of the watchdog to the next
_ALONE = 2 * WATCHDOG_TIMEOUT  # s: for so long it is reloaded, and for so long left alone
_LOOKED_AT, _ZERO = 2.0, 0.1  # V on the loopback's output, which an expired watchdog has to take away
_NOTHING_STOPS = (
    "Nothing would stop the motor of a program that is killed: use the bench with a hand on the emergency stop only, "
    "and ask the board's maker."
)


class Level(StrEnum):
    """How good it is."""

    OK = "ok"
    WARN = "warn"
    FAIL = "fail"


@dataclass(frozen=True)
class Finding:
    """One thing that was looked at: whether it is as it should be, what was found, and what to do about it."""

    what: str
    level: Level
    message: str
    advice: str = ""


def examine(uri: str, seconds: float = 3.0) -> Iterator[Finding]:
    """Look at a bench, one thing after the other.

    Parameters
    ----------
    uri : its address, see :func:`rotflex.hil.open`
    seconds : for how long it is sampled at each of two rates
    """
    try:
        is_file = uri.endswith(".toml") and not uri.startswith(("virtual:", "replay:"))
        file = bench_file.load(uri) if is_file else None
        bench = hil.open(uri)
    except RotflexError as error:
        yield Finding("address", Level.FAIL, str(error), "Put the address or the file right.")
        return
    known = dict(bench.identity)
    if file is not None:
        known |= {name: file.parts[name] for name in ("amplifier", "cable_gain")}
        known |= {name: file.wiring[name] for name in ("motor_sign", "servo_sign", "link_sign")}
    yield Finding("bench", Level.OK, ", ".join(f"{name} {value}" for name, value in known.items()) + ".")
    software = _software(file.address if file else uri)
    yield software
    if bench.connection.recorded is not None:
        yield Finding("board", Level.OK, "A recording is in the plant's place: there is no board to be looked at.")
        return
    limits, commissioned = bench.safety.limits, bench.safety.commissioned
    bench.recorder.folder = None  # what is sampled here is of no use to anybody later
    if software.level is not Level.FAIL:
        yield from _on_the_board(bench, file or _AS_USUAL, seconds)
    yield _commissioned(commissioned() if commissioned is not None else None, file)
    yield Finding("limits", Level.OK, _limits(limits))


def _software(address: str) -> Finding:
    """Look whether what the bench stands on is installed."""
    installed = f"rotflex {__version__}, Python {platform.python_version()}"
    driver = drivers.find(address)
    if driver is not None:
        try:
            installed += f", {driver.software()}"
        except RotflexError as error:
            return Finding("software", Level.FAIL, str(error), "Install it, and ask again.")
    return Finding("software", Level.OK, installed + ".")


def _on_the_board(bench: Bench, file: BenchFile, seconds: float) -> Iterator[Finding]:
    """Look at all that is asked of an open board."""
    with contextlib.ExitStack() as opened:
        try:
            opened.enter_context(bench)
        except RotflexError as error:
            yield Finding("board", Level.FAIL, str(error), _CABLES)
            return
        yield Finding("board", Level.OK, "It opens, and takes 0 V for the motor.")
        for refusal in bench.connection.refused.values():
            yield Finding("board", Level.WARN, refusal)
        for name, check in CHECKS.items():
            known = len(bench.connection.refused)
            try:
                yield from check(bench, file, seconds)
            except RotflexError as error:
                yield Finding(name, Level.FAIL, str(error), _CABLES)
            for refusal in [*bench.connection.refused.values()][known:]:
                yield Finding("board", Level.WARN, refusal)
        try:
            opened.close()
        except RotflexError as error:
            yield Finding("board", Level.FAIL, str(error), "Switch the amplifier off before anything else.")


def _commissioned(why_not: str | None, file: BenchFile | None) -> Finding:
    if why_not:
        advice = "rotflex bench setup --watchdog bench.toml" if "--watchdog" in why_not else "rotflex bench setup"
        return Finding("commissioned", Level.WARN, why_not, advice)
    message = "This bench is asked for none." if file is None else f"On {file.record.get('date')}, as it is wired now."
    return Finding("commissioned", Level.OK, message)


def _limits(limits: Limits) -> str:
    known = {
        "{:g} V": limits.voltage,
        "theta ±{:.0f} deg": limits.theta / DEG,
        "alpha ±{:.0f} deg": limits.alpha / DEG,
        "{:g} rad/s": limits.rate,
        "{:g} s a run": limits.duration,
    }
    listed = ", ".join(text.format(value) for text, value in known.items() if value < math.inf)
    return f"{listed}, until it is commissioned." if limits.why else f"{listed}."


# --- on the open board ------------------------------------------------------------------------------------------------


def _encoders(bench: Bench, file: BenchFile, _seconds: float) -> Iterator[Finding]:
    """Read both counters."""
    (servo, link), wired = bench.connection.counts(), file.wiring
    message = f"Servo (encoder {wired['servo_encoder']}) at {servo} counts, link (encoder {wired['link_encoder']}) at "
    yield Finding("encoders", Level.OK, f"{message}{link}.", "Turn the arm and see them count: rotflex bench watch.")


def _loopback(bench: Bench, file: BenchFile, _seconds: float) -> Iterator[Finding]:
    """Look whether an analog output and an input work, where a cable joins two that nothing else is on."""
    if file.loopback is not None:
        yield Finding("loopback", Level.OK, steps.check_loopback(bench, file) + ".")


def _samples(sample_time: float, bench: Bench, _file: BenchFile, seconds: float) -> Iterator[Finding]:
    """Look how steadily samples come."""
    what = f"samples at {1 / sample_time:.0f} Hz"
    number = max(round(seconds / sample_time), 2)
    recording = listen(bench, number, sample_time, {"experiment": "doctor"}, progress=False)
    timing = recording.metadata.get("timing")
    if timing is None:
        message = "They come, and time waits for the program: there is no period to be measured."
        yield Finding(what, Level.OK, message)
    else:
        yield judge_samples(what, timing, sample_time, number)


def judge_samples(what: str, timing: Mapping[str, Any], sample_time: float, number: int) -> Finding:
    """Judge a run's report on its samples.

    Parameters
    ----------
    what : was looked at
    timing : the report, see :meth:`rotflex.hil.pace.Pace.report`
    sample_time : s
    number : of samples
    """
    period = timing["period"]
    message = (
        f"The period is {period['p50'] * 1e3:.3f} ms (p50), {period['p99'] * 1e3:.3f} ms (p99), "
        f"{period['max'] * 1e3:.3f} ms at most, by a {timing['clock']} clock; of {number} samples "
        f"{timing['late']} were late and {timing['missed']} missed. {of_clock(timing['drift'])}"
    )
    lost = (timing["late"] + timing["missed"]) / number
    if lost <= FEW and abs(period["p50"] / sample_time - 1) <= _PERIOD_OFF:
        return Finding(what, Level.WARN, message, HELPS) if lost else Finding(what, Level.OK, message)
    if sample_time < SAMPLE_TIME:
        message += f" (The course samples at {1 / SAMPLE_TIME:.0f} Hz.)"
        return Finding(what, Level.WARN, message, HELPS)
    return Finding(what, Level.FAIL, message, HELPS)


def _watchdog(bench: Bench, file: BenchFile, _seconds: float) -> Iterator[Finding]:
    """Look whether the watchdog lives while it is reloaded, expires when it is left alone, and can be cleared."""
    what, board, outputs = "watchdog's time", bench.board, steps.outputs(file)
    bench.connection.ask("watchdog_set_analog_expiration_state", outputs, len(outputs), np.zeros(len(outputs)))
    try:
        steps.write_loopback(bench, file, _LOOKED_AT)
        board.watchdog_start(WATCHDOG_TIMEOUT)
        for _each in range(round(_ALONE / _RELOADED)):
            begun = time.monotonic()
            _let_pass(bench, file, _RELOADED)
            if not board.watchdog_reload():
                yield _expired_early(what, _RELOADED if bench.is_simulated else time.monotonic() - begun)
                return
        _let_pass(bench, file, _ALONE)
        if not board.watchdog_is_expired():
            yield Finding(what, Level.FAIL, f"Left alone for {_ALONE:g} s it has not expired.", _NOTHING_STOPS)
            return
        if file.loopback is not None or bench.safety.commissioned is not None:  # a virtual bench has no cable
            yield _left_behind(bench, file)
        message = f"It starts, lives while it is reloaded, and expires within {_ALONE:g} s when it is left alone"
        try:
            board.write_analog(outputs[:1], 1, np.zeros(1))
        except HILError:
            yield Finding(what, Level.OK, message + "; no voltage is taken then.")
        else:
            advice = "The bench clears and stops it before it goes on; ask the board's maker."
            message += "; but a voltage is taken all the same before it is cleared."
            yield Finding(what, Level.WARN, message, advice)
    finally:
        try:
            bench.stop()
        finally:
            board.write_analog(outputs, len(outputs), np.zeros(len(outputs)))


def _expired_early(what: str, left: float) -> Finding:
    message = f"It expired though it was reloaded after {left:.2f} s; its time-out is {WATCHDOG_TIMEOUT:g} s."
    if left >= WATCHDOG_TIMEOUT:
        return Finding(what, Level.WARN, f"{message} This computer had paused meanwhile.", HELPS)
    return Finding(what, Level.FAIL, message, "Ask the board's maker: no run would get far.")


def _left_behind(bench: Bench, file: BenchFile) -> Finding:
    """Look whether a voltage was taken away, where a cable shows it; else tell what the test with the motor found."""
    left = None
    if file.loopback is not None:
        with suppress(HILError):  # an expired watchdog may lock the inputs, too
            left = steps.read_volts(bench, file.loopback[1])
    if left is not None:
        message = f"Of {_LOOKED_AT:g} V on the loopback's output it left {left:.2f} V."
        stopped = abs(left) <= _ZERO
        return Finding("watchdog", Level.OK if stopped else Level.FAIL, message, "" if stopped else _NOTHING_STOPS)
    tested = file.record.get("watchdog")
    if isinstance(tested, Mapping) and tested.get("passed") is True:
        message = f"Not tested here; tested with the motor on {tested.get('date')}: it stopped."
        return Finding("watchdog", Level.OK, message)
    cable = "no cable" if file.loopback is None else "the input is locked"
    message = f"Not tested: {cable}. Nobody has seen whether it sets 0 V."
    return Finding("watchdog", Level.WARN, message, "rotflex bench setup tests it with the motor.")


def _let_pass(bench: Bench, file: BenchFile, seconds: float) -> None:
    """Let time pass on the board; where time waits for the program, it passes as samples are waited for."""
    if not bench.is_simulated:
        time.sleep(seconds)
        return
    board, number = bench.board, round(seconds / SAMPLE_TIME)
    channels = np.array([file.wiring["servo_encoder"], file.wiring["link_encoder"]], dtype=np.uint32)
    task = board.task_create_encoder_reader(number, channels, 2)
    with suppress(HILError):  # an expired watchdog may lock the inputs as well; then enough time has passed
        board.task_start(task, Clock.HARDWARE_CLOCK_0, 1 / SAMPLE_TIME, number)
        board.task_read_encoder(task, number, np.zeros(2 * number, dtype=np.int32))
    with suppress(HILError):
        board.task_stop(task)
    board.task_delete(task)


#: What is asked of an open board, by name.
CHECKS: dict[str, Callable[[Bench, BenchFile, float], Iterator[Finding]]] = {
    "encoders": _encoders,
    "loopback": _loopback,
    "samples": partial(_samples, SAMPLE_TIME),
    "quick samples": partial(_samples, FAST),
    "watchdog": _watchdog,
}
