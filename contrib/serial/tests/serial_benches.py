"""A serial board with the simulated firmware behind it, as tests of the board and of its faults use it."""

import numpy as np
from rotflex_serial.board import SerialBoard
from simulated_uno import SUPPLY, SimulatedPort, SimulatedUno

from rotflex.hil.board import BufferOverflowMode, Clock
from rotflex.plant import PlantParameters

MOTOR = np.array([0], dtype=np.uint32)
BOTH = np.array([0, 1], dtype=np.uint32)
FOREVER = 2**32 - 1


class Bench:
    """A board, and what is behind it."""

    def __init__(self, plant: PlantParameters | None = None) -> None:
        self.uno = SimulatedUno(plant)
        self.port = SimulatedPort(self.uno)
        self.board = SerialBoard(self.port, SUPPLY)
        self.counts = np.zeros(2, dtype=np.int32)
        self.task = 0

    def start(self, mode: BufferOverflowMode = BufferOverflowMode.OVERWRITE_ON_OVERFLOW, rate: float = 500.0) -> None:
        self.task = self.board.task_create_encoder_reader(500, BOTH, 2)
        self.board.task_set_buffer_overflow_mode(self.task, mode)
        self.board.task_start(self.task, Clock.HARDWARE_CLOCK_0, rate, FOREVER)

    def read(self) -> list[int]:
        assert self.board.task_read_encoder(self.task, 1, self.counts) == 1
        return self.counts.tolist()

    def write(self, volts: float) -> None:
        self.board.write_analog(MOTOR, 1, np.array([volts]))

    def cycle(self, volts: float) -> list[int]:
        """What a bench does in a sample."""
        counts = self.read()
        assert self.board.watchdog_reload() is True
        self.write(volts)
        return counts
