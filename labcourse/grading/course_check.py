"""Check whether a course is complete: catalogue, key, cells and texts fit each other, and the key marks correctly.

Nothing is changed. Each :class:`CourseFault` names its place. Without a run, questions, key, rubric, cells and numbers
are compared. With one, the notebooks are run as they are handed out: a student who has written nothing yet must be able
to go on. Then they are run with the solutions: the key must mark these as right, and wrong answers made of them, and
usual mistakes, as wrong.
"""

from __future__ import annotations

import contextlib
import importlib.util
import math
import re
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from nbformat import NotebookNode

from labcourse import program
from labcourse.answers import schema, words
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.cell_reports import REPORTS_FILE
from labcourse.answers.notebooks import Cell, Notebook, as_released
from labcourse.answers.parts import Part, Predictable, Question
from labcourse.errors import AnswerError, GradingError
from labcourse.files import ANSWERS_FILE
from labcourse.grading import outcomes, sheets
from labcourse.grading.course import OUTCOMES_FILE, RUBRIC_FILE, SHEETS_FILE, Course
from labcourse.grading.isolation import selftest
from labcourse.grading.marking import decoding, marking
from labcourse.grading.marking.checks import ForAPerson, slips_of, value_that_follows, wrong_answers
from labcourse.grading.marking.decoding import Claims
from labcourse.grading.marking.marking import KeyFault
from labcourse.grading.marks import Status
from labcourse.grading.release import percent, student_course, student_notebooks
from labcourse.grading.release.student_notebooks import BEGIN_CODE, INSTRUCTOR_TAG, PARAMETERS_TAG, is_answer
from labcourse.grading.running import bundle, runner
from labcourse.grading.running.bundle import Bundle
from labcourse.grading.scoring import rubric
from labcourse.grading.verdicts import Case, Check, OwnAnswers, Verdict
from labcourse.problems import Problem, Reason, Where
from labcourse.run import reasons
from labcourse.run.alignment import recorded
from labcourse.run.merge import Merged, merged
from labcourse.run.reasons import Causes, RunCell
from labcourse.sentences import sentence

#: Student for the run of the solutions: on this bench no result is so near a limit that two answers are right.
SOLUTIONS_STUDENT = "checks"
SEED = 20  #: from which the inputs of functions are drawn
_LONGEST_SHOWN = 60  # characters of an answer
_LARGEST_RTOL = 0.35  # by more, an answer is wrong
_TOLERANCES = ("rtol", "atol", "follow_rtol", "peak_rtol", "largest")  # attributes of checks
_HINT = " Do the session and course.py make the same bench, and is it the same experiment each time?"
_PICTURE = re.compile(r"""!\[[^]]*\]\(([^)\s]+\.\w+)|<img[^>]*\ssrc=["']([^"']+)""")  # in Markdown, in HTML
_LIMITS = runner.RunLimits(cell=300, submission=1800.0)  # generous: these are the course's own notebooks


@dataclass(frozen=True)
class CourseFault:
    """Something that is missing in a course, or contradicts something else.

    Attributes
    ----------
    where : its place, for people
    what : the fault, as a sentence
    is_note : whether it is only worth a look
    """

    where: str
    what: str
    is_note: bool = False

    def __str__(self) -> str:
        return f"{'note: ' * self.is_note}{self.where}: {self.what}"


def check(course: Course, run: bool = True) -> Iterator[CourseFault]:
    """Look for what is missing in a course, or contradicts itself.

    Parameters
    ----------
    course : the course; its key has been compared with its catalogue when it was loaded
    run : run the student notebooks as they are handed out, and those with solutions, and mark the solutions' answers:
        it takes as long as grading two submissions

    Yields
    ------
    CourseFault
        If a notebook differs from its text, or cannot be made of it, only these faults.
    """
    try:
        outdated = percent.outdated(course)
    except GradingError as error:
        yield CourseFault("the texts of the notebooks", str(error))
        return
    for path in outdated:
        yield CourseFault(path.name, f"it is not what its text gives now: say {program.name()} make-notebooks.")
    if outdated:
        return
    for part in (check_key, check_files, check_cells, check_derived, check_numbers, check_imports, check_predictions):
        yield from part(course)
    if run:
        released = bundle.build(course)
        yield from check_empty(course, released)
        yield from check_solutions(course, released)


def _in_cell(notebook: str, cell: str) -> str:
    return f"{notebook}, cell {cell!r}"


