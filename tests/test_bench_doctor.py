"""What `rotflex doctor --bench` says of a bench: of each kind of bench, and of each thing that can be wrong with it."""

from __future__ import annotations

import json
import re
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import quanser_double
from quanser_double import VARIANTS
from typer.testing import CliRunner

from rotflex import bench_doctor, experiments, hil
from rotflex.bench_doctor import Finding, Level
from rotflex.cli import app
from rotflex.commissioning import steps
from rotflex.errors import HILError
from rotflex.hil import bench_file, real
from rotflex.hil.bench_file import BenchFile
from rotflex.hil.real import Setup
from rotflex.hil.student_benches import preset
from rotflex.hil.virtual import VirtualBoard, WallClock

SIMULATOR = "quanser:q2_usb/0@tcpip://localhost:18000?nagle='off'"
VIRTUAL = "virtual:?preset=real_bench"
PARAMETERS = preset("real_bench").parameters
#: What is looked at, in this order, where nothing fails.
ALL = ["bench", "software", "board", "encoders", "samples at 500 Hz", "samples at 1000 Hz", "watchdog's time"]
ALL += ["commissioned", "limits"]


@pytest.fixture(autouse=True)
def settings(monkeypatch, tmp_path) -> Path:
    """All is written into the test's own folder."""
    monkeypatch.setenv("ROTFLEX_CONFIG_DIR", str(tmp_path / "settings"))
    monkeypatch.chdir(tmp_path)
    return tmp_path / "settings" / "unfinished"


@pytest.fixture
def installed(monkeypatch):
    """The maker's package is there; gives a function that chooses its board."""

    def install(make=lambda: Watched(PARAMETERS), variant: quanser_double.Variant | None = None):
        return quanser_double.install(monkeypatch, make, variant)

    return install


class Watched(VirtualBoard):
    """A board that remembers the largest voltage that each output ever had."""

    def __init__(self, *arguments, **settings) -> None:
        super().__init__(*arguments, **settings)
        self.largest = [0.0, 0.0]

    def write_analog(self, channels, num_channels, buffer) -> None:
        super().write_analog(channels, num_channels, buffer)
        self.largest = [max(one) for one in zip(self.largest, map(abs, self.terminals.commanded), strict=True)]


class Joined(Watched):
    """Analog input 1 is joined to output 1."""

    def read_analog(self, channels, num_channels, buffer) -> None:
        buffer[:num_channels] = [self.terminals.commanded[channel] for channel in channels[:num_channels]]


def asked(uri: str, *words: str, code: int = 0) -> dict[str, list[Finding]]:
    """The findings of `rotflex doctor --bench`, by what was looked at."""
    done = CliRunner().invoke(app, ["doctor", "--bench", uri, "--json", "--seconds", "0.2", *words])
    assert done.exit_code == code, done.output
    data = json.loads(done.output)
    assert data["good"] == (code == 0)
    found: dict[str, list[Finding]] = {}
    for one in data["findings"]:
        found.setdefault(one["what"], []).append(Finding(**one | {"level": Level(one["level"])}))
    return found


@pytest.mark.parametrize("uri", [VIRTUAL, "virtual"])
def test_on_a_virtual_bench_all_is_well(uri):
    found = asked(uri)
    assert [one.what for ones in found.values() for one in ones] == ALL
    assert {one.level for ones in found.values() for one in ones} == {Level.OK}
    assert "time waits for the program" in found["samples at 500 Hz"][0].message
    assert found["limits"][0].message == "10 V, theta ±180 deg, alpha ±30 deg."
    assert found["commissioned"][0].message == "This bench is asked for none."


def test_people_get_a_line_each_and_what_to_do_below():
    done = CliRunner().invoke(app, ["doctor", "--bench", VIRTUAL, "--seconds", "0.1"])
    lines = done.output.splitlines()
    assert [line[5:25].strip() for line in lines if line.startswith("ok ")] == ALL
    assert re.fullmatch(" {25}→ .* rotflex bench watch.", lines[ALL.index("encoders") + 1])


def test_of_a_replay_it_is_said_that_there_is_no_board(tmp_path):
    with hil.open(VIRTUAL) as bench:
        experiments.tracking(bench, [18.24, -17.15, 1.59, 0.63], duration=0.5, progress=False).save("run.mat")
    found = asked("replay:run.mat")
    assert list(found) == ["bench", "software", "board"]
    assert "no board" in found["board"][0].message


