"""The contract that every board keeps. It is written in the board's own verbs.

A test module holds boards to it by two lines: ``from board_contract import *``, and ``BOARDS``, name → :class:`Entry`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest

from rotflex.errors import HILError
from rotflex.hil.board import Board, BufferOverflowMode, Clock, EncoderQuadratureMode

CLOCK = Clock.HARDWARE_CLOCK_0
RATE = 500.0  # Hz
FOREVER = 2**32 - 1
MOTOR = np.array([0], dtype=np.uint32)
BOTH = np.array([0, 1], dtype=np.uint32)


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


def pytest_generate_tests(metafunc):
    """Try each board of the module, but for those that lack what a test needs."""
    if "entry" in metafunc.fixturenames:
        needed = getattr(metafunc.function, "needed", ())
        boards = {
            name: entry for name, entry in metafunc.module.BOARDS.items() if all(getattr(entry, one) for one in needed)
        }
        metafunc.parametrize("entry", boards.values(), ids=boards.keys())


@pytest.fixture
def board(entry):
    made = entry.make()
    yield made
    made.close()


def needs(*what: str) -> Callable:
    """Try only boards that have these attributes of :class:`Entry`."""

    def marked(test: Callable) -> Callable:
        test.needed = what
        return test

    return marked


moving = needs("moves")
adjustable = needs("moves", "adjustable")
lenient = needs("lenient")  # what no documentation says is another board's own


def vector(kind: type) -> Callable[..., np.ndarray]:
    return lambda *values: np.array(values, dtype=kind)


volts, counts, modes, levels = map(vector, (np.float64, np.int32, np.uint32, np.int8))


def counted(board: Board) -> np.ndarray:
    buffer = counts(0, 0)
    board.read_encoder(BOTH, 2, buffer)
    return buffer


def encoder_task(board: Board, samples: int = FOREVER, rate: float = RATE, buffer: int = 1000) -> int:
    """A task that is sampling both encoders."""
    task = board.task_create_encoder_reader(buffer, BOTH, 2)
    board.task_start(task, CLOCK, rate, samples)
    return task


def wait(board: Board, duration: float) -> None:
    """Let time pass on the board's own clock."""
    samples = round(duration * RATE) + 1
    task = encoder_task(board, samples, buffer=samples)
    assert board.task_read_encoder(task, samples, np.zeros(2 * samples, dtype=np.int32)) == samples
    board.task_stop(task)
    board.task_delete(task)


#: Every verb but close and is_valid, in a call that an open board would take (tasks aside).
CALLS: dict[str, Callable[[Board], object]] = {
    "set_encoder_counts": lambda b: b.set_encoder_counts(BOTH, 2, counts(0, 0)),
    "set_encoder_quadrature_mode": lambda b: b.set_encoder_quadrature_mode(BOTH, 2, modes(4, 4)),
    "set_encoder_filter_frequency": lambda b: b.set_encoder_filter_frequency(BOTH, 2, volts(1e6, 1e6)),
    "set_analog_input_ranges": lambda b: b.set_analog_input_ranges(BOTH, 2, volts(-10, -10), volts(10, 10)),
    "set_analog_output_ranges": lambda b: b.set_analog_output_ranges(BOTH, 2, volts(-10, -10), volts(10, 10)),
    "read_encoder": lambda b: b.read_encoder(BOTH, 2, counts(0, 0)),
    "read_analog": lambda b: b.read_analog(BOTH, 2, volts(0, 0)),
    "write_analog": lambda b: b.write_analog(MOTOR, 1, volts(0)),
    "write_digital": lambda b: b.write_digital(MOTOR, 1, levels(0)),
    "read": lambda b: b.read(None, 0, BOTH, 2, None, 0, None, 0, None, counts(0, 0), None, None),
    "set_card_specific_options": lambda b: b.set_card_specific_options("", 0),
    "task_create_encoder_reader": lambda b: b.task_create_encoder_reader(10, BOTH, 2),
    "task_create_reader": lambda b: b.task_create_reader(10, BOTH, 2, BOTH, 2, None, 0, None, 0),
    "task_set_buffer_overflow_mode": lambda b: b.task_set_buffer_overflow_mode(1, 0),
    "task_start": lambda b: b.task_start(1, CLOCK, RATE, 10),
    "task_read_encoder": lambda b: b.task_read_encoder(1, 1, counts(0, 0)),
    "task_read": lambda b: b.task_read(1, 1, None, counts(0, 0), None, None),
    "task_get_buffer_overflows": lambda b: b.task_get_buffer_overflows(1),
    "task_flush": lambda b: b.task_flush(1),
    "task_stop": lambda b: b.task_stop(1),
    "task_delete": lambda b: b.task_delete(1),
    "watchdog_set_analog_expiration_state": lambda b: b.watchdog_set_analog_expiration_state(MOTOR, 1, volts(0)),
    "watchdog_set_digital_expiration_state": lambda b: b.watchdog_set_digital_expiration_state(MOTOR, 1, counts(3)),
    "watchdog_start": lambda b: b.watchdog_start(1.0),
    "watchdog_reload": lambda b: b.watchdog_reload(),
    "watchdog_is_expired": lambda b: b.watchdog_is_expired(),
    "watchdog_clear": lambda b: b.watchdog_clear(),
    "watchdog_stop": lambda b: b.watchdog_stop(),
}
TASK_CALLS = [verb for verb in CALLS if verb.startswith("task_") and "create" not in verb]


