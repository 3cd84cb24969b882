"""A hand-in made ready to be run: notebooks in the course's frame, own files, words, what was recorded at home."""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from labcourse.answers import answers, words
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.notebooks import CODE, MAX_SOURCE, UNREADABLE, Cell, HandIn
from labcourse.answers.words import Where, Words
from labcourse.errors import AnswerError
from labcourse.grading.running import supplied as supplying
from labcourse.grading.running.bundle import Bundle
from labcourse.grading.running.supplied import Supplied
from labcourse.run import alignment, merge
from labcourse.run.alignment import Change, Happened, Role
from labcourse.run.merge import Merged
from labcourse.run.reasons import Claim
from labcourse.student_id import LONGEST, caseless

_LONGEST_CELL = 64  # characters of a cell's id; as Jupyter allows


@dataclass(frozen=True)
class Prepared:
    """A hand-in as it is run and marked.

    Attributes
    ----------
    merged : what is run
    files : the student's own: relative path → content
    words : answers in words, from the saved notebooks
    claim : what was recorded at home; None if that is not known
    handed_in : file names of the notebooks that were handed in
    problems, notes : what went wrong, and what is worth knowing
    reports : file name of a report's PDF → its content; nothing of it is run
    """

    merged: Merged
    files: Mapping[str, bytes]
    words: Mapping[Where, Words]
    claim: Claim | None
    handed_in: tuple[str, ...]
    problems: tuple[str, ...]
    notes: tuple[str, ...]
    reports: Mapping[str, bytes] = field(default_factory=dict)

    def content(self) -> list[Any]:
        """All of it that a run depends on, as plain data. Words are not run."""
        cells = {
            name: [[cell["id"], cell["source"]] for cell in notebook["cells"]]
            for name, notebook in self.merged.notebooks.items()
        }
        return [cells, _digests(self.files)]

    def digest(self) -> str:
        """Of all of it."""
        plain = {f"{question} {part}": one.plain() for (question, part), one in self.words.items()}
        claim = None if self.claim is None else [dict(self.claim.cells), self.claim.knows_cells]
        about: list[Any] = [self.content(), plain, claim, self.handed_in, self.problems, self.notes]
        about += [_digests(self.reports)] if self.reports else []
        return hashlib.sha256(json.dumps(about, sort_keys=True).encode()).hexdigest()


def _digests(files: Mapping[str, bytes]) -> dict[str, str]:
    return {name: hashlib.sha256(content).hexdigest() for name, content in files.items()}


def prepare(
    hand_in: HandIn,
    bundle: Bundle,
    catalogue: Catalogue,
    student: str,
    every_cell: bool = False,
    supplied: Sequence[Supplied] = (),
) -> Prepared:
    """Make a hand-in ready.

    Parameters
    ----------
    hand_in : as it was read
    bundle : what it is run with
    catalogue : of the course
    student : whose answers.json it should hold
    every_cell : leave no cell out
    supplied : values in place of missing ones
    """
    notebooks = {name: cells for name, cells in hand_in.notebooks.items() if name in bundle.pristine}
    made = merge.merged(bundle.pristine, notebooks, every_cell, supplying.cells(bundle.pristine, supplied))
    written: dict[Where, Words] = {}
    problems: list[str] = []
    notes: list[str] = []
    for name, cells in notebooks.items():
        found = words.written(bundle.pristine[name]["cells"], cells, hand_in.files)
        written |= found.words
        problems += [f"{name}: {told}" for told in found.problems]
        notes += [f"{name}: {told}" for told in found.notes]
        notes += [f"{name}: {change}" for change in made.changes[name] if _is_told(change)]
        notes += _doubled(name, bundle.pristine[name]["cells"], cells)
        problems += _unreadable(name, cells)
        if not found.words and _is_untouched(bundle.pristine[name]["cells"], cells):
            notes.append(f"{name}: it was handed in as it was handed out; nothing is written in it.")
    claim, said = _claim(hand_in.claim, catalogue, student)
    files = dict(sorted(hand_in.files.items()))
    notes += said
    handed_in = tuple(sorted(notebooks))
    return Prepared(made, files, written, claim, handed_in, tuple(problems), tuple(notes), dict(hand_in.reports))


def _doubled(name: str, master: Sequence[Mapping[str, Any]], cells: Sequence[Cell]) -> list[str]:
    """A note on each answer cell that is there more than once, under one id."""
    times = Counter(cell.id for cell in cells)
    answers = [str(cell["id"]) for cell in master if alignment.role_of(cell) is Role.ANSWER]
    told = "{name}: the cell {cell} is there {times} times; all of them are run, in order."
    return [told.format(name=name, cell=cell, times=times[cell]) for cell in answers if times[cell] > 1]


def _unreadable(name: str, cells: Sequence[Cell]) -> list[str]:
    """A message on each cell that cannot be taken."""
    told = "{name}: its cell {place} is left out: it has more than {most} characters."
    return [
        told.format(name=name, place=place, most=MAX_SOURCE)
        for place, cell in enumerate(cells, start=1)
        if cell.kind == UNREADABLE
    ]


def _is_untouched(master: Sequence[Mapping[str, Any]], cells: Sequence[Cell]) -> bool:
    """Whether a notebook has answer cells, and no code in it is any other than the course's."""
    code = {alignment.source_of(cell).strip() for cell in master}
    asked = any(alignment.role_of(cell) is Role.ANSWER for cell in master)
    return asked and all(cell.source.strip() in code for cell in cells if cell.kind == CODE and cell.source.strip())


def _is_told(change: Change) -> bool:
    """Whether an instructor may want to know of it: text may be deleted, and an answer in words is found elsewhere."""
    if change.role is Role.ANSWER:
        return change.kind == "code"
    return change.role is Role.LOCKED and change.what is not Happened.RENAMED


def _claim(data: bytes | None, catalogue: Catalogue, student: str) -> tuple[Claim | None, tuple[str, ...]]:
    """What the student's own answers.json says was recorded, of what can be asked."""
    if data is None:
        return None, ()
    try:
        content = answers.parse(data)
    except AnswerError as error:
        return None, (f"The student's own answers.json cannot be read, and is not compared: {error}",)
    if caseless(content["student"]) != caseless(student):
        return None, (
            f"The answers.json that was handed in is {content['student'][:LONGEST]!r}'s, and is not compared.",
        )
    known = content["format"] > 1
    cells = {
        number: {
            name: content["cells"].get(number, {}).get(name, "")[:_LONGEST_CELL]
            for name in question.names
            if name in content["answers"].get(number, {})
        }
        for number, question in catalogue.everything.items()
        if number in content["answers"]
    }
    return Claim(cells, known), ()
