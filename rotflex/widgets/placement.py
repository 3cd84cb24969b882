"""Pole placement as the explorer does it, without a page: poles in, gain and response out (Sections 3.1 and 3.4).

The library places the poles; how it is done by hand is what the notebooks ask.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import expm

from rotflex import response, simulation
from rotflex.errors import DesignError
from rotflex.recording import Recording
from rotflex.signals import rate_limit, step, time_axis
from rotflex.specifications import (
    AMPLITUDE,
    FREQUENCY,
    LIMITS,
    OMEGA_N,
    P_3,
    P_4,
    RATE,
    SAMPLE_TIME,
    SETTLING_BAND,
    ZETA,
)

Vector = NDArray[np.float64]

HALF_PERIOD = 0.5 / FREQUENCY  #: s, of the square wave
_LEAD = 0.06  # s before the step
_PHASES = ((0.002, 0.12), (0.01, 1.0))  # s, sample time and end: fine enough for the peak of the voltage, then coarse
_GRID = (24, 22)  # damping ratios and natural frequencies tried


@dataclass(frozen=True)
class Dominant:
    """The desired poles (Equation 3.11): a dominant pair, and two real ones.

    Attributes
    ----------
    zeta : damping ratio, between 0 and 1
    omega_n : natural frequency, rad/s
    p3, p4 : rad/s, negative
    """

    zeta: float = ZETA
    omega_n: float = OMEGA_N
    p3: float = P_3
    p4: float = P_4

    @property
    def pair(self) -> complex:
        """The upper pole of the pair."""
        return self.omega_n * complex(-self.zeta, np.sqrt(1 - self.zeta**2))

    @property
    def poles(self) -> NDArray[np.complex128]:
        """All four, rad/s."""
        return np.array([self.pair, self.pair.conjugate(), self.p3, self.p4])


@dataclass(frozen=True)
class Design:
    """A gain and what it does.

    Attributes
    ----------
    wanted : (4,) poles asked for, rad/s
    feedback : "full" or "partial"
    K : (1, 4) gain, V/rad and V/(rad/s)
    polynomial : (5,) characteristic polynomial of the poles asked for, from s⁴ down
    poles : (4,) poles of the closed loop, rad/s: with partial feedback, not those asked for
    recording : the response to a step of 40 deg, with no limit on the voltage; None if the loop is unstable
    findings : the four specifications, held against it; empty if the loop is unstable
    trouble : why there is no response
    """

    wanted: NDArray[np.complex128]
    feedback: str
    K: Vector
    polynomial: Vector
    poles: NDArray[np.complex128]
    recording: Recording | None
    findings: Sequence[response.Finding]
    trouble: str = ""


def reference() -> tuple[Vector, Vector]:
    """Half a period of the ±20 deg wave, its step from -20 to 20 deg at the beginning.

    Returns
    -------
    t, theta_ref : (n,) s, from -0.06 s on, and rad
    """
    t = time_axis(HALF_PERIOD + _LEAD, SAMPLE_TIME) - _LEAD
    return t, AMPLITUDE * rate_limit(step(t, 2.0) - 1, RATE, SAMPLE_TIME, initial=-1.0)


def design(A: ArrayLike, B: ArrayLike, poles: ArrayLike, feedback: str = "full") -> Design:
    """Place poles by Ackermann's formula, and see what the closed loop does.

    Parameters
    ----------
    A, B : (4, 4) and (4,) or (4, 1), the model with the motor voltage as input
    poles : (4,) rad/s; complex ones in pairs
    feedback : "full" or "partial"

    Raises
    ------
    DesignError
        If a matrix is not of that shape, the poles are not four in conjugate pairs, or they cannot be placed.
    """
    import control

    a, b = matrices(A, B)
    wanted = np.asarray(poles, dtype=complex).ravel()
    polynomial = np.poly(wanted)
    if wanted.size != 4 or not np.isfinite(wanted).all() or np.abs(np.imag(polynomial)).max() > 1e-6:
        raise DesignError("Four poles are needed, complex ones in conjugate pairs.")
    try:
        gain = np.real(np.asarray(control.acker(a, b, wanted))).reshape(1, 4)
    except (ValueError, np.linalg.LinAlgError) as error:
        raise DesignError(f"The poles of this model cannot be placed: {error}. Look at A and B.") from None
    return with_gain(a, b, gain, feedback, wanted)


def with_gain(
    A: ArrayLike, B: ArrayLike, K: ArrayLike, feedback: str = "full", wanted: ArrayLike | None = None
) -> Design:
    """What a given gain does; ``wanted`` are the poles that it was made for, those that it gives unless told.

    Raises
    ------
    DesignError
        As :func:`design`.
    """
    a, b = matrices(A, B)
    gain = np.asarray(K, dtype=float).reshape(1, -1)
    if gain.shape != (1, 4) or not np.isfinite(gain).all():
        raise DesignError(f"K must be four finite numbers; it is {K!r}.")
    applied = gain * [1, 0, 1, 0] if feedback == "partial" else gain
    found = np.linalg.eigvals(a - b @ applied)
    asked = np.linalg.eigvals(a - b @ gain) if wanted is None else np.asarray(wanted, dtype=complex)
    recording, findings, trouble = None, [], ""
    if found.real.max() > 1e-9:
        trouble = "The closed loop is unstable: a pole lies right of the imaginary axis."
    else:
        t, theta_ref = reference()
        try:
            recording = simulation.closed_loop(
                a, b, gain, theta_ref, SAMPLE_TIME, feedback, saturation=None, x0=(-AMPLITUDE, 0, 0, 0)
            )
            recording = Recording(t, recording.channels, recording.metadata)
            findings = response.verdict(response.worst(response.measure(recording)))
        except DesignError as error:
            trouble = str(error)
    return Design(asked, feedback, gain, np.real(np.poly(asked)), found, recording, findings, trouble)


def matrices(A: ArrayLike, B: ArrayLike) -> tuple[Vector, Vector]:
    """A and B as arrays of shape (4, 4) and (4, 1).

    Raises
    ------
    DesignError
        If they are not.
    """
    try:
        a, b = np.asarray(A, dtype=float), np.asarray(B, dtype=float).reshape(-1, 1)
    except (TypeError, ValueError):
        raise DesignError("A and B must be arrays of numbers.") from None
    if a.shape != (4, 4) or b.shape != (4, 1) or not (np.isfinite(a).all() and np.isfinite(b).all()):
        raise DesignError(
            f"A must be 4 by 4 and B 4 by 1, all finite, with the voltage as input; they are {np.shape(A)} and "
            f"{np.shape(B)}."
        )
    return a, b


# --- where the specifications are met -------------------------------------------------------------------------------


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
        return _excess(self._a, self._b, applied).reshape(self.zeta.shape)

    def outline(self, p3: float, p4: float, feedback: str = "full") -> list[tuple[Vector, Vector]]:
        """The region's borders in the s-plane, upper half: closed curves (real part, imaginary part), rad/s."""
        import contourpy

        real = -self.zeta * self.omega
        imaginary = self.omega * np.sqrt(1 - self.zeta**2)
        excess = np.clip(self.excess(p3, p4, feedback), -1.0, 1.0)
        lines: Any = contourpy.contour_generator(real, imaginary, excess, fill_type=contourpy.FillType.OuterCode)
        curves, _ = lines.filled(-2.0, 0.0)
        return [(np.array(curve[:, 0]), np.array(curve[:, 1])) for curve in curves]


def _excess(a: Vector, b: Vector, gains: Vector) -> Vector:
    """The worst of the four specifications, exceeded by this fraction (n,), for gains (n, 4)."""
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


def described(value: complex) -> str:
    """A pole for people, to one decimal."""
    real, imaginary = round(value.real, 1) + 0.0, round(abs(value.imag), 1)
    text = f"{real:.1f}".replace("-", "−")
    return text if imaginary == 0 else f"{text} {'+' if value.imag > 0 else '−'} {imaginary:.1f}j"
