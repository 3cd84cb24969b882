"""Answers made wrong of right ones are wrong by any tolerance."""

from __future__ import annotations

import pytest

from rotflex.courseware.parts import Part
from rotflex.instructor.marking.wrong_answers import wrong_answer


@pytest.mark.parametrize("value", [0.0, 0.1, 2.0, 90.0])
def test_a_number_made_wrong_is_off_by_a_twentieth_of_what_is_plausible_at_least(value):
    part = Part("x", "number", 1, "...", unit="%", plausible=(0.0, 100.0))
    assert wrong_answer(part, value) - value == pytest.approx(5.0 + 0.37 * value)


def test_a_number_of_which_nothing_is_known_is_made_wrong_by_a_factor_and_a_little():
    assert wrong_answer(Part("x", "number", 1, "...", unit="m"), 2.0) == pytest.approx(2.85)
