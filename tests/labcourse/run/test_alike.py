"""When two stored answers say the same."""

import pytest

from labcourse.run.alike import alike

ALIKE = [
    ({"kind": "number", "value": 19.8765}, {"kind": "number", "value": 19.8766}),
    ({"y": [1e-12, 5.0, -3.0]}, {"y": [-1e-12, 5.0, -3.0]}),  # noise beside what is large
    ({"a": [[1, 2], [3, 4.0]]}, {"a": [[1, 2], [3, 4]]}),
    ({"a": None, "b": True, "c": "x"}, {"c": "x", "b": True, "a": None}),
]
OTHER = [({"value": 19.87}, {"value": 19.89}), ({"value": 1e-12}, {"value": -1e-12}), ({"value": 1}, {"value": True})]
OTHER += [({"value": 1}, {"value": "1"}), ({"y": [1.0, 2.0]}, {"y": [1.0]}), ({"y": [1.0, 2.0]}, {"y": [2.0, 1.0]})]
OTHER += [({"a": 1}, {"b": 1}), ({"text": "yes"}, {"text": "no"})]


def test_two_answers_are_alike_or_not():
    for pairs, same in ((ALIKE, True), (OTHER, False)):
        assert [pair for pair in pairs if alike(*pair) is not same or alike(*reversed(pair)) is not same] == []


@pytest.mark.parametrize(("other", "same"), [(1.000099, True), (1.000102, False), (0.9999, True), (0.99989, False)])
def test_answers_are_alike_to_within_a_ten_thousandth(other, same):
    assert alike(1.0, other) == alike(-1.0, -other) == same
    assert alike([1.0, 1e-5], [1.0, 1e-5 + (other - 1.0)]) == same  # of the largest beside them
    assert alike({"a": 1.0, "b": 1e-5}, {"a": 1.0, "b": 1e-5 + (other - 1.0)}) is (abs(other - 1.0) <= 1e-9)


def test_nought_is_like_nought_and_like_nothing_else():
    assert alike(0.0, 0.0) and alike([0, 0.0], [0.0, 0]) and alike({"a": 0}, {"a": 0.0})
    assert not alike(0.0, 1e-12)
