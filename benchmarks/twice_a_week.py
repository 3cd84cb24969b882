"""What the term of a large class costs: the commands that an instructor says twice a week, with little that is new.

    python benchmarks/twice_a_week.py 100 300

Each class has done the whole course, a zip each with notebooks, pictures in them, and answers.json. One student is run
and marked by `rotflex grade`. The others get the same run under their own names, with answers, marks, acts and comments
of their own, through the same intake, preparation and gradebook; so the class is there in minutes. Then the commands
are measured as an instructor types them. The last column is the ratio to the smallest class: what depends on the class
grows with it, and memory (the largest resident set of any process) should not grow at all.
"""

from __future__ import annotations

import argparse
import base64
import json
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any

from classes import WHOLE, environment, grade, grade_command, hand_in, small_course

from labcourse.grading import batch
from labcourse.grading import course as courses
from labcourse.grading.course import Course
from labcourse.grading.gradebook import Gradebook, Graded, RunRecord
from labcourse.grading.graded_run import record_of, submission_of
from labcourse.grading.running.runner import RunLimits
from labcourse.grading.submission import Submission
from labcourse.student_id import GRADEBOOK_FILE

NEW = 5  # students who hand in something new
PICTURE = 300_000  # bytes of what a notebook shows
JOBS = 2
DEADLINE = "\n[[deadline]]\ndue = 2026-01-31\n\n[late]\nper_day = 10\ncap = 50\n"
MODEL = "s001"  # whom the run comes from
STARTED = (2026, 1, 20, 12, 0, 0)  # when the zips were written
CHANGED = (2026, 1, 27, 12, 0, 0)


