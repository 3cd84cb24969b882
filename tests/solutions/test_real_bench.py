"""Marking by a bench of the laboratory's: by the recordings that its machine signed, and by what is known of it."""

from __future__ import annotations

import json

import numpy as np
import pytest
from forged import ANOTHER, FORGED, GAIN, OTHER_GAIN, OURS, recorded
from laboratory import laboratory
from made_courses import OURS as COURSE
from real_class import ARM, toml_of

import rotflex.lab
from rotflex import experiments
from rotflex.courseware.benches import BenchPolicy
from rotflex.errors import BenchError, ConfigurationError, NotRecorded
from rotflex.hil.recorded_runs import TOLD
from rotflex.instructor.marking import decoding, marking
from rotflex.instructor.verdicts import Status
from rotflex.recording import Recording
from rotflex.recordings_folder import RecordingsFolder
from rotflex.signing import signer_settings
from rotflex.signing.signer import Signer
from solutions import real_benches
from solutions.real_bench import RealBench

POLICY = BenchPolicy("real", benches=("north", "south"))


@pytest.fixture(scope="module")
def made():
    return recorded(OURS), recorded(ANOTHER)


@pytest.fixture
def benches(tmp_path, monkeypatch):
    """Two benches of the laboratory's, north and south, and the program that signs at each."""
    folder = tmp_path / "benches"
    folder.mkdir()
    signers = {}
    for name, spec in (("north", OURS), ("south", ANOTHER)):
        place = laboratory(tmp_path, name)
        (folder / f"{name}.toml").write_text(toml_of(place, spec), encoding="utf-8")
        signers[name] = Signer(signer_settings.read(place.settings), lambda: 1000.0)
    monkeypatch.setattr(real_benches, "FOLDER", folder)
    return signers


def told(spec) -> dict:
    return {
        "servo": {"encoder": "E"},
        "joint": {name: getattr(spec.joint, name) for name in (*ARM, "arm_position", "d_12")},
    }


def kept(folder, recording, spec=OURS) -> bytes:
    """A recording's file, as a folder of recordings keeps it."""
    path = RecordingsFolder(folder, "ada", signer="").keep(
        recording, told(spec) | dict(recording.metadata.get(TOLD, {}))
    )
    return path.read_bytes()


def handed_in(folder, signer, recordings, student="ada", spec=OURS) -> dict[str, bytes]:
    files = {}
    for number, one in enumerate(recordings, 1):
        content = kept(folder, one, spec)
        files |= {
            f"recordings/{number:03d}-x.mat": content,
            f"recordings/{number:03d}-x.mat.signed": signer.sign(student, content),
        }
    return files


def test_honest_recordings_count_and_stand_in_the_place_of_the_bench(tmp_path, benches, made):
    bench = RealBench("Ada", POLICY, handed_in(tmp_path, benches["north"], made[0].values()))
    assert (bench.problems, bench.is_known, bench.identity) == ([], True, None)
    (note,) = bench.notes
    assert note.startswith("Marked with the bench north and 9 recordings of it: 001-x, 002-x, 003-x,")
    assert bench.K_s == pytest.approx(OURS.parameters.K_s) and bench.J_l == OURS.joint.J_l
    np.testing.assert_allclose(bench.sweep()["alpha"], made[0]["sweep"]["alpha"], atol=1e-12)
    np.testing.assert_allclose(bench.tracking(tuple(GAIN), "partial")["vm"], made[0]["partial"]["vm"], atol=1e-12)
    with pytest.raises(NotRecorded):
        bench.tracking(tuple(OTHER_GAIN), "full")


def test_what_is_not_signed_is_for_a_person(tmp_path, benches, made):
    files = handed_in(tmp_path, benches["north"], [made[0]["sweep"]]) | {"recordings/002-x.mat": b"anything"}
    bench = RealBench("ada", POLICY, files)
    assert not bench.is_known
    assert bench.problems == ["recordings/002-x.mat does not count, and a person should look at it: it is not signed."]
    assert bench.sweep() is not None


@pytest.mark.parametrize("what", FORGED)
def test_every_recording_that_was_changed_after_it_was_signed_is_told(tmp_path, benches, made, what):
    forge, _found_without = FORGED[what]
    files = handed_in(tmp_path, benches["north"], [made[0]["tracking"]])
    files["recordings/001-x.mat"] = kept(tmp_path, forge(*made))
    bench = RealBench("ada", POLICY, files)
    assert not bench.is_known
    assert "001-x.mat does not count" in bench.problems[0] and "changed after it was signed" in bench.problems[0]


def test_forged_recordings_that_were_signed_are_told_where_the_bench_cannot_have_given_them(tmp_path, benches, made):
    forged = [forge(*made) for forge, found in FORGED.values() if found]
    bench = RealBench("ada", POLICY, handed_in(tmp_path, benches["north"], forged))
    assert not bench.is_known
    assert sum("does not count" in problem for problem in bench.problems) == len(forged)


