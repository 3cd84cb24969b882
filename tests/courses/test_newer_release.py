"""A student begins with one release of a course and goes on with the next, as they would, from their installation.

A class of which some went on, and some did not, is graded.
"""

from __future__ import annotations

import csv
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import two_releases
from two_releases import FIRST, NOTEBOOK, SEED, TwoReleases

FILL = (
    "from pathlib import Path; from labcourse.lab_command import fill; "
    "print(*fill(Path('work'), {student!r}), sep='\\n')"
)


@pytest.fixture(scope="module")
def two(tmp_path_factory) -> TwoReleases:
    return two_releases.made(tmp_path_factory.mktemp("two"))


def lab(installed: Path, place: Path, student: str | None = None) -> str:
    """What ``rotflex lab work`` says before it opens JupyterLab, where a release is installed."""
    site = place / f"site-{installed.parent.name}"
    if not site.exists():  # as pip puts it there
        for wheel in (installed / "wheels").glob("*.whl"):
            shutil.unpack_archive(wheel, site, "zip")
    done = subprocess.run(
        [sys.executable, "-P", "-c", FILL.format(student=student)],
        cwd=place,
        env=os.environ | {"PYTHONPATH": str(site), "LABCOURSE_COURSE": "springlab"},
        capture_output=True,
        encoding="utf-8",
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_a_half_done_folder_goes_on_under_the_next_release(two, tmp_path):
    said = lab(two.first, tmp_path, "ada")
    assert "The course was copied to work: 1 notebook." in said
    assert (tmp_path / "work" / NOTEBOOK).exists()
    course = tmp_path / "work" / "course.json"
    assert json.loads(course.read_text()) == {**two.about(two.first), "student": "ada"}
    assert json.loads(course.read_text())["term"] == FIRST

    path = tmp_path / "work" / NOTEBOOK
    work = json.loads(path.read_text())
    cells = {cell["id"]: cell for cell in work["cells"]}
    cells["q1-1"]["source"] = "run = lab.bench().release()"
    work["cells"].insert(6, {**cells["q1-1"], "id": "mine", "metadata": {}, "source": "half = MASS / 2"})
    path.write_text(json.dumps(work))

    said = lab(two.second, tmp_path)
    assert "now with the course's text of the release" in said and Path(NOTEBOOK).stem in said
    assert "The course gives you another bench now" in said
    assert json.loads(course.read_text()) == {**two.about(two.second), "student": "ada"}
    now = {cell["id"]: "".join(cell["source"]) for cell in json.loads(path.read_text())["cells"]}
    assert now["q1-1"] == "run = lab.bench().release()" and now["mine"] == "half = MASS / 2"
    assert now["title"].endswith("Half a kilogram hangs on a spring.")
    assert "q1-5" in now and "q1-5-answer" in now
    assert lab(two.second, tmp_path).strip() == ""


def test_the_bench_of_a_session_is_the_releases(two, tmp_path):
    """In a folder with its course file, and in one without."""
    lab(two.second, tmp_path, "ada")
    site = tmp_path / f"site-{two.second.parent.name}"
    for folder in (tmp_path / "work", tmp_path):
        done = subprocess.run(
            [sys.executable, "-P", "-c", "import springlab.lab; print(springlab.lab.start('ada').seed)"],
            cwd=folder,
            env=os.environ | {"PYTHONPATH": str(site), "LABCOURSE_COURSE": "springlab"},
            capture_output=True,
            encoding="utf-8",
            check=False,
        )
        assert done.stdout == f"{SEED}\n", done.stderr


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
