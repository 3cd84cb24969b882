"""The house's own rules, beside those in pyproject.toml ([tool.importlinter]: who imports whom)."""

from __future__ import annotations

import subprocess
import sys
import tomllib

import grimp
import pytest
from checkout import ROOT

PACKAGE = ROOT / "rotflex"
MODULES = sorted(path for path in PACKAGE.rglob("*.py") if path != PACKAGE / "__init__.py")
INSIDE = "rotflex.instructor.running.inside"
CONTRACTS = {
    contract["id"]: contract
    for contract in tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["importlinter"]["contracts"]
}
#: What every course needs; all else of the package is of this laboratory, or the instructor's.
GENERAL = {"__main__", "cli", "courseware", "errors", "instructor", "progress", "units"}


def rooms(contract: str) -> set[str]:
    """What a contract gives a floor."""
    return {room.strip() for floor in CONTRACTS[contract]["layers"] for room in floor.replace("|", ":").split(":")}


def short(names: list[str], parent: str) -> set[str]:
    return {name.removeprefix(f"{parent}.") for name in names if name.startswith(f"{parent}.")}


def test_the_rules_of_imports_cover_each_package_that_there_is():
    """A folder without ``__init__.py`` can be imported, but no rule would see it."""
    folders = {path.parent for path in MODULES if "migrations" not in path.parts}
    assert [folder for folder in sorted(folders) if not (folder / "__init__.py").exists()] == []


def test_the_machinery_of_grading_may_import_no_room_of_the_laboratory():
    assert short(CONTRACTS["neutral"]["forbidden_modules"], "rotflex") == rooms("rooms") - GENERAL


def test_each_room_of_the_instructors_is_either_general_or_a_model_of_this_laboratory():
    general, models = (short(CONTRACTS[name]["source_modules"], "rotflex.instructor") for name in ("neutral", "models"))
    assert general | models == rooms("instructor")
    assert not general & models
    assert short(CONTRACTS["models"]["forbidden_modules"], "rotflex.instructor") == general


def test_what_runs_beside_the_students_package_imports_nothing_of_this_one_but_what_it_brings_along():
    graph = grimp.build_graph("rotflex", cache_dir=None)
    own = {INSIDE, *graph.find_descendants(INSIDE)}
    assert f"{INSIDE}.main" in own
    # One module is packed beside it, for releases whose package does not have it; it stands on nothing of ours.
    assert graph.find_upstream_modules(INSIDE, as_package=True) - own == {"rotflex.courseware.run.cell_reports"}


@pytest.mark.parametrize("room", ["rotflex", "rotflex.lab", "rotflex.experiments"])
def test_heavy_libraries_load_only_where_they_are_used(room):
    heavy = [
        "sympy",
        "matplotlib",
        "ipywidgets",
        "anywidget",
        "papermill",
        "sqlalchemy",
        "dask",
        "control",
        "tqdm",
        "typer",
    ]
    heavy += ["scipy.signal", "scipy.optimize"]
    code = f"import sys, {room}; print([name for name in {heavy!r} if name in sys.modules])"
    loaded = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout.strip()
    assert loaded == "[]"


def test_importing_rotflex_alone_loads_nothing_of_it():
    code = "import sys, rotflex; print(sorted(name for name in sys.modules if name.startswith('rotflex.')))"
    assert subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout == "[]\n"
