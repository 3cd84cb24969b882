"""Simulated classes for the benchmarks, and how `rotflex grade` fares with one.

Every student has done everything as the instructor's solutions do it, on a bench of their own. No two notebooks have
the same code: each answer cell bears its student's name in a comment.
"""

from __future__ import annotations

import importlib
import json
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from memory import Peaks, Sampler

from labcourse.grading import course as courses
from labcourse.grading.release import student_course, student_notebooks

ROOT = Path(__file__).resolve().parents[1]
WHOLE = ROOT / "solutions"  #: the folder of the whole course
NO_NAME = 'student = ""'  # in the cell of parameters


def small_course(folder: Path) -> Path:
    """Make the folder of a course with two notebooks, 00 and 02, and the key to their questions."""
    sys.path.append(str(ROOT / "tests" / "helpers"))
    copied = importlib.import_module("made_courses").copied
    key = "\nKEY = {number: KEY[number] for number in ('0.1', '2.9', '2.10', '2.11', '2.12')}\n"
    made: Path = copied(folder, ("00_start.ipynb", "02_finding_stiffness.ipynb"), more=key)
    return made


def hand_in(source: Path, submissions: Path, size: int) -> list[str]:
    """Put so many submissions into a folder, a folder each, and return the students."""
    course = courses.load(source)
    stubs = student_course.derive_notebooks(course)
    solved = {path.name: student_notebooks.read(path) for path in course.notebooks}
    students = [f"s{number:03}" for number in range(1, size + 1)]
    for student in students:
        (submissions / student).mkdir(parents=True)
        for name, text in stubs.items():
            # Of this notebook alone: the same id may be another cell's in another notebook.
            sources = {cell.id: cell.source for cell in solved[name].cells if student_notebooks.is_answer(cell)}
            notebook = _written(json.loads(text), sources, student)
            (submissions / student / name).write_text(json.dumps(notebook), encoding="utf-8")
    return students


def _written(notebook: dict[str, Any], sources: dict[str, str], student: str) -> dict[str, Any]:
    for cell in notebook["cells"]:
        if cell["id"] in sources:
            cell["source"] = f"{sources[cell['id']]}\n# {student}"
        elif cell["id"] == "parameters":
            text = "".join(cell["source"])
            assert NO_NAME in text, text
            cell["source"] = text.replace(NO_NAME, f'student = "{student}"')
    return notebook


def answered(answers: Path) -> set[tuple[str, str]]:
    """The (question, part)s that an ``answers.json`` answers."""
    given = json.loads(answers.read_text(encoding="utf-8"))["answers"]
    return {(question, part) for question, parts in given.items() for part in parts}


def environment(scratch: Path, **more: str) -> dict[str, str]:
    """Return the environment variables for all that is measured.

    There are no progress bars and no user's own settings of Jupyter, and Python stores compiled modules, as usual:
    otherwise each process compiles every library again.
    """
    left_out = ("ROTFLEX_", "JUPYTER_", "PYTHONDONTWRITEBYTECODE")
    plain = {name: value for name, value in os.environ.items() if not name.startswith(left_out)}
    jupyter = {"JUPYTER_CONFIG_DIR": str(scratch / "no-settings"), "JUPYTER_PREFER_ENV_PATH": "1"}
    return {**plain, **jupyter, "TQDM_DISABLE": "1", **more}


@dataclass(frozen=True)
class Graded:
    """How a run of `rotflex grade` went.

    Attributes
    ----------
    seconds : from the command's start to its end
    first : from the command's start to the first result, s
    ran, known : submissions that were run, and that had been run before
    peaks : memory, if it was looked at
    looking : processor time that this took, s
    """

    seconds: float
    first: float
    ran: int
    known: int
    peaks: Peaks | None
    looking: float


def grade_command(source: Path, submissions: Path, out: Path, jobs: int) -> list[str]:
    """The grading of a class as an instructor types it, with lines of JSON to tell when each is done."""
    words = ["-m", "rotflex.cli", "grade", out, submissions, "--solutions", source, "--jobs", jobs, "--json"]
    return [sys.executable, *map(str, words)]


def grade(command: list[str], variables: dict[str, str], interval: float | None = None) -> Graded:
    """Run `rotflex grade`, and see that everybody got all the points that a machine can give.

    Parameters
    ----------
    command : from :func:`grade_command`
    variables : from :func:`environment`
    interval : s; look at its memory so often

    Raises
    ------
    RuntimeError
        If anybody got less.
    """
    first = float("nan")
    started = time.perf_counter()
    with tempfile.TemporaryFile("w+") as log:
        process = subprocess.Popen(command, env=variables, stdout=subprocess.PIPE, stderr=log, text=True)
        sampler = None if interval is None else Sampler(process.pid, interval)
        assert process.stdout is not None
        events = []
        for line in process.stdout:
            events.append(json.loads(line))
            if len(events) == 1:
                first = time.perf_counter() - started
        process.wait()
        seconds = time.perf_counter() - started
        if sampler is not None:
            sampler.stop()
        log.seek(0)
        output = log.read()
    graded = [one for one in events if one["event"] == "graded"]
    short = [one for one in graded if (one["points"] or 0) + one["awaiting"] != one["out_of"]]  # None: not graded
    if process.returncode or short:
        raise RuntimeError(f"rotflex grade: exit code {process.returncode}; {short[:3]}\n{output}")
    done = events[-1]
    peaks, looking = (sampler.peaks, sampler.busy) if sampler else (None, 0.0)
    return Graded(seconds, first, done["ran"], done["known"], peaks, looking)
