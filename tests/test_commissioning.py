"""The guided commissioning: it finds each wrong sign, and records nothing that it did not see."""

from __future__ import annotations

import io
import json
import math
import sys
from dataclasses import replace
from typing import Any

import miswired
import pytest
import quanser_double
from fault_board import Stopwatch

from rotflex import commissioning, experiments, hil
from rotflex.commissioning import Terminal, commission
from rotflex.config import joint, srv02
from rotflex.errors import BenchError
from rotflex.hil import bench_file, real
from rotflex.hil.bench import Bench
from rotflex.hil.bench_file import BenchFile
from rotflex.hil.student_benches import preset, student_bench
from rotflex.hil.virtual import VirtualBoard
from rotflex.units import DEG, HZ

TOLD = BenchFile("virtual:miswired")
SIMULATOR = "quanser:q2_usb/0@tcpip://localhost:18000?nagle='off'"
GAIN = [18.24, -17.15, 1.59, 0.63]
SIGNS = ("motor_sign", "servo_sign", "link_sign")


@pytest.fixture(autouse=True)
def settings(monkeypatch, tmp_path):
    """What a run keeps on disk lands in the test's own folder."""
    monkeypatch.setenv("ROTFLEX_CONFIG_DIR", str(tmp_path))


def connected(laboratory: miswired.Laboratory):
    return lambda told, setup: real.make_bench("test", laboratory, replace(setup, simulated=True))


@pytest.mark.parametrize(  # at a landing, each sign either way
    "signs", [pytest.param(one, marks=() if math.prod(one) < 0 else pytest.mark.scheduled) for one in miswired.SIGNS]
)
def test_each_combination_of_signs_is_found_on_the_makers_package_and_its_file_closes_a_loop(
    signs, monkeypatch, tmp_path
):
    laboratory = miswired.Laboratory(*signs)
    opened = quanser_double.install(monkeypatch, laboratory)
    told = BenchFile(SIMULATOR, wiring={"motor_sign": -1})  # as found another time
    done = commission(told, lambda told, setup: hil.open(told.address, setup=setup), miswired.Person(laboratory))
    assert tuple(done.wiring[name] for name in SIGNS) == signs
    assert laboratory.moved < 30 * DEG
    measured, true = done.record["measured"], laboratory.spec.parameters
    assert measured["counts_per_turn"] == 4096
    assert measured["natural_frequency_Hz"] * HZ == pytest.approx(math.sqrt(true.K_s / true.J_l), rel=0.01)
    assert all(board.terminals.commanded == [0.0, 0.0] for board in laboratory.made)
    bench_file.save(tmp_path / "bench.toml", done)
    with hil.open(str(tmp_path / "bench.toml")) as bench:
        experiments.tracking(bench, GAIN, duration=0.5, progress=False)
    assert all(not card.is_valid() for card in opened)


def test_a_stiff_joint_is_commissioned_and_the_guard_is_told_how_stiff_it_is(tmp_path):
    """Under the workbook's stiffness the guard would stop its sweeps, see tests/hil/test_guard.py."""
    spec = student_bench(22)
    laboratory = miswired.Laboratory(1, 1, -1, spec)
    told = replace(TOLD, parts={"arm_position": spec.joint.arm_position})
    done = commission(told, connected(laboratory), miswired.Person(laboratory))
    omega = math.sqrt(spec.parameters.K_s / spec.parameters.J_l)
    assert done.record["measured"]["natural_frequency_Hz"] * HZ == pytest.approx(omega, rel=0.01)
    nominal = joint(spec.joint.arm_position).J_l
    assert done.setup().stiffness == pytest.approx(nominal * omega**2, rel=0.02)
    bench_file.save(tmp_path / "bench.toml", done)
    setup = bench_file.load(tmp_path / "bench.toml").setup()
    with connected(laboratory)(done, setup) as bench:
        assert bench.safety.guard is not None
        assert len(experiments.sweep(bench, progress=False)) == 7501


@pytest.mark.parametrize("twisted", ["servo_sign", "link_sign"])
def test_an_encoder_that_was_turned_the_wrong_way_by_hand_is_told_before_a_loop_is_closed(twisted):
    laboratory = miswired.Laboratory(1, 1, -1)
    person = miswired.Person(laboratory, clockwise=twisted)
    with pytest.raises(BenchError, match="wrong way round"):
        commission(TOLD, connected(laboratory), person)
    assert not any("In closed loop" in text for text in person.heard)
    assert laboratory.moved < 30 * DEG


