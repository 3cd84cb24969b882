"""What is written to the board, not only that something is: 0 V on opening and whenever opening is broken off."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from rotflex.config import joint, srv02
from rotflex.errors import BenchError, HILError
from rotflex.hil.bench import Bench, Limits, Wiring
from rotflex.hil.board import BufferOverflowMode, Clock
from rotflex.hil.student_benches import preset
from rotflex.hil.virtual import VirtualBoard

SAMPLE_TIME = 0.002
OPENING = ["watchdog_set_analog_expiration_state", "watchdog_clear", "watchdog_stop", "write_analog"]


class WatchedBoard:
    """A virtual board whose outputs somebody left at 7 V; it keeps what it is told, with a copy of each value."""

    def __init__(self, interrupted_at: str = "") -> None:
        self.inner = VirtualBoard(preset("workbook").parameters)
        self.inner.write_analog(np.array([0], dtype=np.uint32), 1, np.array([7.0]))
        self.interrupted_at = interrupted_at
        self.told: list[tuple[str, list[Any]]] = []

    def __getattr__(self, verb: str) -> Callable[..., Any]:
        method = getattr(self.inner, verb)

        def call(*arguments: Any) -> Any:
            plain = [one.tolist() if isinstance(one, np.ndarray) else one for one in arguments]
            self.told.append((verb, plain))
            if verb == self.interrupted_at:
                self.interrupted_at = ""
                raise KeyboardInterrupt
            return method(*arguments)

        return call

    @property
    def voltage(self) -> float:
        return self.inner.terminals.commanded[0]

    def values(self, verb: str) -> list[list[Any]]:
        """What a verb was told, each time."""
        return [plain for told, plain in self.told if told == verb]


def bench_of(board: WatchedBoard, identity: Any = None, cable_gain: int = 1, **choices: Any) -> Bench:
    servo = srv02(cable_gain=cable_gain)
    return Bench(lambda: board, servo, joint(1), identity or {"clock": "simulated"}, **choices)


def test_a_bench_is_opened_at_exactly_0_V_whatever_was_on_the_output_and_so_is_its_watchdog():
    board = WatchedBoard()
    assert board.voltage == 7.0
    with bench_of(board):
        assert board.voltage == 0.0
        assert board.values("write_analog") == [[[0], 1, [0.0]]]
        assert board.values("watchdog_set_analog_expiration_state") == [[[0], 1, [0.0]]]
        assert board.inner._watchdog.states == {0: 0.0}


@pytest.mark.parametrize("verb", OPENING)
def test_ctrl_c_while_a_bench_is_opened_leaves_0_V_and_a_closed_board(verb):
    board = WatchedBoard(interrupted_at=verb)
    bench = bench_of(board)
    with pytest.raises(KeyboardInterrupt), bench:
        pytest.fail("the block must not be entered")
    assert board.voltage == 0.0
    assert board.values("write_analog")[-1] == [[0], 1, [0.0]]
    assert board.told[-1][0] == "close" and not board.inner.is_valid()
    with pytest.raises(BenchError, match="not open"):
        bench.read()


@pytest.mark.parametrize("verb", ["task_create_encoder_reader", "watchdog_start", "task_start", "task_read_encoder"])
def test_ctrl_c_while_a_run_begins_leaves_0_V_and_a_closed_board(verb):
    board = WatchedBoard(interrupted_at=verb)
    with pytest.raises(KeyboardInterrupt), bench_of(board) as bench:
        bench.start(SAMPLE_TIME)
        bench.read()
    assert board.voltage == 0.0 and not board.inner.is_valid()


@pytest.mark.parametrize("came", [0, 2, -1])
def test_a_board_that_returns_no_sample_or_not_one_is_told_and_the_motor_is_at_0_V(came, monkeypatch):
    board = WatchedBoard()
    with pytest.raises(HILError, match="no sample"), bench_of(board) as bench:
        bench.start(SAMPLE_TIME)
        bench.read()
        bench.write(3.0)
        assert board.voltage == 3.0
        monkeypatch.setattr(board.inner, "task_read_encoder", lambda *_: came)
        reloads = len(board.values("watchdog_reload"))
        try:
            bench.read()
        finally:
            assert len(board.values("watchdog_reload")) == reloads  # nobody is alive by this
    assert board.voltage == 0.0 and not board.inner.is_valid()


@pytest.mark.parametrize("gain", [1, 3, 5])
def test_each_voltage_reaches_the_board_with_its_value_and_a_stop_writes_0_V(gain):
    """What is asked for is the motor's; the cable's gain stands between it and the board."""
    board = WatchedBoard()
    with bench_of(board, cable_gain=gain, wiring=Wiring(motor=1)) as bench:
        bench.start(SAMPLE_TIME)
        for volts in (1.25, -4.0):
            bench.write(volts)
        bench.stop()
        written = board.values("write_analog")
        assert [[channels, number] for channels, number, _buffer in written] == [[[1], 1]] * 5
        volts = [buffer for _channels, _number, (buffer,) in written]
        assert volts == pytest.approx([0.0, 0.0, 1.25 / gain, -4.0 / gain, 0.0], abs=0, rel=1e-12)


@pytest.mark.parametrize(
    ("identity", "mode"),
    [
        ({"clock": "simulated"}, BufferOverflowMode.SYNCHRONIZED),
        ({"clock": "wall"}, BufferOverflowMode.OVERWRITE_ON_OVERFLOW),
        ({"uri": "quanser:q2_usb/0"}, BufferOverflowMode.OVERWRITE_ON_OVERFLOW),
    ],
)
def test_what_a_run_tells_the_board_with_its_values(identity, mode):
    board = WatchedBoard()
    with bench_of(board, identity) as bench:
        bench.start(0.005)
        task = bench._task
        assert board.values("set_encoder_counts") == [[[0, 1], 2, [0, 0]]]
        assert board.values("task_create_encoder_reader") == [[200, [0, 1], 2]]  # one second of samples
        assert board.values("task_set_buffer_overflow_mode") == [[task, mode]]
        assert board.values("watchdog_start") == [[0.2]]
        assert board.values("task_start") == [[task, Clock.HARDWARE_CLOCK_0, 200.0, 2**32 - 1]]
        bench.stop()
        assert board.values("task_stop") == board.values("task_delete") == [[task]]


def test_the_watchdog_outlasts_every_sample_time_that_is_taken_and_limits_are_the_laboratorys():
    with bench_of(WatchedBoard()) as bench:
        bench.start(0.199)
        with pytest.raises(BenchError, match=r"0\.2 s"):
            bench.start(0.2)
    assert (Limits().voltage, Limits().theta, Limits().alpha) == pytest.approx((10.0, np.pi, np.pi / 6))


def test_an_arm_that_is_turned_by_hand_at_0_V_breaks_no_limit(monkeypatch):
    board = WatchedBoard()
    with bench_of(board, limits=Limits(theta=0.1, alpha=0.1, rate=1.0, duration=0.01)) as bench:
        bench.start(SAMPLE_TIME)
        coming = iter(range(0, 4000, 200))

        def read(task: int, number: int, counts: Any) -> int:
            counts[:] = next(coming)
            return 1

        monkeypatch.setattr(board.inner, "task_read_encoder", read)
        for _sample in range(20):
            bench.read()
            bench.write(0.0)
        assert bench.latest.theta > 5


@pytest.mark.parametrize(("limit", "angle"), [("theta", "servo angle"), ("alpha", "deflection")])
@pytest.mark.parametrize("sign", [1, -1])
def test_an_angle_may_be_at_its_limit_and_not_beyond(limit, angle, sign, monkeypatch):
    board = WatchedBoard()
    count = srv02().K_enc  # rad
    at = {"theta": 100, "alpha": 50}
    limits = Limits(**{name: counts * count for name, counts in at.items()})
    coming = iter([at[limit], at[limit] + 1])

    def read(task: int, number: int, counts: Any) -> int:
        counts[:] = (sign * next(coming), 0) if limit == "theta" else (0, sign * next(coming))
        return 1

    with bench_of(board, limits=limits) as bench:
        bench.start(SAMPLE_TIME)
        bench.write(0.01)
        monkeypatch.setattr(board.inner, "task_read_encoder", read)
        assert abs(getattr(bench.read(), limit)) == pytest.approx(at[limit] * count)
        with pytest.raises(Exception, match=f"The {angle} reached"):
            bench.read()
        assert board.voltage == 0.0
