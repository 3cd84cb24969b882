"""Numbers that are right to few digits."""

from __future__ import annotations

import math
from types import SimpleNamespace

import pytest

from rotflex.courseware.parts import Part
from rotflex.instructor.marking.checks import Number
from rotflex.instructor.verdicts import Case, Status

NUMBER = Part("x", "number", 1, "...", unit="m")


def judged(value: float, **more: int) -> Status:
    check = Number("it", lambda bench: bench.size, 0.01, **more)
    case = Case(SimpleNamespace(size=math.pi), lambda question, part: {}[question], 7)
    return check.verdict(NUMBER, value, case).status


@pytest.mark.parametrize(
    ("value", "digits", "status"),
    [
        (3.1, 2, Status.RIGHT),
        (3.1, 0, Status.WRONG),
        (3.2, 2, Status.WRONG),  # rounded the wrong way
        (3.105, 2, Status.WRONG),  # not rounded, and off
        (3.0, 1, Status.RIGHT),
        (3.0, 2, Status.WRONG),
        (3.12, 2, Status.RIGHT),  # within 1 %
    ],
)
def test_a_number_is_right_to_the_fewest_digits_that_are_allowed(value, digits, status):
    assert judged(value, fewest_digits=digits) is status
