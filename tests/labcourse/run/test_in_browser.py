"""What the students' commands do in a browser, as far as it can be seen without one."""

import io
import json
import os
import shutil
import subprocess
import sys
import zipfile

import pytest
from checkout import ROOT
from honest_hand_in import solved_notebooks

from labcourse import course_file
from labcourse.answers.answers import by_part, parse
from labcourse.errors import CheckError
from labcourse.files import ANSWERS_FILE, COURSE_FILE
from labcourse.run import execute, in_browser
from rotflex.course import questions  # noqa: F401 (the course that is worked on)

RUN = """
import json, sys
from pathlib import Path
import IPython, matplotlib.pyplot
import rotflex.course.lab, rotflex.experiments, rotflex.figures, rotflex.widgets, scipy.signal
from labcourse.run import execute
execute.IN_BROWSER = True
sys.path.remove("")  # a worker's Python has no such folder
execute.run(json.loads(Path("notebooks.json").read_text()), Path.cwd(), parameters={"student": "ada"})
"""
BAD = ["raise ValueError('own')", "import helper\nassert helper.__file__", "lab.answer('0.1', resolution=helper.one)"]


def test_cells_are_run_as_by_papermill(tmp_path):
    start = solved_notebooks(ROOT)["00_start.ipynb"]
    more = [{"cell_type": "code", "id": f"own-{at}", "source": source, "metadata": {}} for at, source in enumerate(BAD)]
    for cell in more:
        cell |= {"outputs": [], "execution_count": None}
    notebooks = {"00_start.ipynb": start, "again.ipynb": {**start, "cells": [*start["cells"], *more]}}
    answers, reports = [], []
    for place in (tmp_path / "here", tmp_path / "there"):
        place.mkdir()
        (place / "helper.py").write_text("one = 0.25\n")
        (place / COURSE_FILE).write_text(course_file.text({"student": "ada", "course": "rotflex"}))
    execute.run(notebooks, tmp_path / "here", parameters={"student": "ada"})
    (tmp_path / "there" / "notebooks.json").write_text(json.dumps(notebooks))
    done = subprocess.run(
        [sys.executable, "-c", RUN], cwd=tmp_path / "there", capture_output=True, text=True, check=False
    )
    assert not done.returncode, done.stderr
    for place in (tmp_path / "here", tmp_path / "there"):
        answers.append(by_part(parse((place / ANSWERS_FILE).read_bytes())))
        reports.append([json.loads(line) for line in (place / "cell_reports.jsonl").read_text().splitlines()])
    assert answers[0] == answers[1] and answers[0]["0.1", "resolution"]["value"] == 0.25
    assert reports[0] == reports[1] and any(line.get("error") for line in reports[0])


@pytest.fixture
def folder(tmp_path):
    """A student's folder with an answer, as a browser has it."""
    folder = tmp_path / "drive" / "notebooks"
    shutil.copytree(ROOT / "notebooks", folder)
    (folder / COURSE_FILE).write_text(course_file.text({"student": "ada", "course": "rotflex"}))
    return folder


def test_work_is_loose_until_it_is_downloaded_and_when_it_changes_again(folder):
    assert in_browser.is_loose(folder)
    (folder / ANSWERS_FILE).write_text("{}")
    packed = in_browser.packed(folder, "ada")
    assert not in_browser.is_loose(folder)
    assert ANSWERS_FILE in zipfile.ZipFile(packed).namelist()
    later = packed.stat().st_mtime + 60
    os.utime(folder / "04_modeling_results.ipynb", (later, later))
    assert in_browser.is_loose(folder)


def test_a_zip_is_unpacked_over_what_is_there(folder):
    (folder / ANSWERS_FILE).write_text("{}")
    name = "00_start.ipynb"
    long = json.loads((folder / name).read_text())
    data = in_browser.packed(folder, "ada").read_bytes()
    (folder / ANSWERS_FILE).unlink()
    long["metadata"]["more"] = "x" * 10_000
    (folder / name).write_text(json.dumps(long))
    assert in_browser.unpack(data, folder) == 1 + 1 + len([*folder.glob("*.ipynb")])
    assert (folder / ANSWERS_FILE).read_text() == "{}"
    assert "more" not in json.loads((folder / name).read_text())["metadata"]  # nothing is left of the longer file
    assert not (folder / "receipt.json").exists()


@pytest.mark.parametrize("names", [["00_start.ipynb"], [COURSE_FILE, "../outside.txt"], [COURSE_FILE, "/outside.txt"]])
def test_another_zip_is_refused_and_nothing_is_written(folder, names):
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w") as packed:
        for name in names:
            packed.writestr(name, "{}")
    before = {path: path.read_bytes() for path in folder.parent.rglob("*") if path.is_file()}
    for data in (content.getvalue(), b"no zip"):
        with pytest.raises(CheckError):
            in_browser.unpack(data, folder)
    assert {path: path.read_bytes() for path in folder.parent.rglob("*") if path.is_file()} == before
