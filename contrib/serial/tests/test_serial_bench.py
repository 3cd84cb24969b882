"""Whole experiments at ``serial:``, on the real firmware in simavr with a plant on its pins."""

from __future__ import annotations

import os
import select
import threading
from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
import serial
from rotflex_serial import address, line, stream
from rotflex_serial.board import SerialBoard
from rotflex_serial.port import SerialPort
from simulated_uno import SUPPLY, SimulatedPort, SimulatedUno, needs_simavr

from rotflex import experiments, hil
from rotflex.commissioning import Work, checks, watchdog
from rotflex.commissioning.checks import Level
from rotflex.config import joint, srv02
from rotflex.errors import BenchError, ConfigurationError, HILError, LimitExceeded, MotorNotStopped
from rotflex.hil import real
from rotflex.hil.bench import Connection, Wiring
from rotflex.hil.bench_file import BenchFile
from rotflex.hil.real import Setup
from rotflex.hil.student_benches import VirtualPlantSpec, preset
from rotflex.hil.virtual import Timing
from rotflex.units import DEG

PLANT = preset("real_bench").parameters
URI = "serial:/dev/ttyACM0?supply=12"
DELAY = 0.00075  # s: a sample of 24 bytes, and an output of 9, at 20 us each, and the plant's steps of 1/8 ms
COMMISSIONED = Setup(commissioned=lambda: "")
K = [13.04, -17.26, 1.32, -0.05]


@pytest.fixture
def uno(monkeypatch):
    """What is at the address."""
    made = SimulatedUno(PLANT)
    monkeypatch.setattr(address, "open_port", lambda name: SimulatedPort(made))
    monkeypatch.setattr(
        real, "Connection", partial(Connection, now=lambda: made.now)
    )  # nothing depends on this computer
    return made


@needs_simavr
def test_where_the_line_is_cut_nobody_says_that_the_motor_is_at_0_V(uno):
    with (
        pytest.raises(MotorNotStopped, match=r"^The motor may still be at 3\.00 V\.") as told,
        hil.open(URI, setup=COMMISSIONED) as bench,
    ):
        bench.start(0.002)
        for _each in range(20):
            bench.read()
            bench.write(3.0)
        port = bench.board._port
        port.to_board = port.from_board = lambda content: b""
        bench.read()
    assert told.value.outcome == bench.safety.outcome and not bench.safety.outcome.at_zero
    uno.run(0.1)
    assert uno.voltage == 0.0  # by the board itself, which this program cannot know


@pytest.mark.slow
@needs_simavr
@pytest.mark.parametrize(
    ("experiment", "channels", "swing"),
    [
        (partial(experiments.tracking, controller=K, amplitude=20 * DEG), ("theta", "alpha"), 35 * DEG),
        (partial(experiments.sweep, f_start=2.0, f_stop=5.0), ("alpha",), 5 * DEG),
    ],
    ids=["state feedback", "sweep"],
)
def test_an_experiment_at_the_serial_bench_is_that_at_a_virtual_one(uno, experiment, channels, swing):
    with hil.open(URI, setup=COMMISSIONED) as bench:
        recorded = experiment(bench, duration=3.0, progress=False)
        assert bench.board.condition() == (0, 0, 0, 0, 0)
    assert uno.voltage == 0.0
    with hil.open("virtual", plant=VirtualPlantSpec(joint(1), PLANT, Timing(delay=DELAY))) as bench:
        expected = experiment(bench, duration=3.0, progress=False)
    assert max(np.abs(recorded[name] - expected[name]).max() for name in channels) < 0.5 * DEG
    assert np.ptp(recorded[channels[0]]) > swing
    assert (recorded.metadata["bench"]["uri"], recorded.metadata["source"]) == (URI, "bench")


