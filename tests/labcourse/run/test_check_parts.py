"""What a check at home says of one part, from what was recorded now and before: without running anything."""

import pytest

from labcourse.problems import Code, Problem
from labcourse.run.check import CheckState, _state, alike
from labcourse.run.reasons import Reasons

WHERE, WHY = ("2.10", "spectrum"), Problem.of(Code.BUILDS_ON_UNANSWERED, on="2.9")


def recorded(content, seed=1):
    return {"answers": {WHERE[0]: {WHERE[1]: content}} if content else {}, "probe_seed": seed}


def function(output, seed=1):
    return recorded({"kind": "function", "value": [[output, 2.0]]}, seed)


def number(value, seed=1):
    return recorded({"kind": "number", "value": value}, seed)


NONE, STOPPED, BEGUN = recorded(None), Reasons({WHERE: WHY}), frozenset([WHERE])


@pytest.mark.parametrize(
    ("now", "before", "why", "state"),
    [
        (number(20.0), NONE, STOPPED, CheckState.RECORDED),
        (number(20.0), number(20.0), STOPPED, CheckState.RECORDED),
        (number(20.0), number(21.0), STOPPED, CheckState.DIFFERENT),
        (number(20.0), number(21.0, seed=2), STOPPED, CheckState.DIFFERENT),
        (function(1.0), function(1.0), STOPPED, CheckState.RECORDED),
        (function(1.0), function(1.5), STOPPED, CheckState.DIFFERENT),
        (
            function(1.0),
            function(1.5, seed=2),
            STOPPED,
            CheckState.RECORDED,
        ),  # tried on other inputs: nothing to compare
        (NONE, number(20.0), Reasons({}), CheckState.EMPTY),
        (NONE, NONE, Reasons({WHERE: WHY}, begun=BEGUN), CheckState.MISSING),
        (NONE, number(20.0), STOPPED, CheckState.MISSING),
        (NONE, NONE, STOPPED, CheckState.EMPTY),  # of what nobody has begun
    ],
)
def test_a_part_is_other_than_on_the_page_or_missing_where_that_can_be_known(now, before, why, state):
    assert _state(WHERE, now, before, why) is state


ALIKE = [
    ({"kind": "number", "value": 19.8765}, {"kind": "number", "value": 19.8766}),
    ({"y": [1e-12, 5.0, -3.0]}, {"y": [-1e-12, 5.0, -3.0]}),  # noise beside what is large
    ({"a": [[1, 2], [3, 4.0]]}, {"a": [[1, 2], [3, 4]]}),
    ({"a": None, "b": True, "c": "x"}, {"c": "x", "b": True, "a": None}),
    (0.0, 0.0),
]
OTHER = [({"value": 19.87}, {"value": 19.89}), ({"value": 1e-12}, {"value": -1e-12}), ({"value": 1}, {"value": True})]
OTHER += [({"value": 1}, {"value": "1"}), ({"y": [1.0, 2.0]}, {"y": [1.0]}), ({"y": [1.0, 2.0]}, {"y": [2.0, 1.0]})]
OTHER += [({"a": 1}, {"b": 1}), ({"text": "yes"}, {"text": "no"}), (0.0, 1e-12)]


def test_two_answers_are_alike_or_not():
    for pairs, same in ((ALIKE, True), (OTHER, False)):
        assert [pair for pair in pairs if alike(*pair) is not same or alike(*reversed(pair)) is not same] == []


@pytest.mark.parametrize(("other", "same"), [(1.000099, True), (1.000102, False), (0.9999, True), (0.99989, False)])
def test_answers_are_alike_to_within_a_ten_thousandth(other, same):
    assert alike(1.0, other) == alike(-1.0, -other) == same
    assert alike([1.0, 1e-5], [1.0, 1e-5 + (other - 1.0)]) == same  # of the largest beside them
    assert alike({"a": 1.0, "b": 1e-5}, {"a": 1.0, "b": 1e-5 + (other - 1.0)}) is (abs(other - 1.0) <= 1e-9)
