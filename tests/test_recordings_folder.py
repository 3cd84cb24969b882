"""What is recorded at a laboratory's bench is kept, and given back where the bench is not."""

import json
import os
from dataclasses import replace

import numpy as np
import pytest

import rotflex.course.lab
from labcourse.run import RUNNING
from rotflex import experiments, hil
from rotflex.course import plausible
from rotflex.course.recordings_folder import LONGEST, MOST_RECORDINGS, RecordingsFolder, evidence
from rotflex.errors import NotRecorded, RecordingError
from rotflex.hil import real
from rotflex.hil.student_benches import student_bench
from rotflex.hil.virtual import VirtualBoard
from rotflex.recording import Recording

REAL = json.dumps({"student": "ada", "draw": 2, "bench": {"which": "real", "benches": ["north"]}})


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A laboratory whose bench is at the address "north:", and a student's folder, which is the current one."""
    folder, names = tmp_path / "ada", {"north:": "north", "elsewhere:": "east"}
    folder.mkdir()
    really = hil.open

    def opened(uri, **more):
        if uri not in names:
            return really(uri, **more)
        bench = really("virtual", plant=student_bench(2**40 + 7))
        bench.identity["name"] = names[uri]
        return bench

    monkeypatch.setattr(hil, "open", opened)
    monkeypatch.chdir(folder)
    (folder / "course.json").write_text(REAL, encoding="utf-8")


def at_the_bench(**more):
    return rotflex.course.lab.start("ada", bench="north:", quiet=True, **more)


def short(bench):
    return experiments.free_decay(bench, duration=0.5, progress=False)


ADDRESSES = ("north:", "bench.toml", "quanser:q2_usb/0", "serial:/dev/ttyACM0?supply=12")


@pytest.mark.parametrize(
    ("running", "started_at", "address"),
    [
        ("grade", "north:", None),
        *(("check", "virtual", address) for address in ADDRESSES),
    ],
)
def test_a_program_that_runs_the_notebooks_moves_no_bench_and_has_its_recordings(
    here, monkeypatch, running, started_at, address
):
    """Whichever address a cell names."""
    with at_the_bench().bench() as bench:
        made = short(bench)
    monkeypatch.setenv(RUNNING, running)
    monkeypatch.setattr(hil, "open", lambda *_uri, **_more: pytest.fail("the bench was opened"))
    with rotflex.course.lab.start("ada", bench=started_at, quiet=True).bench(address) as bench:
        again = short(bench)
        with pytest.raises(NotRecorded, match="This experiment has no recording of your bench: watch"):
            experiments.watch(bench, 0.1, progress=False)
    assert again.metadata == json.loads(json.dumps(made.metadata))
    np.testing.assert_allclose(again["alpha"], made["alpha"], atol=1e-12)


def test_what_a_bench_cut_to_its_own_limit_is_given_back_and_not_doubted(tmp_path, monkeypatch):
    """As with `[limits] voltage = 6` in bench.toml, or a motor driver that is fed with 6 V."""
    bench = a_bench(tmp_path, monkeypatch, replace(real.DEFAULT_LIMITS, voltage=6.0))
    store = RecordingsFolder(tmp_path)
    gain = [25.0, -17.15, 1.59, 0.63]
    with store.keeping(bench, 1) as opened:
        made = experiments.tracking(opened, gain, duration=4.0, progress=False)
    assert abs(made["vm"]).max() == 6.0
    assert plausible.doubts(store.recordings()[0], bench.servo, student_bench(1).parameters) == []
    with store.bench(1) as given:
        np.testing.assert_allclose(
            experiments.tracking(given, gain, duration=4.0, progress=False)["vm"], made["vm"], atol=1e-9
        )


def test_a_recording_with_too_many_pauses_is_kept_and_told_at_once(tmp_path, capsys):
    time = np.arange(2000) * 0.002
    timing = {"late": 300, "missed": 0, "held": [[first, 60] for first in range(100, 600, 100)]}
    recording = Recording.of(time, {"experiment": "watch", "timing": timing}, theta=time, alpha=time, vm=0 * time)
    RecordingsFolder(tmp_path).keep(recording)
    told = capsys.readouterr().out
    assert "001-watch.mat" in told and "15%" in told


