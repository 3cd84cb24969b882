"""Whether a recording can be one of a bench: honest ones all can, and which forged ones are found.

The link's equation is held against an independent solution of it.
"""

from dataclasses import replace

import numpy as np
import pytest
from forged import ANOTHER, FORGED, GAIN, OURS, limited, recorded
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from rotflex import experiments, hil, link
from rotflex.config import srv02
from rotflex.course import plausible
from rotflex.hil.controllers import StateFeedback
from rotflex.hil.student_benches import REAL_BENCH, student_bench
from rotflex.recording import Recording


@pytest.fixture(scope="module")
def made():
    return recorded(OURS), recorded(ANOTHER)


def doubts(recording, spec=OURS):
    return plausible.doubts(recording, srv02(), spec.parameters)


def test_no_honest_recording_is_doubted(made):
    for recordings, spec in zip(made, (OURS, ANOTHER), strict=True):
        for name, one in recordings.items():
            assert doubts(one, spec) == [], name


def test_the_log_of_a_real_bench_is_not_doubted(real_log):
    metadata = {"experiment": "tracking", "feedback": "full", "K": [13.0384, -17.2586, 1.3198, -0.0461]}
    log = Recording(real_log.time, real_log.channels, metadata)
    assert doubts(log, REAL_BENCH) == []
    assert plausible.voltage_misfit(log, srv02()) < 5e-4
    assert 0 < plausible.link_misfit(log, REAL_BENCH.parameters) < 0.16


@pytest.mark.parametrize("what", FORGED)
def test_what_is_found_of_forged_recordings(made, what):
    forge, is_found = FORGED[what]
    assert bool(found := doubts(forge(*made))) is is_found, found


def test_what_a_bench_cut_to_its_own_limit_is_not_doubted_and_without_the_limit_it_is(made):
    """And a limit that is no number, or none at all, is as if none were told."""
    with hil.open("virtual", plant=OURS) as bench:
        bench.safety.limits = replace(bench.safety.limits, voltage=6.0)
        cut = experiments.tracking(bench, GAIN, progress=False)
    assert abs(cut["vm"]).max() == 6.0
    assert doubts(limited(cut, 6.0)) == []
    for other in (cut, limited(cut, 7.0), limited(cut, 5.0), limited(cut, "6")):
        assert any("beside what its controller sets" in doubt for doubt in doubts(other))
    for nothing in (None, -1.0, 0, True, [6.0], float("nan")):
        assert doubts(limited(made[0]["tracking"], nothing)) == []


def test_a_recording_that_names_no_controller_is_not_compared_with_one(made):
    tracked = made[0]["tracking"]
    for metadata in ({}, {"experiment": "tracking", "K": "x"}, {"experiment": "tracking", "K": [1, 2, 3, 4]}):
        one = Recording(tracked.time, tracked.channels, metadata)
        assert plausible.voltage_misfit(one, srv02()) == 0.0


DT = 0.002
T = np.arange(0, 4.0, DT)


def deflection(stiffness, damping):
    """theta of a servo that is shaken, and alpha of the link on it."""

    def shaken(t):
        return 0.1 * np.sin(9 * t) ** 2 * np.sin(14 * t)

    def moved(t, state):
        arm, rate = state
        alpha = arm - shaken(t)
        alpha_dot = rate - (shaken(t + 1e-6) - shaken(t - 1e-6)) / 2e-6
        return [rate, -stiffness * alpha - damping * alpha_dot]

    arm = solve_ivp(moved, (0, T[-1]), [0, 0], t_eval=T, rtol=1e-9, atol=1e-12).y[0]
    return shaken(T), arm - shaken(T)


@settings(max_examples=5, deadline=None)
@given(omega=st.floats(12, 36), damping=st.floats(0.2, 2.0))
def test_the_natural_frequency_is_found_whatever_drives_the_servo(omega, damping):
    theta, alpha = deflection(omega**2, damping)
    assert link.residual(theta, alpha, DT, omega**2, damping) < 0.03
    found, left = link.natural_frequency(theta, alpha, DT, damping)
    assert found == pytest.approx(omega, rel=2e-3)
    assert left < 0.03
    assert link.natural_frequency(theta, -alpha, DT, damping)[1] > 0.5


@pytest.mark.parametrize("sample_time", [0.01, 0.03])
def test_an_honest_run_with_samples_far_apart_is_not_doubted(sample_time):
    controller = StateFeedback([8.0, 0.0, 0.5, 0.0], sample_time=sample_time, cutoff=0.5 / sample_time)
    command = 0.4 * np.sign(np.sin(np.arange(round(10 / sample_time)) * sample_time * 2))
    with hil.open("virtual:?seed=3") as bench:
        run = experiments.follow(bench, controller, command, sample_time, progress=False)
    assert np.std(run["alpha"]) > 0.02
    assert doubts(run, student_bench(3)) == []
