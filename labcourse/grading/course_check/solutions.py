"""What check-course finds by running notebooks: as they are handed out, and with the solutions.

Somebody who has written nothing yet must be able to go on, and the key must mark the solutions as right, and wrong
answers made of them as wrong.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from labcourse.answers import schema, words
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.notebooks import Cell, Notebook, as_released
from labcourse.answers.parts import Part, Question
from labcourse.errors import AnswerError
from labcourse.grading.course import Course
from labcourse.grading.course_check.static import Finding, in_cell, in_key
from labcourse.grading.isolation import selftest
from labcourse.grading.marking import decoding, marking
from labcourse.grading.marking.checks import ForAPerson
from labcourse.grading.marking.decoding import Claims
from labcourse.grading.marking.marking import KeyFault
from labcourse.grading.marking.wrong_answers import wrong_answer
from labcourse.grading.release import student_notebooks
from labcourse.grading.running import runner
from labcourse.grading.running.bundle import Bundle
from labcourse.grading.running.runner import Job, Limits, Run
from labcourse.grading.verdicts import Case, Check, OwnAnswers, Status
from labcourse.run import reasons
from labcourse.run.causes import Causes, RunCell, Where
from labcourse.run.merge import Merged, merged

#: Student for the run of the solutions: on this bench no result is so near a limit that two answers are right.
STUDENT = "checks"
SEED = 20  #: from which the inputs of functions are drawn
_LIMITS = Limits(cell=300, submission=1800.0)  # generous: these are the course's own notebooks


_NOT_PYTHON = ("SyntaxError", "IndentationError")
_UNSET_NAME = re.compile(r"name '(\w+)' is not defined")


def check_empty(course: Course, bundle: Bundle) -> Iterator[Finding]:
    """Run the student notebooks as they are handed out, and find cells that stop.

    A cell that stops because an earlier one did is not reported.

    Parameters
    ----------
    course : the course
    bundle : its bundle
    """
    notebooks = merged(bundle.pristine, {}, every_cell=True)
    run = run_notebooks(bundle, notebooks)
    yield from (Finding("the student notebooks", problem) for problem in run.problems)
    recorded = set(decoding.decode(run.answers, SEED, course.catalogue).values)
    causes = Causes(bundle.pristine, notebooks, schema.read_reports(run.reports), recorded, course.catalogue)
    unset = set()  # names without a value, each reported once, where it is first used
    for cells in causes.cells.values():
        roots = dict.fromkeys(causes.root(cell) for cell in cells if cell.stopped)
        stopped = {root: _error_type(root) for root in roots if isinstance(root, RunCell)}
        no_python = [root.place for root, error in stopped.items() if error in _NOT_PYTHON]
        for root, error in stopped.items():
            why = _stop_reason(root)
            after_no_python = any(place < root.place for place in no_python)  # it might have bound the name
            if error == "NameError" and (after_no_python or why in unset):
                continue
            unset.add(why)
            yield Finding(in_cell(root.notebook, root.id), f"it stops when nothing is filled in: {why}")


def _error_type(cell: RunCell) -> str:
    """Return the name of the error that stopped a cell; "" if none is known."""
    return cell.report.error.type if cell.report and cell.report.error else ""


def _stop_reason(cell: RunCell) -> str:
    """Return as text why a cell stopped, and for a name without a value, what to do."""
    error = cell.report.error if cell.report else None
    if error is None:
        return "the Python process ended in it."
    unset = _UNSET_NAME.search(error.message)
    if error.type == "NameError" and unset:
        return f"{unset[1]} has no value; preset it before the solution, as {unset[1]} = None."
    line = f", line {error.line}" if error.line else ""
    return f"{error.type}{line}: {error.message}"


def check_key(course: Course, bundle: Bundle) -> Iterator[Finding]:
    """Run the solutions; find those that the key does not mark as right, and wrong answers that it marks as right."""
    claims, missing = answers_of_solutions(course, bundle)
    for problem in claims.problems:
        yield Finding("the solutions", problem)
    yield from check_verdicts(course, claims, missing)


def check_verdicts(course: Course, claims: Claims, missing: Mapping[Where, str]) -> Iterator[Finding]:
    """Mark the solutions' answers, and wrong answers made of them; find verdicts that are not as expected.

    Parameters
    ----------
    course : with the key
    claims : answers, from :func:`answers_of_solutions`
    missing : (question, part) → why there is no answer, from the same
    """
    claims = decoding.with_reports(claims, course.catalogue)
    case = marking.case_of(course, claims, course.true_bench(STUDENT), SEED)
    for number, checks in course.key.items():
        question = course.catalogue.find_marked(number)
        for part in question.parts:
            own = _OwnAnswersOfKnownParts(case.own, course.catalogue)
            why = missing.get((number, part.name), "its cell runs to its end, and leaves it empty.")
            yield from _check_part(question, part, checks[part.name], claims, replace(case, own=own), why)
            for error in own.unknown:
                yield Finding(in_key(question, part), f"it uses an answer that does not exist. {error}")


class _OwnAnswersOfKnownParts:
    """The solutions' answers as ``own`` of a case, which collects the questions and parts that do not exist.

    A check of the key that asks for one of these has a mistake in it.

    Parameters
    ----------
    own : the solutions' answers
    catalogue : of the course

    Attributes
    ----------
    unknown : messages on what was asked for and does not exist, each once
    """

    def __init__(self, own: OwnAnswers, catalogue: Catalogue) -> None:
        self._answers, self._catalogue = own, catalogue
        self.unknown: dict[str, None] = {}  # an ordered set

    def __call__(self, question: str, part: str) -> Any:
        """Return the solution's answer to a part; raise LookupError if there is none or no such part."""
        try:
            self._catalogue.find(question).part(part)
        except AnswerError as error:
            self.unknown[str(error)] = None
            raise LookupError(str(error)) from None
        return self._answers(question, part)


