"""Exchange with Octave, and so with MATLAB, whose files Octave reads and writes: a real one, both ways."""

import numpy as np
import pytest
from octave import octave

from rotflex import experiments, hil
from rotflex.errors import RecordingError
from rotflex.recording import Recording
from rotflex.units import DEG

T = np.arange(50) * 0.002
#: What the programs below save.
MADE = "t = (0:49)' * 0.002; theta = 20 * sin(t); alpha = 3 * cos(t); vm = 2 * t; "
MATRICES = "data_theta = [t 20*ones(50,1) theta]; data_alpha = [t alpha]; data_vm = [t vm]; "
#: Simulink's structure with time, as its scopes leave it.
STRUCTURES = (
    "data_theta.time = t; data_theta.signals = struct('values', {20*ones(50,1), theta}, 'label', {'ref', 'theta'}); "
    "data_alpha.time = t; data_alpha.signals.values = alpha; "
    "data_vm.time = t; data_vm.signals.values = vm; "
)
NAMED = "data_theta data_alpha data_vm"
USUAL = f"-v7 log.mat {NAMED}"
IN_ROWS = "data_theta = data_theta'; data_alpha = data_alpha'; data_vm = data_vm'; "
NESTED = "log.run.data_theta = data_theta; log.run.data_alpha = data_alpha; log.data_vm = data_vm; "
SAVED = {
    "version 5": (MATRICES, f"-v6 log.mat {NAMED}"),
    "version 7": (MATRICES, USUAL),
    "version 4": (MATRICES, f"-v4 log.mat {NAMED}"),
    "everything that was there": (MATRICES + "note = 'x'; list = {1, 'a'}; other.x = {}; ", "-v7 log.mat"),
    "a row for each signal": (MATRICES + IN_ROWS, USUAL),
    "as the workbook spells it once": (MATRICES + "data_Vm = data_vm; clear data_vm; ", "-v7 log.mat"),
    "structures with time": (STRUCTURES, USUAL),
    "two signals in one": (STRUCTURES + "data_theta.signals = struct('values', [20*ones(50,1) theta]); ", USUAL),
    "structures in structures, version 5": (STRUCTURES + NESTED, "-v6 log.mat log"),
    "single precision": (MATRICES + "data_theta = single(data_theta); ", USUAL),
}


@pytest.mark.parametrize("layout", SAVED)
def test_what_octave_saves_is_read(tmp_path, layout):
    program, how = SAVED[layout]
    octave(f"{MADE}{program} save {how}", tmp_path)
    read = Recording.load(tmp_path / "log.mat")
    assert set(read.channels) == {"theta_ref", "theta", "alpha", "vm"}
    np.testing.assert_allclose(read.time, T, atol=1e-8)
    np.testing.assert_allclose(read["theta"], 20 * np.sin(T) * DEG, atol=1e-7)
    np.testing.assert_allclose(read["theta_ref"], 20 * DEG)
    np.testing.assert_allclose(read["alpha"], 3 * np.cos(T) * DEG, rtol=1e-12)
    np.testing.assert_allclose(read["vm"], 2 * T, atol=1e-12)


@pytest.mark.parametrize(("how", "what"), [("-text", "text format"), ("-hdf5", "HDF5")])
def test_what_octave_saves_otherwise_is_told_with_what_to_do(tmp_path, how, what):
    octave(MADE + MATRICES + f"save {how} log.mat data_theta", tmp_path)
    with pytest.raises(RecordingError, match=rf"log\.mat.* {what}.* -v7"):
        Recording.load(tmp_path / "log.mat")


def test_two_arrays_of_one_name_are_told(tmp_path):
    octave(MADE + "one.data_vm = [t vm]; two.data_vm = [t 2*vm]; save -v7 log.mat one two", tmp_path)
    with pytest.raises(RecordingError, match=r"one\.data_vm.*two\.data_vm"):
        Recording.load(tmp_path / "log.mat")


def test_octave_reads_our_files_with_the_workbooks_names_and_shapes(tmp_path):
    with hil.open("virtual:?seed=3") as bench:
        recorded = experiments.free_decay(bench, duration=0.5, progress=False)
    recorded.save(tmp_path / "decay.mat")
    said = octave(
        "load decay.mat; printf('%d %d, %d %d, %d %d\\n', size(data_theta), size(data_alpha), size(data_vm)); "
        "printf('%s %s %s\\n', class(data_theta), class(data_vm), class(rotflex_metadata)); "
        "printf('%.17g\\n', max(data_theta(:,3)), data_alpha(end,2), sum(data_vm(:,2)), data_theta(2,1)); "
        "about = jsondecode(rotflex_metadata); printf('%s\\n', about.experiment);",
        tmp_path,
    ).splitlines()
    assert said[:2] == ["251 3, 251 2, 251 2", "double double char"]
    theta, alpha, volts, step = map(float, said[2:6])
    assert theta == recorded.degrees("theta").max()
    assert alpha == recorded.degrees("alpha")[-1]
    assert volts == pytest.approx(recorded["vm"].sum(), abs=1e-9)
    assert step == recorded.time[1]
    assert said[6] == "free decay"
