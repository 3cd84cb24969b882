"""The watchdog's test with the motor, on boards that do and do not set 0 V, and what a bench may do without it."""

from __future__ import annotations

from dataclasses import replace

import miswired
import numpy as np
import pytest
import quanser_double
from quanser_double import OPTIONAL, Variant, output
from typer.testing import CliRunner

from rotflex import hil
from rotflex.cli import app
from rotflex.commissioning import add_watchdog_test, checks, commission
from rotflex.errors import BenchError, HILError
from rotflex.hil import bench_file, quanser, real
from rotflex.hil.bench_file import BenchFile
from rotflex.hil.board import Board
from rotflex.hil.controllers import StateFeedback
from rotflex.hil.loop import run
from rotflex.hil.real import Setup
from rotflex.hil.student_benches import preset
from rotflex.hil.virtual import WallClock
from rotflex.units import DEG

DIGITAL = "watchdog_set_digital_expiration_state"
Q8 = BenchFile("quanser:q8_usb/0", board={"filter": 1e5})


def before(told: BenchFile) -> BenchFile:
    """A bench that was commissioned before there was the test."""
    return replace(told, record=real.record(told.identity(), {"stiffness": 1.6, "serial_number": "1001"}))


class Laboratory(miswired.InItsOwnTime):
    def connect(self, told: BenchFile, setup: Setup):
        return self.timed(hil.open(told.address, setup=setup))


@pytest.fixture
def installed(monkeypatch, settings):
    """Gives a function that chooses the board; it gives the laboratory and the cards that were opened."""

    def install(variant: Variant, laboratory: miswired.Laboratory | None = None):
        laboratory = laboratory or Laboratory(1, 1, -1)
        cards = quanser_double.install(monkeypatch, laboratory, variant)
        if isinstance(laboratory, Laboratory):
            monkeypatch.setattr(checks.time, "sleep", laboratory.time.pass_by)
        return laboratory, cards

    return install


#: Boards: whether an expired one stops the motor, and what it refuses.
BOARDS = {
    "as documented": (Variant(), True),
    "Q8-series, configured": (Variant(tristate=True), True),
    "Q8-series that refuses digital states": (Variant(tristate=True, refuses=frozenset({DIGITAL})), False),
    "0 V anyhow, all refused": (Variant(zero=True, refuses=OPTIONAL), True),
    "nothing, all refused": (Variant(refuses=OPTIONAL), False),
    "nothing, without words": (Variant(refuses=OPTIONAL, words=False), False),
    "locks inputs": (Variant(locks="all"), True),
    "locks inputs, and its outputs come back": (Variant(locks="all", restores=True, runs_on=True, stops=False), True),
    "locks inputs, and goes on": (Variant(locks="all", tristate=True, refuses=frozenset({DIGITAL})), False),
    "runs on, and its outputs come back": (Variant(restores=True, runs_on=True), True),
}


@pytest.mark.parametrize("variant", BOARDS)
def test_the_test_finds_whether_the_board_stops_the_motor_and_a_loop_follows_from_it(installed, variant):
    chosen, stops = BOARDS[variant]
    way = (-1) ** [*BOARDS].index(variant)  # the motor's cable, this way and that
    laboratory, cards = installed(chosen, Laboratory(way, 1, -1))
    old, person = before(Q8), miswired.Person(laboratory)
    assert "--watchdog" in old.setup().commissioned()
    with laboratory.connect(old, old.setup()) as bench:
        assert bench.safety.limits.voltage == 1.0
        with pytest.raises(BenchError, match="was not tested"):
            bench.safety.require_commissioned()
    done = add_watchdog_test(old, laboratory.connect, person)
    assert done.record["watchdog"]["passed"] is stops, done.record["watchdog"]
    assert set(done.record["watchdog"]["refused"]) == set(chosen.refuses)
    assert sum("refused" in text for text in person.heard) == len(chosen.refuses)  # each is told, once
    assert laboratory.moved < 45 * DEG and output(cards[-1]) == 0.0
    bench_file.save("bench.toml", done)
    again = bench_file.load("bench.toml")
    assert again == replace(done, name="bench")
    with laboratory.connect(again, again.setup()) as bench:
        assert (bench.safety.limits.voltage, again.setup().commissioned() is None) == (
            (10.0, True) if stops else (1.0, False)
        )


@pytest.mark.parametrize("verb", sorted(OPTIONAL))
def test_a_board_that_refuses_what_it_took_closes_no_loop_until_its_watchdog_is_tested_again(installed, verb):
    laboratory, _cards = installed(Variant())
    done = add_watchdog_test(before(Q8), laboratory.connect, miswired.Person(laboratory))
    laboratory, _cards = installed(Variant(zero=True, refuses=frozenset({verb})), laboratory)
    law, reference = StateFeedback([18.24, -17.15, 1.59, 0.63]), np.full(200, 0.2)
    with laboratory.connect(done, done.setup()) as bench:
        bench.set_zero()
        with pytest.raises(BenchError, match=f"{verb}, which it took"):
            run(bench, law, reference, progress=False)
    again = add_watchdog_test(done, laboratory.connect, miswired.Person(laboratory))
    assert again.record["watchdog"]["refused"] == [verb]
    with laboratory.connect(again, again.setup()) as bench:
        bench.set_zero()
        assert len(run(bench, law, reference, progress=False)) == 200


