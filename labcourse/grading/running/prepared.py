"""A submission ready to run: notebooks in the course's frame, own files, texts, and what was recorded at home."""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from labcourse.answers import answers, words
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.notebooks import CODE, MAX_SOURCE, UNREADABLE, Cell, HandIn
from labcourse.answers.words import TextAnswer
from labcourse.errors import AnswerError
from labcourse.grading.running import supplied as supplying
from labcourse.grading.running.bundle import Bundle
from labcourse.grading.running.supplied import Supplied
from labcourse.problems import Code, Problem, Where, as_json
from labcourse.run import alignment, merge
from labcourse.run.alignment import Change, Happened, Role
from labcourse.run.merge import Merged
from labcourse.run.portability import Version
from labcourse.run.reasons import ClaimedCells

_LONGEST_CELL = 64  # characters of a cell's id; as Jupyter allows


@dataclass(frozen=True)
class Prepared:
    """A submission as it is run and marked. Made by :func:`prepare`.

    Attributes
    ----------
    bundle : the release that it is run with
    bench_of : ID of the student on whose bench it is run
    merged : the notebooks to run
    files : the student's own: relative path → content
    words : answers in words, from the saved notebooks
    claim : what was recorded at home; None if that is not known
    handed_in : file names of the notebooks that were handed in
    problems, notes : what went wrong, and what is worth knowing
    reports : file name of a report's PDF → its content; nothing of it is run
    supplied : "1.2.speed" → value that the instructor supplied in place of a missing answer
    python : newest version of Python that a notebook was saved with; None if it is not known
    untouched : names of notebooks, without ending, in which the student changed nothing
    prepared_from : digest of all that it was prepared from
    waits : notebook that others handed in who name this student as a partner, unconfirmed → their IDs
    """

    bundle: Bundle
    bench_of: str
    merged: Merged
    files: Mapping[str, bytes]
    words: Mapping[Where, TextAnswer]
    claim: ClaimedCells | None
    handed_in: tuple[str, ...]
    problems: tuple[Problem, ...]
    notes: tuple[Problem, ...]
    reports: Mapping[str, bytes] = field(default_factory=dict)
    supplied: Mapping[str, Any] = field(default_factory=dict)
    python: Version | None = None
    untouched: tuple[str, ...] = ()
    prepared_from: str = ""
    waits: Mapping[str, Sequence[str]] = field(default_factory=dict)

    def run_content(self) -> list[Any]:
        """Return what a run depends on, as plain data: the owner of the bench, the bundle, the cells and the files.

        A stored run with the same content need not be repeated. Answers in words do not count.
        """
        cells = {
            name: [[cell["id"], cell["source"]] for cell in notebook["cells"]]
            for name, notebook in self.merged.notebooks.items()
        }
        return [self.bench_of, self.bundle.digest, cells, _file_digests(self.files)]

    def digest(self) -> str:
        """Return a digest of the whole submission, problems and notes included."""
        not_run = [list(self.words.items()), self.claim, self.handed_in, _file_digests(self.reports)]
        said = as_json([self.problems, self.notes])
        return content_digest([self.run_content(), *not_run, said, self.waits])


def content_digest(content: object) -> str:
    """Return the SHA-256 digest of plain data and dataclasses; equal content has an equal digest."""
    return hashlib.sha256(json.dumps(content, sort_keys=True, default=repr).encode()).hexdigest()


def _file_digests(files: Mapping[str, bytes]) -> dict[str, str]:
    """Return name → SHA-256 digest of the content."""
    return {name: hashlib.sha256(content).hexdigest() for name, content in files.items()}


