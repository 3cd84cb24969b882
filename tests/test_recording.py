"""Recordings: what they hold, the files they are kept in, and files that are broken."""

from __future__ import annotations

import json
import os
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.io import loadmat, savemat

from rotflex.errors import RecordingError
from rotflex.recording import UNITS, Channel, Recording
from rotflex.units import DEG

T = np.arange(50) * 0.002
METADATA = {
    "source": "virtual bench",
    "experiment": "tracking",
    "bench": {"uri": "virtual", "seed": 7, "arm_position": 2},
    "sample_time": 0.002,
    "software": "rotflex 0.1.0",
    "note": "λ µ “quoted”, 12 %\n",
}


def tracked(metadata=None, t=T) -> Recording:
    return Recording.of(t, metadata or METADATA, theta_ref=0 * t + 0.3, theta=np.sin(t), alpha=np.cos(t), vm=2 * t)


def validated() -> Recording:
    return Recording.of(
        T, {"experiment": "validation"}, theta=np.sin(T), alpha=T, vm=-T, theta_model=np.cos(T), alpha_model=2 * T
    )


def assert_same(read: Recording, written: Recording, tolerance: float = 1e-12) -> None:
    assert set(read.channels) == set(written.channels)
    np.testing.assert_allclose(read.time, written.time - written.time[0], atol=1e-9)
    for name, channel in written.channels.items():
        assert read.channels[name].unit == channel.unit
        np.testing.assert_allclose(read[name], channel.values, rtol=tolerance, atol=1e-300)


def refusals(calls) -> list[str]:
    """What each of the calls is refused with, without the folder of a file."""
    messages = []
    for call in calls:
        with pytest.raises(RecordingError) as error:
            call()
        messages.append(re.sub(r"\S*[/\\](broken\.\w+)", r"\1", str(error.value)))
    return messages


# --- in memory -------------------------------------------------------------------------------------------------------


def test_channels_are_read_by_name_in_si_units():
    recording = tracked()
    np.testing.assert_array_equal(recording["theta"], np.sin(T))
    np.testing.assert_allclose(recording.degrees("theta"), np.degrees(np.sin(T)))
    assert recording.channels["vm"].unit == "V"
    assert recording.sample_time == pytest.approx(0.002)
    assert len(recording) == 50
    assert "alpha" in recording
    assert "alpha_model" not in recording
    assert "0.098 s at 2 ms" in repr(recording)


def test_a_channel_that_is_not_there_is_named_with_those_that_are():
    with pytest.raises(RecordingError, match=r"'beta'.* theta_ref, theta"):
        tracked()["beta"]
    with pytest.raises(RecordingError, match=r"'speed'.* theta_ref"):
        Recording.of(T, speed=T)
    with pytest.raises(RecordingError, match="'vm'"):
        tracked().degrees("vm")


def test_arrays_are_copies_that_cannot_be_changed():
    values = np.sin(T)
    recording = Recording.of(T, theta=values)
    values[0] = 99.0
    assert recording["theta"][0] == 0.0
    for array in (recording.time, recording["theta"]):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0
    with pytest.raises(TypeError):
        recording.channels["alpha"] = Channel(T, "rad")


def test_metadata_are_plain_data_of_its_own():
    given_metadata = {"seed": 1}
    recording = Recording.of(T, given_metadata, theta=T)
    given_metadata["seed"] = 2
    assert json.loads(json.dumps(recording.metadata)) == recording.metadata == {"seed": 1}


def test_comparing_recordings_is_no_accident_of_arrays():
    recording = tracked()
    assert recording == recording  # noqa: PLR0124
    assert recording != tracked()


def test_what_is_no_recording_is_refused(snapshot):
    recordings = [(T, T[:-1]), (T[:1], T[:1]), ([], []), (np.r_[T[:20], T[21:], 0.1], T), (T[::-1], T), (0 * T, T)]
    recordings += [(T, np.where(T[7] == T, np.nan, T)), (np.where(T[3] == T, np.inf, T), T), (T, T.reshape(25, 2))]
    recordings += [(T, ["a"] * 50), (T, None)]
    calls = [lambda time=time, theta=theta: Recording.of(time, theta=theta) for time, theta in recordings]
    calls += [lambda: Recording(T, {"theta": Channel(T, "deg")}), lambda: tracked().between(5, 6), Recording.load]
    assert refusals(calls) == snapshot


def test_a_part_counts_time_from_its_own_beginning():
    part = tracked().between(0.02, 0.04)
    np.testing.assert_allclose(part.time, np.arange(10) * 0.002, atol=1e-15)
    np.testing.assert_array_equal(part["theta"], np.sin(T[10:20]))
    assert part.metadata == METADATA


