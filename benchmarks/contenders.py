"""What `rotflex grade` is measured against: a plain papermill loop, and nbgrader as its users run it.

Both run the notebooks as they were handed in. nbgrader gets a virtual environment of its own, with the same versions of
all libraries, and a course in its own layout; our notebooks bear its metadata already and are taken as they are. Our
answer cells are "manually graded" to nbgrader: it executes everything and gives no marks, which is the least it can do.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from classes import ROOT, WHOLE, answered, environment

from labcourse.grading import course as courses
from labcourse.grading.release import student_course

ASSIGNMENT = "course"
SUBMITTED, EXECUTED = "submitted", "executed"

#: The loop that anybody would write. Notebooks stay where they are, and are run there.
PAPERMILL_LOOP = f"""
from pathlib import Path
import papermill
for folder in sorted(Path("{SUBMITTED}").iterdir()):
    out = Path("{EXECUTED}") / folder.name
    out.mkdir(parents=True)
    for path in sorted(folder.glob("*.ipynb")):
        papermill.execute_notebook(path, out / path.name, cwd=folder, progress_bar=False)
"""


def run(command: list[str], folder: Path, variables: dict[str, str]) -> str:
    """Run a command to its end, and return what it says.

    Raises
    ------
    RuntimeError
        If it fails.
    """
    done = subprocess.run(command, cwd=folder, env=variables, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"{command[:4]} ended with {done.returncode}:\n{done.stdout[-2000:]}\n{done.stderr[-4000:]}")
    return done.stdout


def executed(folder: Path, answers: Path) -> set[tuple[str, str]]:
    """What was answered when the notebooks of a folder were executed.

    Raises
    ------
    RuntimeError
        If a cell was not executed, or ended in an error.
    """
    for path in sorted(folder.glob("*.ipynb")):
        for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]:
            if cell["cell_type"] != "code":
                continue
            failed = any(output["output_type"] == "error" for output in cell["outputs"])
            if failed or cell["execution_count"] is None:
                raise RuntimeError(f"{path}: cell {cell['id']} was not executed, or not without an error.")
    return answered(answers)


class Papermill:
    """A loop over all notebooks with a real kernel for each, and nothing else."""

    name = "papermill loop"

    def __init__(self, submissions: Path, scratch: Path) -> None:
        self._submissions = submissions
        self.command = [sys.executable, "-c", PAPERMILL_LOOP]
        self.variables = environment(scratch)

    def prepare(self, folder: Path) -> None:
        """Put everything into a new folder."""
        shutil.copytree(self._submissions, folder / SUBMITTED)

    def check(self, folder: Path, student: str) -> set[tuple[str, str]]:
        """See that everything of a student was executed, and return what was answered."""
        return executed(folder / EXECUTED / student, folder / SUBMITTED / student / "answers.json")


class NbGrader:
    """`nbgrader autograde` on a course that is set up already: assignment generated, submissions collected."""

    name = "nbgrader autograde"

    def __init__(self, submissions: Path, scratch: Path, venv: Path, source: Path = WHOLE) -> None:
        programs = _installed(venv)
        self.variables = environment(scratch)
        self.variables["PATH"] = f"{programs}:{self.variables['PATH']}"
        self.command = [str(programs / "nbgrader"), "autograde", ASSIGNMENT]
        self._course = scratch / "nbgrader-course"
        (self._course / "source" / ASSIGNMENT).mkdir(parents=True)
        for name, text in student_course.derive_notebooks(courses.load(source)).items():
            (self._course / "source" / ASSIGNMENT / name).write_text(text, encoding="utf-8")
        run([self.command[0], "generate_assignment", ASSIGNMENT], self._course, self.variables)
        for folder in submissions.iterdir():
            shutil.copytree(folder, self._course / SUBMITTED / folder.name / ASSIGNMENT)

    def prepare(self, folder: Path) -> None:
        """Put the course into a new folder: nothing of it was autograded."""
        shutil.copytree(self._course, folder, dirs_exist_ok=True)

    def check(self, folder: Path, student: str) -> set[tuple[str, str]]:
        """See that everything of a student was executed, and return what was answered."""
        graded = folder / "autograded" / student / ASSIGNMENT
        return executed(graded, graded / "answers.json")


def _installed(venv: Path) -> Path:
    """The programs of nbgrader's virtual environment, which is made if it is not there yet."""
    programs = venv / "bin"
    if not (programs / "nbgrader").exists():
        print(f"Installing nbgrader in {venv} ...", file=sys.stderr)
        subprocess.run([sys.executable, "-m", "venv", venv], check=True)
        listed = [sys.executable, "-m", "pip", "freeze", "--exclude-editable"]
        versions = subprocess.run(listed, capture_output=True, text=True, check=True).stdout
        with tempfile.NamedTemporaryFile("w", suffix=".txt") as same:
            same.write(versions)
            same.flush()
            pip: list[str | Path] = [programs / "python", "-m", "pip", "install", "--quiet", "--constraint", same.name]
            subprocess.run([*pip, "nbgrader", "--editable", ROOT], check=True)
    return programs
