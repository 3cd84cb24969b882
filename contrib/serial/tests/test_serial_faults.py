"""Faults of the line and of the board: the motor is at 0 V, the program is told in words, and nothing is made up."""

from __future__ import annotations

import random

import numpy as np
import pytest
from rotflex_serial import line
from rotflex_serial.board import SerialBoard
from rotflex_serial.protocol import Type, pack
from serial_benches import BOTH, MOTOR, Bench
from simulated_uno import SUPPLY, SimulatedPort, SimulatedUno, needs_simavr

from rotflex.errors import HILError
from rotflex.hil.board import BufferOverflowMode

pytestmark = needs_simavr


@pytest.fixture
def bench():
    """In the middle of a run, with 6 V on the motor."""
    made = Bench()
    made.board.watchdog_start(0.2)
    made.start()
    for _ in range(20):
        made.cycle(6.0)
    made.uno.run(0.001)
    assert made.uno.voltage == 6.0
    return made


def cut(_content: bytes) -> bytes:
    return b""


def test_a_program_that_falls_silent_finds_the_motor_at_0_v(bench):
    bench.uno.run(0.050)
    assert bench.uno.voltage == 0.0
    bench.uno.run(0.03)
    bench.read()
    assert bench.board.watchdog_reload() is False
    assert bench.board.watchdog_is_expired()
    with pytest.raises(HILError, match="heard nothing for 50 ms"):
        bench.write(6.0)
    assert bench.uno.voltage == 0.0
    bench.board.watchdog_clear()
    bench.cycle(1.5)
    bench.uno.run(0.001)
    assert bench.uno.voltage == 1.5


def test_a_program_that_waits_and_does_not_reload_finds_its_watchdog_expired(bench):
    for _ in range(110):
        bench.read()
    assert bench.uno.voltage == 0.0
    assert bench.board.watchdog_reload() is False
    with pytest.raises(HILError, match="watchdog has expired and holds the output;"):
        bench.write(6.0)


def test_a_cable_that_is_pulled(bench):
    bench.port.to_board = bench.port.from_board = cut
    pulled = bench.uno.now
    with pytest.raises(HILError, match=r"no sample for 0\.10 s"):
        for _ in range(100):
            bench.cycle(6.0)
    assert bench.uno.voltage == 0.0
    assert bench.uno.now - pulled < 0.15
    with pytest.raises(HILError, match="does not answer"):
        bench.board.watchdog_stop()
    bench.board.close()
    assert not bench.port.open


@pytest.mark.parametrize("broken", ["to the board", "from the board", "babbling"])
def test_a_line_that_is_broken_one_way_only(bench, broken):
    def babble(_content: bytes) -> bytes:
        bench.uno.run(0.0005)
        return b"U" * 20

    way = "to_board" if broken == "to the board" else "from_board"
    setattr(bench.port, way, babble if broken == "babbling" else cut)
    with pytest.raises(HILError, match="watchdog" if broken == "to the board" else "no sample"):
        for _ in range(100):
            bench.read()
            bench.write(6.0)
    bench.uno.run(0.05)
    assert bench.uno.voltage == 0.0


def test_a_reset_in_the_middle(bench):
    bench.uno.reset()
    assert bench.uno.voltage == 0.0
    with pytest.raises(HILError, match="started anew"):
        for _ in range(20):
            bench.cycle(6.0)
    assert bench.uno.voltage == 0.0
    with pytest.raises(HILError, match="Open the bench again"):
        bench.write(6.0)
    bench.board.close()
    again = SerialBoard(SimulatedPort(bench.uno), SUPPLY)
    again.write_analog(MOTOR, 1, np.array([3.0]))
    assert bench.uno.voltage == 3.0


def test_a_reset_that_was_not_heard_and_a_hang(bench):
    bench.uno.hang(interrupts=False)
    bench.uno.run(0.065)
    assert bench.uno.voltage == 0.0
    bench.uno.mend()
    with pytest.raises(HILError, match="hung"):
        for _ in range(100):
            bench.cycle(6.0)
    again = Bench()
    again.uno.reset()
    again.uno.run(0.02)
    again.uno.take()  # nothing of its start is heard; but it answers that it knows of no session
    with pytest.raises(HILError, match="started anew"):
        again.board.watchdog_stop()