def in_key(course: Course, question: Question, part: Part) -> str:
    """Return the place of a part's check: with file and line if it has a function of the course's."""
    check = course.key[question.number][part.name]
    return f"the key, {question.number} {part.name}{_line_of(course, vars(check).values())}"


def _line_of(course: Course, values: Iterable[Any]) -> str:
    """Return " (file, line)" of the first of some values that is a function in the course's folder; "" for none."""
    codes = [code for value in values if (code := getattr(value, "__code__", None))]
    lines = [(Path(code.co_filename), code.co_firstlineno) for code in codes]
    return next((f" ({path.name}, line {line})" for path, line in lines if path.is_relative_to(course.folder)), "")


# --- catalogue, key, rubric, outcomes, modules ------------------------------------------------------------------------


def check_key(course: Course) -> Iterator[CourseFault]:
    """Find questions that the key lacks, and parts that only the key, or only the catalogue, leaves to a person."""
    for number, question in course.catalogue.marked.items():
        if number not in course.key:
            yield CourseFault("the key", f"question {number} has no entry.")
            continue
        for part in question.parts:
            if isinstance(course.key[number][part.name], ForAPerson) != (part.marked == "person"):
                contradiction = f"the catalogue says that it is marked by {part.marked}, the key does otherwise."
                yield CourseFault(in_key(course, question, part), contradiction)
            for name in _TOLERANCES:
                size = getattr(course.key[number][part.name], name, 0.0)
                largest = _LARGEST_RTOL if name.endswith("rtol") else math.inf
                if not (isinstance(size, int | float) and 0 <= size < largest):
                    what = f"its {name} is {size!r}; it should be a number, 0 or more and below {largest:g}."
                    yield CourseFault(in_key(course, question, part), what)


def check_files(course: Course) -> Iterator[CourseFault]:
    """Find faults of the rubric, of codes that questions carry, of the map to outcomes, and of the scoring sheets."""
    catalogue = course.catalogue
    yield from (CourseFault(RUBRIC_FILE, fault) for fault in rubric.examine(course.folder, catalogue)[1])
    for item in catalogue.report_items:
        for number, name in item.shows:
            try:
                question = catalogue.find(number)
                question.part(name or question.names[0])
            except AnswerError as error:
                yield CourseFault(
                    f"the catalogue, {item.report} {item.number}", f"it shows what does not exist. {error}"
                )
    for number, question in catalogue.marked.items():
        for code in dict.fromkeys([*question.outcomes, *(part.outcome for part in question.parts if part.outcome)]):
            if code not in catalogue.outcomes:
                codes = ", ".join(catalogue.outcomes) or "none"
                yield CourseFault(f"question {number}", f"there is no outcome {code!r}; the catalogue has {codes}.")
    try:
        outcomes.read_map(course.folder, catalogue)
    except GradingError as error:
        yield CourseFault(OUTCOMES_FILE, str(error))
    if not (course.folder / SHEETS_FILE).exists():
        return
    try:
        without_sheet = sheets.on_no_sheet(sheets.read_layouts(course.folder, catalogue), catalogue)
    except GradingError as error:
        yield CourseFault(SHEETS_FILE, str(error))
        return
    for number, part in without_sheet:
        if part.outcome:
            yield CourseFault(SHEETS_FILE, f"{number}, {part.name}: it carries {part.outcome}, and is on no sheet.")


def check_imports(course: Course) -> Iterator[CourseFault]:
    """Find modules in the course's ``imports`` that are not installed."""
    for name in course.imports:
        with contextlib.suppress(ModuleNotFoundError):
            if importlib.util.find_spec(name):
                continue
        yield CourseFault("course.py, imports", f"there is no module {name!r}.")


def check_predictions(course: Course) -> Iterator[CourseFault]:
    """Find predictions of answers that do not exist, and those that no cell asks for."""
    cells = [cell.source for path in course.notebooks for cell in student_notebooks.read(path).cells]
    for number, item in _predictions(course):
        where = f"the catalogue, prediction {item.part.name!r} of {number}"
        for question, part in item.found_in:
            try:
                course.catalogue.find(question).part(part)
            except AnswerError as error:
                yield CourseFault(where, f"it is found in an answer that does not exist. {error}")
        call = re.compile(rf"""\.predict\(\s*["']{re.escape(number)}["'][^)]*\b{item.part.name}\s*=""")
        if not any(map(call.search, cells)):
            yield CourseFault(where, f'no cell asks for it, as lab.predict("{number}", {item.part.name}=None) does.')


