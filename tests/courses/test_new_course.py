"""A course that ``labcourse new`` makes goes the whole way at once, by commands alone."""

import csv
import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from checkout import ROOT

from labcourse.errors import GradingError
from labcourse.grading import new

pytestmark = pytest.mark.slow


def labcourse(folder: Path, *arguments: object, installed: Path = ROOT) -> None:
    """Run a command in a folder; it has to end well."""
    done = subprocess.run(
        [sys.executable, "-P", "-m", "labcourse", *map(str, arguments)],
        cwd=folder,
        env={name: value for name, value in os.environ.items() if not name.startswith("LABCOURSE_")}
        | {"PYTHONPATH": f"{ROOT}{os.pathsep}{installed}"},
        capture_output=True,
        encoding="utf-8",
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.fixture(scope="module")
def tank(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A new course with its notebooks."""
    parent = tmp_path_factory.mktemp("new")
    labcourse(parent, "new", "tank")
    labcourse(parent / "tank", "make-notebooks")
    return parent / "tank"


@pytest.fixture(scope="module")
def rows(sandbox: None, tank: Path) -> dict[str, dict[str, str]]:
    """The table of grades of a class of two: the solutions, and the notebooks as they are handed out."""
    for student, notebooks in (("solved", "solutions"), ("empty", "notebooks")):
        shutil.copytree(tank / notebooks, tank / "HANDED" / student, ignore=shutil.ignore_patterns("*.py", "*.toml"))
    labcourse(tank, "grade", "MARKS", "HANDED")
    with (tank / "MARKS" / "grades.csv").open(encoding="utf-8-sig", newline="") as file:
        return {row["student"]: row for row in csv.DictReader(file)}


@pytest.mark.scheduled  # tests/docs/test_new_course_page.py does it, too
@pytest.mark.usefixtures("sandbox")
def test_it_passes_its_own_check(tank):
    labcourse(tank, "check-course")


@pytest.mark.parametrize("licence", ["", "Copyright (c) Ann Lee\n"])
def test_a_release_has_the_courses_own_licence_and_the_engines_in_its_wheel(tank, tmp_path, licence):
    shutil.copytree(tank, tmp_path / "tank")
    if licence:
        (tmp_path / "tank" / "LICENSE").write_text(licence)
    labcourse(tmp_path / "tank", "release", "OUT")
    released = tmp_path / "tank" / "OUT" / "tank-course"
    assert (released / "LICENSE").is_file() == bool(licence)
    found = {}
    for wheel in (released / "wheels").glob("*.whl"):
        with zipfile.ZipFile(wheel) as packed:
            names = [name for name in packed.namelist() if name.endswith("/licenses/LICENSE")]
            found[wheel.name.partition("-")[0]] = "".join(packed.read(name).decode() for name in names)
    assert found == {"labcourse": (ROOT / "LICENSE").read_text(), "tank": licence}


def test_its_release_brings_the_package_and_no_solution(tank):
    labcourse(tank, "release", "OUT")
    (wheel,) = (tank / "OUT" / "tank-course" / "wheels").glob("tank-*.whl")
    with zipfile.ZipFile(wheel) as packed:
        files = {name for name in packed.namelist() if ".dist-info/" not in name}
        entries = next(packed.read(name).decode() for name in packed.namelist() if name.endswith("entry_points.txt"))
    modules = {path.relative_to(tank).as_posix() for path in (tank / "tank").glob("*.py")}
    assert files == modules | {
        f"tank/notebooks/{name}" for name in ("01_first_lab.ipynb", "02_report.ipynb", "course.json")
    }
    assert "[labcourse.courses]\ntank = tank" in entries


@pytest.mark.scheduled  # as above
def test_solutions_get_all_points_but_those_that_a_person_gives_and_empty_notebooks_none(rows):
    columns = ("1.1", "1.2", "1.3", "1.4", "1.5", "Table 1", "total", "out_of", "awaiting a person")
    assert [rows["solved"][name] for name in columns] == ["2", "3", "2", "2", "3", "1", "13", "17", "4"]
    assert [rows["empty"][name] for name in columns] == ["0"] * 6 + ["0", "17", "0"]


def test_a_renamed_notebook_leaves_nothing_behind_and_what_others_wrote_stays(tank, tmp_path):
    shutil.copytree(tank, tmp_path / "tank")
    solutions, notebooks = tmp_path / "tank" / "solutions", tmp_path / "tank" / "notebooks"
    mine = (
        (notebooks / "01_first_lab.ipynb")
        .read_text()
        .replace('"outputs": []', '"outputs": [{"name": "stdout", "output_type": "stream", "text": []}]')
    )
    (notebooks / "mine.ipynb").write_text(mine)
    (solutions / "01_first_lab.py").rename(solutions / "01_oven.py")
    catalogue = tmp_path / "tank" / "tank" / "catalogue.py"
    catalogue.write_text(catalogue.read_text().replace("01_first_lab", "01_oven"))
    labcourse(tmp_path / "tank", "make-notebooks")
    left = ["01_oven.ipynb", "02_report.ipynb"]
    assert sorted(path.name for path in solutions.glob("*.ipynb")) == left
    assert sorted(path.name for path in notebooks.glob("*.ipynb")) == [*left, "mine.ipynb"]


@pytest.mark.parametrize("name", ["two tanks", "2tanks", "Tank", "class", "../tank", "", "numpy"])
def test_a_name_that_cannot_be_a_package_is_refused(tmp_path, name):
    with pytest.raises(GradingError):
        new.make(name, tmp_path)
    assert not list(tmp_path.iterdir())
