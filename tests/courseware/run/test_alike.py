"""When two stored answers say the same."""

import pytest

from rotflex.courseware.run.alike import alike


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ({"kind": "number", "value": 19.8765}, {"kind": "number", "value": 19.8766}),
        ({"y": [1e-12, 5.0, -3.0]}, {"y": [-1e-12, 5.0, -3.0]}),  # noise beside what is large
        ({"a": [[1, 2], [3, 4.0]]}, {"a": [[1, 2], [3, 4]]}),
        ({"a": None, "b": True, "c": "x"}, {"c": "x", "b": True, "a": None}),
    ],
)
def test_alike(one, other):
    assert alike(one, other) and alike(other, one)


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ({"value": 19.87}, {"value": 19.89}),
        ({"value": 1e-12}, {"value": -1e-12}),
        ({"value": 1}, {"value": True}),
        ({"value": 1}, {"value": "1"}),
        ({"y": [1.0, 2.0]}, {"y": [1.0]}),
        ({"y": [1.0, 2.0]}, {"y": [2.0, 1.0]}),
        ({"a": 1}, {"b": 1}),
        ({"text": "yes"}, {"text": "no"}),
    ],
)
def test_not_alike(one, other):
    assert not alike(one, other) and not alike(other, one)
