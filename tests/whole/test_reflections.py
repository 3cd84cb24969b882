"""``lab.reflect()`` on right answers of many benches: it asks nothing.

What it asks of single slips stands in ``test_single_slips.py``; of right ways of every kind, in ``test_right_ways.py``.
"""

import pytest
from reflections import NOTHING, asked_of, said_by
from right_ways import WAYS, worked

BENCHES = tuple(f"reflects-{number}" for number in range(4))


@pytest.mark.parametrize("name", BENCHES)
def test_right_answers_of_many_benches_are_asked_nothing(tmp_path, name):
    assert said_by(asked_of(name, worked(name, tmp_path)[1])) == NOTHING


def test_a_response_that_leaves_its_band_by_a_count_between_two_kept_points_is_asked_nothing(tmp_path):
    (way,) = [way for way in WAYS if str(way) == "rounding: 3.7 T to three digits"]
    assert said_by(asked_of("measure-2859", worked("measure-2859", tmp_path, way)[1])) == NOTHING