def test_every_verb_of_the_protocol_is_tried_here():
    verbs = {name for name in vars(Board) if not name.startswith("_")}
    assert verbs == set(CALLS) | {"close", "is_valid"}


def test_it_is_a_board_that_can_be_closed_twice_and_refuses_afterwards(board):
    assert isinstance(board, Board)
    assert board.is_valid()
    board.close()
    board.close()
    assert not board.is_valid()
    for call in CALLS.values():
        with pytest.raises(HILError) as caught:
            call(board)
        assert caught.value.get_error_message()


NO_COUNTS = [[0, 0], np.zeros(2, dtype=np.int64), np.zeros(2), counts(0), np.zeros((1, 2), dtype=np.int32), None]
NO_VOLTS = [[0.0], 0.0, np.zeros(1, dtype=np.float32), np.zeros(1, dtype=int), np.zeros(0)]
NO_CHANNELS = [[0], 0, np.array([0]), np.array([0], dtype=np.int32), np.array([[0]], dtype=np.uint32)]


def test_buffers_and_channels_are_vectors_of_their_type(board):
    task = encoder_task(board)
    calls = [(lambda b: board.read_encoder(BOTH, 2, b), NO_COUNTS, "int32")]
    calls += [(lambda b: board.set_encoder_counts(BOTH, 2, b), NO_COUNTS, "int32")]
    calls += [(lambda b: board.task_read_encoder(task, 1, b), NO_COUNTS, "int32")]
    calls += [(lambda b: board.read_analog(MOTOR, 1, b), NO_VOLTS, "float64")]
    calls += [(lambda b: board.write_analog(MOTOR, 1, b), NO_VOLTS, "float64")]
    calls += [(lambda b: board.watchdog_set_analog_expiration_state(MOTOR, 1, b), NO_VOLTS, "float64")]
    calls += [(lambda b: board.write_digital(MOTOR, 1, b), [counts(0)], "int8")]
    calls += [(lambda c: board.read_encoder(c, 1, counts(0)), NO_CHANNELS, "uint32")]
    calls += [(lambda c: board.read_analog(c, 1, volts(0)), NO_CHANNELS, "uint32")]
    calls += [(lambda c: board.write_analog(c, 1, volts(0)), NO_CHANNELS, "uint32")]
    calls += [(lambda c: board.task_create_encoder_reader(10, c, 1), NO_CHANNELS, "uint32")]
    for call, unfit, named in calls:
        for one in unfit:
            with pytest.raises(HILError, match=named):
                call(one)


@pytest.mark.parametrize(("channels", "number"), [([99], 1), ([0, 99], 2), ([0], 2)])
def test_channels_that_do_not_exist_are_refused(board, channels, number):
    chosen = np.array(channels, dtype=np.uint32)
    for call in (
        lambda: board.read_encoder(chosen, number, counts(0, 0)),
        lambda: board.read_analog(chosen, number, volts(0, 0)),
        lambda: board.write_analog(chosen, number, volts(0, 0)),
        lambda: board.write_digital(chosen, number, levels(0, 0)),
        lambda: board.set_encoder_counts(chosen, number, counts(0, 0)),
        lambda: board.task_create_encoder_reader(10, chosen, number),
    ):
        with pytest.raises(HILError, match="channels"):
            call()


@lenient
@pytest.mark.parametrize("voltage", [math.nan, math.inf])
def test_an_output_takes_numbers_only(board, voltage):
    with pytest.raises(HILError, match="finite"):
        board.write_analog(MOTOR, 1, volts(voltage))
    with pytest.raises(HILError, match="finite"):
        board.watchdog_set_analog_expiration_state(MOTOR, 1, volts(voltage))