@pytest.mark.skipif(os.name == "nt", reason="links need rights there")
def test_a_link_in_place_of_the_folder_is_not_followed_and_said(tmp_path):
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "recordings").symlink_to(tmp_path / "elsewhere")
    store = RecordingsFolder(tmp_path)
    recording = Recording.of(np.arange(3) * 0.002, theta=np.zeros(3))
    with pytest.raises(RecordingError, match="link"):
        store.keep(recording)
    recording.save(tmp_path / "elsewhere" / "001-run.mat")
    found, (left_out,) = store.load()
    assert found == {} and "link" in left_out


def test_what_is_recorded_at_the_bench_is_kept_and_given_back(here, tmp_path, capsys):
    lab = at_the_bench()
    with lab.bench() as bench:
        made = short(bench)
    with lab.bench(run=2) as bench:
        experiments.watch(bench, 0.1, progress=False)
    assert capsys.readouterr().out == "Kept      recordings/001-free-decay.mat\nKept      recordings/002-watch.mat\n"
    kept = Recording.load(tmp_path / "ada/recordings/001-free-decay.mat")
    assert kept.metadata["bench"]["name"] == "north"
    assert kept.metadata["told"]["joint"]["m_1"] == lab.joint.m_1
    assert (kept.metadata["bench"]["run"], kept.metadata["experiment"]) == (1, "free decay")

    for address in ("virtual", "recorded"):  # the course's notebooks say "virtual"
        home = rotflex.course.lab.start("ada", bench=address, quiet=True)
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
    lab = rotflex.course.lab.start("ada", quiet=True)
    assert lab.joint.arm_position == 1
    with lab.bench() as bench, pytest.raises(NotRecorded, match="Nothing was recorded at the bench yet"):
        short(bench)


def test_a_bench_whose_name_the_course_does_not_have_is_told_before_anything_is_recorded(here, capsys):
    rotflex.course.lab.start("ada", bench="elsewhere:", quiet=True)
    told = capsys.readouterr().out
    assert "This bench's name is 'east', and your course's benches are north: a person has to look" in told
    at_the_bench()
    assert capsys.readouterr().out == ""


def keep(store, *settings, seconds=0.1):
    time = np.arange(round(seconds / 0.002) + 1) * 0.002
    for metadata in settings:
        store.keep(Recording.of(time, metadata, theta=time, alpha=time, vm=time))


def test_of_more_than_can_count_repeats_are_left_out_first_and_that_is_told(tmp_path, capsys):
    store = RecordingsFolder(tmp_path)
    keep(store, {"experiment": "sweep"}, *[{"experiment": "tracking", "K": [1.0, k]} for k in (1, 2, 2)])
    keep(store, *[{"experiment": "tracking", "K": [1.0, k]} for k in range(3, MOST_RECORDINGS)])
    assert "At most 20 recordings count" in capsys.readouterr().out
    found, (line,) = store.load()
    assert len(found) == MOST_RECORDINGS and "001-sweep" in found
    assert line == ("Of 21 recordings, 20 count; left out are: 003-tracking. Delete those that you do not need.")


def test_a_recording_that_is_too_long_is_left_out_and_told(tmp_path, capsys):
    store = RecordingsFolder(tmp_path)
    keep(store, {"experiment": "watch"}, seconds=LONGEST)
    assert "Note" not in capsys.readouterr().out
    keep(store, {"experiment": "watch"}, seconds=LONGEST + 1)
    assert "each of at most 60 s: delete" in capsys.readouterr().out
    found, left_out = store.load()
    assert (list(found), left_out) == (
        ["001-watch"],
        ["002-watch.mat is longer than 60 s, or has more than 30001 samples. It is left out."],
    )


def test_evidence_is_plain_data_and_what_cannot_be_read_is_named(tmp_path):
    store = RecordingsFolder(tmp_path)
    told = {"experiment": "tracking", "feedback": "full", "K": [1, 2.5], "bench": {"name": "north", "run": 2}, "x": {}}
    keep(store, told, seconds=0.004)
    (tmp_path / "recordings/002-x.mat").write_bytes(b"anything")
    found = json.loads(json.dumps(evidence(tmp_path)))
    (one,) = found["recordings"]
    assert (one["file"], one["bench"], one["run"], one["experiment"]) == ("001-tracking", "north", 2, "tracking")
    assert one["settings"] == {"feedback": "full", "K": [1, 2.5]}
    assert one["channels"] == {name: pytest.approx([0.0, 0.002, 0.004]) for name in ("theta", "alpha", "vm")}
    assert found["left_out"][0].startswith("002-x.mat cannot be read as a .mat file")
    assert evidence(tmp_path / "nowhere") == {"recordings": [], "left_out": []}


