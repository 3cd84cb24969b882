"""The term of ``term_table.py`` with the program: zips, times and commands, as an instructor has and types them.

Only what costs time is replaced: a run calls the cells in this process, and this process marks.
"""

import csv
import json
import re
import zipfile
from collections.abc import Mapping
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest
from command_line import rotflex
from fake_class import InlineMarker
from page_text import page_text
from set_clock import set_clock
from term_table import (
    ASSIGNMENTS,
    CATALOGUE,
    CLASS,
    FAULTY,
    MENDED,
    NOTEBOOKS,
    QUESTION,
    SETTINGS,
    UNREADABLE,
    UNTOUCHED,
    Day,
    at,
)

from labcourse.errors import IsolationError
from labcourse.files import ANSWERS_FILE
from labcourse.grading import batch, counting, overview
from labcourse.grading import course as courses
from labcourse.grading.gradebook import Gradebook
from labcourse.grading.release import student_course
from labcourse.grading.running import isolation_report, runner
from labcourse.grading.todo import todo
from labcourse.sentences import sentence

CANVAS = "Student,ID,SIS User ID,SIS Login ID,Section,Lab A (11),Lab B (12),04 report (13)\r\n"
CANVAS += "    Points Possible,,,,,20,30,10\r\n"
MOODLE = '"First name","Last name","ID number","Email address","Assignment: Lab A (Real)","Assignment: Lab B (Real)",'
MOODLE += '"Assignment: 04 report (Real)"\n'


class Answers:
    """Stands for ``lab`` in a run: keeps what is answered as ``answers.json`` has it."""

    def __init__(self) -> None:
        self.answers: dict[str, Any] = {}

    def answer(self, question: str, **values: float | None) -> None:
        there = {name: {"kind": "number", "value": float(one)} for name, one in values.items() if one is not None}
        self.answers.setdefault(question, {}).update(there)


def run(_packed: bytes, job: runner.Job, lost: str = "") -> runner.Ran:
    """Call the cells of a student's notebooks."""
    if job.student == lost:
        raise IsolationError("The sandbox is lost.", "sandbox", "Start it again.")
    lab = Answers()
    for notebook in job.notebooks.values():
        names = {"lab": lab}
        for cell in notebook["cells"]:
            if cell["id"].startswith("q"):
                exec("".join(cell["source"]), names)
    content = {"format": 2, "student": job.student, "bench": {}, "software": "labcourse", "probe_seed": job.probe_seed}
    return {ANSWERS_FILE: json.dumps({**content, "answers": lab.answers}).encode()}, ()


def written(notebook: dict[str, Any], content: Mapping[str, Any]) -> dict[str, Any]:
    """A course's notebook with what a student wrote in it."""
    cells = []
    for cell in notebook["cells"]:
        part = next((name for name in content if cell["id"] == f"q{QUESTION.get(name, '').replace('.', '-')}"), "")
        words = cell["metadata"].get("labcourse", {}).get("part", "")
        source = cell["source"]
        if part:
            source = f"{part} = {content[part]}"
        elif words in content:
            source = content[words]
        cells.append({**cell, "source": source})
    return {**notebook, "cells": cells}


