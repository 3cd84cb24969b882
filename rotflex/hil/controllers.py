"""Controllers: each turns a reference and two measured angles into a motor voltage, once a sample.

Any function ``(reference, theta, alpha) -> V`` is one, see :mod:`rotflex.controller`; here are the laboratory's own.

Velocities are not measured; they come from the angles through band-limited derivatives (Section 2.1.4).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from rotflex.config import one_of
from rotflex.errors import DesignError
from rotflex.units import HZ

DERIVATIVE_CUTOFF = 33 * HZ  #: rad/s, of the band-limited derivatives
FEEDBACK = ("full", "partial")


class BandLimitedDerivative:
    """Derivative up to a cut-off frequency, w_c s/(s + w_c), by forward Euler as the real-time model has it.

    Its gain for a slow ramp is exactly 1. (A zero-order-hold discretisation would give 1.22 at 33 Hz and 2 ms.)

    Parameters
    ----------
    sample_time : s
    cutoff : w_c, rad/s; below 2/sample_time, or the filter is unstable

    Raises
    ------
    DesignError
        If the sample time is not positive, or the filter would be unstable.
    """

    def __init__(self, sample_time: float, cutoff: float = DERIVATIVE_CUTOFF) -> None:
        if not 0 < sample_time < math.inf:
            raise DesignError(f"The sample time must be a positive number of seconds; it is {sample_time!r}.")
        if not 0 < cutoff * sample_time < 2:
            raise DesignError(
                f"A derivative filter with cut-off {cutoff:g} rad/s is not stable at a sample time of "
                f"{sample_time:g} s; keep the cut-off positive and below {2 / sample_time:g} rad/s."
            )
        self._cutoff = cutoff
        self._gain = cutoff * sample_time
        self.reset()

    def reset(self) -> None:
        """Begin again: the next value is taken to have stood still before."""
        self._slow: float | None = None

    def __call__(self, value: float) -> float:
        """Derivative of the signal whose next sample is ``value``."""
        if self._slow is None:
            self._slow = value
        difference = value - self._slow
        self._slow += self._gain * difference
        return self._cutoff * difference


class StateFeedback:
    """State feedback u = K(x_d − x) with x_d = [theta_d, 0, 0, 0] (Equations 3.13, 3.14).

    Parameters
    ----------
    K : (4,) or (1, 4), gain on theta, alpha (V/rad), theta_dot, alpha_dot (V/(rad/s))
    feedback : "full", or "partial", which leaves out alpha and alpha_dot (Section 3.4.4)
    sample_time : s
    cutoff : of the derivatives, rad/s

    Raises
    ------
    DesignError
        If K is not four finite numbers, or as :class:`BandLimitedDerivative` says.
    ConfigurationError
        If the feedback is neither full nor partial.
    """

    def __init__(
        self, K: ArrayLike, feedback: str = "full", sample_time: float = 0.002, cutoff: float = DERIVATIVE_CUTOFF
    ) -> None:
        one_of("feedback", feedback, FEEDBACK)
        try:
            gain = np.asarray(K, dtype=float)
        except (TypeError, ValueError):
            gain = np.array(math.nan)
        if gain.shape not in ((4,), (1, 4)) or not np.isfinite(gain).all():
            raise DesignError(f"K must be four finite numbers, for theta, alpha and their rates; it is {K!r}.")
        gain = gain.ravel()
        if feedback == "partial":
            gain = gain * (1, 0, 1, 0)
        self._gain: tuple[float, ...] = tuple(gain.tolist())
        self._theta_dot = BandLimitedDerivative(sample_time, cutoff)
        self._alpha_dot = BandLimitedDerivative(sample_time, cutoff)

    def reset(self) -> None:
        """Forget the derivatives' past."""
        self._theta_dot.reset()
        self._alpha_dot.reset()

    def __call__(self, reference: float, theta: float, alpha: float) -> float:
        """The voltage (V) for a commanded servo angle (rad) and measured angles (rad)."""
        k_1, k_2, k_3, k_4 = self._gain
        return k_1 * (reference - theta) - k_2 * alpha - k_3 * self._theta_dot(theta) - k_4 * self._alpha_dot(alpha)


class PositionServo:
    """A position loop around the servo alone: u = K_p e + K_d ė with e = theta_d − theta.

    It makes the servo follow a command nearly whatever the arm does, so that the arm sees a base that moves as
    commanded. How stiff the loop may be is bounded twice: by the delay of the board's output, which makes a stiff loop
    unstable, and by the encoder, one count of which is worth K_d w_c times its angle in voltage.

    Parameters
    ----------
    K_p : V/rad
    K_d : V/(rad/s)
    sample_time : s
    cutoff : of the derivative, rad/s

    Raises
    ------
    DesignError
        If a gain is not finite, or as :class:`BandLimitedDerivative` says.
    """

    def __init__(self, K_p: float, K_d: float, sample_time: float = 0.002, cutoff: float = DERIVATIVE_CUTOFF) -> None:
        if not (math.isfinite(K_p) and math.isfinite(K_d)):
            raise DesignError(f"The gains must be finite; they are K_p = {K_p!r} and K_d = {K_d!r}.")
        self._K_p, self._K_d = K_p, K_d
        self._error_dot = BandLimitedDerivative(sample_time, cutoff)

    def reset(self) -> None:
        """Forget the derivative's past."""
        self._error_dot.reset()

    def __call__(self, reference: float, theta: float, alpha: float) -> float:
        """The voltage (V) for a commanded servo angle (rad) and measured angles (rad)."""
        error = reference - theta
        return self._K_p * error + self._K_d * self._error_dot(error)


class OpenLoop:
    """No feedback: the reference is the voltage."""

    def __call__(self, reference: float, theta: float, alpha: float) -> float:
        """The reference (V) as it is."""
        return reference
