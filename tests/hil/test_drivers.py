"""Boards of other packages: found by an entry point, and described by their package."""

from __future__ import annotations

import sys

import pytest

from rotflex import hil
from rotflex.commissioning.checks import examine
from rotflex.errors import BenchError, ConfigurationError
from rotflex.hil import bench_file, drivers, quanser
from rotflex.hil.bench_file import BenchFile

DRIVER = """
from rotflex.hil import real
from rotflex.hil.real import BoardKind, choice
from rotflex.hil.student_benches import preset
from rotflex.hil.virtual import VirtualBoard

def bench(uri, setup):
    return real.make_bench(uri, lambda: VirtualBoard(preset("real_bench").parameters), setup or real.Setup())

def kind(address):
    own = {"parts": {"cable_gain": choice(3, 3)}, "board": {"lamp": choice("off", "off", "on")}}
    return BoardKind("made board", encoders=2, analog_inputs=2, analog_outputs=1, keys=own)

def software():
    return "made 7.1"
"""


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """Install a package with a driver of the scheme ``made``: a module beside the data that pip would write."""

    def install(module: str) -> None:
        about = tmp_path / "made_boards-1.0.dist-info"
        about.mkdir()
        (about / "METADATA").write_text("Metadata-Version: 2.1\nName: made-boards\nVersion: 1.0\n")
        (about / "entry_points.txt").write_text(f"[{drivers.GROUP}]\nmade = made_boards_driver\n")
        (tmp_path / "made_boards_driver.py").write_text(module)
        monkeypatch.syspath_prepend(tmp_path)
        monkeypatch.setenv("ROTFLEX_CONFIG_DIR", str(tmp_path / "settings"))

    yield install
    sys.modules.pop("made_boards_driver", None)


def test_a_package_brings_a_board_and_what_its_file_may_say(installed, tmp_path):
    installed(DRIVER)
    path = tmp_path / "bench.toml"
    path.write_text('name = "made"\naddress = "made:1"\n[board]\nlamp = "on"\n[parts]\nencoder = "EHR"\n')
    told = bench_file.load(path)
    assert (told.board["lamp"], told.parts["cable_gain"], told.identity()["lamp"]) == ("on", 3, "on")
    bench_file.save(path, told)
    assert bench_file.load(path) == told
    with hil.open(str(path)) as bench:
        assert bench.servo.encoder == "EHR" and bench.identity["uri"] == "made:1"
        with pytest.raises(BenchError, match="commissioned"):
            bench.safety.require_commissioned()
    for table, name, value in (("parts", "cable_gain", 1), ("board", "lamp", "dim"), ("wiring", "motor", 1)):
        with pytest.raises(ConfigurationError, match=rf"\[{table}\] {name} is {value!r}"):
            BenchFile("made:1", **{table: {name: value}})
    with pytest.raises(ConfigurationError, match="no lamp"):
        BenchFile("quanser:q2_usb/0", board={"lamp": "on"})
    assert any("made 7.1" in one.message for one in examine("made:1", seconds=0.1))
    with pytest.raises(BenchError, match="takes no servo="):
        hil.open("made:1", servo=bench.servo)


def test_a_package_that_cannot_be_imported_is_named(installed):
    installed("import nothing_of_this_name")
    with pytest.raises(BenchError, match=r"made-boards.*nothing_of_this_name"):
        hil.open("made:1")


def test_an_address_without_a_driver_is_refused_with_the_schemes_that_are_installed(installed):
    installed(DRIVER)
    with pytest.raises(BenchError, match=r"'else:1'.*virtual.*replay.*quanser.*\bmade\b") as caught:
        hil.open("else:1")
    assert ("contrib/serial" in str(caught.value)) is (drivers.find("serial:") is None)
    assert drivers.find("else:1") is None and drivers.find("quanser:q2_usb/0") is quanser
