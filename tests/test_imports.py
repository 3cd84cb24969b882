"""Importing the package is quick: heavy libraries load where they are used."""

import importlib.util
import subprocess
import sys

import pytest

import rotflex

HEAVY = [
    "sympy",
    "matplotlib",
    "ipywidgets",
    "anywidget",
    "sqlalchemy",
    "dask",
    "control",
    "tqdm",
    "typer",
]
HEAVY += ["scipy.io", "scipy.signal", "scipy.optimize"]
#: Of these, showing the help needs none.
OF_A_COMMAND = ["numpy", "scipy", "nbformat", "jinja2", "pydantic", "rotflex.course.lab"]
OF_A_COMMAND += ["labcourse.grading.reports.grades"]


@pytest.mark.parametrize(
    "room", ["rotflex", "rotflex.course.lab", "rotflex.experiments", "rotflex.widgets", "rotflex.cli"]
)
def test_heavy_libraries_load_only_where_they_are_used(room):
    done = subprocess.run(
        [sys.executable, "-c", f"import sys, {room}; print(*sys.modules)"], check=True, capture_output=True, text=True
    )
    loaded = set(done.stdout.split())
    assert room in loaded
    heavy = {*HEAVY, *OF_A_COMMAND} - {"typer"} if room == "rotflex.cli" else HEAVY
    assert loaded.isdisjoint(heavy)
    assert room != "rotflex" or not [name for name in loaded if name.startswith("rotflex.")]


def test_grading_loads_no_grammar_of_web_addresses():
    code = "import sys, labcourse.grading.batch as batch; print('jsonschema' in sys.modules, 'lark' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert done.stdout.split() == ["True", "False"]


def test_dir_of_the_package_shows_modules_that_there_are():
    assert [name for name in dir(rotflex) if not name.startswith("_")] == sorted(rotflex._PUBLIC)
    assert all(importlib.util.find_spec(f"rotflex.{name}") for name in rotflex._PUBLIC)
    with pytest.raises(AttributeError):
        rotflex.experimnets  # noqa: B018
