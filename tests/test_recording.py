"""Recordings: what they hold, the files they are kept in, and files that are broken."""

from __future__ import annotations

import json
import sys
from xml.etree import ElementTree

import h5py
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.io import loadmat, savemat

from rotflex import identification
from rotflex.errors import IdentificationError, RecordingError, UnknownColumns
from rotflex.recording import UNITS, Channel, Recording
from rotflex.units import DEG

T = np.arange(50) * 0.002
METADATA = {
    "source": "virtual bench",
    "experiment": "tracking",
    "bench": {"uri": "virtual", "seed": 7, "arm_position": 2},
    "sample_time": 0.002,
    "software": "rotflex 0.1.0",
    "note": "λ “quoted” 12%\n",
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


def save_73(path, content):
    """A file as ``save -v7.3`` leaves it: columns first, text as numbers, arrays of structures by reference."""
    with h5py.File(path, "w", userblock_size=512) as file:
        put_73(file, content, file.create_group("#refs#"))
    with path.open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")


def put_73(group, content, refs):
    for name, value in content.items():
        if isinstance(value, dict):
            put_73(group.create_group(name), value, refs)
        elif isinstance(value, list):
            put_73(refs, {f"{place}": one["values"] for place, one in enumerate(value)}, refs)
            places = [[refs[f"{place}"].ref] for place in range(len(value))]
            group.create_group(name).create_dataset("values", data=places, dtype=h5py.ref_dtype)
        elif isinstance(value, str):
            group[name] = np.array([list(value.encode())], dtype=np.uint16).T
            group[name].attrs["MATLAB_class"] = np.bytes_("char")
        else:
            group[name] = np.atleast_2d(value).T


def test_channels_are_read_by_name_in_si_units():
    recording = tracked()
    np.testing.assert_array_equal(recording["theta"], np.sin(T))
    np.testing.assert_allclose(recording.degrees("theta"), np.degrees(np.sin(T)))
    assert recording.channels["vm"].unit == "V"
    assert recording.sample_time == pytest.approx(0.002)
    assert len(recording) == 50
    assert "alpha" in recording and "alpha_model" not in recording


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


@pytest.mark.parametrize(
    ("time", "theta", "named"),
    [
        (T, T[:-1], "'theta'.*49.*50"),
        (T[:1], T[:1], "two samples.* 1"),
        (np.where(T[20] == T, 0.038, T), T, "not increase.*0.038 s.*0.038 s"),
        (T, np.where(T[7] == T, np.nan, T), "'theta'.*not finite.* 7"),
        (np.where(T[3] == T, np.inf, T), T, "time.*not finite.* 3"),
        (T, T.reshape(25, 2), r"'theta'.*one-dimensional.*\(25, 2\)"),
        (T, ["a"] * 50, "'theta'.*array of numbers"),
    ],
)
def test_what_is_no_recording_is_refused(time, theta, named):
    with pytest.raises(RecordingError, match=named):
        Recording.of(time, theta=theta)


def test_other_units_no_part_and_no_file_are_refused():
    with pytest.raises(RecordingError, match=r"'theta'.*deg.* rad"):
        Recording(T, {"theta": Channel(T, "deg")})
    with pytest.raises(RecordingError, match=r"between 5 s.*0\.098"):
        tracked().between(5, 6)
    with pytest.raises(RecordingError, match="at least one file"):
        Recording.load()
    for name in ("missing.mat", "missing.csv"):
        with pytest.raises(RecordingError, match=name):
            Recording.load(name)


def test_a_part_counts_samples_that_were_held_or_lost_from_its_own_beginning():
    timing = {"held": [[8, 4], [15, 2], [18, 5], [30, 1]], "lost": [[9, 1], [19, 1]]}
    part = Recording.of(T, {"timing": timing}, theta=T).between(0.02, 0.04)
    assert part.metadata["timing"] == {"held": [[0, 2], [5, 2], [8, 2]], "lost": [[9, 1]]}


@pytest.mark.parametrize("sample_time", [0.002, 0.1, 1 / 3, 0.007])
def test_a_part_is_cut_at_samples_whatever_their_rounding_and_counts_time_from_its_own_beginning(sample_time):
    t = np.arange(100) * sample_time
    recording = Recording.of(t, METADATA, vm=np.arange(100))
    for first, last in ((0, 7), (3, 60), (49, 99), (17, 23)):
        part = recording.between(round(first * sample_time, 9), round(last * sample_time, 9))
        np.testing.assert_array_equal(part["vm"], np.arange(first, last))
        np.testing.assert_allclose(part.time, np.arange(last - first) * sample_time, atol=1e-9)
        assert part.metadata == METADATA


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
LAYOUTS = ["theta", "alpha", "vm", "theta_ref theta", "theta alpha vm", "theta_ref theta alpha vm"]
LAYOUTS += ["theta_model theta alpha_model alpha vm", "theta theta_ref theta_model alpha alpha_model", "theta_ref"]


@st.composite
def recordings(draw):
    size, sample_time = draw(st.integers(2, 20)), draw(st.sampled_from([0.001, 0.002, 0.01, 1 / 3]))
    start = draw(st.sampled_from([0.0, 5.0]))
    values = st.lists(numbers, min_size=size, max_size=size)
    channels = {name: draw(values) for name in draw(st.sampled_from(LAYOUTS)).split()}
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


def test_a_mat_file_has_the_laboratorys_layout(tmp_path):
    content = loadmat(tracked().save(tmp_path / "a.mat"))
    assert {name for name in content if not name.startswith("__")} == {*DATA, "rotflex_metadata"}
    assert_columns(content["data_theta"], T, np.degrees(0 * T + 0.3), np.degrees(np.sin(T)))
    assert_columns(content["data_alpha"], T, np.degrees(np.cos(T)))
    assert_columns(content["data_vm"], T, 2 * T)
    assert json.loads(content["rotflex_metadata"][0]) == METADATA


DATA = ("data_theta", "data_alpha", "data_vm")


def assert_columns(table, *columns):
    np.testing.assert_allclose(table, np.column_stack(columns))


def test_a_validations_mat_file_has_the_model_in_the_middle(tmp_path):
    content = loadmat(validated().save(tmp_path / "v.mat"))
    assert_columns(content["data_theta"], T, np.degrees(np.cos(T)), np.degrees(np.sin(T)))
    assert_columns(content["data_alpha"], T, np.degrees(2 * T), np.degrees(T))
    assert_same(Recording.load(tmp_path / "v.mat"), validated())


def test_a_log_in_the_laboratorys_layout_loads_as_it_is(tmp_path):
    """Without a word of where it comes from, and with arrays that are of no interest."""
    written = Recording.of(T, {"source": "log.mat"}, theta_ref=np.sign(T - 0.03), theta=T, alpha=-T, vm=3 * T)
    columns = {name: written.degrees(name) for name in ("theta_ref", "theta", "alpha")} | {"vm": 3 * T}
    places = {"data_theta": ["theta_ref", "theta"], "data_alpha": ["alpha"], "data_vm": ["vm"]}
    places |= {"data_theta_l": ["theta_ref", "alpha"]}
    tables = {place: np.column_stack([T, *map(columns.get, names)]) for place, names in places.items()}
    savemat(tmp_path / "log.mat", {**tables, "something_else": "text"})
    recording = Recording.load(tmp_path / "log.mat")
    assert_same(recording, written)
    assert recording.metadata == {"source": "log.mat"}


def test_a_csv_file_is_in_degrees_and_can_be_read_by_a_person(tmp_path):
    lines = tracked().save(tmp_path / "a.csv").read_text(encoding="utf-8").splitlines()
    assert json.loads(lines[0].removeprefix("# ")) == METADATA
    assert lines[1] == "t_s,theta_ref_deg,theta_deg,alpha_deg,vm_V"
    assert float(lines[2].split(",")[1]) == pytest.approx(np.degrees(0.3))


@pytest.mark.parametrize(
    ("name", "table", "columns"),
    [
        ("a.csv", "t_s;theta_deg;vm_V\n0;1,5;-2\n0,002;3;4e0\n", ()),
        ("a.csv", "Time (s), theta (deg), V_m (V)\n0, 1.5, -2\n0.002, 3, 4\n", ()),
        ("a.csv", "t_s;theta_deg;vm_V;\n0;1,5;-2;\n0,002;3;4; \n", ()),
        ("a.csv", "Zeit;W;U\n0;1,5;-2\n0,002;3;4\n", ("t_s", "theta_deg", "vm_V")),
        ("a.csv", "time [ms];Theta [°];Vm [mV]\n0;1,5;-2000\n2;3;4000\n", ()),
        ("a.csv", f"t_s,theta_rad,vm_V\n0,{1.5 * DEG},-2\n0.002,{3 * DEG},4\n", ()),
        ("a.csv", 'run 3, 2025-05-02\n"Time","Theta","Vm"\n"s","deg","V"\n0,1.5,-2\n0.002,3,4\n', ()),
        ("a.dat", "% Bench 2\n% time (ms)  theta (deg)  vm (V)\n 0  1,5  -2\n 2  3,0  4\n% end\n", ()),
        ("a.log", "0 on 1.5 -2 ok\n2e-3 off 3 4 late\n", "t_s=1,theta_deg=3,vm_V=4"),
        ("a.csv", "time,pot,u,theta_deg\n0,1.5,-2,9\n0.002,3,4,9\n", "t_s=time, theta_deg=pot, vm_V=3"),
        ("a.tsv", "0\t1,5\t-2\n0,002\t3\t4\n", "t_s,theta_deg,vm_V"),
        ("a.txt", "0\t9\t1.5\t-2\n2e-3\t9\t3\t4\n", "time (s), -, theta (deg), V_m (V)"),
    ],
)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "cp1252", "utf-16"])
def test_a_table_is_read_as_people_have_it(tmp_path, name, table, columns, encoding):
    (tmp_path / name).write_bytes(table.encode(encoding))
    recording = Recording.load(tmp_path / name, columns=columns)
    assert set(recording.channels) == {"theta", "vm"} and recording.metadata == {"source": name}
    np.testing.assert_allclose(recording.time, [0, 0.002])
    np.testing.assert_allclose(recording.degrees("theta"), [1.5, 3])
    np.testing.assert_allclose(recording["vm"], [-2, 4])


