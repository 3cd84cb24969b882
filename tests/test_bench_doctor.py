"""The checks that begin a commissioning: what `rotflex doctor --bench` says of each bench, and what ends a set-up."""

from __future__ import annotations

import json
from dataclasses import replace

import miswired
import numpy as np
import pytest
import quanser_double
from quanser_double import VARIANTS
from typer.testing import CliRunner

from rotflex import experiments, hil
from rotflex.cli import app
from rotflex.commissioning import checks, commission
from rotflex.commissioning.checks import Diagnosis, Level
from rotflex.errors import BenchError, HILError
from rotflex.hil import bench_file, real
from rotflex.hil.bench_file import BenchFile
from rotflex.hil.real import Setup
from rotflex.hil.student_benches import preset
from rotflex.hil.virtual import VirtualBoard, WallClock

pytestmark = pytest.mark.usefixtures("settings")

SIMULATOR = "quanser:q2_usb/0@tcpip://localhost:18000?nagle='off'"
VIRTUAL = "virtual:?preset=real_bench"
PARAMETERS = preset("real_bench").parameters
#: What is looked at, in this order, where nothing fails.
ALL = ["software", "board", "encoders", "samples at 500 Hz", "watchdog"]


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


def asked(uri: str, code: int = 0) -> dict[str, list[Diagnosis]]:
    """The findings of `rotflex doctor --bench`, by what was looked at."""
    done = CliRunner().invoke(app, ["doctor", "--bench", uri, "--json", "--seconds", "0.2"])
    assert done.exit_code == code, done.output
    data = json.loads(done.output)
    assert data["good"] == (code == 0)
    found: dict[str, list[Diagnosis]] = {}
    for one in data["findings"]:
        found.setdefault(one["what"], []).append(Diagnosis(**one | {"level": Level(one["level"])}))
    return found


def test_on_a_virtual_bench_all_is_well():
    found = asked(VIRTUAL)
    assert [one.what for ones in found.values() for one in ones] == ALL
    assert {one.level for ones in found.values() for one in ones} == {Level.OK}
    assert "time waits for the program" in found["samples at 500 Hz"][0].message


@pytest.mark.parametrize("variant", VARIANTS)
def test_the_makers_board_is_looked_at_whatever_its_watchdog_does_and_its_motor_never_driven(installed, variant):
    cards = installed(variant=VARIANTS[variant])
    found = asked(SIMULATOR)
    assert list(found) == [*ALL, "commissioned", "limits"]
    assert "the maker's package" in found["software"][0].message
    assert found["watchdog"][0].level is Level.OK
    narrow = "1 V, theta ±40 deg, alpha ±25 deg, 8 rad/s, 60 s a run, until it is commissioned."
    assert found["limits"][0].message == narrow
    (card,) = cards
    assert card._inner.largest == [0.0, 0.0] and not card.is_valid()


def test_a_board_with_a_clock_of_its_own_is_looked_at_in_its_time(installed):
    cards = installed(lambda: Watched(PARAMETERS, clock=WallClock()))
    found = [one.what for one in checks.examine("quanser:q2_usb/0", seconds=0.2)]
    assert found == [*ALL, "commissioned", "limits"]
    assert cards[0]._inner.largest == [0.0, 0.0]


def test_what_a_board_refuses_is_a_warning_each(installed):
    installed(variant=quanser_double.Variant(zero=True, refuses=quanser_double.OPTIONAL))
    opened, *refused = asked(SIMULATOR)["board"]
    assert opened.level is Level.OK and refused and {one.level for one in refused} == {Level.WARN}


