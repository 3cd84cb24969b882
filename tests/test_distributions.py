"""The two distributions, built and installed as wheels: what each holds, and that courses are found from there."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from checkout import ROOT

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


@pytest.fixture
def alone(wheels, tmp_path):
    """The students' wheel by itself."""
    shutil.unpack_archive(wheels[0], tmp_path / "alone", "zip")
    return tmp_path / "alone"


@pytest.fixture(scope="module")
def wheels(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheels")
    return built(ROOT, folder), built(ROOT / "distributions" / "instructor", folder)


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


def test_together_they_hold_every_module_once_and_the_students_none_of_the_instructors(wheels):
    students, instructors = map(names, wheels)
    modules = {path.relative_to(ROOT).as_posix() for path in (ROOT / "rotflex").rglob("*.py")}
    of_instructors = {name for name in modules if name.startswith("labcourse/grading/")}
    assert {name for name in students if name.endswith(".py")} == modules - of_instructors
    assert {name for name in instructors if name.endswith(".py")} == of_instructors
    assert "labcourse/grading/reports/templates/feedback.html" in instructors
    assert {"labcourse/scene/explorer.js", "labcourse/scene/explorer.css"} <= students
    assert {f"rotflex/_course/notebooks/{path.name}" for path in (ROOT / "notebooks").glob("*.ipynb")} <= students


def test_a_source_distribution_for_students_has_no_solution_no_key_and_builds_the_same_wheel(wheels, tmp_path):
    shutil.unpack_archive(built(ROOT, tmp_path, "sdist"), tmp_path)
    (folder,) = (path for path in tmp_path.iterdir() if path.is_dir())
    assert {path.name for path in folder.iterdir() if path.is_dir()} == {"rotflex", "notebooks"}
    assert not (folder / "labcourse" / "grading").exists()
    assert names(built(folder, tmp_path)) == names(wheels[0])


def test_the_instructors_distribution_needs_the_students_of_its_version(installed):
    from rotflex import __version__

    (about,) = installed.glob("rotflex_instructor-*.dist-info")
    assert f"Requires-Dist: rotflex=={__version__}\n" in (about / "METADATA").read_text(encoding="utf-8")


def test_a_students_installation_opens_the_notebooks_and_has_no_commands_of_instructors(alone, tmp_path):
    shown = rotflex(alone, tmp_path, "--help").stdout
    assert " lab " in shown and " grade " not in shown
    assert "is written" in rotflex(alone, tmp_path, "bench", "notebook").stdout  # for who sets up a laboratory's bench
    assert "A real bench, commissioned" in (tmp_path / "commissioning.ipynb").read_text(encoding="utf-8")
    code = "from pathlib import Path; from labcourse.lab_command import fill; print(fill(Path('work'), 'ada'))"
    done = ran(["-P", "-c", code], tmp_path, PYTHONPATH=str(alone))
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "work" / "00_start.ipynb").exists()


@pytest.mark.parametrize("command", [("release", "out"), ("grade", "out", "in")], ids=lambda words: words[0])
def test_without_a_course_a_command_says_how_to_name_one(installed, tmp_path, command):
    (tmp_path / "in" / "ada").mkdir(parents=True)
    done = rotflex(installed, tmp_path, *command, LABCOURSE_SOLUTIONS="")
    assert done.returncode == 2
    said = " ".join(done.stderr.split())
    assert "--solutions FOLDER" in said and "LABCOURSE_SOLUTIONS" in said, said


def test_release_finds_the_course_by_option_and_by_the_environment(installed, tmp_path):
    course = tmp_path / "elsewhere" / "solutions"
    shutil.copytree(ROOT / "solutions", course, ignore=shutil.ignore_patterns("__pycache__", "answers.json"))
    by_option = rotflex(installed, tmp_path, "release", "one", "--solutions", course)
    by_setting = rotflex(installed, tmp_path, "release", "two", LABCOURSE_SOLUTIONS=str(course))
    assert (by_option.returncode, by_setting.returncode) == (0, 0), by_option.stderr + by_setting.stderr
    one, two = ((tmp_path / out / "rotflex-course.zip").read_bytes() for out in ("one", "two"))
    assert one == two
    released = tmp_path / "one" / "rotflex-course"
    assert not (released / "labcourse" / "grading").exists()
    assert (released / "LICENSE").read_text(encoding="utf-8") == (ROOT / "LICENSE").read_text(encoding="utf-8")


def test_grade_finds_the_course_from_the_wheels(installed, tmp_path, sandbox):
    (tmp_path / "in" / "ada").mkdir(parents=True)
    shutil.copyfile(ROOT / "notebooks" / "00_start.ipynb", tmp_path / "in" / "ada" / "00_start.ipynb")
    words = ("grade", "out", "in", "--solutions", ROOT / "solutions")
    done = rotflex(installed, tmp_path, *words)
    assert done.returncode == 0, done.stdout + done.stderr
    assert (tmp_path / "out" / "grades.csv").exists()


def test_students_check_and_pack_their_work_with_their_own_wheel_alone(alone, tmp_path):
    work = tmp_path / "work"
    assert not (alone / "labcourse" / "grading").exists()
    shutil.copytree(alone / "rotflex" / "_course" / "notebooks", work)
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
    assert "  00_start                   all there\n" in done.stdout
    assert "02_finding_stiffness       nothing yet" in done.stdout
    assert "among the course's cells, changed: console" in done.stdout
    with zipfile.ZipFile(tmp_path / "ada.zip") as packed:
        assert {"00_start.ipynb", "10_control_results.ipynb", "helper.py", "receipt.json"} <= set(packed.namelist())
    restored = rotflex(alone, tmp_path, "restore", "00", "--folder", work, LABCOURSE_RUNNING="")
    assert restored.returncode == 0 and "console is the course's again" in restored.stdout
