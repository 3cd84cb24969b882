"""What is recorded at a laboratory's bench is kept, signed, and given back where the bench is not."""

from __future__ import annotations

import json
import os
import shlex
import sys
from dataclasses import replace

import numpy as np
import pytest
from laboratory import laboratory

import rotflex.lab
from rotflex import experiments, hil, plausible
from rotflex.courseware import signed_files
from rotflex.courseware.run import RUNNING
from rotflex.errors import NotRecorded, RecordingError
from rotflex.hil import real
from rotflex.hil.student_benches import student_bench
from rotflex.hil.virtual import VirtualBoard
from rotflex.recording import Recording
from rotflex.recordings_folder import SIGNER, RecordingsFolder, started

REAL = json.dumps({"student": "ada", "draw": 2, "bench": {"which": "real"}})


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A laboratory whose bench is at the address "north:", and a student's folder, which is the current one."""
    place, folder = tmp_path / "laboratory", tmp_path / "ada"
    place.mkdir()
    folder.mkdir()
    made = laboratory(place)
    really = hil.open
    monkeypatch.setattr(
        hil, "open", lambda uri, **more: really("virtual", plant=made.plant) if uri == "north:" else really(uri, **more)
    )
    monkeypatch.setenv(SIGNER, shlex.join(made.command))
    monkeypatch.chdir(folder)
    (folder / "course.json").write_text(REAL, encoding="utf-8")
    return made


def at_the_bench(**more):
    return rotflex.lab.start("ada", bench="north:", quiet=True, **more)


def short(bench):
    return experiments.free_decay(bench, duration=0.5, progress=False)


@pytest.mark.parametrize("running", ["check", "grade"])
def test_a_program_that_runs_the_notebooks_moves_no_bench_and_has_its_recordings(here, monkeypatch, running):
    with at_the_bench().bench() as bench:
        made = short(bench)
    monkeypatch.setenv(RUNNING, running)
    monkeypatch.setattr(hil, "open", lambda *_uri, **_more: pytest.fail("the bench was opened"))
    with at_the_bench().bench() as bench:
        again = short(bench)
        with pytest.raises(NotRecorded, match="This experiment has no recording of your bench: watch"):
            experiments.watch(bench, 0.1, progress=False)
    assert again.metadata == json.loads(json.dumps(made.metadata))
    np.testing.assert_allclose(again["alpha"], made["alpha"], atol=1e-12)


@pytest.mark.parametrize("address", ["north:", "bench.toml", "quanser:q2_usb/0", "serial:/dev/ttyACM0?supply=12"])
@pytest.mark.parametrize("started_at", ["north:", "virtual"])
def test_nor_does_a_program_move_a_bench_whose_address_a_cell_names(here, monkeypatch, started_at, address):
    with at_the_bench().bench() as bench:
        made = short(bench)
    monkeypatch.setenv(RUNNING, "check")
    monkeypatch.setattr(hil, "open", lambda *_uri, **_more: pytest.fail("the bench was opened"))
    session = rotflex.lab.start("ada", bench=started_at, quiet=True)
    with session.bench(address) as bench:
        np.testing.assert_allclose(short(bench)["alpha"], made["alpha"], atol=1e-12)


@pytest.mark.parametrize("volts", [10.0, 6.0, 5.0])
def test_what_a_bench_cut_to_its_own_limit_is_given_back_and_not_doubted(tmp_path, monkeypatch, volts):
    """As with `[limits] voltage = 6` in bench.toml, or a motor driver that is fed with 6 V."""
    bench = a_bench(tmp_path, monkeypatch, replace(real.LIMITS, voltage=volts))
    store = RecordingsFolder(tmp_path, "ada", signer="")
    gain = [25.0, -17.15, 1.59, 0.63]
    with store.keeping(bench, 1) as opened:
        made = experiments.tracking(opened, gain, duration=4.0, progress=False)
    assert abs(made["vm"]).max() == pytest.approx(volts, abs=2.5 if volts == 10.0 else 0)
    assert list(plausible.look(store.recordings()[0], bench.servo, student_bench(1).parameters).doubts()) == []
    with store.bench(1) as given:
        np.testing.assert_allclose(
            experiments.tracking(given, gain, duration=4.0, progress=False)["vm"], made["vm"], atol=1e-9
        )


