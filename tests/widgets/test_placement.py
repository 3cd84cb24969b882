"""Designs without a page: against python-control, scipy, and the workbook's printed results.

Placement, the region in which specifications are met, runaways, the cloud of an uncertain stiffness.
"""

import control
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from rotflex.config import joint, srv02
from rotflex.errors import DesignError
from rotflex.hil.bench import Limits
from rotflex.model import state_space
from rotflex.widgets.placement import (
    BIN,
    COUNT,
    HORIZON,
    STEP,
    Dominant,
    Region,
    _ackermann,
    cloud,
    design,
    spread_of,
    with_gain,
)

K_S, ARM = 1.4, joint(1)


def model(K_s):
    system = state_space(srv02(), ARM, K_s, input="voltage")
    return np.asarray(system.A), np.asarray(system.B)


A, B = model(K_S)


def poles_of(K, feedback="full"):
    return np.sort_complex(np.linalg.eigvals(A - B @ (K * ([1, 0, 1, 0] if feedback == "partial" else 1))))


def test_the_workbooks_poles_give_the_workbooks_gain_and_others_that_of_another_algorithm():
    found = design(A, B, Dominant().poles)
    assert found.K[0] == pytest.approx([18.2356, -17.1546, 1.5893, 0.6327], abs=2e-4)
    assert found.polynomial == pytest.approx([1, 94, 3280, 56800, 480000])
    assert [finding.met for finding in found.findings] == [True] * 4
    wanted = Dominant(0.7, 25.0, -33.0, -51.0).poles
    assert pytest.approx(np.asarray(control.place(A, B, wanted)), rel=1e-6) == design(A, B, wanted).K


@settings(max_examples=40)
@given(
    st.floats(0.1, 0.99), st.floats(5, 40), st.floats(-80, -2), st.floats(-80, -2)
)  # the explorer's whole range, equal poles included
def test_placement_really_places(zeta, omega_n, p3, p4):
    wanted = Dominant(zeta, omega_n, p3, p4)
    found = design(A, B, wanted.poles)
    assert np.poly(found.poles) == pytest.approx(np.poly(wanted.poles), rel=1e-6)
    assert np.real(found.polynomial) == pytest.approx(np.real(np.poly(wanted.poles)))


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
        (np.eye(3), B, Dominant().poles, r"\(4, 4\)"),
        (A, B[:3], Dominant().poles, r"\(4, 1\)"),
        (A, B, [-1, -2, -3], "Four poles"),
        (A, B, [-1 + 1j, -2, -3, -4], "conjugate"),
        (A, 0 * B, Dominant().poles, "cannot be placed"),
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


K = design(A, B, Dominant().poles).K


def test_the_uncertainty_of_the_stiffness_is_that_of_notebook_04():
    """By drawing: each within its limits, all equally likely."""
    draw = np.random.default_rng(3)
    f = np.sqrt(K_S / ARM.J_l) / (2 * np.pi)
    assert round(BIN, 3) == 0.061  # as the notebooks say
    read, loop, inertia = (1 + draw.uniform(-w, w, 200_000) for w in (0.061 / 2 / f, 0.03, 0.01))
    assert spread_of(A) == pytest.approx(np.std(inertia * (read * loop) ** 2), rel=0.02)


def test_the_cloud_is_the_poles_on_models_of_other_stiffnesses():
    found = cloud(A, B, K, 0.08)
    assert found.poles.shape == (COUNT, 4)
    assert np.median(found.factors) == pytest.approx(1) and np.std(found.factors) == pytest.approx(0.08, rel=0.05)
    for factor, poles in zip(found.factors, found.poles, strict=True):
        a, b = model(K_S * factor)
        assert np.sort_complex(poles) == pytest.approx(np.sort_complex(np.linalg.eigvals(a - b @ K)), rel=1e-6)