@settings(max_examples=80)
@given(
    recordings().filter(lambda recording: all(name in UNITS for name in recording.channels)),
    st.sampled_from([" ", "\t", ",", ";", ", ", "  "]),
    st.sampled_from(["# ", "% ", ""]),
    st.sampled_from(["%.18e", "%.17g"]),
    st.sampled_from(["\n", "\r\n"]),
    st.sampled_from([("_", ""), (" (", ")"), (" [", "]"), ("", "")]),
)
def test_what_numpys_savetxt_writes_is_read_back(tmp_path_factory, recording, separator, sign, fmt, newline, about):
    """In any dialect; where headings have no units, or there are none, ``columns`` says what they are."""
    path = tmp_path_factory.mktemp("savetxt") / "log.txt"
    names = {"t": "s"} | {name: "V" if name == "vm" else "deg" for name in recording.channels}
    table = [recording.time] + [recording["vm"] if n == "vm" else recording.degrees(n) for n in recording.channels]
    headings = [f"{name}{about[0]}{unit * bool(about[0])}{about[1]}" for name, unit in names.items()]
    header = {"header": (separator.strip(" ") or " ").join(headings), "comments": sign} if about[0] or sign else {}
    np.savetxt(path, np.column_stack(table), fmt, delimiter=separator, newline=newline, **header)
    if about[0]:
        read = Recording.load(path)
    else:
        with pytest.raises(UnknownColumns):
            Recording.load(path)
        read = Recording.load(path, columns=[f"{name}_{unit}" for name, unit in names.items()])
    assert_same(read, recording, 1e-9)


