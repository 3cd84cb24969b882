"""The helper that makes runs once gives what running again gives."""

from __future__ import annotations

import numpy as np
import pytest
from remembered import remembered

from rotflex import experiments, hil

GAIN = [18.24, -17.15, 1.59, 0.63]


def tracked(seed, gain=GAIN, before=0, duration=2.0, run=1):
    with hil.open("virtual", seed=seed, run=run) as bench:
        for _time in range(before):
            experiments.tracking(bench, GAIN, duration=1.0, progress=False)
        return experiments.tracking(bench, gain, duration=duration, progress=False)


def same(one, other):
    return one.metadata == other.metadata and all(np.array_equal(one[name], other[name]) for name in one.channels)


@pytest.mark.parametrize("before", [0, 1, 2])
def test_what_is_remembered_is_what_running_again_gives(before):
    real = tracked(3, before=before)
    with remembered() as kept:
        first, second = tracked(3, before=before), tracked(3, before=before)
        assert same(first, real) and same(second, real)
        assert len(kept) == 1


def test_another_bench_gain_duration_or_run_is_another_run():
    with remembered() as kept:
        found = [
            tracked(3),
            tracked(4),
            tracked(3, [10.0, -9.0, 1.0, 0.4]),
            tracked(3, duration=3.0),
            tracked(3, run=2),
        ]
        assert len(kept) == len(found)
        assert not any(same(one, other) for one in found for other in found if one is not other)


def test_afterwards_everything_is_as_before():
    real = experiments._run
    with remembered():
        assert experiments._run is not real
    assert experiments._run is real
