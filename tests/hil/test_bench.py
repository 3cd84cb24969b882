"""The bench: radians and volts, its limits, and 0 V in the end whatever happens."""

from __future__ import annotations

import itertools
import json
import math
import signal
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from rotflex import hil
from rotflex.config import joint, srv02
from rotflex.errors import BenchError, ConfigurationError, HILError, LimitExceeded
from rotflex.hil import halt
from rotflex.hil.bench import WATCHDOG_TIMEOUT, Bench, Limits, Wiring
from rotflex.hil.student_benches import DRAW, preset, student_bench
from rotflex.hil.virtual import VirtualBoard
from rotflex.plant import State
from rotflex.units import DEG

SAMPLE_TIME = 0.002


class FaultyBoard:
    """A virtual board that keeps a transcript of what it is told, and fails where it is told to.

    ``faults`` maps a verb to the number of its calls that still succeed.
    """

    def __init__(self, faults: dict[str, int] | None = None, state: State | None = None) -> None:
        self.inner = VirtualBoard(preset("workbook").parameters, state=state or State(0.0, 0.0, 0.0, 0.0))
        self.faults = dict(faults or {})
        self.transcript: list[str] = []

    def __getattr__(self, verb: str) -> Callable[..., Any]:
        method = getattr(self.inner, verb)

        def call(*arguments: Any) -> Any:
            self.transcript.append(verb)
            if verb in self.faults:
                self.faults[verb] -= 1
                if self.faults[verb] < 0:
                    raise HILError(f"{verb} failed")
            return method(*arguments)

        return call

    @property
    def voltage(self) -> float:
        """What is on the output now."""
        return self.inner.terminals.commanded[0]

    @property
    def tasks(self) -> int:
        """How many tasks there are."""
        return len(self.inner._tasks)


def bench_of(board: FaultyBoard, **choices: Any) -> Bench:
    return Bench(lambda: board, srv02(), joint(1), {"uri": "test", "clock": "simulated"}, **choices)


def assert_left_alone(board: FaultyBoard) -> None:
    """The motor is at 0 V, the watchdog does not watch any more, and the board is closed."""
    assert board.voltage == 0.0
    assert board.inner._watchdog.deadline == math.inf
    assert board.tasks == 0
    assert not board.inner.is_valid()
    assert board.transcript[-1] == "close"


# --- the usual course ------------------------------------------------------------------------------------------------


def test_what_is_said_to_the_board_in_a_run_and_nothing_else():
    board = FaultyBoard()
    with bench_of(board) as bench:
        bench.start(SAMPLE_TIME)
        for _ in range(2):
            bench.read()
            bench.write(1.0)
        bench.stop()
    opening = ["watchdog_set_analog_expiration_state", "watchdog_clear", "watchdog_stop", "write_analog"]
    halt = ["watchdog_clear", "write_analog", "watchdog_stop"]
    start = ["set_encoder_counts", "task_create_encoder_reader", "task_set_buffer_overflow_mode"]
    start += ["watchdog_start", "task_start"]
    sample = ["task_read_encoder", "watchdog_reload", "write_analog"]
    end = [*halt, "task_stop", "task_delete"]
    closing = ["is_valid", *halt, "close"]
    assert board.transcript == [*opening, *halt, *start, *sample, *sample, *end, *closing]
    assert_left_alone(board)


def test_the_motor_is_at_0_V_before_and_after_the_board_is_set_up():
    """A range that is chosen then may make other volts of the same number."""
    board = FaultyBoard()
    seen = []

    def prepare(opened):
        seen.append((opened.transcript.count("write_analog"), opened.voltage))
        opened.inner.write_analog(np.array([0], dtype=np.uint32), 1, np.array([3.0]))

    with bench_of(board, prepare=prepare):
        assert seen == [(1, 0.0)]
        assert (board.transcript.count("write_analog"), board.voltage) == (2, 0.0)


def test_time_counts_samples_from_the_start():
    with hil.open("virtual:?preset=workbook") as bench:
        for _ in range(2):
            bench.start(0.004)
            assert [bench.read().time for _ in range(3)] == [0.0, 0.004, 0.008]


def test_angles_are_calibrated_and_counted_from_the_start():
    board = FaultyBoard(state=State(1.0, 0.0, 0.0, 0.0))
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


