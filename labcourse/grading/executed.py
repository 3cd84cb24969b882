"""What a student's notebook showed when it was run again: a notebook, and a page of it.

All outputs come from the sandbox and are not to be trusted. Taken are plain text, errors, and pictures, which are
decoded and encoded anew; no HTML, no script, and nothing else that a browser or Jupyter would do something with.
"""

from __future__ import annotations

import base64
import contextlib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import nbformat

from labcourse import files
from labcourse.answers.answers import by_part
from labcourse.answers.words import Budget, PictureError, as_png, decoded
from labcourse.errors import GradingError
from labcourse.files import ANSWERS_FILE
from labcourse.grading import counting
from labcourse.grading.batch import Batch, Settings
from labcourse.grading.course import Course
from labcourse.grading.gradebook import Gradebook
from labcourse.grading.graded_run import answers_of
from labcourse.grading.reports.grades import EXECUTED_FOLDER
from labcourse.grading.reports.templating import templates
from labcourse.grading.versions import HandInKey
from labcourse.patterns import pattern
from labcourse.problems import Where
from labcourse.run.inside import EXECUTED
from labcourse.run.inside.outputs import CUT, MOST_OF_CELL, Allowance
from labcourse.safe_text import no_escapes
from labcourse.sentences import sentence, sentences

_COLOURS = pattern(r"\x1b\[[0-9;]{0,50}m", MOST_OF_CELL)  # of an error, for a terminal
_PICTURES = ("image/png", "image/jpeg")
_KERNEL = {"display_name": "Python 3", "language": "python", "name": "python3"}


def write(
    book: Gradebook, course: Course, student: str, out: Path, notebook: str | None = None, version: int | None = None
) -> Iterator[Path]:
    """Run notebooks of a student again in the sandbox, and write what they showed. Yield each page that is written.

    Marks stay as they are, and nothing is stored in the gradebook.

    Parameters
    ----------
    book, course : the gradebook and its course
    student : ID
    out : the folder of results
    notebook : without ending; None for all notebooks that count
    version : its number in :func:`.counting.listed`; None for the one that counts

    Raises
    ------
    GradingError
        If there is no such version, or nothing of the student was graded.
    IsolationError
        If it cannot be isolated.
    """
    marked = book.current(student)
    if marked is None:
        raise GradingError(f"Nothing of {student!r} was graded.")
    by_seed: dict[int, dict[str, HandInKey]] = {}
    for one in marked.run.versions:
        if one.get("counts") and notebook in (None, one["notebook"]):
            key = one["source"], counting.arrival_of(one).received
            if notebook and version is not None:
                hand_ins = counting.listed(book, student, notebook)
                if not 1 <= version <= len(hand_ins):
                    raise GradingError(f"There is no version {version} of {notebook}: {student!r} has {len(hand_ins)}.")
                key = hand_ins[version - 1][0].key
            seed = (book.find_made(one["run"]) or marked).run.probe_seed
            by_seed.setdefault(seed, {})[f"{one['notebook']}.ipynb"] = key
    folder, before = out / marked.run.student / EXECUTED_FOLDER, answers_of(marked.run)
    batch, written = Batch([student], course, book, Settings(every_cell=True)), False
    runs = (run for seed, wanted in by_seed.items() for run in batch.rerun(student, wanted, seed))
    for job, (came, problems) in runs:
        now = answers_of(replace(marked.run, answers=came.get(ANSWERS_FILE)))
        for name in job.shown:
            node = as_shown(job.notebooks[name]["cells"], came.get(f"{EXECUTED}{name}", b""))
            other = [where for where in different(before, now) if f"{course.notebook_of(where[0])}.ipynb" == name]
            said = [*_about(other), *sentences(problems)]
            if not any(cell.outputs for cell in node.cells):
                said.append("Nothing came back of what it showed.")
            about = {"student": marked.run.student, "notebook": name, "said": said, "cells": node.cells}
            page = templates().get_template("executed.html").render(**about)
            node.cells.insert(0, nbformat.v4.new_raw_cell(no_escapes("\n".join(said)), id="about-this-run"))
            folder.mkdir(parents=True, exist_ok=True)
            files.write(folder / name, json.dumps(node, indent=1) + "\n")
            files.write(target := (folder / name).with_suffix(".html"), page + "\n")
            written = True
            yield target
    if not written:
        raise GradingError(f"{student!r} has no such version of {notebook or 'any notebook'}.")


