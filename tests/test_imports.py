"""Importing the package is quick: heavy libraries load where they are used."""

import subprocess
import sys

import pytest

HEAVY = [
    "sympy",
    "matplotlib",
    "ipywidgets",
    "anywidget",
    "papermill",
    "sqlalchemy",
    "dask",
    "control",
    "tqdm",
    "typer",
]
HEAVY += ["scipy.io", "scipy.signal", "scipy.optimize"]


@pytest.mark.parametrize("room", ["rotflex", "rotflex.course.lab", "rotflex.experiments"])
def test_heavy_libraries_load_only_where_they_are_used(room):
    done = subprocess.run(
        [sys.executable, "-c", f"import sys, {room}; print(*sys.modules)"], check=True, capture_output=True, text=True
    )
    loaded = set(done.stdout.split())
    assert room in loaded
    assert loaded.isdisjoint(HEAVY)
    assert room != "rotflex" or not [name for name in loaded if name.startswith("rotflex.")]
