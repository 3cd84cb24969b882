"""The rows of ``versions_table.py`` with the program: hand-ins, times and commands, as an instructor types them.

Only what costs time is replaced: a run calls the cells in this process, and this process marks.
"""

import contextlib
import csv
import json
import os
import zipfile
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pytest
import versions_table as table
from command_line import rotflex
from fake_class import InlineMarker
from set_clock import set_clock
from versions_table import ASSIGNMENTS, QUESTION, Act, HandIn, Row, at

from labcourse.files import ANSWERS_FILE
from labcourse.grading import batch, counting, overview
from labcourse.grading import course as courses
from labcourse.grading.gradebook import Gradebook, RunRecord
from labcourse.grading.release import releases, student_course
from labcourse.grading.running import isolation_report, runner
from labcourse.grading.todo import todo
from labcourse.problems import Code

END = "12-04 18:00"  #: when all is due


class Session:
    """Stands for ``lab`` in a run: keeps what is answered as ``answers.json`` has it."""

    def __init__(self) -> None:
        self.answers: dict[str, Any] = {}

    def answer(self, question: str, **values: float | None) -> None:
        there = {name: {"kind": "number", "value": float(one)} for name, one in values.items() if one is not None}
        self.answers.setdefault(question, {}).update(there)

    def value(self, question: str, part: str) -> float:
        return self.answers[question][part]["value"]


def run(job: runner.Job) -> runner.Ran:
    """Call the cells of a student's notebooks; one that fails stops no other."""
    lab = Session()
    for notebook in job.notebooks.values():
        names = {"lab": lab, "read": lambda name: job.files[name].decode()}
        for cell in notebook["cells"]:
            if cell["id"].startswith("q"):
                with contextlib.suppress(Exception):
                    exec("".join(cell["source"]), names)
    content = {"format": 2, "student": job.student, "bench": {}, "software": "labcourse", "probe_seed": job.probe_seed}
    return {ANSWERS_FILE: json.dumps({**content, "answers": lab.answers}).encode()}, ()


def written(notebook: dict[str, Any], content: Any) -> dict[str, Any]:
    """A course's notebook with what a student wrote in it."""
    sources = {}
    if content == table.ONLY_ID:
        sources = {"parameters": "student = 'i1'"}
    elif content != table.UNTOUCHED:
        ids = {QUESTION[name].replace(".", "-"): name for name in content}
        sources = {f"q{number}": f"{name} = {content[name]}" for number, name in ids.items()}
        sources |= {f"words-{name}": content[name] for name in content}
    cells = []
    for cell in notebook["cells"]:
        words = f"words-{cell['metadata'].get('labcourse', {}).get('part', '')}"
        tag = "parameters" if "parameters" in cell["metadata"].get("tags", ()) else cell["id"]
        cells.append({**cell, "source": sources.get(words, sources.get(tag, cell["source"]))})
    return {**notebook, "cells": cells}