def test_a_part_counts_samples_that_were_held_or_lost_from_its_own_beginning():
    timing = {"held": [[8, 4], [15, 2], [18, 5], [30, 1]], "lost": [[9, 1], [19, 1]]}
    part = Recording.of(T, {"timing": timing}, theta=T).between(0.02, 0.04)
    assert part.metadata["timing"] == {"held": [[0, 2], [5, 2], [8, 2]], "lost": [[9, 1]]}


@pytest.mark.parametrize("sample_time", [0.002, 0.1, 1 / 3, 0.007])
def test_a_part_is_cut_at_samples_whatever_their_rounding(sample_time):
    t = np.arange(100) * sample_time
    recording = Recording.of(t, vm=np.arange(100))
    for first, last in ((0, 7), (3, 60), (49, 99), (17, 23)):
        part = recording.between(round(first * sample_time, 9), round(last * sample_time, 9))
        np.testing.assert_array_equal(part["vm"], np.arange(first, last))


# --- round trips -----------------------------------------------------------------------------------------------------

numbers = st.floats(-1e6, 1e6, allow_subnormal=False)
plain = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(2**53), 2**53)
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=8,
)
LAYOUTS = [
    {"theta"},
    {"alpha"},
    {"vm"},
    {"theta_ref", "theta", "alpha", "vm"},
    {"theta", "alpha", "vm"},
    {"theta_model", "theta", "alpha_model", "alpha", "vm"},
    {"theta_ref", "theta"},
]


@st.composite
def recordings(draw):
    size, sample_time = draw(st.integers(2, 20)), draw(st.sampled_from([0.001, 0.002, 0.01, 1 / 3]))
    start = draw(st.sampled_from([0.0, 5.0]))
    values = st.lists(numbers, min_size=size, max_size=size)
    channels = {name: draw(values) for name in sorted(draw(st.sampled_from(LAYOUTS)))}
    metadata = draw(st.dictionaries(st.text().filter(lambda key: key != "experiment"), plain, max_size=4))
    return Recording.of(start + np.arange(size) * sample_time, {"source": "test", **metadata}, **channels)


@settings(max_examples=40)
@given(recordings(), st.sampled_from([".mat", ".csv"]))
def test_saving_and_loading_gives_the_same_recording(tmp_path_factory, recording, ending):
    path = tmp_path_factory.mktemp("round trip") / f"recording{ending}"
    assert recording.save(path) == path
    read = Recording.load(path)
    assert_same(read, recording, 1e-9 if ending == ".csv" else 1e-12)
    assert read.metadata == recording.metadata


@pytest.mark.parametrize("ending", [".mat", ".csv", ".MAT", ".CSV"])
def test_provenance_is_kept(tmp_path, ending):
    path = tracked().save(tmp_path / f"a{ending}")
    assert Recording.load(path).metadata == METADATA


@pytest.mark.parametrize("ending", [".mat", ".csv"])
def test_time_in_a_file_is_counted_from_its_first_sample(tmp_path, ending):
    late = tracked(t=T + 40.0).save(tmp_path / f"a{ending}")
    np.testing.assert_allclose(Recording.load(late).time, T, atol=1e-9)


def test_a_file_without_provenance_is_said_to_come_from_its_name(tmp_path):
    savemat(tmp_path / "mine.mat", {"data_vm": np.column_stack([T, T])})
    (tmp_path / "mine.csv").write_text("t_s,vm_V\n0,1\n1,2\n")
    assert Recording.load(tmp_path / "mine.mat").metadata == {"source": "mine.mat"}
    assert Recording.load(tmp_path / "mine.csv").metadata == {"source": "mine.csv"}


def test_a_validation_in_csv_is_the_same(tmp_path):
    assert_same(Recording.load(validated().save(tmp_path / "v.csv")), validated(), 1e-9)


# --- the laboratory's layout -----------------------------------------------------------------------------------------


def test_a_mat_file_has_the_laboratorys_layout(tmp_path):
    content = loadmat(tracked().save(tmp_path / "a.mat"))
    assert {name for name in content if not name.startswith("__")} == {
        "data_theta",
        "data_alpha",
        "data_vm",
        "rotflex_metadata",
    }
    np.testing.assert_allclose(
        content["data_theta"], np.column_stack([T, np.degrees(0 * T + 0.3), np.degrees(np.sin(T))])
    )
    np.testing.assert_allclose(content["data_alpha"], np.column_stack([T, np.degrees(np.cos(T))]))
    np.testing.assert_allclose(content["data_vm"], np.column_stack([T, 2 * T]))
    assert json.loads(content["rotflex_metadata"][0]) == METADATA


