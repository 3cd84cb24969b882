"""Why answers are missing after a run: what stopped, what builds on it, and what was recorded at home all the same.

In words, for students and instructors; what caused what is found by :mod:`~labcourse.run.causes`.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from labcourse.answers.catalogue import Catalogue
from labcourse.answers.cell_reports import LEFT, CellError, Reports
from labcourse.messages import listed
from labcourse.run.alignment import Role
from labcourse.run.causes import Cause, Causes, Refused, RunCell, Unanswered, Where
from labcourse.run.merge import Merged
from labcourse.run.portability import HERE, Version, in_words

_NO_MODULE = re.compile(r"No module named '([\w.]+)'")
_NAMED = 2  # questions that are named before "and 12 more"
_MOST_HARMLESS = 20  # cells that are told of though they cost nothing


@dataclass(frozen=True)
class Claim:
    """What a student's own ``answers.json`` says was recorded.

    Attributes
    ----------
    cells : question → part → id of the cell that recorded it; "" if none did
    """

    cells: Mapping[str, Mapping[str, str]] = field(default_factory=dict)


@dataclass(frozen=True)
class Reasons:
    """What there is to say of answers that are not there.

    Attributes
    ----------
    missing : (question, part) → why, for the student; only where there is more to say than that nothing was written
    stops : what stopped, a sentence each, and what builds on it
    lost : what was recorded at home and is not here, though nothing stopped; a sentence each
    harmless : what stopped, and cost no answer; a sentence each
    """

    missing: Mapping[Where, str]
    stops: tuple[str, ...] = ()
    lost: tuple[str, ...] = ()
    harmless: tuple[str, ...] = ()


def explain(
    pristine: Mapping[str, dict[str, Any]],
    merged: Merged,
    reports: Reports,
    recorded: Collection[Where],
    catalogue: Catalogue,
    *,
    handed_in: Collection[str],
    claim: Claim | None = None,
    seconds: float | None = None,
    place: str = "",
    python: Version | None = None,
) -> Reasons:
    """Why answers are missing.

    Parameters
    ----------
    pristine : file name → notebook as released
    merged : what was run
    reports : on its cells
    recorded : (question, part) of what was recorded
    catalogue : of the course
    handed_in : file names of the notebooks that were handed in
    claim : what was recorded at home; None if it is not known
    seconds : that a cell might take
    place : where it was run, as in "pandas is not installed ..."
    python : version that the notebooks were saved with, where that is known
    """
    words = _Words(seconds, place or "where grading runs", python or HERE)
    run = Causes(pristine, merged, reports, set(recorded), catalogue)
    missing: dict[Where, str] = {}
    built: dict[RunCell, list[str]] = {}
    for where in run.missing():
        cause = run.cause_of(where)
        if isinstance(cause, RunCell):
            built.setdefault(cause, []).append(where[0])
        said = words.of_missing(run, where, cause)
        if said:
            missing[where] = said
    stops = tuple(words.of_stop(run, cell, list(dict.fromkeys(questions))) for cell, questions in built.items())
    stopped = {where for where in run.missing() if isinstance(run.cause_of(where), RunCell)}
    lost = _lost(run, claim, stopped, handed_in) if claim else {}
    for where, why in lost.items():
        missing.setdefault(where, f"It was recorded at home; {why}.")
    stopped_cells = [cell for cells in run.cells.values() for cell in cells if cell.stopped]
    harmless = [
        words.of_harmless(run, cell) for cell in stopped_cells if cell not in built and not run.is_passed_on(cell)
    ]
    return Reasons(missing, stops, tuple(_grouped(lost)), tuple(harmless[:_MOST_HARMLESS]))


# --- in words ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Words:
    seconds: float | None
    place: str
    python: Version

    def of_missing(self, run: Causes, where: Where, cause: Cause) -> str:
        """Why one answer is missing, for the student."""
        if isinstance(cause, Refused):
            return f"It was given, and not recorded: {cause.why.rstrip('.')}."
        if isinstance(cause, Unanswered):
            return f"It builds on {cause.question}, which is not answered."
        if cause is None:
            return ""
        cell, error = self.name(run, cause), self.of_error(cause)
        if run.question_of(cause) == where[0]:
            return f"{cell} stopped: {error}."
        return f"It builds on what stopped before it: {cell} ({error})."

    def of_stop(self, run: Causes, cell: RunCell, questions: Sequence[str]) -> str:
        """What stopped, and all that builds on it, in a sentence."""
        own = run.question_of(cell)
        others = [question for question in questions if question != own]
        shown = f"{self.name(run, cell)} stopped: {self.of_error(cell)}"
        if not others:
            return f"{shown}."
        return f"{shown}; {_several(others, 'builds', 'build')} on it."

    def of_harmless(self, run: Causes, cell: RunCell) -> str:
        """What stopped, and cost nothing."""
        shown = f"{self.name(run, cell)} stopped: {self.of_error(cell)}"
        return f"{shown}; no answer is missing for it."

    def name(self, run: Causes, cell: RunCell) -> str:
        """What a cell is called."""
        question = run.question_of(cell)
        if cell.role is Role.ADDED:
            if question:
                return f"Your own cell before {question}"
            return f"Your own cell {cell.id} in {cell.notebook}"
        if cell.role is Role.ANSWER or cell.place in run.questions.get(cell.notebook, ()):
            return question or cell.id
        return f"The course's cell {cell.id} in {cell.notebook}"

    def of_error(self, cell: RunCell) -> str:
        """What stopped a cell."""
        report = cell.report
        if report is None or report.error is None:
            return "the Python process ended in it, and nothing after it in this notebook was run"
        error = report.error
        if error.type == LEFT:
            return "it called exit(), which ends Python: nothing after it in this notebook was run"
        line = f", line {error.line}" if error.line else ""
        if error.type == "KeyboardInterrupt" and self.seconds is not None:
            return f"it took longer than {self.seconds:g} s and was stopped{line}"
        if error.type == "SyntaxError" and self.python > HERE:
            line += f": it seems that this needs Python {in_words(self.python)}; grading runs {in_words(HERE)}"
        return f"{self._what(error)}{line}"

    def _what(self, error: CellError) -> str:
        message = " ".join(error.message.split()).rstrip(".")
        no_module = _NO_MODULE.search(message)
        if error.type == "ModuleNotFoundError" and no_module:
            return (
                f"{no_module[1].partition('.')[0]} is not installed {self.place}, and no file of that name was "
                "handed in"
            )
        if error.type == "LimitExceeded":
            return f"your bench stopped: {message}"
        return f"{error.type}, {message}" if message else error.type


def _several(questions: Sequence[str], one: str, many: str) -> str:
    """As "1.2 builds", "1.2 and 1.3 build", "1.2, 1.3 and 12 more build"."""
    if len(questions) > _NAMED + 1:
        return f"{listed(questions, _NAMED)} {many}"
    *most, last = questions
    if not most:
        return f"{last} {one}"
    return f"{', '.join(most)} and {last} {many}"


# --- what was recorded at home ----------------------------------------------------------------------------------------


def _lost(run: Causes, claim: Claim, stopped: Collection[Where], handed_in: Collection[str]) -> dict[Where, str]:
    """What is claimed, and missing though nothing stopped: why."""
    found = {}
    for where in run.missing():
        cell = claim.cells.get(where[0], {}).get(where[1])
        if cell is None or where in stopped or isinstance(run.cause_of(where), Refused):
            continue
        notebook = run.recorder[where][0]
        if notebook not in handed_in:
            found[where] = f"{notebook} was not handed in"
        elif not cell:
            found[where] = (
                "that was done by the button of an explorer or by hand, and no cell that was handed in records it"
            )
        elif cell not in {one.id for one in run.cells[notebook]}:
            found[where] = f"the cell that did it, {cell[:64]}, is no longer in {notebook}"
        else:
            found[where] = f"{notebook}, run from top to bottom, leaves it empty"
    return found


def _grouped(lost: Mapping[Where, str]) -> Iterator[str]:
    """A sentence for each reason."""
    by_reason: dict[str, list[str]] = {}
    for (question, part), why in lost.items():
        by_reason.setdefault(why, []).append(f"{question} {part}")
    for why, parts in by_reason.items():
        yield f"Recorded at home and missing here: {', '.join(parts)}; {why}."
