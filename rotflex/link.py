"""How the link moves when the servo does, whatever drives the servo: its equation, and what fits it best.

    J_l (theta + alpha)'' + B_l alpha' + K_s alpha = 0

(the second equation of motion). Neither the motor nor the servo's friction has a part in it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotflex.units import DEG, HZ, Vector

NATURAL = (1.5 * HZ, 6.0 * HZ)  #: rad/s: no arm position and spring of the joint is outside
_DAMPING = 0.6  # 1/s, B_l/J_l; it says little of where the best frequency is
#: of the deflection, that is left over: at most 0.17 on logs of the joint, and 1.9 on one of a flexible link
OTHER_MECHANISM = 0.5
_SPACING = 0.05 * HZ  # of the first search
_STILL = 0.4 * DEG  # RMS of the deflection, below which it is counts and little else
_FEWEST = 200  # samples, to tell anything by
_SLOWEST = 0.0101  # s, between samples: beyond, what the servo did between two of them is not known well enough
_BRIDGED = 5  # lost samples: a hundredth of a second, in which the servo goes straight on


def can_be_judged(alpha: Vector, vm: Vector, dt: float) -> bool:
    """Return whether the arm moves enough, in enough samples that are close enough, and not at 0 V, as by a hand."""
    return alpha.size >= _FEWEST and dt <= _SLOWEST and float(np.std(alpha)) >= _STILL and bool(vm.any())


def residual(
    theta: ArrayLike,
    alpha: ArrayLike,
    dt: float,
    stiffness: float,
    damping: float,
    came: NDArray[np.bool_] | None = None,
) -> float:
    """RMS of what the link's equation leaves of the deflection, relative to the deflection's.

    The arm's angle theta + alpha is the servo's, through the link's two poles: nothing is differentiated. What the
    servo did while samples were lost is not known; the arm may swing freely by anything from then on.

    Parameters
    ----------
    theta, alpha : (n,) angles from rest on, rad
    dt : s
    stiffness, damping : K_s/J_l, 1/s², and B_l/J_l, 1/s
    came : (n,) which samples came, and were not bridged; all unless given
    """
    from scipy.signal import bilinear, lfilter

    servo, deflection = np.asarray(theta, dtype=float), np.asarray(alpha, dtype=float)
    numerator, denominator = bilinear([damping, stiffness], [1.0, damping, stiffness], 1 / dt)
    arm = lfilter(numerator, denominator, servo - servo[0]) + servo[0]
    whole = np.ones(servo.size, dtype=bool) if came is None else came
    left = (deflection - (arm - servo))[whole]
    swings = _free_swings(np.asarray(denominator), whole)[whole]
    if swings.size:
        left = left - swings @ np.linalg.lstsq(swings, left, rcond=None)[0]
    return float(np.std(left) / np.std(deflection[whole]))


def _free_swings(denominator: NDArray[np.float64], came: NDArray[np.bool_]) -> NDArray[np.float64]:
    """How the link swings by itself (samples, 2 a gap) after each gap of some length; short ones are bridged well."""
    from scipy.signal import lfilter

    edges = np.flatnonzero(np.diff(np.concatenate([[True], came, [True]]).astype(int)))
    begun = [end for first, end in zip(edges[::2], edges[1::2], strict=True) if end - first > _BRIDGED]
    starts = [start + later for start in begun for later in (0, 1) if start + later < came.size]
    impulses = np.zeros((came.size, len(starts)))
    impulses[starts, range(len(starts))] = 1.0
    swings: NDArray[np.float64] = lfilter([1.0], denominator, impulses, axis=0)
    return swings


def natural_frequency(theta: ArrayLike, alpha: ArrayLike, dt: float, damping: float = _DAMPING) -> tuple[float, float]:
    """Return the sqrt(K_s/J_l), rad/s, that fits best, and its residual.

    Parameters
    ----------
    theta, alpha, dt, damping : as for :func:`residual`
    """
    from scipy.optimize import minimize_scalar

    def residual_at(omega: float) -> float:
        return residual(theta, alpha, dt, omega**2, damping)

    nearest = float(min(np.arange(*NATURAL, _SPACING), key=residual_at))
    found = minimize_scalar(residual_at, bounds=(nearest - _SPACING, nearest + _SPACING), method="bounded")
    return float(found.x), float(found.fun)
