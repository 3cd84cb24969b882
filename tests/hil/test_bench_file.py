"""A laboratory's bench.toml: what may stand in it, what is said of what may not, and that a record is of one wiring."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any
from unittest.mock import Mock

import pytest
import quanser_double

from rotflex import experiments, hil
from rotflex.errors import BenchError, ConfigurationError
from rotflex.hil import bench_file, real
from rotflex.hil.bench_file import BenchFile
from rotflex.hil.student_benches import preset
from rotflex.hil.virtual import VirtualBoard

SIMULATOR = "quanser:q2_usb/0@tcpip://localhost:18000?nagle='off'"


@pytest.fixture
def cards(monkeypatch, tmp_path):
    """The maker's package is there; what is kept on disk lands in the test's own folder."""
    monkeypatch.setenv("ROTFLEX_CONFIG_DIR", str(tmp_path))
    return quanser_double.install(monkeypatch, lambda: VirtualBoard(preset("real_bench").parameters))


def written(tmp_path, text: str) -> str:
    path = tmp_path / "bench.toml"
    path.write_text(f"name = 'north'\n{text}", encoding="utf-8")
    return str(path)


def recorded(bench: BenchFile) -> BenchFile:
    return replace(bench, record=real.record(bench.identity(), {"delay": 0.001, "stiffness": 1.6}))


def test_what_is_written_is_read_again(tmp_path):
    bench = BenchFile(
        SIMULATOR,
        parts={"encoder": "EHR", "cable_gain": 3, "tachometer": False},
        wiring={"motor_sign": -1},
        board={"options": 'led="auto"\\\n', "filter": 2.5e5},
        limits={"theta": 90.0},
        name='the "north" one',
    )
    bench_file.save(tmp_path / "bench.toml", recorded(bench))
    assert bench_file.load(tmp_path / "bench.toml") == recorded(bench)


QUANSER = "address = 'quanser:q2_usb/0'\n"
NUMBER = "must be the number of a channel"


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (f"{QUANSER}[wring]", ["no wring; there are name, address, parts, wiring, board, limits, commissioned"]),
        (f"{QUANSER}[wiring]\nmotr = 1", [r"no motr in \[wiring\]; there are motor, servo_encoder"]),
        (f"{QUANSER}[wiring]\nmotor_sign = 2", [r"\[wiring\] motor_sign is 2; it must be 1, -1"]),
        (f"{QUANSER}[wiring]\nmotor = true", [f"motor is True; it {NUMBER}"]),
        (f"{QUANSER}[parts]\ngear = 'low'", [r"\[parts\] gear is 'low'; it must be 'high'"]),
        (f"{QUANSER}[limits]\nalpha = nan", [r"\[limits\] alpha is nan; .* above 2\.5, at most 90"]),
        (
            f"{QUANSER}[wiring]\nlink_encoder = 0\nmotor = 7\nloopback_output = 7",
            ["both 0", "loopback_output is the motor's, 7", "motor is 7; .* 0 to 1", "loopback_output is 7; .* 0 to 1"],
        ),
        (f"{QUANSER}parts = 3\n[wring]\n[limit]", ["no wring", "no limit", "parts is a table"]),
        ("", ["address is ''; it must be that of a board"]),
        (QUANSER[:-2], ["cannot be read"]),
        (
            "address = 3\n[wiring]\nmotor = -4\nmotr = 1\n[limits]\ntheta = 3.14",
            ["address is 3", f"motor is -4; it {NUMBER}", "no motr", r"theta is 3\.14; .* above 5, at most 360"],
        ),
        ("address = 'quanser:q8_usb/0'\n[board]\ninput_range = 2", ["input_range is 2; .* Q8-USB 5, 10 V"]),
    ],
)
def test_all_that_cannot_be_is_told_at_once_with_its_place(tmp_path, text, told):
    path = written(tmp_path, text)
    with pytest.raises(ConfigurationError, match=re.escape(path)) as caught:
        bench_file.load(path)
    lines = str(caught.value).splitlines()
    assert len(lines) == len(told)
    for line, expected in zip(lines, told, strict=True):
        assert re.search(expected, line), line


def test_nothing_is_refused_by_a_number_that_is_not_known(tmp_path):
    for text in (
        "quanser:q2_usb/0'\n[board]\noutput_range = 5",
        "quanser:qpid_e/0'\n[board]\ninput_range = 5",
        "quanser:ni_pcie_6259/0'\n[wiring]\nservo_encoder = 2\nlink_encoder = 3",
        "quanser:another/0'\n[wiring]\nlink_encoder = 31",
    ):
        assert bench_file.load(written(tmp_path, f"address = '{text}")).address.startswith("quanser:")


def test_a_file_without_a_name_or_that_is_not_there_is_refused(tmp_path):
    path = tmp_path / "bench.toml"
    with pytest.raises(ConfigurationError, match="`rotflex bench setup`"):
        hil.open(str(path))
    for name in ("", "name = ''\n", "name = 3\n", "name = ' x'\n", f"name = '{61 * 'n'}'\n"):
        path.write_text(f"{name}address = 'quanser:q2_usb/0'\n", encoding="utf-8")
        with pytest.raises(ConfigurationError, match='name = "north"'):
            hil.open(str(path))
    path.write_text("name = 'north'\naddress = 'quanser:q2_usb/0'\n")
    with pytest.raises(BenchError, match="setup="):
        hil.open(str(path), setup=BenchFile(SIMULATOR).setup())
    path.write_text(f"name = '{60 * 'n'}'\naddress = 'quanser:q2_usb/0'\n", encoding="utf-8")
    assert bench_file.load(path).name == 60 * "n"


def test_a_bench_has_its_files_name_unless_given_and_its_recordings_carry_it(cards, tmp_path):
    path = tmp_path / "south.toml"
    bench_file.save(path, recorded(BenchFile(SIMULATOR)))
    assert bench_file.load(path).name == "south"
    assert bench_file.load(path).setup().commissioned() is None  # a name is no part of what was commissioned
    with hil.open(str(path)) as bench:
        assert experiments.watch(bench, 0.1, progress=False).metadata["bench"]["name"] == "south"


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"wiring": {"link_sign": 1}}, "link_sign was -1 and is 1"),
        ({"parts": {"cable_gain": 3}}, "cable_gain was 1 and is 3"),
        ({"parts": {"arm_position": 2}}, "arm_position was 1 and is 2"),
        ({"board": {"clock": -1}}, "clock was 0 and is -1"),
        ({"address": "quanser:q8_usb/0"}, "address was .*q2_usb.* and is 'quanser:q8_usb/0'"),
    ],
)
def test_a_record_is_of_one_board_and_wiring_and_says_what_has_changed(change, said):
    bench = recorded(BenchFile(SIMULATOR))
    assert replace(bench, limits={"theta": 60.0}).setup().commissioned() is None
    why = replace(bench, **change).setup().commissioned()
    assert re.search(said, why)
    assert "rotflex bench setup" in why


def test_a_board_that_the_last_program_left_driven_and_expired_is_cleared_and_at_0_V_before_it_is_set_up(
    cards, monkeypatch, tmp_path
):
    """Whether a locked board takes a range is documented nowhere: this one takes none."""
    bench_file.save(tmp_path / "bench.toml", BenchFile(SIMULATOR))
    begin, do = quanser_double.HIL.open, quanser_double.HIL._do
    first: dict[str, float] = {}

    def left_behind(card: Any, *where: Any) -> None:
        begin(card, *where)
        card._inner.terminals.set({0: 3.0})
        card._inner._watchdog.expired = True

    def locked(card: Any, verb: str, *arguments: Any, **more: Any) -> Any:
        if verb.endswith(("ranges", "mode", "options")) and "task" not in verb:
            assert not card._inner.watchdog_is_expired(), verb
            first.setdefault(verb, card._inner.terminals.commanded[0])
        return do(card, verb, *arguments, **more)

    monkeypatch.setattr(quanser_double.HIL, "open", left_behind)
    monkeypatch.setattr(quanser_double.HIL, "_do", locked)
    with hil.open(str(tmp_path / "bench.toml")):
        pass
    assert first == {"set_encoder_quadrature_mode": 0.0, "set_analog_output_ranges": 0.0}


def test_a_voltage_beyond_the_outputs_range_is_recorded_as_what_it_is_cut_to(cards, tmp_path):
    narrow = BenchFile(SIMULATOR, board={"output_range": 5.0})
    path = tmp_path / "bench.toml"
    bench_file.save(path, recorded(narrow))
    with hil.open(str(path)) as bench:
        bench.start(0.002)
        bench.read()
        assert bench.write(8.0) == 5.0
        assert quanser_double.output(cards[0]) == 5.0


def test_a_board_that_is_not_known_is_told_what_is_not_as_usual():
    bench = Mock()
    bench.board.serial_number.return_value = ""
    ranges = bench.board.set_analog_output_ranges, bench.board.set_analog_input_ranges
    usual = BenchFile("quanser:q9/0")
    usual.setup().prepare(bench)
    assert not any(verb.called for verb in (bench.ask, *ranges))
    other = replace(
        usual, board={"output_range": 5.0, "input_range": 2.0}, wiring={"loopback_output": 1, "loopback_input": 3}
    )
    other.setup().prepare(bench)
    assert [verb.call_args.args[-1][0] for verb in ranges] == [5.0, 2.0] and not bench.ask.called


@pytest.mark.parametrize("record", [{"version": 99, "of": {}}, {"version": 1, "of": 3}, {"date": "today"}])
def test_a_record_that_cannot_be_read_is_none(record):
    assert "cannot be read" in BenchFile(SIMULATOR, record=record).setup().commissioned()


@pytest.mark.parametrize(("gain", "volts"), [(1, 2.5), (3, 7.5), (5, 10.0)])
def test_the_motor_gets_what_the_outputs_range_and_the_cables_gain_allow(gain, volts):
    told = BenchFile("quanser:another/0", parts={"cable_gain": gain}, board={"output_range": 2.5})
    assert told.setup().limits.voltage == volts


def test_before_its_commissioning_a_bench_keeps_its_own_limits_where_they_are_narrower():
    allowed = BenchFile(SIMULATOR, limits={"voltage": 0.5, "rate": 50.0, "duration": 30.0}).setup().allowed()
    assert (allowed.voltage, allowed.rate, allowed.duration) == (0.5, real.CAREFUL.rate, 30.0)
