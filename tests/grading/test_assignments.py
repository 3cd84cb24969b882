"""Assignments, the calendar's states, and what a student may see: each state by the facts that make it."""

from dataclasses import replace
from datetime import UTC, datetime, timedelta
from fractions import Fraction

import pytest
from gradebooks import facts, graded, mark
from made_courses import OURS

from labcourse.errors import GradingError
from labcourse.grading.accounts import account_of
from labcourse.grading.assignments import Handed, State, find, of_course, works
from labcourse.grading.gradebook import Arrival, Excuse, StudentRecord
from labcourse.grading.marks import Mark
from labcourse.grading.settings import Assignment, CourseSettings, Deadline, Extension, LateSettings, MarkSettings
from labcourse.problems import Code, Problem

DUE = datetime(2026, 11, 20, 18, tzinfo=UTC)
DAY = timedelta(days=1)
ADA = StudentRecord("ada", section="A")
SECOND, THIRD = "02_finding_stiffness", "03_model_validation"
LAB = Assignment("Lab 02", (SECOND,), DUE)
BOTH = Assignment("Both", (SECOND, THIRD), DUE, out_of=20)
CAME = {f"{SECOND}.ipynb": Arrival(DUE - DAY)}


def course(*named, **settings):
    return replace(OURS, settings=CourseSettings(assignments=named, **settings))


def handed(*marks, received=CAME, cells=(), problems=(), excuses=None):
    run = graded("ada", *marks, cells=cells, problems=problems)
    return Handed(ADA, run.marks, received, run, excuses or {})


def excused(name):
    return {name: Excuse(1, "ada", name, True, "lea", "ill", DUE)}


def state(what, when=DUE + DAY, made=None, name=SECOND):
    return works(made or course(LAB), what, when)[name].state


RIGHT, MISSING = mark(), Mark("2.11", "omega_n", "missing", 0.0, 2.0, "")
WAITS = Mark("2.11", "explanation", "for a person", 0.0, 1.0, "")
FAULT = Mark("2.11", "omega_n", "not marked: key fault", 0.0, 2.0, "")
UNTOUCHED = facts(untouched=(SECOND,))
FAILED = Problem.of(Code.GRADING_FAILED, error="OSError: the disk is full")


@pytest.mark.parametrize(
    ("what", "before", "after"),
    [
        (Handed(ADA), "not due", "missing"),
        (Handed(ADA, (), CAME), "handed in", "handed in"),
        (handed(MISSING, cells=UNTOUCHED), "untouched", "untouched"),
        (handed(RIGHT), "marked", "marked"),
        (handed(RIGHT, received={}), "marked", "marked"),  # an answer is there, though no file is stored
        (handed(RIGHT, WAITS), "waits for a person", "waits for a person"),
        (handed(FAULT), "could not be graded", "could not be graded"),
        (handed(RIGHT, problems=(FAILED,)), "could not be graded", "could not be graded"),
    ],
)
def test_each_state_before_and_after_the_deadline(what, before, after):
    assert (state(what, DUE), state(what, DUE + timedelta(seconds=1))) == (before, after)


def test_a_file_that_cannot_be_read_could_not_be_graded():
    what = handed(MISSING, received={})
    for code in (Code.NOTEBOOK_UNREAD, Code.OLDER_NOTEBOOK_COUNTS):
        for name, expected in ((SECOND, State.NOT_GRADED), ("another", State.MISSING)):
            run = replace(what.graded.run, problems=(Problem.of(code, f"{name}.ipynb"),))
            assert state(replace(what, graded=replace(what.graded, run=run))) == expected


def test_of_a_submission_that_cannot_be_read_what_is_due_could_not_be_graded():
    what = handed(MISSING, received={})

    def with_problem(**about):
        problems = (Problem.of(Code.SUBMISSION_UNREAD, "ada.zip", **about),)
        return replace(what, graded=replace(what.graded, run=replace(what.graded.run, problems=problems)))

    unread = with_problem()
    assert (state(unread, DUE), state(unread)) == (State.NOT_DUE, State.NOT_GRADED)
    assert state(with_problem(notebooks=[f"{SECOND}.ipynb"])) == State.NOT_GRADED
    assert state(with_problem(notebooks=["another.ipynb"])) == State.MISSING
    grade = account_of(course(LAB), unread, DUE + DAY)
    assert grade.undecided and grade.assignments[0].points_text == ""


