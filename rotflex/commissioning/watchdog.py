"""The watchdog's own test: left alone at a small voltage, the board must stop the motor."""

from __future__ import annotations

import time
from contextlib import suppress
from typing import Any

import numpy as np

from rotflex import experiments
from rotflex.commissioning import by_hand
from rotflex.errors import BenchError, HILError, LimitExceeded
from rotflex.hil.bench import Bench, Measurement
from rotflex.hil.bench_file import BenchFile
from rotflex.hil.commissioned import today
from rotflex.hil.halt import WATCHDOG_TIMEOUT
from rotflex.hil.real import CAREFUL
from rotflex.specifications import SAMPLE_TIME
from rotflex.units import DEG

_END = WATCHDOG_TIMEOUT + 0.3  # s; the servo must stand by then
_SPAN = 0.1  # s, over which motion is compared. What follows was measured on 41 virtual benches
_STANDS = 0.4  # of the driven motion, at the end: 0.15 at most where the board stopped the motor, else 1.1 at least
_COASTS = 2.0  # of it, from the watchdog's time on: 1.2 at most where the board stopped the motor, else 3.4 at least
_LEAST = 1 * DEG
_ZERO = 0.1  # V


def test(bench: Bench, told: BenchFile) -> dict[str, Any]:
    """Drive the motor with 1 V, reload the watchdog no more, and see whether the servo stops.

    Returns
    -------
    dict
        For the record: whether it passed, the date, what was found in words, and which verbs the board refused.

    Raises
    ------
    BenchError
        If the servo did not turn: then nothing was tested.
    """
    experiments.rest(bench)
    seen: list[Measurement] = []
    left = 0.0  # V, at the loopback's input
    expired = ran_away = locked = False
    try:
        with suppress(HILError):  # what it refuses, the bench has noted already
            outputs = by_hand.outputs(told)
            bench.board.watchdog_set_analog_expiration_state(outputs, len(outputs), np.zeros(len(outputs)))
        bench.start(SAMPLE_TIME)
        first = bench.counts()[0]
        seen.append(bench.read())
        by_hand.write_loopback(bench, told, CAREFUL.voltage)
        bench.write(CAREFUL.voltage)
        bench.is_left_alone = True
        try:
            while seen[-1].time < _END:
                measured = bench.read()
                seen += [*bench.late, measured]
        except LimitExceeded:
            ran_away = True
        except HILError:  # an expired watchdog may keep inputs to itself: then the counter is read once it is cleared
            locked = True
            time.sleep(max(_END - seen[-1].time, 0.0))
        if not ran_away:
            expired = bench.board.watchdog_is_expired()
            if locked:
                bench.board.watchdog_clear()
                moved = (bench.counts()[0] - first) * told.wiring["servo_sign"] * bench.servo.K_enc
                seen.append(Measurement(_END, seen[0].theta + moved, 0.0))
            with suppress(HILError):  # it may keep its inputs to itself
                left = 0.0 if told.loopback is None else by_hand.read_volts(bench, told.loopback[1])
    finally:
        try:
            bench.stop()
        finally:
            by_hand.write_loopback(bench, told, 0.0)
    found = _trouble(seen, locked, ran_away, expired, left)
    said = found or f"At {CAREFUL.voltage:g} V, left alone, the servo stopped."
    return {"passed": not found, "date": today(), "found": said, "refused": list(bench.refused)}


def _trouble(seen: list[Measurement], locked: bool, ran_away: bool, expired: bool, left: float) -> str:
    """What was not as it must be; empty text if the watchdog passed."""
    times, theta = [one.time for one in seen], [one.theta for one in seen]

    def turned(begin: float, end: float) -> float:
        return abs(float(np.interp(end, times, theta) - np.interp(begin, times, theta)))

    driven = turned(WATCHDOG_TIMEOUT - _SPAN, WATCHDOG_TIMEOUT)
    if driven < _LEAST:
        raise BenchError(
            f"The servo did not turn at {CAREFUL.voltage:g} V, so nothing was tested: is the amplifier on, its "
            "emergency stop released, and the arm free?"
        )
    if locked:
        stood = turned(WATCHDOG_TIMEOUT, _END) < _COASTS * driven
    else:
        stood = turned(_END - _SPAN, _END) < _STANDS * driven
    if ran_away or not stood:
        return f"The watchdog did not stop the motor: the servo still turned {_END:g} s after the last sign of life."
    if not expired:
        return "The servo stopped, but the watchdog had not expired: something else stopped it."
    if abs(left) > _ZERO:
        return f"The watchdog left {left:.2f} V on the loopback's output."
    return ""
