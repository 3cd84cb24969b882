"""The commands of a bench: what they write, and what they say where they cannot."""

from __future__ import annotations

import re
import shutil
import tomllib
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import miswired
import numpy as np
import pytest
import quanser_double
from fault_board import FaultBoard, bench_of
from typer.testing import CliRunner

from rotflex import bench_commands, commissioning, experiments, hil
from rotflex.cli import app
from rotflex.errors import BenchError, LimitExceeded, RecordingError
from rotflex.hil import bench_file, real
from rotflex.hil.student_benches import preset
from rotflex.hil.virtual import VirtualBoard
from rotflex.recording import Recording
from rotflex.unanswered import drift_of
from rotflex.units import DEG

pytestmark = pytest.mark.usefixtures("settings")

SIMULATOR = "quanser:q2_usb/0@tcpip://localhost:18000?nagle='off'"
VIRTUAL = ("--bench", "virtual:?preset=real_bench")
GAIN = "18.24,-17.15,1.59,0.63"


def said(*words: str, code: int = 0) -> str:
    result = CliRunner().invoke(app, ["bench", *words])
    assert result.exit_code == code, result.output
    return re.sub(r"\s+", " ", result.output)


def package(monkeypatch, board) -> None:
    """Install the maker's package, with a board."""
    quanser_double.install(monkeypatch, board)


@pytest.mark.parametrize(
    ("words", "experiment", "feedback"),
    [
        (["sweep"], "sweep", None),
        (["decay"], "free decay", None),
        (["fsf", "--gain", GAIN], "tracking", "full"),
        (["psf", "--gain", f"[{GAIN}]"], "tracking", "partial"),
    ],
)
def test_an_experiment_is_run_and_kept(words, experiment, feedback):
    assert "501 samples are in out.mat" in said("run", *words, *VIRTUAL, "--duration", "1", "--out", "out.mat")
    recording = Recording.load("out.mat")
    assert (recording.metadata["experiment"], recording.metadata.get("feedback")) == (experiment, feedback)
    assert np.ptp(recording["theta"]) > 0


@pytest.mark.parametrize(("lost", "words", "code"), [(20, "few enough", 0), (60, "too many", 1)])
def test_samples_that_never_came_are_told_and_too_many_fail(lost, words, code, monkeypatch):
    board = FaultBoard()
    board.loses[1000] = lost
    monkeypatch.setattr(hil, "open", lambda address: bench_of(board))
    output = said("run", "fsf", "--gain", GAIN, "--duration", "10", "--out", "out.mat", code=code)
    recording = Recording.load("out.mat")
    assert (len(recording), recording.metadata["timing"]["missed"]) == (5001, lost)
    assert words in output and f"2 came late and {lost} never came" in output and "close other programs" in output


@pytest.mark.parametrize(("drift", "said_so"), [(-0.01, "1.000% faster"), (0.001, "")])
def test_a_boards_clock_that_is_off_is_followed_and_said(drift, said_so, monkeypatch):
    board = FaultBoard()
    bench = bench_of(board)
    bench.connection.now = lambda: (1 + drift) * board.time.now()
    monkeypatch.setattr(hil, "open", lambda address: bench)
    output = said("run", "fsf", "--gain", GAIN, "--duration", "5", "--out", "out.mat")
    assert ("The board's clock is" in output) == bool(said_so) and said_so in output
    assert Recording.load("out.mat").metadata["timing"]["missed"] == 0


@pytest.mark.parametrize("timing", [None, "no", {}, {"drift": "0.1"}, {"drift": float("nan")}])
def test_of_a_replay_that_does_not_say_its_clocks_drift_nothing_is_said(timing):
    assert drift_of({"timing": timing}) == 0.0


def test_recordings_in_which_samples_came_late_are_told_and_where_too_many_did_not_fitted():
    recording = Recording.load(recorded("one.mat"))
    for late, code in ((3, 0), (20, 2)):
        timing = {"late": late, "missed": 2}
        Recording(recording.time, recording.channels, {**recording.metadata, "timing": timing}).save("late.mat")
        output = said("fit", "late.mat", "--free", "K_s", "--force", code=code)
        assert f"{late} came late and 2 never came" in output


