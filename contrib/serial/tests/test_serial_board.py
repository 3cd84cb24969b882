"""The board at the end of a serial line: the real firmware in simavr, a plant on its pins, in lockstep."""

from __future__ import annotations

import random
from collections.abc import Callable

import numpy as np
import pytest
from rotflex_serial.board import SerialBoard
from serial_benches import BOTH, FOREVER, MOTOR, Bench
from simulated_uno import MS, SUPPLY, SimulatedPort, needs_simavr

from rotflex.config import srv02
from rotflex.errors import HILError
from rotflex.hil.board import BufferOverflowMode, Clock
from rotflex.hil.student_benches import preset

pytestmark = needs_simavr

PLANT = preset("real_bench").parameters
STEP = SUPPLY / 800  # V, of the motor's output


@pytest.fixture
def bench():
    return Bench(PLANT)


@pytest.fixture
def bare():
    """With nothing on its pins."""
    return Bench()


def test_500_round_trips_none_lost_counts_exact(bench):
    """The servo runs to and fro; each sample has the plant's counts of its own instant."""
    K_enc, seen = srv02().K_enc, []
    bench.board.watchdog_start(0.2)
    bench.start()
    for number in range(500):
        counts = bench.cycle(2.0 if number // 100 % 2 else -2.0)
        seen.append(counts[0])
    assert bench.board.condition() == (0, 0, 0, 0, 0)
    assert bench.board.task_get_buffer_overflows(bench.task) == 0
    assert max(seen) - min(seen) > 200
    bench.write(0.0)
    bench.board.task_stop(bench.task)
    bench.uno.run(1.0)  # comes to rest
    bench.board.read_encoder(BOTH, 2, bench.counts)
    state = bench.uno.plant.state
    assert bench.counts.tolist() == [round(state.theta / K_enc), round(-state.alpha / K_enc)]


def test_samples_are_of_the_boards_own_clock(bare):
    """However long the program takes to answer: what turns evenly is sampled evenly."""
    bare.uno.turn(0, 100_000, 10_000 * MS)  # 20 counts a sample
    bare.start()
    draw = random.Random(1)
    first = bare.read()[0]
    for number in range(1, 300):
        assert bare.read()[0] - first == pytest.approx(20 * number, abs=1)
        bare.uno.run(draw.choice([0.0, 0.0005, 0.003, 0.008]) * (number < 200))


def test_what_is_written_is_at_the_motor(bench):
    for volts in (1.0, -3.0, 7.5, 0.0):
        bench.write(volts)
        assert bench.uno.voltage == pytest.approx(volts, abs=STEP / 2)
    bench.write(99.0)
    assert bench.uno.voltage == SUPPLY


def test_closing_leaves_0_v_and_lets_the_line_go_and_a_board_can_be_opened_again(bench):
    bench.write(5.0)
    bench.start()
    again = SerialBoard(SimulatedPort(bench.uno), SUPPLY)
    assert bench.uno.voltage == 0.0
    again.read_encoder(BOTH, 2, bench.counts)
    again.write_analog(MOTOR, 1, np.array([5.0]))
    again.close()
    assert (bench.uno.voltage, again.is_valid()) == (0.0, False)
    bench.board.close()
    assert not bench.port.open


REFUSED: dict[str, Callable[[SerialBoard], object]] = {
    "X4": lambda b: b.set_encoder_quadrature_mode(BOTH, 2, np.array([4, 1], dtype=np.uint32)),
    "no filter": lambda b: b.set_encoder_filter_frequency(BOTH, 2, np.array([1e6, 1e6])),
    "0 to 5 V": lambda b: b.set_analog_input_ranges(BOTH, 2, np.array([-10.0, -10.0]), np.array([10.0, 10.0])),
    "±12 V": lambda b: b.set_analog_output_ranges(MOTOR, 1, np.array([-10.0]), np.array([10.0])),
    "0 V": lambda b: b.watchdog_set_analog_expiration_state(MOTOR, 1, np.array([1.0])),
    "65 s": lambda b: b.watchdog_start(100.0),
    "milliseconds": lambda b: b.task_start(b.task_create_encoder_reader(5, BOTH, 2), Clock.HARDWARE_CLOCK_0, 300.0, 5),
    "10000": lambda b: b.task_start(b.task_create_encoder_reader(5, BOTH, 2), Clock.HARDWARE_CLOCK_0, 2000.0, 5),
    "nobody": lambda b: b.task_set_buffer_overflow_mode(
        b.task_create_encoder_reader(5, BOTH, 2), BufferOverflowMode.SYNCHRONIZED
    ),
    "other channels": lambda b: b.task_create_reader(5, None, 0, BOTH, 2, None, 0, BOTH, 1),
    "1 analog output": lambda b: b.write_analog(BOTH, 2, np.zeros(2)),
}


def test_what_it_cannot_do_is_refused_by_name(bare):
    for name, call in REFUSED.items():
        with pytest.raises(HILError, match=name):
            call(bare.board)


def test_what_it_has_anyway_may_be_asked_for(bare):
    bare.board.set_encoder_quadrature_mode(BOTH, 2, np.array([4, 4], dtype=np.uint32))
    bare.board.set_analog_input_ranges(BOTH, 2, np.zeros(2), np.full(2, 5.0))
    bare.board.set_analog_output_ranges(MOTOR, 1, np.array([-SUPPLY]), np.array([SUPPLY]))


def test_two_tasks_have_one_rate(bare):
    bare.start()
    second = bare.board.task_create_encoder_reader(5, BOTH, 2)
    with pytest.raises(HILError, match="500 Hz now"):
        bare.board.task_start(second, Clock.HARDWARE_CLOCK_0, 250.0, 5)
    bare.board.task_start(second, Clock.HARDWARE_CLOCK_0, 500.0, 5)
    bare.board.task_stop(bare.task)
    assert bare.board.task_read_encoder(second, 1, bare.counts) == 1


def overrun(bare: Bench, mode: BufferOverflowMode) -> list[int]:
    """What a task with room for 10 samples gives, when 25 were taken: by number."""
    bare.uno.turn(0, 100_000, 10_000 * MS)
    bare.task = bare.board.task_create_encoder_reader(10, BOTH, 2)
    bare.board.task_set_buffer_overflow_mode(bare.task, mode)
    bare.board.task_start(bare.task, Clock.HARDWARE_CLOCK_0, 500.0, FOREVER)
    first = bare.read()[0]
    bare.uno.run(0.050)
    return [round((bare.read()[0] - first) / 20) for _ in range(10)]


def test_of_more_samples_than_fit_the_old_or_the_new_ones_are_lost_or_it_is_an_error(bare):
    numbers = overrun(bare, BufferOverflowMode.OVERWRITE_ON_OVERFLOW)
    lost = bare.board.task_get_buffer_overflows(bare.task)
    assert numbers == list(range(1 + lost, 11 + lost)) and lost > 10
    assert overrun(Bench(), BufferOverflowMode.DISCARD_ON_OVERFLOW) == list(range(1, 11))
    with pytest.raises(HILError, match=r"lost \d+ samples"):
        overrun(Bench(), BufferOverflowMode.ERROR_ON_OVERFLOW)


def test_starting_leaves_no_old_sample(bare):
    bare.uno.turn(0, 100_000, 10_000 * MS)
    bare.start()
    bare.uno.run(0.2)
    bare.board.task_stop(bare.task)
    bare.board.set_encoder_counts(BOTH, 2, np.zeros(2, dtype=np.int32))
    bare.board.task_start(bare.task, Clock.HARDWARE_CLOCK_0, 500.0, FOREVER)
    assert 0 <= bare.read()[0] < 60


def test_while_the_program_waits_for_a_slow_sample_it_is_known_to_live(bare):
    """At 20 Hz a sample comes each 50 ms; a motor that is driven meanwhile is not taken for forgotten."""
    bare.start(rate=20.0)
    bare.write(3.0)
    for _ in range(10):
        bare.read()
        assert bare.uno.voltage == 3.0
