"""``lab.reflect()`` on the whole course: single slips carried on are asked about, right ways never are."""

from __future__ import annotations

import pytest
from reflections import asked_of
from right_ways import WAYS, rewritten, worked
from single_slip_marks import answers_with
from single_slips import SLIPS, STUDENT

STUDENTS = ("ada", "bob", "carla")
BENCHES = tuple(f"reflects-{number}" for number in range(9))


@pytest.fixture(scope="module")
def usual(tmp_path_factory):
    return {name: worked(name, tmp_path_factory.mktemp(name)) for name in STUDENTS}


@pytest.mark.parametrize("slip", SLIPS, ids=lambda slip: slip.name)
def test_a_slip_that_is_carried_on_in_good_faith_is_asked_about(slip):
    said = asked_of(STUDENT, answers_with(slip))
    assert said.asked
    assert not said.unclear


@pytest.mark.parametrize("name", BENCHES)
def test_right_answers_of_many_benches_are_asked_nothing(tmp_path, name):
    said = asked_of(name, worked(name, tmp_path)[1])
    assert (said.asked, said.missing, said.unclear) == ((), (), ())


@pytest.mark.parametrize("way", [pytest.param(way, id=str(way)) for way in WAYS])
def test_right_answers_in_another_way_are_asked_nothing(usual, tmp_path, way):
    name = STUDENTS[list(WAYS).index(way) % len(STUDENTS)]  # by turns
    if way.carried:
        data = worked(name, tmp_path, way)[1]
    else:
        own, before = usual[name]
        data, _said = rewritten(name, tmp_path, way.written, own, before)
    said = asked_of(name, data)
    assert (said.asked, said.missing, said.unclear) == ((), (), ())
