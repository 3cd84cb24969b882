"""What ends a run: an angle, the servo's rate or the time past its limit, or motion that cannot be.

Only a run in which the motor was driven is judged. At 0 V nothing runs away, and whoever turns the arm by hand is free
to.
"""

from __future__ import annotations

import math

from rotflex.hil.guard import Guard
from rotflex.hil.parts import Limits, Measurement

_RATE_OVER = 0.01  # s; a count is worth 0.15 rad/s then


class Supervision:
    """Of one run, sample by sample.

    Parameters
    ----------
    limits : see :class:`~rotflex.hil.parts.Limits`
    guard : the runaway guard, for a bench that can come to harm
    sample_time : s
    begun : where the servo stands as it begins, rad from the bench's mark
    """

    def __init__(self, limits: Limits, guard: Guard | None, sample_time: float, begun: float = 0.0) -> None:
        self._limits, self._guard, self._sample_time, self._begun = limits, guard, sample_time, begun
        self._driven = False
        self._before: Measurement | None = None
        self._rate = 0.0  # rad/s, smoothed
        if guard is not None:
            guard.start(sample_time)

    def drive(self, voltage: float) -> None:
        """What is applied until the next sample, V."""
        self._driven = self._driven or voltage != 0.0
        if self._guard is not None:
            self._guard.drive(voltage)

    def see(self, measured: Measurement, samples: int) -> str:
        """Judge a sample, so many after the one before: text that is not empty is why the motor must stop."""
        before, self._before = self._before, measured
        impossible = "" if self._guard is None else self._guard.see(measured.theta, measured.alpha, samples)
        if not self._driven:
            return ""
        limits = self._limits
        if abs(self._begun + measured.theta) > limits.theta or abs(measured.alpha) > limits.alpha:
            return limits.passed(measured, self._begun)
        if impossible:
            return at(impossible, measured.time)
        if measured.time > limits.duration:
            text = "The run has taken {time:g} s, which is all that this bench allows."
            return at(text.format(time=limits.duration), measured.time, limits.why)
        if limits.rate < math.inf and samples == 1 and before is not None:
            return self._too_quick(measured, before)
        return ""

    def _too_quick(self, measured: Measurement, before: Measurement) -> str:
        weight = math.exp(-self._sample_time / _RATE_OVER)
        rate = (measured.theta - before.theta) / (measured.time - before.time)
        self._rate = weight * self._rate + (1 - weight) * rate
        if abs(self._rate) <= self._limits.rate:
            return ""
        text = "The servo turned at {rate:.1f} rad/s; its limit is ±{limit:.1f} rad/s."
        return at(text.format(rate=self._rate, limit=self._limits.rate), measured.time, self._limits.why)


def at(why: str, time: float, advice: str = "") -> str:
    """A reason with its moment (s)."""
    return f"{why} (t = {time:.3f} s.) {advice}".rstrip()
