"""Right answers in many ways (``right_ways.py``): each has its full marks on several benches, and changes no other.

And ``lab.reflect()`` asks nothing of any.
"""

from __future__ import annotations

from functools import cache

import pytest
from made_courses import OURS
from reflections import NOTHING, asked_of, said_by
from right_ways import TOLD, WAYS, rewritten, worked
from working_through import FULL

from rotflex.hil.student_benches import student_seed
from rotflex.instructor.marking.decoding import decode
from rotflex.instructor.marking.marking import mark
from solutions.true_bench import TrueBench

pytestmark = pytest.mark.usefixtures("runs_made_once")

STUDENTS = ("ada", "bob", "carla")


def marked(data, student, bench):
    """The marks that a file of answers earns, by question and part."""
    seed = student_seed(student)
    return {(one.question, one.part): one for one in mark(OURS, decode(data, seed, OURS.catalogue), bench, seed)}


@pytest.fixture(scope="module")
def usual(tmp_path_factory):
    """A student's usual answers, the file of them, its marks, and the bench; worked out when first asked for."""

    @cache
    def of(student):
        own, data = worked(student, tmp_path_factory.mktemp(student))
        bench = TrueBench(student)
        return own, data, marked(data, student, bench), bench

    return of


def lost(marks):
    return {where: marks[where].reason for where, full in FULL.items() if marks[where].points < full}


def of_each(ways):
    return pytest.mark.parametrize("way", [pytest.param(way, id=str(way)) for way in ways])


@pytest.mark.parametrize("student", STUDENTS)
def test_the_usual_way_has_full_marks(usual, student):
    assert lost(usual(student)[2]) == {}
    assert said_by(asked_of(student, usual(student)[1])) == NOTHING


@of_each([way for way in WAYS if way.written])
def test_another_way_of_writing_has_full_marks_and_changes_nothing_else(usual, tmp_path, way):
    student = STUDENTS[list(WAYS).index(way) % len(STUDENTS)]  # by turns
    own, data, before, bench = usual(student)
    changed, said = rewritten(student, tmp_path, way.written, own, data)
    assert [line for line in said if not line.endswith("  recorded")] == []
    marks = marked(changed, student, bench)
    assert lost(marks) == {}
    assert {where: marks[where].status for where in FULL} == {where: before[where].status for where in FULL}
    assert said_by(asked_of(student, changed)) == NOTHING


@of_each([way for way in WAYS if way.carried])
def test_another_reading_has_full_marks_in_all_that_builds_on_it(usual, tmp_path, way):
    for student in STUDENTS:
        (tmp_path / student).mkdir()
        _own, data = worked(student, tmp_path / student, way)
        assert lost(marked(data, student, usual(student)[3])) == {}
        assert said_by(asked_of(student, data)) == NOTHING


@pytest.mark.parametrize(("where", "what"), TOLD)
def test_what_is_not_taken_says_what_to_do(usual, tmp_path, where, what):
    given, told = TOLD[where, what]
    own, data, *_ = usual("ada")
    _changed, said = rewritten("ada", tmp_path, {where: given}, own, data)
    assert len(said) == 1
    assert "not recorded" in said[0]
    assert told in said[0]
