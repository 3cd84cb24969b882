"""What a bench measures, what it may do, how it is wired, and what keeps it from harm: a laboratory has its own."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from rotflex.errors import ConfigurationError
from rotflex.hil.guard import Guard
from rotflex.hil.mark import Mark
from rotflex.units import DEG


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

    def passed(self, measured: Measurement, begun: float = 0.0) -> str:
        """Which angle is past its limit, in words; empty text if none is.

        Parameters
        ----------
        measured : since the run began
        begun : where the servo stood then, rad from the bench's mark
        """
        for name, value, limit in (
            ("servo angle", begun + measured.theta, self.theta),
            ("deflection", measured.alpha, self.alpha),
        ):
            if abs(value) > limit:
                advice = self.why or "Use a smaller amplitude or check the gain."
                if begun and name == "servo angle":
                    advice = f"The run began at {begun / DEG:.1f} deg: turn the arm back to its mark. {advice}"
                return (
                    f"The {name} reached {value / DEG:.1f} deg at t = {measured.time:.3f} s; its limit is "
                    f"±{limit / DEG:.0f} deg. {advice}"
                )
        return ""


@dataclass(frozen=True)
class Wiring:
    """Which channels the bench is wired to, and which way.

    A positive voltage turns the servo the positive way, and a positive turn counts up, where a sign is 1. By default
    it is as on the virtual bench, where the link's encoder counts the other way. How a real bench is wired is found
    there, never assumed.

    digital_outputs : how many digital outputs the board has that an expired watchdog must let go

    Raises
    ------
    ConfigurationError
        If a sign is neither 1 nor -1.
    """

    motor: int = 0
    servo_encoder: int = 0
    link_encoder: int = 1
    link_sign: int = -1
    motor_sign: int = 1
    servo_sign: int = 1
    digital_outputs: int = 0

    def __post_init__(self) -> None:
        for name in ("motor_sign", "servo_sign", "link_sign"):
            if getattr(self, name) not in (1, -1):
                raise ConfigurationError(f"{name} must be 1 or -1; it is {getattr(self, name)!r}.")


@dataclass(frozen=True)
class Safety:
    """What a bench has that can come to harm.

    Attributes
    ----------
    guard : watches every run for motion that cannot be
    commissioned : asked before each closed loop; text that is not empty is why there is none yet on this bench
    folder : where samples are kept while they come, so that they outlive the program
    mark : from which the servo's angle is limited; without one it is from where each run begins
    """

    guard: Guard | None = None
    commissioned: Callable[[], str] | None = None
    folder: Path | None = None
    mark: Mark | None = None
