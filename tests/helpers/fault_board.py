"""A board on which things go wrong, at a sample of one's choice, in time that the test owns."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from rotflex.config import joint, srv02
from rotflex.errors import HILError
from rotflex.hil.bench import Bench, Connection, Limits, Recorder, Safety, Wiring
from rotflex.hil.guard import Guard
from rotflex.hil.student_benches import preset
from rotflex.hil.virtual import VirtualBoard
from rotflex.plant import REST, State

SAMPLE_TIME = 0.002
FAULT_AT = 150  #: the sample at which it goes wrong; the arm is in motion then


class Stopwatch:
    """Time that passes while somebody waits, or when the test says so; the same for the board and the bench."""

    def __init__(self) -> None:
        self.time = 0.0

    def now(self) -> float:
        return self.time

    def wait_until(self, instant: float) -> None:
        self.time = max(self.time, instant)

    def pass_by(self, duration: float) -> None:
        self.time += duration


FOR_GOOD = 10_000  # times


def failing(error_at: int = 0, error: BaseException | None = None, times: int = 1) -> Callable[[int], None]:
    """Make a verb that fails ``times`` times, from sample ``error_at`` on."""
    waiting = [error or HILError("the board refused")] * times

    def before(sample: int) -> None:
        if sample >= error_at and waiting:
            raise waiting.pop()

    return before


class FaultBoard:
    """The virtual board behind a layer that spoils what it is told to.

    Attributes
    ----------
    before : verb → called with the sample's number before each call; what it raises is the board's failure
    spoil : called with counts (servo, link) and the sample's number; what it returns is read in their place
    came : how many samples a read returns, if not as many as it was asked for
    loses : sample → how many are lost in one burst before it; the board does not say how many it lost
    sample : how many samples were read since the last run began
    told : each verb that it was told, with a copy of its values
    written : each voltage while it took samples, after its time, s
    """

    def __init__(self, bench: str = "real_bench", state: State = REST) -> None:
        self.time = Stopwatch()
        spec = preset(bench)
        self.inner = VirtualBoard(spec.parameters, state=state, clock=self.time, timing=spec.timing)
        self.told: list[tuple[str, list[Any]]] = []
        self.written: list[tuple[float, float]] = []
        self.before: dict[str, Callable[[int], None]] = {}
        self.spoil: Callable[[list[int], int], list[int]] | None = None
        self.came: Callable[[int], int | None] = lambda sample: None
        self.loses: dict[int, int] = {}
        self.sample = 0
        self.unplugged = False

    def __getattr__(self, verb: str) -> Callable[..., Any]:
        method = getattr(self.inner, verb)

        def call(*arguments: Any) -> Any:
            self.told.append((verb, [one.tolist() if isinstance(one, np.ndarray) else one for one in arguments]))
            if verb in self.before:
                self.before[verb](self.sample)
            if self.unplugged and verb not in ("is_valid", "close"):
                raise HILError(f"{verb}: the board does not answer")
            return method(*arguments)

        return call

    def task_start(self, *arguments: Any) -> None:
        self.__getattr__("task_start")(*arguments)
        self.sample = 0

    def write_analog(self, channels: Any, count: int, voltages: Any) -> None:
        self.__getattr__("write_analog")(channels, count, voltages)
        if self.sample:
            self.written.append((self.time.now(), float(voltages[0])))

    def task_read_encoder(self, task: int, samples: int, buffer: Any) -> int:
        for lost in [self.loses.pop(one, 0) for one in range(self.sample, self.sample + samples)]:
            if lost:
                self.inner.task_read_encoder(task, lost, np.zeros(2 * lost, dtype=np.int32))
        count = int(self.__getattr__("task_read_encoder")(task, samples, buffer))
        for place in range(count):
            if self.spoil is not None:
                buffer[2 * place : 2 * place + 2] = self.spoil(buffer[2 * place : 2 * place + 2].tolist(), self.sample)
            self.sample += 1
        came = self.came(self.sample)
        return count if came is None else came

    def task_get_buffer_overflows(self, task: int) -> int:
        raise AssertionError("the maker does not say whether a burst of lost samples counts once, or for each sample")

    @property
    def voltage(self) -> float:
        """What is on the output now."""
        return float(self.inner.terminals.commanded[0])

    @property
    def transcript(self) -> list[str]:
        """The verbs that it was told."""
        return [verb for verb, _values in self.told]

    def values(self, verb: str) -> list[list[Any]]:
        """What a verb was told, each time."""
        return [values for told, values in self.told if told == verb]

    def let_time_pass(self) -> None:
        """A second in which no program says a word; the board itself goes on."""
        self.time.pass_by(1.0)
        self.inner._catch_up(self.time.now())


def bench_of(board: FaultBoard, folder: Path | None = None, **choices: Any) -> Bench:
    """A bench that can come to harm, above a board on which things go wrong."""
    limits = choices.pop("limits", Limits())
    wiring = choices.pop("wiring", Wiring())
    servo = srv02()
    safety = Safety(limits, Guard(servo, limits.alpha), **choices)
    connection = Connection(lambda: board, servo, wiring=wiring, now=board.time.now)
    return Bench(connection, servo, joint(1), {"uri": "test", "clock": "wall"}, safety, Recorder(folder))


def counts_of(degrees: float) -> int:
    """An angle in counts."""
    return round(np.radians(degrees) / srv02().K_enc)