def _predictions(course: Course) -> list[tuple[str, Predictable]]:
    """Return all that can be predicted, each with the number of its question."""
    return [(number, item) for number, items in course.catalogue.predictions.items() for item in items]


# --- cells of the notebooks -------------------------------------------------------------------------------------------


def check_cells(course: Course) -> Iterator[CourseFault]:
    """Find faults of cells, and of what they record.

    These are parts that no cell records, or several; cells that record what the catalogue does not have, or has in
    another notebook; answer cells that nothing records; missing notebooks; and faults of tags, solutions and headings.
    """
    places: dict[Where, list[str]] = defaultdict(list)
    for path in course.notebooks:
        notebook = student_notebooks.read(path)
        yield from _check_tags_and_headings(path.name, notebook.cells)
        yield from _check_recorded(course, path, notebook, places)
        yield from _check_pictures(course, path.name, notebook.cells)
    for name in course.catalogue.optional:
        if not (course.folder / f"{name}.ipynb").is_file():
            yield CourseFault("the catalogue, optional", f"there is no notebook {name} in {course.folder.name}.")
    names = {path.stem for path in course.notebooks}
    for question in course.catalogue.everything.values():
        if question.notebook not in names:
            yield CourseFault(f"question {question.number}", f"there is no notebook {question.notebook}.")
            continue
        for part in question.parts:
            cells = places[question.number, part.name]
            if len(cells) != 1:
                several = f"{len(cells)} cells record it: {'; '.join(cells)}."
                what = several if cells else f"no cell of {question.notebook} records it."
                yield CourseFault(f"question {question.number}, {part.name}", what)


def _check_recorded(
    course: Course, path: Path, notebook: NotebookNode, places: dict[Where, list[str]]
) -> Iterator[CourseFault]:
    """Find cells that record what they should not, and answer cells that no cell records.

    Parameters
    ----------
    course : with its catalogue
    path, notebook : of the notebook with solutions, and the notebook
    places : (question, part) → cells that record it, as text; those of this notebook are added
    """
    cells = notebook.cells
    ids = [cell.id for cell in cells]
    answered = set()  # a text cell records itself, code is recorded by the cell after it
    for entry in recorded(cells):
        where = _in_cell(path.name, entry.cell)
        answered.add(entry.cell if entry.in_words else ids[ids.index(entry.cell) - 1])
        try:
            question = course.catalogue.find(entry.question)
            parts = [question.part(part) for part in entry.of(question)]
        except AnswerError as error:
            yield CourseFault(where, str(error))
            continue
        for part in parts:
            if entry.in_words and part.kind != "prose":
                yield CourseFault(where, f"{part.name} is no answer in words, but of kind {part.kind}.")
            places[question.number, part.name].append(where)
        if question.notebook != path.stem:
            place = f"which the catalogue has in {question.notebook}."
            yield CourseFault(where, f"it records question {question.number}, {place}")
    for cell in cells:
        if is_answer(cell) and cell.id not in answered:
            missing = "an answer cell, but the cell after it records nothing (lab.answer(...))."
            yield CourseFault(_in_cell(path.name, cell.id), missing)


def _check_tags_and_headings(name: str, cells: list[NotebookNode]) -> Iterator[CourseFault]:
    """Find missing or repeated tags "parameters" and headings, and solutions outside of answer cells."""
    tagged = sum(PARAMETERS_TAG in cell.metadata.get("tags", []) for cell in cells)
    if tagged != 1:
        yield CourseFault(
            name, f"{tagged} cells are tagged 'parameters'; one should be, for papermill's to come after it."
        )
    seen: dict[str, str] = {}
    for cell in cells:
        where = _in_cell(name, cell.id)
        is_solution = BEGIN_CODE in cell.source or words.BEGIN in cell.source
        if is_solution and INSTRUCTOR_TAG not in cell.metadata.get("tags", []) and not is_answer(cell):
            yield CourseFault(where, "it has a solution, but its metadata do not make it an answer cell.")
        if cell.cell_type != "markdown" or not is_answer(cell):
            continue
        headings = words.headings(cell.source.partition(words.BEGIN)[0])
        if len(headings) != 1:
            example = words.heading("Your answer: 1.1, why")
            yield CourseFault(where, f"it should begin with one heading for students, such as {example}")
        for heading in headings:
            if heading in seen:
                yield CourseFault(where, f"it has the heading of cell {seen[heading]!r}, too.")
            seen[heading] = cell.id


