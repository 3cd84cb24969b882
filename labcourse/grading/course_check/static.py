"""What check-course finds without running a notebook: catalogue, key, rubric, cells and texts contradict each other."""

from __future__ import annotations

import ast
import contextlib
import importlib.util
import re
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from nbformat import NotebookNode

from labcourse import program
from labcourse.answers import forms, starts, words
from labcourse.answers.parts import Part, Question, Where
from labcourse.answers.starts import Start
from labcourse.benches import SAME, BenchPolicy
from labcourse.errors import AnswerError, GradingError
from labcourse.grading.course import OUTCOMES_FILE, RUBRIC_FILE, SHEETS_FILE, Course
from labcourse.grading.marking.checks import ForAPerson
from labcourse.grading.outcomes import outcome_map, sheet_layout
from labcourse.grading.release import student_course, student_notebooks
from labcourse.grading.release.student_notebooks import BEGIN, INSTRUCTOR_TAG, PARAMETERS_TAG, is_answer
from labcourse.grading.scoring import rubric


@dataclass(frozen=True)
class Finding:
    """Something that is missing in a course, or contradicts something else.

    Attributes
    ----------
    where : its place, for people
    what : the fault, as a sentence
    """

    where: str
    what: str

    def __str__(self) -> str:
        return f"{self.where}: {self.what}"


def in_cell(notebook: str, cell: str) -> str:
    """Return the place of a cell for a finding."""
    return f"{notebook}, cell {cell!r}"


def in_key(question: Question, part: Part) -> str:
    """Return the place of a check of the key for a finding."""
    return f"the key, {question.number} {part.name}"


# --- catalogue, key, rubric, outcomes, modules ------------------------------------------------------------------------


def check_key(course: Course) -> Iterator[Finding]:
    """Find questions without a key, and parts that only the key, or only the catalogue, leaves to a person."""
    for number, question in course.catalogue.marked.items():
        if number not in course.key:
            yield Finding("the key", f"question {number} has no entry.")
            continue
        for part in question.parts:
            if isinstance(course.key[number][part.name], ForAPerson) != (part.marked == "person"):
                contradiction = f"the catalogue says that it is marked by {part.marked}, the key does otherwise."
                yield Finding(in_key(question, part), contradiction)


def check_files(course: Course) -> Iterator[Finding]:
    """Find faults of the rubric, of codes of outcomes, of the map to outcomes, and of the scoring sheets."""
    catalogue = course.catalogue
    yield from (Finding(RUBRIC_FILE, fault) for fault in rubric.examine(course.folder, catalogue)[1])
    for number, question in catalogue.marked.items():
        for code in dict.fromkeys([*question.outcomes, *(part.outcome for part in question.parts if part.outcome)]):
            if code not in catalogue.outcomes:
                codes = ", ".join(catalogue.outcomes) or "none"
                yield Finding(f"question {number}", f"there is no outcome {code!r}; the catalogue has {codes}.")
    try:
        outcome_map.find(course.folder, catalogue)
    except GradingError as error:
        yield Finding(OUTCOMES_FILE, str(error))
    try:
        layouts = sheet_layout.read(course.folder, catalogue) if (course.folder / SHEETS_FILE).exists() else None
    except GradingError as error:
        yield Finding(SHEETS_FILE, str(error))
    else:
        for number, part in sheet_layout.on_no_sheet(layouts, catalogue) if layouts is not None else ():
            if part.outcome:
                yield Finding(SHEETS_FILE, f"{number}, {part.name}: it carries {part.outcome}, and is on no sheet.")


def check_imports(course: Course) -> Iterator[Finding]:
    """Find modules in the course's ``imports`` that are not installed."""
    for name in course.imports:
        with contextlib.suppress(ModuleNotFoundError):
            if importlib.util.find_spec(name):
                continue
        yield Finding("course.py, imports", f"there is no module {name!r}.")


# --- cells of the notebooks -------------------------------------------------------------------------------------------


