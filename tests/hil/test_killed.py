"""The program ends in the middle of a run, its board in a process of its own: 0 V, and what was recorded is saved."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import board_process
import numpy as np
import pytest
from board_process import RemoteBoard
from checkout import ROOT
from fault_board import FaultBoard, bench_of
from jupyter_client.manager import KernelManager

from rotflex.hil.controllers import OpenLoop
from rotflex.hil.loop import run
from rotflex.hil.recorder import recover
from rotflex.recording import Recording

HELPER = board_process.__file__
ENVIRONMENT = os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT), str(Path(HELPER).parent)])}
_PATIENCE = 60.0  # s; a busy computer takes its time


def until(true: Callable[[], object], alive: Callable[[], bool] = lambda: True) -> None:
    """Wait for something."""
    end = time.monotonic() + _PATIENCE
    while not true():
        assert time.monotonic() < end and alive()
        time.sleep(0.01)


@pytest.fixture
def board(tmp_path) -> Iterator[RemoteBoard]:
    server = subprocess.Popen([sys.executable, HELPER, "serve", str(tmp_path)], env=ENVIRONMENT)
    try:
        until((tmp_path / "address").exists, lambda: server.poll() is None)
        yield RemoteBoard(tmp_path)
    finally:
        server.kill()
        server.wait()


def assert_at_0_V_and_recorded(board: RemoteBoard, folder: Path, why: str) -> None:
    (recording,) = map(Recording.load, (folder / "unfinished").glob("*.mat"))
    assert why in recording.metadata["ended"]
    assert len(recording) > 500
    assert set(np.abs(recording["vm"][:-1])) == {board_process.VOLTS}
    assert np.abs(recording["theta"]).max() > 0.05
    assert board.voltage() == 0.0


def test_a_program_that_is_killed_leaves_0_V_by_the_watchdog_and_what_it_recorded(board, tmp_path):
    program = subprocess.Popen([sys.executable, HELPER, "drive", str(tmp_path)], env=ENVIRONMENT)
    try:
        until((tmp_path / "moves").exists, lambda: program.poll() is None)
    finally:
        program.kill()
        program.wait()
    assert abs(board.voltage()) == board_process.VOLTS
    board.let_time_pass()
    recover(tmp_path / "unfinished")
    assert_at_0_V_and_recorded(board, tmp_path, "The program ended without a word")


ENDING = [name for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]
on_posix = pytest.mark.skipif(
    sys.platform == "win32", reason="Windows has no such signals: it ends a program without notice"
)


def assert_ended_by(name: str, board: RemoteBoard, folder: Path) -> None:
    """0 V without time for the watchdog, and the reason with what was recorded."""
    assert board.voltage() == 0.0 and not board.is_valid()  # the program closed it
    (recording,) = map(Recording.load, (folder / "unfinished").glob("*.mat"))
    assert name in recording.metadata["ended"]
    assert len(recording) > 400 and np.abs(recording["theta"]).max() > 0.05


@on_posix
@pytest.mark.parametrize("where", ["main", "thread"])
@pytest.mark.parametrize("name", ENDING)
def test_a_program_that_is_told_to_end_sets_0_V_itself_and_ends_by_the_signal(board, tmp_path, name, where):
    ignored = signal.signal(getattr(signal, name), signal.SIG_DFL)  # under nohup, which a program inherits
    try:
        program = subprocess.Popen([sys.executable, HELPER, where, str(tmp_path)], env=ENVIRONMENT)
    finally:
        signal.signal(getattr(signal, name), ignored)
    try:
        until((tmp_path / "moves").exists, lambda: program.poll() is None)
        program.send_signal(getattr(signal, name))
        assert program.wait(_PATIENCE) == -getattr(signal, name)
    finally:
        program.kill()
        program.wait()
    assert_ended_by(name, board, tmp_path)


@on_posix
def test_the_handler_of_before_is_there_again_and_hears_of_it_and_nohup_holds():
    heard: list[int] = []
    usual = signal.signal(signal.SIGTERM, handler := lambda number, _frame: heard.append(number))
    ignored = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    board = FaultBoard()
    try:
        with bench_of(board) as bench:
            bench.on_sample = lambda measured, _voltage: signal.raise_signal(signal.SIGHUP)
            assert len(run(bench, OpenLoop(), np.full(50, 1.0), progress=False)) == 50
            signal.raise_signal(signal.SIGTERM)  # between two runs: at once
            assert (heard, board.inner.is_valid()) == ([signal.SIGTERM], False)
            assert signal.getsignal(signal.SIGTERM) is handler
    finally:
        signal.signal(signal.SIGTERM, usual)
        signal.signal(signal.SIGHUP, ignored)


@pytest.fixture
def kernel(tmp_path) -> Iterator[KernelManager]:
    manager = KernelManager()
    manager.start_kernel(env=ENVIRONMENT, cwd=str(tmp_path))
    try:
        yield manager
    finally:
        manager.shutdown_kernel(now=True)


def run_cell(kernel: KernelManager, folder: Path, clock: str = "simulated") -> None:
    client = kernel.blocking_client()
    client.start_channels()
    client.wait_for_ready(timeout=_PATIENCE)
    client.execute(f"import pathlib, board_process; board_process.drive(pathlib.Path({str(folder)!r}), {clock!r})")
    until((folder / "moves").exists, kernel.is_alive)
    client.stop_channels()


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="on Windows a kernel is interrupted by an event of its own")
def test_a_kernel_that_is_interrupted_sets_0_V_itself(board, kernel, tmp_path):
    run_cell(kernel, tmp_path)
    kernel.signal_kernel(signal.SIGINT)
    until(lambda: board.voltage() == 0.0)
    until(lambda: list((tmp_path / "unfinished").glob("*.mat")))
    assert_at_0_V_and_recorded(board, tmp_path, "KeyboardInterrupt")


@on_posix
@pytest.mark.slow
def test_a_kernel_that_is_stopped_sets_0_V_itself_and_ends(board, kernel, tmp_path):
    run_cell(kernel, tmp_path, "wall")
    kernel.signal_kernel(signal.SIGTERM)
    until(lambda: not kernel.is_alive())
    assert_ended_by("SIGTERM", board, tmp_path)
