"""The bench: radians and volts, its limits, and 0 V in the end whatever happens."""

from __future__ import annotations

import itertools
import math
import signal
import sys
from typing import Any

import numpy as np
import pytest
from fault_board import FOR_GOOD, FaultBoard, failing

from rotflex import hil
from rotflex.config import joint, srv02
from rotflex.errors import BenchError, ConfigurationError, HILError, LimitExceeded
from rotflex.hil import halt
from rotflex.hil.bench import Bench, Connection, Limits, Safety, Wiring
from rotflex.hil.board import WATCHDOG_TIMEOUT, BufferOverflowMode, Clock
from rotflex.plant import State
from rotflex.units import DEG

SAMPLE_TIME = 0.002
OPENING = ["watchdog_set_analog_expiration_state", "watchdog_clear", "watchdog_stop", "write_analog"]


@pytest.fixture
def board() -> FaultBoard:
    return FaultBoard("workbook")


@pytest.fixture
def left_at_7_V(board) -> FaultBoard:
    """A board with a voltage left on its output."""
    board.inner.write_analog(np.array([0], dtype=np.uint32), 1, np.array([7.0]))
    return board


def bench_of(board: FaultBoard, identity: Any = None, cable_gain: int = 1, **choices: Any) -> Bench:
    identity = identity or {"uri": "test", "clock": "simulated"}
    servo, safety = srv02(cable_gain=cable_gain), choices.pop("safety", Safety(choices.pop("limits", Limits())))
    return Bench(Connection(lambda: board, servo, **choices), servo, joint(1), identity, safety)


def assert_left_alone(board: FaultBoard) -> None:
    """The motor is at 0 V, the watchdog does not watch any more, and the board is closed."""
    assert board.voltage == 0.0
    assert board.inner._watchdog.deadline == math.inf
    assert len(board.inner._tasks) == 0
    assert not board.inner.is_valid()
    assert board.transcript[-1] == "close"


def test_what_is_said_to_the_board_in_a_run_and_nothing_else(board):
    with bench_of(board) as bench:
        bench.start(SAMPLE_TIME)
        for _ in range(2):
            bench.read()
            bench.write(1.0)
        bench.stop()
    halt = ["watchdog_clear", "write_analog", "watchdog_stop"]
    start = ["read_encoder", "task_create_encoder_reader", "task_set_buffer_overflow_mode"]
    start += ["watchdog_start", "task_start"]
    sample = ["task_read_encoder", "watchdog_reload", "write_analog"]
    end = [*halt, "task_stop", "task_delete"]
    closing = ["is_valid", *halt, "close"]
    assert board.transcript == [*OPENING, *halt, *start, *sample, *sample, *end, *closing]
    assert_left_alone(board)


def test_the_motor_is_at_0_V_before_and_after_the_board_is_set_up(board):
    """A range that is chosen then may make other volts of the same number."""
    seen = []

    def prepare(_bench):
        seen.append((board.transcript.count("write_analog"), board.voltage))
        board.inner.write_analog(np.array([0], dtype=np.uint32), 1, np.array([3.0]))

    with bench_of(board, prepare=prepare):
        assert seen == [(1, 0.0)]
        assert (board.transcript.count("write_analog"), board.voltage) == (2, 0.0)


def test_angles_are_calibrated_and_counted_from_the_start():
    board = FaultBoard("workbook", State(1.0, 0.0, 0.0, 0.0))
    with bench_of(board) as bench:
        bench.start(SAMPLE_TIME)
        assert bench.read()[1:] == (0.0, 0.0)
        bench.write(4.0)
        for _ in range(100):
            measured = bench.read()
        true = board.inner.plant.state
        half_a_count = math.pi / 4096
        assert measured.theta == pytest.approx(true.theta - 1.0, abs=2 * half_a_count)
        assert measured.alpha == pytest.approx(true.alpha, abs=2 * half_a_count)
        assert measured.theta > 0.2
        bench.start(SAMPLE_TIME, zero=False)
        assert bench.read().theta == pytest.approx(measured.theta, abs=2 * half_a_count)
        bench.start(SAMPLE_TIME)
        assert bench.read()[1:] == (0.0, 0.0)


def test_voltages_are_cut_to_the_limit_and_the_amplifiers_and_reported_as_set(board):
    with bench_of(board, limits=Limits(voltage=6.0)) as bench:
        bench.start(SAMPLE_TIME)
        assert [bench.write(v) for v in (7.0, -100.0, 2.5, np.float64(3.0))] == [6.0, -6.0, 2.5, 3.0]
    servo = srv02(amplifier="Q3")
    with Bench(Connection(lambda: FaultBoard("workbook"), servo), servo, joint(1), {}) as bench:
        bench.start(SAMPLE_TIME)
        assert bench.write(10.0) == 4.16


def run(bench: Bench, samples: int = 10) -> None:
    bench.start(SAMPLE_TIME)
    for _ in range(samples):
        bench.read()
        bench.write(3.0)


