"""The key, held against the answers of the solutions, and against wrong answers made of them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from labcourse.answers import cell_reports, words
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.handed_in import Cell, as_released, cells_of
from labcourse.answers.parts import Part, Question
from labcourse.errors import AnswerError
from labcourse.grading.course import Course
from labcourse.grading.course_check.finding import Finding, in_key
from labcourse.grading.isolation import layers
from labcourse.grading.marking import decoding, marking
from labcourse.grading.marking.checks import ForAPerson
from labcourse.grading.marking.decoding import Claims
from labcourse.grading.marking.marking import KeyFault
from labcourse.grading.marking.wrong_answers import wrong_answer
from labcourse.grading.release import student_notebooks
from labcourse.grading.running import runner
from labcourse.grading.running.bundle import Bundle
from labcourse.grading.running.runner import Job, Limits, Run
from labcourse.grading.verdicts import Case, Check, Own, Status
from labcourse.run import reasons
from labcourse.run.causes import Where
from labcourse.run.merge import Merged, merged

#: Student for the run of the solutions. No result on this bench is at its limit, where both answers are right.
STUDENT = "checks"
SEED = 20  #: from which the inputs of functions are drawn
_LIMITS = Limits(cell=300, submission=1800.0)  # they are our own notebooks: they may take their time


def check(course: Course, made: Bundle) -> Iterator[Finding]:
    """Answers of the solutions that the key does not mark as right, or marks as right when they are changed."""
    claims, missing = answers_of_solutions(course, made)
    for problem in claims.problems:
        yield Finding("the solutions", problem)
    yield from judged(course, claims, missing)


def judged(course: Course, claims: Claims, missing: Mapping[Where, str]) -> Iterator[Finding]:
    """What the key makes of the solutions' answers, and of wrong ones made of them.

    Parameters
    ----------
    course : with the key
    claims, missing : from :func:`answers_of_solutions`
    """
    claims = decoding.with_reports(claims, course.catalogue)
    case = marking.case_of(course, claims, course.true_bench(STUDENT), SEED)
    for number, checks in course.key.items():
        question = course.catalogue.find_marked(number)
        for part in question.parts:
            own = _Own(case.own, course.catalogue)
            why = missing.get((number, part.name), "its cell runs to its end, and leaves it empty.")
            yield from _judged(question, part, checks[part.name], claims, replace(case, own=own), why)
            for said in own.unknown:
                yield Finding(in_key(question, part), f"it follows what there is not. {said}")


class _Own:
    """The solutions' own answers, for follow-through; remembers what was asked for and is in no catalogue."""

    def __init__(self, own: Own, catalogue: Catalogue) -> None:
        self._own, self._catalogue = own, catalogue
        self.unknown: list[str] = []

    def __call__(self, question: str, part: str) -> Any:
        try:
            self._catalogue.find(question).part(part)
        except AnswerError as error:
            if str(error) not in self.unknown:
                self.unknown.append(str(error))
            raise LookupError(str(error)) from None
        return self._own(question, part)


def handed_in(course: Course, pristine: Mapping[str, dict[str, Any]]) -> dict[str, tuple[Cell, ...]]:
    """The cells of a student who answered as the solutions do, and changed nothing else.

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


def answers_of_solutions(course: Course, made: Bundle) -> tuple[Claims, Mapping[Where, str]]:
    """What the notebooks with solutions answer, and why answers are missing.

    Raises
    ------
    GradingError
        If the course cannot be imported.
    """
    written = merged(made.pristine, handed_in(course, made.pristine))
    run = run_of(made, written)
    claims = decoding.decode(run.answers, SEED, course.catalogue)
    why = reasons.explain(
        *(made.pristine, written, cell_reports.read(run.reports), claims.values, course.catalogue),
        handed_in=made.pristine,
    )
    claims.problems.extend(run.problems)
    for path in course.notebooks:
        texts = words.written(made.pristine[path.name]["cells"], cells_of(path.read_bytes()))
        claims = decoding.with_words(claims, texts.words, course.catalogue)
        claims.problems.extend(f"{path.name}: {told}" for told in [*texts.problems, *texts.notes])
    return claims, why.missing


def run_of(made: Bundle, notebooks: Merged) -> Run:
    """Run notebooks of our own: where there is no sandbox, without.

    Raises
    ------
    GradingError
        If the course cannot be imported.
    """
    job = Job(
        student=STUDENT,
        notebooks=notebooks.notebooks,
        probe_seed=SEED,
        parameters=made.parameters,
        imports=made.imports,
        limits=_LIMITS,
        isolated=all(layer.good for layer in layers.examine() if layer.needed),
    )
    return runner.run(made.packed, job)


def _judged(
    question: Question, part: Part, one: Check, claims: Claims, case: Case, why_missing: str
) -> Iterator[Finding]:
    """The key's verdict on a solution, and on what it becomes when it is changed."""
    where = in_key(question, part)
    for_a_person = isinstance(one, ForAPerson)
    try:
        mark = marking.mark_part(question, part, one, claims, case)
    except Exception as error:  # whatever a slip in a key may raise
        yield Finding(where, _fails(error))
        return
    if mark.status is Status.MISSING:
        yield Finding(where, f"the solution records no answer: {why_missing}")
        return
    if mark.status is not (Status.FOR_A_PERSON if for_a_person else Status.RIGHT):
        yield Finding(
            where,
            f"the solution gets {mark.points:g} of {mark.out_of:g} points, {mark.status.value}: {mark.reason}",
        )
    value = claims.values.get((question.number, part.name))
    if for_a_person or value is None:
        return
    if part.plausible and not part.plausible[0] <= value <= part.plausible[1]:
        yield Finding(
            f"the catalogue, {question.number} {part.name}",
            f"the solution, {value:g}, is outside of what is plausible: right answers would draw a hint.",
        )
    try:
        verdict = one.verdict(part, wrong_answer(part, value), case)
    except Exception as error:
        yield Finding(where, f"on a wrong answer, {_fails(error)}")
        return
    if verdict.status in (Status.RIGHT, Status.FOLLOW_THROUGH):
        yield Finding(
            where,
            f"a wrong answer ({str(wrong_answer(part, value))[:60]}) is taken for right: {verdict.reason}",
        )


def _fails(error: Exception) -> str:
    if isinstance(error, KeyFault):
        return f"it fails: {error}"
    return f"it fails: {type(error).__name__}: {error}"