def solved_cells(course: Course, pristine: Mapping[str, dict[str, Any]]) -> dict[str, tuple[Cell, ...]]:
    """Return file name → cells of a student who answered as the solutions do, and changed nothing else.

    Parameters
    ----------
    course : with the solutions
    pristine : file name → notebook as released
    """
    return {
        path.name: as_released(
            pristine[path.name],
            {cell.id: cell.source for cell in student_notebooks.read(path).cells if student_notebooks.is_answer(cell)},
        )
        for path in course.notebooks
    }


def answers_of_solutions(course: Course, bundle: Bundle) -> tuple[Claims, Mapping[Where, str]]:
    """Run the notebooks with solutions.

    Returns
    -------
    Claims
        Their answers, with problems of the run.
    Mapping
        (question, part) → why there is no answer, for those that are missing.

    Raises
    ------
    GradingError
        If the course cannot be imported.
    """
    written = merged(bundle.pristine, solved_cells(course, bundle.pristine))
    run = run_notebooks(bundle, written)
    claims = decoding.decode(run.answers, SEED, course.catalogue)
    why = reasons.explain(
        *(bundle.pristine, written, schema.read_reports(run.reports), claims.values, course.catalogue),
        handed_in=bundle.pristine,
    )
    claims.problems.extend(run.problems)
    for path in course.notebooks:
        texts = words.written(bundle.pristine[path.name]["cells"], Notebook.read(path.read_bytes()).cells)
        decoding.add_words(claims, texts.words, course.catalogue)
        claims.problems.extend(f"{path.name}: {problem}" for problem in [*texts.problems, *texts.notes])
    return claims, why.missing


def run_notebooks(bundle: Bundle, notebooks: Merged) -> Run:
    """Run notebooks of the course: in the sandbox if there is one on this computer, else without.

    Raises
    ------
    GradingError
        If the course cannot be imported.
    """
    job = Job(
        student=STUDENT,
        notebooks=notebooks.notebooks,
        probe_seed=SEED,
        parameters=bundle.parameters,
        imports=bundle.imports,
        limits=_LIMITS,
        isolated=all(layer.good for layer in selftest.layers() if layer.needed),
    )
    return runner.run(bundle.packed, job)


def _check_part(
    question: Question, part: Part, check: Check, claims: Claims, case: Case, missing_reason: str
) -> Iterator[Finding]:
    """Mark the solution of a part, and a wrong answer made of it; find verdicts that are not as expected.

    Parameters
    ----------
    claims : the solutions' answers
    missing_reason : why there is no answer, if there is none
    """
    where, for_a_person = in_key(question, part), isinstance(check, ForAPerson)
    try:
        mark = marking.mark_part(question, part, check, claims, case)
    except Exception as error:  # whatever a mistake in a key may raise
        yield Finding(where, _failure_text(error))
        return
    if mark.status is Status.MISSING:
        yield Finding(where, f"the solution records no answer: {missing_reason}")
        return
    if mark.status is not (Status.FOR_A_PERSON if for_a_person else Status.RIGHT):
        points = f"{mark.points:g} of {mark.out_of:g} points"
        yield Finding(where, f"the solution gets {points}, {mark.status.value}: {mark.reason}")
    value = claims.values.get((question.number, part.name))
    if for_a_person or value is None:
        return
    if part.plausible and not part.plausible[0] <= value <= part.plausible[1]:
        hint = f"the solution, {value:g}, is outside of what is plausible: right answers would draw a hint."
        yield Finding(f"the catalogue, {question.number} {part.name}", hint)
    try:
        wrong = wrong_answer(part, value)
        verdict = check.verdict(part, wrong, case)
    except Exception as error:
        yield Finding(where, f"on a wrong answer, {_failure_text(error)}")
        return
    if verdict.status in (Status.RIGHT, Status.FOLLOW_THROUGH):
        yield Finding(where, f"a wrong answer ({str(wrong)[:60]}) is taken for right: {verdict.reason}")


def _failure_text(error: Exception) -> str:
    """Return as text that a check of the key failed by an error."""
    kind = "" if isinstance(error, KeyFault) else f"{type(error).__name__}: "
    return f"it fails: {kind}{error}"