def _about(other: Sequence[Where]) -> Iterator[str]:
    """Yield what stands above a notebook; ``other`` are the (question, part) that were marked with another answer."""
    yield "This is what the student's code showed in this run. Marks do not come from it."
    if not other:
        yield "Its answers are those that were marked."
        return
    yield f"Other answers than those that were marked: {', '.join(map(' '.join, other))}."


def different(before: Mapping[str, Any], now: Mapping[str, Any]) -> list[Where]:
    """Return the (question, part) with another answer in one ``answers.json`` than in the other, or with none."""
    old, new = map(by_part, (before, now))
    return [where for where in dict.fromkeys([*old, *new]) if old.get(where) != new.get(where)]


def as_shown(cells: Sequence[Mapping[str, Any]], executed: bytes) -> Any:
    """Return a notebook with the cells that were run, and with those outputs of an executed one that do no harm.

    Parameters
    ----------
    cells : that were run
    executed : the notebook as it came back, untrusted; nothing is taken of it if it cannot be read
    """
    outputs: dict[str, Any] = {}
    with contextlib.suppress(ValueError, TypeError, KeyError, AttributeError):
        outputs = {cell["id"]: cell.get("outputs") for cell in files.from_json(executed)["cells"]}
    allowance, budget = Allowance(), Budget()
    made = [
        nbformat.v4.new_code_cell(
            no_escapes("".join(cell["source"])),
            id=cell["id"],
            outputs=[*_bounded(outputs.get(cell["id"]), allowance, budget)],
        )
        for cell in cells
    ]
    return nbformat.v4.new_notebook(cells=made, metadata={"kernelspec": _KERNEL})


def _bounded(outputs: Any, allowance: Allowance, budget: Budget) -> Iterator[Any]:
    """Yield the outputs of a cell until they are too many; then a line that says so."""
    for output in outputs if isinstance(outputs, list) else ():
        with contextlib.suppress(TypeError, KeyError, AttributeError):  # a cell may have written anything
            if (made := _harmless(output, budget)) and allowance.take("", len(json.dumps(made))):
                yield made
    if allowance.end_cell():
        yield nbformat.v4.new_output("stream", name="stderr", text=CUT)


def _harmless(output: Mapping[str, Any], budget: Budget) -> Any:
    """Return an output with nothing but plain text and a picture in it; None if there is neither."""
    kind = output["output_type"]
    if kind == "stream":
        name = "stderr" if output["name"] == "stderr" else "stdout"
        return nbformat.v4.new_output(kind, name=name, text=_text(output["text"]))
    if kind == "error":
        lines = [_text(line) for line in output["traceback"]]
        return nbformat.v4.new_output(
            kind, ename=_text(output["ename"]), evalue=_text(output["evalue"]), traceback=lines
        )
    if kind not in ("display_data", "execute_result"):
        return None
    given, shown = output["data"], dict[str, str]()
    if "text/plain" in given:
        shown["text/plain"] = _text(given["text/plain"])
    for media in (media for media in _PICTURES if media in given):
        try:
            shown["image/png"] = base64.b64encode(as_png(decoded(given[media]), budget)).decode("ascii")
        except PictureError as error:
            shown["text/plain"] = f"{shown.get('text/plain', '')}\n[{sentence(error.problem)}]".strip()
    return nbformat.v4.new_output("display_data", data=shown) if shown else None


def _text(given: str) -> str:
    return no_escapes(_COLOURS.sub("", given))
