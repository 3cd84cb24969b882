"""The virtual board: its wiring, its sensors, its time. (What it shares with every board is in contract/.)"""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import islice

import numpy as np
import pytest
from board_contract import BOTH, FOREVER, MOTOR, counted
from fault_board import Stopwatch

import rotflex.plant
from rotflex.config import srv02
from rotflex.errors import ConfigurationError, HILError
from rotflex.hil import virtual
from rotflex.hil.board import BufferOverflowMode, Clock
from rotflex.hil.student_benches import preset, student_bench
from rotflex.hil.virtual import TICK, SimulatedClock, Terminals, Timing, VirtualBoard, WallClock
from rotflex.plant import State
from rotflex.units import DEG, RPM

WORKBOOK = preset("workbook").parameters
STILL = replace(WORKBOOK, servo_friction=(1.0, 1.0), link_friction=(1.0, 1.0))  # rusty: stays wherever it is put
FREE = replace(WORKBOOK, I_max=0.0, B_eq=0.0)


def analog(board: VirtualBoard) -> list[float]:
    buffer = np.zeros(2)
    board.read_analog(BOTH, 2, buffer)
    return buffer.tolist()


def write(board: VirtualBoard, voltage: float) -> None:
    board.write_analog(MOTOR, 1, np.array([voltage]))


def started(board: VirtualBoard, buffer: int, mode: BufferOverflowMode, samples: int = FOREVER) -> int:
    """A task at 100 Hz."""
    task = board.task_create_encoder_reader(buffer, BOTH, 2)
    board.task_set_buffer_overflow_mode(task, mode)
    board.task_start(task, Clock.HARDWARE_CLOCK_0, 100.0, samples)
    return task


def fetch(board: VirtualBoard, task: int) -> int:
    """Servo counts of the next sample of a task."""
    buffer = np.zeros(2, dtype=np.int32)
    assert board.task_read_encoder(task, 1, buffer) == 1
    return int(buffer[0])


def test_driven_by_its_verbs_it_moves_as_the_plant_does():
    """Ten seconds of a chirp and steps, held for 20 ms each, sampled every 2 ms."""
    rate, per_hold = 500.0, 10
    t = np.arange(500) * per_hold / rate
    voltages = np.sin(2 * np.pi * (0.5 * t + 0.225 * t**2)) + 2.0 * np.sign(np.sin(2 * np.pi * 0.3 * t + 0.1))
    board, by_hand = VirtualBoard(WORKBOOK), rotflex.plant.Plant(WORKBOOK)
    task = board.task_create_encoder_reader(500, BOTH, 2)
    board.task_start(task, Clock.HARDWARE_CLOCK_0, rate, FOREVER)
    for voltage in voltages:
        fetch(board, task)
        np.testing.assert_allclose(board.plant.state, by_hand.state, atol=1e-9)
        write(board, voltage)
        for _sample in range(per_hold - 1):
            fetch(board, task)
        by_hand.advance(voltage, per_hold / rate)


