"""The sample recordings of the workbook's Table 6."""

import importlib.util

import numpy as np
import pytest
from checkout import ROOT

from rotflex.recording import Recording

DATA = ROOT / "data"
NAMES = [
    f"data_rotflex_{experiment}_{variable}.mat"
    for experiment, variables in {
        "sweep": ("theta", "alpha", "vm"),
        "val": ("theta", "alpha"),
        "fsf": ("theta", "alpha", "vm"),
        "psf": ("theta", "alpha", "vm"),
    }.items()
    for variable in variables
]


def make_data():
    specification = importlib.util.spec_from_file_location("make_data", ROOT / "tools" / "make_data.py")
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


def test_the_eleven_recordings_of_table_6_are_there():
    assert sorted(path.name for path in DATA.glob("*.mat")) == sorted(NAMES)
    assert len(NAMES) == 11


@pytest.mark.parametrize("name", NAMES)
def test_each_says_that_it_is_from_the_virtual_bench_and_from_which_seed(name):
    metadata = Recording.load(DATA / name).metadata
    assert metadata["source"] == "virtual bench"
    assert metadata["bench"]["seed"] == make_data().SEED


def test_they_are_what_the_script_makes(tmp_path):
    make_data().main(tmp_path)
    for name in NAMES:
        stored, made = Recording.load(DATA / name), Recording.load(tmp_path / name)
        assert list(stored.channels) == list(made.channels)
        for channel in stored.channels:
            # A rounding in the last bit, on another machine, may turn an encoder's count or two.
            difference = np.abs(stored[channel] - made[channel])
            assert np.sqrt(np.mean(difference**2)) <= 0.02 * np.sqrt(np.mean(stored[channel] ** 2)), channel
