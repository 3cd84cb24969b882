"""The control loop: once a sample, recorded as it was, and 0 V in the end."""

from __future__ import annotations

import errno
import json
import subprocess
import sys

import numpy as np
import pytest

from rotflex import __version__, files, hil
from rotflex.config import srv02
from rotflex.errors import BenchError, DesignError, RecordingError
from rotflex.hil.bench import Bench, Connection, Recorder, Safety
from rotflex.hil.controllers import OpenLoop, StateFeedback
from rotflex.hil.loop import run
from rotflex.hil.recorder import Stored, recover
from rotflex.hil.student_benches import preset
from rotflex.hil.virtual import VirtualBoard
from rotflex.recording import Recording
from rotflex.signals import smooth_square_wave, time_axis
from rotflex.units import DEG

GAIN = [18.24, -17.15, 1.59, 0.63]


def a_bench(folder, **safety):
    """A bench of a virtual one, which keeps samples while they come."""
    spec = preset("real_bench")
    connection = Connection(lambda: VirtualBoard(spec.parameters), srv02())
    return Bench(connection, srv02(), spec.joint, {"clock": "simulated"}, Safety(**safety), Recorder(folder))


def test_arrays_in_the_metadata_are_kept_as_lists_on_each_bench(tmp_path):
    metadata = {"K": np.array(GAIN), "offset": np.float64(0.5), "experiment": "mine"}
    for bench in (a_bench(tmp_path / "unfinished"), hil.open()):
        with bench:
            made = run(bench, OpenLoop(), np.zeros(10), metadata=metadata, progress=False)
        again = Recording.load(made.save(tmp_path / "made.mat"))
        assert (again.metadata["K"], again.metadata["offset"]) == (GAIN, 0.5)


class Closing(OpenLoop):
    """Made of an open loop, and none."""

    def __call__(self, reference: float, theta: float, alpha: float) -> float:
        return reference - 5.0 * theta


def test_a_class_made_of_the_open_loop_closes_none_on_a_bench_that_was_not_commissioned(tmp_path):
    with a_bench(tmp_path, commissioned=lambda: "It was not commissioned.") as bench:
        assert len(run(bench, OpenLoop(), np.zeros(10), progress=False)) == 10
        with pytest.raises(BenchError, match="It was not commissioned"):
            run(bench, Closing(), np.zeros(10), progress=False)


class Scripted:
    """A controller that notes what it is asked, and may fail at a sample."""

    def __init__(self, voltage: float = 1.0, fail_at: int | None = None, failure: type[BaseException] = ValueError):
        self.voltage, self.fail_at, self.failure = voltage, fail_at, failure
        self.resets = 0
        self.asked: list[tuple[float, float, float]] = []

    def reset(self) -> None:
        self.resets += 1

    def __call__(self, reference: float, theta: float, alpha: float) -> float:
        if len(self.asked) == self.fail_at:
            raise self.failure("scripted")
        self.asked.append((reference, theta, alpha))
        return self.voltage


@pytest.fixture
def bench():
    with hil.open("virtual:?preset=workbook") as opened:
        yield opened


def test_each_sample_is_read_decided_and_written(bench):
    controller = Scripted(voltage=25.0)
    reference = np.linspace(0.0, 1.0, 20)
    recording = run(bench, controller, reference, progress=False)
    assert controller.resets == 1
    asked = np.array(controller.asked)
    np.testing.assert_allclose(asked[:, 0], reference, rtol=0, atol=1e-9)
    np.testing.assert_array_equal(asked[:, 1], recording["theta"])
    np.testing.assert_array_equal(asked[:, 2], recording["alpha"])
    assert set(recording["vm"]) == {10.0}  # what was set, not what was asked for


def test_the_recording_says_where_it_comes_from(bench):
    described = run(bench, OpenLoop(), np.zeros(5), metadata={"experiment": "none"}, progress=False).metadata
    assert described["source"] == "virtual bench"
    assert described["bench"] == bench.identity
    assert described["sample_time"] == 0.002
    assert described["software"] == f"rotflex {__version__}"
    assert described["experiment"] == "none"
    json.dumps(described, allow_nan=False)


