"""The honest class, graded by the command: what each way got, and what the student was told."""

import csv
import json
import re
import subprocess
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from checkout import ROOT
from honest_hand_in import Notebook, Way

WAITING = "for a person"
_HEADINGS = ("Student ID", "name", "email", "Identifier", "alias")


@dataclass
class Marks:
    """What a student got and was told."""

    marks: list[dict[str, Any]] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    @cached_property
    def lost(self) -> dict[str, str]:
        """Question → a part of it that has not its points, though nobody has to read it, and why."""
        return {
            one["question"]: f"{one['question']} {one['part']}, {one['status']}: {one['reason']}"
            for one in self.marks
            if one["status"] != WAITING and one["points"] < one["out_of"]
        }

    @property
    def told(self) -> str:
        """All that the student reads, but for what is right."""
        return "\n".join([*self.problems, *self.notes, *self.lost.values()])


@dataclass
class Graded:
    """A class that was graded, and where it lies."""

    students: dict[str, Marks]
    ignored: list[str]
    place: Path

    def of(self, student: str) -> Marks:
        """What a student got; nothing, where nothing was found of them."""
        return self.students.get(student, Marks())

    def told(self, way: Way) -> str:
        """All that is told of a way: to its students, and of what could not be taken in."""
        return "\n".join([self.of(way.student).told, *self.ignored])

    def not_told(self, way: Way) -> list[str]:
        """What should be told, and is not."""
        told = self.told(way)
        return [pattern for pattern in way.told if not re.search(pattern, told, re.IGNORECASE | re.DOTALL)]


def build(ways: Iterable[Way], solved: Mapping[str, Notebook], folder: Path) -> Path:
    """Put all ways into a folder, and its roster beside it; the roster's path."""
    folder.mkdir(parents=True)
    roster = folder.with_name("roster.csv")
    with roster.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file)
        table.writerow(_HEADINGS)
        for way in ways:
            way.build(folder, solved)
            table.writerow([way.student])
    return roster


def grade(ways: Iterable[Way], solved: Mapping[str, Notebook], place: Path, *options: str) -> Graded:
    """Grade a class of all ways, in isolation, by the command."""
    roster = build(ways, solved, place / "in")
    book = str(place / "book.sqlite")
    _rotflex("roster", book, str(roster))
    said = _rotflex("grade", book, str(place / "in"), "--out", str(place / "out"), "--json", *options)
    lines = [json.loads(line) for line in said.splitlines()]
    students = {}
    for path in (place / "out").glob("*/marks.json"):
        content = json.loads(path.read_text(encoding="utf-8"))
        students[content["student"]] = Marks(content["marks"], content["problems"], content["notes"])
    return Graded(students, [line["what"] for line in lines if line["event"] == "ignored"], place)


def _rotflex(*words: str) -> str:
    command = [sys.executable, "-m", "rotflex.cli", *words]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, encoding="utf-8", check=False)
    assert done.returncode in (0, 1), done.stderr
    return done.stdout
