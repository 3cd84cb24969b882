"""Loop gain and margins of state feedback, without a page: how far gain, phase and delay are from instability.

The loop is opened at the motor voltage: L(s) = K (sI - A)⁻¹ B. Crossings are roots of polynomials, and no frequency is
missed between two points of a grid.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]

_LOWEST = 1e-3  # rad/s; what is slower is rounding of the servo's own pole at 0
_LEAST = 1e-6  # of a loop gain; a smaller one is a zero of the loop on the imaginary axis, as of a link without damping
_REAL = 1e-6  # of its size: how far from the real axis a root may lie to be taken for a real one


@dataclass(frozen=True)
class Margins:
    """How far a stable loop is from instability.

    Attributes
    ----------
    gain_up, gain_down : factors by which the loop gain may rise, and fall to; infinite, and 0, where it may as it likes
    gain_up_at, gain_down_at : rad/s, where the loop then swings
    phase : deg that the loop may lose or gain, infinite if its gain is 1 nowhere
    phase_at : rad/s
    delay : s by which the voltage may come late
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


def loop(a: Vector, b: Vector, applied: Vector) -> tuple[Vector, Vector]:
    """The loop gain's numerator and denominator, from s³ and from s⁴ down.

    Parameters
    ----------
    a, b : (4, 4) and (4, 1), the model with the motor voltage as input
    applied : (1, 4) gain that is fed back
    """
    opened = np.real(np.poly(a))
    return np.real(np.poly(a - b @ applied) - np.poly(a))[1:], opened


def bode(a: Vector, b: Vector, applied: Vector, omega: Vector) -> tuple[Vector, Vector]:
    """Magnitude (dB) and phase (deg, without jumps) of the loop gain at frequencies (rad/s)."""
    numerator, denominator = loop(a, b, applied)
    value = np.polyval(numerator, 1j * omega) / np.polyval(denominator, 1j * omega)
    magnitude: Vector = 20 * np.log10(np.maximum(np.abs(value), 1e-12))
    phase: Vector = np.degrees(np.unwrap(np.angle(value)))
    return magnitude, phase


def margins(a: Vector, b: Vector, applied: Vector) -> Margins:
    """The margins of a loop that is stable; see :func:`loop`."""
    numerator, denominator = loop(a, b, applied)

    def at(omega: float) -> complex:
        return complex(np.polyval(numerator, 1j * omega) / np.polyval(denominator, 1j * omega))

    mirrored_n, mirrored_d = _mirrored(numerator), _mirrored(denominator)
    size = np.polysub(np.polymul(numerator, mirrored_n), np.polymul(denominator, mirrored_d))
    turned = np.polysub(np.polymul(numerator, mirrored_d), np.polymul(mirrored_n, denominator))
    real = [(1 / abs(at(omega)), omega) for omega in _frequencies(turned) if at(omega).real < -_LEAST]
    up = min(((factor, omega) for factor, omega in real if factor > 1), default=(math.inf, math.nan))
    down = max(((factor, omega) for factor, omega in real if factor < 1), default=(0.0, math.nan))
    crossed = [(np.angle(at(omega)) + math.pi, omega) for omega in _frequencies(size)]
    phase = min(
        ((math.degrees(min(left % (2 * math.pi), -left % (2 * math.pi))), omega) for left, omega in crossed),
        default=(math.inf, math.nan),
    )
    delay = min(((left % (2 * math.pi) / omega, omega) for left, omega in crossed), default=(math.inf, math.nan))
    return Margins(*up, *down, *phase, *delay)


def _mirrored(polynomial: Vector) -> Vector:
    """p(-s)."""
    signs = (-1.0) ** np.arange(polynomial.size - 1, -1, -1)
    found: Vector = polynomial * signs
    return found


def _frequencies(polynomial: Vector) -> list[float]:
    """Where a polynomial in s that is even or odd is zero on the upper imaginary axis, rad/s."""
    squared = np.roots(polynomial[::2])  # in s²; of an odd one, a factor s is taken out
    real = np.abs(squared.imag) <= _REAL * np.abs(squared)
    return [math.sqrt(-value) for value in squared[real].real.tolist() if value < -(_LOWEST**2)]