@pytest.mark.parametrize(("encoder", "per_revolution"), [("E", 4096), ("EHR", 8192)])
def test_encoders_count_quarters_of_lines_and_the_link_the_other_way(encoder, per_revolution):
    board = VirtualBoard(STILL, srv02(encoder=encoder), State(90 * DEG, 10 * DEG, 0.0, 0.0))
    assert counted(board).tolist() == [per_revolution // 4, -round(per_revolution / 36)]


def test_potentiometer_has_its_gain_wraps_and_has_a_gap():
    def volts(degrees: float) -> float:
        return analog(VirtualBoard(STILL, state=State(degrees * DEG, 0.0, 0.0, 0.0)))[0]

    for degrees in (0.0, 100.0, -175.0, 175.0):
        assert volts(degrees) == pytest.approx(degrees / -35.2)
    assert volts(175.9) == pytest.approx(-5.0, abs=0.01)
    assert volts(184.1) == pytest.approx(5.0, abs=0.01)
    assert volts(360.0 + 35.2) == pytest.approx(-1.0)
    for degrees in (177.0, 180.0, 183.0, -180.0, 540.0):
        assert volts(degrees) == 0.0


def test_tachometer_has_its_gain_at_the_load_and_gives_nothing_where_there_is_none():
    state = State(0.0, 0.0, 10.0, 0.0)
    # 1.5 mV per rpm of the motor, which turns 70 times as quickly; the sign is the potentiometer's
    assert analog(VirtualBoard(STILL, state=state))[1] == pytest.approx(-1.5e-3 * 70 * 10 / RPM)
    assert analog(VirtualBoard(STILL, state=state))[1] == pytest.approx(10 / -0.99733, rel=1e-4)
    assert analog(VirtualBoard(STILL, srv02(tachometer=False), state))[1] == 0.0


def speed(voltage: float, **choices: object) -> float:
    """Servo speed (rad/s) two seconds after a voltage on the output."""
    servo, time = srv02(**choices), Stopwatch()
    board = VirtualBoard(replace(WORKBOOK, V_max=servo.amplifier.V_max, I_max=math.inf), servo, clock=time)
    write(board, voltage)
    time.time = 2.0
    counted(board)
    return board.plant.state.theta_dot


def final_speed(motor_voltage: float) -> float:
    damping = WORKBOOK.B_eq + WORKBOOK.torque_per_volt * WORKBOOK.back_emf
    return WORKBOOK.torque_per_volt * motor_voltage / damping


def test_the_converter_gives_ten_volts_at_most_the_cable_multiplies_and_the_amplifier_limits():
    assert speed(10.0) == pytest.approx(final_speed(10.0), rel=1e-5)
    assert speed(25.0) == speed(10.0)
    assert speed(-25.0) == pytest.approx(-speed(10.0))
    assert speed(2.0, cable_gain=3) == pytest.approx(final_speed(6.0), rel=1e-5)
    assert speed(10.0, cable_gain=5) == pytest.approx(final_speed(24.0), rel=1e-5)
    assert speed(10.0, cable_gain=3, amplifier="UPM_1503") == pytest.approx(final_speed(15.0), rel=1e-5)


def watched(timeout: float, expires_to: float = 0.0) -> tuple[VirtualBoard, Stopwatch]:
    """Return a board with a running watchdog, and its clock."""
    time = Stopwatch()
    board = VirtualBoard(WORKBOOK, clock=time)
    board.watchdog_set_analog_expiration_state(MOTOR, 1, np.array([expires_to]))
    board.watchdog_start(timeout)
    return board, time


@pytest.mark.parametrize(
    ("call", "chosen", "set_"),
    [
        ("watchdog_is_expired", -1.0, -1.0),
        ("watchdog_is_expired", 50.0, 10.0),  # the converter's limit is the watchdog's
        *((f"watchdog_{verb}", 0.0, 0.0) for verb in ("stop", "reload", "clear", "is_expired")),
    ],
)
def test_an_expired_watchdog_sets_its_voltage_at_its_instant_whoever_notices(call, chosen, set_):
    """From then on the motor, free of friction, is as if the voltage had been set by hand."""
    board, time = watched(0.2, chosen)
    write(board, 3.0)
    time.time = 1.0
    assert getattr(board, call)() in (None, call == "watchdog_is_expired")
    by_hand = rotflex.plant.Plant(WORKBOOK)
    by_hand.advance(3.0, 0.2)
    by_hand.advance(set_, 0.8)
    np.testing.assert_allclose(board.plant.state, by_hand.state, rtol=1e-9)


def test_starting_the_watchdog_again_does_not_forget_that_it_expired():
    board, time = watched(0.2)
    time.time = 1.0
    board.watchdog_start(0.2)
    with pytest.raises(HILError, match="clear"):
        write(board, 1.0)


# The arm turns steadily, 1 rad/s and no forces, so that counts tell when a sample was taken: 6.52 counts every 10 ms.
TURNING = State(0.0, 0.0, 1.0, 0.0)


def turning() -> tuple[VirtualBoard, Stopwatch]:
    time = Stopwatch()
    return VirtualBoard(FREE, state=TURNING, clock=time), time


def test_simulated_time_passes_only_while_a_task_waits():
    clock_ = SimulatedClock()
    board = VirtualBoard(FREE, state=TURNING, clock=clock_)
    task = started(board, 10, BufferOverflowMode.SYNCHRONIZED)
    for _ in range(50):
        write(board, 0.0)
        counted(board)
    assert clock_.now() == 0.0
    assert [fetch(board, task) for _ in range(4)] == [0, 7, 13, 20]
    assert clock_.now() == pytest.approx(0.03)


@pytest.mark.parametrize(
    ("room", "mode", "expected"),
    [
        (10, BufferOverflowMode.ERROR_ON_OVERFLOW, [0, 7, 13, 20, 26, 33, 39]),
        (3, BufferOverflowMode.OVERWRITE_ON_OVERFLOW, [20, 26, 33, 39]),
        (1, BufferOverflowMode.SYNCHRONIZED, [0, 7, 13, 20]),  # time waits for the program
        (3, BufferOverflowMode.ERROR_ON_OVERFLOW, None),
    ],
)
def test_samples_wait_in_the_buffer_until_they_are_fetched(room, mode, expected):
    """They are those of their time: a write after a pause moves the plant on."""
    board, time = turning()
    task = started(board, room, mode)
    time.time = 0.055  # six samples were taken: 0 to 50 ms
    if mode != BufferOverflowMode.SYNCHRONIZED:
        write(board, 0.0)
        assert counted(board)[0] == 36
    board.task_flush(task)  # throws no sample away
    if expected is None:
        with pytest.raises(HILError, match="lost 3 samples"):
            fetch(board, task)
    else:
        assert [fetch(board, task) for _ in expected] == expected


def test_lost_samples_count_towards_the_end_of_the_task():
    board, time = turning()
    task = started(board, 2, BufferOverflowMode.OVERWRITE_ON_OVERFLOW, samples=6)
    time.time = 1.0  # the task ended long ago; its last two samples are in the buffer
    buffer = np.zeros(12, dtype=np.int32)
    assert board.task_read_encoder(task, 6, buffer) == 2
    assert buffer[:4:2].tolist() == [26, 33]


def test_the_newest_samples_are_thrown_away_if_so_chosen():
    board, time = turning()
    task = started(board, 3, BufferOverflowMode.DISCARD_ON_OVERFLOW)
    time.time = 0.055  # three are in the buffer, and three found no room
    assert [fetch(board, task) for _ in range(2)] == [0, 7]
    time.time = 0.085  # two more found room, and one did not
    assert [fetch(board, task) for _ in range(5)] == [13, 39, 46, 59, 65]
    assert board.task_get_buffer_overflows(task) == 4


def test_however_irregular_the_calls_few_transition_matrices_are_needed(monkeypatch):
    """In real time every call comes at its own instant; a matrix exponential for each would be too slow."""
    made, exponential = [], rotflex.plant.expm
    monkeypatch.setattr(rotflex.plant, "expm", lambda matrix: made.append(matrix) or exponential(matrix))
    instants = np.cumsum(np.random.default_rng(3).uniform(1e-5, 3e-3, 1000))
    time, parameters = Stopwatch(), student_bench(1).parameters
    board = VirtualBoard(parameters, clock=time)
    write(board, 2.0)
    for time.time in instants.tolist():
        counted(board)
    assert len(made) <= 100  # a tenth of the calls: spans, and halves of those in which a motion turned round
    state = rotflex.plant.Plant(parameters).advance(2.0, instants[-1])
    assert board.plant.state.theta == pytest.approx(state.theta, abs=state.theta_dot * TICK)


def test_the_wall_clock_sleeps_until_the_instant(monkeypatch):
    slept = []
    monkeypatch.setattr(virtual.time, "perf_counter", lambda: 100.0 + sum(slept))
    monkeypatch.setattr(virtual.time, "sleep", slept.append)
    wall = WallClock()
    assert wall.now() == 0.0
    for instant in (0.25, 0.1):  # the second one is over
        wall.wait_until(instant)
        assert (slept, wall.now()) == ([0.25], 0.25)


# --- when a voltage arrives at the plant ---

LATE = Timing(delay=1e-3, jitter=0.25e-3, late=0.01, late_by=2e-3, seed=5)


class Held:
    """Moves nowhere, and remembers which voltages it was held at, and for how long."""

    state = State(0.0, 0.0, 0.0, 0.0)

    def __init__(self) -> None:
        self.held: list[tuple[float, float]] = []

    def advance(self, voltage: float, duration: float) -> State:
        if self.held and self.held[-1][0] == voltage:
            voltage, before = self.held.pop()
            duration += before
        self.held.append((voltage, duration))
        return self.state


def terminals(timing=LATE, gain=1.0, now=0.0):
    return Terminals(Held(), gain, timing, now)


@pytest.mark.parametrize(
    ("delay", "held"), [(0.0, [(3.0, 2e-3), (-3.0, 2e-3)]), (0.75e-3, [(0.0, 0.75e-3), (3.0, 2e-3), (-3.0, 1.25e-3)])]
)
def test_a_voltage_takes_effect_after_the_delay_and_the_one_before_holds_until_then(delay, held):
    ours = terminals(Timing(delay=delay), gain=3.0, now=1.0)
    ours.send({0: 1.0, 1: 5.0})
    ours.move(1.002)
    ours.send({0: -1.0})
    ours.move(1.004)
    assert np.ravel(ours.plant.held) == pytest.approx(np.ravel(held))


def test_none_overtakes_the_one_before():
    timing = Timing(delay=1e-3, late=0.5, late_by=4e-3, seed=1)
    ours, time = terminals(timing), 0.0
    for n in range(200):
        ours.send({0: float(n)})
        time += 0.002
        ours.move(time)
    voltages = [voltage for voltage, _ in ours.plant.held]
    assert voltages == sorted(voltages) and len(set(voltages)) == len(voltages)
    assert sum(duration for _, duration in ours.plant.held) == pytest.approx(0.4)


def test_what_is_set_at_once_puts_aside_what_was_on_its_way():
    """A watchdog that expires sets 0 V, and no voltage from before arrives after it."""
    ours = terminals(Timing(delay=2e-3))
    ours.send({0: 5.0})
    ours.set({0: 0.0})
    ours.move(0.01)
    assert ours.plant.held == [(0.0, 0.01)] and ours.commanded == [0.0, 0.0]


def test_delays_are_drawn_around_the_mean_and_some_come_late():
    delays = np.array(list(islice(LATE.ticks(), 20_000))) * TICK
    in_time = delays[delays < 2e-3]
    assert 0.75e-3 <= in_time.min() < 0.8e-3 and 1.2e-3 < in_time.max() <= 1.25e-3
    assert in_time.mean() == pytest.approx(1e-3, rel=0.01)
    assert np.mean(delays >= 2e-3) == pytest.approx(0.01, abs=0.002)
    assert delays.max() <= 3.25e-3 + 1e-9


def test_delays_are_the_same_for_the_same_seed_and_begin_anew_with_every_task():
    ours = terminals()
    first = list(islice(LATE.ticks(), 3000))
    assert first == list(islice(LATE.ticks(), 3000))
    assert first != list(islice(Timing(1e-3, 0.25e-3, 0.01, 2e-3, seed=6).ticks(), 3000))

    def sent(time: float) -> list[float]:
        ours.move(time)
        ours.set({0: 0.0})
        ours.begin()
        ours.plant.held.clear()
        for n in range(20):
            ours.send({0: float(n % 2)})
            ours.move(time + 0.002 * (n + 1))
        return [duration for _, duration in ours.plant.held]

    np.testing.assert_allclose(sent(0.0), sent(1.0), atol=1e-9)


def test_a_timing_that_cannot_be_is_refused():
    wrong = [{"delay": value} for value in (-1e-3, math.inf, math.nan)] + [{"jitter": 1e-3}]
    wrong += [{"delay": 1e-3, "jitter": jitter} for jitter in (2e-3, -1e-4)]
    wrong += [{"late": 1.5}, {"late": -0.1}, {"late_by": -1e-3}, {"late_by": math.inf}]
    for values in wrong:
        with pytest.raises(ConfigurationError):
            Timing(**values)
