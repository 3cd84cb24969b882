"""What an open board is asked: does it count, do its samples come in time, does its watchdog do what it is for?

0 V is written to the motor's output, and nothing else is ever written to it.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Mapping
from contextlib import suppress
from typing import Any

import numpy as np

from rotflex.bench_doctor.findings import Finding, Level
from rotflex.commissioning import by_hand
from rotflex.errors import HILError
from rotflex.hil.bench import Bench
from rotflex.hil.bench_file import BenchFile
from rotflex.hil.board import Board, Channels, Clock
from rotflex.hil.halt import WATCHDOG_TIMEOUT
from rotflex.hil.loop import listen
from rotflex.specifications import SAMPLE_TIME
from rotflex.unanswered import FEW, HELPS

_PERIOD_OFF = 0.02  # of the period: what its median may be off by
_RELOADED = 0.02  # s, from one reload of the watchdog to the next
_ALONE = 2 * WATCHDOG_TIMEOUT  # s: for so long it is reloaded, and for so long left alone
_LOOKED_AT = 2.0  # V on the loopback's output, which an expired watchdog has to take away
_ZERO = 0.1  # V
_NOTHING_STOPS = (
    "Nothing would stop the motor of a program that is killed: use the bench with a hand on the emergency stop only, "
    "and ask the board's maker."
)


def encoders(bench: Bench, told: BenchFile) -> Iterator[Finding]:
    """Whether both counters can be read."""
    servo, link = bench.counts()
    said = "Servo (encoder {servo_encoder}) at {servo} counts, link (encoder {link_encoder}) at {link}.".format(
        servo=servo, link=link, **told.wiring
    )
    yield Finding("encoders", Level.OK, said, "Turn the arm and see them count: rotflex bench watch.")


def loopback(bench: Bench, told: BenchFile) -> Iterator[Finding]:
    """Whether an analog output and an input work, where a cable joins two that nothing else is on."""
    if told.loopback is not None:
        yield Finding("loopback", Level.OK, by_hand.loopback(bench, told) + ".")


# --- samples ----------------------------------------------------------------------------------------------------------


def samples(bench: Bench, sample_time: float, seconds: float) -> Iterator[Finding]:
    """How steadily samples come."""
    what = f"samples at {1 / sample_time:.0f} Hz"
    number = max(round(seconds / sample_time), 2)
    recording = listen(bench, number, sample_time, {"experiment": "doctor"}, progress=False)
    timing = recording.metadata.get("timing")
    if timing is None:
        said = "They come, and time waits for the program: there is no period to be measured."
        yield Finding(what, Level.OK, said)
    else:
        yield judged(what, timing, sample_time, number)


def judged(what: str, timing: Mapping[str, Any], sample_time: float, number: int) -> Finding:
    """What a run's report on its samples means.

    Parameters
    ----------
    what : was looked at
    timing : the report, see :meth:`rotflex.hil.pace.Pace.report`
    sample_time : s
    number : of samples
    """
    period = timing["period"]
    said = (
        f"The period is {period['p50'] * 1e3:.3f} ms (p50), {period['p99'] * 1e3:.3f} ms (p99), "
        f"{period['max'] * 1e3:.3f} ms at most, by a {timing['clock']} clock; of {number} samples "
        f"{timing['late']} were late and {timing['missed']} missed. The board's clock is {abs(timing['drift']):.3%} "
        f"{'slower' if timing['drift'] > 0 else 'faster'} than the computer's."
    )
    lost = (timing["late"] + timing["missed"]) / number
    if lost <= FEW and abs(period["p50"] / sample_time - 1) <= _PERIOD_OFF:
        return Finding(what, Level.WARN, said, HELPS) if lost else Finding(what, Level.OK, said)
    if sample_time < SAMPLE_TIME:
        said += f" (The course samples at {1 / SAMPLE_TIME:.0f} Hz.)"
        return Finding(what, Level.WARN, said, HELPS)
    return Finding(what, Level.FAIL, said, HELPS)


# --- the watchdog -----------------------------------------------------------------------------------------------------


def watchdog(bench: Bench, told: BenchFile) -> Iterator[Finding]:
    """Whether the watchdog starts, runs on while it is reloaded, expires when it is left alone, and can be cleared."""
    what, board = "watchdog's time", bench.board
    outputs = by_hand.outputs(told)
    board.watchdog_set_analog_expiration_state(outputs, len(outputs), np.zeros(len(outputs)))
    try:
        by_hand.write_loopback(bench, told, _LOOKED_AT)
        board.watchdog_start(WATCHDOG_TIMEOUT)
        paused = _kept_alive(bench, told)
        if not math.isnan(paused):
            yield _expired_early(what, paused)
            return
        _let_pass(bench, told, _ALONE)
        if not board.watchdog_is_expired():
            said = f"Left alone for {_ALONE:g} s it has not expired."
            yield Finding(what, Level.FAIL, said, _NOTHING_STOPS)
            return
        yield from _outputs_after("watchdog", bench, told)
        yield _locked(what, board, outputs[:1])
    finally:
        try:
            bench.stop()
        finally:
            board.write_analog(outputs, len(outputs), np.zeros(len(outputs)))
    yield Finding(what, Level.OK, "Cleared and stopped, it lets the board be used again, and takes 0 V for the motor.")


def _kept_alive(bench: Bench, told: BenchFile) -> float:
    """Reload it in time, time and again; not a number if it lived, or how long it had been left when it did not (s)."""
    for _each in range(round(_ALONE / _RELOADED)):
        begun = time.monotonic()
        _let_pass(bench, told, _RELOADED)
        if not bench.board.watchdog_reload():
            return _RELOADED if bench.is_simulated else time.monotonic() - begun
    return math.nan


def _expired_early(what: str, left: float) -> Finding:
    said = f"It expired though it was reloaded after {left:.2f} s; its time-out is {WATCHDOG_TIMEOUT:g} s."
    if left >= WATCHDOG_TIMEOUT:
        said += " This computer had paused meanwhile."
        return Finding(what, Level.WARN, said, HELPS)
    return Finding(what, Level.FAIL, said, "Ask the board's maker: no run would get far.")


def _locked(what: str, board: Board, motor: Channels) -> Finding:
    """Whether an expired watchdog keeps voltages out, as it should."""
    said = "It starts, lives while it is reloaded, and expires within {time:g} s when it is left alone"
    said = said.format(time=_ALONE)
    try:
        board.write_analog(motor, 1, np.zeros(1))
    except HILError:
        return Finding(what, Level.OK, said + "; no voltage is taken then.")
    said += "; but a voltage is taken all the same before it is cleared."
    return Finding(what, Level.WARN, said, "The bench clears and stops it before it goes on; ask the board's maker.")


def _outputs_after(what: str, bench: Bench, told: BenchFile) -> Iterator[Finding]:
    """Whether a voltage was taken away, where a cable shows it."""
    if told.loopback is None:
        if bench.safety.commissioned is not None:  # a virtual bench has no cable
            yield _not_tested_here(told)
        return
    try:
        left = by_hand.read_volts(bench, told.loopback[1])
    except HILError:  # it keeps its inputs to itself until it is cleared, too
        yield _not_tested_here(told)
        return
    said = f"Of {_LOOKED_AT:g} V on the loopback's output it left {left:.2f} V."
    if abs(left) <= _ZERO:
        yield Finding(what, Level.OK, said)
    else:
        yield Finding(what, Level.FAIL, said, _NOTHING_STOPS)


def _not_tested_here(told: BenchFile) -> Finding:
    """That nobody saw here whether an expired watchdog sets 0 V; what its test with the motor found, where it was."""
    tested = told.record.get("watchdog")
    if isinstance(tested, Mapping) and tested.get("passed") is True:
        said = f"Not tested here; tested with the motor on {tested.get('date')}: it stopped."
        return Finding("watchdog", Level.OK, said)
    cable = "no cable" if told.loopback is None else "the input is locked"
    said = f"Not tested: {cable}. Nobody has seen whether it sets 0 V."
    return Finding("watchdog", Level.WARN, said, "rotflex bench setup tests it with the motor.")


def _let_pass(bench: Bench, told: BenchFile, seconds: float) -> None:
    """Let time pass on the board; where time waits for the program, it passes as samples are waited for."""
    if not bench.is_simulated:
        time.sleep(seconds)
        return
    board, number = bench.board, round(seconds / SAMPLE_TIME)
    channels = np.array([told.wiring["servo_encoder"], told.wiring["link_encoder"]], dtype=np.uint32)
    task = board.task_create_encoder_reader(number, channels, 2)
    with suppress(HILError):  # an expired watchdog may keep inputs out as well; then enough time has passed
        board.task_start(task, Clock.HARDWARE_CLOCK_0, 1 / SAMPLE_TIME, number)
        board.task_read_encoder(task, number, np.zeros(2 * number, dtype=np.int32))
    with suppress(HILError):
        board.task_stop(task)
    board.task_delete(task)