def _check_pictures(course: Course, name: str, cells: list[NotebookNode]) -> Iterator[CourseFault]:
    """Find pictures in texts that students do not get: their notebooks are alone in their folder."""
    for cell in cells:
        for picture in map("".join, _PICTURE.findall(cell.source) if cell.cell_type == "markdown" else ()):
            attached = picture.removeprefix("attachment:") in cell.get("attachments", {})
            if not (attached or picture.startswith(("http:", "https:", "data:"))):
                what = f"its picture {picture} is missing where students have it: attach it to the cell."
                yield CourseFault(_in_cell(name, cell.id), what)


def check_derived(course: Course) -> Iterator[CourseFault]:
    """Find stored student notebooks that differ from what would be derived now. Without their folder, find none."""
    try:
        texts = student_course.derive_notebooks(course)
    except GradingError as error:
        yield CourseFault("the student notebooks", str(error))
        return
    folder = course.student_notebooks
    paths = [path for path in folder.glob("*.ipynb") if path.stem not in course.off]
    stored = {path.name: path.read_text(encoding="utf-8") for path in paths}
    for name in sorted(texts.keys() | stored.keys()) if folder.is_dir() else ():
        place = f"{folder.name}/{name}"
        if name not in texts:
            yield CourseFault(place, f"no notebook in {course.folder.name} leads to it: remove it.")
        elif texts[name] != stored.get(name):
            yield CourseFault(place, f"it is not what is derived now: say {program.name()} make-notebooks.")


def check_numbers(course: Course) -> Iterator[CourseFault]:
    """Find cells that state another number than the course has, and patterns of such numbers that no cell matches."""
    cells = [
        (_in_cell(path.name, cell.id), cell.source)
        for path in sorted(course.folder.glob("*.ipynb"))
        for cell in student_notebooks.read(path).cells
    ]
    for stated in course.stated:
        pattern = re.compile(re.sub(r" +", r"\\s+", stated.pattern))
        matches = [(where, match[1]) for where, text in cells for match in pattern.finditer(text)]
        if not matches:
            advice = f"no text has it as {stated.pattern!r} any more: mend the pattern, or take it out."
            yield CourseFault(f"stated, {stated.what}", advice)
        for where, number in matches:
            if not np.isclose(float(number.replace("−", "-")), stated.value, rtol=1e-9, atol=0):
                yield CourseFault(where, f"{stated.what} is {stated.value:g}; this text says {number}.")


# --- what a run brings out --------------------------------------------------------------------------------------------


def check_empty(course: Course, released: Bundle) -> Iterator[CourseFault]:
    """Run the student notebooks as they are handed out, and find cells that stop; of each stop, only the first cause.

    Parameters
    ----------
    course : the course
    released : the course as students have it
    """
    notebooks = merged(released.pristine, {}, every_cell=True)
    files, problems = run_notebooks(released, notebooks)
    yield from (CourseFault("the student notebooks", sentence(problem)) for problem in problems)
    yield from stops(course, released, notebooks, files, "when nothing is filled in")


def stops(
    course: Course, released: Bundle, notebooks: Merged, left: Mapping[str, bytes], when: str
) -> Iterator[CourseFault]:
    """Yield the cells that stopped a run of notebooks; of each stop, only the first cause.

    ``left`` are the files that the run left, and ``when`` says in words which run it was.
    """
    values = set(decoding.decode(left.get(ANSWERS_FILE), SEED, course.catalogue).values)
    reports = schema.read_reports(left.get(REPORTS_FILE, b""))
    causes = Causes(released.pristine, notebooks, reports, values, course.catalogue)
    stopped = (causes.root(cell) for cells in causes.cells.values() for cell in cells if cell.stopped)
    for root in dict.fromkeys(cell for cell in stopped if isinstance(cell, RunCell)):
        yield CourseFault(_in_cell(root.notebook, root.id), f"it stops {when}: {_stop_reason(root)}")


def _stop_reason(cell: RunCell) -> str:
    """Return why a cell stopped, as text."""
    error = cell.report.error if cell.report else None
    if error is None:
        return "the Python process ended in it."
    name = error.message.split("'")[1] if error.type == "NameError" and "'" in error.message else ""
    hint = f". Preset it: begin the answer cell with {name} = None, before the solution." if name else ""
    if error.type == "ModuleNotFoundError":
        hint = ". Name the package that has it in course.py, requires=(…)."
    return f"{error.type}{f', line {error.line}' if error.line else ''}: {error.message}{hint}"