def test_a_validations_mat_file_has_the_model_in_the_middle(tmp_path):
    content = loadmat(validated().save(tmp_path / "v.mat"))
    np.testing.assert_allclose(
        content["data_theta"], np.column_stack([T, np.degrees(np.cos(T)), np.degrees(np.sin(T))])
    )
    np.testing.assert_allclose(content["data_alpha"], np.column_stack([T, np.degrees(2 * T), np.degrees(T)]))
    assert_same(Recording.load(tmp_path / "v.mat"), validated())


def test_a_mat_file_is_of_version_5(tmp_path):
    header = tracked().save(tmp_path / "a.mat").read_bytes()[:128]
    assert header.startswith(b"MATLAB 5.0 MAT-file")
    assert header[124:128] == b"\x00\x01IM"


def test_a_log_in_the_laboratorys_layout_loads_as_it_is(tmp_path):
    reference, theta, alpha = 20 * np.sign(T - 0.03), 10 * T, -5 * T
    savemat(
        tmp_path / "log.mat",
        {
            "data_theta": np.column_stack([T, reference, theta]),
            "data_alpha": np.column_stack([T, alpha]),
            "data_theta_l": np.column_stack([T, reference, theta + alpha]),
            "data_vm": np.column_stack([T, 3 * T]),
            "something_else": "of no interest",
        },
    )
    recording = Recording.load(tmp_path / "log.mat")
    assert set(recording.channels) == {"theta_ref", "theta", "alpha", "vm"}
    np.testing.assert_allclose(recording["theta_ref"], reference * DEG)
    np.testing.assert_allclose(recording["theta"], theta * DEG)
    np.testing.assert_allclose(recording["alpha"], alpha * DEG)
    np.testing.assert_allclose(recording["vm"], 3 * T)


def test_a_validation_in_the_laboratorys_layout_needs_no_provenance(tmp_path):
    pairs = {"data_theta": np.column_stack([T, 2 * T, T]), "data_alpha": np.column_stack([T, 4 * T, 3 * T])}
    savemat(tmp_path / "v.mat", pairs)
    recording = Recording.load(tmp_path / "v.mat")
    assert set(recording.channels) == {"theta", "theta_model", "alpha", "alpha_model"}
    np.testing.assert_allclose(recording["alpha_model"], 4 * T * DEG)


def test_a_csv_file_is_in_degrees_and_can_be_read_by_a_person(tmp_path):
    lines = tracked().save(tmp_path / "a.csv").read_text(encoding="utf-8").splitlines()
    assert json.loads(lines[0].removeprefix("# ")) == METADATA
    assert lines[1] == "t_s,theta_ref_deg,theta_deg,alpha_deg,vm_V"
    assert float(lines[2].split(",")[1]) == pytest.approx(np.degrees(0.3))


def test_a_csv_file_may_come_from_a_spreadsheet(tmp_path):
    """With a byte order mark, angles in radians, and empty rows at the end."""
    (tmp_path / "a.csv").write_bytes(b"\xef\xbb\xbft_s,theta_rad,vm_V\r\n0,1,2\r\n0.5,3,4\r\n\r\n,,\r\n")
    recording = Recording.load(tmp_path / "a.csv")
    assert recording["theta"].tolist() == [1.0, 3.0]
    assert recording["vm"].tolist() == [2.0, 4.0]


def test_the_files_of_one_experiment_load_together(tmp_path):
    for name in ("theta", "alpha", "vm"):
        tracked().save(tmp_path / f"{name}.mat", variables=[f"data_{name}"])
    recording = Recording.load(*(tmp_path / f"{name}.mat" for name in ("theta", "alpha", "vm")))
    assert_same(recording, tracked())
    assert recording.metadata == METADATA
    assert set(Recording.load(tmp_path / "alpha.mat").channels) == {"alpha"}


def test_files_of_different_experiments_do_not(tmp_path):
    other_bench = {**METADATA, "bench": {"uri": "virtual", "seed": 8}}
    tracked().save(tmp_path / "theta.mat", variables=["data_theta"])
    tracked(other_bench).save(tmp_path / "alpha.mat", variables=["data_alpha"])
    tracked(t=T * 2).save(tmp_path / "slow.mat", variables=["data_vm"])
    tracked(t=T * 2).save(tmp_path / "theta_again.mat", variables=["data_theta"])
    with pytest.raises(RecordingError, match=r"alpha\.mat.*bench"):
        Recording.load(tmp_path / "theta.mat", tmp_path / "alpha.mat")
    with pytest.raises(RecordingError, match=r"slow\.mat.*data_vm.*data_theta"):
        Recording.load(tmp_path / "theta.mat", tmp_path / "slow.mat")
    with pytest.raises(RecordingError, match=r"theta_again\.mat.*data_theta"):
        Recording.load(tmp_path / "theta.mat", tmp_path / "theta_again.mat")


