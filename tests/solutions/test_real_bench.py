"""Marking by a bench of the laboratory's: by the recordings that name it, and by what is known of it."""

from __future__ import annotations

import json
import pickle
from dataclasses import replace

import numpy as np
import pytest
from forged import ANOTHER, GAIN, OTHER_GAIN, OURS, changed, recorded, scaled
from made_courses import OURS as COURSE
from real_class import ARM, toml_of

import rotflex.course.lab
from labcourse.benches import BenchPolicy
from labcourse.grading.marking import decoding, marking
from labcourse.grading.marks import Status
from labcourse.grading.submission import Submission
from labcourse.problems import Code
from rotflex import experiments
from rotflex.course.recordings_folder import MOST_RECORDINGS, MOST_SAMPLES, RecordingsFolder, evidence
from rotflex.errors import BenchError, ConfigurationError, NotRecorded
from rotflex.hil.replay import REPORTED
from rotflex.recording import Recording
from solutions import real_benches
from solutions.real_bench import RealBench

POLICY = BenchPolicy("real", benches=("north", "south"))


@pytest.fixture(scope="module")
def made():
    return recorded(OURS), recorded(ANOTHER)


@pytest.fixture(autouse=True)
def benches(tmp_path, monkeypatch):
    """What is known of two benches of the laboratory's, north and south."""
    folder = tmp_path / "benches"
    folder.mkdir()
    for name, spec in (("north", OURS), ("south", ANOTHER)):
        (folder / f"{name}.toml").write_text(toml_of(spec), encoding="utf-8")
    monkeypatch.setattr(real_benches, "FOLDER", folder)


def told(spec) -> dict:
    return {
        "servo": {"encoder": "E"},
        "joint": {name: getattr(spec.joint, name) for name in (*ARM, "arm_position", "d_12")},
    }


def at(bench: str, recording: Recording) -> Recording:
    """A recording that names a bench; "" for none."""
    return replace(recording, metadata={**recording.metadata, "bench": {"name": bench, "run": 1} if bench else {}})


def content_of(folder, *recordings, spec=OURS) -> dict:
    """What the sandbox gives back of a folder with these recordings, before it is JSON."""
    store = RecordingsFolder(folder)
    for one in recordings:
        reported = told(spec) | dict(one.metadata.get(REPORTED, {}))
        store.keep(replace(one, metadata={**one.metadata, REPORTED: reported}))
    return evidence(folder)


def bench_of(content) -> RealBench:
    return RealBench(POLICY, json.dumps(content).encode())


def test_honest_recordings_count_and_stand_in_the_place_of_the_bench(tmp_path, made, monkeypatch):
    content = content_of(tmp_path, *(at("north", one) for one in made[0].values()))
    monkeypatch.setattr(Recording, "load", lambda *_paths: pytest.fail("a file was opened"))
    bench = bench_of(content)
    assert (bench.problems, bench.is_known, bench.identity) == ([], True, None)
    (note,) = bench.notes
    assert note.startswith("Marked with the bench north and 9 recordings of it: 001-sweep, 002-free-decay,")
    assert bench.K_s == pytest.approx(OURS.parameters.K_s) and bench.J_l == OURS.joint.J_l
    np.testing.assert_allclose(bench.sweep()["alpha"], made[0]["sweep"]["alpha"], atol=1e-8)
    np.testing.assert_allclose(bench.tracking(tuple(GAIN), "partial")["vm"], made[0]["partial"]["vm"], atol=1e-8)
    with pytest.raises(NotRecorded):
        bench.tracking(tuple(OTHER_GAIN), "full")


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (lambda one: at("east", one), "it says that it was made at the bench 'east', and the course's benches are no"),
        (lambda one: at("", one), "it does not say at which bench it was made, and the course's benches are north, s"),
        (lambda one: at("north", scaled(one, 1.1)), "its voltage is up to 0."),
        (lambda one: at("north", changed(one, vm=0.9 * one["vm"])), "its voltage is up to "),
        (lambda one: at("south", one), "it is of the bench south, and most are of north"),
    ],
    ids=["a name that is unknown", "no name", "angles not of K", "voltages not of K", "another bench's name"],
)
def test_a_recording_in_doubt_leaves_what_was_measured_to_a_person_and_says_why(tmp_path, made, change, why):
    honest = [at("north", made[0]["sweep"]), at("north", made[0]["partial"])]
    bench = bench_of(content_of(tmp_path, change(made[0]["tracking"]), *honest))
    assert not bench.is_known
    (problem,) = bench.problems
    assert (problem.code, problem.where) == (Code.DOUBTED_BY_COURSE, "001-tracking")
    assert problem.parameters["why"].startswith(why)
    assert bench.sweep() is not None and bench.K_s == pytest.approx(OURS.parameters.K_s)