def test_where_headings_do_not_say_what_columns_are_there_is_a_guess(tmp_path):
    path = tmp_path / "a.txt"
    np.savetxt(path, np.column_stack([T, 20 * np.sin(T * 40), T * 1000, 2 + 0 * T]), header="n u t_ms $\\theta$")
    with pytest.raises(UnknownColumns) as raised:
        Recording.load(path)
    assert raised.value.guess == {"t": "3 ms", "theta": "4 rad", "vm": "2 V"}
    lines = [line.split() for line in str(raised.value).splitlines()]
    assert ["3", "t_ms", "0", "2", "4", "0", "98"] in lines  # number, name, first values, least, largest
    np.savetxt(path, np.column_stack([T * 1000, 20 * np.sin(T * 40), np.sin(T)]))
    with pytest.raises(UnknownColumns, match="columns='t_ms=1,theta_deg=2,alpha_deg=3'"):
        Recording.load(path)


@pytest.mark.parametrize(
    ("columns", "words"),
    [
        ("t_s=1,theta_deg", "'theta_deg': no column"),
        ("t_s=1,theta_deg=4", "'theta_deg=4': no column"),
        ("t_s=1,theta_deg=2,theta_rad=3", "two columns for theta"),
        ("theta_deg=2", r"headed t_s.*theta_deg=2"),
        ("t_s=1,theta=2", "'theta' should be one of"),
    ],
)
def test_columns_that_are_not_there_are_refused(tmp_path, columns, words):
    np.savetxt(tmp_path / "a.txt", np.column_stack([T, T, T]))
    with pytest.raises(RecordingError, match=words):
        Recording.load(tmp_path / "a.txt", columns=columns)