def test_wiring_says_which_encoder_is_which_and_its_sign():
    board = FaultyBoard(state=State(0.0, 5 * DEG, 0.0, 0.0))
    swapped = Wiring(servo_encoder=1, link_encoder=0, link_sign=1)
    with bench_of(board, wiring=swapped) as bench:
        bench.start(SAMPLE_TIME, zero=False)
        assert bench.read().theta == pytest.approx(-5 * DEG, abs=1e-3)


def test_voltages_are_cut_to_the_limit_and_reported_as_set():
    with bench_of(FaultyBoard(), limits=Limits(voltage=6.0)) as bench:
        bench.start(SAMPLE_TIME)
        assert [bench.write(v) for v in (7.0, -100.0, 2.5, np.float64(3.0))] == [6.0, -6.0, 2.5, 3.0]


def test_the_amplifier_bounds_the_voltage_too():
    board = FaultyBoard()
    with Bench(lambda: board, srv02(amplifier="Q3"), joint(1), {}) as bench:
        bench.start(SAMPLE_TIME)
        assert bench.write(10.0) == 4.16


def test_the_cables_gain_is_taken_into_account():
    board = FaultyBoard()
    with Bench(lambda: board, srv02(cable_gain=5), joint(1), {}) as bench:
        bench.start(SAMPLE_TIME)
        bench.write(5.0)
        assert board.voltage == 1.0


# --- 0 V in the end --------------------------------------------------------------------------------------------------


def run(bench: Bench, samples: int = 10) -> None:
    bench.start(SAMPLE_TIME)
    for _ in range(samples):
        bench.read()
        bench.write(3.0)


def test_a_run_that_just_ends_leaves_0_V():
    board = FaultyBoard()
    with bench_of(board) as bench:
        run(bench)
        assert board.voltage == 3.0
    assert_left_alone(board)


def test_whatever_is_raised_in_the_block_leaves_0_V_and_passes_on():
    for trouble in (ZeroDivisionError, KeyboardInterrupt, SystemExit, BenchError):
        board = FaultyBoard()
        with pytest.raises(trouble), bench_of(board) as bench:
            run(bench)
            raise trouble
        assert_left_alone(board)


@pytest.mark.parametrize("verb", ["task_read_encoder", "watchdog_reload", "write_analog"])
def test_a_board_that_fails_once_in_a_run_is_at_0_V(verb):
    board = FaultyBoard()
    with pytest.raises(HILError, match=f"{verb} failed"), bench_of(board) as bench:
        run(bench, 5)
        board.faults[verb] = 0
        try:
            run_on(bench)
        finally:
            board.faults.clear()
    assert_left_alone(board)


def run_on(bench: Bench) -> None:
    bench.read()
    bench.write(2.0)


@pytest.mark.parametrize(
    "verb", ["set_encoder_counts", "task_create_encoder_reader", "task_set_buffer_overflow_mode", "task_start"]
)
def test_a_board_that_fails_at_the_start_of_a_run_is_at_0_V(verb):
    board = FaultyBoard({verb: 0})
    with pytest.raises(HILError, match=f"{verb} failed"), bench_of(board) as bench:
        run(bench)
    assert_left_alone(board)


@pytest.mark.parametrize("verb", ["watchdog_set_analog_expiration_state", "watchdog_clear", "write_analog"])
def test_a_board_that_fails_on_opening_is_closed_again(verb):
    board = FaultyBoard({verb: 0})
    bench = bench_of(board)
    with pytest.raises(HILError, match="failed"), bench:
        pytest.fail("the block must not be entered")
    assert board.transcript[-1] == "close"
    assert not board.inner.is_valid()
    with pytest.raises(BenchError, match="not open"):
        bench.read()


def test_a_failing_watchdog_does_not_keep_the_motor_running():
    board = FaultyBoard()
    with pytest.raises(HILError, match="watchdog_clear failed"), bench_of(board) as bench:
        run(bench)
        board.faults["watchdog_clear"] = 0
    assert board.voltage == 0.0
    assert board.transcript[-5:] == ["write_analog", "watchdog_stop", "task_stop", "task_delete", "close"]


def test_a_board_that_does_not_take_0_V_is_left_to_its_watchdog():
    board = FaultyBoard()
    with pytest.raises(HILError, match="write_analog failed"), bench_of(board) as bench:
        run(bench)
        board.faults["write_analog"] = 0
    assert board.transcript[-4:] == ["watchdog_start", "task_stop", "task_delete", "close"]
    watchdog = board.inner._watchdog
    assert watchdog.deadline <= board.inner.clock.now() + WATCHDOG_TIMEOUT
    assert watchdog.states == {0: 0.0}


