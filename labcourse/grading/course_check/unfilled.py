"""The student notebooks, run as they are handed out: whoever has written nothing yet must be able to go on."""

from __future__ import annotations

import re
from collections.abc import Iterator

from labcourse.answers import cell_reports
from labcourse.grading.course import Course
from labcourse.grading.course_check.finding import Finding, in_cell
from labcourse.grading.course_check.solved import SEED, run_of
from labcourse.grading.marking import decoding
from labcourse.grading.running.bundle import Bundle
from labcourse.run.causes import Causes, RunCell
from labcourse.run.merge import merged

_NO_PYTHON = ("SyntaxError", "IndentationError")
_UNSET = re.compile(r"name '(\w+)' is not defined")


def check(course: Course, made: Bundle) -> Iterator[Finding]:
    """Cells that stop, but for those that need an answer to an earlier question.

    Parameters
    ----------
    course : the course
    made : its bundle
    """
    notebooks = merged(made.pristine, {}, every_cell=True)
    run = run_of(made, notebooks)
    for problem in run.problems:
        yield Finding("the student notebooks", problem)
    recorded = set(decoding.decode(run.answers, SEED, course.catalogue).values)
    causes = Causes(made.pristine, notebooks, cell_reports.read(run.reports), recorded, course.catalogue)
    unset = set()  # names without a value, each reported once, where it is first used
    for cells in causes.cells.values():
        roots = dict.fromkeys(causes.root(cell) for cell in cells if cell.stopped)
        stopped = {root: _type(root) for root in roots if isinstance(root, RunCell)}
        no_python = [root.place for root, error in stopped.items() if error in _NO_PYTHON]
        for root, error in stopped.items():
            if error == "NameError" and any(place < root.place for place in no_python):
                continue  # what that cell would have bound cannot be read off it
            why = _why(root)
            if error == "NameError" and why in unset:
                continue
            unset.add(why)
            yield Finding(in_cell(root.notebook, root.id), f"it stops when nothing is filled in: {why}")


def _type(cell: RunCell) -> str:
    return cell.report.error.type if cell.report and cell.report.error else ""


def _why(cell: RunCell) -> str:
    error = cell.report.error if cell.report else None
    if error is None:
        return "the Python process ended in it."
    unset = _UNSET.search(error.message)
    if error.type == "NameError" and unset:
        return f"{unset[1]} has no value; preset it before the solution, as {unset[1]} = None."
    line = f", line {error.line}" if error.line else ""
    return f"{error.type}{line}: {error.message}"
