"""How the link moves when the servo does, whatever drives the servo: its equation, and what fits it best.

    J_l (theta + alpha)'' + B_l alpha' + K_s alpha = 0

(the second equation of motion). Neither the motor nor the servo's friction has a part in it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike


def residual(theta: ArrayLike, alpha: ArrayLike, dt: float, stiffness: float, damping: float) -> float:
    """RMS of what the link's equation leaves of the deflection, relative to the deflection's.

    The arm's angle theta + alpha is the servo's, through the link's two poles: nothing is differentiated.

    Parameters
    ----------
    theta, alpha : (n,) angles from rest on, rad
    dt : s
    stiffness, damping : K_s/J_l, 1/s², and B_l/J_l, 1/s
    """
    from scipy.signal import bilinear, lfilter

    servo, deflection = np.asarray(theta, dtype=float), np.asarray(alpha, dtype=float)
    numerator, denominator = bilinear([damping, stiffness], [1.0, damping, stiffness], 1 / dt)
    arm = lfilter(numerator, denominator, servo - servo[0]) + servo[0]
    return float(np.std(deflection - (arm - servo)) / np.std(deflection))


def natural_frequency(
    theta: ArrayLike, alpha: ArrayLike, dt: float, damping: float, within: tuple[float, float], spacing: float
) -> tuple[float, float]:
    """The sqrt(K_s/J_l), rad/s, that fits best, and the residual that it leaves.

    Parameters
    ----------
    theta, alpha, dt, damping : as above
    within, spacing : where it is looked for, and how closely at first, rad/s
    """
    from scipy.optimize import minimize_scalar

    def left(omega: float) -> float:
        return residual(theta, alpha, dt, omega**2, damping)

    nearest = float(min(np.arange(*within, spacing), key=left))
    found = minimize_scalar(left, bounds=(nearest - spacing, nearest + spacing), method="bounded")
    return float(found.x), float(found.fun)
