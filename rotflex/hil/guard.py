"""The runaway guard: the servo must go where voltage and spring drive it, or the motor is stopped.

A sign that is wrong somewhere (motor, an encoder), a counter that stands still, jumps or turns round: each makes the
servo move as it could not. The guard follows, sample by sample, how quickly the applied voltage and the measured
deflection would drive a nominal servo, and compares that with how quickly the encoder says it moves. Both are summed up
over the last moments: R, by how much they differ, and A, by how much either moves. With right signs R is a fraction of
A; with a wrong sign, or a counter that stands still, it is all of it. Only what is driven is judged: an arm that
is moved by hand at 0 V is not.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from rotflex.config import Servo
from rotflex.units import DEG

_LIGHTEST_LINK = 1e-3  # kg·m²; a third of the lightest arm there is
_A_FEW_COUNTS = 0.5 * DEG  # rad; six counts of an encoder


@dataclass(frozen=True)
class Allowance:
    """What the guard lets pass. Chosen, then tried on the runs of ``tests/hil/test_guard.py``.

    Attributes
    ----------
    share : of all motion, by which the servo may move otherwise than it is driven; a wrong sign or a counter that
        stands still gives 1
    motion : rad besides, for what a nominal servo does not know: friction, play, delays. Sweeps of 24 benches needed
        1.5 deg, with the stiffness known within 15 %
    friction : N·m; a drive below it may move the servo or not. The stickiest of real logs has 0.024
    memory : s, over which motion is summed up: three time constants of the servo
    smoothing : s, by which rates are smoothed; an encoder's count is worth 0.4 rad/s from one sample to the next
    jump : by how many times the quickest possible motion a counter may move in one sample
    stiffness : of this bench's joint, N·m/rad: where it is off by a third, honest sweeps are stopped
    """

    share: float = 0.6
    motion: float = 2.0 * DEG
    friction: float = 0.03
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
        """A run begins, with the arm anywhere and at 0 V."""
        self._period = sample_time
        self._lag = math.exp(-sample_time * self._damping / self._servo.J_eq)
        self._smooth = math.exp(-sample_time / self._allowed.smoothing)
        self._forget = math.exp(-sample_time / self._allowed.memory)
        self._before: tuple[float, float] | None = None
        self._volts = self._driven = self._rate = self._expected = 0.0
        self._stood = 0
        self.apart = self.moved = 0.0  #: R and A, rad

    def drive(self, voltage: float) -> None:
        """What is applied until the next sample, V."""
        self._volts = voltage

    def see(self, theta: float, alpha: float, samples: int = 1) -> str:
        """Judge a sample (rad): text that is not empty is why the motor must stop."""
        before, self._before = self._before, (theta, alpha)
        if before is None:
            return ""
        reach = self._allowed.jump * samples * self._period
        for moved, quickest, name in (
            (theta - before[0], self._quickest[0], "servo angle"),
            (alpha - before[1], self._quickest[1], "deflection"),
        ):
            if abs(moved) > reach * quickest + _A_FEW_COUNTS:
                return (
                    f"The {name} jumped by {moved / DEG:.1f} deg from one sample to the next, quicker than it "
                    "can move: look at the encoder's plug and cable."
                )
        self._stood = 0 if theta != before[0] else self._stood + samples
        for _each in range(samples):
            self._follow((theta - before[0]) / samples, before[1])
        if self.apart <= self._allowed.motion + self._allowed.share * self.moved:
            return ""
        return self._reason()

    def _follow(self, moved: float, alpha: float) -> None:
        """One sample: how quickly the servo is driven, and how quickly it moves."""
        torque = self._torque * self._volts + self._allowed.stiffness * alpha
        driving = math.copysign(max(abs(torque) - self._allowed.friction, 0.0), torque) if self._volts else 0.0
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
