"""A class of any size whose notebook is done in a moment, for what is about the class and not about the course."""

import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from gradebook_dump import dump
from made_courses import copied

from labcourse.grading import course as courses
from labcourse.grading.gradebook import Gradebook
from labcourse.grading.release import student_course

NOTEBOOK = "00_start.ipynb"
_ANSWERS = (
    *("resolution = 2 * np.pi / 4096", "resolution = 0.0015", "resolution = 1.0"),
    *("resolution = 'none'", "resolution = None"),
)


def course(folder: Path) -> Path:
    """The folder of this course with its first notebook only."""
    return copied(folder, [NOTEBOOK], more='\nKEY = {"0.1": KEY["0.1"]}\n')


def hand_in(source: Path, submissions: Path, size: int) -> None:
    """So many submissions, right and wrong in turns, no two alike."""
    ((name, text),) = student_course.derive_notebooks(courses.load(source)).items()
    for number in range(size):
        student, notebook = f"student-{number:03}", json.loads(text)
        for cell in notebook["cells"]:
            if cell["id"] == "q0-1":
                cell["source"] = f"{_ANSWERS[number % len(_ANSWERS)]}  # {student}"
        (submissions / student).mkdir(parents=True)
        (submissions / student / name).write_text(json.dumps(notebook), encoding="utf-8")


def command(source: Path, submissions: Path, out: Path, *options: str) -> list[str]:
    """The grading of a class as an instructor types it."""
    words = [sys.executable, "-m", "rotflex.cli", "grade", out, submissions, "--solutions", source]
    return [*map(str, words), "--probe-seed", "7", *options]


def contents(out: Path) -> dict[str, Any]:
    """All that is in a gradebook, but for times and its secret."""
    with Gradebook(out / "gradebook.sqlite") as book:
        return dump(book)


def killed_at_work(words: list[str], scratch: Path) -> None:
    """Run a command, and kill it once it has files in its folder for temporary files, however long that takes."""
    environment = {**os.environ, "TMPDIR": str(scratch)}
    child = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=environment)
    while not any(scratch.iterdir()):
        assert child.poll() is None
        time.sleep(0.01)
    os.kill(child.pid, signal.SIGKILL)
    child.wait()


def killed_and_resumed(words: list[str], kills: int, longest: float, scratch: Path) -> None:
    """Run a command, kill it so often after random times up to the longest (s), and let it come to its end then.

    It is killed sooner if it has come to its end by then. ``scratch`` is its folder for temporary files, by which all
    that it starts can be known.
    """
    environment = {**os.environ, "TMPDIR": str(scratch)}
    drawn = random.Random(1)
    for _ in range(kills):
        moment, killed = drawn.uniform(0, longest), False
        while not killed:
            child = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=environment)
            time.sleep(moment)
            if child.poll() is None:
                os.kill(child.pid, signal.SIGKILL)
                killed = True
            child.wait()
            moment /= 2
    subprocess.run(words, check=False, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