def test_a_recording_with_uneven_time_is_left_out_by_name(tmp_path):
    store = RecordingsFolder(tmp_path)
    store.folder.mkdir()
    Recording.of([0.0, 0.002, 0.005], theta=[0, 1, 2]).save(store.folder / "001-watch.mat")
    found, (left_out,) = store.load()
    assert found == {} and left_out.startswith("001-watch.mat: The samples are not evenly spaced")


def test_virtual_benches_and_replays_leave_nothing_behind(here, tmp_path):
    (tmp_path / "ada/course.json").unlink()
    lab = rotflex.course.lab.start("ada", quiet=True)
    with lab.bench() as bench:
        path = short(bench).save(tmp_path / "log.mat")
    with lab.bench(f"replay:{path}") as bench:
        short(bench)
    assert not (tmp_path / "ada/recordings").exists()


def test_a_broken_file_is_told_and_left_out_and_numbers_go_on(here, tmp_path, capsys):
    store = RecordingsFolder(tmp_path / "ada")
    t = np.arange(10) * 0.002
    store.keep(Recording.of(t, {"experiment": "a/b ../c"}, theta=t, alpha=t, vm=t))
    (tmp_path / "ada/recordings/0999-x.mat").write_text("broken")
    (tmp_path / "ada/recordings/notes.mat").write_text("mine")
    store.keep(Recording.of(t, {}, theta=t, alpha=t, vm=t))
    assert [path.name for path in store.paths] == ["001-a-b-c.mat", "0999-x.mat", "1000-run.mat"]
    assert len(store.recordings()) == 2
    assert "Note      0999-x.mat cannot be read as a .mat file" in capsys.readouterr().out


def a_bench(tmp_path, monkeypatch, limits=real.DEFAULT_LIMITS):
    """A bench that can come to harm, of a virtual one."""
    monkeypatch.setenv("ROTFLEX_CONFIG_DIR", str(tmp_path / "settings"))
    spec = student_bench(1)
    setup = real.Setup(joint=spec.joint, limits=limits, commissioned=lambda: "", simulated=True)
    return real.make_bench("north:0", lambda: VirtualBoard(spec.parameters, timing=spec.timing), setup)


@pytest.mark.parametrize("beside", ["", "a file"], ids=["there is a place", "there is none"])
def test_a_run_that_cannot_be_kept_is_not_lost_and_its_place_is_told(tmp_path, monkeypatch, beside):
    bench = a_bench(tmp_path, monkeypatch)
    store = RecordingsFolder(tmp_path)
    (tmp_path / "recordings").write_text("a file")
    with pytest.raises(RecordingError, match=r"recordings cannot be made: .* The recording is whole: it is in") as told:  # noqa: SIM117
        with store.keeping(bench, 1) as opened:
            bench.recorder.folder = None if beside else bench.recorder.folder
            short(opened)
    assert (
        len(bench.recorder.unfinished) == 251
        and "theta_ref" in bench.recorder.unfinished
        and "ended" not in bench.recorder.unfinished.metadata
    )
    saved = list((tmp_path / "settings").rglob("*.mat"))
    if beside:
        assert not saved and "in the bench's recorder.unfinished, until the program ends" in str(told.value)
        return
    assert f"it is in {saved[0]}" in str(told.value)
    again = Recording.load(*saved)
    assert again.metadata == json.loads(json.dumps(dict(bench.recorder.unfinished.metadata)))
    np.testing.assert_allclose(again["alpha"], bench.recorder.unfinished["alpha"], atol=1e-12)
    (tmp_path / "recordings").unlink()
    (tmp_path / "recordings").mkdir()
    saved[0].rename(tmp_path / "recordings" / "001-free-decay.mat")  # as it would have been kept
    with store.bench(1) as given:
        np.testing.assert_allclose(short(given)["vm"], bench.recorder.unfinished["vm"], atol=1e-9)
