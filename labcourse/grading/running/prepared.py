"""A submission ready to run: notebooks in the course's frame, own files, texts, and what was recorded at home."""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import labcourse
from labcourse.answers import answers, words
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.notebooks import MAX_SOURCE, UNREADABLE, Cell
from labcourse.answers.words import TextAnswer
from labcourse.errors import AnswerError
from labcourse.grading.running import supplied as supplying
from labcourse.grading.running.bundle import Bundle
from labcourse.grading.running.supplied import Supplied
from labcourse.grading.submission import Submission
from labcourse.problems import Code, Problem, Where, as_json
from labcourse.run import alignment, merge
from labcourse.run.alignment import Change, Happened, Role
from labcourse.run.reasons import CellIdsAtHome

_LONGEST_CELL_ID = 64  # characters; as Jupyter allows


def content_digest(content: object) -> str:
    """Return the SHA-256 digest (hexadecimal) of plain data and dataclasses; equal content has an equal digest."""
    return hashlib.sha256(json.dumps(content, sort_keys=True, default=repr).encode()).hexdigest()


def program_digest() -> str:
    """Return the digest of labcourse: submissions are prepared, and pages made, again when a part of it changes."""
    package = Path(labcourse.__file__).parent
    sources = (path for path in sorted(package.rglob("*")) if path.suffix in (".py", ".html", ".css"))
    return content_digest(_file_digests({f"{path}": path.read_bytes() for path in sources}))


def _file_digests(files: Mapping[str, bytes]) -> dict[str, str]:
    """Return name → SHA-256 digest of the content, in hexadecimal digits."""
    return {name: hashlib.sha256(content).hexdigest() for name, content in files.items()}


def run_content(submission: Submission) -> list[Any]:
    """Return what a run depends on, as plain data: the owner of the bench, the bundle, the cells and the files.

    A stored run with the same content need not be repeated. Answers in words are no part of it.
    """
    cells = {
        name: [[cell["id"], cell["source"]] for cell in notebook["cells"]]
        for name, notebook in submission.merged.notebooks.items()
    }
    return [submission.bench_of, submission.bundle.digest, cells, _file_digests(submission.files)]


def not_run(submission: Submission) -> list[Any]:
    """Return what is marked and not run, as plain data: answers in words, and reports."""
    return [list(submission.words.items()), _file_digests(submission.pdfs)]


def submission_digest(submission: Submission, content: list[Any]) -> str:
    """Return a digest of a whole submission: of what is run, of what is not, and of problems and notes.

    ``content`` is from :func:`run_content`.
    """
    compared = [submission.claim, submission.handed_in]
    messages = as_json([submission.problems, submission.notes])
    return content_digest([content, *not_run(submission), *compared, messages, submission.waiting])


def prepare(
    submission: Submission,
    bundle: Bundle,
    catalogue: Catalogue,
    *,
    every_cell: bool = False,
    supplied: Sequence[Supplied] = (),
) -> None:
    """Prepare a submission for its run: fill in the notebooks to run, the answers in words, and the cells at home.

    Problems and notes say what is wrong with the notebooks, and which cells of the course are changed.

    Parameters
    ----------
    submission : with the files that count
    bundle : the release that it is run with
    catalogue : of the course
    every_cell : run the cells that only show something, too
    supplied : values that the instructor gives in place of missing answers
    """
    notebooks = {name: cells for name, cells in submission.notebooks.items() if name in bundle.pristine}
    inserted = supplying.code_to_insert(bundle.pristine, supplied)
    submission.bundle, submission.notebooks = bundle, notebooks
    submission.merged = merged = merge.merged(bundle.pristine, notebooks, every_cell, inserted)
    texts: dict[Where, TextAnswer] = {}
    untouched = list[str]()
    budget = words.Budget()
    for name, cells in notebooks.items():
        master = bundle.pristine[name]["cells"]
        written = words.written(master, cells, submission.files, budget=budget)
        texts |= written.words
        problems = (*written.problems, *_too_long(cells))
        changed = (change.problem for change in merged.changes[name] if _is_noted(change))
        notes = (*written.notes, *changed, *_repeated(master, cells))
        submission.problems += [replace(problem, where=name) for problem in problems]
        submission.notes += [replace(note, where=name) for note in notes]
        if not written.words and _is_untouched(master, cells):
            submission.notes.append(Problem.of(Code.UNTOUCHED, name))
            untouched.append(name.removesuffix(".ipynb"))
    try:
        at_home = submission.answers_at_home
        submission.claim = None if at_home is None else _read_cells_at_home(at_home, catalogue)
    except AnswerError as error:
        submission.notes.append(Problem.of(Code.CLAIM_UNREAD, error=str(error)))
    submission.notes += [Problem.of(Code.VALUE_SUPPLIED, value.name, value=str(value.value)) for value in supplied]
    submission.supplied = {value.name: value.value for value in supplied}
    submission.files = dict(sorted(submission.files.items()))
    submission.words, submission.untouched = texts, tuple(untouched)


def _repeated(master: Sequence[Mapping[str, Any]], cells: Sequence[Cell]) -> Iterator[Problem]:
    """Yield a note on each answer cell of the course with an id that several cells of the student have."""
    times = Counter(cell.id for cell in cells)
    for name in (str(cell["id"]) for cell in master if alignment.role_of(cell) is Role.ANSWER):
        if times[name] > 1:
            yield Problem.of(Code.CELL_REPEATED, cell=name, times=times[name])


def _too_long(cells: Sequence[Cell]) -> Iterator[Problem]:
    """Yield a problem for each cell of the student that is too long to be read."""
    for place, cell in enumerate(cells, start=1):
        if cell.kind == UNREADABLE:
            yield Problem.of(Code.CELL_TOO_LONG, cell=place, most=MAX_SOURCE)


def _is_untouched(master: Sequence[Mapping[str, Any]], cells: Sequence[Cell]) -> bool:
    """Return whether a notebook has cells for answers, and the student wrote nothing in it."""
    has_answers = any(alignment.role_of(cell) is Role.ANSWER for cell in master)
    return has_answers and not alignment.count_changed(master, cells)


def _is_noted(change: Change) -> bool:
    """Return whether a change of the course's cells is noted for the instructor.

    Changes of text cells for answers are not: texts may be deleted, and answers in words are compared elsewhere.
    """
    if change.role is Role.ANSWER:
        return change.kind == "code"
    return change.role is Role.LOCKED and change.what is not Happened.RENAMED


def _read_cells_at_home(data: bytes, catalogue: Catalogue) -> CellIdsAtHome:
    """Read from the student's own answers.json by which cells answers were recorded at home, whatever student it names.

    Parameters
    ----------
    data : content of the file
    catalogue : of the course; other questions and parts are left out

    Returns
    -------
    Mapping
        question → part → id of the cell that recorded the answer at home; "" if no cell did. Parts without an answer
        are left out.

    Raises
    ------
    AnswerError
        If the file cannot be read.
    """
    content = answers.parse(data)
    return {
        number: {
            name: content["cells"].get(number, {}).get(name, "")[:_LONGEST_CELL_ID]
            for name in question.names
            if name in content["answers"][number]
        }
        for number, question in catalogue.everything.items()
        if number in content["answers"]
    }
