"""The real firmware in simavr, frame by frame."""

from __future__ import annotations

import random
import struct

import pytest
from rotflex_serial import protocol
from rotflex_serial.protocol import Booted, Cause, Flag, Message, Receiver, Reply, Sample, Status, Type
from simulated_uno import CYCLES, MS, SUPPLY, SimulatedUno, firmware, needs_simavr

pytestmark = needs_simavr

STEPS = 800
SILENCE = 0.050
RESOLUTION = 2e-5  # s, of what is measured here


class Talk:
    """A session with a simulated board, without the program's own line."""

    def __init__(self, **choices: object) -> None:
        self.uno = SimulatedUno(**choices)
        self.receiver = Receiver()
        self.sequence = 0
        self.uno.run(0.01)
        self.heard: list[Message] = self.hear()

    def hear(self, wait: float = 0.0) -> list[Message]:
        self.uno.run(wait)
        return [protocol.message(body) for body in self.receiver.take(self.uno.take())]

    def say(self, kind: Type, payload: bytes = b"") -> None:
        self.sequence = (self.sequence + 1) % 256
        self.uno.feed(protocol.request(kind, self.sequence, payload))

    def ask(self, kind: Type, payload: bytes = b"") -> Reply:
        self.say(kind, payload)
        replies = [heard for heard in self.hear(0.003) if isinstance(heard, Reply)]
        assert [reply.sequence for reply in replies] == [self.sequence]
        return replies[0]

    def begin(self, supply: float = SUPPLY) -> None:
        assert self.ask(Type.HELLO).status is Status.OK
        assert self.ask(Type.SUPPLY, protocol.SUPPLY.pack(round(supply * 1000))).status is Status.OK

    def drive(self, volts: float) -> float:
        """Set an output, and say what the motor gets."""
        self.say(Type.OUTPUT, protocol.OUTPUT.pack(round(volts * 1000)))
        self.uno.run(0.002)
        return self.uno.voltage

    def counts(self) -> tuple[int, int]:
        servo, link, *_rest = protocol.READ.unpack(self.ask(Type.READ).payload)
        return servo, link

    def time_to_zero(self, longest: float) -> float:
        start = self.uno.now
        while self.uno.voltage and self.uno.now < start + longest:
            self.uno.run(RESOLUTION)
        assert self.uno.voltage == 0.0
        return self.uno.now - start


@pytest.fixture
def talk():
    session = Talk()
    session.begin()
    return session


def test_it_fits_into_the_controller():
    """It has 32 KiB of flash, half a KiB of which the bootloader takes; of 2 KiB of memory the stack needs a part."""
    elf = firmware().read_bytes()  # 32-bit: a table of sections, whose names are in one of them
    table, entry_size, count, names_at = struct.unpack_from("<I", elf, 32) + struct.unpack_from("<3H", elf, 46)
    entries = [struct.unpack_from("<10I", elf, table + number * entry_size) for number in range(count)]
    names = elf[entries[names_at][4] :]
    sizes = {names[entry[0] : names.index(b"\0", entry[0])].decode(): entry[5] for entry in entries}
    assert sizes[".text"] + sizes[".data"] < 31 * 1024
    assert sizes[".data"] + sizes[".bss"] < 1024


def test_it_says_that_it_has_started_and_what_it_is_and_obeys_nothing_before_a_session():
    talk = Talk()
    assert talk.heard == [Booted(Cause.POWER)]
    assert talk.uno.voltage == talk.drive(5.0) == 0.0
    assert talk.ask(Type.SUPPLY, protocol.SUPPLY.pack(12000)).status is Status.NO_SESSION
    assert talk.drive(5.0) == 0.0
    release, steps, silence, _cause = protocol.HELLO.unpack(talk.ask(Type.HELLO).payload)
    assert (release, steps, silence) == (1, STEPS, round(SILENCE * 1000))
    assert talk.drive(5.0) == 0.0  # it does not know its supply


@pytest.mark.parametrize("supply", [5.0, 12.0, 24.0])
def test_a_voltage_is_a_share_of_the_supply_to_half_a_step(supply):
    talk = Talk(supply=supply)
    talk.begin(supply)
    for volts in (0.0, 0.001, 0.02, -0.02, 1.0, -1.0, 3.333, -4.9, 5.0, -5.0):
        assert talk.drive(volts) == pytest.approx(volts, abs=supply / STEPS / 2 + 0.0005)
    assert (talk.drive(30.0), talk.drive(-30.0)) == (supply, -supply)  # more than the supply is the supply


def test_the_sign_changes_at_once_and_a_farewell_sets_0_v(talk):
    for volts in (6.0, -6.0, 6.0, 0.0, -6.0, 0.0, 6.0):
        assert talk.drive(volts) == volts
    talk.ask(Type.BYE)
    assert talk.uno.voltage == 0.0
    assert talk.drive(6.0) == 0.0


