"""The cloud of poles, and the regulator that placed poles are compared with."""

import control
import numpy as np
import pytest

from rotflex.config import joint, srv02
from rotflex.errors import DesignError
from rotflex.model import state_space
from rotflex.units import DEG
from rotflex.widgets.cloud import BIN, COUNT, cloud, spread_of
from rotflex.widgets.optimal import lqr
from rotflex.widgets.placement import Dominant, design, with_gain

K_S = 1.4
ARM = joint(1)


def model(K_s):
    system = state_space(srv02(), ARM, K_s, input="voltage")
    return np.asarray(system.A), np.asarray(system.B)


A, B = model(K_S)
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


def test_without_uncertainty_the_cloud_is_the_design_and_without_a_spring_or_regulator_there_is_none():
    found = cloud(A, B, K, 0.0)
    assert found.share == 1
    assert np.ptp(found.poles.real, axis=0).max() < 1e-9
    with pytest.raises(DesignError, match="no spring"):
        spread_of(A * [1, 0, 1, 1])
    with pytest.raises(DesignError, match="no optimal gain"):
        lqr(A, 0 * B)


def test_the_regulator_is_that_of_the_notebook_by_python_control():
    direction, bent = np.array([[1, 1, 0, 0]]), np.array([[0, 1, 0, 0]])
    for error, deflection in ((40.0, 25.0), (15.0, 50.0)):
        Q = direction.T @ direction / (error * DEG) ** 2 + bent.T @ bent / (deflection * DEG) ** 2
        expected = control.lqr(A, B, Q, np.array([[1 / 10**2]]))[0]
        assert lqr(A, B, error, deflection) == pytest.approx(np.asarray(expected), rel=1e-6)
