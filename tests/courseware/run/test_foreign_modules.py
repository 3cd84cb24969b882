"""Which modules a student's code imports that the course does not bring."""

import importlib.metadata

import pytest

from rotflex.courseware.run import foreign_modules
from rotflex.courseware.run.foreign_modules import foreign, imported

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

    monkeypatch.setattr(foreign_modules.importlib.metadata, "packages_distributions", lambda: HOMES)
    monkeypatch.setattr(foreign_modules.importlib.metadata, "distribution", Installed)


def test_what_is_installed_and_is_not_the_courses(monkeypatch):
    for source, names in (
        ("import pandas as pd", ["pandas"]),
        ("def f():\n    from pandas.io import json", ["pandas"]),
        ("import numpy, PIL.Image, json, course.sub, shared", []),  # they come with the course, or with Python
        ("import nowhere", []),  # the run will say so
        ("import helper", []),
        ("from . import pandas", []),
        ("%pip install pandas", []),
        ("import pytest_thing, pandas.x", ["pandas"]),
    ):
        assert foreign([source], ["helper"], "course") == names
    assert foreign(["import pandas"], [], "unknown") == []  # it is not known what that course brings
    monkeypatch.setitem(HOMES, "pytest", ["pytest"])
    assert foreign(["import pytest"], [], "course") == ["pytest"]  # a requirement of an extra is not brought


def test_names_of_modules_are_those_of_the_top():
    assert list(imported("import a.b, c\nfrom d.e import f\nif x:\n    import g")) == ["a", "c", "d", "g"]