@pytest.mark.parametrize("save", [savemat, save_73])
def test_vectors_and_structures_of_matlab_under_any_name_are_columns(tmp_path, save):
    path = tmp_path / "log.mat"
    structure = {"time": T * 1000, "signals": {"values": np.column_stack([10 * T, 2 * T])}}
    content = {"theta_deg": 10 * T, "t_s": T, "gain": np.eye(2)}
    save(path, content)
    np.testing.assert_allclose(Recording.load(path).degrees("theta"), 10 * T)
    save(path, {**content, "run": {"log": structure}, "n": np.arange(50, dtype=np.uint8)})
    value = "run.log.signals.values"
    read = Recording.load(path, columns=f"t_ms=run.log.time,theta_deg={value}(1),vm_V={value}(2)")
    np.testing.assert_allclose(read.time, T, atol=1e-12)
    np.testing.assert_allclose(read.degrees("theta"), 10 * T)
    np.testing.assert_allclose(read["vm"], 2 * T)


@pytest.mark.parametrize("ending", [".m", ".tdms", ".bin"])
def test_what_is_no_table_is_named_as_what_it_is(tmp_path, ending):
    (tmp_path / f"log{ending}").write_bytes(b"t = 0:0.002:1;")
    words = {".m": "MATLAB.*save", ".tdms": "LabVIEW.*npTDMS", ".bin": "fromfile"}
    with pytest.raises(RecordingError, match=rf"log\{ending} is a?.*{words[ending]}"):
        Recording.load(tmp_path / f"log{ending}")


UNEVEN = np.cumsum([0.0] + [0.002, 0.003, 0.002] * 100)


def test_an_uneven_recording_is_refused_where_its_sample_time_counts_and_resampled(tmp_path):
    about = {"timing": {"late": 3, "missed": 0, "held": [[1, 3]], "drift": 0.0}, "note": "mine"}
    uneven = Recording.of(UNEVEN + 5, about, theta=3 * UNEVEN, vm=1 - UNEVEN)
    with pytest.raises(RecordingError, match=r"not evenly spaced.*5\.002 s.*5\.005 s.*resampled"):
        _ = uneven.sample_time
    with pytest.raises(IdentificationError, match="resampled"):
        identification.frequency_response(uneven, "vm", "theta")
    even = uneven.resampled(0.001)
    assert even.sample_time == pytest.approx(0.001) and len(even) == 701 and "unevenly" in repr(uneven)
    np.testing.assert_allclose(even["theta"], 3 * even.time, atol=1e-12)  # a straight line stays one
    np.testing.assert_allclose(even["vm"], 1 - even.time, atol=1e-12)
    resampled = {"method": "linear", "from": pytest.approx(0.002)}
    timing = {"late": 7, "missed": 0, "drift": 0.0}
    assert even.metadata == {"note": "mine", "resampled": resampled, "timing": timing, "sample_time": 0.001}
    assert Recording.load(even.save(tmp_path / "even.csv")).sample_time == pytest.approx(0.001)


