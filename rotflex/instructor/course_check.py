"""Whether a course is whole: catalogue, key, cells and texts fit each other, and the key marks the solutions as right.

What is found is told in words that name the place; nothing is changed.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from rotflex.courseware.messages import _
from rotflex.courseware.parts import Part, Question
from rotflex.courseware.run.merge import merged
from rotflex.errors import AnswerError, GradingError
from rotflex.instructor.course import Course
from rotflex.instructor.isolation import layers
from rotflex.instructor.marking import decoding, marking
from rotflex.instructor.marking.checks import ForAPerson
from rotflex.instructor.marking.decoding import Claims
from rotflex.instructor.marking.wrong_answers import wrong_answer
from rotflex.instructor.release import student_course, student_notebooks
from rotflex.instructor.running import bundle, runner
from rotflex.instructor.running.runner import Job, Limits
from rotflex.instructor.verdicts import Case, Check, Status

STUDENT = "check-course"  #: whose bench the solutions are run on
_SEED = 20
_LIMITS = Limits(cell=300, submission=1800.0)  # they are our own notebooks: they may take their time


@dataclass(frozen=True)
class Finding:
    """Something that is missing, or that contradicts something else: where, and what."""

    where: str
    what: str

    def __str__(self) -> str:
        return f"{self.where}: {self.what}"


def check(course: Course, run: bool = True) -> Iterator[Finding]:
    """Look at all of a course.

    Parameters
    ----------
    course : the course; its key has been held against its catalogue when it was loaded
    run : run the notebooks with solutions, too, and mark what they answer: it takes as long as grading a submission
    """
    yield from _key(course)
    yield from _cells(course)
    yield from _derived(course)
    yield from _texts(course)
    if run:
        yield from _solutions(course)


# --- catalogue and key ------------------------------------------------------------------------------------------------


def _key(course: Course) -> Iterator[Finding]:
    """Questions without a key, and answers in words without a rubric."""
    for number, question in course.catalogue.everything.items():
        if number not in course.key:
            yield Finding(_("the key"), _("question {number} has no entry.").format(number=number))
            continue
        for part in question.parts:
            one = course.key[number][part.name]
            for_a_person = isinstance(one, ForAPerson)
            if isinstance(one, ForAPerson) and not one.rubric.strip():
                yield Finding(_the_key(question, part), _("it says nothing of what to look for in the text."))
            if for_a_person != (part.marked == "person"):
                yield Finding(
                    _the_key(question, part),
                    _("the catalogue says that it is marked by {marked}, the key does otherwise.").format(
                        marked=part.marked
                    ),
                )


def _the_key(question: Question, part: Part) -> str:
    return _("the key, {number} {part}").format(number=question.number, part=part.name)


# --- cells ------------------------------------------------------------------------------------------------------------


def _cells(course: Course) -> Iterator[Finding]:
    """Questions that no cell records, or several; cells that record what there is not, or where it does not belong."""
    by_name = {path.stem: path for path in course.notebooks}
    asked: dict[tuple[str, str], list[str]] = {}
    for name, path in by_name.items():
        notebook = student_notebooks.read(path)
        ids = [cell.id for cell in notebook.cells]
        recording = set()
        for one in student_notebooks.recorded(notebook):
            where = _("{name}, cell {cell!r}").format(name=path.name, cell=one.cell)
            recording.add(ids.index(one.cell) - 1)
            try:
                question = course.catalogue.find(one.question)
                parts = [question.part(part) for part in one.of(question)]
            except AnswerError as error:
                yield Finding(where, str(error))
                continue
            for part in parts:
                asked.setdefault((question.number, part.name), []).append(where)
            if question.notebook != name:
                yield Finding(
                    where,
                    _("it records question {number}, which the catalogue has in {notebook}.").format(
                        number=question.number, notebook=question.notebook
                    ),
                )
        for index, cell in enumerate(notebook.cells):
            if student_notebooks.is_answer(cell) and index not in recording:
                yield Finding(
                    _("{name}, cell {cell!r}").format(name=path.name, cell=cell.id),
                    _("an answer cell, but the cell after it records nothing (lab.answer(...))."),
                )
    for question in course.catalogue.everything.values():
        if question.notebook not in by_name:
            yield Finding(
                _("question {number}").format(number=question.number),
                _("there is no notebook {notebook}.").format(notebook=question.notebook),
            )
            continue
        for part in question.parts:
            places = asked.get((question.number, part.name), [])
            if len(places) != 1:
                yield Finding(
                    _("question {number}, {part}").format(number=question.number, part=part.name),
                    _("no cell of {notebook} records it.").format(notebook=question.notebook)
                    if not places
                    else _("{count} cells record it: {places}.").format(count=len(places), places="; ".join(places)),
                )


def _derived(course: Course) -> Iterator[Finding]:
    """Student notebooks that are no longer what would be derived, where a course keeps them."""
    try:
        texts = student_course.derived(course)
    except GradingError as error:
        yield Finding(_("the student notebooks"), str(error))
        return
    folder = course.student_notebooks
    if not folder.is_dir():
        return
    there = {path.name: path.read_text(encoding="utf-8") for path in folder.glob("*.ipynb")}
    for name in sorted(texts.keys() | there.keys()):
        if texts.get(name) != there.get(name):
            yield Finding(f"{folder.name}/{name}", _("it is not what is derived now: say rotflex notebooks."))


# --- numbers in texts -------------------------------------------------------------------------------------------------


def _texts(course: Course) -> Iterator[Finding]:
    """Numbers of the course that a text has otherwise, and patterns that no text has any more."""
    cells = [
        (_("{name}, cell {cell!r}").format(name=path.name, cell=cell.id), cell.source)
        for path in sorted(course.folder.glob("*.ipynb"))
        for cell in student_notebooks.read(path).cells
    ]
    for stated in course.stated:
        pattern = re.compile(re.sub(r" +", r"\\s+", stated.pattern))
        found = [(where, match[1]) for where, text in cells for match in pattern.finditer(text)]
        if not found:
            yield Finding(
                _("stated, {what}").format(what=stated.what),
                _("no text has it as {pattern!r} any more: mend the pattern, or take it out.").format(
                    pattern=stated.pattern
                ),
            )
        for where, number in found:
            if not np.isclose(float(number.replace("−", "-")), stated.value, rtol=1e-9, atol=0):
                yield Finding(
                    where,
                    _("{what} is {value:g}; this text says {number}.").format(
                        what=stated.what, value=stated.value, number=number
                    ),
                )


# --- the key, on the solutions ----------------------------------------------------------------------------------------


def _solutions(course: Course) -> Iterator[Finding]:
    """Answers of the solutions that the key does not mark as right, or marks as right when they are changed."""
    claims = answers_of_solutions(course)
    for problem in claims.problems:
        yield Finding(_("the solutions"), problem)
    yield from judged(course, claims)


def judged(course: Course, claims: Claims) -> Iterator[Finding]:
    """What the key makes of the solutions' answers, and of wrong ones made of them."""
    bench = course.bench(STUDENT)
    case = marking.case_of(course, claims, bench, _SEED)
    for number, checks in course.key.items():
        question = course.catalogue.find(number)
        for part in question.parts:
            yield from _judged(question, part, checks[part.name], claims, case)