def test_a_reference_is_a_vector_of_numbers_and_a_bench_must_be_open(bench):
    controller = Scripted()
    for reference in (1.0, [1.0], [[1.0, 2.0]], [0.0, np.nan], [0.0, np.inf]):
        with pytest.raises(BenchError, match="reference"):
            run(bench, controller, reference, progress=False)
    assert controller.resets == 0
    with pytest.raises(BenchError, match="not open"):
        run(hil.open("virtual"), controller, np.zeros(10), progress=False)


def test_a_real_bench_moves_as_its_log_says(real_log):
    """A log's reference, followed on the virtual bench fitted to it, under the gain of that log."""
    with hil.open("virtual:?preset=real_bench") as bench:
        controller = StateFeedback([13.0384, -17.2586, 1.3198, -0.0461])
        replayed = run(bench, controller, real_log["theta_ref"], progress=False)
    for name, limit in (("theta", 0.2), ("alpha", 0.16)):
        assert np.sqrt(np.mean((replayed.degrees(name) - real_log.degrees(name)) ** 2)) <= limit, name
    assert np.abs(replayed["vm"]).max() == pytest.approx(np.abs(real_log["vm"]).max(), rel=0.1)


def test_the_preset_of_a_real_bench_rests_where_that_bench_does():
    """On two of its logs: how far off the servo stands 1.9 s after a turn to -30 deg, and at which voltage."""
    reference = smooth_square_wave(time_axis(4.2, 0.002), 0.25, 30 * DEG, 100.0)  # the turn is at 2 s
    for gain, off, volts in (
        # Of the log's -0.18 V, 0.05 are of a deflection of 0.16 deg at which that link rests; the virtual one's is 0.
        ([13.0384, -17.2586, 1.3198, -0.0461], 0.56, -0.13),
        ([4.74, 0.0, 0.2133, 0.0], 2.35, -0.2),
    ):
        with hil.open("virtual:?preset=real_bench") as bench:
            recording = run(bench, StateFeedback(gain), reference, progress=False)
        rest = (recording.time > 3.7) & (recording.time < 3.95)
        assert np.mean(recording.degrees("theta")[rest]) + 30 == pytest.approx(off, abs=0.15)
        assert np.mean(recording["vm"][rest]) == pytest.approx(volts, abs=0.05)


@pytest.mark.parametrize("answer", [None, [1.0, 2.0], "fast", 1j, True, np.bool_(True), "1.0"])
def test_a_controller_that_returns_no_voltage_is_told_and_the_motor_is_at_0_V(answer):
    with hil.open("virtual:?preset=workbook") as bench:
        with pytest.raises(DesignError, match="returned"):
            run(bench, lambda reference, theta, alpha: 1.0 if theta == 0 else answer, np.ones(500), progress=False)
        assert bench.board.terminals.commanded[0] == 0.0
        with pytest.raises(DesignError, match="a function"):
            run(bench, [1.0, 2.0, 3.0, 4.0], np.ones(500), progress=False)


#: A program that samples, and never comes to an end.
PROGRAM = """
import sys, time
from pathlib import Path
from rotflex.hil.recorder import Stored
stored = Stored(1000, Path(sys.argv[1]), {"sample_time": 0.002, "experiment": "tracking"})
for sample in range(700):
    stored.signals[:3, sample] = 0.001 * sample, -0.001 * sample, 1.0
print("sampled", flush=True)
time.sleep(600)
"""


