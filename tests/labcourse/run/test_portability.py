"""What of a student's code is known to work at home only."""

import importlib.metadata

import pytest

from labcourse.run import portability
from labcourse.run.portability import foreign, not_packed, version

HOMES = {"course": ["my-course"], "numpy": ["numpy"], "PIL": ["Pillow"], "pandas": ["pandas"]}
HOMES |= {"shared": ["pandas", "numpy"]}
REQUIRES = {"my-course": ["NumPy>=1.26", "pillow (>=10)", 'pytest; extra == "test"'], "numpy": None, "pillow": []}


@pytest.fixture(autouse=True)
def installed(monkeypatch):
    """As if there were these distributions."""

    class Installed:
        def __init__(self, name):
            if name not in REQUIRES:
                raise importlib.metadata.PackageNotFoundError(name)
            self.requires = REQUIRES[name]

    monkeypatch.setattr(portability.importlib.metadata, "packages_distributions", lambda: HOMES)
    monkeypatch.setattr(portability.importlib.metadata, "distribution", Installed)


def test_what_is_installed_and_is_not_the_courses(monkeypatch, tmp_path):
    (tmp_path / "at_home_only.py").touch()
    monkeypatch.syspath_prepend(tmp_path)
    for source, names in (
        ("import pandas as pd", ["pandas"]),
        ("def f():\n    from pandas.io import json", ["pandas"]),
        ("import numpy, PIL.Image, json, course.sub, shared", []),  # they come with the course, or with Python
        ("import nowhere", []),  # the run will say so
        ("import helper", []),
        ("from . import pandas", []),
        ("%pip install pandas", []),
        ("%matplotlib inline\nimport pandas", ["pandas"]),
        ("import at_home_only, __main__", ["at_home_only"]),  # on the path, and of no distribution
        ("import pytest_thing, pandas.x\nif x:\n    import at_home_only", ["at_home_only", "pandas"]),
    ):
        assert foreign([source], ["helper"], ["course"]) == names
    assert foreign(["import pandas"], [], ["unknown"]) == []  # it is not known what that course brings
    monkeypatch.setitem(HOMES, "pytest", ["pytest"])
    assert foreign(["import pytest"], [], ["course"]) == ["pytest"]  # a requirement of an extra is not brought


@pytest.mark.parametrize(
    ("text", "read"), [("3.12.1", (3, 12)), ("3.9", (3, 9)), ("2.7", None), ("3.1234", None), (3.12, None), ("", None)]
)
def test_versions_are_read_of_whatever_stands_there(text, read):
    assert version(text) == read


def test_files_that_are_at_home_only(tmp_path):
    work = tmp_path / "work"
    work.mkdir()
    for name in ("mine.npz", "large.csv", "../outside.npz"):
        (work / name).touch()
    source = "np.load('mine.npz'); open('./mine.npz'); open('large.csv'); p = '../outside.npz'; open('no', '.')"
    assert {*not_packed(source, work, {"mine.npz"})} == {"large.csv", "../outside.npz"}
    for name in ("helper", "pandas", "json", "packed"):
        (tmp_path / f"{name}.py").touch()
    imports = "import helper.sub, pandas, json, packed, numpy"
    assert [*not_packed(imports, work, {"packed.py"})] == ["../helper.py"]
