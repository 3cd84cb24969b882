"""A whole class on the whole course, against marks worked out by hand (see ``whole_class.py``)."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import whole_class
from made_courses import OURS
from whole_class import CLASS
from working_through import FULL, JUDGED, PROSE

from labcourse.grading.marking.decoding import decode
from labcourse.grading.marking.marking import mark
from rotflex.hil.student_benches import student_seed
from solutions.true_bench import TrueBench

FOLLOWS = "right, given your own earlier answers"


@pytest.fixture(scope="session")
def key():
    return OURS.key


@pytest.fixture(scope="session")
def bytes_of(tmp_path_factory):
    """Each student's answers, worked out when first asked for."""

    @cache
    def worked(name):
        return whole_class.claims(name, CLASS[name], tmp_path_factory.mktemp(name))

    return worked


def marks_of(data, name, key):
    return mark(
        replace(OURS, key=key), decode(data, student_seed(name), OURS.catalogue), TrueBench(name), student_seed(name)
    )


@pytest.fixture(scope="session")
def marks(bytes_of, key):
    """Each student's marks by question and part, worked out when first asked for."""

    @cache
    def marked(name):
        return {(one.question, one.part): one for one in marks_of(bytes_of(name), name, key)}

    return marked


def test_the_points_are_those_of_the_catalogue():
    assert sum(FULL.values()) == 82.5
    assert sum(PROSE.values()) + sum(JUDGED.values()) == 42 + 4


@pytest.mark.parametrize("name", CLASS)
def test_points_are_those_worked_out_by_hand(marks, name):
    expected = CLASS[name].points()
    given = {where: one.points for where, one in marks(name).items() if where in expected}
    assert given.keys() == expected.keys()
    differing = {where: (given[where], marks(name)[where].reason) for where in given if given[where] != expected[where]}
    assert differing == {}
    assert sum(one.awaiting for one in marks(name).values()) == CLASS[name].awaiting()


@pytest.mark.parametrize("name", [name for name, student in CLASS.items() if student.follows])
def test_what_follows_from_a_mistake_is_said_to_follow(marks, name):
    assert {where: marks(name)[where].status.value for where in CLASS[name].follows} == dict.fromkeys(
        CLASS[name].follows, FOLLOWS
    )


@pytest.mark.parametrize("name", ["ada", "rough"])
def test_what_is_right_within_its_tolerance_is_right_and_not_merely_consistent(marks, name):
    auto = {one.status.value for where, one in marks(name).items() if where in FULL}
    assert auto == {"right"}


def test_students_have_different_benches():
    assert len({(TrueBench(name).joint.arm_position, TrueBench(name).K_s) for name in CLASS}) == len(CLASS)


def test_a_perfect_file_of_another_student_does_not_earn_what_depends_on_the_bench(bytes_of, key):
    marks = marks_of(bytes_of("ada"), "silent", key)
    copied = {(one.question, one.part): one.points for one in marks}
    for where in (("2.9", "sweep"), ("2.15", "validation"), ("3.13", "response"), ("3.15", "response")):
        assert copied[where] == 0, where


@pytest.mark.parametrize("name", ["soft", "polynomial-slip"])
def test_no_reason_gives_away_a_value_of_the_bench(marks, name):
    bench = TrueBench(name)
    reasons = " ".join(one.reason for one in marks(name).values())
    assert "omega_n" in reasons
    assert [v for v in (bench.K_s, bench.omega_n, bench.omega_n / (2 * np.pi)) if f"{v:#.4g}" in reasons] == []