def test_a_board_that_is_gone_already_is_let_go():
    board = FaultyBoard()
    with pytest.raises(HILError, match="closed"), bench_of(board) as bench:
        run(bench)
        board.inner.close()
        bench.read()
    assert board.transcript[-1] == "is_valid"


def test_a_bench_whose_board_broke_down_can_be_opened_anew():
    boards = [FaultyBoard(), FaultyBoard()]
    waiting = iter(boards)
    bench = Bench(lambda: next(waiting), srv02(), joint(1), {"clock": "simulated"})
    with pytest.raises(HILError), bench:
        run(bench)
        boards[0].faults.update(task_read_encoder=0, write_analog=0)
        bench.read()
    with bench:
        run(bench)
    assert_left_alone(boards[1])


def test_a_program_that_stops_without_a_word_is_stopped_by_the_watchdog():
    board = FaultyBoard()
    with pytest.raises(HILError, match="watchdog"), bench_of(board) as bench:
        run(bench)
        board.inner.clock.wait_until(10.0)
        assert board.inner.watchdog_is_expired()
        assert board.voltage == 0.0
        bench.write(1.0)
    assert_left_alone(board)


# --- limits ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("limits", "voltage", "named"),
    [
        (Limits(theta=20 * DEG), 6.0, r"servo.* 20\.\d deg at t = 0\.\d{3} s"),
        (Limits(theta=20 * DEG), -6.0, r"servo.* -20\.\d deg"),
        (Limits(alpha=8 * DEG), 8.0, r"deflection.* -8\.\d deg at t = 0\.\d{3} s"),
    ],
)
def test_a_limit_that_is_passed_stops_the_motor_and_says_which(limits, voltage, named):
    board = FaultyBoard()
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


@pytest.mark.parametrize("voltage", [3.0, -3.0])
@pytest.mark.parametrize("limits", [Limits(theta=5 * DEG), Limits(alpha=2 * DEG), Limits(rate=1.0)], ids=repr)
def test_every_limit_holds_in_both_directions(limits, voltage):
    board = FaultyBoard()
    with bench_of(board, limits=limits) as bench:
        bench.start(SAMPLE_TIME)
        with pytest.raises(LimitExceeded):
            for _ in range(100):
                bench.read()
                bench.write(voltage)
    assert abs(bench.latest.theta) < 20 * DEG
    assert_left_alone(board)


def test_a_motor_that_cannot_be_stopped_is_not_said_to_be():
    board = FaultyBoard()
    with pytest.raises(HILError, match="write_analog failed"), bench_of(board, limits=Limits(theta=5 * DEG)) as bench:
        bench.start(SAMPLE_TIME)
        bench.write(6.0)
        board.faults["write_analog"] = 0
        for _ in range(1000):
            bench.read()


@pytest.mark.parametrize("voltage", [math.nan, math.inf, -math.inf, np.float64("nan")])
def test_a_voltage_that_is_no_number_stops_the_motor(voltage):
    board = FaultyBoard()
    with bench_of(board) as bench:
        run(bench)
        with pytest.raises(BenchError, match=f"asked for {voltage} V.*0 V"):
            bench.write(voltage)
        assert board.voltage == 0.0
    assert_left_alone(board)


@pytest.mark.parametrize("before", [lambda b: None, lambda b: b.stop(), lambda b: (b.start(SAMPLE_TIME), b.stop())])
def test_no_voltage_is_set_while_no_watchdog_runs(before):
    """It would stay when the program is killed, and for as long as nobody reads."""
    board = FaultyBoard()
    with bench_of(board) as bench:
        before(bench)
        with pytest.raises(BenchError, match=r"start\(\)"):
            bench.write(1.0)
        assert board.voltage == 0.0
        assert bench.write(0.0) == 0.0


def interrupted(line: int, by_an_exception: bool) -> tuple[bool, FaultyBoard, Bench]:
    """Ctrl-C at one of the lines that are passed as a bench is let go: whether there was one, the board, the bench."""
    files = {sys.modules[one.__module__].__file__ for one in (Bench, halt.halt)}
    board, passed = FaultyBoard(), itertools.count(1)
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
            assert bench._board is board and board.transcript[-1] == "write_analog"
            bench._close()
        assert_left_alone(board)
    assert line > 20


