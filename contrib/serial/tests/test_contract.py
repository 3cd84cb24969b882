"""The serial board keeps the contract that the boards of rotflex keep."""

import pytest
from board_contract import *  # noqa: F403  its tests, on the board below
from board_contract import Entry
from rotflex_serial.board import SerialBoard
from simulated_uno import SUPPLY, SimulatedPort, SimulatedUno, lacking

from rotflex.hil.student_benches import preset


def _serial() -> SerialBoard:
    if lacking():
        pytest.skip(lacking())
    return SerialBoard(SimulatedPort(SimulatedUno(preset("real_bench").parameters)), SUPPLY)


BOARDS = {"serial": Entry(_serial, time_waits=False, adjustable=False)}