@pytest.mark.parametrize("verb", ["watchdog_clear", "write_analog"])
def test_a_board_that_fails_on_opening_is_closed_again(verb, board):
    board.before[verb] = failing(times=FOR_GOOD)
    bench = bench_of(board)
    with pytest.raises(HILError, match="refused"), bench:
        pytest.fail("the block must not be entered")
    assert board.transcript[-1] == "close"
    assert not board.inner.is_valid()
    with pytest.raises(BenchError, match="not open"):
        bench.read()


@pytest.mark.parametrize("limits", [Limits(), Limits(theta=5 * DEG)], ids=["stop", "limit"])
def test_a_board_that_does_not_take_0_V_is_left_to_its_watchdog_and_not_said_to_stand(limits, board):
    with pytest.raises(HILError, match="refused"), bench_of(board, limits=limits) as bench:
        run(bench)
        board.before["write_analog"] = failing(times=FOR_GOOD)
        for _ in range(1000 if limits != Limits() else 0):
            bench.read()
    begun = len(board.transcript) - board.transcript[::-1].index("watchdog_start")
    again = ["is_valid", "write_analog"] if limits != Limits() else []  # asked once more as the bench is closed
    assert board.transcript[begun:] == ["task_stop", "task_delete", *again, "close"]
    watchdog = board.inner._watchdog
    assert watchdog.deadline <= board.inner.clock.now() + WATCHDOG_TIMEOUT
    assert watchdog.states == {0: 0.0}


@pytest.mark.parametrize(
    ("limits", "voltage", "named"),
    [
        (Limits(theta=20 * DEG), 6.0, r"servo.* 20\.\d deg at t = 0\.\d{3} s"),
        (Limits(alpha=8 * DEG), 8.0, r"deflection.* -8\.\d deg at t = 0\.\d{3} s"),
        (Limits(rate=1.0), -3.0, r"turned at -1\.\d.* rad/s"),
    ],
)
def test_a_limit_that_is_passed_stops_the_motor_and_says_which(limits, voltage, named, board):
    with bench_of(board, limits=limits) as bench:
        bench.start(SAMPLE_TIME)
        with pytest.raises(LimitExceeded, match=named):
            for _ in range(1000):
                bench.read()
                bench.write(voltage)
        assert board.voltage == 0.0
        with pytest.raises(BenchError, match="not sampling"):
            bench.read()
    assert_left_alone(board)


@pytest.mark.parametrize("before", [lambda b: None, lambda b: b.stop(), lambda b: (b.start(SAMPLE_TIME), b.stop())])
def test_no_voltage_is_set_while_no_watchdog_runs(before, board):
    """It would stay when the program is killed, and for as long as nobody reads."""
    with bench_of(board) as bench:
        before(bench)
        with pytest.raises(BenchError, match=r"start\(\)"):
            bench.write(1.0)
        assert board.voltage == 0.0
        assert bench.write(0.0) == 0.0


def interrupted(line: int, by_an_exception: bool) -> tuple[bool, FaultBoard, Bench]:
    """Ctrl-C at one of the lines that are passed as a bench is let go: whether there was one, the board, the bench."""
    files = {sys.modules[one.__module__].__file__ for one in (Bench, halt.halt)}
    board, passed = FaultBoard("workbook"), itertools.count(1)
    pressed = False

    def trace(frame: Any, event: str, _argument: Any) -> Any:
        nonlocal pressed
        if frame.f_code.co_filename not in files:
            return None
        if event == "line" and next(passed) == line:
            pressed = True
            signal.raise_signal(signal.SIGINT)
        return trace

    bench, heard = bench_of(board), None
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # whoever runs tests in the background ignores it
    try:
        with bench:
            run(bench)
            sys.settrace(trace)
            if by_an_exception:
                raise ZeroDivisionError
    except (KeyboardInterrupt, ZeroDivisionError) as error:
        heard = error
    finally:
        sys.settrace(None)
        signal.signal(signal.SIGINT, before)
    assert isinstance(heard, KeyboardInterrupt) == pressed
    return pressed, board, bench


@pytest.mark.parametrize("by_an_exception", [False, True])
def test_ctrl_c_at_whatever_moment_a_bench_is_let_go_leaves_it_at_0_V(by_an_exception):
    for line in itertools.count(1):
        pressed, board, bench = interrupted(line, by_an_exception)
        if not pressed:
            break
        if board.voltage != 0.0:  # nothing was begun: the board is open, and its watchdog runs
            assert bench.board is board and board.transcript[-1] == "write_analog"
            bench._close()
        assert_left_alone(board)
    assert line > 20


def test_a_bench_must_be_open_and_sampling():
    for verb in (lambda b: b.start(0.002), lambda b: b.read(), lambda b: b.write(1.0), lambda b: b.stop()):
        with pytest.raises(BenchError, match="not open"):
            verb(hil.open("virtual"))
    with hil.open("virtual") as bench, pytest.raises(BenchError, match=r"start\(\)"):
        bench.read()