@needs_simavr
@pytest.mark.parametrize("stopped_by", [LimitExceeded, ZeroDivisionError])
def test_a_limit_and_an_exception_end_at_0_v(uno, stopped_by):
    with pytest.raises(stopped_by), hil.open(URI, setup=COMMISSIONED) as bench:
        bench.start(0.002)
        for _ in range(20 if stopped_by is ZeroDivisionError else 3000):
            bench.read()
            bench.write(6.0)
        raise ZeroDivisionError
    assert uno.voltage == 0.0


@needs_simavr
def test_a_voltage_ends_at_the_supply(uno):
    with hil.open("serial:COM3?supply=5", setup=COMMISSIONED) as bench:
        bench.start(0.002)
        bench.read()
        assert bench.write(9.0) == 5.0


def test_an_address_tells_all_of_it():
    uri = "serial:/dev/ttyACM0?supply=12&encoder=EHR&arm_position=2"
    bench = hil.open(uri)
    assert bench.identity == {"uri": uri, "arm_position": 2, "encoder": "EHR", "clock": "wall"}
    assert (bench.servo.cable_gain, bench.is_simulated) == (1, False)


@pytest.mark.parametrize(
    ("uri", "given", "named"),
    [
        ("serial:/dev/ttyACM0", {}, r"supply=12"),
        ("serial:COM3?supply=much", {}, r"supply=12"),
        ("serial:COM3?supply=230", {}, "to 32 V"),
        (URI, {"plant": PLANT}, "plant"),
        (URI, {"servo": srv02()}, "setup="),
        (URI + "&arm_position=2", {"setup": COMMISSIONED}, "arm_position="),
        ("serial:", {}, "names no port"),
        ("serial:?supply=12", {}, "names no port"),
        ("serial:COM3?seed=7", {}, "supply, encoder, arm_position"),
        ("serial:COM3?supply=12&arm_position=x", {}, "arm_position.*'x'"),
        ("serial:COM3?supply=12&arm_position=9", {}, "arm_position|anchor"),
    ],
)
def test_what_does_not_go_with_the_address_is_refused_by_name(uri, given, named):
    with pytest.raises(ConfigurationError if uri[-2:] in ("=x", "=9") else BenchError, match=named):
        hil.open(uri, **given)


def test_a_bench_file_names_a_port(tmp_path):
    (tmp_path / "bench.toml").write_text(
        f'name = "mine"\naddress = "{URI}"\n[parts]\narm_position = 3\nencoder = "EHR"\n'
    )
    bench = hil.open(str(tmp_path / "bench.toml"))
    assert (bench.joint.arm_position, bench.servo.encoder, bench.servo.amplifier.V_max) == (3, "EHR", 12.0)


@needs_simavr
def test_no_loop_is_closed_before_the_bench_is_commissioned(uno):
    with hil.open(URI) as bench:
        with pytest.raises(BenchError, match="not been commissioned"):
            experiments.tracking(bench, K, duration=1.0, progress=False)
        bench.start(0.002)
        bench.read()
        with pytest.raises(LimitExceeded, match=r"3\.0 V.*±1 V.*commissioned"):
            bench.write(3.0)
    assert uno.voltage == 0.0


@needs_simavr
def test_a_motor_that_is_wired_the_other_way_is_driven_so(uno):
    turned = replace(COMMISSIONED, wiring=Wiring(motor_sign=-1))
    with hil.open(URI, setup=turned) as bench:
        bench.start(0.002)
        for _sample in range(3):
            bench.read()
            bench.write(1.5)
        bench.read()
        assert uno.voltage == pytest.approx(-1.5, abs=SUPPLY / 800)


@pytest.mark.parametrize(
    ("table", "name", "value", "told"),
    [
        ("parts", "cable_gain", 5, "must be 1"),
        ("wiring", "motor", 3, "0 to 0"),
        ("wiring", "servo_encoder", 7, "0 to 1"),
        ("board", "clock", -1, "must be 0"),
    ],
)
def test_what_a_serial_board_cannot_is_told_with_its_place(table, name, value, told):
    with pytest.raises(ConfigurationError, match=rf"\[{table}\] {name}\b.*{value}.*{told}"):
        BenchFile("serial:/dev/ttyACM0?supply=12", **{table: {name: value}})