def test_a_gap_is_not_bridged():
    gap = np.r_[T[:20], T[22:]]
    assert len(Recording.of(np.r_[T[:20], T[21:]], theta=gap[:1].repeat(49)).resampled(0.002)) == 50  # two steps
    with pytest.raises(RecordingError, match=r"between t = 0\.038 s and 0\.044 s"):
        Recording.of(gap, theta=gap).resampled(0.002)


@settings(max_examples=40)
@given(recordings())
def test_resampling_at_its_own_rate_changes_nothing(recording):
    again = recording.resampled(recording.sample_time)
    assert len(again) == len(recording)
    for name, channel in recording.channels.items():
        np.testing.assert_allclose(again[name], channel.values, atol=1e-9 * np.abs(channel.values).max())


TO_FILE = np.vstack([T, 20 + 0 * T, 10 * T, 2 * T])


@pytest.mark.parametrize("save", [savemat, save_73])
def test_the_matrix_of_simulinks_to_file_asks_for_the_names_of_its_rows(tmp_path, save):
    path = tmp_path / "ans.mat"
    save(path, {"ans": TO_FILE, "K": np.eye(2)})
    with pytest.raises(UnknownColumns, match=r"(?s)ans\.mat: .*'ans\(1\)'.* 4 ans\(4\).*--columns"):
        Recording.load(path)
    recording = Recording.load(path, columns="t_s,-,theta_deg,vm_V")
    np.testing.assert_allclose(recording.degrees("theta"), 10 * T)
    np.testing.assert_allclose(recording["vm"], 2 * T)
    with pytest.raises(RecordingError, match=r"has 4 columns, and columns= names 3"):
        Recording.load(path, columns="t_s,theta_deg,vm_V")
    with pytest.raises(RecordingError, match="one file at a time"):
        Recording.load(path, path, columns="t_s,-,theta_deg,vm_V")


def test_a_file_of_matlabs_format_73_is_read(tmp_path):
    signals = [{"values": 20 + 0 * T}, {"values": 10 * T}]
    content = {"data_theta": {"time": T, "signals": signals}, "run": {"data_alpha": np.column_stack([T, 3 * T])}}
    save_73(tmp_path / "v73.mat", content | {"data_vm": np.column_stack([T, 2 * T]), "rotflex_metadata": '{"seed": 7}'})
    recording = Recording.load(tmp_path / "v73.mat")
    assert set(recording.channels) == {"theta_ref", "theta", "alpha", "vm"} and recording.metadata["seed"] == 7
    np.testing.assert_allclose(recording.degrees("theta"), 10 * T)
    np.testing.assert_allclose(recording.degrees("alpha"), 3 * T)
    np.testing.assert_allclose(recording["vm"], 2 * T)


def test_format_73_needs_an_extra_and_a_whole_file(tmp_path, monkeypatch):
    save_73(tmp_path / "v73.mat", {"data_vm": np.column_stack([T, 2 * T])})
    (tmp_path / "broken.mat").write_bytes((tmp_path / "v73.mat").read_bytes()[:900])
    with pytest.raises(RecordingError, match=r"broken\.mat .*7\.3.* -v7"):
        Recording.load(tmp_path / "broken.mat")
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(RecordingError, match=r"v73\.mat .*7\.3.*rotflex\[hdf5\].* -v7"):
        Recording.load(tmp_path / "v73.mat")


def test_the_files_of_one_experiment_load_together(tmp_path):
    paths = [tracked().save(tmp_path / f"{name}.mat", variables=[name]) for name in DATA]
    recording = Recording.load(*paths)
    assert_same(recording, tracked())
    assert recording.metadata == METADATA
    assert set(Recording.load(paths[1]).channels) == {"alpha"}


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


@pytest.mark.parametrize(
    ("name", "choices", "message"),
    [
        ("a.txt", {}, "saved as .mat or .csv"),
        ("a.mat", {"variables": ["data_beta"]}, "cannot give data_beta; it can give data_theta, data_alpha, data_vm"),
        ("a.csv", {"variables": ["data_vm"]}, "only with .mat"),
        ("no such folder/a.mat", {}, "cannot be written: No such file"),
    ],
)
def test_impossible_saves_are_refused(tmp_path, name, choices, message):
    with pytest.raises(RecordingError, match=message):
        tracked().save(tmp_path / name, **choices)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("ending", [".mat", ".csv"])