WRITING = {
    "run": (["run", "sweep", *VIRTUAL, "--duration", "1"], "out.mat"),
    "fit": (["fit", "fsf.mat"], "out.toml"),
}


@pytest.mark.parametrize("command", WRITING)
def test_what_cannot_be_written_or_is_there_is_said_before_anything_is_done(command, monkeypatch, tmp_path):
    words, out = WRITING[command]
    monkeypatch.setattr(hil, "open", lambda *_uri, **_more: pytest.fail("the bench was opened"))
    monkeypatch.setattr(Recording, "load", lambda *_paths: pytest.fail("the recordings were read"))
    ending = "whose name ends in .toml" if command == "fit" else "a recording is saved as .mat or .csv"
    assert ending in said(*words, "--out", "out.txt", code=2)
    assert "name a file in a folder that is there" in said(*words, "--out", f"no/{out}", code=2)
    (tmp_path / out).write_text("mine")
    assert f"{out} is there already: name another --out, or add --force" in said(*words, "--out", out, code=2)
    assert (tmp_path / out).read_text() == "mine"


def commissioned(**limits: float) -> None:
    """A bench.toml of a commissioned bench."""
    told = bench_file.BenchFile(SIMULATOR, limits=limits)
    bench_file.save("bench.toml", replace(told, record=real.record(told.identity(), {"stiffness": 1.6})))


DECAY = ["run", "decay", "--bench", "bench.toml", "--duration", "1", "--out", "out.mat"]


def test_a_run_that_cannot_be_saved_after_all_says_where_it_is(monkeypatch, tmp_path):
    """As on a disk that is full by then."""
    package(monkeypatch, lambda: VirtualBoard(preset("real_bench").parameters))
    commissioned()
    really = Recording.save

    def save(recording: Recording, path: Path) -> Path:
        if path.name == "out.mat":
            raise RecordingError("out.mat cannot be written: No space left on device.")
        return really(recording, path)

    monkeypatch.setattr(Recording, "save", save)
    output = said(*DECAY, code=2)
    (kept,) = (tmp_path / "settings").rglob("*.mat")
    assert "No space left on device. The recording is whole: it is in" in output and kept.name in output
    assert len(Recording.load(kept)) == 501


def test_a_run_that_is_broken_off_is_saved_once_by_the_command_and_aside_in_python(monkeypatch, tmp_path):
    package(monkeypatch, lambda: VirtualBoard(preset("real_bench").parameters))
    commissioned(theta=6.0)
    assert "What was recorded until then is in out.mat" in said(*DECAY, code=2)
    assert Recording.load("out.mat").metadata["ended"].startswith("LimitExceeded")
    assert not list((tmp_path / "settings").rglob("*.mat"))
    with pytest.raises(LimitExceeded) as caught, hil.open("bench.toml") as bench:
        experiments.free_decay(bench, duration=1.0, progress=False)
    (path,) = (tmp_path / "settings" / "unfinished").iterdir()
    assert str(path) in "".join(caught.value.__notes__)
    assert "LimitExceeded" in Recording.load(path).metadata["ended"]


def test_watching_shows_both_angles():
    assert "theta 0.00 deg alpha 0.00 deg" in said("watch", *VIRTUAL, "--duration", "0.5")


def test_a_bench_is_set_up_and_used(monkeypatch):
    laboratory = miswired.Laboratory(-1, 1, 1)
    package(monkeypatch, laboratory)
    monkeypatch.setattr(commissioning, "Terminal", lambda: miswired.Person(laboratory))
    bench_file.save("north.toml", bench_file.BenchFile(SIMULATOR))
    assert "no loop is closed" in said("run", "sweep", "--bench", "north.toml", "--out", "sweep.mat", code=2)
    assert "is there already: give it in place of" in said("setup", SIMULATOR, "--out", "north.toml", code=2)
    assert "Open it as north.toml" in said("setup", "north.toml")
    assert bench_file.load("north.toml").wiring["motor_sign"] == -1
    said("run", "sweep", "--bench", "north.toml", "--duration", "1", "--out", "sweep.mat")
    assert Recording.load("sweep.mat").metadata["bench"]["uri"] == SIMULATOR


