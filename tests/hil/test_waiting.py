"""Recordings that a killed program left behind: listed, noted once, and written out with nothing lost."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import quanser_double
from typer.testing import CliRunner

from rotflex import hil
from rotflex.cli import app
from rotflex.errors import LimitExceeded, RecordingError
from rotflex.hil import bench_file, real
from rotflex.hil.bench import Limits
from rotflex.hil.bench_file import BenchFile
from rotflex.hil.controllers import OpenLoop
from rotflex.hil.loop import run
from rotflex.hil.real import Setup
from rotflex.hil.student_benches import preset
from rotflex.hil.unfinished import Unfinished, place
from rotflex.hil.virtual import VirtualBoard
from rotflex.recording import Recording

SIMULATOR = "quanser:q2_usb/0@tcpip://localhost:18000?nagle='off'"
#: A program that samples, and never comes to an end.
PROGRAM = """
import sys, time
from pathlib import Path
from rotflex.hil.unfinished import Unfinished
kept = Unfinished(1000, Path(sys.argv[1]), {"sample_time": 0.002, "experiment": "tracking", "bench": {"uri": "here"}})
for sample in range(700):
    kept.signals[:, sample] = 0.001 * sample, -0.001 * sample, 1.0
print("sampled", flush=True)
time.sleep(600)
"""


@pytest.fixture(autouse=True)
def settings(monkeypatch, tmp_path) -> Path:
    monkeypatch.setenv("ROTFLEX_CONFIG_DIR", str(tmp_path / "settings"))
    monkeypatch.chdir(tmp_path)
    return tmp_path / "settings" / "unfinished"


@pytest.fixture
def boards(monkeypatch):
    """The maker's package is there."""
    modules, _opened = quanser_double.package(lambda: VirtualBoard(preset("real_bench").parameters))
    for name, module in modules.items():
        monkeypatch.setitem(sys.modules, name, module)


def unfinished(*words: str, code: int = 0) -> str:
    done = CliRunner().invoke(app, ["bench", "unfinished", *words])
    assert done.exit_code == code, done.output
    return " ".join(done.output.split())


def broken_off(settings) -> None:
    samples = Unfinished(100, settings, {"sample_time": 0.002})
    samples.signals[:, :50] = 1.0
    samples.broken_off("for a test", {})


def test_a_run_that_goes_on_is_not_listed_and_one_that_was_killed_is_noted_once_and_written_out(
    settings, boards, capsys
):
    program = subprocess.Popen([sys.executable, "-c", PROGRAM, str(settings)], stdout=subprocess.PIPE, text=True)
    try:
        assert program.stdout is not None and program.stdout.readline() == "sampled\n"
        assert "No recording waits" in unfinished()
    finally:
        program.kill()
        program.communicate()
    listed = unfinished()
    assert "tracking, 1.4 s, here" in listed and f"1 recording in {settings}" in listed
    for noted in (True, False):
        with hil.open(SIMULATOR):
            assert ("rotflex bench unfinished" in capsys.readouterr().out) is noted
    assert "is in out/tracking-" in unfinished("--out", "out")
    (path,) = Path("out").iterdir()
    recording = Recording.load(path)
    np.testing.assert_allclose(recording["theta"], 0.001 * np.arange(700), atol=1e-12)
    assert "watchdog" in recording.metadata["ended"]
    assert "No recording waits" in unfinished() and not list(settings.iterdir())


def test_a_run_that_is_broken_off_waits_as_well(boards):
    with pytest.raises(LimitExceeded), hil.open(SIMULATOR, setup=Setup(limits=Limits(theta=0.01))) as bench:
        run(bench, OpenLoop(), np.full(500, 0.9), progress=False)
    assert "LimitExceeded" in unfinished()


def test_what_the_command_run_saved_itself_does_not_wait_as_well(boards):
    told = BenchFile(SIMULATOR, limits={"theta": 6.0})
    bench_file.save("bench.toml", replace(told, record=real.record(told.identity(), {"stiffness": 1.6})))
    words = ["bench", "run", "decay", "--bench", "bench.toml", "--duration", "1", "--out", "out.mat"]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 2 and "What was recorded until then is in out.mat" in done.output, done.output
    assert "No recording waits" in unfinished()
    assert "LimitExceeded" in Recording.load("out.mat").metadata["ended"]


def test_where_samples_cannot_be_kept_the_message_says_what_to_do(settings):
    settings.parent.write_text("a file")
    with pytest.raises(RecordingError, match=r"unfinished.*ROTFLEX_CONFIG_DIR"):
        Unfinished(100, place(), {"sample_time": 0.002})


def test_a_place_that_cannot_be_written_loses_nothing(settings):
    broken_off(settings)
    Path("out").write_text("a file")
    assert "out" in unfinished("--out", "out", code=2)
    assert "run, 0.1 s, ? for a test" in unfinished()


@pytest.mark.parametrize("busy", [".npy", ".json", ".lock"])
def test_a_file_that_another_program_has_open_loses_no_run(boards, settings, monkeypatch, busy):
    """As on Windows, where a file cannot be deleted that the system's search has open."""
    really = Path.unlink

    def unlink(path: Path, missing_ok: bool = False) -> None:
        if path.suffix == busy and path.exists():
            raise PermissionError(13, "The process cannot access the file", str(path))
        really(path, missing_ok)

    monkeypatch.setattr(Path, "unlink", unlink)
    with hil.open(SIMULATOR) as bench:
        assert len(run(bench, OpenLoop(), np.full(100, 0.3), progress=False)) == 100
    assert bench.kept is None


SAYS = '{"source": "bench", "bench": {"uri": "here"}, "sample_time": 0.002}'
#: What a killed program, or a full disk, may leave: its samples and its words.
BROKEN: dict[str, tuple[object, str]] = {
    "no sample and no header": (b"", SAYS),
    "half a header": (b"\x93NUMPY\x01\x00v\x00{", SAYS),
    "no samples' file at all": (b"\x80\x04K\x01.", SAYS),
    "samples of another shape": (np.zeros((2, 10)), SAYS),
    "a single number": (np.zeros(()), SAYS),
    "words that are none": (np.zeros((3, 10)), ""),
    "words that are a list": (np.zeros((3, 10)), "[]"),
    "words that are a number": (np.zeros((3, 10)), "3"),
    "words without a sample time": (np.zeros((3, 10)), "{}"),
    "words whose sample time is none": (np.zeros((3, 10)), '{"sample_time": []}'),
    "words whose sample time is 0": (np.zeros((3, 10)), '{"sample_time": 0}'),
}


@pytest.mark.parametrize("broken", BROKEN)
def test_a_file_that_is_not_whole_keeps_nobody_from_a_bench_nor_hides_the_others(boards, settings, capsys, broken):
    samples, words = BROKEN[broken]
    broken_off(settings)
    with (settings / "0.npy").open("wb") as file:
        file.write(samples) if isinstance(samples, bytes) else np.save(file, samples)
    (settings / "0.json").write_text(words, encoding="utf-8")
    with hil.open(SIMULATOR):
        assert "1 recording" in capsys.readouterr().out
    assert "run, 0.1 s, ? for a test 1 recording in" in unfinished()