def test_a_bench_that_was_not_commissioned_or_changed_since_is_told_to_be(installed):
    installed()
    told = BenchFile(SIMULATOR)
    bench_file.save("bench.toml", told)
    (one,) = asked("bench.toml")["commissioned"]
    assert (one.level, one.advice) == (Level.WARN, "rotflex bench setup")
    told = replace(told, record=real.record(told.identity(), {"stiffness": 1.6}))
    bench_file.save("bench.toml", told)
    found = asked("bench.toml")
    assert found["commissioned"][0].level is Level.OK and told.record["date"] in found["commissioned"][0].message
    assert found["limits"][0].message == "10 V, theta ±180 deg, alpha ±30 deg, 25 rad/s, 120 s a run."
    bench_file.save("bench.toml", told.with_signs(link_sign=1))
    (one,) = asked("bench.toml")["commissioned"]
    assert one.level is Level.WARN and "link_sign was -1 and is 1" in one.message


def test_a_watchdog_that_was_not_tested_with_the_motor_is_a_warning(installed):
    installed(lambda: Watched(PARAMETERS, clock=WallClock()))
    told = BenchFile("quanser:q2_usb/0")
    bench_file.save("bench.toml", replace(told, record=real.record(told.identity(), {"stiffness": 1.6})))
    (one,) = (one for one in checks.examine("bench.toml", seconds=0.1) if one.what == "commissioned")
    assert (one.level, one.advice) == (Level.WARN, "rotflex bench setup --watchdog bench.toml")


@pytest.mark.parametrize(("uri", "said"), [("nowhere.toml", "nowhere.toml"), ("quanser:q2_usb/7", "(error -1073)")])
def test_what_cannot_be_opened_ends_it_as_any_command_of_a_bench(installed, uri, said):
    installed()
    done = CliRunner().invoke(app, ["doctor", "--bench", uri])
    assert done.exit_code == 2 and said in done.output


def test_a_recording_has_no_board(tmp_path):
    with hil.open(VIRTUAL) as bench:
        experiments.watch(bench, duration=0.5, progress=False).save("run.mat")
    done = CliRunner().invoke(app, ["doctor", "--bench", "replay:run.mat"])
    assert done.exit_code == 2 and "no board" in done.output


class NoCounters(Watched):
    def read_encoder(self, channels, num_channels, buffer) -> None:
        raise HILError("The counters do not answer.")


def test_one_thing_that_fails_does_not_keep_the_others_from_being_looked_at(installed):
    installed(lambda: NoCounters(PARAMETERS))
    found = asked(SIMULATOR, code=1)
    assert found["encoders"][0].level is Level.FAIL and "The counters do not answer" in found["encoders"][0].message
    assert "commissioned" in found


def test_a_board_that_takes_no_0_V_any_more_has_its_amplifier_switched_off(installed):
    class Stuck(Watched):
        sampled = False

        def write_analog(self, channels, num_channels, buffer) -> None:
            if self.sampled:
                raise HILError("The output does not answer.")
            super().write_analog(channels, num_channels, buffer)

        def task_start(self, *arguments) -> None:
            self.sampled = True
            super().task_start(*arguments)

    installed(lambda: Stuck(PARAMETERS))
    done = CliRunner().invoke(app, ["doctor", "--bench", SIMULATOR, "--seconds", "0.2"])
    assert done.exit_code == 2 and "fail samples at 500 Hz" in done.output
    assert "→ Switch the amplifier off." in done.output


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
    assert not (settings / "unfinished").exists()


def watchdog(kind, **verbs):
    """A kind of board with other verbs of the watchdog."""
    return type(f"Other{kind.__name__}", (kind,), verbs)


DEAF = watchdog(Watched, watchdog_start=lambda board, timeout: VirtualBoard.watchdog_start(board, 1e9))
HASTY = watchdog(Watched, watchdog_start=lambda board, timeout: VirtualBoard.watchdog_start(board, timeout / 1000))
LEAVES = watchdog(Joined, watchdog_set_analog_expiration_state=lambda *_: None)  # its outputs as they are
LOOPED = {"loopback_output": 1, "loopback_input": 1}