def prepare(
    hand_in: HandIn,
    bundle: Bundle,
    catalogue: Catalogue,
    student: str,
    *,
    every_cell: bool = False,
    supplied: Sequence[Supplied] = (),
) -> Prepared:
    """Prepare a submission for its run.

    Parameters
    ----------
    hand_in : as it was read
    bundle : what it is run with
    catalogue : of the course
    student : ID of the student on whose bench it is run
    every_cell : leave no cell out
    supplied : values in place of missing ones
    """
    notebooks = {name: cells for name, cells in hand_in.notebooks.items() if name in bundle.pristine}
    merged = merge.merged(bundle.pristine, notebooks, every_cell, supplying.code_to_insert(bundle.pristine, supplied))
    texts: dict[Where, TextAnswer] = {}
    problems, notes, untouched = list[Problem](), list[Problem](), list[str]()
    budget = words.Budget()
    for name, cells in notebooks.items():
        master = bundle.pristine[name]["cells"]
        written = words.written(master, cells, hand_in.files, budget=budget)
        texts |= written.words
        problems += [replace(problem, where=name) for problem in (*written.problems, *_too_long(cells))]
        changed = map(_changed, filter(_is_noted, merged.changes[name]))
        notes += [replace(note, where=name) for note in (*written.notes, *changed, *_repeated(master, cells))]
        if not written.words and _is_untouched(master, cells):
            notes.append(Problem.of(Code.UNTOUCHED, name))
            untouched.append(name.removesuffix(".ipynb"))
    try:
        claim = None if hand_in.claim is None else _read_claim(hand_in.claim, catalogue)
    except AnswerError as error:
        claim = None
        notes.append(Problem.of(Code.CLAIM_UNREAD, error=str(error)))
    notes += [Problem.of(Code.VALUE_SUPPLIED, value.name, value=str(value.value)) for value in supplied]
    files, handed_in = dict(sorted(hand_in.files.items())), tuple(sorted(notebooks))
    values = {value.name: value.value for value in supplied}
    messages = (tuple(problems), tuple(notes))
    run = (bundle, student, merged, files, texts, claim, handed_in, *messages, hand_in.reports, values)
    return Prepared(*run, untouched=tuple(untouched))


def _repeated(master: Sequence[Mapping[str, Any]], cells: Sequence[Cell]) -> Iterator[Problem]:
    """Yield a note on each id that several answer cells have."""
    times = Counter(cell.id for cell in cells)
    for name in (str(cell["id"]) for cell in master if alignment.role_of(cell) is Role.ANSWER):
        if times[name] > 1:
            yield Problem.of(Code.CELL_REPEATED, cell=name, times=times[name])


def _too_long(cells: Sequence[Cell]) -> Iterator[Problem]:
    """Yield each cell that is too long."""
    for place, cell in enumerate(cells, start=1):
        if cell.kind == UNREADABLE:
            yield Problem.of(Code.CELL_TOO_LONG, cell=place, most=MAX_SOURCE)


def _is_untouched(master: Sequence[Mapping[str, Any]], cells: Sequence[Cell]) -> bool:
    """Return whether a notebook has answer cells, and all code in it is the course's."""
    code = {alignment.source_of(cell).strip() for cell in master}
    has_answers = any(alignment.role_of(cell) is Role.ANSWER for cell in master)
    return has_answers and all(cell.source.strip() in {"", *code} for cell in cells if cell.kind == CODE)


def _is_noted(change: Change) -> bool:
    """Return whether a change of the course's cells is noted for the instructor.

    Changes of text cells for answers are not: texts may be deleted, and answers in words are compared elsewhere.
    """
    if change.role is Role.ANSWER:
        return change.kind == "code"
    return change.role is Role.LOCKED and change.what is not Happened.RENAMED


def _changed(change: Change) -> Problem:
    """Return a note on what happened to a cell of the course."""
    return Problem.of(Code.CELL_CHANGED, cell=change.cell, what=change.what.value, role=change.role.value)


def _read_claim(data: bytes, catalogue: Catalogue) -> ClaimedCells:
    """Read from the student's own answers.json which answers were recorded at home, whomever it names.

    Parameters
    ----------
    data : content of the file
    catalogue : of the course; other questions and parts are left out

    Raises
    ------
    AnswerError
        If it cannot be read; then it does not count.
    """
    content = answers.parse(data)
    return {
        number: {
            name: content["cells"].get(number, {}).get(name, "")[:_LONGEST_CELL]
            for name in question.names
            if name in content["answers"][number]
        }
        for number, question in catalogue.everything.items()
        if number in content["answers"]
    }
