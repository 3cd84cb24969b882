"""The boards of the package keep the contract."""

import sys
from unittest.mock import patch

import numpy as np
import quanser_double
from board_contract import *  # noqa: F403  its tests, on the boards below
from board_contract import Entry

from rotflex.hil import quanser
from rotflex.hil.board import Board
from rotflex.hil.replay import RecordedPlant
from rotflex.hil.student_benches import preset
from rotflex.hil.virtual import VirtualBoard
from rotflex.recording import Recording


def _virtual() -> VirtualBoard:
    return VirtualBoard(preset("real_bench").parameters)


def _replay() -> VirtualBoard:
    t = np.arange(0, 1.0, 0.002)
    return VirtualBoard(RecordedPlant(Recording.of(t, theta=0 * t, alpha=0 * t, vm=0 * t)))


def _quanser(identifier: str) -> Board:
    modules, _opened = quanser_double.package(_virtual)
    with patch.dict(sys.modules, modules):
        return quanser.connect("q2_usb", identifier)


SIMULATOR = "0@tcpip://localhost:18000?nagle='off'"
BOARDS: dict[str, Entry] = {
    "virtual": Entry(_virtual),
    "replay": Entry(_replay, moves=False),
    "quanser": Entry(lambda: _quanser("0"), lenient=False, time_waits=False),
    "quanser's simulator": Entry(lambda: _quanser(SIMULATOR), lenient=False),
}