@pytest.mark.parametrize("variant", VARIANTS)
def test_the_makers_board_is_looked_at_whatever_its_watchdog_does_and_its_motor_never_driven(installed, variant):
    cards = installed(variant=VARIANTS[variant])
    found = asked(SIMULATOR)
    assert [one for one in found if one != "watchdog"] == list(dict.fromkeys(ALL))
    assert found["watchdog"][0].level is Level.WARN  # there is no cable: nobody saw 0 V
    assert "the maker's package" in found["software"][0].message
    assert found["watchdog's time"][0].message.endswith("; no voltage is taken then.")
    narrow = "1 V, theta ±40 deg, alpha ±25 deg, 8 rad/s, 60 s a run, until it is commissioned."
    assert found["limits"][0].message == narrow
    (card,) = cards
    assert card._inner.largest == [0.0, 0.0] and not card.is_valid()


def test_a_board_with_a_clock_of_its_own_is_looked_at_in_its_time(installed):
    cards = installed(lambda: Watched(PARAMETERS, clock=WallClock()))
    found = [one for one in bench_doctor.examine("quanser:q2_usb/0", seconds=0.2)]
    assert {"samples at 500 Hz", "samples at 1000 Hz", "watchdog's time"} <= {one.what for one in found}
    assert cards[0]._inner.largest == [0.0, 0.0]


def test_a_bench_that_was_not_commissioned_or_changed_since_is_told_to_be(installed):
    installed()
    told = BenchFile(SIMULATOR)
    bench_file.save("bench.toml", told)
    (one,) = asked("bench.toml")["commissioned"]
    assert (one.level, one.advice) == (Level.WARN, "rotflex bench setup")
    told = replace(told, record=real.record(told.identity(), {"stiffness": 1.6})).with_signs(link_sign=1)
    bench_file.save("bench.toml", told)
    (one,) = asked("bench.toml")["commissioned"]
    assert one.level is Level.WARN and "link_sign was -1 and is 1" in one.message


def test_a_bench_that_was_commissioned_says_when_and_how_it_is_wired(installed):
    installed()
    told = BenchFile(SIMULATOR, parts={"cable_gain": 3}, wiring={"motor_sign": -1})
    told = replace(told, record=real.record(told.identity(), {"stiffness": 1.6}))
    bench_file.save("bench.toml", told)
    found = asked("bench.toml")
    assert found["commissioned"][0].message == f"On {told.record['date']}, as it is wired now."
    assert found["limits"][0].message == "10 V, theta ±180 deg, alpha ±30 deg, 25 rad/s, 120 s a run."
    assert "amplifier VoltPAQ-X1, cable_gain 3, motor_sign -1, servo_sign 1, link_sign -1." in found["bench"][0].message


@pytest.mark.parametrize(
    ("uri", "what", "said"),
    [
        ("nowhere.toml", "address", "nowhere.toml"),
        ("virtul", "address", "'virtul'"),
        ("replay:nowhere.mat", "address", "nowhere.mat"),
        ("quanser:q2_usb/7", "board", "(error -1073)"),
    ],
)
def test_what_is_not_there_is_a_fault(installed, uri, what, said):
    installed()
    (one,) = asked(uri, code=1)[what]
    assert one.level is Level.FAIL and said in one.message and one.advice


def test_a_package_that_is_missing_is_a_fault_and_the_board_is_not_tried(monkeypatch):
    monkeypatch.setitem(sys.modules, "quanser.hardware", None)
    found = asked("quanser:q2_usb/0", code=1)
    assert found["software"][0].level is Level.FAIL and "Quanser SDK" in found["software"][0].message
    assert "board" not in found and "commissioned" in found


def test_one_thing_that_fails_does_not_keep_the_others_from_being_looked_at(installed):
    class NoEncoders(Watched):
        def read_encoder(self, channels, num_channels, buffer) -> None:
            raise HILError("The counters do not answer.")

    installed(lambda: NoEncoders(PARAMETERS))
    found = asked(SIMULATOR, code=1)
    assert found["encoders"][0].level is Level.FAIL and "The counters do not answer" in found["encoders"][0].message
    assert found["watchdog's time"][0].level is Level.OK


def test_samples_that_end_in_the_middle_leave_no_recording_behind(installed, settings):
    class Failing(Watched):
        reads = 0

        def task_read_encoder(self, *arguments):
            self.reads += 1
            if self.reads == 100:
                raise HILError("the board refused")
            return super().task_read_encoder(*arguments)

    installed(lambda: Failing(PARAMETERS))
    found = asked(SIMULATOR, code=1)
    assert any("the board refused" in one.message for looked in found.values() for one in looked)
    assert not settings.exists()


def watchdog(kind, **verbs):
    """A kind of board with other verbs of the watchdog."""
    return type(f"Other{kind.__name__}", (kind,), verbs)


def write_all_the_same(board, channels, num_channels, buffer):
    if board._watchdog.expired:
        board.watchdog_clear()
    Watched.write_analog(board, channels, num_channels, buffer)