def test_grace_and_extensions_move_when_work_is_due_and_the_latest_counts():
    more = Extension(DUE + 2 * DAY, ("ADA",), assignments=("Lab 02",))
    made = course(LAB, deadlines=(Deadline(DUE - DAY),), extensions=(more,), late=LateSettings(grace_hours=2))
    assert state(Handed(ADA), DUE + 2 * DAY + timedelta(hours=2), made) == State.NOT_DUE
    assert state(Handed(ADA), DUE + 2 * DAY + timedelta(hours=2, seconds=1), made) == State.MISSING
    assert state(Handed(StudentRecord("bob")), DUE + timedelta(hours=3), made) == State.MISSING


def test_without_a_date_work_is_due_with_the_last_that_has_one():
    made = course(Assignment("Lab 01", ("01_modeling_prelab",), DUE - DAY), LAB)
    assert state(Handed(ADA), DUE, made, THIRD) == State.NOT_DUE
    assert state(Handed(ADA), DUE + DAY, made, THIRD) == State.MISSING
    assert state(Handed(ADA), DUE, course(), THIRD) == State.MISSING  # no calendar


def test_by_default_each_notebook_with_points_is_an_assignment_in_the_order_of_notebooks():
    asked = OURS.catalogue.marked.values()
    counting = {one.notebook for one in asked if any(part.points for part in one.parts)}
    names = [one.notebooks for one in of_course(course())]
    assert names == [(name,) for name in OURS.catalogue.notebooks if name in counting]
    dropped = MarkSettings(drop=tuple(one.number for one in asked if one.notebook == THIRD))
    assert (THIRD,) not in [one.notebooks for one in of_course(course(marks=dropped))]


def test_assignments_are_listed_by_the_date_of_whoever_has_most_time_and_without_a_date_last():
    first = Assignment("First", ("04_modeling_results",), DUE - DAY)
    other = Assignment("Other", (THIRD,), DUE - 2 * DAY)
    more = (Deadline(DUE + DAY, section="B", assignments=("Other",)), Deadline(DUE, ("01_modeling_prelab",)))
    titles = [one.title for one in of_course(course(other, LAB, first, deadlines=more))]
    assert titles[:5] == ["First", "01 modeling prelab", "Lab 02", "Other", "05 control prelab"]
    assert [one.title for one in account_of(course(LAB, first), handed(RIGHT)).assignments][:2] == ["First", "Lab 02"]


@pytest.mark.parametrize("name", ["lab 02", SECOND, "02"])
def test_an_assignment_is_found_by_title_notebook_or_number(name):
    assert find(course(LAB), name) == LAB
    with pytest.raises(GradingError, match="There are: Lab 02, 01 modeling prelab"):
        find(course(LAB), "12")


def test_an_assignment_has_points_of_its_own_scale():
    """Earned 1.5 of 3 in one notebook, of which a tenth is lost, and 1 of 2 in the other: 2.35 of 5."""
    half = Mark("2.11", "omega_n", "partly right", 1.5, 2.0, "")
    zero = Mark("2.11", "explanation", "wrong", 0.0, 1.0, "")
    other = Mark("2.13", "state_space", "partly right", 1.0, 2.0, "")
    late = {f"{SECOND}.ipynb": Arrival(DUE + timedelta(hours=1)), f"{THIRD}.ipynb": Arrival(DUE)}
    made = course(BOTH, late=LateSettings(per_day=10))
    found = account_of(made, handed(half, zero, other, received=late), DUE + DAY)
    (both,) = [one for one in found.assignments if one.title == "Both"]
    assert (both.earned, both.possible, both.points) == (Fraction(235, 100), 5, Fraction(235, 100) * 4)
    assert (both.points_text, both.days_late, both.state) == ("9.40", 1, State.MARKED)
    assert (found.earned, found.out_of) == (both.points, 20) and found.explanations()[-1].startswith("Both: ")


def test_who_is_excused_has_it_in_neither_sum():
    made = course(BOTH)
    other = Mark("2.13", "state_space", "partly right", 1.0, 2.0, "")
    some = account_of(made, handed(RIGHT, other, excuses=excused(SECOND)), DUE + DAY)
    assert (some.earned, some.out_of) == (10, 20)  # 1 of 2, on the scale of 20
    rest = account_of(made, handed(RIGHT, excuses=excused(SECOND)), DUE + DAY)
    assert rest.out_of == 0  # as nothing that is left earns points
    every = account_of(made, handed(RIGHT, other, excuses=excused(SECOND) | excused(THIRD)), DUE + DAY)
    assert every.out_of == 0 and every.assignments[1].points_text == ""