def check_cells(course: Course) -> Iterator[Finding]:
    """Find questions that no cell records, or several; cells that record unknown questions, or in a wrong notebook."""
    places: dict[Where, list[str]] = defaultdict(list)
    for path in course.notebooks:
        notebook = student_notebooks.read(path)
        yield from _check_tags(path.name, notebook.cells)
        yield from _check_headings(path.name, notebook.cells)
        yield from _check_recorded(course, path, notebook, places)
    names = {path.stem for path in course.notebooks}
    for question in course.catalogue.everything.values():
        if question.notebook not in names:
            yield Finding(f"question {question.number}", f"there is no notebook {question.notebook}.")
            continue
        for part in question.parts:
            cells = places[question.number, part.name]
            if len(cells) != 1:
                several = f"{len(cells)} cells record it: {'; '.join(cells)}."
                what = several if cells else f"no cell of {question.notebook} records it."
                yield Finding(f"question {question.number}, {part.name}", what)


def _check_recorded(
    course: Course, path: Path, notebook: NotebookNode, places: dict[Where, list[str]]
) -> Iterator[Finding]:
    """Check what the cells of a notebook record.

    Parameters
    ----------
    path : of the notebook
    places : (question, part) → cells that record it; those of this notebook are added
    """
    ids = [cell.id for cell in notebook.cells]
    text_cells = {cell.id for cell in notebook.cells if words.where_of(cell)}
    answered = set()  # indices of answer cells: a text cell records itself, code is recorded by the cell after it
    for entry in student_notebooks.recorded(notebook):
        where, is_text = in_cell(path.name, entry.cell), entry.cell in text_cells
        answered.add(ids.index(entry.cell) - (not is_text))
        try:
            question = course.catalogue.find(entry.question)
            parts = [question.part(part) for part in entry.of(question)]
        except AnswerError as error:
            yield Finding(where, str(error))
            continue
        for part in parts:
            if is_text and part.kind != "prose":
                yield Finding(where, f"{part.name} is no answer in words, but of kind {part.kind}.")
            places[question.number, part.name].append(where)
        if question.notebook != path.stem:
            place = f"which the catalogue has in {question.notebook}."
            yield Finding(where, f"it records question {question.number}, {place}")
    for index, cell in enumerate(notebook.cells):
        if is_answer(cell) and index not in answered:
            missing = "an answer cell, but the cell after it records nothing (lab.answer(...))."
            yield Finding(in_cell(path.name, cell.id), missing)


def _check_headings(name: str, cells: Iterable[Mapping[str, Any]]) -> Iterator[Finding]:
    """Find text cells for answers without a question or a heading, and those with the heading of another cell."""
    seen: dict[str, str] = {}
    for cell in cells:
        if cell["cell_type"] != "markdown" or not is_answer(cell):
            continue
        where = in_cell(name, cell["id"])
        if words.where_of(cell) is None:
            yield Finding(where, f'its metadata should have "{words.KEY}": {{"question": ..., "part": ...}}.')
        headings = words.headings(words.source_of(cell).partition(words.BEGIN)[0])
        if len(headings) != 1:
            example = words.heading("Your answer: 1.1, why")
            yield Finding(where, f"it should begin with one heading for students, such as {example}")
        for heading in headings:
            if heading in seen:
                yield Finding(where, f"it has the heading of cell {seen[heading]!r}, too.")
            seen[heading] = cell["id"]


def _check_tags(name: str, cells: Iterable[NotebookNode]) -> Iterator[Finding]:
    """Find a missing or repeated tag "parameters", and solutions in cells that are not answer cells."""
    tagged = sum(PARAMETERS_TAG in cell.metadata.get("tags", []) for cell in cells)
    if tagged != 1:
        yield Finding(name, f"{tagged} cells are tagged 'parameters'; one should be: a run sets the student after it.")
    for cell in cells:
        is_solution = BEGIN in cell.source or words.BEGIN in cell.source
        if is_solution and INSTRUCTOR_TAG not in cell.metadata.get("tags", []) and not is_answer(cell):
            yield Finding(in_cell(name, cell.id), "it has a solution, but its metadata do not make it an answer cell.")


def check_derived(course: Course) -> Iterator[Finding]:
    """Find stored student notebooks that differ from what would be derived now."""
    try:
        texts = student_course.derive_notebooks(course)
    except GradingError as error:
        yield Finding("the student notebooks", str(error))
        return
    folder = course.student_notebooks
    if not folder.is_dir():
        return
    stored = {path.name: path.read_text(encoding="utf-8") for path in folder.glob("*.ipynb")}
    for name in sorted(texts.keys() | stored.keys()):
        place = f"{folder.name}/{name}"
        if name not in texts:
            yield Finding(place, f"no notebook in {course.folder.name} leads to it: remove it.")
        elif texts[name] != stored.get(name):
            yield Finding(place, f"it is not what is derived now: say {program.name()} make-notebooks.")