def altered(**parameters):
    spec = preset("real_bench")
    return replace(spec, parameters=replace(spec.parameters, **parameters))


EXCHANGED = {"servo_encoder": 1, "link_encoder": 0}
LOOPBACK = {"loopback_output": 1, "loopback_input": 1}


@pytest.mark.parametrize(
    ("spec", "wiring", "person", "named"),
    [
        (altered(B_l=0.2), None, {}, r"\d+% of"),
        (altered(I_max=0.0), None, {}, "amplifier"),
        (None, None, {"moves": False}, "0 counted 0"),
        (None, EXCHANGED, {}, "Exchange"),
        (None, LOOPBACK, {}, "analog input 1"),
    ],
    ids=["held arm", "no power", "not moved by hand", "exchanged encoders", "loopback without cable"],
)
def test_what_is_wrong_with_the_bench_is_named(spec, wiring, person, named):
    laboratory = miswired.Laboratory(1, 1, -1, *([spec] if spec else []))
    told = replace(TOLD, wiring=wiring) if wiring else TOLD
    with pytest.raises(BenchError, match=named):
        commission(told, connected(laboratory), miswired.Person(laboratory, **person))


def alone(laboratory: miswired.Laboratory, step, person: miswired.Person) -> commissioning.Work:
    """What one step found."""
    connect = laboratory.connect if isinstance(laboratory, Paused) else connected(laboratory)
    work = commissioning.Work(TOLD, connect, person)
    with commissioning.driven_slowly(work) as bench:
        step(work, bench)
    return work


def test_limits_are_about_the_zero_that_was_chosen_however_far_it_was_turned_by_hand(monkeypatch, tmp_path):
    """The first board is the one that was turned by hand, and is opened again and again."""
    laboratory = Paused(1, -1, 1)
    board = laboratory()
    monkeypatch.setattr(board, "close", lambda: None)
    monkeypatch.setattr(Paused, "__call__", lambda self: board)
    commission(TOLD, laboratory.connect, miswired.Person(laboratory))
    assert board.plant.state.theta == pytest.approx(370 * DEG, abs=30 * DEG)
    assert laboratory.moved < 410 * DEG
    (kept,) = (tmp_path / "marks").iterdir()
    told = json.loads(kept.read_text())
    assert told["zero"] * -srv02().K_enc == pytest.approx(370 * DEG, abs=0.1 * DEG)
    assert told["counts"] == board._counted(0)


def test_whoever_says_no_has_no_motor_driven_and_nothing_recorded():
    laboratory = miswired.Laboratory(1, 1, -1)
    with pytest.raises(BenchError, match="broken off"):
        commission(TOLD, connected(laboratory), miswired.Person(laboratory, agrees=False))
    assert laboratory.moved < 1e-9


class Pushed(miswired.Laboratory):
    """Somebody pushes the arm the positive way, harder than 1 V does either way."""

    def __call__(self) -> VirtualBoard:
        board = super().__call__()
        advance = board.plant.advance
        board.plant.advance = lambda voltage, duration: advance(5.0 if voltage else 0.0, duration)
        return board


def test_a_motors_sign_counts_only_if_it_turns_either_way():
    laboratory = Pushed(1, 1, -1)
    with pytest.raises(BenchError, match="the same way"):
        alone(laboratory, commissioning.motor_sign, miswired.Person(laboratory))
    assert laboratory.board.terminals.commanded[0] == 0.0


class Paused(miswired.InItsOwnTime):
    """The computer pauses for 5 ms now and then."""

    every = 0  # reads between two pauses; none unless given
    reads = 0

    def __call__(self) -> VirtualBoard:
        board = super().__call__()
        read = board.task_read_encoder

        def paused(*arguments: Any) -> int:
            self.reads += 1
            if self.every and self.reads % self.every == 0:
                self.time.pass_by(0.005)
            return read(*arguments)

        board.task_read_encoder = paused
        return board

    def connect(self, told: BenchFile, setup: real.Setup) -> Bench:
        return self.timed(real.make_bench("test", self, setup))