def test_a_link_unlike_that_of_the_bench_that_is_named_is_in_doubt(tmp_path, made):
    bench = bench_of(content_of(tmp_path, at("south", made[0]["sweep"])))
    assert not bench.is_known
    (problem,) = bench.problems
    assert (problem.code, problem.where) == (Code.DOUBTED_BY_COURSE, "001-sweep")
    assert "its arm does not move as the arm of" in problem.parameters["why"]


@pytest.mark.parametrize("data", [b"", json.dumps({"recordings": [], "left_out": []}).encode()])
def test_without_recordings_nobody_knows_at_which_bench_it_was(data):
    bench = RealBench(POLICY, data)
    assert (bench.is_known, len(bench.problems)) == (False, 1)
    assert "No recording could be read that names a bench of the course's" in bench.problems[0]
    for what in ("K_s", "J_l", "omega_n", "joint"):
        with pytest.raises(BenchError, match="not known at which bench"):
            getattr(bench, what)


@pytest.fixture(scope="module")
def two_recordings(tmp_path_factory, made):
    folder = tmp_path_factory.mktemp("two")
    return json.dumps(content_of(folder, at("north", made[0]["sweep"]), at("north", made[0]["partial"])))


@pytest.fixture
def content(two_recordings):
    """Two honest recordings as plain data."""
    return json.loads(two_recordings)


NO_DATA = {
    "pickle": b"\x80\x04\x95" + pickle.dumps(print),
    "path": b"recordings/001-sweep.mat",
}
NO_DATA |= {"path as JSON": b'"recordings/001-sweep.mat"', "more": b'{"recordings": [], "left_out": [], "more": 1}'}
NO_DATA |= {"nested": b"[" * 100_000, "large integer": b'{"recordings": ' + b"9" * 5000 + b', "left_out": []}'}
NO_DATA |= {"many objects": b'{"recordings": [' + b"{}," * 100_000 + b'{}], "left_out": []}'}
TOO_MANY = {"recordings": [{}] * (MOST_RECORDINGS + 1), "left_out": []}


@pytest.mark.parametrize("data", [*NO_DATA.values(), json.dumps(TOO_MANY).encode()], ids=[*NO_DATA, "21 recordings"])
def test_what_is_no_plain_data_is_refused_as_a_whole_and_named(data):
    bench = RealBench(POLICY, data)
    assert (bench.is_known, bench._found.recordings) == (False, [])
    assert bench.problems[0].startswith("What the run gave back of the recordings is not as it should be: ")


@pytest.mark.parametrize(
    ("where", "value", "why"),
    [
        (("channels", "theta"), [0.0] * (MOST_SAMPLES + 1), "theta should be a list of 2 to 30001 items"),
        (("sample_time",), 0.01, "should be a list of 2 to 6002 items"),
        (("sample_time",), 1e-9, "sample_time should be from"),
        (("channels", "theta", 5), float("nan"), "theta should be a finite number"),
        (("channels", "vm", 5), 1e300, "vm should be within 1e+06"),
        (("channels", "vm"), [0.0, 1.0], "the time has 2"),
        (("channels", "x"), [0.0], "channels should be some of"),
        (("file",), "../../etc/passwd", "file should be the name of a recording"),
        (("file",), "001-sweep\n", "file should be the name of a recording"),
        (("settings", "K"), [float("inf")] * 4, "K should be a finite number"),
        (("voltage_limit",), None, "voltage_limit should be a finite number"),
        (("timing", "held"), [[1, 2]] * 101, "held should be a list of 0 to 100 items"),
        (("timing", "held"), [[1, -2]], "a stretch of samples should be a whole number"),
    ],
)
def test_a_recording_that_is_not_as_it_should_be_costs_itself_and_is_named(content, where, value, why):
    within = content["recordings"][1]
    for name in where[:-1]:
        within = within[name]
    within[where[-1]] = value
    if where == ("sample_time",) and value == 0.01:
        within["channels"] = {name: values * 5 for name, values in within["channels"].items()}
    bench = bench_of(content)
    assert len(bench._found.recordings) == 1 and bench.sweep() is not None
    (problem,) = bench.problems
    assert problem.startswith("Recording 2 of the run is not as it should be, and does not count: ") and why in problem
    with pytest.raises(NotRecorded):
        bench.tracking(tuple(GAIN), "partial")