def check_solutions(course: Course, released: Bundle) -> Iterator[CourseFault]:
    """Run the solutions; find problems of the run, and verdicts of the key as :func:`check_verdicts` does."""
    claims, missing = answers_of_solutions(course, released)
    yield from (CourseFault("the solutions", sentence(problem)) for problem in claims.problems)
    yield from check_verdicts(course, claims, missing)


def check_verdicts(
    course: Course, claims: Claims, missing: Mapping[Where, Problem], student: str = SOLUTIONS_STUDENT
) -> Iterator[CourseFault]:
    """Mark the solutions' answers, and wrong answers made of them; find verdicts that are not as expected.

    Right answers should be right, or for a person where the key says so; wrong ones, and the usual mistakes that the
    key knows, should not be right. Marked for another bench, answers that follow from others should count. What a
    prediction is compared with should be found without an error.

    Parameters
    ----------
    course : with the key
    claims : answers, from :func:`answers_of_solutions`
    missing : (question, part) → why there is no answer, from the same
    student : ID of the student with the bench on which these were run
    """
    claims = decoding.with_reports(claims, course.catalogue)
    case = marking.case_of(course, claims, course.true_bench(student), SEED)
    for question, part in asked_parts(course):
        why = sentence(missing.get((question.number, part.name), "its cell runs to its end, and leaves it empty."))
        yield from _faults_of_check(course, question, part, claims, case, student, why)
    for number, item in _predictions(course):
        where = f"the catalogue, prediction {item.part.name!r} of {number}"
        with contextlib.suppress(LookupError):  # an answer is missing, which has been said
            answers = [case.own(*found) for found in item.found_in]
            for fault in _faults_of_prediction(course, item, answers):
                yield CourseFault(where, fault)


def _faults_of_prediction(course: Course, item: Predictable, answers: list[Any]) -> Iterator[str]:
    """Work out from answers what was to be predicted; yield why nobody could have predicted it."""
    try:
        seen = item.seen(*answers)
    except Exception as error:
        yield f"what is seen of it fails: {marking.error_and_line(course, error)}"
        return
    low, high = item.part.plausible or (-math.inf, math.inf)
    if item.part.choices and seen not in item.part.choices:
        yield f"what is seen of it, {seen!r}, is none of its choices."
    elif not item.part.choices and not (isinstance(seen, int | float | np.number) and low <= seen <= high):
        yield f"what is seen of it, {str(seen)[:_LONGEST_SHOWN]}, is outside of what the catalogue calls plausible."


class _KnownAnswers:
    """The solutions' answers as ``own`` of a case. It collects messages on answers that do not exist (``unknown``)."""

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


def asked_parts(course: Course) -> list[tuple[Question, Part]]:
    """Return the parts that the key marks and the class is asked, each with its question, in the key's order."""
    asked = course.asked_catalogue.marked
    return [(asked[number], part) for number in course.key if number in asked for part in asked[number].parts]