def test_the_doctor_tells_what_is_installed_and_a_port_that_is_not_there():
    found = checks.examine("serial:/dev/nowhere?supply=12")
    assert f"pyserial {serial.VERSION}" in next(found).message
    with pytest.raises(BenchError, match="'/dev/nowhere'"):
        next(found)


@needs_simavr
def test_the_watchdog_expires_when_it_is_left_alone():
    uno = SimulatedUno(PLANT)
    with real.make_bench("test", lambda: SerialBoard(SimulatedPort(uno), SUPPLY), Setup()) as bench:
        bench.connection.now = lambda: uno.now
        found = list(checks.watchdog_expires(bench, BenchFile("usual:board")))
    assert [one.level for one in found] == [Level.OK], found
    assert uno.voltage == 0.0


@needs_simavr
@pytest.mark.parametrize("works", [True, False])
def test_the_watchdog_is_tested_with_the_motor(works):
    class Deaf(SerialBoard):
        def watchdog_start(self, timeout: float) -> None:
            super().watchdog_start(60.0)

    uno = SimulatedUno(PLANT)
    setup = Setup(commissioned=lambda: "", guarded=False, limits=real.CAREFUL)
    kind = SerialBoard if works else Deaf
    with real.make_bench("test", lambda: kind(SimulatedPort(uno), SUPPLY), setup) as bench:
        bench.connection.now = lambda: uno.now
        told = BenchFile("serial:/dev/null?supply=12")
        work = Work(told, lambda *_: bench, SimpleNamespace(say=lambda text: None))
        watchdog(work, bench)
        assert work.file.record["watchdog"]["passed"] is works
    assert uno.voltage == 0.0


def test_a_port_that_breaks_is_told_in_words():
    class Pulled:
        in_waiting = 1

        def read(self, _count: int) -> bytes:
            raise serial.SerialException("device reports readiness to read but returned no data")

        write = read

    with pytest.raises(BenchError, match="'/dev/no-such-port'"):
        SerialPort("/dev/no-such-port")
    port = SerialPort("loop://")
    port._line = Pulled()
    for call in (lambda: port.write(b"x"), lambda: port.read(port.now())):
        with pytest.raises(HILError, match="loop://"):
            call()


@needs_simavr
def test_the_whole_way_through_a_terminal_of_this_computer(monkeypatch):
    """pyserial at one end of a pseudo-terminal, the firmware at the other; which has its own time."""
    import pty

    for module, name in ((line, "_STARTING"), (line, "_PATIENCE"), (stream, "_LATE")):
        monkeypatch.setattr(module, name, 300.0)  # s of this computer, however busy it is
    ours, theirs = pty.openpty()
    ended = threading.Event()

    uno = SimulatedUno(PLANT)
    uno.run(0.01)

    def pump() -> None:
        while not ended.is_set():
            if select.select([ours], [], [], 0.005)[0]:
                uno.feed(os.read(ours, 4096))
            uno.run(0.0008)  # s; a sample's time passes while an output and a reload are sent
            os.write(ours, uno.take())

    thread = threading.Thread(target=pump)
    thread.start()
    try:
        with hil.open(f"serial:{os.ttyname(theirs)}?supply=12", setup=COMMISSIONED) as bench:
            bench.connection.now = lambda: uno.now
            bench.start(0.002)
            angles = []
            for _ in range(100):
                angles.append(bench.read().theta)
                bench.write(3.0)
            assert bench.board.condition().damaged_there == 0
        assert angles[0] == 0.0
        assert angles[-1] > 5 * DEG
    finally:
        ended.set()
        thread.join()
        os.close(ours)
        os.close(theirs)