def test_the_real_log_loads_as_it_is(real_log, real_log_path):
    assert set(real_log.channels) == {"theta_ref", "theta", "alpha", "vm"}
    assert len(real_log) == 5001
    assert real_log.time[-1] == pytest.approx(10.0)
    assert real_log.sample_time == pytest.approx(0.002)
    assert np.abs(real_log.degrees("theta_ref")).max() == pytest.approx(30.0)
    assert np.abs(real_log.degrees("alpha")).max() == pytest.approx(9.7, abs=0.06)
    assert np.abs(real_log["vm"]).max() == pytest.approx(8.4, abs=0.05)
    assert real_log.metadata == {"source": real_log_path.name}
    for name in ("theta", "alpha"):
        counts = real_log.degrees(name) / (360 / 4096)
        np.testing.assert_allclose(counts, np.round(counts), atol=1e-6)


@pytest.mark.parametrize("ending", [".mat", ".csv"])
def test_the_real_log_survives_a_round_trip(real_log, tmp_path, ending):
    assert_same(Recording.load(real_log.save(tmp_path / f"log{ending}")), real_log, 1e-9)


# --- what cannot be saved --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "choices", "message"),
    [
        ("a.txt", {}, "saved as .mat or .csv"),
        ("a", {}, "saved as .mat or .csv"),
        ("a.mat", {"variables": ["data_beta"]}, "cannot give data_beta; it can give data_theta, data_alpha, data_vm"),
        ("a.csv", {"variables": ["data_vm"]}, "only with .mat"),
        ("no such folder/a.mat", {}, "cannot be written: No such file"),
        ("no such folder/a.csv", {}, "cannot be written: No such file"),
    ],
)
def test_impossible_saves_are_refused(tmp_path, name, choices, message):
    with pytest.raises(RecordingError, match=message):
        tracked().save(tmp_path / name, **choices)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("channels", "lost"),
    [
        ({"theta": T, "theta_ref": T, "theta_model": T, "alpha": T, "alpha_model": T}, "theta_ref"),
        ({"theta": T, "theta_model": T}, "theta_model"),
        ({"theta": T, "theta_ref": T, "alpha": T, "alpha_model": T}, "theta_ref"),
        ({"theta_ref": T}, "theta_ref"),
    ],
)
def test_a_mat_file_that_would_lose_a_channel_is_not_written(tmp_path, channels, lost):
    recording = Recording.of(T, **channels)
    with pytest.raises(RecordingError, match=f"no place here for {lost}; save as .csv"):
        recording.save(tmp_path / "a.mat")
    assert list(tmp_path.iterdir()) == []
    assert_same(Recording.load(recording.save(tmp_path / "a.csv")), recording, 1e-9)


@pytest.mark.parametrize("ending", [".mat", ".csv"])
def test_channels_that_files_do_not_know_are_not_dropped_in_silence(tmp_path, ending):
    recording = Recording(T, {"theta": Channel(T, "rad"), "current": Channel(T, "A")})
    with pytest.raises(RecordingError, match="current"):
        recording.save(tmp_path / f"a{ending}")


@pytest.mark.parametrize("ending", [".mat", ".csv"])
def test_metadata_that_are_no_plain_data_are_refused(tmp_path, ending):
    with pytest.raises(RecordingError, match="plain data"):
        tracked({"gain": np.array([1.0])}).save(tmp_path / f"a{ending}")
    assert list(tmp_path.iterdir()) == []


# --- nothing half-written --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("failure", [OSError("disk full"), KeyboardInterrupt()])
@pytest.mark.parametrize("ending", [".mat", ".csv"])
def test_a_save_that_fails_half_way_leaves_the_old_file_alone(tmp_path, monkeypatch, ending, failure):
    path = tracked().save(tmp_path / f"a{ending}")
    before = path.read_bytes()

    def half_way(*arguments, **_):
        target = arguments[0]
        if isinstance(target, str):
            with open(target, "wb") as file:
                file.write(b"MATLAB 5.0")
        raise failure

    monkeypatch.setattr("scipy.io.savemat", half_way)
    monkeypatch.setattr("rotflex.recording.csv.writer", half_way)
    expected = RecordingError if isinstance(failure, OSError) else type(failure)
    with pytest.raises(expected):
        validated().save(path)
    assert path.read_bytes() == before
    assert os.listdir(tmp_path) == [path.name]


