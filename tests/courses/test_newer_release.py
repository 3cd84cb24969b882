"""A class of which some went on from one release of a course to the next, and some did not, is graded."""

from __future__ import annotations

import csv
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
import two_releases
from two_releases import NOTEBOOK, TwoReleases


@pytest.fixture(scope="module")
def two(tmp_path_factory) -> TwoReleases:
    return two_releases.made(tmp_path_factory.mktemp("two"))


SOLVED = {
    "q1-1": "run = lab.bench().release()",
    "q1-2": "k = lab.bench().k",
    "q1-3": 'formula = sympy.sqrt(sympy.Symbol("k") / sympy.Symbol("m"))\nomega = lab.bench().omega',
    "q1-5": "period = 2 * math.pi / omega",
}


def hand_in(two: TwoReleases, which: Path, folder: Path, about: dict[str, object] | None) -> None:
    """A notebook of a release, answered, with what ``course.json`` says; without one for None."""
    folder.mkdir(parents=True)
    notebook = two.notebook(which)
    for cell in notebook["cells"]:
        cell["source"] = SOLVED.get(cell["id"], cell["source"])
    (folder / NOTEBOOK).write_text(json.dumps(notebook), encoding="utf-8")
    if about is not None:
        (folder / "course.json").write_text(json.dumps(about), encoding="utf-8")


def rotflex(two: TwoReleases, place: Path, *words: str | Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "rotflex.cli", *words, "--solutions", two.course],
        cwd=place,
        env=os.environ | {"PYTHONPATH": str(two_releases.ROOT), "COLUMNS": "200"},
        capture_output=True,
        encoding="utf-8",
        check=False,
    )


def test_a_class_is_graded_each_under_the_release_that_they_began_with(sandbox, two, tmp_path):
    submissions = tmp_path / "submissions"
    first, second = two.about(two.first), two.about(two.second)
    hand_in(two, two.first, submissions / "ada", {**first, "student": "ada"})
    hand_in(two, two.first, submissions / "bob", None)
    hand_in(two, two.second, submissions / "grace", {**second, "student": "grace"})
    hand_in(two, two.second, submissions / "eve", {**second, "student": "eve", "release": "2025-autumn-00000000"})
    done = rotflex(two, tmp_path, "grade", tmp_path / "out", submissions)
    assert done.returncode == 1, done.stdout + done.stderr  # eve's
    with (tmp_path / "out" / "grades.csv").open(encoding="utf-8-sig", newline="") as file:
        rows = {row["student"]: row for row in csv.DictReader(file)}
    # Of 1.4 is nothing there. Who was not asked for 1.5 is not held to it.
    expected = {"ada": ("7", "8"), "bob": ("7", "8"), "grace": ("8", "9"), "eve": ("8", "9")}
    assert {name: (row["total"], row["out_of"]) for name, row in rows.items()} == expected
    older = f"Run and marked under an earlier release, {first['release']}."
    assert {name for name, row in rows.items() if older in row["notes"]} == {"ada", "bob"}
    assert (
        "names the release '2025-autumn-00000000', which is not among the releases in releases/" in rows["eve"]["notes"]
    )
    again = rotflex(two, tmp_path, "regrade", tmp_path / "out" / "gradebook.sqlite")
    assert again.stdout == "Other marks than before: 0 students. The same: 4.\n", again.stdout + again.stderr