def test_what_cannot_be_is_refused(talk):
    for kind, payload in (
        *((Type.SUPPLY, struct.pack("<H", millivolts)) for millivolts in (2999, 32001)),
        *((Type.START, struct.pack("<H", period)) for period in (0, 10001)),
        (Type.WATCHDOG, struct.pack("<BH", 7, 100)),
        (Type.WATCHDOG, struct.pack("<BH", 1, 0)),
        (Type.READ, b"what?"),
        (Type.OUTPUT, b""),
    ):
        assert talk.ask(kind, payload).status is Status.BAD_VALUE
    for head, status in ((protocol.VERSION << 4, Status.UNKNOWN), (2 << 4 | Type.OUTPUT, Status.OTHER_VERSION)):
        talk.sequence += 1
        talk.uno.feed(protocol.pack(bytes([head, talk.sequence]) + protocol.OUTPUT.pack(6000)))
        (reply,) = talk.hear(0.003)
        assert (reply.sequence, reply.status) == (talk.sequence, status)
    assert talk.uno.voltage == 0.0
    *_inputs, before, _missed = protocol.READ.unpack(talk.ask(Type.READ).payload)
    talk.sequence += 3  # frames that did not come are counted
    *_inputs, lost, _missed = protocol.READ.unpack(talk.ask(Type.READ).payload)
    assert lost - before == 3


def test_each_edge_counts_either_way(talk):
    at = [0, 0]
    for servo, link in ((1, 0), (0, 1), (2, -1), (-1, -2), (4096, 3), (-4096, -8192), (5, 5)):
        at = [at[0] + servo, at[1] + link]
        talk.uno.turn(0, at[0], 200 * MS)
        talk.uno.turn(1, at[1], 200 * MS)
        talk.uno.run(0.21)
        assert talk.counts() == tuple(at)


def test_counts_are_set_each_by_itself(talk):
    talk.ask(Type.COUNTS, protocol.COUNTS.pack(1, -70000, 5))
    assert talk.counts() == (-70000, 0)
    talk.ask(Type.COUNTS, protocol.COUNTS.pack(2, 9, 2**31 - 1))
    assert talk.counts() == (-70000, 2**31 - 1)