def answers_of_solutions(course: Course) -> Claims:
    """What the notebooks with solutions answer. They are our own: where there is no sandbox, they are run without.

    Raises
    ------
    GradingError
        If the course cannot be released or imported.
    """
    made = bundle.build(course)
    solved = {
        path.name: {
            cell.id: cell.source for cell in student_notebooks.read(path).cells if student_notebooks.is_answer(cell)
        }
        for path in course.notebooks
    }
    job = Job(
        student=STUDENT,
        notebooks=merged(made.pristine, solved),
        probe_seed=_SEED,
        parameters=made.parameters,
        imports=made.imports,
        limits=_LIMITS,
        isolated=all(layer.good for layer in layers.examine() if layer.needed),
    )
    run = runner.run(made.packed, job)
    claims = decoding.decode(run.answers, _SEED, course.catalogue)
    claims.problems.extend(run.problems)
    return claims


def _judged(question: Question, part: Part, one: Check, claims: Claims, case: Case) -> Iterator[Finding]:
    """The key's verdict on a solution, and on what it becomes when it is changed."""
    where = _the_key(question, part)
    for_a_person = isinstance(one, ForAPerson)
    try:
        mark = marking.mark_part(question, part, one, claims, case)
    except Exception as error:  # whatever a slip in a key may raise
        yield Finding(where, _fails(error))
        return
    if mark.status is not (Status.FOR_A_PERSON if for_a_person else Status.RIGHT):
        yield Finding(
            where,
            _("the solution gets {points:g} of {out_of:g} points, {status}: {reason}").format(
                points=mark.points, out_of=mark.out_of, status=mark.status.value, reason=mark.reason
            ),
        )
    value = claims.values.get((question.number, part.name))
    if for_a_person or value is None:
        return
    try:
        verdict = one.verdict(part, wrong_answer(part, value), case)
    except Exception as error:
        yield Finding(where, _("on a wrong answer, {fails}").format(fails=_fails(error)))
        return
    if verdict.status in (Status.RIGHT, Status.FOLLOW_THROUGH):
        yield Finding(
            where,
            _("a wrong answer ({value}) is taken for right: {reason}").format(
                value=str(wrong_answer(part, value))[:60], reason=verdict.reason
            ),
        )


def _fails(error: Exception) -> str:
    return _("it fails: {kind}: {error}").format(kind=type(error).__name__, error=error)