DEAF = watchdog(Watched, watchdog_start=lambda board, timeout: VirtualBoard.watchdog_start(board, 1e9))
HASTY = watchdog(Watched, watchdog_start=lambda board, timeout: VirtualBoard.watchdog_start(board, timeout / 100))
OPEN = watchdog(Watched, write_analog=write_all_the_same)
STUCK = watchdog(Joined, watchdog_set_analog_expiration_state=lambda *_: None)  # leaves the outputs as they are


LOOPED = BenchFile("usual:board", wiring={"loopback_output": 1, "loopback_input": 1})


def watchdog_of(board: VirtualBoard, told: BenchFile = LOOPED) -> list[Finding]:
    with real.bench("test", lambda: board, Setup(simulated=True)) as bench:
        found = list(bench_doctor._watchdog(bench, told, 0.2))
    assert board.terminals.commanded == [0.0, 0.0]
    return found


@pytest.mark.parametrize(
    ("kind", "level", "said"),
    [
        (DEAF, Level.FAIL, "Left alone for 0.4 s it has not expired."),
        (HASTY, Level.FAIL, "It expired though it was reloaded after 0.02 s; its time-out is 0.2 s."),
        (OPEN, Level.WARN, "; but a voltage is taken all the same before it is cleared."),
    ],
    ids=["deaf", "hasty", "open"],
)
def test_a_watchdog_that_does_not_do_what_it_is_for(kind, level, said):
    (one,) = [one for one in watchdog_of(kind(PARAMETERS), BenchFile("usual:board")) if one.level is level][-1:]
    assert one.level is level and one.message.endswith(said) and one.advice


def test_where_a_cable_joins_an_output_and_an_input_it_is_seen_that_the_watchdog_takes_a_voltage_away():
    board = Joined(PARAMETERS)
    assert watchdog_of(board)[0] == Finding("watchdog", Level.OK, "Of 2 V on the loopback's output it left 0.00 V.")
    assert board.largest == [0.0, 2.0]
    one = watchdog_of(STUCK(PARAMETERS))[0]
    assert one.level is Level.FAIL and one.message == "Of 2 V on the loopback's output it left 2.00 V."


def test_the_loopback_is_looked_at_where_bench_toml_names_it(installed):
    cards = installed(lambda: Joined(PARAMETERS))
    bench_file.save("bench.toml", BenchFile(SIMULATOR, wiring=dict(LOOPED.wiring)))
    assert asked("bench.toml")["loopback"][0].message == "what is written comes in, within 0.1 V."
    assert cards[0]._inner.largest == [0.0, 2.0]


def test_the_loopback_is_left_at_0_V():
    board = Joined(PARAMETERS)
    with real.bench("test", lambda: board, Setup(simulated=True)) as bench:
        steps.check_loopback(bench, LOOPED)
        assert board.terminals.commanded == [0.0, 0.0]


def test_a_pause_of_the_computer_is_told_from_a_watchdog_in_haste():
    one = bench_doctor._expired_early("watchdog", 0.31)
    assert one.level is Level.WARN and one.message.endswith("This computer had paused meanwhile.")


@pytest.mark.parametrize(
    ("late", "missed", "period", "sample_time", "level"),
    [
        (0, 0, 0.002, 0.002, Level.OK),
        (1, 0, 0.002, 0.002, Level.WARN),
        (10, 6, 0.002, 0.002, Level.FAIL),
        (0, 0, 0.0021, 0.002, Level.FAIL),
        (0, 500, 0.001, 0.001, Level.WARN),
    ],
)
def test_what_a_report_on_samples_means(late, missed, period, sample_time, level):
    percentiles = {"p50": period, "p99": 1.5 * period, "max": 3 * period}
    timing = {"clock": "hardware", "late": late, "missed": missed, "period": percentiles, "drift": -0.002}
    one = bench_doctor.judge_samples("samples", timing, sample_time, 1500)
    assert one.level is level and bool(one.advice) == (level is not Level.OK)
    assert f"of 1500 samples {late} were late and {missed} missed." in one.message
    assert "0.200% faster" in one.message
    assert (" (The course samples at 500 Hz.)" in one.message) == (sample_time < 0.002 and level is Level.WARN)


def test_counts_are_those_of_the_channels_that_bench_toml_names(installed):
    class Swapped(Watched):
        def read_encoder(self, channels, num_channels, buffer) -> None:
            buffer[:num_channels] = np.where(channels[:num_channels] == 0, 17, -4)

    installed(lambda: Swapped(PARAMETERS))
    bench_file.save("bench.toml", BenchFile(SIMULATOR, wiring={"servo_encoder": 1, "link_encoder": 0}))
    said = asked("bench.toml")["encoders"][0].message
    assert said == "Servo (encoder 1) at -4 counts, link (encoder 0) at 17."
