"""Copies of the course of a mass on a spring, to be spoilt."""

import importlib
import json
import shutil
import sys
from pathlib import Path

import pytest

from labcourse.grading import course as courses
from labcourse.grading.release import student_course

SPRING = Path(__file__).resolve().parent / "spring"
NOTEBOOK = "01_spring.ipynb"


def forget():
    """Let the students' package be imported anew, from another folder."""
    for name in [name for name in sys.modules if name.partition(".")[0] == "springlab"]:
        del sys.modules[name]


@pytest.fixture
def spoilt(tmp_path, monkeypatch):
    """Return a function that loads a copy of the course, with other sources in some cells of its notebook."""
    return copied(tmp_path, monkeypatch)


@pytest.fixture(scope="module")
def course(tmp_path_factory):
    """Load a copy of the course."""
    with pytest.MonkeyPatch.context() as patch:
        yield copied(tmp_path_factory.mktemp("course"), patch)()


def copied(tmp_path, monkeypatch):
    """Copy the course into a folder, and return a function that loads it with other sources in some cells."""
    shutil.copytree(SPRING, tmp_path / "spring", ignore=shutil.ignore_patterns("notebooks", "__pycache__"))
    forget()
    monkeypatch.syspath_prepend(str(tmp_path / "spring"))
    importlib.invalidate_caches()
    student_course.write_notebooks(courses.load(tmp_path / "spring" / "solutions"))
    shutil.rmtree(tmp_path / "spring" / "notebooks")
    (tmp_path / "spring" / "solutions" / "01_spring.py").unlink(missing_ok=True)

    def made(**sources):
        folder = tmp_path / "spring" / "solutions"
        notebook = json.loads((folder / NOTEBOOK).read_text(encoding="utf-8"))
        for cell in notebook["cells"]:
            cell["source"] = sources.get(cell["id"].replace("-", "_"), cell["source"])
        (folder / NOTEBOOK).write_text(json.dumps(notebook), encoding="utf-8")
        return courses.load(folder)

    made.forget = forget
    return made
