"""Pole placement as the explorer does it, without a page: poles in, gain and response out (Sections 3.1 and 3.4).

The library places the poles; how it is done by hand is what the notebooks ask.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotflex import response, simulation
from rotflex.errors import DesignError
from rotflex.recording import Recording
from rotflex.signals import rate_limit, step, time_axis
from rotflex.specifications import (
    AMPLITUDE,
    FREQUENCY,
    OMEGA_N,
    P_3,
    P_4,
    RATE,
    SAMPLE_TIME,
    ZETA,
)
from rotflex.widgets.runaway import BORDER, LEAD, Runaway, run_away

Vector = NDArray[np.float64]

_PARTIAL = np.array([1.0, 0.0, 1.0, 0.0])  # of the state, the servo's alone
HALF_PERIOD = 0.5 / FREQUENCY  #: s, of the square wave


@dataclass(frozen=True)
class Dominant:
    """The desired poles (Equation 3.11): a dominant pair, and two real ones.

    Attributes
    ----------
    zeta : damping ratio, from -1 on; from 1 on the pair is two real poles
    omega_n : natural frequency, rad/s
    p3, p4 : rad/s
    """

    zeta: float = ZETA
    omega_n: float = OMEGA_N
    p3: float = P_3
    p4: float = P_4

    @property
    def pair(self) -> complex:
        """The upper pole of the pair, or the slower of two real ones."""
        if self.zeta < 1:
            return self.omega_n * complex(-self.zeta, math.sqrt(1 - self.zeta**2))
        return complex(-self.omega_n / (self.zeta + math.sqrt(self.zeta**2 - 1)))

    @property
    def partner(self) -> complex:
        """The lower pole of the pair, or the faster of two real ones."""
        if self.zeta < 1:
            return self.pair.conjugate()
        return complex(-self.omega_n * (self.zeta + math.sqrt(self.zeta**2 - 1)))

    @property
    def poles(self) -> NDArray[np.complex128]:
        """All four, rad/s."""
        return np.array([self.pair, self.partner, self.p3, self.p4])


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
    runaway : what it does instead, if the loop is unstable
    """

    wanted: NDArray[np.complex128]
    feedback: str
    K: Vector
    polynomial: Vector
    poles: NDArray[np.complex128]
    recording: Recording | None
    findings: Sequence[response.Finding]
    trouble: str = ""
    runaway: Runaway | None = None

    @property
    def applied(self) -> Vector:
        """The gain that is fed back: of the four numbers, with partial feedback two."""
        return self.K * _PARTIAL if self.feedback == "partial" else self.K

    @property
    def motion(self) -> Recording | None:
        """What the arm does: the response, or how it runs away."""
        return self.recording if self.runaway is None else self.runaway.recording


def reference() -> tuple[Vector, Vector]:
    """Half a period of the ±20 deg wave, its step from -20 to 20 deg at the beginning.

    Returns
    -------
    t, theta_ref : (n,) s, from -0.06 s on, and rad
    """
    t = time_axis(HALF_PERIOD + LEAD, SAMPLE_TIME) - LEAD
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
    applied = gain * _PARTIAL if feedback == "partial" else gain
    found = np.linalg.eigvals(a - b @ applied)
    asked = np.linalg.eigvals(a - b @ gain) if wanted is None else np.asarray(wanted, dtype=complex)
    recording, findings, trouble, runaway = None, [], "", None
    growth = float(found.real.max())
    if growth > -BORDER:
        runaway = run_away(a, b, applied, growth)
        trouble = " ".join(runaway.sentences)
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
    return Design(asked, feedback, gain, np.real(np.poly(asked)), found, recording, findings, trouble, runaway)


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


def described(value: complex) -> str:
    """A pole for people, to one decimal."""
    real, imaginary = round(value.real, 1) + 0.0, round(abs(value.imag), 1)
    text = f"{real:.1f}".replace("-", "−")
    return text if imaginary == 0 else f"{text} {'+' if value.imag > 0 else '−'} {imaginary:.1f}j"