# --- numbers in texts -------------------------------------------------------------------------------------------------


def check_numbers(course: Course) -> Iterator[Finding]:
    """Find texts that state another number than the course has, and patterns that no text matches any more."""
    cells = [
        (in_cell(path.name, cell.id), cell.source)
        for path in sorted(course.folder.glob("*.ipynb"))
        for cell in student_notebooks.read(path).cells
    ]
    for stated in course.stated:
        pattern = re.compile(re.sub(r" +", r"\\s+", stated.pattern))
        matches = [(where, match[1]) for where, text in cells for match in pattern.finditer(text)]
        if not matches:
            advice = f"no text has it as {stated.pattern!r} any more: mend the pattern, or take it out."
            yield Finding(f"stated, {stated.what}", advice)
        for where, number in matches:
            if not np.isclose(float(number.replace("−", "-")), stated.value, rtol=1e-9, atol=0):
                yield Finding(where, f"{stated.what} is {stated.value:g}; this text says {number}.")


# --- classes that begin in the middle ---------------------------------------------------------------------------------


def check_starts(course: Course) -> Iterator[Finding]:
    """Find faults of the starts of classes that begin in the middle.

    A start may name what the course does not have, give an answer no value, or leave a cell without an answer.
    """
    for start in course.catalogue.starts:
        faults = [*_unknown_name_faults(course, start)]
        if not faults:
            faults = [*_given_value_faults(course, start)]
            yield from _cells_without_answer(course, start)
        yield from (Finding(f"start {start.name}", fault) for fault in faults)


def _unknown_name_faults(course: Course, start: Start) -> Iterator[str]:
    """Yield a fault for each notebook or part of a start that the course does not have, or that is still asked."""
    for name in start.skips:
        if name not in course.catalogue.notebooks:
            yield f"it skips the notebook {name}, and there is no such notebook."
    for number, part in start.gives:
        try:
            question = course.catalogue.find(number)
            question.part(part)
        except AnswerError as error:
            yield str(error)
        else:
            if question.notebook not in start.skips:
                yield f"it gives {number}, {part}, which {question.notebook} asks for; that is not skipped."


def _given_value_faults(course: Course, start: Start) -> Iterator[str]:
    """Yield a fault for each given answer without a usable value, on a bench that is the same for everybody."""
    if course.given is None:
        yield "course.py does not say what is given (Course.given)."
        return
    values = course.given(start.name, "", BenchPolicy(SAME, seed=1, draw=course.draw))
    for number, part in start.gives:
        try:
            forms.encode(course.catalogue.find(number).part(part), values[number, part], 0)
        except (KeyError, forms.FormError, forms.NotAnswered) as error:
            yield f"{number}, {part} has no value that it could have: {error}"


def _cells_without_answer(course: Course, start: Start) -> Iterator[Finding]:
    """Find cells that need an answer which a class that begins here does not have."""
    asked = starts.narrowed(course.catalogue, start).everything
    available = {(number, part) for number, question in asked.items() for part in question.names} | set(start.gives)
    for path in course.notebooks:
        cells = student_notebooks.read(path).cells if path.stem not in start.skips else ()
        for cell in cells:
            for question, part in _needed_answers(cell.source) if cell.cell_type == "code" else ():
                if (question, part) not in available and question in course.catalogue.everything:
                    missing = f"it needs {question}, {part}; a class that begins with {start.name} does not have it."
                    yield Finding(in_cell(path.name, cell.id), missing)


def _needed_answers(source: str) -> Iterator[Where]:
    """Yield the (question, part) that the code of a cell needs: ``lab.value(question, part)`` without a default."""
    try:
        tree = ast.parse(source)
    except SyntaxError:
        return
    for node in ast.walk(tree):
        match node:
            case ast.Call(
                func=ast.Attribute(attr="value"),
                args=[ast.Constant(value=str() as question), ast.Constant(value=str() as part)],
                keywords=[],
            ):
                yield question, part