def test_noise_on_the_line_to_the_board(bench):
    """Of 300 outputs, each fourth is spoilt: no voltage is at the motor that was not asked for, and the next comes."""
    draw, seen, asked = random.Random(7), set(), set()

    def noisy(content: bytes) -> bytes:
        if draw.random() < 0.25:
            place = draw.randrange(len(content))
            return content[:place] + draw.randbytes(draw.randrange(1, 9)) + content[place + 1 :]
        return content

    bench.port.to_board = noisy
    for number in range(300):
        volts = 1.5 * (number % 8 - 3.5)
        asked.add(round(volts, 6))
        bench.read()
        bench.board.watchdog_reload()
        bench.write(volts)
        seen.add(round(bench.uno.voltage, 6))
    bench.port.to_board = bytes
    assert seen - {6.0} <= asked
    assert len(seen) == len(asked) + 1
    condition = bench.board.condition()
    assert condition.damaged_there > 30
    assert condition.lost_there > 30
    assert (condition.samples_lost, condition.damaged_here) == (0, 0)
    bench.cycle(-4.5)
    bench.read()
    assert bench.uno.voltage == -4.5


def test_noise_on_the_line_from_the_board(bench):
    """Samples that were spoilt are counted, and all others are as they were."""
    draw = random.Random(8)
    bench.board.task_stop(bench.task)
    bench.uno.turn(0, 100_000, 16_000 * 10_000)  # 20 counts a sample
    bench.start()
    first = bench.read()[0]

    def noisy(content: bytes) -> bytes:
        if content and draw.random() < 0.03:
            place = draw.randrange(len(content))
            return content[:place] + draw.randbytes(3) + content[place:]
        return content

    bench.port.from_board = noisy
    before = 0
    for number in range(1, 400):
        counts = bench.cycle(1.0)[0]
        lost = bench.board.task_get_buffer_overflows(bench.task)
        # The sample may be from before the last loss, where several came at once; it is at its own place all the same.
        place = (counts - first) / 20
        assert place == pytest.approx(round(place), abs=0.06)
        assert number + before <= round(place) <= number + lost
        before = round(place) - number
    bench.port.from_board = bytes
    condition = bench.board.condition()
    assert condition.samples_lost == bench.board.task_get_buffer_overflows(bench.task) > 5
    assert condition.damaged_here >= condition.samples_lost / 2


def test_a_lost_sample_is_an_error_where_one_is_asked_for(bench):
    bench.board.task_set_buffer_overflow_mode(bench.task, BufferOverflowMode.ERROR_ON_OVERFLOW)
    bench.read()
    bench.uno.run(0.005)
    bench.uno.take()
    with pytest.raises(HILError, match=r"lost [23] samples"):
        bench.read()


def test_the_last_0_v_is_sent_until_it_is_obeyed(bench):
    bench.port.to_board = losing(2, lambda content: len(content) >= 8 and content[2] & 0xF == Type.OUTPUT)
    bench.board.watchdog_clear()
    bench.port.uno.run(0.001)
    bench.write(0.0)
    bench.board.watchdog_stop()
    assert bench.port.to_board.left == 0
    assert bench.uno.voltage == 0.0


def losing(times, is_lost):
    """Make a line that loses the content that ``is_lost`` selects; ``left`` counts how often it still does."""

    def line(content):
        if line.left and is_lost(content):
            line.left -= 1
            return b""
        return content

    line.left = times
    return line


def test_an_answer_that_is_lost_is_asked_for_again(bench):
    bench.board.task_stop(bench.task)
    bench.port.from_board = losing(1, lambda content: b"\x1d" in content)
    bench.board.read_encoder(BOTH, 2, bench.counts)
    assert bench.port.from_board.left == 0


def test_a_port_at_which_no_board_of_this_version_answers(monkeypatch):
    monkeypatch.setattr(line, "_STARTING", 0.6)
    with pytest.raises(HILError, match=r"version 2 .*version 1"):
        SerialBoard(SimulatedPort(SimulatedUno(defines="-DPROTOCOL_VERSION=2")), SUPPLY)
    for answer in (cut, lambda content: b"OK\r\nready>\0" if content else b""):
        port = SimulatedPort(SimulatedUno())
        port.from_board = answer
        with pytest.raises(HILError, match="Nothing answers"):
            SerialBoard(port, SUPPLY)
        assert not port.open


def test_what_no_board_says_is_passed_over(bench):
    strange = b"\0" + pack(b"\x1c\x00") + pack(b"\x1d\x00\x00\xff\x00\x00")
    bench.port.from_board = lambda content: content.replace(b"\0", strange)
    bench.cycle(6.0)
    bench.board.read_encoder(BOTH, 2, bench.counts)


def test_an_encoder_that_is_too_quick_ends_the_run(bench):
    bench.uno.turn(0, 18_000, 16_000 * 200)
    bench.uno.turn(1, 18_000, 16_000 * 200)
    with pytest.raises(HILError, match="counts are wrong from here on"):
        for _ in range(100):
            bench.cycle(6.0)
    bench.uno.run(0.3)
    bench.board.set_encoder_counts(BOTH, 2, np.zeros(2, dtype=np.int32))
    bench.board.read_encoder(BOTH, 2, bench.counts)
    assert bench.counts.tolist() == [0, 0]