def test_the_notebook_that_is_gone_is_refused_with_the_command_that_does_the_same():
    assert "rotflex bench setup" in said("notebook", "--out", "mine.ipynb", code=2)
    assert not Path("mine.ipynb").exists()


def test_a_twin_is_fitted_and_moves_as_its_bench():
    said("run", "fsf", "--gain", GAIN, *VIRTUAL, "--duration", "3", "--out", "fsf.mat")
    output = said("fit", "fsf.mat", "--free", "K_s,J_eq,braking,servo_friction", "--out", "twin.toml")
    assert "omega_n" in output and "There is one recording" in output and "open it as virtual:twin.toml" in output
    assert "doubt" not in output and "doubts" not in tomllib.loads(Path("twin.toml").read_text())["about"]
    said("run", "fsf", "--gain", GAIN, "--bench", "virtual:twin.toml", "--duration", "3", "--out", "twin.mat")
    apart = Recording.load("twin.mat")["theta"] - Recording.load("fsf.mat")["theta"]
    assert np.sqrt(np.mean(apart**2)) < 0.3 * DEG
    identity = hil.open("virtual:twin.toml?run=2").identity
    assert (identity["run"], identity["uri"]) == (2, "virtual:twin.toml?run=2")
    with pytest.raises(BenchError, match="run must be a whole number"):
        hil.open("virtual:twin.toml?run=x")


def test_a_fit_that_is_doubted_says_so_in_the_terminal_and_in_the_twins_file():
    log = Recording.load(recorded("log.mat"))
    Recording.of(log.time, theta=log["theta"], alpha=-log["alpha"], vm=log["vm"]).save("swapped.csv")
    words = "doubted: what is left of swapped.csv is theta"
    assert words in said("fit", "swapped.csv", "--free", "K_s", "--out", "a.toml")
    assert "swapped.csv" in tomllib.loads(Path("a.toml").read_text())["about"]["doubts"][0]
    assert hil.open("virtual:a.toml").identity["arm_position"] == 1


def test_the_links_inertia_can_be_given_and_the_stiffness_goes_with_it():
    recorded("log.mat")
    plants = []
    for inertia in ("0.0027", "0.0035"):
        said("fit", "log.mat", "--free", "K_s,torque_per_volt,J_eq", "--J_l", inertia, "--force")
        plants.append(tomllib.loads(Path("twin.toml").read_text())["plant"])
    assert [plant["J_l"] for plant in plants] == [0.0027, 0.0035]
    assert plants[0]["K_s"] / 0.0027 == pytest.approx(plants[1]["K_s"] / 0.0035, rel=0.02)


def test_columns_of_a_table_without_headings_are_named():
    log = Recording.load(recorded("log.mat"))
    table = np.column_stack([log.time, log.degrees("theta"), log.degrees("alpha"), log["vm"]])
    np.savetxt("log.txt", table, delimiter="\t")
    assert "no headings" in said("fit", "log.txt", code=2)
    columns = ("--columns", "t_s,theta_deg,alpha_deg,vm_V")
    assert "open it as virtual:twin.toml" in said("fit", "log.txt", *columns, "--free", "K_s")


def test_on_a_terminal_the_first_rows_are_shown_and_the_columns_asked_for(monkeypatch):
    log = Recording.load(recorded("log.mat"))
    table = np.column_stack([log.time * 1000, log["vm"], log.degrees("alpha"), log.degrees("theta")])
    np.savetxt("log.txt", table, header="ms volt deflection pot")
    terminal = SimpleNamespace(isatty=lambda: True)
    monkeypatch.setattr(bench_commands, "sys", SimpleNamespace(stdin=terminal))
    words = ["bench", "fit", "log.txt", "--free", "K_s"]
    result = CliRunner().invoke(app, words, input="\n4 deg\n\n2 V\n")  # t and alpha as guessed
    assert result.exit_code == 0, result.output
    assert " 4 pot " in result.output and "theta (- for none) [-]: 4 deg" in result.output
    fitted = tomllib.loads(Path("twin.toml").read_text())["plant"]
    said("fit", "log.mat", "--free", "K_s", "--out", "same.toml")
    assert fitted["K_s"] == pytest.approx(tomllib.loads(Path("same.toml").read_text())["plant"]["K_s"], rel=1e-3)