def test_a_recording_with_too_many_pauses_is_kept_and_told_at_once(tmp_path, capsys):
    time = np.arange(2000) * 0.002
    timing = {"late": 300, "missed": 0, "held": [[first, 60] for first in range(100, 600, 100)]}
    recording = Recording.of(time, {"experiment": "watch", "timing": timing}, theta=time, alpha=time, vm=0 * time)
    RecordingsFolder(tmp_path, "ada", signer="").keep(recording, {})
    told = capsys.readouterr().out
    assert "Note      001-watch.mat will not count by itself: 15% of its samples were not answered in time" in told
    assert "Close what else keeps this computer busy, and run it again." in told


def test_what_is_recorded_at_the_bench_is_kept_signed_and_given_back(here, tmp_path, capsys):
    lab = at_the_bench()
    with lab.bench() as bench:
        made = short(bench)
    with lab.bench(run=2) as bench:
        experiments.watch(bench, 0.1, progress=False)
    assert capsys.readouterr().out == (
        "Kept      recordings/001-free-decay.mat: signed\nKept      recordings/002-watch.mat: signed\n"
    )
    file = tmp_path / "ada/recordings/001-free-decay.mat"
    beside = file.with_name(file.name + ".signed").read_bytes()
    assert signed_files.verified(file.read_bytes(), beside, [here.public]).text("student") == "ada"
    kept = Recording.load(file)
    assert kept.metadata["told"]["joint"]["m_1"] == lab.joint.m_1
    assert (kept.metadata["bench"]["run"], kept.metadata["experiment"]) == (1, "free decay")

    for address in ("virtual", "recorded"):  # the course's notebooks say "virtual"
        home = rotflex.lab.start("ada", bench=address, quiet=True)
        assert (home.joint, home.servo) == (lab.joint, lab.servo)
        with home.bench() as bench:
            again = short(bench)
            with pytest.raises(NotRecorded, match="sweep, drive = position"):
                experiments.sweep(bench, progress=False)
        for name in made.channels:
            np.testing.assert_allclose(again[name], made[name], rtol=1e-12, atol=1e-12)
        with home.bench(run=2) as bench:
            experiments.watch(bench, 0.1, progress=False)


def test_before_anything_is_recorded_notebooks_open_and_say_so(here):
    lab = rotflex.lab.start("ada", quiet=True)
    assert lab.joint.arm_position == 1
    with lab.bench() as bench, pytest.raises(NotRecorded, match="Nothing was recorded at the bench yet"):
        short(bench)


@pytest.mark.parametrize(
    ("command", "why"),
    [
        ("", "not signed, as this machine signs nothing"),
        ("/no/such/program", "not signed: "),
        pytest.param(
            '"unclosed',
            "not signed: ROTFLEX_SIGNER is no command (No closing quotation)",
            marks=pytest.mark.skipif(os.name == "nt", reason="Windows takes the line as it is"),
        ),
        (shlex.join([sys.executable, "-c", "import sys; sys.exit('no key today')"]), "not signed: no key today"),
        (shlex.join([sys.executable, "-c", ""]), "not signed: "),
    ],
)
def test_what_cannot_be_signed_is_kept_and_the_line_says_why(here, monkeypatch, capsys, tmp_path, command, why):
    monkeypatch.setenv(SIGNER, command)
    with at_the_bench().bench() as bench:
        short(bench)
    assert f"Kept      recordings/001-free-decay.mat: {why}" in capsys.readouterr().out
    assert [path.name for path in (tmp_path / "ada/recordings").iterdir()] == ["001-free-decay.mat"]


def test_on_windows_a_command_with_a_blank_in_its_path_is_taken_as_it_is():
    line = r'"C:\Program Files\Python\python.exe" -I -m rotflex.signing sign C:\signer\north.toml'
    assert started(line, "nt") == line
    assert started("'/opt/my python' -I -m x", "posix") == ["/opt/my python", "-I", "-m", "x"]


