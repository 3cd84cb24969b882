"""The guided commissioning: it finds each wrong sign, and records nothing that it did not see."""

from __future__ import annotations

import sys
from dataclasses import replace

import miswired
import pytest
import quanser_double

from rotflex import hil
from rotflex.commissioning import commission, driven
from rotflex.errors import BenchError
from rotflex.hil import bench_file, real
from rotflex.hil.bench_file import BenchFile
from rotflex.hil.student_benches import preset
from rotflex.hil.terminals import Timing
from rotflex.units import DEG

TOLD = BenchFile("virtual:miswired", wiring={"potentiometer": 0})
SIMULATOR = "quanser:q2_usb/0@tcpip://localhost:18000?nagle='off'"
SIGNS = ("motor_sign", "servo_sign", "link_sign")


@pytest.fixture(autouse=True)
def settings(monkeypatch, tmp_path):
    """What a run keeps on disk lands in the test's own folder."""
    monkeypatch.setenv("ROTFLEX_CONFIG_DIR", str(tmp_path))


def connected(laboratory: miswired.Laboratory):
    return lambda told, setup: real.bench("test", laboratory, replace(setup, simulated=True))


def expected(motor: int, servo: int, link: int) -> dict[str, int]:
    return {"motor_sign": motor, "servo_sign": servo, "link_sign": link}


@pytest.mark.parametrize("signs", miswired.SIGNS)
def test_each_combination_of_signs_is_found_and_the_arm_stays_within_a_few_degrees(signs):
    laboratory = miswired.Laboratory(*signs)
    done = commission(TOLD, connected(laboratory), miswired.Person(laboratory))
    assert {name: done.wiring[name] for name in SIGNS} == expected(*signs)
    assert done.setup().commissioned() == ""
    assert not done.record["provisional"]
    assert laboratory.moved < 15 * DEG
    measured = done.record["measured"]
    assert measured["counts_per_turn"] == 4096
    assert measured["potentiometer_gap_deg"] == pytest.approx(170, abs=3)
    natural = (laboratory.spec.parameters.K_s / laboratory.spec.parameters.J_l) ** 0.5 / 6.2832
    assert measured["natural_frequency_Hz"] == pytest.approx(natural, rel=0.06)
    assert all(board.terminals.commanded == [0.0, 0.0] for board in laboratory.made)


@pytest.mark.parametrize("signs", [(-1, 1, -1), (1, -1, 1)])
def test_the_makers_package_is_commissioned_and_its_file_closes_a_loop(signs, monkeypatch, tmp_path):
    laboratory = miswired.Laboratory(*signs)
    modules, opened = quanser_double.package(laboratory)
    for name, module in modules.items():
        monkeypatch.setitem(sys.modules, name, module)
    done = commission(
        BenchFile(SIMULATOR, wiring={"potentiometer": 0}),
        lambda told, setup: hil.open(told.address, setup=setup),
        miswired.Person(laboratory),
    )
    assert {name: done.wiring[name] for name in SIGNS} == expected(*signs)
    bench_file.save(tmp_path / "bench.toml", done)
    with hil.open(str(tmp_path / "bench.toml")) as bench:
        bench.require_commissioned()
    assert all(not card.is_valid() for card in opened)


@pytest.mark.parametrize("delay", [0.0, 0.001, 0.002, 0.004])
def test_the_delay_is_found(delay):
    spec = replace(preset("real_bench"), timing=Timing(delay=delay))
    laboratory = miswired.Laboratory(1, 1, -1, spec)
    with connected(laboratory)(TOLD, TOLD.setup()) as bench:
        bench.safety = replace(bench.safety, guard=None)
        assert driven.loop_delay(bench) == pytest.approx(delay, abs=0.0002)


def test_breakaway_is_the_friction_of_each_way():
    friction = preset("real_bench").parameters
    laboratory = miswired.Laboratory(1, 1, -1)
    with connected(laboratory)(TOLD, TOLD.setup()) as bench:
        bench.safety = replace(bench.safety, guard=None)
        found = driven.breakaway(bench)
    for volts, torque in zip(found, friction.servo_friction, strict=True):
        assert 0 <= volts - torque / friction.torque_per_volt < 0.06


def test_whoever_does_not_move_the_bench_is_told_what_was_counted():
    laboratory = miswired.Laboratory(1, 1, -1)
    with pytest.raises(BenchError, match="You moved the servo, and encoder 0 counted 0, which is too little"):
        commission(TOLD, connected(laboratory), miswired.Person(laboratory, moves=False))


def test_exchanged_encoders_are_told():
    laboratory = miswired.Laboratory(1, 1, -1)
    told = BenchFile("virtual:miswired", wiring={"servo_encoder": 1, "link_encoder": 0})
    with pytest.raises(BenchError, match=r"the two are the other way round. Exchange their cables"):
        commission(told, connected(laboratory), miswired.Person(laboratory))


def test_limits_are_about_the_zero_that_was_chosen_however_far_it_was_turned_by_hand():
    laboratory = miswired.Laboratory(1, -1, 1)
    commission(TOLD, connected(laboratory), miswired.Person(laboratory))
    by_hand = laboratory.made[0]
    assert by_hand.plant.state.theta == pytest.approx(370 * DEG)
    assert [by_hand._sensors.counts(channel) for channel in (0, 1)] == [0, 0]


def test_whoever_says_no_has_no_motor_driven_and_nothing_recorded():
    laboratory = miswired.Laboratory(1, 1, -1)
    with pytest.raises(BenchError, match="broken off before the motor drove"):
        commission(TOLD, connected(laboratory), miswired.Person(laboratory, agrees=False))
    assert laboratory.moved < 1e-9


def test_a_motor_without_power_is_told():
    spec = preset("real_bench")
    dead = replace(spec, parameters=replace(spec.parameters, I_max=0.0))
    laboratory = miswired.Laboratory(1, 1, -1, dead)
    with pytest.raises(BenchError, match="did not move at 2 V: is the amplifier on, its emergency stop released"):
        commission(TOLD, connected(laboratory), miswired.Person(laboratory))


def test_a_loopback_without_its_cable_is_told():
    laboratory = miswired.Laboratory(1, 1, -1)
    told = BenchFile("virtual:miswired", wiring={"loopback_output": 1, "loopback_input": 1})
    with pytest.raises(BenchError, match=r"-2 V on analog output 1 came in as -?0.00 V at analog input 1"):
        commission(told, connected(laboratory), miswired.Person(laboratory))
