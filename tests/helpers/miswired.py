"""A virtual bench whose motor and encoders may be wired the wrong way round, and a person who moves it by hand."""

from collections.abc import Iterator
from typing import Any

from fault_board import Stopwatch

from rotflex.hil.bench import Bench
from rotflex.hil.student_benches import VirtualPlantSpec, preset
from rotflex.hil.virtual import SERVO_ENCODER, VirtualBoard
from rotflex.plant import Plant
from rotflex.units import DEG

SIGNS = tuple((motor, servo, link) for motor in (1, -1) for servo in (1, -1) for link in (1, -1))


class _Turned(VirtualBoard):
    """A board with counters that may count the other way than those of the virtual bench."""

    turned = (1, 1)

    def _counted(self, channel: int) -> int:
        state, servo = self.plant.state, channel == SERVO_ENCODER
        angle = state.theta if servo else state.alpha
        return self.turned[0 if servo else 1] * round(angle / self._per_count[channel]) + self._offsets[channel]


class Laboratory:
    """Makes boards with the same bench on them, wired with these signs; ``board`` is the one made last."""

    def __init__(self, motor: int, servo: int, link: int, spec: VirtualPlantSpec | None = None) -> None:
        self.signs, self.spec = (motor, servo, link), spec or preset("real_bench")
        self.made: list[VirtualBoard] = []
        self.moved = 0.0  # rad, the largest angle of the servo under voltage

    @property
    def board(self) -> VirtualBoard:
        return self.made[-1]

    def __call__(self) -> VirtualBoard:
        plant = Plant(self.spec.parameters)
        laboratory, advance, motor = self, plant.advance, self.signs[0]

        class Driven:
            """The plant as the motor's cable has it."""

            @property
            def state(self) -> Any:
                return plant.state

            @state.setter
            def state(self, state: Any) -> None:
                plant.state = state

            def advance(self, voltage: float, duration: float) -> Any:
                state = advance(motor * voltage, duration)
                laboratory.moved = max(laboratory.moved, abs(state.theta))
                return state

        board = _Turned(Driven(), timing=self.spec.timing)
        board.turned = self.signs[1:]
        self.made.append(board)
        return board


class InItsOwnTime(Laboratory):
    """Its boards run in time that does not wait for the program."""

    def __init__(self, *wired: Any) -> None:
        super().__init__(*wired)
        self.time = Stopwatch()

    def __call__(self) -> VirtualBoard:
        board = super().__call__()
        board.clock = self.time
        return board

    def timed(self, bench: Bench) -> Bench:
        """Have a bench of one of the boards measure its time."""
        bench.connection.now = self.time.now
        return bench


class Person:
    """Does what is asked for, on the bench of a laboratory; ``heard`` is all that was said.

    ``clockwise`` is what they turn the wrong way: "servo_sign" or "link_sign".
    """

    def __init__(
        self, laboratory: Laboratory | None, agrees: bool = True, moves: bool = True, clockwise: str = ""
    ) -> None:
        self.laboratory, self.agrees, self.moves = laboratory, agrees, moves
        self.clockwise = clockwise
        self.heard: list[str] = []

    def say(self, text: str) -> None:
        self.heard.append(text)

    def agree(self, text: str) -> bool:
        self.heard.append(text)
        return self.agrees

    def wait(self, text: str) -> None:
        self.heard.append(text)
        if text.startswith("Turn the servo with"):
            self._move(theta=-20 * DEG if self.clockwise == "servo_sign" else 20 * DEG)
        elif text.startswith("Hold the servo"):
            self._move(alpha=-5 * DEG if self.clockwise == "link_sign" else 5 * DEG)
        elif text.startswith("Let the arm go"):
            self._move(alpha=5 * DEG if self.clockwise == "link_sign" else -5 * DEG)
        elif text.startswith("Turn the arm back"):
            self._move(theta=-10 * DEG)  # a turn on from where it was

    def turning(self, text: str) -> Iterator[None]:
        self.heard.append(text)
        for _each in range(360):
            self._move(theta=1 * DEG)
            yield

    def _move(self, theta: float = 0.0, alpha: float = 0.0) -> None:
        if self.moves and self.laboratory:
            plant: Any = self.laboratory.board.plant
            state = plant.state
            plant.state = state._replace(theta=state.theta + theta, alpha=state.alpha + alpha)