def test_unknown_options_are_refused(board):
    board.set_card_specific_options("", 0)
    with pytest.raises(HILError, match="turbo"):
        board.set_card_specific_options("turbo=1", 7)


def test_counters_read_what_they_were_set_to_in_the_order_and_number_asked_for(board):
    board.set_encoder_counts(BOTH, 2, counts(-1000, 250))
    asked = (BOTH, 2, [-1000, 250]), (BOTH[::-1].copy(), 2, [250, -1000]), (BOTH, 1, [-1000, 7])
    for channels, number, expected in asked:
        buffer = counts(7, 7)
        board.read_encoder(channels, number, buffer)
        assert buffer.tolist() == expected


@moving
def test_a_positive_voltage_turns_the_servo_the_positive_way(board):
    board.set_encoder_counts(BOTH, 2, counts(0, 0))
    board.write_analog(MOTOR, 1, volts(2.0))
    wait(board, 0.2)
    board.write_analog(MOTOR, 1, volts(0.0))
    assert counted(board)[0] > 50


def test_all_kinds_of_inputs_are_read_at_one_instant(board):
    board.set_encoder_counts(BOTH, 2, counts(5, 6))
    board.write_digital(BOTH, 2, levels(1, 0))
    together = volts(0, 0), counts(0, 0), levels(7, 7)
    board.read(BOTH, 2, BOTH, 2, BOTH, 2, None, 0, *together, None)
    analog = volts(0, 0)
    board.read_analog(BOTH, 2, analog)
    assert together[0].tolist() == analog.tolist()
    assert together[1].tolist() == counted(board).tolist() == [5, 6]
    assert together[2].tolist() == [1, 0]


def test_a_task_gives_as_many_samples_as_asked_for_and_ends(board):
    board.set_encoder_counts(BOTH, 2, counts(1, 2))
    task = encoder_task(board, samples=5)
    buffer = np.zeros(6, dtype=np.int32)
    assert board.task_read_encoder(task, 3, buffer) == 3
    assert buffer.tolist() == [1, 2, 1, 2, 1, 2]
    assert board.task_read_encoder(task, 3, buffer) == 2
    assert board.task_read_encoder(task, 3, buffer) == 0


@moving
def test_samples_come_at_the_tasks_rate(board):
    """The servo runs freely, so that counts tell the time."""

    def run(rate: float, samples: int) -> np.ndarray:
        task = encoder_task(board, samples, rate)
        buffer = np.zeros(2 * samples, dtype=np.int32)
        assert board.task_read_encoder(task, samples, buffer) == samples
        board.task_delete(task)
        return buffer[::2]

    board.write_analog(MOTOR, 1, volts(3.0))
    wait(board, 1.0)
    slow, quick = np.diff(run(100.0, 21)), np.diff(run(1000.0, 201))
    board.write_analog(MOTOR, 1, volts(0.0))
    assert slow.mean() == pytest.approx(10 * quick.mean(), rel=0.1)


def test_a_task_samples_inputs_of_all_kinds(board):
    board.set_encoder_counts(BOTH, 2, counts(8, 9))
    board.write_digital(MOTOR, 1, levels(1))
    task = board.task_create_reader(100, BOTH, 2, BOTH, 2, MOTOR, 1, None, 0)
    board.task_start(task, CLOCK, RATE, 100)
    analog, encoders, digital = volts(9, 9, 9, 9), counts(0, 0, 0, 0), levels(0, 0)
    assert board.task_read(task, 2, analog, encoders, digital, None) == 2
    assert encoders.tolist() == [8, 9, 8, 9]
    assert digital.tolist() == [1, 1]
    assert 9.0 not in analog


def test_two_tasks_live_side_by_side(board):
    first, second = encoder_task(board), encoder_task(board)
    assert first != second
    board.task_delete(first)
    assert board.task_read_encoder(second, 1, counts(0, 0)) == 1
    with pytest.raises(HILError, match=f"task {first}"):
        board.task_read_encoder(first, 1, counts(0, 0))


def test_a_task_must_be_started_to_be_read_and_can_be_started_again(board):
    task = board.task_create_encoder_reader(10, BOTH, 2)
    with pytest.raises(HILError, match="started"):
        board.task_read_encoder(task, 1, counts(0, 0))
    board.task_start(task, CLOCK, RATE, FOREVER)
    board.task_read_encoder(task, 1, counts(0, 0))
    board.task_stop(task)
    with pytest.raises(HILError, match="started"):
        board.task_read_encoder(task, 1, counts(0, 0))
    board.task_start(task, CLOCK, RATE, 1)
    assert board.task_read_encoder(task, 2, counts(0, 0, 0, 0)) == 1