def test_what_the_reader_left_out_is_told_in_one_line_of_bounded_length(content):
    bench = bench_of({**content, "left_out": ["003-x.mat is\nlonger than\0 60 s." + 1000 * "!"]})
    assert [one.rstrip("!") for one in bench.problems] == [
        "The run says of the recordings: 003-x.mat is longer than\N{REPLACEMENT CHARACTER} 60 s."
    ]
    assert bench.is_known and len(bench.problems[0]) < 700


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "'told' is missing"),
        ('keys = ["x"]\n[told]\n[truth]', "keys, and signatures"),
        ("[told]\narm_position = 1\n[truth]\nomega_n = 22.0", "'omega_n_u' is missing"),
        ("[told]\narm_position = 1\n[truth]\nomega_n = 22.0\nomega_n_u = 1.0", "4.5% only"),
        ("[told]\narm_position = 1\nm1 = 3\n[truth]\n", "no entry 'm1'"),
        ('[told]\narm_position = 1\n[truth]\nomega_n = "x"\nomega_n_u = 1', "omega_n is 'x'"),
    ],
)
def test_a_benchs_file_that_cannot_be_used_is_told(tmp_path, text, why):
    (tmp_path / "north.toml").write_text(text, encoding="utf-8")
    with pytest.raises(ConfigurationError) as raised:
        real_benches.read("north", tmp_path)
    assert why in str(raised.value)


def test_answers_are_marked_by_the_recordings_of_that_bench(tmp_path, made, monkeypatch):
    """The sweep's recording, given as an answer where the bench is not, comes out right; else it is a person's."""
    content = content_of(tmp_path, at("north", made[0]["sweep"]))
    monkeypatch.chdir(tmp_path)
    (tmp_path / "course.json").write_text(
        json.dumps({"student": "ada", "draw": 2, "bench": POLICY.as_json()}), encoding="utf-8"
    )
    lab = rotflex.course.lab.start("ada", quiet=True)
    with lab.bench() as bench:
        sweep = experiments.sweep(bench, progress=False)
    lab.answer("2.9", **{COURSE.catalogue.find("2.9").parts[0].name: sweep})
    claims = decoding.decode((tmp_path / "answers.json").read_bytes(), lab.book.probe_seed, COURSE.catalogue)
    statuses = []
    for given in (json.dumps(content).encode(), b""):
        marks = marking.mark(
            COURSE, claims, RealBench(POLICY, given), Submission(student="ada", probe_seed=lab.book.probe_seed)
        )
        statuses.append(next(one.status for one in marks if one.question == "2.9"))
    assert statuses == [Status.RIGHT, Status.FOR_A_PERSON]


def test_what_is_wrong_with_a_benchs_file_is_known_before_anything_is_graded(tmp_path):
    truth = "[told]\narm_position = 1\n[truth]\nomega_n = 22.9\nomega_n_u = "
    (tmp_path / "north.toml").write_text(truth + "0.1\n", encoding="utf-8")
    (tmp_path / "south.toml").write_text(truth + "0.5\n", encoding="utf-8")
    assert list(found := real_benches.faults(tmp_path)) == ["north", "south"]
    assert found["north"] == ""
    assert "omega_n is known to 2.2% only" in found["south"]