def test_a_machine_speaks_for_its_own_bench_and_a_stranger_for_none(tmp_path, benches, made):
    stranger = laboratory(tmp_path, "east")
    signer = Signer(signer_settings.read(stranger.settings), lambda: 1000.0)
    bench = RealBench("ada", POLICY, handed_in(tmp_path, signer, [made[0]["sweep"]]))
    assert "not one of the laboratory's" in bench.problems[0]
    assert "There is no recording that a bench of the laboratory's signed" in bench.problems[1]
    for what in ("K_s", "J_l", "omega_n", "joint"):
        with pytest.raises(BenchError, match="not known at which bench"):
            getattr(bench, what)
    both = handed_in(tmp_path, benches["north"], [made[0]["sweep"], made[0]["tracking"]])
    south = handed_in(tmp_path, benches["south"], [made[1]["sweep"]], spec=ANOTHER)
    both |= {name.replace("001", "003"): content for name, content in south.items()}
    bench = RealBench("ada", POLICY, both)
    assert bench.K_s == pytest.approx(OURS.parameters.K_s)
    assert (
        "003-x.mat does not count" in bench.problems[0]
        and "of the bench south, and most are of north" in bench.problems[0]
    )


def test_a_recording_in_anothers_name_is_told(tmp_path, benches, made):
    bench = RealBench("ada", POLICY, handed_in(tmp_path, benches["north"], [made[0]["sweep"]], student="bob"))
    assert bench.is_known
    assert bench.problems == [
        "1 recording signed in the name of bob: right where the two worked at the bench together, and "
        "else not ada's own."
    ]


def test_a_signed_file_that_is_no_recording_is_told(tmp_path, benches):
    content = b"anything"
    from rotflex.courseware import signed_files

    key = signed_files.private_key(tmp_path / "north.key")
    files = {"recordings/1.mat": content, "recordings/1.mat.signed": signed_files.signed(content, {"number": "x"}, key)}
    assert "cannot be read as a .mat file" in RealBench("ada", POLICY, files).problems[0]


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "'told' is missing"),
        ("keys = []\n[told]\n[truth]", "keys should be as"),
        ('keys = ["x"]\n[told]\narm_position = 1\n[truth]\nomega_n = 22.0', "'omega_n_u' is missing"),
        ('keys = ["x"]\n[told]\narm_position = 1\n[truth]\nomega_n = 22.0\nomega_n_u = 1.0', "known to 4.5% only"),
        ('keys = ["x"]\n[told]\narm_position = 1\nm1 = 3\n[truth]\n', "it knows no entry 'm1'"),
        ('keys = ["x"]\n[told]\narm_position = 7\n[truth]\n', "arm_position is 7"),
        ('keys = ["x"]\n[told]\narm_position = 1\n[truth]\nomega_n = "x"\nomega_n_u = 1', "omega_n is 'x'"),
        ("[", "cannot be used"),
    ],
)
def test_a_benchs_file_that_cannot_be_used_is_told(tmp_path, text, why):
    (tmp_path / "north.toml").write_text(text, encoding="utf-8")
    with pytest.raises(ConfigurationError) as raised:
        real_benches.read("north", tmp_path)
    assert why in str(raised.value)


def test_answers_are_marked_by_the_recordings_of_that_bench(tmp_path, benches, made, monkeypatch):
    """The sweep's recording, given as an answer where the bench is not, comes out right; unsigned, it is a person's."""
    files = handed_in(tmp_path, benches["north"], [made[0]["sweep"]])
    monkeypatch.chdir(tmp_path)
    (tmp_path / "course.json").write_text(
        json.dumps({"student": "ada", "draw": 2, "bench": POLICY.plain()}), encoding="utf-8"
    )
    lab = rotflex.lab.start("ada", quiet=True)
    with lab.bench() as bench:
        sweep = experiments.sweep(bench, progress=False)
    lab.answer("2.9", **{COURSE.catalogue.find("2.9").parts[0].name: sweep})
    claims = decoding.decode((tmp_path / "answers.json").read_bytes(), lab.book.probe_seed, COURSE.catalogue)
    statuses = []
    for given in (files, {}):
        marks = marking.mark(COURSE, claims, RealBench("ada", POLICY, given), lab.book.probe_seed)
        statuses.append(next(one.status for one in marks if one.question == "2.9"))
    assert statuses == [Status.RIGHT, Status.FOR_A_PERSON]


def test_recordings_are_as_they_were_when_kept(tmp_path, made):
    (tmp_path / "x.mat").write_bytes(kept(tmp_path, made[0]["sweep"]))
    read = Recording.load(tmp_path / "x.mat")
    np.testing.assert_allclose(read["vm"], made[0]["sweep"]["vm"], atol=1e-12)


def test_what_is_wrong_with_a_benchs_file_is_known_before_anything_is_graded(tmp_path):
    truth = 'keys = ["k"]\n[told]\narm_position = 1\n[truth]\nomega_n = 22.9\nomega_n_u = '
    (tmp_path / "north.toml").write_text(truth + "0.1\n", encoding="utf-8")
    (tmp_path / "south.toml").write_text(truth + "0.5\n", encoding="utf-8")
    assert list(found := real_benches.faults(tmp_path)) == ["north", "south"]
    assert found["north"] == ""
    assert "omega_n is known to 2.2% only" in found["south"]
