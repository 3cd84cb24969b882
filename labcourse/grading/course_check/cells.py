"""The cells of a course's notebooks, held against the catalogue, and the notebooks that are derived of them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from nbformat import NotebookNode

from labcourse import program
from labcourse.answers import words
from labcourse.errors import AnswerError, GradingError
from labcourse.grading.course import Course
from labcourse.grading.course_check.finding import Finding, in_cell
from labcourse.grading.release import student_course, student_notebooks


def check(course: Course) -> Iterator[Finding]:
    """Questions that no cell records, or several; cells that record what there is not, or where it does not belong."""
    by_name = {path.stem: path for path in course.notebooks}
    asked: dict[tuple[str, str], list[str]] = {}
    for name, path in by_name.items():
        notebook = student_notebooks.read(path)
        yield from _form(course, path.name, notebook)
        yield from in_words(path.name, notebook.cells)
        ids = [cell.id for cell in notebook.cells]
        worded = {cell.id for cell in notebook.cells if words.where_of(cell)}
        recording = set()
        for one in student_notebooks.recorded(notebook):
            where = in_cell(path.name, one.cell)
            recording.add(ids.index(one.cell) - (one.cell not in worded))
            try:
                question = course.catalogue.find(one.question)
                parts = [question.part(part) for part in one.of(question)]
            except AnswerError as error:
                yield Finding(where, str(error))
                continue
            for part in parts:
                if one.cell in worded and part.kind != "prose":
                    yield Finding(
                        where,
                        f"{part.name} is no answer in words, but of kind {part.kind}.",
                    )
                asked.setdefault((question.number, part.name), []).append(where)
            if question.notebook != name:
                yield Finding(
                    where,
                    f"it records question {question.number}, which the catalogue has in {question.notebook}.",
                )
        for index, cell in enumerate(notebook.cells):
            if student_notebooks.is_answer(cell) and index not in recording:
                yield Finding(
                    in_cell(path.name, cell.id),
                    "an answer cell, but the cell after it records nothing (lab.answer(...)).",
                )
    for question in course.catalogue.everything.values():
        if question.notebook not in by_name:
            yield Finding(
                f"question {question.number}",
                f"there is no notebook {question.notebook}.",
            )
            continue
        for part in question.parts:
            places = asked.get((question.number, part.name), [])
            if len(places) != 1:
                yield Finding(
                    f"question {question.number}, {part.name}",
                    f"no cell of {question.notebook} records it."
                    if not places
                    else f"{len(places)} cells record it: {'; '.join(places)}.",
                )


def in_words(name: str, cells: Iterable[Mapping[str, Any]]) -> Iterator[Finding]:
    """Text cells for answers that do not say, or not plainly, what is to be written in them."""
    seen: dict[str, str] = {}
    for cell in cells:
        if cell["cell_type"] != "markdown" or not student_notebooks.is_answer(cell):
            continue
        where = in_cell(name, cell["id"])
        if words.where_of(cell) is None:
            yield Finding(
                where,
                f'its metadata should have "{words.KEY}": {{"question": ..., "part": ...}}.',
            )
        found = words.headings(words.source_of(cell).partition(words.BEGIN)[0])
        if len(found) != 1:
            yield Finding(
                where,
                f"it should begin with one heading for students, such as {words.heading('Your answer: 1.1, why')}",
            )
        for heading in found:
            if heading in seen:
                yield Finding(where, f"it has the heading of cell {seen[heading]!r}, too.")
            seen[heading] = cell["id"]


def _form(course: Course, name: str, notebook: NotebookNode) -> Iterator[Finding]:
    """What a run of the notebook, or its student version, would stumble over."""
    tagged = [cell.id for cell in notebook.cells if student_notebooks.PARAMETERS_TAG in cell.metadata.get("tags", [])]
    if len(tagged) != 1:
        yield Finding(
            name,
            f"{len(tagged)} cells are tagged 'parameters'; one should be: a run tells its student there.",
        )
    for cell in notebook.cells:
        released = student_notebooks.INSTRUCTOR_TAG not in cell.metadata.get("tags", [])
        solved = student_notebooks.BEGIN in cell.source or words.BEGIN in cell.source
        if released and solved and not student_notebooks.is_answer(cell):
            yield Finding(in_cell(name, cell.id), "it has a solution, but its metadata do not make it an answer cell.")


def check_derived(course: Course) -> Iterator[Finding]:
    """Student notebooks that are no longer what would be derived, where a course keeps them."""
    try:
        texts = student_course.derived(course)
    except GradingError as error:
        yield Finding("the student notebooks", str(error))
        return
    folder = course.student_notebooks
    if not folder.is_dir():
        return
    there = {path.name: path.read_text(encoding="utf-8") for path in folder.glob("*.ipynb")}
    for name in sorted(texts.keys() | there.keys()):
        if name not in texts:
            yield Finding(f"{folder.name}/{name}", f"no notebook in {course.folder.name} leads to it: remove it.")
        elif texts[name] != there.get(name):
            yield Finding(
                f"{folder.name}/{name}", f"it is not what is derived now: say {program.name()} make-notebooks."
            )
