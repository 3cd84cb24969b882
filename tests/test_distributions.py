"""The two distributions, built and installed as wheels: what each holds, and that courses are found from there."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import zipfile
from importlib import metadata
from pathlib import Path

import pytest
from checkout import ROOT

import labcourse

pytestmark = pytest.mark.slow

BUILD = "import sys, hatchling.build; print(hatchling.build.build_wheel(sys.argv[1]))"


def ran(command, folder, **environment):
    """A program of Python, in a folder."""
    return subprocess.run(
        [sys.executable, *map(str, command)],
        cwd=folder,
        env=os.environ | environment,
        capture_output=True,
        text=True,
        check=False,
    )


def built(project: Path, folder: Path, what: str = "wheel") -> Path:
    """A wheel of a project, or its source distribution."""
    done = ran(["-c", BUILD.replace("wheel", what), folder], project)
    assert done.returncode == 0, done.stderr
    return folder / done.stdout.strip().splitlines()[-1]


@pytest.fixture(scope="module")
def wheels(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheels")
    return built(ROOT, folder), built(ROOT / "labcourse", folder)


@pytest.fixture(scope="module")
def installed(wheels, tmp_path_factory):
    """Both wheels unpacked as pip would, in front of what this environment has."""
    folder = tmp_path_factory.mktemp("installed")
    for wheel in wheels:
        shutil.unpack_archive(wheel, folder, "zip")
    return folder


def rotflex(installed, folder, *words, **environment):
    """The command from the wheels, in a folder that has nothing to do with the checkout."""
    settings = {"PYTHONPATH": str(installed), "COLUMNS": "200"} | environment
    return ran(["-P", "-m", "rotflex.cli", *words], folder, **settings)


def names(wheel):
    with zipfile.ZipFile(wheel) as packed:
        return set(packed.namelist())


def test_together_they_hold_every_module_once(wheels):
    for package, held in zip(("rotflex", "labcourse"), map(names, wheels), strict=True):
        modules = {path.relative_to(ROOT).as_posix() for path in (ROOT / package).rglob("*.py")}
        assert {name for name in held if name.endswith(".py")} == modules
        assert not [name for name in held if not name.startswith((f"{package}/", f"{package}-"))]
    laboratory, engine = map(names, wheels)
    assert {f"rotflex/course/notebooks/{path.name}" for path in (ROOT / "notebooks").glob("*.ipynb")} <= laboratory
    assert "rotflex/figures/drawings/joint_angles.svg" in laboratory
    assert {"labcourse/scene/explorer.js", "labcourse/grading/reports/templates/feedback.html"} <= engine
    extension = "labcourse/jupyter/labextensions/labcourse"
    assert {f"{extension}/package.json", f"{extension}/static/opening.js"} <= engine


@pytest.mark.parametrize("package", ["rotflex", "labcourse"])
def test_a_source_distribution_has_no_solution_and_builds_the_same_wheel(wheels, tmp_path, package):
    project = ROOT if package == "rotflex" else ROOT / package
    shutil.unpack_archive(built(project, tmp_path, "sdist"), tmp_path)
    (folder,) = (path for path in tmp_path.iterdir() if path.is_dir())
    assert not (folder / "solutions").exists()
    assert names(built(folder, tmp_path)) == names(wheels[package == "labcourse"])


def test_the_laboratory_alone_needs_no_jupyterlab_and_has_the_commands_of_a_bench(wheels, tmp_path):
    shutil.unpack_archive(wheels[0], tmp_path / "alone", "zip")
    (about,) = metadata.distributions(name="rotflex", path=[str(tmp_path / "alone")])
    needed = {one.partition(">")[0] for one in about.requires if "extra" not in one}
    assert not needed & {"jupyterlab", "ipywidgets", "labcourse"}
    assert f"labcourse=={labcourse.__version__}; extra == 'course'" in about.requires
    block = "import sys; sys.modules['labcourse'] = None; sys.argv[0] = 'rotflex'; from rotflex import cli; cli.run()"
    shown = ran(["-P", "-c", block, "--help"], tmp_path, PYTHONPATH=str(tmp_path / "alone")).stdout
    assert " bench " in shown and " lab " not in shown
    done = ran(["-P", "-c", block, "doctor", "--bench", "virtual"], tmp_path, PYTHONPATH=str(tmp_path / "alone"))
    assert done.returncode == 0 and "ok   watchdog" in done.stdout, done.stderr


def test_without_a_course_a_command_says_how_to_name_one(installed, tmp_path):
    (tmp_path / "in" / "ada").mkdir(parents=True)
    done = rotflex(installed, tmp_path, "grade", "out", "in", LABCOURSE_SOLUTIONS="")
    assert done.returncode == 2
    said = " ".join(done.stderr.split())
    assert "--solutions FOLDER" in said and "LABCOURSE_SOLUTIONS" in said, said


@pytest.mark.scheduled
def test_grade_finds_the_course_from_the_wheels(installed, tmp_path, sandbox):
    (tmp_path / "in" / "ada").mkdir(parents=True)
    shutil.copyfile(ROOT / "notebooks" / "00_start.ipynb", tmp_path / "in" / "ada" / "00_start.ipynb")
    words = ("grade", "out", "in", "--solutions", ROOT / "solutions")
    done = rotflex(installed, tmp_path, *words)
    assert done.returncode == 0, done.stdout + done.stderr
    assert (tmp_path / "out" / "grades.csv").exists()


def test_students_check_and_pack_their_work_with_their_releases_wheels_alone(installed, tmp_path):
    done = rotflex(installed, tmp_path, "release", "out", "--no-keep", LABCOURSE_SOLUTIONS=str(ROOT / "solutions"))
    assert done.returncode == 0, done.stderr
    released = tmp_path / "out" / "rotflex-course"
    assert (released / "LICENSE").read_text(encoding="utf-8") == (ROOT / "LICENSE").read_text(encoding="utf-8")
    work, alone = tmp_path / "work", tmp_path / "alone"
    for wheel in (released / "wheels").iterdir():
        shutil.unpack_archive(wheel, alone, "zip")
    assert not (alone / "labcourse" / "grading").exists()
    shutil.copytree(alone / "rotflex" / "course" / "notebooks", work)
    start = work / "00_start.ipynb"
    answered = start.read_text("utf-8").replace("resolution = None", "resolution = helper.resolution")
    start.write_text(answered.replace("import rotflex.course.lab", "import rotflex.course.lab\\n", 1), encoding="utf-8")
    (work / "helper.py").write_text("resolution = 2 * 3.14159 / 4096\n", encoding="utf-8")
    notebook = json.loads(start.read_text("utf-8"))
    place = next(n for n, cell in enumerate(notebook["cells"]) if cell["id"] == "q0-1")
    own = {"cell_type": "code", "id": "mine", "metadata": {}, "source": "import helper", "outputs": []}
    notebook["cells"].insert(place, {**own, "execution_count": None})
    start.write_text(json.dumps(notebook), encoding="utf-8")
    # Before what this environment has: its own rotflex is the checkout's.
    done = rotflex(alone, tmp_path, "submit", work, "--student", "ada", LABCOURSE_RUNNING="")
    assert done.returncode == 1, done.stdout + done.stderr  # one question is answered, and the others are empty
    assert "Complete: 1 of 40 questions" in done.stdout
    assert "nothing yet: 01_modeling_prelab, 02_finding_stiffness" in done.stdout
    assert "of the course's cells, changed: console" in done.stdout
    with zipfile.ZipFile(tmp_path / "ada.zip") as packed:
        assert {"00_start.ipynb", "10_control_results.ipynb", "helper.py", "receipt.json"} <= set(packed.namelist())
    restored = rotflex(alone, tmp_path, "restore", "00", "--folder", work, LABCOURSE_RUNNING="")
    assert restored.returncode == 0 and "console" in restored.stdout
