"""Another laboratory's course goes the whole way over the same rails, by the commands that a teacher types.

The course is in ``spring/``: a mass on a spring, four questions, 8 points. What each submission should get is worked
out by hand from its key, in ``CLASS``.
"""

from __future__ import annotations

import csv
import json
import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
NOTEBOOK = "01_spring.ipynb"
FOLLOWED = "right, given your own earlier answers"


@dataclass(frozen=True)
class Handed:
    """A submission: what it says instead of the solutions, by cell; the points of 1.1 to 1.4; what became of parts."""

    changes: dict[str, tuple[str, str]]
    points: tuple[int, int, int, int]
    statuses: dict[str, str]


CLASS = {
    "right": Handed({}, (1, 2, 4, 0), {"k": "right", "formula": "right", "omega": "right", "why": "for a person"}),
    # 8 % off, where 5 % may be; omega is then 3.9 % off (the root of 1.08), where 2 % may be, but follows from it.
    "stiff": Handed(
        {"q1-2": ("k = MASS", "k = 1.08 * MASS")}, (1, 0, 4, 0), {"k": "wrong", "formula": "right", "omega": FOLLOWED}
    ),
    "formula": Handed(
        {"q1-3": ('"k") / sympy.Symbol("m")', '"m") / sympy.Symbol("k")')},
        (1, 2, 1, 0),
        {"k": "right", "formula": "wrong", "omega": "right"},
    ),
    # All from a spring that is somebody else's.
    "copied": Handed(
        {"q1-1": ("lab.bench()", 'springlab.lab.Spring(springlab.lab.seed_of("right"))')},
        (0, 0, 4, 0),
        {"run": "wrong", "k": "wrong", "formula": "right", "omega": FOLLOWED},
    ),
    "empty": Handed({}, (0, 0, 0, 0), {"run": "missing", "k": "missing", "why": "missing"}),
}


def rotflex(*arguments: object) -> str:
    """What a command prints, typed where there is no other course about; it has to end well."""
    environment = {name: value for name, value in os.environ.items() if name != "LABCOURSE_SOLUTIONS"}
    done = subprocess.run(
        [sys.executable, "-m", "rotflex.cli", *map(str, arguments)],
        cwd=HERE,
        env=environment | {"PYTHONPATH": str(ROOT)},
        capture_output=True,
        encoding="utf-8",
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def events(printed: str) -> list[dict[str, object]]:
    return [json.loads(line) for line in printed.splitlines()]


def rows(folder: Path) -> dict[str, dict[str, str]]:
    with (folder / "grades.csv").open(encoding="utf-8-sig", newline="") as file:
        return {row["student"]: row for row in csv.DictReader(file)}


def points(row: dict[str, str]) -> tuple[float, ...]:
    """The points of a row, question by question; what is not decided yet, and so empty, has none."""
    return tuple(float(row[number] or 0) for number in ("1.1", "1.2", "1.3", "1.4"))


def statuses(folder: Path, student: str) -> dict[str, str]:
    marks = json.loads((folder / student / "marks.json").read_text(encoding="utf-8"))["marks"]
    return {mark["part"]: mark["status"] for mark in marks}


@pytest.fixture(scope="module")
def solutions(tmp_path_factory: pytest.TempPathFactory) -> Path:
    course = tmp_path_factory.mktemp("course") / "spring"
    shutil.copytree(HERE / "spring", course, ignore=shutil.ignore_patterns("notebooks", "__pycache__"))
    rotflex("make-notebooks", "--solutions", course / "solutions")
    return course / "solutions"


@pytest.fixture(scope="module")
def submissions(solutions: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    written = json.loads((solutions / NOTEBOOK).read_text(encoding="utf-8"))["cells"]
    answers = {cell["id"]: "".join(cell["source"]) for cell in written if "### BEGIN" in "".join(cell["source"])}
    folder = tmp_path_factory.mktemp("submissions")
    for student, handed in CLASS.items():
        notebook = json.loads((solutions.parent / "notebooks" / NOTEBOOK).read_text(encoding="utf-8"))
        for cell in notebook["cells"]:
            if student != "empty" and cell["id"] in answers:
                before, after = handed.changes.get(cell["id"], ("", ""))
                assert before in answers[cell["id"]]
                cell["source"] = answers[cell["id"]].replace(before, after) if before else answers[cell["id"]]
        (folder / student).mkdir()
        (folder / student / NOTEBOOK).write_text(json.dumps(notebook), encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def graded(sandbox: None, solutions: Path, submissions: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("marks")
    lines = events(rotflex("grade", out, submissions, "--solutions", solutions, "--jobs", 2, "--json"))
    assert lines[-1] == {"event": "done", "ran": 5, "known": 0, "failed": 0, "total": 5}
    return out


def test_check_course_finds_nothing(solutions: Path) -> None:
    """What a run of the notebooks brings out: test_optional.py."""
    assert " in 1 notebook: everything fits" in rotflex("check-course", "--no-run", "--solutions", solutions)


def test_each_submission_gets_what_the_key_gives_by_hand(graded: Path) -> None:
    table = rows(graded)
    assert set(table) == set(CLASS)
    for student, handed in CLASS.items():
        assert points(table[student]) == handed.points, student
        assert float(table[student]["total"]) == sum(handed.points)
        assert float(table[student]["out_of"]) == 8
        assert float(table[student]["awaiting a person"]) == (student != "empty")
        assert table[student]["1.4"] == ("0" if student == "empty" else "")  # words, which wait for a person
        assert handed.statuses.items() <= statuses(graded, student).items(), student
        assert table[student]["notes"].endswith("Run in isolation.")
