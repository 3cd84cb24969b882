"""The worker on the stand-in of the maker's board, which lives on when a program dies; and programs that are killed."""

import os
import random
import subprocess
import sys
import time

import card_process
import pytest
from card_process import ADDRESS, Fault, Line
from checkout import ROOT
from rigs import Rig, until
from rotflex_rig.queue import WORKER
from rotflex_rig.web import TOKEN_VARIABLE

from rotflex import experiments
from rotflex.errors import LimitExceeded
from rotflex.hil import bench_file, real
from rotflex.hil.bench_file import BenchFile

HELPERS = os.path.dirname(card_process.__file__)
BEGIN = f"""
import pathlib, sys
sys.path.insert(0, {HELPERS!r})
import card_process
card_process.install(pathlib.Path(sys.argv[1]))
"""
ZERO = f"""{BEGIN}
from rotflex import hil
with hil.open("bench.toml") as bench:
    bench.set_zero()
"""
WORK = f"""{BEGIN}
sys.argv = ["rotflex-rig", "work", sys.argv[2], "bench.toml", "virtual:?preset=real_bench"]
from rotflex_rig.commands import app
app()
"""
STUDENT = """
import sys
from rotflex import experiments, hil
K = (18.24, -17.15, 1.59, 0.63)
with hil.open("rig:" + sys.argv[1]) as bench:
    made = experiments.tracking(bench, K, amplitude=float(sys.argv[2]), duration=6.0, progress=False)
print("RECORDED", made)
"""
AMPLITUDES = (0.2, 0.25, 0.3)  # rad


@pytest.fixture(scope="module")
def card(tmp_path_factory):
    folder = tmp_path_factory.mktemp("card")
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT), HELPERS])}
    process = subprocess.Popen([sys.executable, card_process.__file__, "serve", str(folder)], env=environment)
    try:
        until((folder / "address").exists)
        yield folder
    finally:
        process.kill()
        process.wait()


class Laboratory:
    """The laboratory's computer, with a commissioned bench on the stand-in."""

    def __init__(self, rig, card, folder):
        self.rig, self.card, self.folder = rig, card, folder
        folder.mkdir()
        tested = {"passed": True, "date": "2026-11-01", "found": "it stopped", "refused": []}
        record = real.record(
            BenchFile(ADDRESS).identity(), {"stiffness": 1.6, "serial_number": "1001"}, watchdog=tested
        )
        bench_file.save(folder / "bench.toml", BenchFile(ADDRESS, record=record, name="north"))

    def run(self, program, *arguments):
        words = [sys.executable, "-c", program, str(self.card), *arguments]
        environment = os.environ | {TOKEN_VARIABLE: self.rig.token[WORKER]}
        output = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
        return subprocess.Popen(words, cwd=self.folder, env=environment, **output)

    def zero(self):
        """Put the arm at its mark, as the command `rotflex bench zero` does."""
        said = (program := self.run(ZERO)).communicate(timeout=60)[0]
        assert program.returncode == 0, said

    def work(self):
        self.rig.workers.append(self.run(WORK, self.rig.url))
        return self.rig.workers[-1]


@pytest.fixture
def laboratory(rig, card, tmp_path):
    line = Line(card)
    line.fault(None)
    for _each in range(10):
        line.let_time_pass()
    return Laboratory(rig, card, tmp_path / "laboratory")


def student(rig, amplitude):
    words = [sys.executable, "-c", STUDENT, rig.url, str(amplitude)]
    return subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


def test_a_run_on_the_makers_board_is_recorded_and_0_v_is_left(laboratory, rig, card, monkeypatch):
    laboratory.zero()
    laboratory.work()
    rig.enter(monkeypatch)
    rig.bench()
    said = student(rig, 0.3).communicate(timeout=90)[0]
    assert "RECORDED" in said, said
    assert Line(card).voltage == 0.0


def test_a_runaway_gain_never_reaches_the_motor(laboratory, rig, card, monkeypatch):
    laboratory.zero()
    laboratory.work()
    rig.enter(monkeypatch)
    rig.bench()
    before = Line(card).samples
    with rig.bench() as bench, pytest.raises(LimitExceeded):
        experiments.tracking(bench, (-18, 17, -1.5, -0.6))
    assert (Line(card).samples, Line(card).voltage) == (before, 0.0)


def test_without_the_mark_no_run_is_begun_and_the_worker_says_what_to_do(laboratory, rig, monkeypatch):
    rig.enter(monkeypatch)
    rig.queue.put("ada", b"{}", "tracking", 1.0)
    laboratory.zero()
    for path in (rig.folder.parent / "settings" / "marks").iterdir():
        path.unlink()
    worker = laboratory.work()
    said = worker.communicate(timeout=60)[0]
    assert worker.returncode == 2 and "rotflex bench zero" in said
    assert len(rig.queue.order()) == 1


def test_a_board_that_fails_pauses_the_rig_and_the_run_comes_once_more(laboratory, rig, card, monkeypatch):
    laboratory.zero()
    worker = laboratory.work()
    rig.enter(monkeypatch)
    rig.bench()
    Line(card).fault(Fault(1500, ("task_read_encoder",)))
    program = student(rig, 0.3)
    until(lambda: rig.queue.overview()["paused"])
    assert "task_read_encoder" in rig.queue.overview()["paused"]
    assert Line(card).voltage == 0.0
    Line(card).fault(None)
    rig.queue.pause("")
    assert "RECORDED" in program.communicate(timeout=90)[0]
    assert worker.poll() is None


def test_kills_at_ten_moments_cost_no_run_and_leave_no_voltage(laboratory, rig, card, monkeypatch, tmp_path):
    """Server, worker and clients are killed in turn, and started again; after a worker, the watchdog's time passes."""
    draw, line, rows = random.Random(10), Line(card), []
    rig = laboratory.rig = Rig(tmp_path / "apart", apart=True)
    rig.enter(monkeypatch)
    laboratory.zero()
    port = rig.free_port()
    server, worker = rig.serve_apart(port), laboratory.work()
    try:
        for moment in range(10):
            until(rig.knows_its_bench)
            amplitude = 0.2 + moment / 100
            client = student(rig, amplitude)
            until(lambda one=client: rig.queue.overview()["queue"] or one.poll() is not None)
            if moment % 2:
                until(lambda: line.voltage)  # the motor drives
            else:
                time.sleep(draw.uniform(0.0, 1.5))
            victim = ("server", "worker", "client")[moment % 3]
            at = next((one["state"] for one in rig.queue.overview()["queue"]), "done")
            {"server": server, "worker": worker, "client": client}[victim].kill()
            volts = after = line.voltage
            if victim == "worker":
                line.let_time_pass()
                after = line.voltage
            if victim == "server":
                server.wait()
                server = rig.serve_apart(port)
            elif victim == "worker":
                worker.wait()
                laboratory.zero()
                worker = laboratory.work()
            else:
                client.wait()
                client = student(rig, amplitude)
            said = client.communicate(timeout=120)[0]
            left = line.voltage
            rows.append((moment, victim, at, f"{volts:.2f} V", f"{after:.2f} V", f"{left:.2f} V", "RECORDED" in said))
            assert rows[-1][-1] and left == 0.0 and (after == 0.0 or victim != "worker"), (rows, said)
            assert rig.queue.order() == []
    finally:
        for program in (server, worker):
            program.kill()
            program.wait()
    print("\n".join(map(str, rows)))
    recorded = rig.queue.recorded()
    assert 10 <= len(recorded) <= 10 + sum(row[1] == "client" for row in rows)
