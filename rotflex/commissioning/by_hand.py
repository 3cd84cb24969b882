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


def counts(bench: Bench, told: BenchFile) -> tuple[int, int]:
    """What the counters of servo and link read now."""
    buffer = np.zeros(2, dtype=np.int32)
    bench.board.read_encoder(_channels(told.wiring["servo_encoder"], told.wiring["link_encoder"]), 2, buffer)
    servo, link = buffer.tolist()
    return servo, link


def loopback(bench: Bench, told: BenchFile) -> str:
    """Whether what is written to the joined output comes in at the input; what was seen, in words.

    Raises
    ------
    BenchError
        If it does not.
    """
    if told.loopback is None:
        return "not tried: bench.toml names no loopback_output and loopback_input"
    output, source = (_channels(one) for one in told.loopback)
    read = np.zeros(1)
    try:
        for volts in _LOOPED:
            bench.board.write_analog(output, 1, np.array([volts]))
            bench.board.read_analog(source, 1, read)
            if abs(read[0] - volts) > _OFF_BY:
                raise BenchError(
                    f"{volts:g} V on analog output {told.loopback[0]} came in as {read[0]:.2f} V at analog input "
                    f"{told.loopback[1]}: look at the cable between them, and at the board's ranges."
                )
    finally:
        bench.board.write_analog(output, 1, np.zeros(1))
    return f"what is written comes in, within {_OFF_BY:g} V"


def directions(bench: Bench, told: BenchFile, dialogue: Dialogue) -> dict[str, int]:
    """The signs of both encoders, by name. Positive is counter-clockwise, seen from above.

    Raises
    ------
    BenchError
        If the wrong encoder counts, or none.
    """
    first = counts(bench, told)
    dialogue.wait("Turn the servo with the arm on it COUNTER-CLOCKWISE, seen from above, by about 20 degrees.")
    servo = _moved(bench, told, first)
    _require(servo, 0, "the servo", told)
    second = counts(bench, told)
    dialogue.wait(
        "Hold the servo, and bend the arm COUNTER-CLOCKWISE against its springs by about 5 degrees. Keep it there."
    )
    link = _moved(bench, told, second)
    _require(link, 1, "the arm", told)
    dialogue.wait("Let the arm go.")
    return {"servo_sign": int(np.sign(servo[0])), "link_sign": int(np.sign(link[1]))}


def _moved(bench: Bench, told: BenchFile, before: tuple[int, int]) -> tuple[int, int]:
    servo, link = counts(bench, told)
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
    begin = counts(bench, told)[0]
    readings = []
    text = "Turn the servo slowly by exactly one full turn, mark to mark, counter-clockwise."
    for _each in dialogue.turning(text):
        readings.append((counts(bench, told)[0], _potentiometer(bench, told)))
    turned = abs(counts(bench, told)[0] - begin)
    nearest = min(ENCODERS, key=lambda name: abs(math.log(max(turned, 1) / ENCODERS[name])))
    if abs(turned / ENCODERS[nearest] - 1) > 0.1:
        raise BenchError(
            f"A full turn counted {turned}; the encoders that exist have "
            f"{', '.join(str(one) for one in ENCODERS.values())} counts a turn. Turn it from mark to mark, and "
            "look whether the board counts all four edges."
        )
    return Turn(turned, nearest, _gap(readings))


def _potentiometer(bench: Bench, told: BenchFile) -> float:
    if told.potentiometer is None:
        return 0.0
    volts = np.zeros(1)
    bench.board.read_analog(_channels(told.potentiometer), 1, volts)
    return float(volts[0])


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


def _channels(*numbers: int) -> Channels:
    return np.array(numbers, dtype=np.uint32)
