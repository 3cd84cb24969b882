"""A student begins with one release of a course and goes on with the next: as they would, from their installation."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import two_releases
from two_releases import FIRST, NOTEBOOK, SEED, TwoReleases

FILL = "from pathlib import Path; from rotflex.cli import fill; print(*fill(Path('work'), {student!r}), sep='\\n')"


@pytest.fixture(scope="module")
def two(tmp_path_factory) -> TwoReleases:
    return two_releases.made(tmp_path_factory.mktemp("two"))


def lab(installed: Path, place: Path, student: str | None = None) -> str:
    """What ``rotflex lab work`` says before it opens JupyterLab, where a release is installed."""
    site = place / f"site-{installed.parent.name}"
    if not site.exists():  # as pip puts it there
        for name in ("rotflex", "springlab"):
            shutil.copytree(installed / name, site / name)
        shutil.copytree(installed / "notebooks", site / "rotflex" / "_course" / "notebooks")
    done = subprocess.run(
        [sys.executable, "-P", "-c", FILL.format(student=student)],
        cwd=place,
        env=os.environ | {"PYTHONPATH": str(site)},
        capture_output=True,
        encoding="utf-8",
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_a_half_done_folder_goes_on_under_the_next_release(two, tmp_path):
    said = lab(two.first, tmp_path, "ada")
    assert f"Copied to work: {NOTEBOOK}" in said
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
    assert f"{NOTEBOOK}: of the course's cells 1 changed, 1 new, 0 gone." in said
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
            env=os.environ | {"PYTHONPATH": str(site)},
            capture_output=True,
            encoding="utf-8",
            check=False,
        )
        assert done.stdout == f"{SEED}\n", done.stderr
