"""A board that goes on counting while it is closed, as one does that has power; and a bench of it.

python powered.py DEGREES     mark where the arm stands, and turn it by hand by so much before the bench is closed
"""

import sys
from typing import Any

from fault_board import Stopwatch

from rotflex.hil import real
from rotflex.hil.bench import Bench
from rotflex.hil.real import Setup
from rotflex.hil.student_benches import preset
from rotflex.hil.virtual import VirtualBoard
from rotflex.plant import Plant
from rotflex.units import DEG


class Powered:
    """The board; ``off`` and on again, it counts from 0."""

    def __init__(self) -> None:
        self.plant, self.time, self.at_zero = Plant(preset("real_bench").parameters), Stopwatch(), 0.0
        self.board: VirtualBoard

    def turn(self, degrees: float) -> None:
        """By hand."""
        state = self.plant.state
        self.plant.state = state._replace(theta=state.theta + degrees * DEG)

    def off(self) -> None:
        self.at_zero = self.plant.state.theta

    def connect(self) -> VirtualBoard:
        self.board = VirtualBoard(self.plant, clock=self.time)
        self.board._offsets[0] = -round(self.at_zero / self.board.servo.K_enc)
        return self.board

    def bench(self, **setup: Any) -> Bench:
        chosen = {"commissioned": lambda: "", "marked": True, "guarded": False, **setup}
        bench = real.make_bench("test", self.connect, Setup(**chosen))
        bench.connection.now = self.time.now
        return bench


if __name__ == "__main__":
    powered = Powered()
    with powered.bench() as one:
        one.set_zero()
        powered.turn(float(sys.argv[1]))
