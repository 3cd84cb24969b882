"""Importing the package is quick: heavy libraries load where they are used."""

import importlib.util
import inspect
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


@pytest.mark.parametrize("room", ["rotflex", "rotflex.course.lab", "rotflex.experiments"])
def test_heavy_libraries_load_only_where_they_are_used(room):
    done = subprocess.run(
        [sys.executable, "-c", f"import sys, {room}; print(*sys.modules)"], check=True, capture_output=True, text=True
    )
    loaded = set(done.stdout.split())
    assert room in loaded
    assert loaded.isdisjoint(HEAVY)
    assert room != "rotflex" or not [name for name in loaded if name.startswith("rotflex.")]


def test_grading_loads_no_grammar_of_web_addresses():
    code = "import sys, labcourse.grading.batch as batch; print('jsonschema' in sys.modules, 'lark' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert done.stdout.split() == ["True", "False"]


ROOMS = ["design", "experiments", "figures", "greybox", "hil", "identification", "model", "recording", "response"]


@pytest.mark.parametrize("name", [*ROOMS, "signals", "simulation"])
def test_dir_shows_what_is_public_and_nothing_else(name):
    module = importlib.import_module(f"rotflex.{name}")
    assert dir(module) == sorted(module.__all__)
    for public in dir(module):
        thing = getattr(module, public)
        assert not inspect.ismodule(thing) and not public.startswith("_")
        assert getattr(thing, "__module__", "rotflex").startswith("rotflex") or public.isupper()


def test_dir_of_the_package_shows_modules_that_there_are():
    assert [name for name in dir(rotflex) if not name.startswith("_")] == sorted(rotflex._PUBLIC)
    assert all(importlib.util.find_spec(f"rotflex.{name}") for name in rotflex._PUBLIC)
    with pytest.raises(AttributeError):
        rotflex.experimnets  # noqa: B018
