"""The steps at 0 V, in which a person moves the bench: what is on which channel, and which way it counts."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np

from rotflex.commissioning.dialogue import Dialogue
from rotflex.config import ENCODERS
from rotflex.errors import BenchError
from rotflex.hil.bench import Bench
from rotflex.hil.bench_file import BenchFile
from rotflex.hil.board import Channels

_ENOUGH = 30  # counts, of a push by hand; 1.3 deg at least
_LOOPED = (-2.0, 0.0, 2.0)  # V
_OFF_BY = 0.1  # V
_JUMP = 2.0  # V, of the potentiometer from one reading to the next; 70 deg


def read_volts(bench: Bench, channel: int) -> float:
    """What an analog input reads, V."""
    volts = np.zeros(1)
    bench.board.read_analog(np.array([channel], dtype=np.uint32), 1, volts)
    return float(volts[0])


def write_loopback(bench: Bench, told: BenchFile, volts: float) -> None:
    """Set the output that a cable may join to an input, V, where it is named."""
    if told.loopback is not None:
        bench.board.write_analog(np.array(told.loopback[:1], dtype=np.uint32), 1, np.array([volts]))


def outputs(told: BenchFile) -> Channels:
    """The motor's output, and that of a loopback, where there is one."""
    return np.array([told.wiring["motor"], *(told.loopback or ())[:1]], dtype=np.uint32)


def loopback(bench: Bench, told: BenchFile) -> str:
    """Whether what is written to the joined output comes in at the input; what was seen, in words.

    Raises
    ------
    BenchError
        If it does not.
    """
    if told.loopback is None:
        return "not tried: bench.toml names no loopback_output and loopback_input"
    try:
        for volts in _LOOPED:
            write_loopback(bench, told, volts)
            read = read_volts(bench, told.loopback[1])
            if abs(read - volts) > _OFF_BY:
                raise BenchError(
                    f"{volts:g} V on analog output {told.loopback[0]} came in as {read:.2f} V at analog input "
                    f"{told.loopback[1]}: look at the cable between them, and at the board's ranges."
                )
    finally:
        write_loopback(bench, told, 0.0)
    return f"what is written comes in, within {_OFF_BY:g} V"


def directions(bench: Bench, told: BenchFile, dialogue: Dialogue) -> dict[str, int]:
    """The signs of both encoders, by name. Positive is counter-clockwise, seen from above.

    Raises
    ------
    BenchError
        If the wrong encoder counts, or none.
    """
    first = bench.counts()
    dialogue.wait("Turn the servo with the arm on it COUNTER-CLOCKWISE, seen from above, by about 20 degrees.")
    servo = _moved(bench, first)
    _require(servo, 0, "the servo", told)
    second = bench.counts()
    dialogue.wait(
        "Hold the servo, and bend the arm COUNTER-CLOCKWISE against its springs by about 5 degrees. Keep it there."
    )
    link = _moved(bench, second)
    _require(link, 1, "the arm", told)
    dialogue.wait("Let the arm go.")
    return {"servo_sign": int(np.sign(servo[0])), "link_sign": int(np.sign(link[1]))}


def _moved(bench: Bench, before: tuple[int, int]) -> tuple[int, int]:
    servo, link = bench.counts()
    return servo - before[0], link - before[1]


def _require(moved: tuple[int, int], which: int, what: str, told: BenchFile) -> None:
    """That one encoder counted, and more than the other one did."""
    channels = (told.wiring["servo_encoder"], told.wiring["link_encoder"])
    mine, others = abs(moved[which]), abs(moved[1 - which])
    if mine >= _ENOUGH and mine > others:
        return
    if others >= _ENOUGH:
        raise BenchError(
            f"You moved {what}, and encoder {channels[1 - which]} counted {others} where encoder "
            f"{channels[which]} counted {mine}: the two are the other way round. Exchange their cables, or "
            "servo_encoder and link_encoder in bench.toml."
        )
    raise BenchError(
        f"You moved {what}, and encoder {channels[which]} counted {mine}, which is too little to tell a "
        "direction: look at its cable and its number in bench.toml, and move it further."
    )


@dataclass(frozen=True)
class Turn:
    """A full turn by hand: how many counts it was, and where the counter stood as the potentiometer jumped."""

    counts: int
    encoder: str
    gap: float | None


def full_turn(bench: Bench, told: BenchFile, dialogue: Dialogue) -> Turn:
    """Counts of a turn of the servo, and the potentiometer's gap, where it is connected.

    Raises
    ------
    BenchError
        If no encoder that exists has so many.
    """
    begin = bench.counts()[0]
    readings = []
    text = "Turn the servo slowly by exactly one full turn, mark to mark, counter-clockwise."
    for _each in dialogue.turning(text):
        readings.append(
            (bench.counts()[0], 0.0 if told.potentiometer is None else read_volts(bench, told.potentiometer))
        )
    turned = abs(bench.counts()[0] - begin)
    nearest = min(ENCODERS, key=lambda name: abs(math.log(max(turned, 1) / ENCODERS[name])))
    if abs(turned / ENCODERS[nearest] - 1) > 0.1:
        raise BenchError(
            f"A full turn counted {turned}; the encoders that exist have "
            f"{', '.join(str(one) for one in ENCODERS.values())} counts a turn. Turn it from mark to mark, and "
            "look whether the board counts all four edges."
        )
    return Turn(turned, nearest, _gap(readings))


def _gap(readings: list[tuple[int, float]]) -> float | None:
    """The middle of the jumps, in counts; None if there is no jump."""
    jumps = [
        (before[0] + after[0]) / 2
        for before, after in itertools.pairwise(readings)
        if abs(after[1] - before[1]) > _JUMP
    ]
    return float(np.mean(jumps)) if jumps else None


def from_zero(turn: Turn, zero: int, sign: int) -> float | None:
    """Where the potentiometer's gap is, deg from where the counter of the servo stood at zero, 0 to 360."""
    if turn.gap is None:
        return None
    return float(sign * (turn.gap - zero) * 360 / ENCODERS[turn.encoder] % 360)