def test_the_share_is_of_models_on_which_all_four_are_met():
    gain = design(A, B, Dominant(0.6, 17.0).poles).K
    found = cloud(A, B, gain, 0.15)
    met = []
    for factor in found.factors:
        findings = with_gain(*model(K_S * factor), gain).findings
        met.append(bool(findings) and all(one.met for one in findings))
    assert 0.1 < np.mean(met) < 0.9  # else this would show little
    assert found.share == pytest.approx(np.mean(met), abs=1.5 / COUNT)  # on the border, its coarser samples decide


def test_without_uncertainty_the_cloud_is_the_design_and_without_a_spring_there_is_none():
    found = cloud(A, B, K, 0.0)
    assert found.share == 1
    assert np.ptp(found.poles.real, axis=0).max() < 1e-9
    with pytest.raises(DesignError, match="no spring"):
        spread_of(A * [1, 0, 1, 1])


def unstable(growth, imaginary=16.0):
    size = np.hypot(growth, imaginary)
    return design(A, B, Dominant(-growth / size, size).poles)


@pytest.mark.parametrize("growth", [1.5, 6.0])
def test_it_swings_up_to_a_limit_and_is_stopped_there(growth):
    found = unstable(growth)
    runaway = found.runaway
    assert found.recording is None and not found.findings
    assert runaway.growth == pytest.approx(growth, rel=1e-6)
    recording, limits = runaway.recording, Limits()
    before = recording.time < runaway.stopped
    reached = np.maximum(np.abs(recording["theta"]) / limits.theta, np.abs(recording["alpha"]) / limits.alpha)
    assert (reached[before] <= 1).all() and reached[~before][0] > 1
    assert (recording["vm"][~before] == 0).all() and np.abs(recording["vm"][before]).max() > 0
    swings = np.abs(recording["alpha"][before])
    halves = [half.max() for half in np.array_split(swings, 3)]
    assert halves == sorted(halves)  # each larger than the one before
    where, grows, end = runaway.sentences
    assert f"+{growth:.2g} rad/s" in where and f"{np.log(2) / growth:.2g} s" in grows
    assert f"after {runaway.stopped:.2f} s" in end and "the safety stops it at 0 V" in end
    assert found.trouble == " ".join(runaway.sentences)


def test_until_the_stop_it_is_the_exact_solution_and_after_it_the_arm_is_free():
    found = unstable(6.0)
    recording, dt = found.runaway.recording, 0.002
    K = found.K
    state = np.array([-STEP / 2, 0, 0, 0])
    stopped = int(np.argmax(recording.time >= found.runaway.stopped))
    for k in range(recording.time.size - 1):
        assert (recording["theta"][k], recording["alpha"][k]) == pytest.approx((state[0], state[1]), abs=1e-7)
        pull = (B * K[0, 0]).ravel() * recording["theta_ref"][k] if k < stopped else np.zeros(4)
        loop = A - B @ K if k < stopped else A
        solved = solve_ivp(lambda _, x, m=loop, p=pull: m @ x + p, (0, dt), state, rtol=1e-10, atol=1e-13)
        state = solved.y[:, -1]


def test_a_pole_on_the_border_swings_on():
    found = design(A, B, Dominant(0.0).poles)
    assert found.recording is None
    assert "border of stability" in found.trouble and "no limit of the bench" in found.trouble
    assert found.runaway.stopped is None
    assert found.runaway.recording.time[-1] == pytest.approx(HORIZON)
    alpha = np.abs(found.runaway.recording["alpha"])
    assert alpha[-500:].max() == pytest.approx(alpha[500:1000].max(), rel=0.05)


def test_a_gain_is_that_of_the_library_for_any_bench_and_poles():
    """Each entry, with condition numbers up to 1e10 of the matrix that is inverted; benches have them below 1e7."""
    draw = np.random.default_rng(5)
    for _ in range(1000):
        a, b = (matrix * draw.uniform(0.5, 2.0, matrix.shape) for matrix in (A, B))
        wanted = Dominant(draw.uniform(-1, 3), draw.uniform(5, 40), *draw.uniform(-80, 10, 2)).poles
        gain = np.real(np.poly(wanted)) @ _ackermann(a, b)
        np.testing.assert_allclose(gain, np.ravel(control.acker(a, b, wanted)), rtol=1e-9)
