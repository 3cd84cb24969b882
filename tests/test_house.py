"""The house's own rules: who imports whom, what loads when, what a student may see."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest
from checkout import ROOT

PACKAGE = ROOT / "rotflex"

#: From the ground up (docs/architecture.md); a room may import from its own floor and from those below.
FLOORS = (
    {"errors", "units", "progress", "courseware"},
    {"config"},
    {"plant"},
    {"recording", "signals"},
    {"simulation", "response", "identification", "greybox"},
    {"figures", "hil"},
    {"experiments"},
    {"workbook"},
    {"lab"},
    {"widgets"},
    {"server"},
)
INSTRUCTOR = {"model", "design", "symbolic", "stiffness"}
#: Know nothing of the course.
GENERAL = {"gradebook", "isolation"}
FLOOR_OF = {room: number for number, rooms in enumerate(FLOORS) for room in rooms}


def room_of(path: Path) -> str:
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


def imported_rooms(path: Path) -> set[str]:
    """Rooms of the package that a module imports, anywhere in it."""
    rooms = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module:
            if node.module == "rotflex":
                rooms |= {alias.name for alias in node.names}
            elif node.module.startswith("rotflex."):
                rooms.add(node.module.split(".")[1])
        elif isinstance(node, ast.Import):
            rooms |= {alias.name.split(".")[1] for alias in node.names if alias.name.startswith("rotflex.")}
    return rooms - {"__version__"}


MODULES = sorted(path for path in PACKAGE.rglob("*.py") if path != PACKAGE / "__init__.py")


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_imports_go_one_way(path):
    room, imported = room_of(path), imported_rooms(path)
    imported.discard(room)
    assert "cli" not in imported
    if room in FLOOR_OF:
        too_high = {other for other in imported if FLOOR_OF.get(other, len(FLOORS)) > FLOOR_OF[room]}
        assert not too_high, f"{room} imports {too_high}"
    elif room in INSTRUCTOR:
        # What students have is not written again for instructors; but nothing here touches a bench.
        allowed = INSTRUCTOR | {"errors", "units", "courseware", "config", "identification", "simulation"}
        assert imported <= allowed, f"{room} imports {imported - allowed}"
    elif room in GENERAL:
        allowed = {"errors", "courseware"}
        assert imported <= allowed, f"{room} imports {imported - allowed}"
    else:
        assert room in {"cli", "grading"}, f"{room} has no floor"


@pytest.mark.parametrize("path", sorted((PACKAGE / "grading" / "inside").glob("*.py")), ids=lambda path: path.name)
def test_what_runs_beside_the_students_package_needs_nothing_that_they_do_not_have(path):
    assert not imported_rooms(path) & (INSTRUCTOR | GENERAL | {"grading", "cli"})


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_rooms_keep_to_a_readable_size(path):
    assert len(path.read_text(encoding="utf-8").splitlines()) <= 400


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