class VersionsClass:
    """A class that hands in the rows of a table.

    Parameters
    ----------
    folder : where all of it is to lie
    patch : of pytest
    rows : of the table
    per_day : percentage that a day late costs

    Attributes
    ----------
    runs : number of runs by the student with the bench
    """

    def __init__(self, folder: Path, patch: pytest.MonkeyPatch, rows: Iterable[Row], per_day: int = 10) -> None:
        self.folder, self.marks, self.rows, self._patch = folder, folder / "marks", [*rows], patch
        self.runs: Counter[str] = Counter()
        self.solutions = folder / "course" / "solutions"
        self.solutions.mkdir(parents=True)
        settings = table.SETTINGS.format(per_day=per_day)
        texts = {"course.py": table.CATALOGUE, "key.py": table.KEY, "course.toml": settings}
        for name, text in texts.items():
            (self.solutions / name).write_text(text, encoding="utf-8")
        self._handed_out = [self._released(notebooks) for notebooks in (table.NOTEBOOKS, table.NEXT)]
        patch.setattr(isolation_report, "check", lambda: None)
        patch.setattr(batch.runner, "run", self._run)
        for grading in (batch, counting):
            patch.setattr(grading, "Marker", InlineMarker)
        students = sorted({who for row in self.rows for one in row.hand_ins for who in one.students.split("+")})
        lines = ["id,group", *(f"{who},{'pair' if who in table.PAIR else ''}" for who in students)]
        (folder / "roster.csv").write_text("\n".join(lines), encoding="utf-8")
        self.say("roster", self.marks, folder / "roster.csv")

    def _released(self, notebooks: dict[str, str]) -> tuple[str, dict[str, tuple[str, dict[str, Any]]]]:
        """Make and store a release; return its name, and name and content of its notebooks by the first two digits."""
        for name, text in notebooks.items():
            (self.solutions / f"{name}.py").write_text(text, encoding="utf-8")
        course = courses.load(self.solutions)
        paths = student_course.write_notebooks(course)
        made = student_course.release(course, self.folder / "release", replace=True)
        releases.store(course, made.archive, made.id)
        return made.id, {path.name[:2]: (path.name, json.loads(path.read_text(encoding="utf-8"))) for path in paths}

    def _run(self, _packed: bytes, job: runner.Job, cancelled: object = None) -> runner.Ran:
        self.runs[job.student] += 1
        return run(job)

    def say(self, *words: object) -> str:
        """Type a command."""
        of_course = words[0] in ("grade", "regrade", "status", "report", "publish", "excuse", "take")
        done = rotflex(*words, *(["--solutions", self.solutions] if of_course else []))
        assert done.exit_code in (0, 1), (words, done.output, done.exception)
        return done.output

    # --- the term -----------------------------------------------------------------------------------------------------

    def live(self) -> None:
        """Grade each day what came that day, and do what persons do."""
        acts = [(act.when, act) for row in self.rows for act in row.acts]
        came = [(one.when, one) for row in self.rows for one in row.hand_ins]
        for when in sorted({when for when, _what in (*acts, *came)}):
            set_clock(self._patch, at(when))
            for assignment in sorted({one.assignment for time, one in came if time == when}):
                self.grade([one for time, one in came if (time, one.assignment) == (when, assignment)], assignment)
            for _when, act in (act for act in acts if act[0] == when):
                self._do(act)
        self.end()

    def grade_all(self, rows: Iterable[Row]) -> None:
        """Grade all that ever came of some rows from one folder, at the end."""
        set_clock(self._patch, at(END))
        self.grade([one for row in rows for one in row.hand_ins])
        self.end()

    def end(self) -> None:
        """Write all when all is due."""
        set_clock(self._patch, at(END))
        self.say("report", self.marks)

    def grade(self, hand_ins: Iterable[HandIn], assignment: str = "") -> str:
        """Grade some hand-ins from a folder of their own."""
        folder = self.folder / f"in {len([*self.folder.iterdir()])}"
        folder.mkdir()
        names: dict[str, HandIn] = {}
        for one in hand_ins:
            copies = sum(name.partition(" ")[0] == one.students for name in names)
            names[f"{one.students} ({copies})" if copies else one.students] = one
        for name, one in names.items():
            self._pack(folder / name, one)
        lines = ["name,time", *(f"{name}.zip,2026-{one.when}" for name, one in names.items() if one.clock)]
        times = self.folder / "times.csv"
        times.write_text("\n".join(lines), encoding="utf-8")
        more = ("--assignment", assignment) if assignment else ()
        return self.say("grade", self.marks, folder, "--times", times, *more)

    def _pack(self, path: Path, hand_in: HandIn) -> None:
        if table.UNREADABLE in hand_in.notebooks.values():
            path.with_suffix(".zip").write_bytes(b"PK\x03\x04 broken")
            return
        release, notebooks = self._handed_out[hand_in.release - 1]
        files = {name: text.encode() for name, text in hand_in.files.items()}
        for number, content in hand_in.notebooks.items():
            name, notebook = notebooks[number]
            files[name] = json.dumps(written(notebook, content)).encode()
        if hand_in.bench:
            said = {"student": hand_in.bench, "with": [*hand_in.partners], "release": release}
            files["course.json"] = json.dumps(said).encode()
        if hand_in.clock:
            with zipfile.ZipFile(path.with_suffix(".zip"), "w") as archive:
                for name, data in files.items():
                    archive.writestr(name, data)
            return
        for name, data in files.items():  # of a folder, only the times of its files are known
            (path / name).parent.mkdir(parents=True, exist_ok=True)
            (path / name).write_bytes(data)
            os.utime(path / name, (at(hand_in.when).timestamp(),) * 2)

    def _do(self, act: Act) -> None:
        getattr(self, f"_{act.verb}")(*act.about)

    def _mark(self, student: str, question: str, part: str, points: str) -> None:
        self.say("mark", self.marks, student, question, part, points, "--reason", "Read.", "--by", "tia")

    def _excuse(self, student: str, assignment: str) -> None:
        self.say("excuse", self.marks, student, assignment, "--reason", "Ill.", "--by", "lea")

    def _publish(self, assignment: str) -> None:
        self.say("publish", self.marks, "--yes", "--by", "lea", "--assignment", assignment)

    def take(self, student: str, *words: object) -> str:
        """Take a version of a notebook, or list them."""
        return self.say("take", self.marks, student, *words)

    # --- what there is then -------------------------------------------------------------------------------------------

    def grades(self) -> dict[str, dict[str, str]]:
        """The rows of grades.csv, by student."""
        with (self.marks / "grades.csv").open(encoding="utf-8-sig", newline="") as file:
            return {row["student"]: row for row in csv.DictReader(file)}

    def counts(self) -> dict[tuple[str, str], float | str]:
        """Student and assignment → the points that count; "" if nothing is decided."""
        rows = self.grades()
        return {(who, title): rows[who][title] and float(rows[who][title]) for who in rows for title in ASSIGNMENTS}

    def run_of(self, student: str) -> RunRecord:
        """The run that counts."""
        with Gradebook(self.marks / "gradebook.sqlite") as book:
            graded = book.current(student)
        assert graded is not None
        return graded.run

    def tasks(self) -> set[tuple[Code, str]]:
        """What a person must do: code and student."""
        with Gradebook(self.marks / "gradebook.sqlite") as book:
            tasks = todo(overview.class_overview(book, courses.load(self.solutions), self.marks).of)
        return {(task.what.code, who) for task in tasks for who in task.who}

    def states(self) -> dict[tuple[str, str], str]:
        """Student and assignment → its state."""
        return {(who, title): row[f"{title} state"] for who, row in self.grades().items() for title in ASSIGNMENTS}