def test_an_uneven_recording_is_not_fitted():
    log = Recording.load(recorded("log.mat"))
    uneven = np.r_[0:600, 601 : len(log)]
    Recording.of(log.time[uneven], theta=log["theta"][uneven], alpha=log["alpha"][uneven]).save("log.csv")
    assert "log.csv: The samples are not evenly spaced: after t = 1.198 s" in said("fit", "log.csv", code=2)


def recorded(name: str, run: int = 1, duration: str = "3") -> str:
    bench = ("--bench", f"virtual:?preset=real_bench&run={run}")
    said("run", "fsf", "--gain", GAIN, *bench, "--duration", duration, "--out", name)
    return name


@pytest.mark.slow
def test_of_several_recordings_each_is_predicted_by_a_fit_to_the_others():
    output = said("fit", recorded("1.mat"), recorded("2.mat", run=2), "--free", "K_s,torque_per_volt")
    assert "value 95 % interval " in output and "alpha_offset[2.mat]" in output and "[1]" not in output
    assert re.search(r"K_s 1\.\d+ .* torque_per_volt 0\.1\d+ ", output)
    assert re.search(r"Left out predicted .* 1\.mat theta 0\.\d+, alpha 0\.\d+ .* 2\.mat theta .* all theta", output)
    assert "open it as virtual:twin.toml" in output
    assert hil.open("virtual:twin.toml").identity["arm_position"] == 1


def test_a_fit_is_kept_where_no_recording_can_be_left_out():
    output = said("fit", recorded("1.mat", duration="2"), recorded("2.mat", 2, "2"), "--free", "K_s")
    assert "in 2 windows" in output
    assert "open it as virtual:twin.toml" in output


def test_recordings_of_different_arms_are_not_fitted_together():
    for position in ("1", "2"):
        bench = ("--bench", f"virtual:?seed=1&arm_position={position}")
        said("run", "sweep", *bench, "--duration", "1", "--out", f"{position}.mat")
    assert "(1.mat: 1, 2.mat" in said("fit", "1.mat", "2.mat", code=2)


@pytest.mark.parametrize(("text", "expected"), [("[plant]\nJ_l = 1", "no fitted plant"), ("[plant", "read: Expected")])
def test_a_twin_that_is_none_is_told(text, expected, tmp_path):
    (tmp_path / "twin.toml").write_text(text, encoding="utf-8")
    assert expected in said("watch", "--bench", "virtual:twin.toml", "--duration", "0.1", code=2)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["setup", "virtual:?clock=wall"], "has no wires and no hands at it: it needs no commissioning"),
        (["setup", "nothere.toml"], "There is no nothere.toml yet. Name the board"),
        (["run", "fsf"], "fsf needs four numbers as --gain"),
        (["run", "psf", "--gain", "1,2,three,4"], "it is '1,2,three,4'"),
        (["run", "sweep", "--gain", "1,2,3,4"], "sweep takes no --gain"),
        (["fit", "one.mat"], "at least 3"),
        (["fit", "one.mat", "--J_l", "0"], "--J_l 0: give a positive inertia"),
        (["fit", "one.mat", "--J_l", "0.003", "--free", "K_s,J_l"], "leave J_l out of --free"),
        (["fit", "one.mat", "two.mat"], "The same recording is named twice: name recordings of different runs"),
    ],
)
def test_what_cannot_be_is_said_before_anything_runs(words, told, tmp_path):
    recorded("one.mat", duration="0.5")
    shutil.copy("one.mat", "two.mat")
    more = [*VIRTUAL, "--out", "a.mat"] if words[0] == "run" else []
    assert told in said(*words, *more, code=2)
    assert not (tmp_path / "a.mat").exists()


def test_a_files_text_does_not_steer_the_terminal():
    Path("bench.toml").write_text('name = "n"\naddress = "quanser:q2_usb/0"\n[wiring]\n"\\u001b[2J" = 1\n')
    assert "There is no \\x1b[2J in [wiring]" in said("watch", code=2)
