"""A student's bench as it really is, whichever the course gives them."""

from __future__ import annotations

import numpy as np
import pytest

from rotflex import identification
from rotflex.courseware.benches import BenchPolicy
from rotflex.hil.student_benches import DRAW, preset, student_bench, student_seed
from solutions.true_bench import TrueBench


def test_their_own_is_drawn_from_their_id():
    drawn = student_bench(student_seed("ada"))
    bench = TrueBench("ada")
    assert (bench.K_s, bench.joint) == (drawn.parameters.K_s, drawn.joint)


def test_the_same_for_all_is_drawn_from_the_seed():
    policy = BenchPolicy("same", seed=7, draw=DRAW)
    ada, grace = TrueBench("ada", policy), TrueBench("grace", policy)
    assert ada.K_s == grace.K_s == student_bench(7).parameters.K_s
    assert ada.joint == grace.joint == student_bench(7).joint
    np.testing.assert_array_equal(ada.sweep()["alpha"], grace.sweep()["alpha"])


@pytest.mark.parametrize("name", ["workbook", "real_bench"])
def test_a_preset_has_the_natural_frequency_that_a_sweep_of_it_shows(name):
    bench = TrueBench("ada", BenchPolicy("preset", preset=name))
    true = preset(name).parameters
    assert bench.omega_n == pytest.approx(np.sqrt(true.K_s / true.J_l))
    seen = identification.resonance(identification.frequency_response(bench.sweep()))
    assert seen.value == pytest.approx(bench.omega_n, rel=0.05)