class Class:
    """A class, its submissions and its gradebook.

    Parameters
    ----------
    scratch : a folder for everything
    source : the folder of the course
    work : the folder with the model's notebooks
    model : the run and the marks of the model
    """

    def __init__(self, scratch: Path, source: Path, work: Path, model: Graded) -> None:
        self.out, self.downloads, self.only_new = scratch / "out", scratch / "all", scratch / "new"
        self._course, self._work, self._model = source, work, model

    def fill(self, size: int) -> None:
        """Hand in, and put the class into the gradebook."""
        students = [f"s{number:03}" for number in range(1, size + 1)]
        for student in students:
            self.pack(self.downloads, student)
        course = courses.load(self._course)
        self.out.mkdir()
        with Gradebook(self.out / GRADEBOOK_FILE) as book:
            roster = self.out / "roster.csv"
            roster.write_text("id,name\n" + "".join(f"{one},Student {one}\n" for one in students), encoding="utf-8")
            book.import_roster(roster)
            steps = _Filled(self.downloads, course, book, self._model).grade()
            for number, step in enumerate(steps):
                _decide(book, step.graded, number)

    def change(self, size: int) -> None:
        """Hand in again: a few students have written something."""
        for number in range(1, size, size // NEW or 1)[:NEW]:
            for folder in (self.downloads, self.only_new):
                self.pack(folder, f"s{number:03}", "# again", CHANGED)

    def pack(self, folder: Path, student: str, more: str = "", when: tuple[int, ...] = STARTED) -> None:
        """Write a student's zip."""
        folder.mkdir(exist_ok=True)
        drawn = random.Random(student)
        with zipfile.ZipFile(folder / f"{student}.zip", "w", zipfile.ZIP_DEFLATED) as archive:
            for path in sorted(self._work.glob("*.ipynb")):
                text = path.read_text(encoding="utf-8").replace(f'# {MODEL}"', f'# {student}{more}"')
                notebook = json.loads(text.replace(f'student = \\"{MODEL}\\"', f'student = \\"{student}\\"'))
                shown = base64.b64encode(drawn.randbytes(PICTURE * 3 // 4)).decode()
                code = next(cell for cell in reversed(notebook["cells"]) if cell["cell_type"] == "code")
                code["outputs"] = [{"output_type": "display_data", "data": {"image/png": shown}, "metadata": {}}]
                archive.writestr(zipfile.ZipInfo(path.name, when), json.dumps(notebook, indent=1))
            answers = answers_of(self._model.run, student)
            archive.writestr(zipfile.ZipInfo("answers.json", when), answers)
            archive.writestr(zipfile.ZipInfo("course.json", when), json.dumps({"student": student}))
        stamp = time.mktime((*when, 0, 0, -1))
        os.utime(folder / f"{student}.zip", (stamp, stamp))


def answers_of(run: RunRecord, student: str) -> bytes:
    """The model's answers under another name: recordings have another amplitude at each sample, numbers are others."""
    drawn = random.Random(student)
    content = json.loads(run.answers or b"{}")
    content["student"] = student
    for parts in content["answers"].values():
        for answer in parts.values():
            if answer.get("kind") == "recording":
                for channel in answer["channels"].values():
                    channel["values"] = [value * (1 + 0.1 * drawn.random()) for value in channel["values"]]
            elif isinstance(answer.get("value"), float):
                answer["value"] *= 1 + 0.2 * drawn.random()
    return json.dumps(content).encode()


class _Filled(batch.Batch):
    """A batch in which everybody's run and marks are the model's."""

    def __init__(self, submissions: Path, course: Course, book: Gradebook, model: Graded) -> None:
        super().__init__(submissions, course, book, batch.Settings(limits=RunLimits(submission=600), jobs=JOBS))
        self._model = model

    def _run(self, submission: Submission, *_: Any) -> None:
        submission.answers = answers_of(self._model.run, submission.student)
        submission.cell_reports = submission_of(self._model.run).cell_reports

    def _mark(self, submission: Submission, *_: Any) -> None:
        drawn = random.Random(submission.student)
        wrong = {"status": "wrong", "points": 0.0, "reason": "It does not fit your bench."}
        marks = [
            replace(mark, **wrong) if mark.status == "right" and drawn.random() < 0.1 else mark
            for mark in self._model.marks
        ]
        submission.graded = Graded(record_of(submission, isolated=True), tuple(marks), self._key_digest)


def _decide(book: Gradebook, graded: Graded, number: int) -> None:
    """A person scores half of the answers in words; some students ask, and get a comment."""
    words = [mark for mark in graded.marks if mark.status == "for a person"]
    for mark in words[::2]:
        book.scores.give(graded.run.student, mark.where, mark.out_of / 2, "tutor", level=2, remark="Say why.")
    if number % 5 == 0 and words:
        book.comment(graded.run.student, "Please look again.", "tutor", *words[0].where, asks=True)
        book.comment(graded.run.student, "Well done.", actor="tutor")


def command(*words: object, scratch: Path, ran: int | None = None) -> tuple[float, float]:
    """Say a command. Returns its time, s, and the largest resident set of its processes, MB.

    Raises
    ------
    RuntimeError
        If it fails, or if it did not run so many submissions.
    """
    code = "import resource, subprocess, sys; done = subprocess.run(sys.argv[1:], stdout=2).returncode"
    code += "; print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss, done)"
    line = [sys.executable, "-c", code, sys.executable, "-m", "rotflex.cli", *map(str, words)]
    started = time.perf_counter()
    done = subprocess.run(line, env=environment(scratch), capture_output=True, text=True, check=True)
    seconds = time.perf_counter() - started
    kilobytes, code = map(int, done.stdout.split())
    if code not in (0, 1) or (ran is not None and f'"ran": {ran},' not in done.stderr):
        raise RuntimeError(f"{words}: exit code {code}\n{done.stderr[-2000:]}")
    return seconds, kilobytes / 1e3


def measured(one: Class, course: Path, size: int, scratch: Path) -> dict[str, tuple[float, float]]:
    """Fill a class, and measure the commands. Returns what was said → s and MB."""
    one.fill(size)
    given = ("--solutions", course)
    graded = (*given, "--jobs", JOBS, "--json")
    rows = {"grade, nothing new": command("grade", one.out, one.downloads, *graded, scratch=scratch, ran=0)}
    for name in ("status", "report"):
        rows[name] = command(name, one.out, *given, scratch=scratch)
    rows["publish"] = command("publish", one.out, "--yes", "--by", "lecturer", *given, scratch=scratch)
    table, filled = one.out.with_name("canvas.csv"), one.out.with_name("filled.csv")
    lines = "".join(f"Student,{number},s{number:03},s{number:03},A,\n" for number in range(1, size + 1))
    head = "Student,ID,SIS User ID,SIS Login ID,Section,Lab (1)\n    Points Possible,,,,,100\n"
    table.write_text(head + lines, encoding="utf-8")
    rows["export"] = command("export", one.out, "--into", table, "--write", filled, *given, scratch=scratch)
    one.change(size)
    rows["grade, 5 new of all"] = command("grade", one.out, one.downloads, *graded, scratch=scratch, ran=NEW)
    rows["grade, only these 5"] = command("grade", one.out, one.only_new, *graded, scratch=scratch, ran=0)
    return rows


def show(classes: dict[int, dict[str, tuple[float, float]]]) -> None:
    """Print the table: size of a class → what :func:`measured` returned."""
    smallest, *_ = classes.values()
    print(f"\n{'':24}{'class':>6}{'s':>8}{'ratio':>7}{'MB':>8}{'ratio':>7}")
    for name, (seconds, megabytes) in smallest.items():
        for size, rows in classes.items():
            taken, used = rows[name]
            print(f"{name:24}{size:6}{taken:8.1f}{taken / seconds:7.2f}{used:8.0f}{used / megabytes:7.2f}")


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sizes", type=int, nargs="*", default=[100, 300], metavar="SIZE")
    parser.add_argument("--smoke", action="store_true", help="a class of six, with two notebooks")
    asked = parser.parse_args()
    print(f"{JOBS} jobs on {os.cpu_count()} processors; load before: {os.getloadavg()[0]:.1f}", flush=True)
    with tempfile.TemporaryDirectory(prefix="rotflex-benchmark-") as folder:
        scratch = Path(folder)
        if asked.smoke:
            course = small_course(scratch / "course")
        else:
            course = Path(shutil.copytree(WHOLE, scratch / "course" / "solutions"))
        with (course / "course.toml").open("a", encoding="utf-8") as file:
            file.write(DEADLINE)
        work = scratch / "work"
        hand_in(course, work, 1)
        grade(grade_command(course, work, scratch / "model", 1), environment(scratch))
        with Gradebook(scratch / "model" / GRADEBOOK_FILE) as book:
            model = book.current(MODEL)
        assert model is not None
        classes = {}
        for size in [6] if asked.smoke else sorted(asked.sizes):
            (scratch / str(size)).mkdir()
            one = Class(scratch / str(size), course, work / MODEL, model)
            classes[size] = measured(one, course, size, scratch)
            print(f"{size}: {classes[size]}", file=sys.stderr, flush=True)
            shutil.rmtree(scratch / str(size))
    show(classes)


if __name__ == "__main__":
    main()