def test_what_a_killed_program_recorded_is_saved_when_a_bench_is_opened_next_and_not_while_it_is_alive(
    tmp_path, capsys
):
    program = subprocess.Popen([sys.executable, "-c", PROGRAM, str(tmp_path)], stdout=subprocess.PIPE, text=True)
    try:
        assert program.stdout is not None and program.stdout.readline() == "sampled\n"
        recover(tmp_path)
        assert sorted(path.suffix for path in tmp_path.iterdir()) == [".json", ".npy"]
    finally:
        program.kill()
        program.communicate()
    recover(tmp_path)
    (path,) = tmp_path.iterdir()
    recording = Recording.load(path)
    assert str(path) in capsys.readouterr().err and "watchdog" in recording.metadata["ended"]
    np.testing.assert_allclose(recording["theta"], 0.001 * np.arange(700), atol=1e-12)


@pytest.mark.skipif(sys.platform == "win32", reason="Windows locks otherwise")
def test_it_is_saved_also_where_only_a_file_that_may_be_written_can_be_locked_as_over_a_network(tmp_path, monkeypatch):
    import fcntl

    def over_a_network(file, operation, lock=fcntl.flock):
        if not file.writable():
            raise OSError(errno.EBADF, "Bad file descriptor")
        lock(file, operation)

    monkeypatch.setattr(fcntl, "flock", over_a_network)
    stored = Stored(1000, tmp_path, {"sample_time": 0.002})
    stored.signals[:, :10] = 1.0
    recover(tmp_path)
    assert not list(tmp_path.glob("*.mat"))
    stored._file.close()
    recover(tmp_path)
    assert list(tmp_path.glob("*.mat"))


ABOUT = '{"source": "bench", "sample_time": 0.002}'


@pytest.mark.parametrize(
    ("samples", "about"),
    [
        (b"", ABOUT),
        (b"\x93NUMPY\x01\x00v\x00{", ABOUT),
        (b"\x80\x04K\x01.", ABOUT),
        *((np.zeros(shape), ABOUT) for shape in ((2, 10), (3,), ())),
        *((np.zeros((3, 10)), about) for about in ("", "[]", "3", "{}", '{"sample_time": []}', '{"sample_time": 0}')),
    ],
)
def test_what_is_not_whole_keeps_nobody_from_a_bench(tmp_path, samples, about):
    with (tmp_path / "0.npy").open("wb") as file:
        file.write(samples) if isinstance(samples, bytes) else np.save(file, samples)
    (tmp_path / "0.json").write_text(about, encoding="utf-8")
    recover(tmp_path)
    assert not list(tmp_path.glob("*.mat"))


def test_where_samples_cannot_be_stored_nothing_moves_and_the_message_says_what_to_do(tmp_path):
    (tmp_path / "file").write_text("a file")
    for folder, metadata, named in ((tmp_path / "file", {}, "ROTFLEX_CONFIG_DIR"), (tmp_path, {"x": object()}, "JSON")):
        with a_bench(folder) as bench, pytest.raises(RecordingError, match=named):
            bench.on_sample = lambda *_sample: pytest.fail("it moved")
            run(bench, OpenLoop(), np.zeros(10), metadata=metadata, progress=False)


@pytest.mark.parametrize("ending", [".json", ".npy"])
def test_on_a_full_disk_nothing_moves_and_nothing_is_left(tmp_path, monkeypatch, ending):
    def full(path, content, write=files.write):
        if path.suffix == ending:
            raise OSError(errno.ENOSPC, "No space left on device")
        return write(path, content)

    monkeypatch.setattr(files, "write", full)
    with a_bench(tmp_path) as bench, pytest.raises(RecordingError, match="No space left on device"):
        bench.on_sample = lambda *_sample: pytest.fail("it moved")
        run(bench, OpenLoop(), np.ones(50), progress=False)
    assert not list(tmp_path.iterdir())


def test_the_file_is_whole_before_the_motor_moves_and_what_never_began_is_no_recording(tmp_path):
    stored = Stored(6001, tmp_path, {"sample_time": 0.002})
    (path,) = tmp_path.glob("*.npy")
    assert np.isnan(np.load(path)).all() and path.stat().st_blocks * 512 >= 4 * 6001 * 8
    stored._file.close()  # the program ends here
    recover(tmp_path)
    assert not list(tmp_path.iterdir())
