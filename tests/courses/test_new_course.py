"""A course that ``labcourse new`` makes: its name and its release. (Its marks: tests/docs/test_new_course_page.py.)"""

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from checkout import ROOT

from labcourse.errors import GradingError
from labcourse.grading import new

pytestmark = pytest.mark.slow


def labcourse(folder: Path, *arguments: object) -> None:
    """Run a command in a folder; it has to end well."""
    done = subprocess.run(
        [sys.executable, "-P", "-m", "labcourse", *map(str, arguments)],
        cwd=folder,
        env={name: value for name, value in os.environ.items() if not name.startswith("LABCOURSE_")}
        | {"PYTHONPATH": str(ROOT)},
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


def licences(released):
    """The licence in each wheel of a release; "" for none."""
    found = {}
    for wheel in (released / "wheels").glob("*.whl"):
        with zipfile.ZipFile(wheel) as packed:
            names = [name for name in packed.namelist() if name.endswith("/licenses/LICENSE")]
            found[wheel.name.partition("-")[0]] = "".join(packed.read(name).decode() for name in names)
    return found


def test_its_release_brings_the_package_its_own_licence_and_no_solution(tank):
    engines = (ROOT / "LICENSE").read_text()
    labcourse(tank, "release", "BARE")
    bare = tank / "BARE" / "tank-course"
    assert (licences(bare), (bare / "LICENSE").exists()) == ({"labcourse": engines, "tank": ""}, False)
    (tank / "LICENSE").write_text("Copyright (c) Ann Lee\n")
    labcourse(tank, "release", "OUT")
    released = tank / "OUT" / "tank-course"
    assert licences(released) == {"labcourse": engines, "tank": "Copyright (c) Ann Lee\n"}
    assert (released / "LICENSE").is_file()
    (wheel,) = (released / "wheels").glob("tank-*.whl")
    with zipfile.ZipFile(wheel) as packed:
        files = {name for name in packed.namelist() if ".dist-info/" not in name}
        entries = next(packed.read(name).decode() for name in packed.namelist() if name.endswith("entry_points.txt"))
    modules = {path.relative_to(tank).as_posix() for path in (tank / "tank").glob("*.py")}
    assert files == modules | {
        f"tank/notebooks/{name}" for name in ("01_first_lab.ipynb", "02_report.ipynb", "course.json")
    }
    assert "[labcourse.courses]\ntank = tank" in entries


@pytest.mark.parametrize("name", ["two tanks", "2tanks", "Tank", "class", "../tank", "", "numpy"])
def test_a_name_that_cannot_be_a_package_is_refused(tmp_path, name):
    with pytest.raises(GradingError):
        new.make(name, tmp_path)
    assert not list(tmp_path.iterdir())