def test_a_board_that_refuses_all_that_is_optional_is_commissioned_where_its_watchdog_stops_the_motor(installed):
    laboratory, cards = installed(Variant(zero=True, refuses=OPTIONAL, serial=None))
    done = commission(Q8, laboratory.connect, miswired.Person(laboratory))
    assert done.record["watchdog"]["passed"] and "serial_number" not in done.record["measured"]
    assert laboratory.moved < 410 * DEG  # a turn by hand, and what the motor did
    with laboratory.connect(done, done.setup()) as bench:
        assert len(run(bench, StateFeedback([18.24, -17.15, 1.59, 0.63]), np.full(200, 0.2), progress=False)) == 200
    assert output(cards[-1]) == 0.0


def test_a_watchdog_that_does_not_stop_the_motor_ends_the_commissioning_at_1_V(installed):
    laboratory, cards = installed(Variant(tristate=True, refuses=frozenset({DIGITAL})))
    with pytest.raises(BenchError, match=r"did not stop the motor.*Nothing was recorded"):
        commission(Q8, laboratory.connect, miswired.Person(laboratory))
    assert laboratory.moved < 410 * DEG and output(cards[-1]) == 0.0


@pytest.mark.parametrize("refuses", [frozenset(), frozenset({DIGITAL})])
def test_a_program_without_a_word_leaves_0_V_on_a_q8_only_where_its_digital_outputs_are_configured(installed, refuses):
    laboratory, cards = installed(Variant(tristate=True, refuses=refuses))
    with laboratory.connect(Q8, replace(Q8.setup(), commissioned=lambda: "")) as bench:
        bench.start(0.002)
        bench.read()
        bench.write(1.27)
        laboratory.time.pass_by(1.0)
        laboratory.board._catch_up(laboratory.time.now())
        assert output(cards[-1]) == (1.27 if refuses else 0.0)


def test_a_motor_without_power_is_no_test_and_nothing_is_recorded(installed):
    spec = preset("real_bench")
    dead = replace(spec, parameters=replace(spec.parameters, I_max=0.0))
    laboratory, _cards = installed(Variant(), Laboratory(1, 1, -1, dead))
    with pytest.raises(BenchError, match="amplifier"):
        add_watchdog_test(before(Q8), laboratory.connect, miswired.Person(laboratory))
    with pytest.raises(BenchError, match="broken off"):
        add_watchdog_test(before(Q8), laboratory.connect, miswired.Person(laboratory, agrees=False))
    with pytest.raises(BenchError, match="no record"):
        add_watchdog_test(Q8, laboratory.connect, miswired.Person(laboratory))


@pytest.mark.parametrize(("joined", "passed"), [(True, True), (False, False)])
def test_a_loopback_is_read_back_and_one_that_keeps_its_voltage_fails(installed, monkeypatch, joined, passed):
    looped = replace(Q8, wiring={"loopback_output": 1, "loopback_input": 1})
    laboratory, cards = installed(Variant())

    def read(card, channels, number, buffer) -> None:
        buffer[0] = output(card, 1) if joined else 1.0

    monkeypatch.setattr(quanser_double.HIL, "read_analog", read)
    done = add_watchdog_test(before(looped), laboratory.connect, miswired.Person(laboratory))
    assert done.record["watchdog"]["passed"] is passed
    assert [output(cards[-1], channel) for channel in (0, 1)] == [0.0, 0.0]


@pytest.mark.parametrize(("serial", "same"), [("1001", True), (None, True), ("2002", False)])
def test_another_board_of_the_same_kind_is_noticed_and_one_that_does_not_tell_is_no_fault(installed, serial, same):
    laboratory, _cards = installed(Variant(serial=serial))
    old = before(Q8)
    told = replace(old, record={**old.record, "watchdog": {"passed": True}})
    with laboratory.connect(told, told.setup()) as bench:
        assert bench.safety.limits.voltage == (10.0 if same else 1.0)
        if same:
            bench.safety.require_commissioned()
        else:
            with pytest.raises(BenchError, match=r"serial number was '1001' and is '2002'"):
                bench.safety.require_commissioned()


def test_the_makers_simulator_needs_no_test():
    assert before(BenchFile("quanser:q8_usb/0@tcpip://localhost:18000")).setup().commissioned() is None


def test_the_command_adds_the_test_to_the_record(installed):
    class InWallTime(miswired.Laboratory):
        def __call__(self):
            board = super().__call__()
            board.clock = WallClock()
            return board

    _laboratory, cards = installed(Variant(tristate=True), InWallTime(1, 1, -1))
    bench_file.save("bench.toml", before(Q8))
    done = CliRunner().invoke(app, ["bench", "setup", "--watchdog", "bench.toml"], input="yes\n")
    assert done.exit_code == 0, done.output
    told = bench_file.load("bench.toml")
    assert told.record["watchdog"]["passed"] and told.setup().commissioned() is None
    assert CliRunner().invoke(app, ["bench", "setup", "--watchdog", Q8.address]).exit_code == 2
    assert output(cards[-1]) == 0.0


def test_an_error_without_words_is_told_by_its_number_and_by_what_was_done(installed):
    installed(Variant(refuses=frozenset({"task_stop"}), words=False))
    board: Board = quanser.connect("q2_usb", "0")
    with pytest.raises(HILError, match=r"task_stop.*-1040"):
        board.task_stop(7)


def test_the_size_of_options_counts_bytes(installed, monkeypatch):
    laboratory, _cards = installed(Variant())
    told = []
    monkeypatch.setattr(
        "rotflex.hil.virtual.VirtualBoard.set_card_specific_options", lambda _, *given: told.append(given)
    )
    chosen = replace(Q8, board={"options": "led=grün"})
    with laboratory.connect(chosen, chosen.setup()):
        assert told == [("led=grün", 9)]
