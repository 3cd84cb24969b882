"""The link's equation, against an independent solution of it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from rotflex import link

DT = 0.002
T = np.arange(0, 4.0, DT)


def deflection(stiffness: float, damping: float) -> tuple[np.ndarray, np.ndarray]:
    """theta of a servo that is shaken, and alpha of the link on it."""

    def shaken(t: float | np.ndarray) -> np.ndarray:
        return 0.1 * np.sin(9 * t) ** 2 * np.sin(14 * t)

    def moved(t: float, state: np.ndarray) -> list[float]:
        arm, rate = state
        alpha = arm - shaken(t)
        alpha_dot = rate - (shaken(t + 1e-6) - shaken(t - 1e-6)) / 2e-6
        return [rate, -stiffness * alpha - damping * alpha_dot]

    arm = solve_ivp(moved, (0, T[-1]), [0, 0], t_eval=T, rtol=1e-9, atol=1e-12).y[0]
    return shaken(T), arm - shaken(T)


@settings(max_examples=10, deadline=None)
@given(omega=st.floats(12, 36), damping=st.floats(0.2, 2.0))
def test_the_natural_frequency_is_found_whatever_drives_the_servo(omega, damping):
    theta, alpha = deflection(omega**2, damping)
    assert link.residual(theta, alpha, DT, omega**2, damping) < 0.03
    found, left = link.natural_frequency(theta, alpha, DT, damping, (10.0, 38.0), 0.3)
    assert found == pytest.approx(omega, rel=2e-3)
    assert left < 0.03
    assert link.natural_frequency(theta, -alpha, DT, damping, (10.0, 38.0), 0.3)[1] > 0.5