def test_there_must_be_such_a_task(board):
    for verb in TASK_CALLS:
        with pytest.raises(HILError, match="no task 1"):
            CALLS[verb](board)


def test_impossible_tasks_are_refused(board):
    task = board.task_create_encoder_reader(10, BOTH, 2)
    for frequency, samples in ((0.0, 10), (-1.0, 10), (math.nan, 10), (math.inf, 10), (RATE, 0)):
        with pytest.raises(HILError, match="cannot take"):
            board.task_start(task, CLOCK, frequency, samples)
    with pytest.raises(HILError, match="clock"):
        board.task_start(task, 7, RATE, 10)
    with pytest.raises(HILError, match="overflow mode"):
        board.task_set_buffer_overflow_mode(task, 99)
    with pytest.raises(HILError, match="buffer"):
        board.task_create_encoder_reader(0, BOTH, 2)
    board.task_start(task, CLOCK, RATE, 10)
    for samples, words in ((0, "asked for"), (-1, "asked for|required")):
        with pytest.raises(HILError, match=words):
            board.task_read_encoder(task, samples, counts(0, 0))
    with pytest.raises(HILError, match="buffer"):
        board.task_read_encoder(task, 2, counts(0, 0))


@pytest.mark.parametrize("mode", list(BufferOverflowMode))
def test_a_task_that_is_fetched_in_time_does_not_mind_its_overflow_mode(board, mode, entry):
    task = board.task_create_encoder_reader(1, BOTH, 2)
    if mode >= BufferOverflowMode.WAIT_ON_OVERFLOW and not entry.time_waits:
        with pytest.raises(HILError, match="simulat"):
            board.task_set_buffer_overflow_mode(task, mode)
        return
    board.task_set_buffer_overflow_mode(task, mode)
    board.task_start(task, CLOCK, RATE, 20)
    for _ in range(20):
        assert board.task_read_encoder(task, 1, counts(0, 0)) == 1
    assert board.task_get_buffer_overflows(task) == 0


def neglected(board: Board, mode: BufferOverflowMode | None, room: int) -> int:
    """A task whose 50 samples were all taken before anybody came for one."""
    task = board.task_create_encoder_reader(room, BOTH, 2)
    if mode is not None:
        board.task_set_buffer_overflow_mode(task, mode)
    board.task_start(task, CLOCK, RATE, 50)
    wait(board, 0.2)
    return task


def remaining(board: Board, task: int, room: int) -> int:
    """How many samples of a task there still are."""
    count = 0
    while came := board.task_read_encoder(task, room, np.zeros(2 * room, dtype=np.int32)):
        count += came
    return count


LOSING = (BufferOverflowMode.OVERWRITE_ON_OVERFLOW, BufferOverflowMode.DISCARD_ON_OVERFLOW, None)


@pytest.mark.parametrize("mode", LOSING)
def test_samples_that_find_no_room_are_lost_and_counted_and_an_error_unless_told_otherwise(board, mode):
    task = neglected(board, mode, room=10)
    if mode is None:
        with pytest.raises(HILError, match="lost 40 samples"):
            board.task_read_encoder(task, 1, counts(0, 0))
    else:
        assert remaining(board, task, room=10) == 10
        assert board.task_get_buffer_overflows(task) > 0


def test_flushing_a_reader_leaves_its_samples_where_they_are(board):
    task = neglected(board, BufferOverflowMode.OVERWRITE_ON_OVERFLOW, room=100)
    board.task_flush(task)
    assert remaining(board, task, room=100) == 50
    assert board.task_get_buffer_overflows(task) == 0


def test_the_numbers_of_modes_and_clocks_are_the_makers():
    names = [f"{what}_ON_OVERFLOW" for what in ("ERROR", "OVERWRITE", "DISCARD", "WAIT")]
    assert [BufferOverflowMode[name] for name in (*names, "SYNCHRONIZED")] == [0, 1, 2, 3, 4]
    assert [clock.value for clock in Clock if clock.name.startswith("SYSTEM")] == [-4, -3, -2, -1]
    assert Clock.HARDWARE_CLOCK_0 == 0
    assert [mode.value for mode in EncoderQuadratureMode] == [0, 1, 2, 4]


