"""The boards that the contract is tried on: a line each."""

import sys
from collections.abc import Callable
from dataclasses import dataclass
from unittest.mock import patch

import numpy as np
import pytest
import quanser_double
from simulated_uno import SUPPLY, SimulatedPort, SimulatedUno, lacking

from rotflex.hil import quanser
from rotflex.hil.board import Board
from rotflex.hil.replay import RecordedPlant
from rotflex.hil.serial.board import SerialBoard
from rotflex.hil.student_benches import preset
from rotflex.hil.virtual import VirtualBoard
from rotflex.recording import Recording


@dataclass(frozen=True)
class Entry:
    """How a board is made, fresh and open, with a bench at rest on its terminals, and what it cannot do.

    moves : whether voltage moves what hangs on it
    lenient : whether it takes what is documented nowhere, and says what is wrong with it
    time_waits : whether it has the overflow modes of simulated boards
    adjustable : whether its ranges, and how its encoders count, can be chosen
    """

    make: Callable[[], Board]
    moves: bool = True
    lenient: bool = True
    time_waits: bool = True
    adjustable: bool = True


def _virtual() -> VirtualBoard:
    return VirtualBoard(preset("real_bench").parameters)


def _replay() -> VirtualBoard:
    t = np.arange(0, 1.0, 0.002)
    return VirtualBoard(RecordedPlant(Recording.of(t, theta=0 * t, alpha=0 * t, vm=0 * t)))


def _quanser(identifier: str) -> Board:
    modules, _opened = quanser_double.package(_virtual)
    with patch.dict(sys.modules, modules):
        return quanser.connect("q2_usb", identifier)


def _serial() -> Board:
    if lacking():
        pytest.skip(lacking())
    return SerialBoard(SimulatedPort(SimulatedUno(preset("real_bench").parameters)), SUPPLY)


SIMULATOR = "0@tcpip://localhost:18000?nagle='off'"
BOARDS: dict[str, Entry] = {
    "virtual": Entry(_virtual),
    "replay": Entry(_replay, moves=False),
    "quanser": Entry(lambda: _quanser("0"), lenient=False, time_waits=False),
    "quanser's simulator": Entry(lambda: _quanser(SIMULATOR), lenient=False),
    "serial": Entry(_serial, time_waits=False, adjustable=False),
}
MOVING = [name for name, entry in BOARDS.items() if entry.moves]
ADJUSTABLE = [name for name, entry in BOARDS.items() if entry.moves and entry.adjustable]
LENIENT = [name for name, entry in BOARDS.items() if entry.lenient]
