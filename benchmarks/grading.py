"""How fast grading is: a papermill loop, `nbgrader autograde` and `rotflex grade`, in turns, on the same notebooks.

    python benchmarks/grading.py --submissions 4 --repeats 5

Each submission is the whole course, done as in the solutions. Times are those of the whole command, from start to end:
ours includes the self-test, the sandboxes, imports, marking, gradebook and feedback, and begins with nothing each time.
Also a lower bound: the students' code as plain Python, with nothing around it (see plain_python.py).

nbgrader comes into a virtual environment of its own (build/nbgrader-venv), as the course does not need it. What each of
them did is looked at afterwards: every cell executed, no errors, the same questions answered, all points.

First, memory is measured on two submissions in a run each, which warms up the caches as well; then come the repeats,
each of which is one run of everybody. Ratios are taken within a repeat; of them, and of times, the median is shown.
A run that fails is left out of them, and is named in the end.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import math
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median

from classes import ROOT, WHOLE, answered, environment, grade, grade_command, hand_in, small_course
from contenders import NbGrader, Papermill
from memory import OTHERS, SANDBOX, TOTAL, WORKERS, Peaks, Sampler

from labcourse.grading import course as courses
from labcourse.grading.release import student_course

OURS = "rotflex grade --jobs {}"
LOWER_BOUND, IMPORTS = "students' code alone", "its imports"
FOR_MEMORY = 2  # submissions, at most
INTERVAL = 0.05  # s between two looks at the memory
ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}  # as in the sandbox

Look = Callable[[Path, bool], tuple[float, Peaks | None]]  # a folder, and whether to look at memory → s, peaks


@dataclass
class Figures:
    """What was measured: who → s and s of processor time, a value for each repeat, nan if it failed; who → peaks."""

    seconds: dict[str, list[float]] = field(default_factory=dict)
    processor: dict[str, list[float]] = field(default_factory=dict)
    peaks: dict[str, Peaks] = field(default_factory=dict)
    failures: list[str] = field(default_factory=list)

    @contextlib.contextmanager
    def noting(self, what: str) -> Iterator[None]:
        """Go on after an error in the ``with`` block, and note it."""
        try:
            yield
        except (OSError, RuntimeError, subprocess.SubprocessError) as error:
            self.failures.append(f"{what}: {error}")
            print(f"failed: {self.failures[-1]}", file=sys.stderr, flush=True)

    def add(self, who: str, seconds: float) -> None:
        """Note a time."""
        self.seconds.setdefault(who, []).append(seconds)

    def ratio(self, one: str, other: str) -> float:
        """How many times the other's time one takes; nan if no repeat has both."""
        return middle([a / b for a, b in zip(self.seconds[one], self.seconds[other], strict=True)])


def middle(values: Sequence[float]) -> float:
    """Return the median of those that were measured; nan if none was."""
    there = [value for value in values if not math.isnan(value)]
    return median(there) if there else math.nan


class Contest:
    """Everybody, on the same submissions.

    Parameters
    ----------
    scratch : a folder for everything
    submissions : how many
    venv : nbgrader's virtual environment; None to leave it out
    source : the course's folder
    """

    def __init__(self, scratch: Path, submissions: int, venv: Path | None, source: Path) -> None:
        self._scratch, self._source = scratch, source
        self._submissions = scratch / "submissions"
        self._students = hand_in(source, self._submissions, submissions)
        others: list[Papermill | NbGrader] = [Papermill(self._submissions, scratch)]
        if venv is not None:
            others.append(NbGrader(self._submissions, scratch, venv, source))
        self.names = [other.name for other in others] + [OURS.format(jobs) for jobs in (1, 2)]
        self._runs: dict[str, Look] = {other.name: self._other(other) for other in others}
        self._runs |= {OURS.format(jobs): self._ours(jobs) for jobs in (1, 2)}
        self._answered: set[tuple[str, str]] | None = None

    def run(self, who: str, with_memory: bool = False) -> tuple[float, Peaks | None]:
        """One run of one of them in a new folder: seconds, and peaks of memory if wanted."""
        with tempfile.TemporaryDirectory(dir=self._scratch) as folder:
            return self._runs[who](Path(folder), with_memory)

    def lower_bound(self) -> dict[str, float]:
        """Seconds of the students' code alone, and of its imports, over all submissions."""
        found = {LOWER_BOUND: 0.0, IMPORTS: 0.0}
        for student in self._students:
            with tempfile.TemporaryDirectory(dir=self._scratch) as folder:
                finished = subprocess.run(
                    [sys.executable, Path(__file__).with_name("plain_python.py"), self._submissions / student],
                    cwd=folder,
                    env=environment(self._scratch, **ONE_THREAD),
                    stdout=subprocess.PIPE,
                    check=True,
                )
                self._same(LOWER_BOUND, answered(Path(folder) / "answers.json"))
            seconds = json.loads(finished.stdout)
            found[LOWER_BOUND] += seconds["cells"]
            found[IMPORTS] += seconds["imports"]
        return found

    def _other(self, other: Papermill | NbGrader) -> Look:
        def look(folder: Path, with_memory: bool) -> tuple[float, Peaks | None]:
            other.prepare(folder)
            with (folder.parent / "log.txt").open("wb") as log:
                started = time.perf_counter()
                process = subprocess.Popen(other.command, cwd=folder, env=other.variables, stdout=log, stderr=log)
                sampler = Sampler(process.pid, INTERVAL) if with_memory else None
                code = process.wait()
                seconds = time.perf_counter() - started
            if sampler:
                sampler.stop()
            if code:
                raise RuntimeError(f"{other.name}: exit code {code}; see {log.name}")
            for student in self._students:
                self._same(other.name, other.check(folder, student))
            return seconds, sampler.peaks if sampler else None

        return look

    def _ours(self, jobs: int) -> Look:
        def look(folder: Path, with_memory: bool) -> tuple[float, Peaks | None]:
            command = grade_command(self._source, self._submissions, folder / "out", jobs)
            done = grade(command, environment(self._scratch), INTERVAL if with_memory else None)
            if (done.ran, done.known) != (len(self._students), 0):
                raise RuntimeError(f"{done.ran} submissions were run and {done.known} were not.")
            return done.seconds, done.peaks

        return look

    def _same(self, who: str, answered: set[tuple[str, str]]) -> None:
        """See that everybody did the same work."""
        if self._answered is None:
            self._answered = answered
        if answered != self._answered:
            raise RuntimeError(f"{who}: other questions were answered: {sorted(answered ^ self._answered)[:5]} ...")


