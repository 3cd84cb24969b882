"""Where theta is zero on a real bench: kept while the board has power, asked for after that, and what limits it."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import powered
import pytest
import quanser_double
from checkout import ROOT
from powered import Powered
from typer.testing import CliRunner

from rotflex import commissioning, experiments
from rotflex.cli import app
from rotflex.errors import BenchError, LimitExceeded
from rotflex.hil import bench_file, real
from rotflex.hil.bench import Bench, Wiring
from rotflex.hil.bench_file import BenchFile
from rotflex.hil.controllers import OpenLoop
from rotflex.hil.loop import run
from rotflex.units import DEG

pytestmark = pytest.mark.usefixtures("settings")


@pytest.fixture
def board() -> Powered:
    return Powered()


def marked(board: Powered) -> Powered:
    """A board that was opened, and at which the mark was set."""
    with board.bench() as bench:
        bench.set_zero()
    return board


def stopped_at(board: Powered, bench: Bench, volts: float = 2.0) -> float:
    """Where the arm is, deg from the mark, when a constant voltage has driven it to its limit."""
    with pytest.raises(LimitExceeded, match=r"18[0-2].* deg at"):
        run(bench, OpenLoop(), np.full(3000, volts), progress=False)
    assert board.board.terminals.commanded[0] == 0.0
    return float(board.plant.state.theta / DEG)


def test_a_run_that_begins_at_170_deg_ends_at_180_and_its_recording_begins_at_0(board):
    marked(board)
    with board.bench() as bench:
        board.turn(170)
        assert 180 <= stopped_at(board, bench) < 182
        assert bench.recorder.unfinished["theta"][0] == 0.0
        assert 10 < bench.recorder.unfinished["theta"].max() / DEG < 12
        board.turn(-20)
        assert -182 < stopped_at(board, bench, -2.0) <= -180


def test_an_arm_that_stands_at_200_deg_is_not_driven(board):
    marked(board)
    with board.bench() as bench:
        board.turn(200)
        with pytest.raises(BenchError, match="stands at 200 deg from its mark") as refused:
            run(bench, OpenLoop(), np.full(3000, 2.0), progress=False)
        assert refused.value.outcome is None and bench.recorder.unfinished is None
        bench.start(0.002)
        bench.read()
        with pytest.raises(BenchError, match="stands at 200 deg from its mark") as refused:
            bench.write(2.0)
        assert refused.value.outcome.at_zero and board.plant.state.theta == 200 * DEG


@pytest.mark.parametrize("servo_sign", [1, -1])
def test_the_zero_is_that_of_the_first_of_several_blocks(board, servo_sign):
    marked(board)
    for _block in range(2):
        with board.bench() as bench:
            board.turn(60)
    with board.bench(wiring=Wiring(servo_sign=servo_sign)) as bench:
        assert 180 <= stopped_at(board, bench) < 182


def test_the_zero_is_kept_from_one_program_to_the_next(board):
    path = os.pathsep.join([str(ROOT), str(Path(powered.__file__).parent)])
    subprocess.run([sys.executable, powered.__file__, "100"], env=os.environ | {"PYTHONPATH": path}, check=True)
    board.turn(100)
    with board.bench() as bench:
        assert 180 <= stopped_at(board, bench) < 182


@pytest.mark.parametrize("what", ["power-off", "turned by hand", "killed while it was open", "never marked"])
def test_where_the_arm_may_stand_anywhere_nothing_moves_before_it_is_put_at_its_mark(board, settings, what):
    if what != "never marked":
        marked(board)
    if what == "power-off":
        with board.bench():
            board.turn(30)
        board.off()
    elif what == "turned by hand":
        board.turn(30)
    elif what == "killed while it was open":
        board.bench().__enter__()
    with board.bench() as bench:
        for drive in (lambda: experiments.sweep(bench, drive="voltage", progress=False), lambda: driven(bench)):
            with pytest.raises(BenchError, match=r"set_zero\(\)"):
                drive()
        assert len(experiments.watch(bench, 1.0, progress=False)) == 501
        assert not list((settings / "unfinished").iterdir())
        board.turn(-30)
        bench.set_zero()
        assert len(experiments.sweep(bench, drive="voltage", duration=2.0, progress=False)) == 1001
    with board.bench() as bench:
        assert not bench.safety.mark_unknown


def driven(bench: Bench) -> None:
    bench.start(0.002)
    bench.read()
    bench.write(0.0)
    bench.write(0.1)


def test_a_bench_that_was_never_commissioned_has_its_zero_where_this_program_opened_it_first(board, settings):
    setup = {"commissioned": real.not_commissioned, "marked": False}
    with board.bench(**setup):
        board.turn(30)
    with board.bench(**setup) as bench:
        with pytest.raises(LimitExceeded, match=r"4[01].* deg at"):
            run(bench, OpenLoop(), np.full(3000, 1.0), progress=False)
        assert 10 < bench.recorder.unfinished["theta"].max() / DEG < 12
    (path,) = (settings / "marks").iterdir()
    path.write_text(path.read_text().replace('"set_by": "', '"set_by": "another'))
    with board.bench(**setup) as bench:
        assert len(run(bench, OpenLoop(), np.full(50, 1.0), progress=False)) == 50
    with board.bench() as bench:  # it was commissioned now: that the arm stood there once is no mark
        assert bench.safety.mark_unknown


@pytest.mark.parametrize("content", ["", "[]", "{}", '{"counts": 0, "zero": null, "set_by": ""}'])
def test_a_file_that_is_not_whole_is_none(board, settings, content):
    marked(board)
    (path,) = (settings / "marks").iterdir()
    path.write_text(content)
    with board.bench() as bench:
        assert bench.safety.mark_unknown


def test_the_commands_ask_whether_the_arm_is_at_its_mark(board, monkeypatch):
    quanser_double.install(monkeypatch, board.connect)
    told = BenchFile("quanser:q2_usb/0")
    tested = real.record(told.identity(), {"stiffness": 1.6}, watchdog={"passed": True})
    bench_file.save("bench.toml", replace(told, record=tested))
    run_it = ["run", "decay", "--bench", "bench.toml", "--duration", "0.2", "--out", "out.mat", "--force"]

    def refused(words, answer):  # on a busy computer a run may end with 1: too many samples came late
        return CliRunner().invoke(app, ["bench", *words], input=f"{answer}\n").exit_code == 2

    assert [refused(run_it, answer) for answer in ("n", "y", "")] == [True, False, False]
    board.off()
    assert [refused(run_it, "n"), refused(["zero"], "y"), refused(run_it, "")] == [True, False, False]


@pytest.mark.parametrize("degrees", [-38, 38])
def test_a_commissioning_drives_the_servo_back_to_its_mark_within_its_limits(board, degrees):
    marked(board)
    with board.bench(limits=real.CAREFUL) as bench:
        board.turn(degrees)
        commissioning.return_to_mark(bench)
    assert abs(board.plant.state.theta) < 5 * DEG