def test_a_servo_that_cannot_carry_the_joint_is_refused():
    with pytest.raises(ConfigurationError, match="flexible joint mounted"):
        Bench(Connection(FaultBoard, srv02()), srv02(gear="low"), joint(1), {})


def test_the_address_goes_before_the_callers_preset_and_that_before_their_seed():
    assert hil.open("virtual:?seed=3", seed=9).identity["seed"] == 3
    assert hil.open("virtual", seed=9).identity["seed"] == 9
    assert hil.open().identity["seed"] == 0 and "seed=0" in repr(hil.open()) and "closed" in repr(hil.open())
    identity = {"uri": "virtual", "preset": "workbook", "run": 1, "arm_position": 1, "encoder": "E"}
    assert hil.open("virtual", seed=7, preset="workbook").identity == {**identity, "clock": "simulated"}
    assert hil.open("virtual:?seed=3", preset="workbook").identity["seed"] == 3
    assert hil.open("virtual:?preset=real_bench", preset="workbook").identity["preset"] == "real_bench"
    with pytest.raises(BenchError, match="a preset has its own parameters"):
        hil.open("virtual:?arm_position=2", preset="workbook")


@pytest.mark.parametrize(
    ("error", "uri", "named"),
    [
        (BenchError, "labjack:0", "virtual.*replay.*quanser.*serial"),
        (BenchError, "quanser:q2_usb", "'quanser:q2_usb/0'"),
        *((BenchError, f"virtual:{asked}", "seed, arm_position, preset") for asked in ("seed=7", "?speed=7")),
        (BenchError, "virtual:?seed=1&seed=2", "seed, arm_position, preset"),
        *((BenchError, f"virtual:?seed={seed}", f"seed .*'{seed}'") for seed in ("-1", "one")),
        (BenchError, "virtual:?preset=workbook&seed=1", "preset and a draw"),
        (ConfigurationError, "virtual:?arm_position=4", "arm_position.*4.*2, 3"),
        (ConfigurationError, "virtual:?preset=moon", "'moon'.*'real_bench', 'workbook'"),
        (ConfigurationError, "virtual:?clock=sundial", "'sundial'.*'simulated', 'wall'"),
    ],
)
def test_a_wrong_address_is_refused_and_what_is_allowed_is_named(error, uri, named):
    with pytest.raises(error, match=named):
        hil.open(uri)


def test_a_bench_is_opened_at_exactly_0_V_whatever_was_on_the_output_and_so_is_its_watchdog(left_at_7_V):
    board = left_at_7_V
    assert board.voltage == 7.0
    with bench_of(board):
        assert board.voltage == 0.0
        assert board.values("write_analog") == [[[0], 1, [0.0]]]
        assert board.values("watchdog_set_analog_expiration_state") == [[[0], 1, [0.0]]]
        assert board.inner._watchdog.states == {0: 0.0}


@pytest.mark.parametrize("verb", OPENING)
def test_ctrl_c_while_a_bench_is_opened_leaves_0_V_and_a_closed_board(verb, left_at_7_V):
    board = left_at_7_V
    board.before[verb] = failing(error=KeyboardInterrupt())
    bench = bench_of(board)
    with pytest.raises(KeyboardInterrupt), bench:
        pytest.fail("the block must not be entered")
    assert board.voltage == 0.0
    assert board.values("write_analog")[-1] == [[0], 1, [0.0]]
    assert board.told[-1][0] == "close" and not board.inner.is_valid()
    with pytest.raises(BenchError, match="not open"):
        bench.read()


@pytest.mark.parametrize("gain", [1, 3, 5])
def test_each_voltage_reaches_the_board_with_its_value_and_a_stop_writes_0_V(gain, board):
    """What is asked for is the motor's; the cable's gain stands between it and the board."""
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
def test_what_a_run_tells_the_board_with_its_values(identity, mode, board):
    with bench_of(board, identity) as bench:
        bench.start(0.005)
        task = bench.connection.task
        assert board.values("read_encoder") == [[[0, 1], 2, [0, 0]]]
        assert not board.values("set_encoder_counts")
        assert board.values("task_create_encoder_reader") == [[200, [0, 1], 2]]  # one second of samples
        assert board.values("task_set_buffer_overflow_mode") == [[task, mode]]
        assert board.values("watchdog_start") == [[0.2]]
        assert board.values("task_start") == [[task, Clock.HARDWARE_CLOCK_0, 200.0, 2**32 - 1]]
        bench.stop()
        assert board.values("task_stop") == board.values("task_delete") == [[task]]


def test_an_arm_that_is_turned_by_hand_at_0_V_breaks_no_limit(monkeypatch, board):
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
def test_an_angle_may_be_at_its_limit_and_not_beyond(limit, angle, sign, monkeypatch, board):
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
