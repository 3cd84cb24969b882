"""What of a student's code is known to work at home only."""

import importlib.metadata
import sys

import pytest

from labcourse.run import portability
from labcourse.run.portability import foreign, not_packed, too_new, version

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
    ("source", "grader", "what"),
    [
        ("x = 1\ntry:\n    x\nexcept* ValueError:\n    pass", (3, 10), "Exception groups"),
        ("match 1:\n    case 1:\n        pass", (3, 9), "Pattern matching"),
        ("match 1:\n    case 1:\n        print(f'{1}')", (3, 10), None),  # parso alone takes it for an error
        ("%matplotlib inline\nx = 1\nx?", (3, 8), None),
        ("a = (f'{1}'\n    f'{2:>{3}}')", (3, 8), None),
        ('print(f"{x:.2f} {y:{width}.1f}")', (3, 11), None),
        ("x = = 1", (3, 8), None),  # no Python reads it: the run says so
        pytest.param(
            'print(f"{d["unit"]}")',
            (3, 11),
            'the text f"{d["unit"]}"',
            marks=pytest.mark.skipif(sys.version_info < (3, 12), reason="this Python cannot read it"),
        ),
    ],
)
def test_what_an_older_python_cannot_read(source, grader, what):
    found = too_new(source, grader)
    assert found is what or found.startswith(what)


@pytest.mark.parametrize(("string", "reads"), [('f"{d["unit"]}"', False), ("f'{d[\"unit\"]}'\n  f'{1:>{2}}'", True)])
def test_strings_that_an_older_python_reads(string, reads):
    assert portability.is_readable(string, (3, 11)) is reads


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
