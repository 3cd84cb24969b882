"""Pole placement for the explorer: against python-control, scipy, and the workbook's printed results."""

import control
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rotflex import response, simulation
from rotflex.config import joint, srv02
from rotflex.errors import DesignError
from rotflex.model import state_space
from rotflex.signals import smooth_square_wave, time_axis
from rotflex.units import DEG
from rotflex.widgets.placement import Dominant, design, reference, with_gain
from rotflex.widgets.region import Region

SYSTEM = state_space(srv02(), joint(1), 1.4, input="voltage")
A, B = np.asarray(SYSTEM.A), np.asarray(SYSTEM.B)


def poles_of(K, feedback="full"):
    return np.sort_complex(np.linalg.eigvals(A - B @ (K * ([1, 0, 1, 0] if feedback == "partial" else 1))))


def test_the_workbooks_poles_give_the_workbooks_gain_and_others_that_of_another_algorithm():
    found = design(A, B, Dominant().poles)
    assert found.K[0] == pytest.approx([18.2356, -17.1546, 1.5893, 0.6327], abs=2e-4)
    assert found.polynomial == pytest.approx([1, 94, 3280, 56800, 480000])
    assert [finding.met for finding in found.findings] == [True] * 4
    wanted = Dominant(0.7, 25.0, -33.0, -51.0).poles
    assert pytest.approx(np.asarray(control.place(A, B, wanted)), rel=1e-6) == design(A, B, wanted).K


def test_what_is_measured_is_what_a_whole_square_wave_gives():
    found = design(A, B, Dominant().poles)
    wave = smooth_square_wave(time_axis(6.2, 0.002), 0.33, 20 * DEG, 100)
    whole = simulation.closed_loop(A, B, found.K, wave, saturation=None)
    expected = response.verdict(response.worst(response.measure(whole)))
    for ours, theirs in zip(found.findings, expected, strict=True):
        assert ours.value == pytest.approx(theirs.value, rel=1e-6)


@settings(max_examples=40)
@given(
    st.floats(0.1, 0.99), st.floats(5, 40), st.floats(-80, -2), st.floats(-80, -2)
)  # the explorer's whole range, equal poles included
def test_placement_really_places(zeta, omega_n, p3, p4):
    wanted = Dominant(zeta, omega_n, p3, p4)
    found = design(A, B, wanted.poles)
    assert np.poly(found.poles) == pytest.approx(np.poly(wanted.poles), rel=1e-6)
    assert np.real(found.polynomial) == pytest.approx(np.real(np.poly(wanted.poles)))


def test_the_response_is_the_exact_solution():
    from scipy.integrate import solve_ivp

    K = design(A, B, Dominant().poles).K
    found = design(A, B, Dominant().poles).recording
    t, command = reference()
    state = np.array([-20 * DEG, 0, 0, 0])
    for index in range(0, 120):  # the step and the first moments after it, sample by sample
        assert found["theta"][index] == pytest.approx(state[0], abs=1e-9)
        assert found["alpha"][index] == pytest.approx(state[1], abs=1e-9)
        pull = (B * K[0, 0]).ravel() * command[index]
        solved = solve_ivp(lambda _, x, pull=pull: (A - B @ K) @ x + pull, (0, 0.002), state, rtol=1e-11, atol=1e-13)
        state = solved.y[:, -1]
    assert t[0] == pytest.approx(-0.06) and command[0] == pytest.approx(-20 * DEG)


def test_partial_feedback_gives_other_poles_and_a_given_gain_is_taken_as_it_is():
    found = design(A, B, Dominant().poles, "partial")
    assert np.sort_complex(found.poles) == pytest.approx(poles_of(found.K, "partial"))
    assert np.abs(np.sort_complex(found.poles) - np.sort_complex(found.wanted)).max() > 1
    assert found.recording is not None
    K = np.array([[18.2, -17.2, 1.59, 0.633]])
    given_gain = with_gain(A, B, K)
    assert pytest.approx(K) == given_gain.K
    assert np.sort_complex(given_gain.poles) == pytest.approx(poles_of(K))
    unstable = with_gain(A, B, [-5, 0, 0, 0])
    assert unstable.recording is None and not unstable.findings and "unstable" in unstable.trouble


@pytest.mark.parametrize(
    ("a", "b", "poles", "word"),
    [
        (np.eye(3), B, Dominant().poles, "4 by 4"),
        (A, B[:3], Dominant().poles, "4 by 1"),
        (A * np.nan, B, Dominant().poles, "finite"),
        (A, B, [-1, -2, -3], "Four poles"),
        (A, B, [-1 + 1j, -2, -3, -4], "conjugate"),
        (A, 0 * B, Dominant().poles, "cannot be placed"),
        ("A", B, Dominant().poles, "arrays of numbers"),
    ],
)
def test_what_cannot_be_designed_is_said(a, b, poles, word):
    with pytest.raises(DesignError, match=word):
        design(a, b, poles)


@pytest.mark.parametrize("feedback", ["full", "partial"])
def test_the_region_agrees_with_the_designs_in_it(feedback):
    region = Region(A, B)
    excess = region.excess(-30, -40, feedback)
    rng = np.random.default_rng(5)
    rows, columns = rng.integers(region.zeta.shape[0], size=60), rng.integers(region.zeta.shape[1], size=60)
    for row, column in zip(rows, columns, strict=True):
        if abs(excess[row, column]) < 0.02:  # on the border, its coarser samples decide
            continue
        one = design(A, B, Dominant(region.zeta[row, column], region.omega[row, column]).poles, feedback)
        met = bool(one.findings) and all(finding.met for finding in one.findings)
        assert met == (excess[row, column] < 0)


def test_the_regions_outline_holds_the_workbooks_pair_and_not_a_slow_one():
    from matplotlib.path import Path

    curves = [Path(np.column_stack(curve)) for curve in Region(A, B).outline(-30, -40)]
    assert curves
    pair, slow = Dominant().pair, Dominant(0.6, 7.0).pair
    assert any(curve.contains_point((pair.real, pair.imag)) for curve in curves)
    assert not any(curve.contains_point((slow.real, slow.imag)) for curve in curves)