def test_virtual_benches_and_replays_leave_nothing_behind(here, tmp_path):
    (tmp_path / "ada/course.json").unlink()
    lab = rotflex.lab.start("ada", quiet=True)
    with lab.bench() as bench:
        path = short(bench).save(tmp_path / "log.mat")
    with lab.bench(f"replay:{path}") as bench:
        short(bench)
    assert not (tmp_path / "ada/recordings").exists()


def test_a_broken_file_is_told_and_left_out_and_numbers_go_on(here, tmp_path, capsys):
    store = RecordingsFolder(tmp_path / "ada", "ada", signer="")
    t = np.arange(10) * 0.002
    store.keep(Recording.of(t, {"experiment": "a/b ../c"}, theta=t, alpha=t, vm=t), {})
    (tmp_path / "ada/recordings/0999-x.mat").write_text("broken")
    (tmp_path / "ada/recordings/notes.mat").write_text("mine")
    store.keep(Recording.of(t, {}, theta=t, alpha=t, vm=t), {})
    assert [path.name for path in store.paths] == ["001-a-b-c.mat", "0999-x.mat", "1000-run.mat"]
    assert len(store.recordings()) == 2
    assert "Note      0999-x.mat cannot be read as a .mat file" in capsys.readouterr().out


def a_bench(tmp_path, monkeypatch, limits=real.LIMITS):
    """A bench that can come to harm, of a virtual one."""
    monkeypatch.setenv("ROTFLEX_CONFIG_DIR", str(tmp_path / "settings"))
    spec = student_bench(1)
    setup = real.Setup(joint=spec.joint, limits=limits, commissioned=lambda: "", simulated=True)
    return real.bench("north:0", lambda: VirtualBoard(spec.parameters, timing=spec.timing), setup)


@pytest.mark.parametrize("beside", ["", "a file"], ids=["there is a place", "there is none"])
def test_a_run_that_cannot_be_kept_is_not_lost_and_its_place_is_told(tmp_path, monkeypatch, beside):
    bench = a_bench(tmp_path, monkeypatch)
    store = RecordingsFolder(tmp_path, "ada", signer="")
    (tmp_path / "recordings").write_text("a file")
    with pytest.raises(RecordingError, match=r"recordings cannot be made: .* The recording is whole: it is in") as told:  # noqa: SIM117
        with store.keeping(bench, 1) as opened:
            bench.safety = replace(bench.safety, folder=None if beside else bench.safety.folder)
            short(opened)
    assert len(bench.kept) == 251 and "theta_ref" in bench.kept and "ended" not in bench.kept.metadata
    saved = list((tmp_path / "settings").rglob("*.mat"))
    if beside:
        assert not saved and "in the bench's `kept`, until the program ends" in str(told.value)
        return
    assert f"it is in {saved[0]}, and in the bench's `kept`" in str(told.value)
    again = Recording.load(*saved)
    assert again.metadata == json.loads(json.dumps(dict(bench.kept.metadata)))
    np.testing.assert_allclose(again["alpha"], bench.kept["alpha"], atol=1e-12)
    (tmp_path / "recordings").unlink()
    (tmp_path / "recordings").mkdir()
    saved[0].rename(tmp_path / "recordings" / "001-free-decay.mat")  # as it would have been kept
    with store.bench(1) as given:
        np.testing.assert_allclose(short(given)["vm"], bench.kept["vm"], atol=1e-9)


def test_a_signature_that_cannot_be_written_is_told_and_the_recording_is_kept(here, monkeypatch, capsys, tmp_path):
    (tmp_path / "ada/recordings/001-free-decay.mat.signed/mine").mkdir(parents=True)
    with at_the_bench().bench() as bench:
        assert len(short(bench)) == 251
    assert "Kept      recordings/001-free-decay.mat: not signed: " in capsys.readouterr().out
    assert len(Recording.load(tmp_path / "ada/recordings/001-free-decay.mat")) == 251


def test_a_folder_that_cannot_be_made_is_told(here, tmp_path):
    (tmp_path / "ada/recordings").write_text("a file")
    t = np.arange(10) * 0.002
    with pytest.raises(RecordingError, match="recordings cannot be made"):
        RecordingsFolder(tmp_path / "ada", "ada").keep(Recording.of(t, theta=t, alpha=t), {})