@adjustable
@pytest.mark.parametrize(("mode", "share"), [(1, 4), (2, 2), (4, 1)])
def test_fewer_edges_are_counted_where_so_chosen_and_what_was_counted_stays(board, mode, share):
    def turn() -> int:
        before = counted(board)
        wait(board, 0.2)
        return int(counted(board)[0] - before[0])

    board.write_analog(MOTOR, 1, volts(2.0))
    wait(board, 1.0)
    whole = turn()
    before = counted(board)
    board.set_encoder_quadrature_mode(MOTOR, 1, modes(mode))
    assert before.tolist() == counted(board).tolist()
    assert turn() == pytest.approx(whole / share, abs=0.05 * whole)


def test_settings_that_cannot_be_are_refused(board):
    for call in (
        lambda: board.set_encoder_quadrature_mode(MOTOR, 1, modes(3)),
        lambda: board.set_encoder_quadrature_mode(MOTOR, 1, counts(4)),
        lambda: board.set_encoder_filter_frequency(MOTOR, 1, volts(0.0)),
        lambda: board.set_analog_input_ranges(MOTOR, 1, volts(10.0), volts(-10.0)),
        lambda: board.set_analog_output_ranges(MOTOR, 1, volts(-100.0), volts(100.0)),
        lambda: board.set_analog_output_ranges(MOTOR, 1, [-10.0], [10.0]),
    ):
        with pytest.raises(HILError) as caught:
            call()
        assert caught.value.get_error_message()


@adjustable
def test_an_output_is_cut_to_its_range(board):
    def turned(voltage: float, highest: float) -> int:
        board.set_analog_output_ranges(MOTOR, 1, volts(-10.0), volts(highest))
        board.set_encoder_counts(BOTH, 2, counts(0, 0))
        board.write_analog(MOTOR, 1, volts(voltage))
        wait(board, 1.0)
        angle = int(counted(board)[0])
        board.write_analog(MOTOR, 1, volts(0.0))
        wait(board, 1.0)
        return angle

    assert turned(8.0, 2.0) == pytest.approx(turned(2.0, 10.0), rel=0.02)


@adjustable
def test_an_input_is_cut_to_its_range(board):
    board.write_analog(MOTOR, 1, volts(2.0))
    wait(board, 0.5)
    board.set_analog_input_ranges(BOTH, 2, volts(-0.5, -0.5), volts(0.5, 0.5))
    buffer = volts(9, 9)
    board.read_analog(BOTH, 2, buffer)
    assert abs(buffer[1]) == 0.5  # the tachometer's


@pytest.fixture
def guarded(board):
    """A board whose watchdog sets 0 V after 50 ms without a reload, with 3 V on the motor."""
    board.watchdog_set_analog_expiration_state(MOTOR, 1, volts(0.0))
    board.watchdog_clear()
    board.watchdog_stop()
    board.watchdog_start(0.05)
    board.write_analog(MOTOR, 1, volts(3.0))
    return board


def test_a_watchdog_that_is_reloaded_does_not_expire(guarded):
    task = encoder_task(guarded)
    for _ in range(100):
        guarded.task_read_encoder(task, 1, counts(0, 0))
        assert guarded.watchdog_reload() is True
    assert not guarded.watchdog_is_expired()
    guarded.write_analog(MOTOR, 1, volts(1.0))


def test_a_watchdog_that_is_not_reloaded_expires_and_holds_the_outputs(guarded):
    wait(guarded, 0.1)
    assert guarded.watchdog_is_expired()
    assert guarded.watchdog_reload() is False
    assert guarded.watchdog_is_expired()
    with pytest.raises(HILError, match="watchdog"):
        guarded.write_analog(MOTOR, 1, volts(1.0))
    guarded.watchdog_clear()
    guarded.write_analog(MOTOR, 1, volts(0.0))
    assert not guarded.watchdog_is_expired()


@moving
def test_an_expired_watchdog_lets_the_servo_come_to_rest(guarded):
    wait(guarded, 2.0)
    before = counted(guarded)
    wait(guarded, 0.5)
    assert 20 < before[0] == counted(guarded)[0]


def test_a_watchdog_needs_time_and_a_stopped_one_does_not_expire(guarded):
    guarded.watchdog_stop()
    for timeout in (0.0, -1.0, math.nan):
        with pytest.raises(HILError, match="time-out"):
            guarded.watchdog_start(timeout)
    wait(guarded, 0.5)
    assert not guarded.watchdog_is_expired()
    guarded.write_analog(MOTOR, 1, volts(0.0))
