"""What ends a run: an angle, the servo's rate or the time past its limit, or motion that cannot be.

The runaway guard: the servo must go where voltage and spring drive it, or the motor is stopped. A sign that is wrong
somewhere (motor, an encoder), a counter that stands still, jumps or turns round: each makes the servo move as it could
not. The guard follows, sample by sample, how quickly the applied voltage and the measured deflection would drive a
nominal servo, and compares that with how quickly the encoder says it moves. Both are summed up over the last moments:
R, by how much they differ, and A, by how much either moves. With right signs R is a fraction of A; with a wrong sign,
or a counter that stands still, it is all of it. Only what is driven is judged: an arm that is moved by hand at 0 V is
not.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from rotflex.config import Servo
from rotflex.units import DEG

_LIGHTEST_LINK = 1e-3  # kg·m²; a third of the lightest arm there is
_A_FEW_COUNTS = 0.5 * DEG  # rad; six counts of an encoder
SLOWEST = 0.05  #: s, between samples; at 0.1 s the guard stops runs of benches that are in order
_RATE_OVER = 0.01  # s; a count is worth 0.15 rad/s then


@dataclass(frozen=True)
class Allowance:
    """What the guard lets pass. Chosen, then tried on the runs of ``tests/hil/test_guard.py``.

    Attributes
    ----------
    share : of all motion, by which the servo may move otherwise than it is driven; a wrong sign or a counter that
        stands still gives 1
    motion : rad besides, for what a nominal servo does not know: friction, play, delays. Sweeps of 24 benches needed
        1.8 deg, with the stiffness known within 15 %
    friction : N·m; a drive below it may move the servo or not. The stickiest of real logs has 0.026
    load : of the spring's torque, which presses on the gear, by which that is more
    memory : s, over which motion is summed up: three time constants of the servo
    smoothing : s, by which rates are smoothed; an encoder's count is worth 0.4 rad/s from one sample to the next
    jump : by how many times the quickest possible motion a counter may move in one sample
    stiffness : of this bench's joint, N·m/rad: where it is off by a third, honest sweeps are stopped
    """

    share: float = 0.6
    motion: float = 2.0 * DEG
    friction: float = 0.03
    load: float = 0.13
    memory: float = 0.1
    smoothing: float = 0.006
    jump: float = 2.0
    stiffness: float = 1.4


class Guard:
    """Watches one run after the other.

    Parameters
    ----------
    servo : nominal
    alpha_limit : the deflection's limit, rad, which bounds how quickly the link can move
    allowance : see above
    """

    def __init__(self, servo: Servo, alpha_limit: float = 30 * DEG, allowance: Allowance | None = None) -> None:
        self._servo, self._allowed = servo, allowance or Allowance()
        self._torque, self._damping = servo.torque_per_volt, servo.B_eq + servo.back_emf_damping
        quickest = servo.torque_per_volt * servo.V_max / self._damping
        swinging = min(alpha_limit, math.pi) * math.sqrt(self._allowed.stiffness / _LIGHTEST_LINK)
        self._quickest = (quickest, quickest + swinging)
        self.start(0.002)

    def start(self, sample_time: float) -> None:
        """Begin a run, with the arm anywhere and at 0 V."""
        self._period = sample_time
        self._lag = math.exp(-sample_time * self._damping / self._servo.J_eq)
        self._smooth = math.exp(-sample_time / self._allowed.smoothing)
        self._forget = math.exp(-sample_time / self._allowed.memory)
        self._before: tuple[float, float] | None = None
        self._volts = self._driven = self._rate = self._expected = 0.0
        self._stood = 0
        self.apart = self.moved = 0.0  #: R and A, rad

    def drive(self, voltage: float) -> None:
        """Note what is applied until the next sample, V."""
        self._volts = voltage

    def see(self, theta: float, alpha: float, samples: int = 1) -> str | None:
        """Judge a sample (rad), so many after the one before; return why the motor must stop, or None."""
        before, self._before = self._before, (theta, alpha)
        if before is None:
            return None
        reach = self._allowed.jump * samples * self._period
        for name, now, earlier, quickest in zip(
            ("servo angle", "deflection"), (theta, alpha), before, self._quickest, strict=True
        ):
            if abs(now - earlier) > reach * quickest + _A_FEW_COUNTS:
                return (
                    f"The {name} jumped by {(now - earlier) / DEG:.1f} deg from one sample to the next, quicker than "
                    "it can move: look at the encoder's plug and cable."
                )
        self._stood = 0 if theta != before[0] else self._stood + samples
        for _each in range(samples):
            self._follow((theta - before[0]) / samples, before[1])
        if self.apart <= self._allowed.motion + self._allowed.share * self.moved:
            return None
        return self._reason()

    def _follow(self, moved: float, alpha: float) -> None:
        """Follow for one sample how quickly the servo is driven, and how quickly it moves."""
        spring = self._allowed.stiffness * alpha
        torque = self._torque * self._volts + spring
        friction = self._allowed.friction + self._allowed.load * abs(spring)
        driving = math.copysign(max(abs(torque) - friction, 0.0), torque) if self._volts else 0.0
        self._driven = self._lag * self._driven + (1 - self._lag) * driving / self._damping
        smooth = self._smooth
        self._rate = smooth * self._rate + (1 - smooth) * moved / self._period
        self._expected = smooth * self._expected + (1 - smooth) * self._driven
        judged = self._period if self._volts else 0.0
        forget = self._forget
        self.apart = forget * self.apart + judged * abs(self._rate - self._expected)
        self.moved = forget * self.moved + judged * (abs(self._rate) + abs(self._expected))

    def _reason(self) -> str:
        if self._stood * self._period > self._allowed.memory / 10:
            return (
                f"The servo's encoder has stood still for {self._stood * self._period * 1e3:.0f} ms while "
                f"{self._volts:.1f} V drove the motor: look at the encoder's cable, at the amplifier, and "
                "whether something holds the arm."
            )
        return (
            "The servo does not move as voltage and spring drive it: a sign of the motor or of an encoder is wrong, a "
            "cable is loose, or somebody pushes the arm."
        )


class Measurement(NamedTuple):
    """One sample: time since the start (s), servo angle and deflection (rad)."""

    time: float
    theta: float
    alpha: float


@dataclass(frozen=True)
class Limits:
    """Software limits. The makers publish no mechanical ones, so these are cautious.

    Attributes
    ----------
    voltage : at the motor, V; a larger command is cut to it
    theta : servo angle either way, rad: half a turn, for the cables' sake, from the bench's mark
    alpha : deflection either way, rad
    rate : of the servo, rad/s, over 10 ms; none unless given
    duration : of a run, s; none unless given
    why : why they are as narrow as they are; with a reason, a larger voltage is refused in place of being cut
    """

    voltage: float = 10.0
    theta: float = 180 * DEG
    alpha: float = 30 * DEG
    rate: float = math.inf
    duration: float = math.inf
    why: str = ""

    def passed(self, measured: Measurement, begun: float = 0.0) -> str | None:
        """Return which angle is past its limit; None if none is.

        Parameters
        ----------
        measured : since the run began
        begun : where the servo stood then, rad from the bench's mark
        """
        advice = self.why or "Use a smaller amplitude or check the gain."
        if abs(measured.alpha) > self.alpha:
            return _passed("deflection", measured.alpha, self.alpha, measured.time, advice)
        if abs(begun + measured.theta) > self.theta:
            if begun:
                advice = f"The run began at {begun / DEG:.1f} deg: turn the arm back to its mark. {advice}"
            return _passed("servo angle", begun + measured.theta, self.theta, measured.time, advice)
        return None


def _passed(name: str, value: float, limit: float, time: float, advice: str) -> str:
    return (
        f"The {name} reached {value / DEG:.1f} deg at t = {time:.3f} s; its limit is ±{limit / DEG:.0f} deg. {advice}"
    )


class Supervision:
    """Judges one run, sample by sample: only where the motor was driven, for at 0 V nothing runs away.

    Parameters
    ----------
    limits : of the bench
    guard : the runaway guard, for a bench that can come to harm
    sample_time : s
    begun : where the servo stands as it begins, rad from the bench's mark
    """

    def __init__(self, limits: Limits, guard: Guard | None, sample_time: float, begun: float = 0.0) -> None:
        self._limits, self._guard, self._begun = limits, guard, begun
        self._weight = math.exp(-sample_time / _RATE_OVER)
        self.is_driven = False  #: whether any voltage was applied
        self._before: Measurement | None = None
        self._rate = 0.0  # rad/s, smoothed
        if guard is not None:
            guard.start(sample_time)

    def drive(self, voltage: float) -> None:
        """Note what is applied until the next sample, V."""
        self.is_driven = self.is_driven or voltage != 0.0
        if self._guard is not None:
            self._guard.drive(voltage)

    def see(self, measured: Measurement, samples: int) -> str | None:
        """Judge a sample, so many after the one before; return why the motor must stop, or None."""
        before, self._before = self._before, measured
        impossible = None if self._guard is None else self._guard.see(measured.theta, measured.alpha, samples)
        if not self.is_driven:
            return None
        limits, now = self._limits, measured.time
        if impossible:  # angles that cannot be say nothing of limits
            return at(impossible, now)
        if passed := limits.passed(measured, self._begun):
            return passed
        if now > limits.duration:
            why = f"The run has taken {limits.duration:g} s, which is all that this bench allows."
            return at(why, now, limits.why)
        if samples == 1 and before is not None:
            rate = (measured.theta - before.theta) / (now - before.time)
            self._rate = self._weight * self._rate + (1 - self._weight) * rate
            if abs(self._rate) > limits.rate:
                why = f"The servo turned at {self._rate:.1f} rad/s; its limit is ±{limits.rate:.1f} rad/s."
                return at(why, now, limits.why)
        return None


def at(why: str, time: float, advice: str = "") -> str:
    """Return a reason with its moment (s)."""
    return f"{why} (t = {time:.3f} s.) {advice}".rstrip()