class TermClass:
    """A class through the term.

    Parameters
    ----------
    folder : where all of it is to lie
    patch : of pytest

    Attributes
    ----------
    marks : the folder of results
    published : what ``rotflex publish`` said last
    solutions : the course as it is now
    """

    def __init__(self, folder: Path, patch: pytest.MonkeyPatch) -> None:
        self.folder, self.marks, self.published, self._patch = folder, folder / "marks", "", patch
        self._courses = {key: self._made_course(name, key) for name, key in (("first", FAULTY), ("then", MENDED))}
        patch.setattr(isolation_report, "check", lambda: None)
        for grading in (batch, counting):
            patch.setattr(grading, "Marker", InlineMarker)
        self._use(FAULTY)
        roster = "\n".join(["id,name,section", *(f"{who},{name},{part}" for who, (name, part) in CLASS.items())])
        (folder / "roster.csv").write_text(roster, encoding="utf-8")
        self.say("roster", self.marks, folder / "roster.csv")

    def _made_course(self, name: str, key: str) -> Path:
        folder = self.folder / name / "solutions"
        folder.mkdir(parents=True)
        files = {"course.py": CATALOGUE, "key.py": key, "course.toml": SETTINGS}
        files |= {f"{notebook}.py": text for notebook, text in NOTEBOOKS.items()}
        for file, text in files.items():
            (folder / file).write_text(text, encoding="utf-8")
        self._handed_out = {path.name[:2]: path for path in student_course.write_notebooks(courses.load(folder))}
        return folder

    def _use(self, key: str) -> None:
        self.solutions = self._courses[key]

    def say(self, *words: object, code: int | None = 0) -> str:
        """Type a command, which has to end with this exit code; None for any."""
        of_course = words[0] in ("grade", "regrade", "status", "report", "publish", "export", "excuse")
        done = rotflex(*words, *(["--solutions", self.solutions] if of_course else []))
        assert code is None or done.exit_code == code, (words, done.output, done.exception)
        return done.output

    # --- a date -------------------------------------------------------------------------------------------------------

    def live(self, day: Day) -> None:
        """Grade what came, and do what persons do."""
        set_clock(self._patch, at(day.now))
        self._patch.setattr(batch.runner, "run", lambda packed, job, cancelled: run(packed, job, day.lost))
        came = self.folder / f"until {day.now[:5]}"
        came.mkdir()
        for hand_in in day.hand_ins:
            self._pack(came / f"{hand_in.students}.zip", hand_in.notebooks)
        lines = [f"{hand_in.students}.zip,2026-{hand_in.when}" for hand_in in day.hand_ins]
        times = self.folder / "times.csv"
        times.write_text("\n".join(["name,time", *lines]), encoding="utf-8")
        self.say("grade", self.marks, came, "--times", times, code=3 if day.lost else None)
        for verb, *about in day.acts:
            getattr(self, f"_{verb}")(*about)
        if day.acts and day.acts[-1][0] != "publish":  # which writes all of it
            self.say("report", self.marks)

    def _pack(self, path: Path, notebooks: Mapping[str, Any]) -> None:
        with zipfile.ZipFile(path, "w") as archive:
            for number, content in notebooks.items():
                handed_out = self._handed_out[number]
                data = handed_out.read_text(encoding="utf-8")
                if content == UNREADABLE:
                    data = data[:100]
                elif content != UNTOUCHED:
                    data = json.dumps(written(json.loads(data), content))
                archive.writestr(handed_out.name, data)

    def _mark(self, student: str, part: str, points: str) -> None:
        self.say("mark", self.marks, student, QUESTION[part], part, points, "--reason", "Read.", "--by", "tia")

    def _request(self, student: str, part: str) -> None:
        self._comment(student, part, "Please look again.", "--ask")

    def _answer(self, student: str, part: str) -> None:
        self._comment(student, part, "It stays.")

    def _comment(self, student: str, part: str, text: str, *more: str) -> None:
        answer = ("--question", QUESTION[part], "--part", part)
        self.say("comment", self.marks, student, text, *answer, "--by", "tia", *more)

    def _excuse(self, student: str, assignment: str) -> None:
        self.say("excuse", self.marks, student, assignment, "--reason", "Ill.", "--by", "lea")

    def _undo(self, student: str, assignment: str) -> None:
        self.say("excuse", self.marks, student, assignment, "--reason", "A mistake.", "--by", "lea", "--undo")

    def _regrade(self) -> None:
        self._use(MENDED)
        self.say("regrade", self.marks)

    def _publish(self, *assignments: str) -> None:
        chosen = [word for title in assignments for word in ("--assignment", title)]
        self.published = self.say("publish", self.marks, "--yes", "--by", "lea", *chosen)

    # --- what there is then -------------------------------------------------------------------------------------------

    def grades(self) -> dict[str, dict[str, str]]:
        """The rows of grades.csv, by student."""
        with (self.marks / "grades.csv").open(encoding="utf-8-sig", newline="") as file:
            return {row["student"]: row for row in csv.DictReader(file)}

    def data(self, student: str) -> dict[str, Any]:
        """A student's marks.json; nothing without one."""
        file = self.marks / student / "marks.json"
        return json.loads(file.read_text(encoding="utf-8")) if file.exists() else {}

    def page(self, student: str) -> tuple[str, list[list[str]]]:
        """What a student's page says above its first table, and the cells of that, by row; nothing without a page."""
        file = self.marks / student / "feedback.html"
        first, _table, rest = (file.read_text("utf-8") if file.exists() else "").partition("<tbody>")
        rows = rest.partition("</tbody>")[0].split("</tr>")[:-1]
        return page_text(first), [list(map(page_text, re.split(r"</t[hd]>", row)[:-1])) for row in rows]

    def to_do(self) -> dict[str, tuple[set[str], Fraction | None]]:
        """What the class page says first: a task → its students, and the points at stake."""
        with Gradebook(self.marks / "gradebook.sqlite") as book:
            tasks = todo(overview.class_overview(book, courses.load(self.solutions), self.marks).of)
        return {sentence(task.what): ({*task.who}, task.worth) for task in tasks}

    def exported(self, platform: str, title: str) -> dict[str, str]:
        """The column of an assignment in a platform's file, by student."""
        file, filled = self.folder / "theirs.csv", self.folder / "filled.csv"
        rows = enumerate(CLASS.items(), 70)
        if platform == "Canvas":
            lines = [f'"{name}",{number},{who},{who},{part},,,\r\n' for number, (who, (name, part)) in rows]
            file.write_text(CANVAS + "".join(lines), encoding="utf-8", newline="")
        else:
            lines = [f"{name.replace(' ', ',')},{who},,-,-,-\n" for _number, (who, (name, _part)) in rows]
            file.write_text(MOODLE + "".join(lines), encoding="utf-8", newline="")
        filled.unlink(missing_ok=True)
        column = ["--assignment", title, "--column", title]
        column += [] if platform == "Canvas" else ["--out-of", ASSIGNMENTS[title][1]]
        said = self.say("export", self.marks, "--into", file, "--write", filled, *column, code=None)
        assert filled.exists(), said
        with filled.open(encoding="utf-8-sig", newline="") as opened:
            table = list(csv.DictReader(opened))
        (column,) = (name for name in table[0] if title in name)
        key = "SIS User ID" if platform == "Canvas" else "ID number"
        return {row[key]: row[column] for row in table if row[key]}
