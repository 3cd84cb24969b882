"""Where the dominant pair may lie so that all four specifications are met: many designs, simulated at once."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import expm

from rotflex.specifications import AMPLITUDE, LIMITS, RATE, SAMPLE_TIME, SETTLING_BAND
from rotflex.widgets.placement import matrices

Vector = NDArray[np.float64]

_PHASES = ((0.002, 0.12), (0.01, 1.0))  # s, sample time and end: fine enough for the peak of the voltage, then coarse
_GRID = (24, 22)  # damping ratios and natural frequencies tried


class Region:
    """Where the dominant pair may lie so that all four specifications are met, the real poles being where they are.

    Many designs at once, at a coarse sample time: quick enough to follow a pole that is dragged.

    Parameters
    ----------
    A, B : as in :func:`design`
    """

    def __init__(self, A: ArrayLike, B: ArrayLike) -> None:
        self._a, self._b = matrices(A, B)
        powers = [np.linalg.matrix_power(self._a, n) for n in range(5)]
        reach = np.hstack([power @ self._b for power in powers[:4]])
        last = np.linalg.solve(reach.T, np.array([0.0, 0.0, 0.0, 1.0]))
        # K is the coefficients of the desired polynomial times these (Ackermann's formula).
        self._rows = np.array([last @ power for power in powers[::-1]])
        zeta, omega = np.meshgrid(np.linspace(0.2, 0.99, _GRID[0]), np.linspace(6.0, 40.0, _GRID[1]))
        self.zeta, self.omega = zeta, omega

    def excess(self, p3: float, p4: float, feedback: str = "full") -> Vector:
        """How far the worst specification is exceeded, as a fraction of its limit: negative where all are met.

        Returns
        -------
        (m, n) array over ``omega`` and ``zeta``
        """
        zeta, omega = self.zeta.ravel(), self.omega.ravel()
        fast = np.poly([p3, p4])
        pairs = np.stack([np.ones_like(zeta), 2 * zeta * omega, omega**2], axis=1)
        polynomials = np.zeros((zeta.size, 5))
        for shift, coefficient in enumerate(fast):
            polynomials[:, shift : shift + 3] += coefficient * pairs
        gains = polynomials @ self._rows
        applied = gains * [1, 0, 1, 0] if feedback == "partial" else gains
        return excess_of(self._a, self._b, applied).reshape(self.zeta.shape)

    def outline(self, p3: float, p4: float, feedback: str = "full") -> list[tuple[Vector, Vector]]:
        """The region's borders in the s-plane, upper half: closed curves (real part, imaginary part), rad/s."""
        import contourpy

        real = -self.zeta * self.omega
        imaginary = self.omega * np.sqrt(1 - self.zeta**2)
        excess = np.clip(self.excess(p3, p4, feedback), -1.0, 1.0)
        lines: Any = contourpy.contour_generator(real, imaginary, excess, fill_type=contourpy.FillType.OuterCode)
        curves, _ = lines.filled(-2.0, 0.0)
        return [(np.array(curve[:, 0]), np.array(curve[:, 1])) for curve in curves]


def excess_of(a: Vector, b: Vector, gains: Vector) -> Vector:
    """The worst of the four specifications, exceeded by this fraction (n,), for gains (n, 4).

    Parameters
    ----------
    a, b : (4, 4), or one for each gain (n, 4, 4), and (4, 1)
    gains : that are fed back, V/rad and V/(rad/s)
    """
    n = len(gains)
    M = np.zeros((n, 5, 5))
    M[:, :4, :4] = a - b[None] * gains[:, None, :]
    M[:, :4, 4] = b[:, 0] * gains[:, :1]
    phases = [(dt, expm(M * dt), round((until - since) / dt)) for dt, until, since in _phases()]
    steps = [(dt, transition) for dt, transition, count in phases for _ in range(count)]
    t = np.cumsum([0.0, *(dt for dt, _ in steps)])
    theta_ref = np.minimum(AMPLITUDE * (RATE * (t + SAMPLE_TIME) - 1), AMPLITUDE)
    state = np.zeros((n, 5, 1))
    state[:, 0] = -AMPLITUDE
    theta, alpha, volts = np.empty((3, t.size, n))
    with np.errstate(over="ignore", invalid="ignore"):
        for k, target in enumerate(theta_ref.tolist()):
            state[:, 4] = target
            theta[k], alpha[k] = state[:, 0, 0], state[:, 1, 0]
            volts[k] = gains[:, 0] * target - (gains * state[:, :4, 0]).sum(axis=1)
            if k < len(steps):
                state = steps[k][1] @ state
    beyond = theta - AMPLITUDE
    overshoot = 100 * beyond.max(axis=0) / (2 * AMPLITUDE)
    late = t > LIMITS["settling_time"]
    band = SETTLING_BAND * AMPLITUDE
    settling = np.abs(beyond[late]).max(axis=0)  # in the band at the limit, and for good
    measures = (
        settling / band,
        overshoot / LIMITS["overshoot"],
        np.abs(alpha).max(axis=0) / LIMITS["max_alpha"],
        np.abs(volts).max(axis=0) / LIMITS["max_vm"],
    )
    excess: Vector = np.nan_to_num(np.max(measures, axis=0) - 1, nan=1e3, posinf=1e3)
    return excess


def _phases() -> list[tuple[float, float, float]]:
    """Sample time, end and beginning of each phase, s."""
    since = [0.0, *(until for _, until in _PHASES)]
    return [(dt, until, begun) for (dt, until), begun in zip(_PHASES, since, strict=False)]