def test_a_file_keeps_any_channel_with_its_unit(tmp_path, ending):
    own = {
        "theta": (T, "rad"),
        "motor current": (2 * T, "A"),
        "t": (3 * T, "s"),
        "x, hat": (4 * T, "rad"),
        "gain": (T, ""),
    }
    recording = Recording(T, {name: Channel(*one) for name, one in own.items()}, {"note": "mine"})
    again = Recording.load(recording.save(tmp_path / f"a{ending}"))
    assert_same(again, recording, 1e-9)
    assert {name: one.unit for name, one in again.channels.items()} == {name: unit for name, (_t, unit) in own.items()}
    assert {**again.metadata, "source": ""} == {"note": "mine", "source": ""}
    if ending == ".mat":
        part = Recording.load(recording.save(tmp_path / "part.mat", variables=["data_theta"]))
        assert list(part.channels) == ["theta"]
        np.testing.assert_array_equal(loadmat(tmp_path / "a.mat")["rotflex_other"][:, 1], 2 * T)


@pytest.mark.parametrize("ending", [".mat", ".csv"])
def test_what_a_file_cannot_hold_is_not_dropped_in_silence(tmp_path, ending):
    if ending == ".csv":
        with pytest.raises(RecordingError, match="tab"):
            Recording(T, {"one;two": Channel(T, "A")}).save(tmp_path / "a.csv")
    with pytest.raises(RecordingError, match="plain data"):
        tracked({"gain": np.array([1.0])}).save(tmp_path / f"a{ending}")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("said", [1, [["a"]], [["a", 1]], [["a", "A"], ["b", "B"]]])
@pytest.mark.parametrize("ending", [".mat", ".csv"])
def test_a_description_that_fits_no_channels_is_a_recording_error(tmp_path, ending, said):
    if ending == ".csv":
        path = tmp_path / "a.csv"
        path.write_text(f"# {json.dumps({'other_channels': said})}\nt_s,theta_ref_m\n0,1\n1,2\n", encoding="utf-8")
    else:
        path = tmp_path / "a.mat"
        about = json.dumps({"other_channels": said})
        savemat(path, {"rotflex_other": np.column_stack([T, T]), "rotflex_metadata": about})
    with pytest.raises(RecordingError):
        Recording.load(path)


TABLE = np.column_stack([T, T])


NOT_JSON = "not JSON"


@pytest.mark.parametrize(
    ("content", "named"),
    [
        ({"other": TABLE}, r"'other\(1\)' should be one of t, "),
        ({"K": np.eye(4)}, "data_theta, data_alpha, data_vm, and no vectors"),
        ({"x": np.sin(90 * TABLE) @ np.eye(2, 4)}, r"no column grows.* time.*Recording\.of(?s:.*) 4 x\(4\)"),
        ({"data_vm": T}, r"data_vm is \(50,\)"),
        ({"data_theta": np.column_stack([T] * 4)}, r"data_theta.*\(50, 4\).*2 more"),
        ({"data_vm": TABLE * 1j}, "data_vm, and no vectors of 20 real numbers"),
        ({"data_vm": {"time": T, "signals": {"values": T[:-1]}}}, r"data_vm is \(50,\) and \(49,\).*structure"),
        ({"data_vm": TABLE, "run": {"data_vm": 2 * TABLE}}, r"data_vm twice, as data_vm and as run\.data_vm"),
        ({"data_vm": np.zeros((0, 2))}, ""),
        ({"data_vm": TABLE, "data_alpha": TABLE[:-1]}, "data_vm.*time axis.*data_alpha"),
        ({"data_alpha": np.where(TABLE[9] == TABLE, np.nan, TABLE)}, "not finite.* 9"),
        ({"data_vm": TABLE, "rotflex_metadata": "[" * 50_000}, NOT_JSON),
        ({"data_vm": TABLE, "rotflex_metadata": "[1]"}, "a JSON object"),
        (b"", "no row of numbers"),
        (b"Time: 5 Position: 3\nTime: 6 Position: 4\n", "no row of numbers.*'Time: 5 Position: 3'"),
        (b"theta_deg,vm_V\n0,1\n1,2\n", r"headed t_s.*\['theta_deg', 'vm_V'\]"),
        (b"time (s),alpha (V)\n0,1\n1,2\n", r"'alpha \(V\)' should be one of.*theta_deg"),
        (b"t_s;theta_deg\n0;1,5\n1;1.234,5\n", "2 numbers.*1.234.5"),
        (b"0\t1\t2\n1\t2\t3\n", "no headings(?s:.*)  3 (?s:.*)columns=.*--columns 't_ms=1,"),
        (b"t_s,theta_deg\n", "no row of numbers.*'t_s,theta_deg'"),
        (b"t_s,theta_deg\n0,1\n", "two samples.* 1"),
        (b"t_s,theta_deg,vm_V\n0,1,\n1,1,2\n", "'vm'.*not finite.* 0"),
        (b"t_s,theta_deg\n0,1\n1,1,5\n", "2 numbers.*columns changed"),
        (b"t_s,theta_deg\n0,1\n1,two\n", "2 numbers.*'two'"),
        (b"t_s,theta_deg\n0,1\n1,nan\n", "'theta'.*not finite.* 1"),
        (b"t_s,theta_deg,theta_rad\n0,1,1\n1,1,1\n", "two.*for theta"),
        (b"t_s,theta\n0,1\n1,1\n", "'theta'.*theta_ref.*theta_deg"),
        (b"# {not JSON}\nt_s,theta_deg\n0,1\n0.1,2\n", NOT_JSON),
        (b"0\x00\x01\x02", "no text.*export"),
    ],
)
def test_a_file_that_is_no_recording_says_why(tmp_path, content, named):
    path = tmp_path / ("broken.csv" if isinstance(content, bytes) else "broken.mat")
    path.write_bytes(content) if isinstance(content, bytes) else savemat(path, content)
    with pytest.raises(RecordingError, match=rf"broken\{path.suffix}.*{named}"):
        Recording.load(path)


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