@pytest.mark.parametrize(
    ("kind", "what", "level", "said"),
    [
        (DEAF, "watchdog", Level.FAIL, "not expired"),
        (HASTY, "samples at 500 Hz", Level.FAIL, "watchdog expired"),
        (LEAVES, "watchdog", Level.FAIL, "left 1.00 V"),
        (Joined, "watchdog", Level.OK, "It expires"),
    ],
    ids=["deaf", "hasty", "leaves its voltage", "as it should be"],
)
def test_a_watchdog_that_does_not_do_what_it_is_for(kind, what, level, said):
    board, told = kind(PARAMETERS), BenchFile("usual:board", wiring=LOOPED if issubclass(kind, Joined) else {})
    with real.make_bench("test", lambda: board, Setup(simulated=True)) as bench:
        found = [one for one in checks.look(bench, told, 0.3) if one.what == what]
    assert [one.level for one in found] == [level] and said in found[0].message
    assert board.terminals.commanded == [0.0, 0.0] and board.largest[0] == 0.0


def test_the_loopback_is_looked_at_where_bench_toml_names_it(installed):
    cards = installed(lambda: Joined(PARAMETERS))
    bench_file.save("bench.toml", BenchFile(SIMULATOR, wiring=LOOPED))
    assert asked("bench.toml")["loopback"][0].level is Level.OK
    assert cards[0]._inner.largest == [0.0, 2.0] and cards[0]._inner.terminals.commanded == [0.0, 0.0]


@pytest.mark.parametrize("kind", [DEAF, HASTY, NoCounters])
def test_set_up_begins_with_the_same_and_ends_where_something_fails(kind):
    laboratory, connected = miswired.Laboratory(1, 1, -1), kind(PARAMETERS)
    person = miswired.Person(laboratory)
    with pytest.raises(BenchError, match="Nothing was recorded"):
        commission(
            BenchFile("usual:board"),
            lambda _told, setup: real.make_bench("test", lambda: connected, replace(setup, simulated=True)),
            person,
        )
    assert any(text.startswith("fail ") for text in person.heard)
    assert not any("COUNTER-CLOCKWISE" in text for text in person.heard) and connected.largest == [0.0, 0.0]


def test_in_the_makers_simulator_a_watchdog_that_does_not_expire_is_a_warning(installed):
    installed(lambda: DEAF(PARAMETERS))
    bench_file.save("bench.toml", BenchFile(SIMULATOR))
    assert asked("bench.toml")["watchdog"][0].level is Level.WARN


@pytest.mark.parametrize(
    ("late", "missed", "period", "level"),
    [
        (0, 0, 0.002, Level.OK),
        (1, 0, 0.002, Level.WARN),
        (10, 6, 0.002, Level.FAIL),
        (0, 0, 0.0021, Level.FAIL),
        (0, 0, 0.0019, Level.FAIL),
    ],
)
def test_what_a_report_on_samples_means(late, missed, period, level):
    percentiles = {"p50": period, "p99": 1.5 * period, "max": 3 * period}
    timing = {"clock": "hardware", "late": late, "missed": missed, "period": percentiles, "drift": -0.002}
    one = checks.judge_samples({"timing": timing}, 1500)
    assert one.level is level and bool(one.advice) == (level is not Level.OK)
    assert (f"{late} came late and {missed} never came" in one.advice) == (late > 0)
    assert "0.200% faster" in one.message


def test_counts_are_those_of_the_channels_that_bench_toml_names(installed):
    class Swapped(Watched):
        def read_encoder(self, channels, num_channels, buffer) -> None:
            buffer[:num_channels] = np.where(channels[:num_channels] == 0, 17, -4)

    installed(lambda: Swapped(PARAMETERS))
    bench_file.save("bench.toml", BenchFile(SIMULATOR, wiring={"servo_encoder": 1, "link_encoder": 0}))
    said = asked("bench.toml")["encoders"][0].message
    assert said == "Servo (encoder 1) at -4 counts, link (encoder 0) at 17."