def _faults_of_check(
    course: Course, question: Question, part: Part, claims: Claims, case: Case, student: str, missing_reason: Reason
) -> Iterator[CourseFault]:
    """Mark the solution of a part, on its bench and on another, and wrong answers; find what is not as expected.

    Parameters
    ----------
    claims : the solutions' answers
    case : of these answers, and of the bench on which they were found
    student : ID of the student with this bench
    missing_reason : why there is no answer to the part, if there is none
    """
    fault = partial(CourseFault, in_key(course, question, part))
    check, value = course.key[question.number][part.name], claims.values.get((question.number, part.name))
    expected = Status.FOR_A_PERSON if isinstance(check, ForAPerson) else Status.RIGHT
    own = _KnownAnswers(case.own, course.catalogue)
    case = replace(case, own=own)
    doing = "it fails"
    try:
        mark = marking.mark_part(course, question, part, claims, case)
        if value is not None and mark.status is not expected:
            _verdict(check, part, value, case)  # raises what marking leaves to a person
        if mark.status is Status.MISSING:
            yield fault(f"the solution records no answer: {sentence(missing_reason)}")
        elif mark.status is not expected:
            hint = _HINT if part.kind == "recording" and value is not None else ""
            earned = f"{mark.points:g} of {mark.out_of:g} points, {mark.status.value}"
            yield fault(f"the solution gets {earned}: {sentence(mark.reason)}{hint}")
        if value is None or expected is Status.FOR_A_PERSON:
            return
        if part.plausible and not part.plausible[0] <= value <= part.plausible[1]:
            what = "is outside of what the catalogue calls plausible: right answers draw a hint."
            yield fault(f"the solution, {value:g}, {what}")
        doing = "what follows from right answers fails"
        value_that_follows(check, part, case)
        on_another = replace(case, bench=course.true_bench(f"{student}-other"))
        if getattr(check, "follow", None) and _verdict(check, part, value, on_another).status is Status.WRONG:
            yield fault("what follows from right answers is not the solution: is the formula of follow=… right?")
        doing = "on a wrong answer, it fails"
        for what, wrong in [*wrong_answers(part, value), *slips_of(check, part, case)]:
            verdict = _verdict(check, part, wrong, case)
            if verdict.status in (Status.RIGHT, Status.FOLLOW_THROUGH):
                why = sentence(verdict.reason) + " Is follow=… right?" * (verdict.status is Status.FOLLOW_THROUGH)
                taken = f"{what} ({str(wrong)[:_LONGEST_SHOWN]}) is taken for right: {why}"
                # Numbers may be so near a limit on some benches that they agree with two choices.
                yield fault(taken, part.kind == "choice" and student != SOLUTIONS_STUDENT)
                break
    except Exception as error:  # whatever a mistake in a key may raise
        if not own.unknown:
            yield fault(f"{doing}: {_error_text(course, error)}")
    for unknown in own.unknown:
        yield fault(f"it uses an answer that does not exist. {unknown}")


def _verdict(check: Check, part: Part, value: Any, case: Case) -> Verdict:
    """Return a check's verdict, as marking does, but let it raise."""
    with np.errstate(all="ignore"):
        return check.verdict(part, value, case)


def _error_text(course: Course, error: Exception) -> str:
    """Return an error as text, with its type and its line; the message of a KeyFault has both already."""
    return str(error) if isinstance(error, KeyFault) else marking.error_and_line(course, error)


def solved_cells(course: Course, pristine: Mapping[str, dict[str, Any]]) -> dict[str, tuple[Cell, ...]]:
    """Return file name → cells of the released notebook, with the solutions in its answer cells.

    Parameters
    ----------
    course : with the solutions
    pristine : file name → notebook as released
    """
    solved = {name: student_notebooks.read(course.folder / name).cells for name in pristine}
    return {
        name: as_released(pristine[name], {cell.id: cell.source for cell in cells if is_answer(cell)})
        for name, cells in solved.items()
    }


def answers_of_solutions(
    course: Course, released: Bundle, student: str = SOLUTIONS_STUDENT
) -> tuple[Claims, Mapping[Where, Problem]]:
    """Run the notebooks with solutions, on the bench of a student.

    Returns
    -------
    Claims
        The answers, the values that are given to the class, and problems of the run.
    Mapping
        (question, part) → why there is no answer, for missing answers of which the reason is known.

    Raises
    ------
    GradingError
        If the course cannot be imported.
    """
    pristine = released.pristine
    written = merged(pristine, solved_cells(course, pristine))
    files, problems = run_notebooks(released, written, student)
    claims = decoding.decode(files.get(ANSWERS_FILE), SEED, course.catalogue)
    reports = schema.read_reports(files.get(REPORTS_FILE, b""))
    why = reasons.explain(pristine, written, reports, claims.values, released.catalogue, handed_in=pristine)
    claims.problems.extend(problems)
    for name, master in pristine.items():
        texts = words.written(master["cells"], Notebook.read((course.folder / name).read_bytes()).cells)
        decoding.add_words(claims, texts.words, course.catalogue)
        claims.problems.extend(replace(problem, where=name) for problem in [*texts.problems, *texts.notes])
    claims.values.update(course.given_values(student, released.policy, released.asked_parts))
    return claims, why.missing


def run_notebooks(released: Bundle, notebooks: Merged, student: str = SOLUTIONS_STUDENT) -> runner.Ran:
    """Run notebooks of the course: in a sandbox if all needed layers work on this computer, else without.

    Raises
    ------
    GradingError
        If the course cannot be imported.
    """
    job = runner.Job(
        student=student,
        notebooks=notebooks.notebooks,
        probe_seed=SEED,
        parameters=released.parameters,
        imports=released.imports,
        limits=_LIMITS,
        isolated=all(layer.good for layer in selftest.layers() if layer.needed),
    )
    return runner.run(released.packed, job)
