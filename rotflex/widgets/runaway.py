"""What an unstable loop does on a bench, without a page: it swings up until the bench's safety stops it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from rotflex.hil.bench import Limits
from rotflex.recording import Recording
from rotflex.specifications import RATE, SAMPLE_TIME
from rotflex.units import DEG

Vector = NDArray[np.float64]

STEP = 2 * DEG  #: rad; small, so that the swing can be seen to grow: the larger step meets a limit at its first swing
LEAD = 0.06  #: s before the step
LONGEST = 4.0  #: s, that a loop is followed after the step
_AFTER = 0.6  # s, that the arm is followed after the stop
BORDER = 1e-6  #: rad/s; a pole that is no further right than this is taken to lie on the imaginary axis


@dataclass(frozen=True)
class Runaway:
    """A loop that does not settle.

    Attributes
    ----------
    growth : rad/s, the largest real part of its poles
    recording : theta_ref, theta, alpha (rad) and vm (V), until some time after the stop
    stopped : s after the step, when a limit of the bench was reached; None if none was
    what : the angle that reached it, or ""
    limit : rad
    """

    growth: float
    recording: Recording
    stopped: float | None
    what: str
    limit: float

    @property
    def doubled(self) -> float:
        """s, in which what swings becomes twice as large."""
        return math.log(2) / self.growth if self.growth > BORDER else math.inf

    @property
    def sentences(self) -> tuple[str, str, str]:
        """Where it lies, what it means, what comes of it."""
        if self.growth <= BORDER:
            return (
                "The closed loop is at the border of stability: a pole lies on the imaginary axis.",
                "What swings there does not die away.",
                self._end,
            )
        return (
            f"The closed loop is unstable: a pole lies right of the imaginary axis, at +{self.growth:.2g} rad/s.",
            f"What swings grows: twice as large every {self.doubled:.2g} s.",
            self._end,
        )

    @property
    def _end(self) -> str:
        if self.stopped is None:
            return f"A step of {STEP / DEG:.0f} deg: no limit of the bench is reached within {LONGEST:g} s."
        return (
            f"A step of {STEP / DEG:.0f} deg: after {self.stopped:.2f} s the {self.what} is at its limit of "
            f"{self.limit / DEG:.0f} deg, and the safety stops it at 0 V."
        )


def run_away(a: Vector, b: Vector, applied: Vector, growth: float) -> Runaway:
    """Follow a small step until a limit of the bench stops it, and the arm after that.

    Parameters
    ----------
    a, b : (4, 4) and (4, 1), the model with the motor voltage as input; nothing limits the voltage here
    applied : (1, 4) gain that is fed back
    growth : rad/s, the largest real part of the loop's poles
    """
    driven, free = _transition(a - b @ applied, b * applied[0, 0]), _transition(a, 0 * b)
    what, limit = "", 0.0
    samples: list[tuple[float, float, float, float]] = []
    state, stopped = np.array([-STEP / 2, 0.0, 0.0, 0.0, 0.0]), None
    for number in range(round((LEAD + LONGEST) / SAMPLE_TIME) + 1):
        t = number * SAMPLE_TIME - LEAD
        command = STEP / 2 * min(max(RATE * (t + SAMPLE_TIME), 0.0) - 1, 1.0)
        state[4] = command
        theta, alpha = float(state[0]), float(state[1])
        if stopped is None:
            what, limit = _reached(theta, alpha)
            stopped = t if what else None
        volts = float(applied[0, 0] * command - applied[0] @ state[:4]) if stopped is None else 0.0
        samples.append((command, theta, alpha, volts))
        if stopped is not None and t >= stopped + _AFTER:
            break
        state = (driven if stopped is None else free) @ state
    command_, theta_, alpha_, vm = np.array(samples).T
    time = np.arange(len(samples)) * SAMPLE_TIME - LEAD
    about = {"source": "simulation", "experiment": "runaway"}
    recording = Recording.of(time, about, theta_ref=command_, theta=theta_, alpha=alpha_, vm=vm)
    return Runaway(growth, recording, stopped, what, limit)


def _transition(a: Vector, input_: Vector) -> Vector:
    """Of the state and an input that is held, from each sample to the next."""
    moved = np.zeros((5, 5))
    moved[:4, :4], moved[:4, 4:] = a, input_
    found: Vector = expm(moved * SAMPLE_TIME)
    return found


def _reached(theta: float, alpha: float) -> tuple[str, float]:
    """What is beyond its limit on a bench, and that limit (rad)."""
    limits = Limits()
    if abs(theta) > limits.theta:
        return "servo angle", limits.theta
    return ("deflection", limits.alpha) if abs(alpha) > limits.alpha else ("", 0.0)
