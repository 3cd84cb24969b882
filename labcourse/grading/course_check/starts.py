"""Where a class may begin in the middle: what is given fits the catalogue, and what is left asks for nothing else."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from labcourse.answers import forms, starts
from labcourse.answers.handed_in import CODE
from labcourse.answers.starts import Start, Where
from labcourse.benches import SAME, BenchPolicy
from labcourse.errors import AnswerError
from labcourse.grading.course import Course
from labcourse.grading.course_check.finding import Finding
from labcourse.grading.release import student_notebooks


def check(course: Course) -> Iterator[Finding]:
    """What of each start names what there is not, has no value, or leaves a cell without an answer that it needs."""
    for start in course.catalogue.starts:
        place = f"start {start.name}"
        wrong = [*_names(course, start)]
        yield from (Finding(place, text) for text in wrong)
        if not wrong:
            yield from (Finding(place, text) for text in _values(course, start))
            yield from _left_without(course, start)


def _names(course: Course, start: Start) -> Iterator[str]:
    for name in start.skips:
        if name not in course.catalogue.notebooks:
            yield f"it skips the notebook {name}, which there is not."
    for number, part in start.gives:
        try:
            question = course.catalogue.find(number)
            question.part(part)
        except AnswerError as error:
            yield str(error)
        else:
            if question.notebook not in start.skips:
                yield f"it gives {number}, {part}, which {question.notebook} asks for; that is not skipped."


def _values(course: Course, start: Start) -> Iterator[str]:
    """On a bench that everybody has: there, each value has to be one."""
    if course.given is None:
        yield "course.py does not say what is given (Course.given)."
        return
    values = course.given(start.name, "", BenchPolicy(SAME, seed=1, draw=course.draw))
    for number, part in start.gives:
        try:
            forms.encode(course.catalogue.find(number).part(part), values[number, part], 0)
        except (KeyError, forms.FormError, forms.NotAnswered) as error:
            yield f"{number}, {part} has no value that it could have: {error}"


def _left_without(course: Course, start: Start) -> Iterator[Finding]:
    asked = starts.narrowed(course.catalogue, start).everything
    there = {(number, part) for number, question in asked.items() for part in question.names} | set(start.gives)
    for path in course.notebooks:
        if path.stem in start.skips:
            continue
        for cell in student_notebooks.read(path).cells:
            for where in _needed(cell.source) if cell.cell_type == CODE else ():
                if where not in there and where[0] in course.catalogue.everything:
                    yield Finding(
                        f"{path.name}, {cell.id}",
                        f"it needs {where[0]}, {where[1]}, which a class that begins with {start.name} has not.",
                    )


def _needed(source: str) -> Iterator[Where]:
    """The answers that a cell cannot do without: ``lab.value(question, part)`` with no default."""
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
