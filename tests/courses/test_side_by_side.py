"""Releases of two courses in one environment: neither writes into the other, and each is found by its name."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from made_courses import OURS

from labcourse import lab_command
from labcourse.grading import course as courses
from labcourse.grading.release import student_course

SPRING = Path(__file__).resolve().parent / "spring"
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def spring(tmp_path_factory):
    """The course of a mass on a spring, with its notebook made of its text."""
    folder = shutil.copytree(SPRING, tmp_path_factory.mktemp("spring") / "spring")
    course = courses.load(folder / "solutions")
    student_course.write_notebooks(course)
    return course


@pytest.fixture(scope="module")
def site(spring, tmp_path_factory):
    """The folder that the wheels of both releases are unpacked into, as pip does."""
    folder = tmp_path_factory.mktemp("both")
    held: dict[str, bytes] = {}
    for course in (OURS, spring):
        made = student_course.release(course, folder / course.name)
        for wheel in (made.folder / "wheels").iterdir():
            with zipfile.ZipFile(wheel) as archive:
                for name in archive.namelist():
                    assert held.setdefault(name, archive.read(name)) == archive.read(name), name
                archive.extractall(folder / "site")
    return folder / "site"


@pytest.fixture(autouse=True)
def settings(tmp_path, monkeypatch):
    monkeypatch.setenv(lab_command.SETTINGS_VARIABLE, str(tmp_path / "settings"))


def labcourse(site, place, *words, program="labcourse.command_line"):
    """What the command prints, typed where both are installed; and its exit code."""
    given = {name: value for name, value in os.environ.items() if not name.startswith("LABCOURSE_")}
    given |= {
        "PYTHONPATH": str(site),
        "LABCOURSE_CONFIG_DIR": os.environ[lab_command.SETTINGS_VARIABLE],
        "COLUMNS": "200",
    }
    fill = "from labcourse import lab_command; lab_command.open_jupyterlab = lambda *given: None; "
    fill += f"from {program} import run; import sys; sys.argv[0] = 'labcourse'; run()"
    done = subprocess.run(
        [sys.executable, "-P", "-c", fill, *words], cwd=place, env=given, capture_output=True, text=True, check=False
    )
    return done.returncode, " ".join((done.stdout + done.stderr).split())


def test_each_course_is_opened_by_its_name_and_without_one_all_are_listed(site, tmp_path):
    code, said = labcourse(site, tmp_path, "lab", "work", "--student", "ada")
    assert code == 2 and "rotflex, springlab" in said
    for name, count in (("springlab", 1), ("rotflex", len(OURS.notebooks))):
        code, said = labcourse(site, tmp_path, "--course", name, "lab", name, "--student", "ada")
        assert code == 0, said
        assert len(list((tmp_path / name).glob("*.ipynb"))) == count
        about = json.loads((tmp_path / name / "course.json").read_text("utf-8"))
        assert about["release"].startswith({"springlab": "spring-course", "rotflex": "rotflex-course"}[name])
        assert about["course"] == name