@pytest.mark.parametrize("rate", [20_000, 50_000])
def test_both_count_exactly_at_once_while_samples_are_sent(talk, rate):
    """At 50 000 edges a second each, whatever else is done: 12 turns a second of an encoder with 4096 counts."""
    talk.ask(Type.START, protocol.PERIOD.pack(2))
    edges = round(0.3 * rate)
    talk.uno.turn(0, edges, CYCLES * 3 // 10)
    talk.uno.turn(1, -edges, CYCLES * 31 // 100)  # never at the same time, and then at the same time again
    for number in range(160):
        talk.drive(number % 7 - 3.0)
        talk.hear()
    *_inputs, damaged, lost, missed = protocol.READ.unpack(talk.ask(Type.READ).payload)
    assert (damaged, lost, missed) == (0, 0, 0)
    assert talk.counts() == (edges, -edges)


def test_an_encoder_that_is_too_quick_is_told(talk):
    talk.uno.turn(0, 18_000, CYCLES // 5)
    talk.uno.turn(1, 18_000, CYCLES // 5)
    talk.uno.run(0.25)
    assert Flag.MISCOUNTED in talk.ask(Type.READ).flags
    assert Flag.MISCOUNTED not in talk.ask(Type.COUNTS, protocol.COUNTS.pack(3, 0, 0)).flags


@pytest.mark.parametrize("period", [1, 2, 10])
def test_samples_come_unasked_by_its_own_clock(talk, period):
    """The encoder turns evenly, so that counts tell the time."""
    samples, per_ms = 100, 10
    talk.uno.turn(0, per_ms * 5000, 5000 * MS)
    assert talk.ask(Type.START, protocol.PERIOD.pack(period)).status is Status.OK
    heard = [sample for sample in talk.hear(samples * period / 1000) if isinstance(sample, Sample)]
    begun, first = heard[0].number, heard[0].inputs.counts[0]
    assert begun <= 3 and len(heard) >= samples - 3  # the first ones came with the answer
    for number, sample in enumerate(heard):
        assert sample.number == begun + number
        assert sample.inputs.counts[0] - first == pytest.approx(per_ms * period * number, abs=1)


def test_a_sample_says_which_output_was_obeyed_last_and_samples_end_when_they_are_told_to(talk):
    talk.ask(Type.START, protocol.PERIOD.pack(2))
    talk.drive(1.0)
    sample = talk.hear(0.004)[-1]
    assert sample.accepted == talk.sequence
    talk.drive(0.0)
    talk.ask(Type.STOP)
    assert talk.hear(0.5) == []
    assert Flag.EXPIRED not in talk.ask(Type.READ).flags  # silence at 0 V is no fault


def test_inputs_and_lines(talk):
    talk.uno.analog(2, 1.25)
    talk.uno.analog(3, 5.0)
    assert talk.ask(Type.LINES, protocol.LINES.pack(0b1111, 0b0101)).status is Status.OK
    assert talk.ask(Type.LINES, protocol.LINES.pack(0b0001, 0b0000)).status is Status.OK
    assert talk.uno.lines == 0b0100
    talk.uno.run(0.01)
    _servo, _link, lines, first, second, *_rest = protocol.READ.unpack(talk.ask(Type.READ).payload)
    assert lines == 0b0100
    assert first == pytest.approx(256, abs=1)
    assert second >= 1022


def test_silence_sets_the_motor_to_0_v_within_50_ms(talk):
    assert talk.drive(6.0) == 6.0
    talk.say(Type.ALIVE)
    talk.uno.run(0.0002)  # its 7 bytes take 140 us to come, and some more to be understood
    assert SILENCE - 0.002 <= talk.time_to_zero(1.0) <= SILENCE + RESOLUTION
    assert talk.ask(Type.READ).flags & (Flag.EXPIRED | Flag.SILENT) == Flag.EXPIRED | Flag.SILENT
    assert talk.drive(6.0) == 0.0
    talk.ask(Type.WATCHDOG, protocol.WATCHDOG.pack(protocol.Operation.CLEAR, 0))
    assert talk.uno.voltage == 0.0
    assert talk.drive(6.0) == 6.0


@pytest.mark.parametrize("kind", [Type.ALIVE, Type.RELOAD, Type.READ, None])
def test_any_frame_breaks_the_silence_and_damaged_ones_do_not(talk, kind):
    talk.drive(-6.0)
    for _ in range(10):
        if kind is None:
            talk.uno.feed(b"\0" + protocol.pack(b"\x1f\x01")[:-2] + b"\x77\0")
        else:
            talk.say(kind)
        talk.uno.run(0.045)
    assert talk.uno.voltage == (0.0 if kind is None else -6.0)


def test_the_programs_watchdog_needs_its_reload_and_nothing_else(talk):
    talk.ask(Type.WATCHDOG, protocol.WATCHDOG.pack(protocol.Operation.WATCH, 200))
    talk.drive(6.0)
    for _ in range(20):
        talk.say(Type.RELOAD)
        talk.uno.run(0.04)
    assert talk.uno.voltage == 6.0
    start = talk.uno.now
    while talk.uno.voltage and talk.uno.now < start + 1:
        talk.say(Type.ALIVE)
        talk.uno.run(0.004)
    assert talk.uno.now - start == pytest.approx(0.16, abs=0.005)  # 0.04 s had passed
    flags = talk.ask(Type.READ).flags
    assert Flag.EXPIRED in flags
    assert Flag.SILENT not in flags


@pytest.mark.parametrize(("interrupts", "longest"), [(True, SILENCE), (False, 0.065)])
def test_a_program_that_hangs_sets_the_motor_to_0_v(talk, interrupts, longest):
    """With interrupts, by the silence; without, by the controller's own watchdog, which starts it anew."""
    talk.drive(6.0)
    talk.uno.hang(interrupts)
    assert talk.time_to_zero(1.0) <= longest
    talk.uno.mend()
    if not interrupts:
        assert Booted(Cause.HANG) in talk.hear(0.1)
    assert talk.uno.voltage == 0.0


def test_a_reset_sets_the_motor_to_0_v_and_ends_the_session(talk):
    talk.drive(6.0)
    talk.uno.reset()
    assert talk.uno.voltage == 0.0
    assert any(isinstance(heard, Booted) for heard in talk.hear(0.02))
    assert talk.drive(6.0) == 0.0
    talk.begin()
    assert talk.drive(6.0) == 6.0


def test_noise_drives_nothing_and_the_next_frame_is_heard(talk):
    draw = random.Random(14)
    for _ in range(40):
        talk.uno.feed(draw.randbytes(150))
        talk.uno.run(0.005)
        assert talk.uno.voltage == 0.0
    assert Flag.DAMAGED in talk.ask(Type.READ).flags
    assert talk.drive(6.0) == 6.0


def test_no_answer_is_lost_at_whatever_moment_between_samples_it_is_asked_for():
    """An answer that came right behind a sample was lost where the queue's end had wrapped and its beginning not."""
    talk = Talk()
    talk.begin()
    assert talk.ask(Type.START, protocol.PERIOD.pack(2)).status is Status.OK
    moments = random.Random(14)
    for _each in range(600):
        talk.hear(moments.uniform(0.0, 0.002))
        if moments.random() < 0.5:
            talk.say(Type.RELOAD)
        talk.ask(Type.READ)  # asserts that the answer came, and no other
