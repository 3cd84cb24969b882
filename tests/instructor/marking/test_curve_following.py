"""From where a curve's time is counted, found by where it follows."""

from __future__ import annotations

import numpy as np
import pytest

from rotflex.instructor.marking.curve_following import Trace

STEP = 0.1  # s
TIME = STEP * np.arange(200)


def channel(time):
    return np.sin(1.7 * time) + 0.5 * np.cos(4.1 * time)


@pytest.mark.parametrize("part", [0.0, 0.49, 0.51])
def test_a_time_at_a_sample_or_half_way_to_the_next_is_found(part):
    """From whichever of two samples is the nearer."""
    start = (40 + part) * STEP
    curve = STEP * np.arange(60)
    found = Trace(TIME, channel(TIME)).best_shift(curve, channel(curve + start))
    assert abs(found - start) <= 0.02 * STEP