# --- broken files ----------------------------------------------------------------------------------------------------

TABLE = np.column_stack([T, T])


def test_a_mat_file_that_is_no_recording_says_why(tmp_path, snapshot):
    contents = [{"other": TABLE}, {}, {"data_vm": T}, {"data_theta": np.column_stack([T] * 4)}]
    contents += [{"data_vm": unfit} for unfit in (np.zeros((5, 2, 2)), TABLE * 1j, "text", {"field": 1})]
    contents += [{"data_vm": TABLE[:1]}, {"data_vm": TABLE[::-1]}, {"data_vm": TABLE, "data_alpha": TABLE[:-1]}]
    contents += [{"data_alpha": np.where(TABLE[9] == TABLE, np.nan, TABLE)}]
    contents += [{"data_vm": TABLE, "rotflex_metadata": unfit} for unfit in ("{", "[1]", "[" * 50_000, 3.0)]

    def load(content):
        savemat(tmp_path / "broken.mat", content)
        Recording.load(tmp_path / "broken.mat")

    assert refusals([lambda content=content: load(content) for content in contents]) == snapshot
    with pytest.raises(RecordingError, match=r"broken\.mat"):
        load({"data_vm": np.zeros((0, 2))})


#: Tables in which the header, a row or the description is unfit.
BROKEN_TABLES = ["", "# {}\n", "time,theta_deg\n0,1\n1,2\n", "t_s,theta_deg\n", "t_s,theta_deg\n0,1\n"]
BROKEN_TABLES += ["t_s,theta_deg\n0,1\n1,2,3\n", "t_s,theta_deg\n0,1\n1\n", "t_s,theta_deg,vm_V\n0,1\n1,2\n"]
BROKEN_TABLES += ["t_s,theta_deg\n0,1\n1,two\n", "t_s;theta_deg\n0;1\n1;2\n", "t_s,theta_deg\n0,1\n1,nan\n"]
BROKEN_TABLES += ["t_s,theta_deg\n0,1\n1,1\n3,1\n", "t_s,theta_deg,theta_rad\n0,1,1\n1,1,1\n"]
BROKEN_TABLES += [f"t_s,{name}\n0,1\n1,1\n" for name in ("theta", "theta_V", "beta_deg")]
BROKEN_TABLES += [f"# {text}\nt_s,theta_deg\n0,1\n0.1,2\n" for text in ("not JSON", "[1]")]


def test_a_csv_file_that_is_no_recording_says_why(tmp_path, snapshot):
    def load(content):
        (tmp_path / "broken.csv").write_bytes(content)
        Recording.load(tmp_path / "broken.csv")

    assert refusals([lambda text=text: load(text.encode()) for text in BROKEN_TABLES]) == snapshot
    with pytest.raises(RecordingError, match=r"broken\.csv"):
        load(b"\xff\xfe\x00t_s")


def test_what_is_no_file_is_named(tmp_path):
    for ending in (".mat", ".csv"):
        (tmp_path / f"folder{ending}").mkdir()
        for name in (f"folder{ending}", f"missing{ending}"):
            with pytest.raises(RecordingError, match=name):
                Recording.load(tmp_path / name)


@settings(max_examples=60)
@given(st.data())
def test_a_mat_file_with_a_part_cut_off_or_damaged_never_gives_a_traceback_of_others(tmp_path_factory, data):
    """Its compressed content has a checksum, so that damage there is noticed."""
    folder = tmp_path_factory.mktemp("broken")
    whole = bytearray(tracked().save(folder / "whole.mat").read_bytes())
    if data.draw(st.booleans()):
        whole = whole[: data.draw(st.integers(0, len(whole) - 1))]
    else:
        place = data.draw(st.integers(140, len(whole) - 1))
        whole[place] ^= data.draw(st.integers(1, 255))
    (folder / "broken.mat").write_bytes(whole)
    try:
        recording = Recording.load(folder / "broken.mat")
    except RecordingError as error:
        assert "broken.mat" in str(error)
    else:  # only whole arrays at the end can be missing
        assert {"theta"} <= set(recording.channels) <= set(UNITS)


@settings(max_examples=60)
@given(st.binary(max_size=200), st.sampled_from([".mat", ".csv"]))
def test_rubbish_is_no_recording(tmp_path_factory, rubbish, ending):
    path = tmp_path_factory.mktemp("rubbish") / f"a{ending}"
    path.write_bytes(rubbish)
    with pytest.raises(RecordingError):
        Recording.load(path)
