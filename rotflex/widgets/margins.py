"""Loop gain and margins of state feedback as it runs, without a page: how far the loop is from instability.

The loop is opened at the motor voltage. It is the one that a bench runs: a voltage held from each sample to the next,
velocities from the two band-limited derivatives of :mod:`rotflex.hil.controllers`, and a delay from sample to voltage.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import expm

from rotflex.hil.controllers import DERIVATIVE_CUTOFF
from rotflex.specifications import SAMPLE_TIME
from rotflex.widgets.placement import matrices

Vector = NDArray[np.float64]

DELAY = 2e-3  #: s from sample to voltage, unless another one is given; virtual benches take 1 to 3.5 ms
_LOWEST = 0.1  # rad/s; no loop with a pole nearer to 0 settles within a turn
_LEAST = 1e-3  # of a loop gain; a smaller one is a zero of the loop on the imaginary axis, as of a link without damping


@dataclass(frozen=True)
class Margins:
    """How far a stable loop is from instability.

    Attributes
    ----------
    gain_up, gain_down : factors by which the loop gain may rise, and fall to; infinite, and 0, if there is no limit
    gain_up_at, gain_down_at : rad/s, where the loop then swings
    phase : deg that the loop may lose or gain, infinite if its gain is 1 nowhere
    phase_at : rad/s
    delay : s by which the voltage may come later than it does
    delay_at : rad/s
    """

    gain_up: float
    gain_up_at: float
    gain_down: float
    gain_down_at: float
    phase: float
    phase_at: float
    delay: float
    delay_at: float


def loop_gain(A: ArrayLike, B: ArrayLike, K: ArrayLike, omega: Vector, delay: float = DELAY) -> NDArray[np.complex128]:
    """Find the loop gain as it runs at frequencies (rad/s); see :func:`margins`."""
    transition, entry, law = _sampled(A, B, K)
    z = np.exp(1j * omega * SAMPLE_TIME)
    states = np.linalg.solve(z[:, None, None] * np.eye(6) - transition, entry[:, None])[..., 0]
    found: NDArray[np.complex128] = states @ law * np.exp(-1j * omega * delay)
    return found


def bode(A: ArrayLike, B: ArrayLike, K: ArrayLike, omega: Vector, delay: float = DELAY) -> tuple[Vector, Vector]:
    """Magnitude (dB) and phase (deg, without jumps) of :func:`loop_gain`."""
    value = loop_gain(A, B, K, omega, delay)
    magnitude: Vector = 20 * np.log10(np.maximum(np.abs(value), 1e-12))
    phase: Vector = np.degrees(np.unwrap(np.angle(value)))
    return magnitude, phase


def margins(A: ArrayLike, B: ArrayLike, K: ArrayLike, delay: float = DELAY) -> Margins | None:
    """Find the margins of a state feedback as a bench runs it.

    Parameters
    ----------
    A, B : (4, 4) and (4,) or (4, 1), the model with the motor voltage as input
    K : (4,) or (1, 4) gain that is fed back
    delay : s from sample to voltage

    Returns
    -------
    Margins or None
        None if the loop is unstable, with that delay or without.
    """
    transition, entry, law = _sampled(A, B, K)
    omega = np.geomspace(_LOWEST, np.pi / SAMPLE_TIME, 10000)
    at_once = loop_gain(A, B, K, omega, 0.0)
    late = at_once * np.exp(-1j * omega * delay)
    crossed = _crossings(np.abs(at_once) - 1, omega, at_once)
    allowed, delay_at = min(
        ((float(np.angle(-value)) % (2 * math.pi) / where, where) for where, value in crossed),
        default=(math.inf, math.nan),
    )
    if np.abs(np.linalg.eigvals(transition - np.outer(entry, law))).max() >= 1 or allowed <= delay:
        return None
    real = [(1 / abs(value), where) for where, value in _crossings(late.imag, omega, late) if value.real < -_LEAST]
    up = min(((factor, where) for factor, where in real if factor > 1), default=(math.inf, math.nan))
    down = max(((factor, where) for factor, where in real if factor < 1), default=(0.0, math.nan))
    phase = min(
        ((abs(math.degrees(np.angle(-value * np.exp(-1j * where * delay)))), where) for where, value in crossed),
        default=(math.inf, math.nan),
    )
    return Margins(*up, *down, *phase, allowed - delay, delay_at)


def _sampled(A: ArrayLike, B: ArrayLike, K: ArrayLike) -> tuple[Vector, Vector, Vector]:
    """Transition (6, 6), input (6,) and gain (6,) from sample to sample: the plant's states, and the filters' two."""
    a, b = matrices(A, B)
    k = np.asarray(K, dtype=float).reshape(4)
    share = DERIVATIVE_CUTOFF * SAMPLE_TIME
    held = expm(np.block([[a, b], [np.zeros((1, 5))]]) * SAMPLE_TIME)
    transition = np.zeros((6, 6))
    transition[:4, :4] = held[:4, :4]
    transition[4:, :2], transition[4:, 4:] = share * np.eye(2), (1 - share) * np.eye(2)
    law = np.concatenate([k[:2] + DERIVATIVE_CUTOFF * k[2:], [0.0, 0.0], -DERIVATIVE_CUTOFF * k[2:]])
    return transition, np.append(held[:4, 4], [0.0, 0.0]), law


def _crossings(signed: Vector, omega: Vector, value: NDArray[np.complex128]) -> list[tuple[float, complex]]:
    """Find where a curve changes its sign: the frequency, and the loop gain there."""
    at = np.flatnonzero(np.diff(np.sign(signed)))
    share = signed[at] / (signed[at] - signed[at + 1])
    between = [one[at] + share * (one[at + 1] - one[at]) for one in (omega, value)]
    return list(zip(between[0].tolist(), between[1].tolist(), strict=True))
