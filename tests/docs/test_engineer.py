"""The engineer's script in the documentation, by the laboratory and python-control alone."""

import runpy

import control
import matplotlib.pyplot as plt
import numpy as np
import pytest
from checkout import ROOT
from scipy.linalg import solve_continuous_are

from rotflex import response
from rotflex.hil.student_benches import student_bench

SCRIPT = ROOT / "docs" / "examples" / "engineer.py"


def test_lqr_observer_sweep_and_margins(monkeypatch, capsys):
    summaries, worst = [], response.worst
    monkeypatch.setattr(plt, "show", lambda: None)
    monkeypatch.setattr(response, "worst", lambda steps: summaries.append(worst(steps)) or summaries[-1])
    made = runpy.run_path(str(SCRIPT))
    plant, sampled, K, L, measured = (made[name] for name in ("plant", "sampled", "K", "L", "measured"))
    # The gain solves Riccati's equation; the observer is stable.
    P = solve_continuous_are(plant.A, plant.B, np.diag([400, 400, 1, 1]), [[1]])
    np.testing.assert_allclose(K, plant.B.T @ P, rtol=1e-6)
    assert np.abs(np.linalg.eigvals(sampled.A - sampled.A @ L @ sampled.C[:1])).max() < 1
    # Both follow the command on the bench.
    assert len(summaries) == 2
    assert all(one.settling_time < 0.5 and one.overshoot < 10 and one.max_vm <= 10 for one in summaries)
    # The stiffness is the bench's, and the sweep lies on the model, but at the peak, where friction damps it.
    true = student_bench(7).parameters
    assert made["K_s"] == pytest.approx(true.K_s * made["bench"].joint.J_l / true.J_l, rel=0.05)
    omega_n = np.sqrt(true.K_s / true.J_l)
    for below, above in ((0.6, 0.9), (1.1, 1.25)):
        beside = (measured.omega > below * omega_n) & (measured.omega < above * omega_n)
        link = 1 / (omega_n**2 / measured.omega[beside] ** 2 - 1)
        np.testing.assert_allclose(np.abs(measured.frdata[0, 0, beside] / link), 1, atol=0.25)
    # An LQR's margins are known beforehand: any larger gain, and at least 60 deg.
    gain, phase, *_at = control.margin(control.ss(plant.A, plant.B, K, 0))
    assert gain == np.inf and phase >= 60
    assert f"{phase:.6f}"[:7] in capsys.readouterr().out
    plt.close("all")
