"""What a student sees at home of a hand-in of the honest class, held against what grading made of it."""

import json
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from made_courses import OURS

from labcourse.grading.gradebook import Gradebook
from labcourse.grading.graded_run import recorded_in, submission_of
from labcourse.grading.release import student_course
from labcourse.problems import Code, Problem
from labcourse.sentences import sentences

Where = tuple[str, str]
HERE, THERE = "here", "where grading runs"
_PROGRAM = """
import json, sys
from pathlib import Path
from labcourse.answers import notebooks
from labcourse.run import execute, warm
from labcourse.run.check import check
from labcourse.sentences import sentences
folder, student, seconds = sys.argv[1:]
warm._KernelClient = None  # by the warm process alone
masters = notebooks.masters()
found = check(Path(folder), masters, notebooks.catalogue_of(masters), student=student, cell_timeout=float(seconds))
parts = [[one.question, one.name, one.state.value] for one in found.parts]
print(json.dumps([parts, sentences(found.stops), found.seconds]))
"""


@dataclass(frozen=True)
class Seen:
    """What is recorded of a hand-in, and what is said of what is not.

    Attributes
    ----------
    recorded : (question, part) of what is recorded, words included
    stops : what stopped, and what builds on it, a sentence each
    seconds : that it took; 0 where that is not known
    """

    recorded: frozenset[Where]
    stops: frozenset[str]
    seconds: float = 0.0


def students_installation(folder: Path) -> Path:
    """The course as students have it, in a new folder, to be put on Python's path: nothing of an instructor's."""
    student_course.build(OURS, folder)
    assert not (folder / "labcourse" / "grading").exists()
    return folder


def at_home(folder: Path, student: str, installation: Path, cell_timeout: float) -> Seen:
    """What ``rotflex check`` finds in a folder, with a student's installation."""
    done = subprocess.run(
        [sys.executable, "-P", "-c", _PROGRAM, str(folder), student, str(cell_timeout)],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(installation), "LABCOURSE_RUNNING": ""},
        capture_output=True,
        text=True,
        encoding="utf-8",
        check=False,
    )
    assert done.returncode == 0, done.stderr
    parts, stops, seconds = json.loads(done.stdout.splitlines()[-1])
    recorded = frozenset(
        (question, part) for question, part, state in parts if state in ("recorded", "different", "written")
    )
    return Seen(recorded, frozenset(stops), seconds)


def when_graded(book: Gradebook, student: str) -> Seen:
    """What grading found of a hand-in; sentences say "here", as they do at home."""
    graded = book.current(student)
    assert graded is not None
    run = graded.run
    words = {(question, part) for question, parts in run.words.items() for part in parts}
    stopped = [one for one in submission_of(run).problems if isinstance(one, Problem) and one.code is Code.CELL_STOPPED]
    stops = {line.replace(THERE, HERE) for line in sentences(stopped)}
    return Seen(frozenset(recorded_in(run.answers) | words), frozenset(stops))