def test_where_time_does_not_wait_it_goes_as_well_and_the_record_says_how_samples_came():
    laboratory = Paused(-1, 1, 1)
    laboratory.every = 977
    done = commission(TOLD, laboratory.connect, miswired.Person(laboratory))
    assert [done.wiring[name] for name in SIGNS] == [-1, 1, 1]
    measured = done.record["measured"]
    assert measured["late"] > 0 and measured["missed"] == 0


def test_of_a_motor_without_power_the_rising_voltage_ends_at_the_limit_however_late_the_last_sample_comes():
    laboratory = Paused(1, 1, -1, altered(I_max=0.0))
    laboratory.every = 500
    with pytest.raises(BenchError, match="amplifier"):
        alone(laboratory, commissioning.motor_sign, miswired.Person(laboratory))


@pytest.mark.parametrize("busy_for", [1, 3])
def test_a_sweep_in_which_too_many_samples_came_late_comes_again_and_at_last_ends_the_commissioning(busy_for):
    laboratory = Paused(1, 1, -1)
    laboratory.every = 20
    heard: list[str] = []

    class Busy(miswired.Person):
        def say(self, text: str) -> None:
            if "came late" in text:
                heard.append(text)
                laboratory.every = 20 if len(heard) < busy_for else 0

    if busy_for < 3:
        assert 2 < alone(laboratory, commissioning.link, Busy(laboratory)).measured["natural_frequency_Hz"] < 6
    else:
        with pytest.raises(BenchError, match=r"came late.*in 3 sweeps"):
            alone(laboratory, commissioning.link, Busy(laboratory))
    assert len(heard) == busy_for and "close other programs" in heard[0]


def test_ctrl_c_says_what_is_kept_and_leaves_no_recording_behind(tmp_path):
    """In the sweep without a loop: the mark was set before."""

    def connect(told: BenchFile, setup: real.Setup) -> Bench:
        bench = laboratory.connect(told, setup)

        def press(measured: Any, _voltage: float) -> None:
            if measured.time > 1.0 and bench.latest.alpha:
                raise KeyboardInterrupt

        bench.on_sample = press
        return bench

    laboratory = Paused(1, 1, -1)
    with pytest.raises(BenchError, match="mark that you set"):
        commission(TOLD, connect, miswired.Person(laboratory))
    assert laboratory.board.terminals.commanded == [0.0, 0.0] and not laboratory.board.is_valid()
    assert [path.parent.name for path in tmp_path.rglob("*.*")] == ["marks"]


@pytest.fixture
def typed(monkeypatch):
    """What the person types, line by line."""

    def type_in(*lines: str) -> None:
        monkeypatch.setattr(sys, "stdin", io.StringIO("".join(f"{line}\n" for line in lines)))

    return type_in


def test_a_question_is_asked_until_the_answer_is_yes_or_no(typed, capsys):
    for lines, agreed in ((("y",), True), (("No",), False), (("", "perhaps", " YES "), True), (("nein",), False)):
        typed(*lines)
        assert Terminal().agree("Begin?") is agreed
        assert capsys.readouterr().out.count("?") == 1 + len(lines)


def test_a_turn_by_hand_has_its_time_from_enter_on(typed, capsys, monkeypatch):
    clock = Stopwatch()
    monkeypatch.setattr(commissioning.time, "monotonic", clock.now)
    monkeypatch.setattr(commissioning.time, "sleep", clock.pass_by)
    typed("")
    looks = sum(1 for _each in Terminal().turning("Turn it."))
    assert clock.now() == pytest.approx(15.0, abs=0.01)
    assert looks == pytest.approx(3000, abs=2)
    assert capsys.readouterr().out == "Turn it. You have 15 s for it.\nPress Enter, and turn. "


def test_whoever_closes_the_terminal_ends_it_with_the_motor_at_0_V(typed):
    laboratory = miswired.Laboratory(1, 1, -1)
    typed()
    with pytest.raises(BenchError, match="Nothing is saved"):
        commission(TOLD, connected(laboratory), Terminal())
    assert laboratory.board.terminals.commanded == [0.0, 0.0] and not laboratory.board.is_valid()
