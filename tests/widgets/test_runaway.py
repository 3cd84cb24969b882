"""What an unstable loop does: it swings up, meets a limit of the bench, and is stopped."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from rotflex.config import joint, srv02
from rotflex.hil.bench import Limits
from rotflex.model import state_space
from rotflex.units import DEG
from rotflex.widgets.placement import Dominant, design, with_gain
from rotflex.widgets.runaway import LONGEST, STEP

SYSTEM = state_space(srv02(), joint(1), 1.4, input="voltage")
A, B = np.asarray(SYSTEM.A), np.asarray(SYSTEM.B)


def unstable(growth, imaginary=16.0):
    size = np.hypot(growth, imaginary)
    return design(A, B, Dominant(-growth / size, size).poles)


@pytest.mark.parametrize("growth", [1.5, 2.0, 6.0])
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
    assert found.runaway.recording.time[-1] == pytest.approx(LONGEST)
    alpha = np.abs(found.runaway.recording["alpha"])
    assert alpha[-500:].max() == pytest.approx(alpha[500:1000].max(), rel=0.05)


def test_how_soon_it_is_stopped_and_by_which_limit_depends_on_the_poles():
    times = [unstable(growth).runaway.stopped for growth in (1.5, 2.0, 4.0, 8.0)]
    assert times == sorted(times, reverse=True)
    slow = unstable(0.05)
    assert slow.runaway.stopped is None and "unstable" in slow.trouble
    assert f"{Limits().theta / DEG:.0f} deg" in design(A, B, Dominant(p3=5.0).poles).trouble  # a real pole: the servo's
    found = with_gain(A, B, [18.2, -17.2, -3.0, 0.6], "partial")
    growth = np.linalg.eigvals(A - B @ [[18.2, 0, -3.0, 0]]).real.max()
    assert found.runaway.growth == pytest.approx(growth)