# --- misuse ----------------------------------------------------------------------------------------------------------


def test_a_bench_must_be_open_and_sampling():
    for verb in (lambda b: b.start(0.002), lambda b: b.read(), lambda b: b.write(1.0), lambda b: b.stop()):
        with pytest.raises(BenchError, match="not open"):
            verb(hil.open("virtual"))
    with hil.open("virtual") as bench, pytest.raises(BenchError, match=r"start\(\)"):
        bench.read()


def test_a_bench_is_opened_once_at_a_time():
    bench = hil.open("virtual")
    with bench:
        with pytest.raises(BenchError, match="open already"):
            bench.__enter__()
        bench.start(SAMPLE_TIME)
        bench.read()
    with bench:
        bench.start(SAMPLE_TIME)


@pytest.mark.parametrize("sample_time", [0.0, -0.002, math.nan, 0.2, 5.0])
def test_the_sample_time_is_positive_and_shorter_than_the_watchdogs(sample_time):
    with hil.open("virtual") as bench, pytest.raises(BenchError, match="sample time"):
        bench.start(sample_time)


def test_a_servo_that_cannot_carry_the_joint_is_refused():
    with pytest.raises(ConfigurationError, match="flexible joint mounted"):
        Bench(FaultyBoard, srv02(gear="low"), joint(1), {})


# --- addresses -------------------------------------------------------------------------------------------------------


def test_identity_is_plain_data_that_says_which_bench_it_is():
    bench = hil.open("virtual:?arm_position=2&encoder=EHR", seed=7)
    expected = {
        "uri": "virtual:?arm_position=2&encoder=EHR",
        "seed": 7,
        "draw": DRAW,
        "run": 1,
        "arm_position": 2,
        "encoder": "EHR",
        "clock": "simulated",
    }
    assert json.loads(json.dumps(bench.identity)) == bench.identity == expected
    assert bench.joint == student_bench(7, 2).joint
    assert bench.servo == srv02(encoder="EHR")
    assert "seed=7" in repr(bench)
    assert "closed" in repr(bench)


def test_the_address_goes_before_the_callers_seed():
    assert hil.open("virtual:?seed=3", seed=9).identity["seed"] == 3
    assert hil.open("virtual", seed=9).identity["seed"] == 9
    assert hil.open().identity["seed"] == 0


def test_a_preset_is_that_plant():
    with hil.open("virtual:?preset=real_bench") as bench:
        assert bench.board.plant.parameters == preset("real_bench").parameters
        assert bench.identity["preset"] == "real_bench"
        assert "seed" not in bench.identity


def test_the_callers_preset_goes_before_their_seed_and_the_address_before_both():
    bench = hil.open("virtual", seed=7, preset="workbook")
    assert bench.identity == {
        "uri": "virtual",
        "preset": "workbook",
        "run": 1,
        "arm_position": 1,
        "encoder": "E",
        "clock": "simulated",
    }
    assert hil.open("virtual:?seed=3", preset="workbook").identity["seed"] == 3
    assert hil.open("virtual:?preset=real_bench", preset="workbook").identity["preset"] == "real_bench"
    with pytest.raises(BenchError, match="a preset has its own parameters"):
        hil.open("virtual:?arm_position=2", preset="workbook")


def test_time_waits_for_the_program_unless_it_is_the_computers():
    assert hil.open("virtual").is_simulated
    assert not hil.open("virtual:?clock=wall").is_simulated


def test_a_wrong_address_is_refused_and_what_is_allowed_is_named(snapshot):
    addresses = ["labjack:0", "quanser", "quanser:q2_usb", "quanser:/0", "", "virtual:seed=7"]
    queries = ["speed=7", "seed=1&seed=2", "seed=-1", "seed=one", "seed=", "arm_position=x", "preset=workbook&seed=1"]
    not_there = ["arm_position=4", "preset=moon", "encoder=X", "clock=sundial"]
    messages = {}
    for uri in [*addresses, *(f"virtual:?{query}" for query in queries + not_there)]:
        with pytest.raises((BenchError, ConfigurationError)) as error:
            hil.open(uri)
        assert (error.type is ConfigurationError) == (uri.removeprefix("virtual:?") in not_there)
        messages[uri] = str(error.value)
    with pytest.raises(ConfigurationError, match="9"):
        hil.open("virtual", seed=7, draw=9)
    assert messages == snapshot
