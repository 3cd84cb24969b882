"""Rehearse a course before a class has it: install its release anew, and mark made-up students on many benches.

:func:`labcourse.grading.course_check.check` looks at one bench, on a computer where everything is installed. This is
what it cannot find: packages that students will not have, and what goes wrong on some benches only. Nothing is changed.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from difflib import get_close_matches
from functools import partial
from pathlib import Path

import numpy as np

from labcourse.answers.cell_reports import REPORTS_FILE
from labcourse.answers.notebooks import imports_of
from labcourse.courses import NOTEBOOKS
from labcourse.errors import GradingError
from labcourse.files import ANSWERS_FILE
from labcourse.grading import course_check
from labcourse.grading.course import Course
from labcourse.grading.course_check import SEED, SOLUTIONS_STUDENT, CourseFault
from labcourse.grading.marking import marking
from labcourse.grading.marking.checks import RecordingOf
from labcourse.grading.marking.decoding import Claims
from labcourse.grading.marking.figure_checks import FigureFollows
from labcourse.grading.release import student_course, student_notebooks
from labcourse.grading.running import bundle
from labcourse.grading.running.bundle import Bundle
from labcourse.problems import Problem, Where
from labcourse.run.alignment import asked_cells
from labcourse.run.merge import merged
from labcourse.sentences import sentence

_Answers = tuple[Claims, Mapping[Where, Problem]]  # of a run of the solutions, and why some are missing

_AT_ONCE = 2  # runs of notebooks
_INSTALL_SECONDS = 240.0
_RUN_SECONDS = 600.0
_LEFT_OUT = "it was not tried in a fresh environment"
_BUILT_BY = "hatchling"  # every release needs it: where pip does not find it, it finds nothing
_CODE = re.compile(r"`([A-Za-z_]\w*)`")  # a name in a text
_NUMBER = re.compile(r"[-−]?\d[\d.e+-]*")
_SCRIPT = """
import json, sys
from pathlib import Path
from labcourse.run import execute
job = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))
execute.run(job["notebooks"], Path(job["folder"]), parameters=job["parameters"], imports=job["imports"])
"""


def rehearse(course: Course, benches: int, progress: Callable[[str], None]) -> Iterator[CourseFault]:
    """Look for what will go wrong when a class has the course.

    Parameters
    ----------
    course : the course
    benches : number of made-up students, each with a bench of their own
    progress : called with what is done next, in a few words

    Yields
    ------
    CourseFault
        First those of :func:`~labcourse.grading.course_check.check`. One that shows on several benches comes once.
    """
    progress("the course as it is")
    seen = set()
    for fault in course_check.check(course):
        seen.add(_kind(fault))
        yield fault
    yield from check_names(course)
    released = bundle.build(course)
    progress("a fresh environment")
    yield from check_fresh(course, released)
    found: dict[tuple[str, str], tuple[CourseFault, list[str]]] = {}
    students = [f"rehearsal-{number}" for number in range(1, benches + 1)]
    runs = ThreadPoolExecutor(_AT_ONCE)
    try:
        run = partial(course_check.answers_of_solutions, course, released)
        again, *given = [runs.submit(run, student) for student in (students[0], *students)]
        for number, (student, answers) in enumerate(zip(students, given, strict=True), 1):
            progress(f"bench {number} of {benches}")
            faults = {_kind(fault): fault for fault in check_bench(course, student, answers.result())}
            for kind, fault in faults.items():
                found.setdefault(kind, (fault, []))[1].append(student)
        yield from differences(given[0].result()[0], again.result()[0])
    finally:
        runs.shutdown(cancel_futures=True)  # who stops it waits for the runs that go on, and for no more
    for kind, (fault, on) in found.items():
        if kind not in seen:
            yield replace(fault, what=f"{fault.what} (on {len(on)} of {benches} benches, first for {on[0]})")


def check_names(course: Course) -> Iterator[CourseFault]:
    """Note texts that ask for a name which is nearly that of the part below them, and not for that."""
    for path in course.notebooks:
        cells = student_notebooks.read(path).cells
        ids = [cell.id for cell in cells]
        for _name, entry, asked in asked_cells({path.name: {"cells": cells}}, course.catalogue):
            texts = [cell.source if cell.cell_type == "markdown" else "" for cell in cells[: ids.index(entry.cell)]]
            begin = max((place for place, text in enumerate(texts) if text.startswith("#")), default=0)
            names = set(_CODE.findall("\n".join(texts[begin:])))
            others = names.difference(course.catalogue.find(entry.question).names)
            for part in [part for _question, part in asked if part not in names and not entry.in_words]:
                for name in (name for name in others if get_close_matches(part.lower(), [name.lower()])):
                    yield CourseFault(f"{path.name}, {entry.question}", f"its text has {name}, not {part}.", True)


def _kind(fault: CourseFault) -> tuple[str, str]:
    """Return by what a fault is the same on several benches: by all but its numbers."""
    return fault.where, _NUMBER.sub("#", fault.what)


def check_bench(course: Course, student: str, answers: _Answers) -> Iterator[CourseFault]:
    """Find what goes wrong on one student's bench.

    These are a bench that cannot be made, faults of the run of the solutions and of their marks, points for an empty
    hand-in, and experiments that are not the same when they are repeated.
    """
    (claims, missing), empty = answers, Claims()
    try:
        case = marking.case_of(course, empty, course.true_bench(student), SEED)
    except Exception as error:
        yield CourseFault("course.py, bench", f"it fails: {marking.error_and_line(course, error)}")
        return
    yield from (CourseFault("the solutions", sentence(problem)) for problem in claims.problems)
    yield from course_check.check_verdicts(course, claims, missing, student)
    for question, part in course_check.asked_parts(course):
        where, check = course_check.in_key(course, question, part), course.key[question.number][part.name]
        if (points := marking.mark_part(course, question, part, empty, case).points) > 0:
            yield CourseFault(where, f"an empty hand-in earns {points:g} points.")
        if isinstance(check, FigureFollows) and (size := _size(check, course.true_bench(student))) > check.largest:
            yield CourseFault(where, f"its largest is {check.largest:g}, and {check.channel} reaches {size:g}.")
        if isinstance(check, RecordingOf):
            yield from (CourseFault(where, fault) for fault in _repeated(course, check, student))


def _size(check: FigureFollows, bench: object) -> float:
    """Return the largest absolute value in the channel that a figure shows; 0 if it cannot be recorded."""
    try:
        return float(np.abs(check.recording(bench).channels[check.channel].values).max())
    except Exception:  # the solution's mark has said so
        return 0.0


def _repeated(course: Course, check: RecordingOf, student: str) -> Iterator[str]:
    """Run the experiment of a check again, on the same bench and on one that is made anew; yield how these differ."""
    bench, run = course.true_bench(student), (1,) * check.runs
    try:
        first, same = (check.recording(bench, *run).channels[check.channel].values for _ in range(2))
        anew = check.recording(course.true_bench(student), *run).channels[check.channel].values
    except Exception:  # the solution's mark has said so
        return
    if not np.array_equal(first, anew):
        yield "on the same bench, made anew, the experiment gives other values: is there chance without its seed?"
    elif not np.array_equal(first, same):
        yield "the experiment, repeated on the same bench, gives other values: does the bench keep something of a run?"


def differences(first: Claims, again: Claims) -> Iterator[CourseFault]:
    """Find recordings that differ between two runs of the same notebooks."""
    for (question, part), content in first.contents.items():
        if content.get("kind") == "recording" and again.contents.get((question, part)) != content:
            what = "it does not repeat: a second run of the notebooks gives other values, if only in the last digit."
            yield CourseFault(f"question {question}, {part}", what)


# --- the release, installed where nothing else is ---------------------------------------------------------------------


def check_fresh(course: Course, released: Bundle) -> Iterator[CourseFault]:
    """Install the release into a new environment and run the solutions there; find what stops, of that the first.

    Where pip reaches no index and no local wheels (``PIP_FIND_LINKS``), a note says that this was left out.
    """
    with tempfile.TemporaryDirectory(prefix="labcourse-rehearse-", ignore_cleanup_errors=True) as scratch:
        home = Path(scratch)
        try:
            made = student_course.release(course, home)
        except GradingError as error:
            yield CourseFault("the release", str(error))
            return
        python = home / "env" / ("Scripts" if os.name == "nt" else "bin") / "python"
        environment = {name: os.environ[name] for name in os.environ if not name.startswith(("PYTHON", "LABCOURSE"))}
        command = partial(subprocess.run, capture_output=True, text=True, encoding="utf-8", env=environment)
        install = [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
        prepare = ([sys.executable, "-m", "venv", str(home / "env")], [*install, _BUILT_BY])
        for step in (*prepare, [*install, str(made.folder)]):
            try:
                done = command(step, timeout=_INSTALL_SECONDS)
            except subprocess.TimeoutExpired:
                yield CourseFault("the release", f"{_LEFT_OUT}: pip takes more than {_INSTALL_SECONDS:g} s.", True)
                return
            if done.returncode:
                lines = (done.stderr or done.stdout).strip().splitlines()
                why = next((line for line in lines if line.startswith("ERROR")), lines[-1])
                left_out = _LEFT_OUT if step in prepare else "it is not installed"
                yield CourseFault("the release", f"{left_out}: {why}", step in prepare)
                return
        work, job = home / "work", home / "job.json"
        shutil.copytree(made.folder / NOTEBOOKS, work)
        notebooks = merged(released.pristine, course_check.solved_cells(course, released.pristine), every_cell=True)
        content = {
            "notebooks": notebooks.notebooks,
            "folder": str(work),
            "parameters": {**released.parameters, "student": SOLUTIONS_STUDENT},
            "imports": imports_of(released.pristine),
        }
        job.write_text(json.dumps(content), encoding="utf-8")
        try:
            done = command([str(python), "-I", "-c", _SCRIPT, str(job)], timeout=_RUN_SECONDS)
        except subprocess.TimeoutExpired:
            yield CourseFault("the release", f"its notebooks take more than {_RUN_SECONDS:g} s.")
            return
        left = {name: (work / name).read_bytes() for name in (ANSWERS_FILE, REPORTS_FILE) if (work / name).exists()}
        stopped = [*course_check.stops(course, released, notebooks, left, "in a fresh environment")]
        yield from {_NUMBER.sub("#", fault.what): fault for fault in reversed(stopped)}.values()  # the first of a kind
        if done.returncode and not stopped:
            yield CourseFault("the release", f"its notebooks cannot be run: {done.stderr.strip().splitlines()[-1]}")