def test_a_notebook_shows_a_table_of_the_channels_with_angles_in_degrees():
    t = np.arange(5000) * 0.002
    recording = Recording(t, {"theta": Channel(np.sin(t) * 20 * DEG, "rad"), "a<b": Channel(3 * t, "A")})
    table = ElementTree.fromstring(recording._repr_html_())
    theta, other = ([cell.text for cell in row] for row in table.findall("tbody/tr"))
    assert other == ["a<b", "A", "0", "29.99", "15", "29.99"]
    assert theta[:2] == ["theta", "deg"] and float(theta[3]) == pytest.approx(20, abs=0.01)


def test_a_response_of_python_control_has_what_acted_as_inputs_and_the_rest_as_outputs():
    time = np.arange(5) * 0.002
    names = ("theta_ref", "theta", "alpha", "vm")
    signals = {name: np.linspace(0, n, 5) for n, name in enumerate(names, start=1)}
    recorded = Recording.of(time, **signals)
    found = recorded.to_response()
    assert (found.input_labels, found.output_labels) == (["theta_ref", "vm"], ["theta", "alpha"])
    np.testing.assert_array_equal(found.time, time)
    for row, name in enumerate(found.input_labels):
        np.testing.assert_array_equal(found.inputs[row], signals[name])
    for row, name in enumerate(found.output_labels):
        np.testing.assert_array_equal(found.outputs[row], signals[name])
    alone = Recording.of(time, theta=signals["theta"]).to_response()
    assert alone.output_labels == ["theta"] and not alone.ninputs
    with pytest.raises(RecordingError, match="needs an output beside vm"):
        Recording.of(time, vm=signals["vm"]).to_response()


def test_a_table_of_pandas_has_a_column_for_each_channel():
    pandas = pytest.importorskip("pandas", reason="pandas is not installed")
    table = Recording.of([0.0, 0.002], theta=[1.0, 2.0], vm=[3.0, 4.0]).to_pandas()
    expected = pandas.DataFrame({"theta": [1.0, 2.0], "vm": [3.0, 4.0]}, index=pandas.Index([0.0, 0.002], name="time"))
    pandas.testing.assert_frame_equal(table, expected)


def test_without_pandas_there_is_no_table_but_a_way_to_one(monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(RecordingError, match="pip install pandas"):
        Recording.of([0.0, 0.002], theta=[1.0, 2.0]).to_pandas()
