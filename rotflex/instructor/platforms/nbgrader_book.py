"""Marks into nbgrader's gradebook, cell by cell, through nbgrader's own interface.

A course's answer cells bear nbgrader's metadata; so a release of it is an assignment of nbgrader's, and its gradebook
has a grade for each answer cell of each submission that was collected there. Ours goes in as the mark of a person: it
stands for whatever tests would have given. nbgrader knows points of cells only: weights and lateness are not carried
over.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rotflex.courseware.messages import _, plural
from rotflex.courseware.student_id import caseless
from rotflex.errors import GradingError
from rotflex.instructor.course import Course
from rotflex.instructor.gradebook import Gradebook, StudentRecord
from rotflex.instructor.platforms import matching
from rotflex.instructor.release import student_notebooks
from rotflex.instructor.reports.result import Result, points, result_of

Where = tuple[str, str]  # question, part
Cells = Mapping[tuple[str, str], tuple[Where, ...]]  # notebook and grade id → what is answered there


@dataclass
class Carried:
    """What came of it.

    Attributes
    ----------
    written : grades of cells that were set
    unchanged : grades that were so already
    replaced : "student, cell: before → after", where a person had given another mark in nbgrader
    new : "student, cell: points", where no person had
    students : of whom something was carried over
    waiting : student → cells whose answer still waits for a person
    without : student → why nothing was carried over
    cells : notebook and cell → why it is left alone, for everybody
    nowhere : parts that are worth points, and have no cell
    """

    written: int = 0
    unchanged: int = 0
    replaced: list[str] = field(default_factory=list)
    new: list[str] = field(default_factory=list)
    students: set[str] = field(default_factory=set)
    waiting: dict[str, list[str]] = field(default_factory=dict)
    without: dict[str, str] = field(default_factory=dict)
    cells: dict[str, str] = field(default_factory=dict)
    nowhere: dict[str, None] = field(default_factory=dict)

    def told(self, dry: bool = False) -> list[str]:
        """All that there is to tell, a line each, the sum first; where nothing is written, each new mark, too."""
        lines = [
            _(
                "{written} of cells written ({replaced} of them in place of another), {unchanged} as they were; "
                "of {students}."
            ).format(
                written=plural(self.written, "{count} mark", "{count} marks"),
                replaced=len(self.replaced),
                unchanged=self.unchanged,
                students=plural(len(self.students), "{count} student", "{count} students"),
            )
        ]
        if dry and self.new:
            lines.append(_("Where nobody gave a mark: {listed}").format(listed="; ".join(self.new)))
        if self.replaced:
            lines.append(_("Replaced: {listed}").format(listed="; ".join(self.replaced)))
        lines += [
            _("{student}: still waits for a person, and left: {cells}").format(student=student, cells=", ".join(cells))
            for student, cells in self.waiting.items()
        ]
        lines += [
            _("{student}: nothing; {why}").format(student=student, why=why) for student, why in self.without.items()
        ]
        lines += [_("Cell {cell}: left; {why}").format(cell=cell, why=why) for cell, why in self.cells.items()]
        if self.nowhere:
            lines.append(_("In no cell, and so not in nbgrader: {parts}").format(parts=", ".join(self.nowhere)))
        return lines


def answer_cells(course: Course) -> dict[tuple[str, str], tuple[Where, ...]]:
    """Notebook and grade id of each answer cell of a course → the questions and parts that are answered there."""
    found = {}
    for path in course.notebooks:
        notebook = student_notebooks.read(path)
        parts = student_notebooks.parts_of(notebook, path.name, course.catalogue)
        for cell in notebook.cells:
            if cell.id in parts and cell.metadata.nbgrader.get("grade"):
                found[path.stem, cell.metadata.nbgrader.grade_id] = parts[cell.id]
    return found


def carry(book: Gradebook, course: Course, theirs: Path, assignment: str, dry: bool = False) -> Carried:
    """Put everybody's marks into nbgrader's gradebook: all of it, or, after an error, nothing.

    Parameters
    ----------
    book : our gradebook
    course : whose notebooks say which cell answers what
    theirs : nbgrader's gradebook, a file of SQLite
    assignment : its name there
    dry : only tell what would come of it

    Raises
    ------
    GradingError
        If nbgrader is not installed, or its gradebook cannot be read, or has no such assignment.
    """
    cells = answer_cells(course)
    known = matching.known_by(book.students())
    with _opened(theirs) as nbgrader:
        names = sorted(str(one.name) for one in nbgrader.assignments)
        if assignment not in names:
            raise GradingError(
                _("{file} has no assignment {name!r}; it has {names}.").format(
                    file=theirs, name=assignment, names=", ".join(map(repr, names)) or _("none")
                )
            )
        carried = Carried()
        submissions = {str(one.student.id): one for one in nbgrader.assignment_submissions(assignment)}
        led = {name: known.get(caseless(name), set()) for name in submissions}
        for name, student in _whose(led, carried).items():
            _submission(book, submissions[name], student, cells, carried)
        _uncollected(book, set().union(*led.values()), carried)
        if dry:
            nbgrader.db.rollback()
        else:
            nbgrader.db.commit()
    return carried


def _whose(led: Mapping[str, set[str]], carried: Carried) -> dict[str, str]:
    """nbgrader's student → ours, where that is certain; of the others it is told why they get nothing.

    Parameters
    ----------
    led : nbgrader's student → all of ours whom that may be
    carried : where it is told
    """
    certain = {theirs: min(ours) for theirs, ours in led.items() if len(ours) == 1}
    times = Counter(certain.values())
    for theirs, ours in led.items():
        if not ours:
            carried.without[theirs] = _("the gradebook has no such student.")
        elif theirs not in certain:
            why = _("it may be any of {students}.").format(students=", ".join(sorted(ours)))
            carried.without[theirs] = why
        elif times[certain[theirs]] > 1:
            why = _("several submissions lead to {student!r}.").format(student=certain[theirs])
            carried.without[theirs] = why
    return {theirs: student for theirs, student in certain.items() if times[student] == 1}


def _submission(book: Gradebook, submission: Any, student: str, cells: Cells, carried: Carried) -> None:
    """The grades of one submission."""
    graded = book.current(student)
    if graded is None:
        carried.without[student] = _("nothing of theirs is graded here.")
        return
    result = result_of(graded, StudentRecord(student))
    placed: set[Where] = set()
    for notebook in submission.notebooks:
        for grade in notebook.grades:
            parts = cells.get((notebook.name, grade.name))
            name = f"{notebook.name} {grade.name}"
            if parts is None:
                carried.cells.setdefault(name, _("the course has no such answer cell."))
                continue
            placed.update(parts)
            _grade(grade, name, parts, result, carried)
    carried.students.add(student)
    there = [mark for mark in result.marks if mark.out_of and (mark.question, mark.part) not in placed]
    carried.nowhere |= dict.fromkeys(f"{mark.question} {mark.part}" for mark in there)


def _grade(grade: Any, name: str, parts: tuple[Where, ...], result: Result, carried: Carried) -> None:
    """The grade of one cell."""
    marks = [mark for mark in result.marks if (mark.question, mark.part) in parts]
    if not marks:
        carried.cells.setdefault(name, _("nothing of it is marked here."))
        return
    out_of = sum(mark.out_of for mark in marks)
    if not _same(out_of, grade.max_score or 0):
        why = _(
            "it is worth {theirs:g} points in nbgrader, and {ours:g} here: make the assignment of the same release."
        )
        carried.cells.setdefault(name, why.format(theirs=grade.max_score or 0, ours=out_of))
        return
    undecided = result.undecided()
    if any(mark in undecided for mark in marks):
        carried.waiting.setdefault(result.student, []).append(name)
        return
    earned = float(sum(mark.points for mark in marks))
    before = grade.manual_score
    if before is not None and _same(before, earned) and not grade.needs_manual_grade:
        carried.unchanged += 1
        return
    if before is None:
        carried.new.append(f"{result.student}, {name}: {points(earned)}")
    elif not _same(before, earned):
        carried.replaced.append(f"{result.student}, {name}: {points(before)} → {points(earned)}")
    grade.manual_score, grade.needs_manual_grade = earned, False
    carried.written += 1


def _uncollected(book: Gradebook, reached: Collection[str], carried: Carried) -> None:
    """Those who have marks here, and no submission there."""
    for one in book.students():
        if one.student not in reached and book.current(one.student) is not None:
            carried.without[one.student] = _(
                "nbgrader has no submission of theirs: collect it there, and autograde it."
            )


def _same(one: float, other: float) -> bool:
    """Whether two sums of points are the same, but for how they were added up."""
    return math.isclose(one, other, abs_tol=1e-9)


@contextmanager
def _opened(file: Path) -> Iterator[Any]:
    """nbgrader's gradebook, for as long as the block is."""
    try:
        from nbgrader.api import Gradebook as Theirs
    except ImportError:
        raise GradingError(
            _("nbgrader is not installed here, and its gradebook is read by nbgrader alone: pip install nbgrader")
        ) from None
    from sqlalchemy import create_engine, text
    from sqlalchemy.exc import SQLAlchemyError

    if not file.is_file():
        raise GradingError(_("There is no gradebook of nbgrader's {file}.").format(file=file))
    url = f"sqlite:///{file.resolve()}"
    try:
        engine = create_engine(url)
        with engine.connect() as connection:
            courses = list(connection.execute(text("SELECT id FROM course")).scalars())
        engine.dispose()
        with Theirs(url, course_id=courses[0] if courses else "") as opened:  # an unknown name would be added
            yield opened
    except SQLAlchemyError as error:
        raise GradingError(
            _(
                "{file} cannot be used as a gradebook of nbgrader's: {why}. (`nbgrader db upgrade` brings an older one "
                "up.)"
            ).format(file=file, why=str(error).splitlines()[0])
        ) from None
