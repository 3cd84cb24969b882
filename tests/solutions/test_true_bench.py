"""A student's bench as it really is, whichever the course gives them."""

import numpy as np
import pytest

from labcourse.benches import BenchPolicy
from rotflex import experiments, hil, identification
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


@pytest.fixture(scope="module")
def ada():
    return TrueBench("ada")


def test_a_run_is_what_the_students_bench_does_with_its_number(ada):
    seed = student_seed("ada")
    with hil.open("virtual", seed=seed, run=2) as opened:
        recorded = experiments.sweep(opened, progress=False)
    np.testing.assert_array_equal(ada.sweep(2)["alpha"], recorded["alpha"])
    assert not np.array_equal(ada.sweep()["alpha"], recorded["alpha"])
    assert ada.sweep(2) is ada.sweep(2)  # run once


def test_tracking_and_validation_have_runs_as_well(ada):
    K, A = (18.0, -17.0, 1.6, 0.6), np.diag([0.0, 0.0, -10.0, -10.0])
    A[:2, 2:] = np.eye(2)
    B = np.array([0.0, 0.0, 60.0, -60.0])
    first, second = ada.tracking(K, "full"), ada.tracking(K, "full", run=2)
    assert not np.array_equal(first["theta"], second["theta"])
    assert ada.tracking(K, "full", run=2) is second and ada.tracking(K, "full", 1) is first
    runs = [ada.validation(A, B, "square", run=run)["theta"] for run in (1, 2, 1)]
    assert not np.array_equal(runs[0], runs[1])
    np.testing.assert_array_equal(runs[0], runs[2])


def test_what_answers_say_of_their_bench_holds_whatever_their_run_is(ada):
    """An address may name a run: answers from it are from the same bench."""
    said = hil.open("virtual:?run=5", seed=student_seed("ada")).identity
    assert ada.identity.items() <= {**said, "uri": "virtual"}.items()
    assert "run" not in ada.identity and ada.identity["draw"] == DRAW