def measured(scratch: Path, submissions: int, repeats: int, venv: Path | None, source: Path) -> Figures:
    """Run everything. Progress is printed on the standard error."""
    figures = Figures()
    (scratch / "memory").mkdir()
    for_memory = Contest(scratch / "memory", min(FOR_MEMORY, submissions), venv, source)
    for who in for_memory.names:
        with figures.noting(f"memory, {who}"):
            seconds, peaks = for_memory.run(who, with_memory=True)
            print(f"memory, {who}: {seconds:.1f} s", file=sys.stderr, flush=True)
            if peaks is not None:
                figures.peaks[who] = peaks
    shutil.rmtree(scratch / "memory")
    contest = Contest(scratch, submissions, venv, source)
    for repeat in range(1, repeats + 1):
        for who in contest.names:
            before, seconds, processor = processor_time(), math.nan, math.nan
            with figures.noting(f"{repeat} of {repeats}, {who}"):
                seconds = contest.run(who)[0]
                processor = processor_time() - before
            figures.add(who, seconds)
            figures.processor.setdefault(who, []).append(processor)
            print(f"{repeat} of {repeats}, {who}: {seconds:.1f} s", file=sys.stderr, flush=True)
        bounds = {LOWER_BOUND: math.nan, IMPORTS: math.nan}
        with figures.noting(f"{repeat} of {repeats}, {LOWER_BOUND}"):
            bounds = contest.lower_bound()
        for what, seconds in bounds.items():
            figures.add(what, seconds)
    return figures


def processor_time() -> float:
    """Processor time of all processes that were started and have ended, s."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def show(figures: Figures, count: int) -> None:
    """Print the tables.

    Parameters
    ----------
    figures : from :func:`measured`
    count : notebooks in a run
    """
    one, two = (OURS.format(jobs) for jobs in (1, 2))
    print(f"\n{'':24}{'s a notebook':>14}{'of all repeats':>18}{'to ours, 1 job':>16}{'processor time':>16}")
    for who, seconds in figures.seconds.items():
        each = [second / count for second in seconds if not math.isnan(second)] or [math.nan]
        processor = f"{middle(figures.processor[who]) / count:16.2f}" if who in figures.processor else ""
        row = f"{who:24}{middle(each):14.2f}{f'{min(each):.2f}–{max(each):.2f}':>18}{figures.ratio(who, one):16.2f}"
        print(row + processor)
    print(f"\n2 jobs are {figures.ratio(one, two):.2f} times as fast as 1")
    code = figures.ratio(LOWER_BOUND, one)
    imports = figures.ratio(IMPORTS, one)
    print(f"of our time with 1 job, students' code is {code:.0%}, and its imports once a submission {imports:.0%}")
    print(f"\npeak memory (PSS), MB   {'all':>10}{'sandboxes':>12}{'marking':>10}{'a worker':>10}")
    for who, peaks in figures.peaks.items():
        row = f"{who:24}{peaks.megabytes(TOTAL):10.0f}"
        for jobs, ours in ((1, one), (2, two)):
            if who == ours:
                row += f"{peaks.megabytes(SANDBOX):12.0f}{peaks.megabytes(OTHERS):10.0f}"
                row += f"{peaks.megabytes(WORKERS) / jobs:10.0f}"
        print(row)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--submissions", type=int, default=4, help="whole courses in a run; even, for two jobs")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--venv", type=Path, default=ROOT / "build" / "nbgrader-venv", help="where nbgrader is or goes")
    parser.add_argument("--without-nbgrader", action="store_true")
    parser.add_argument("--smoke", action="store_true", help="one submission of two notebooks, once, without nbgrader")
    asked = parser.parse_args()
    if asked.smoke:
        asked.submissions, asked.repeats, asked.without_nbgrader = 1, 1, True
    venv = None if asked.without_nbgrader else asked.venv
    with tempfile.TemporaryDirectory(prefix="rotflex-benchmark-") as scratch:
        source = small_course(Path(scratch) / "course") if asked.smoke else WHOLE
        notebooks = len(student_course.derive_notebooks(courses.load(source)))
        print(f"{asked.submissions} submissions of {notebooks} notebooks, {asked.repeats} repeats")
        print(f"{os.cpu_count()} processors; load before: {os.getloadavg()[0]:.1f}", flush=True)
        (Path(scratch) / "contest").mkdir()
        figures = measured(Path(scratch) / "contest", asked.submissions, asked.repeats, venv, source)
    show(figures, asked.submissions * notebooks)
    if figures.failures:
        raise SystemExit("\nfailed:\n" + "\n".join(figures.failures))


if __name__ == "__main__":
    main()
