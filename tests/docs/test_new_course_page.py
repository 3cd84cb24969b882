"""Whoever does what docs/new_course.md says, line by line, has the course and the marks that it shows.

Of its fences, ``sh`` is run, and so is Python that begins with an import. Any other is put into the file that is named
in bold before it, "above" a line or "at the end"; or it stands in that file already.
"""

import csv
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from checkout import ROOT

pytestmark = pytest.mark.scheduled

PAGE = (ROOT / "docs" / "new_course.md").read_text(encoding="utf-8")
FENCE = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
FILE = re.compile(r"\*\*`([\w./]+)`\*\*(?:, (?:above `(.+)`|(at the end)):$)?", re.MULTILINE)
ROW = re.compile(r"^\| (.+) \|$", re.MULTILINE)


class Reader:
    """Somebody who does what the page says, in a folder, where labcourse is installed and nothing is downloaded."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder / "work"
        self.course = self.folder / "tank"
        self._there, self._programs = folder / "there", folder / "bin"
        self.folder.mkdir()
        self._programs.mkdir()
        for name, words in (("labcourse", "-P -m labcourse"), ("python", ""), ("pip", "-m pip")):
            (self._programs / name).write_text(f'#!/bin/sh\nexec "{sys.executable}" {words} "$@"\n')
            (self._programs / name).chmod(0o755)
        installed = self.folder.parent / f"prefix/lib/python{sys.version_info[0]}.{sys.version_info[1]}/site-packages"
        self._environment = {
            **{name: value for name, value in os.environ.items() if not name.startswith("LABCOURSE_")},
            "PATH": f"{self._programs}:{os.environ['PATH']}",
            "PYTHONPATH": f"{installed}:{self.course}:{ROOT}",
            "PIP_PREFIX": str(folder / "prefix"),
            "PIP_NO_INDEX": "1",
            "PIP_NO_DEPS": "1",
            "PIP_NO_BUILD_ISOLATION": "false",  # which turns isolation off
            "LABCOURSE_COURSE": "tank",  # another course is installed here, too
        }

    def run(self, *command: str) -> None:
        """Run a program, which has to end well; it leaves its folder behind."""
        done = subprocess.run(
            command, cwd=self.folder, env=self._environment, capture_output=True, encoding="utf-8", check=False
        )
        assert done.returncode == 0, f"{command[-1]}\n{done.stdout}{done.stderr}"

    def do(self, language: str, code: str, before: str) -> None:
        """Do what a fence says, after the text before it."""
        if language == "sh":
            self.run("bash", "-e", "-c", f"{code}\npwd > {self._there}")
            self.folder = Path(self._there.read_text().strip())
        elif re.match("from|import", code):
            self.run(sys.executable, "-c", code)
        else:
            name, above, at_the_end = FILE.findall(before)[-1]
            text = (self.course / name).read_text(encoding="utf-8")
            if at_the_end:
                text = f"{text}\n{code}"
            elif above:
                assert text.count(f"\n{above}") == 1
                text = text.replace(f"\n{above}", f"\n{code}{above}")
            assert code in text
            (self.course / name).write_text(text, encoding="utf-8")


@pytest.fixture(scope="module")
def course(sandbox: None, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The course of somebody who read the page to its end."""
    reader = Reader(tmp_path_factory.mktemp("reader"))
    for fence in FENCE.finditer(PAGE):
        reader.do(fence[1], fence[2], PAGE[: fence.start()])
    return reader.course


def test_the_class_has_the_marks_on_the_page(course):
    head, _line, *rows = [row.split(" | ") for row in ROW.findall(PAGE[PAGE.index("| student |") :])[:5]]
    with (course / "MARKS" / "grades.csv").open(encoding="utf-8-sig", newline="") as file:
        found = {row["student"]: row for row in csv.DictReader(file)}
    marked = found["ada"]  # by a person, after the table
    assert (marked["1.5"], marked["total"], marked["awaiting a person"]) == ("4", "15", "3")
    found["ada"] = marked | {"1.5": "3", "total": "14", "awaiting a person": "4"}
    assert [[found[row[0]][name] for name in head] for row in rows] == rows


def test_the_report_and_the_picture_are_there(course):
    assert (course / "try" / "report.pdf").is_file() and (course / "explorer.png").is_file()
