"""A course of which two releases were handed out: the mass on a spring, changed in between.

The second one has a question more, other words and packages, and one spring for everybody.
"""

import json
import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from checkout import ROOT

from labcourse.answers.notebooks import Notebook

SPRING = ROOT / "tests" / "courses" / "spring"
NOTEBOOK = "01_spring.ipynb"
SEED = 7  #: of everybody's spring, in the second release
FIRST, SECOND = "2026 spring", "2026 autumn"
_OTHER_TITLE = "Half a kilogram hangs on a spring."
_FIFTH = """
        Question("1.5", "1", "01_spring", "Period", ("measures",), (
            number("period", "s", (0.01, 10.0), "measures", "The period of your spring."),
        )),
    ],
"""


@dataclass(frozen=True)
class TwoReleases:
    """The course's folder, as it is after the second release, and the two folders that students have."""

    course: Path
    first: Path
    second: Path

    def about(self, which: Path) -> dict[str, Any]:
        """The ``course.json`` of a release."""
        return json.loads((which / "notebooks" / "course.json").read_text(encoding="utf-8"))

    def notebook(self, which: Path) -> dict[str, Any]:
        """A released notebook."""
        return json.loads((which / "notebooks" / NOTEBOOK).read_text(encoding="utf-8"))

    def hand_in(self, which: Path, answers: dict[str, str], **course: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        """A release's notebook with answers (by cell), and what ``course.json`` says."""
        notebook = self.notebook(which)
        for cell in notebook["cells"]:
            cell["source"] = answers.get(cell["id"], cell["source"])
        return {NOTEBOOK: Notebook.read(json.dumps(notebook).encode()).cells}, course


def made(folder: Path) -> TwoReleases:
    """Hand out two releases of the course, by the command."""
    course = folder / "spring"
    shutil.copytree(SPRING, course, ignore=shutil.ignore_patterns("notebooks", "__pycache__"))
    settings = course / "solutions" / "course.toml"
    settings.write_text(f'[course]\nterm = "{FIRST}"\n', encoding="utf-8")
    with (course / "springlab" / "lab.py").open("a", encoding="utf-8") as file:
        file.write("\n\nEDITION = 1\n")
    release(course, folder / "first")
    _change(course)
    settings.write_text(
        f'[course]\nterm = "{SECOND}"\n[bench]\nwhich = "same"\nseed = {SEED}\n',
        encoding="utf-8",
    )
    release(course, folder / "second")
    return TwoReleases(course / "solutions", folder / "first" / "spring-course", folder / "second" / "spring-course")


def release(course: Path, out: Path, *options: str) -> str:
    """What the command prints; the notebook is made of its text before."""
    _rotflex("make-notebooks", course, out.parent)
    return _rotflex("release", course, out.parent, str(out), *options)


def _rotflex(command: str, course: Path, place: Path, *words: str) -> str:
    done = subprocess.run(
        [sys.executable, "-m", "rotflex.cli", command, *words, "--solutions", str(course / "solutions")],
        cwd=place,
        env=os.environ | {"PYTHONPATH": str(ROOT), "COLUMNS": "200"},
        capture_output=True,
        encoding="utf-8",
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def _change(course: Path) -> None:
    """The course as it is for the second release."""
    _replace(course / "springlab" / "lab.py", "EDITION = 1", "EDITION = 2")
    _replace(course / "springlab" / "catalogue.py", "\n    ],\n", _FIFTH)
    _replace(
        course / "solutions" / "key.py",
        "KEY = {\n",
        'KEY = {\n    "1.5": {"period": Number("the period", lambda bench: 2 * math.pi / bench.omega, rtol=0.02)},\n',
    )
    text = course / "solutions" / "01_spring.py"
    _replace(text, "A mass of half a kilogram hangs on a spring. It is pulled aside by 4 cm and let go.", _OTHER_TITLE)
    with text.open("a", encoding="utf-8") as file:
        file.write("\n# %% answer 1.5\nperiod = 2 * math.pi / omega\n")


def _replace(path: Path, old: str, new: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert text.count(old) == 1, (path, old)
    path.write_text(text.replace(old, new), encoding="utf-8")
