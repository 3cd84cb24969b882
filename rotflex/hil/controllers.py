"""Controllers: each turns a reference and two measured angles into a motor voltage, once a sample.

Any function ``(reference, theta, alpha) -> V`` is one, and so is a discrete system of python-control, see
:mod:`rotflex.controller`; here are the laboratory's own.

Velocities are not measured; they come from the angles through band-limited derivatives (Section 2.1.4).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import chain, repeat
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotflex.config import DAC_LIMIT, one_of, real_array
from rotflex.controller import Controller, SystemController, name_of, runnable
from rotflex.errors import DesignError
from rotflex.simulation import DERIVATIVE_CUTOFF

if TYPE_CHECKING:
    from control import StateSpace

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
        """Return the derivative of a signal; ``value`` is its next sample."""
        if self._slow is None:
            self._slow = value
        difference = value - self._slow
        self._slow += self._gain * difference
        return self._cutoff * difference


class StateFeedback:
    """State feedback u = K(x_d − x) with x_d = [theta_d, 0, 0, 0] (Equations 3.13, 3.14).

    Parameters
    ----------
    K : (4,), (1, 4) or (4, 1), gain on theta, alpha (V/rad), theta_dot, alpha_dot (V/(rad/s))
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
        gain = real_array("K, four numbers for theta, alpha and their rates,", K, DesignError)
        if gain.shape not in ((4,), (1, 4), (4, 1)) or not np.isfinite(gain).all():
            raise DesignError(f"K must be four finite numbers, for theta, alpha and their rates; it is {K!r}.")
        gain = gain.ravel()
        self.K: list[float] = gain.tolist()
        if feedback == "partial":
            gain = gain * (1, 0, 1, 0)
        self._gain: tuple[float, ...] = tuple(gain.tolist())
        self.feedback, self.sample_time, self._cutoff = feedback, sample_time, cutoff
        self._theta_dot = BandLimitedDerivative(sample_time, cutoff)
        self._alpha_dot = BandLimitedDerivative(sample_time, cutoff)

    def reset(self) -> None:
        """Forget the derivatives' past."""
        self._theta_dot.reset()
        self._alpha_dot.reset()

    def __call__(self, reference: float, theta: float, alpha: float) -> float:
        """Return the voltage (V) for a commanded servo angle (rad) and measured angles (rad)."""
        k_1, k_2, k_3, k_4 = self._gain
        return k_1 * (reference - theta) - k_2 * alpha - k_3 * self._theta_dot(theta) - k_4 * self._alpha_dot(alpha)

    @property
    def numbers(self) -> dict[str, Any]:
        """What it was made of, plain data."""
        return {"K": self.K, "feedback": self.feedback, "sample_time": self.sample_time, "cutoff": self._cutoff}

    def system(self) -> StateSpace:
        """Return the controller as a discrete system of python-control, from theta and alpha to the voltage.

        Run as a controller, the system gets theta - theta_ref for theta: its rate is that of the error, too.
        """
        angles, rates = np.array([self._gain[:2]]), np.array([self._gain[2:]])
        w_c, passed, I = self._cutoff, self._cutoff * self.sample_time, np.eye(2)
        return _system((1 - passed) * I, passed * I, w_c * rates, -angles - w_c * rates, self.sample_time)


class ObserverFeedback:
    """State feedback u = K(x_d − x̂) with x_d = [theta_d, 0, …, 0], where a discrete observer finds the state x̂.

    The observer predicts with the model, x̂⁻[k+1] = Phi x̂ + Gamma u, and corrects with the newest sample,
    x̂ = x̂⁻ + L (y − C x̂⁻). It limits its voltage to the ±10 V of a bench, so that the prediction stays right there.

    Parameters
    ----------
    Phi, Gamma : (n, n) and (n, 1) or (n,), the model from one sample to the next; its first two states are theta and
        alpha (rad). The last voltages may be states, too, where the voltage comes late
    L : (n, 1), correction by the servo's encoder alone; or (n, 2), by both encoders
    K : (n,) or (1, n), gain: V/rad for the angles, V/(rad/s) for the rates
    sample_time : s, of the model and of the loop

    Raises
    ------
    DesignError
        If one is no array of finite numbers, or the shapes do not fit each other.
    """

    def __init__(self, Phi: ArrayLike, Gamma: ArrayLike, L: ArrayLike, K: ArrayLike, sample_time: float) -> None:
        given = {"Phi": Phi, "Gamma": Gamma, "L": L, "K": K}
        self.Phi, self.Gamma, self.L, self.K = (real_array(*item, DesignError) for item in given.items())
        n = self.Phi.shape[0] if self.Phi.ndim else 0
        self.Gamma, self.K = self.Gamma.ravel(), self.K.ravel()
        shapes = self.Phi.shape == (n, n) and self.Gamma.shape == self.K.shape == (n,)
        if not shapes or self.L.shape not in ((n, 1), (n, 2)):
            raise DesignError(
                f"For a model with {n} states, Phi must be ({n}, {n}), Gamma and K must have {n} values, and L must be "
                f"({n}, 1) for the servo's encoder or ({n}, 2) for both; they are {self.Phi.shape}, "
                f"{self.Gamma.shape}, {self.K.shape} and {self.L.shape}."
            )
        if not all(np.isfinite(matrix).all() for matrix in (self.Phi, self.Gamma, self.L, self.K)):
            raise DesignError("Phi, Gamma, L or K has a value that is not finite.")
        self.sample_time = sample_time
        self.reset()

    def reset(self) -> None:
        """Begin again: the arm is at rest where the next sample finds it."""
        self._predicted: NDArray[np.float64] | None = None

    def __call__(self, reference: float, theta: float, alpha: float) -> float:
        """Return the voltage (V) for a commanded servo angle (rad) and measured angles (rad)."""
        measured = np.array([theta, alpha])[: self.L.shape[1]]
        if self._predicted is None:
            self._predicted = np.zeros(len(self.Phi))
            self._predicted[: measured.size] = measured
        state = self._predicted + self.L @ (measured - self._predicted[: measured.size])
        voltage = float(np.clip(self.K[0] * reference - self.K @ state, -DAC_LIMIT, DAC_LIMIT))
        self._predicted = self.Phi @ state + self.Gamma * voltage
        return voltage

    @property
    def numbers(self) -> dict[str, Any]:
        """What it was made of, plain data."""
        matrices = {name: getattr(self, name).tolist() for name in ("Phi", "Gamma", "L", "K")}
        return {**matrices, "sample_time": self.sample_time}

    def system(self) -> StateSpace:
        """Return the controller as a discrete system of python-control, from theta and alpha to the voltage."""
        n, gain = len(self.Phi), np.pad(self.L, ((0, 0), (0, 2 - self.L.shape[1])))
        correct, loop = np.eye(n) - gain @ np.eye(2, n), self.Phi - np.outer(self.Gamma, self.K)
        K = self.K[np.newaxis]
        return _system(loop @ correct, loop @ gain, -K @ correct, -K @ gain, self.sample_time)


class TwoDegreesOfFreedom:
    """Another controller with a feed-forward and an integrator in front of it: command + feed-forward + z.

    ż = rate · (command − theta). While the voltage is at its limit, z does not grow further in that direction
    (anti-windup by conditional integration).

    Parameters
    ----------
    controller : the other one; with an attribute ``sample_time`` (s), unless that is 2 ms
    feedforward : (n,) rad, added to the command, such as ``FlatMotion.feedforward``; zero after its end
    rate : of the integrator, 1/s; none by default
    """

    def __init__(self, controller: Controller, feedforward: ArrayLike = (), rate: float = 0.0) -> None:
        self._controller = runnable(controller)
        self.sample_time: float = getattr(self._controller, "sample_time", None) or 0.002
        self._rate, self._step = rate, rate * self.sample_time
        self._feedforward: list[float] = real_array("The feed-forward", feedforward, DesignError).ravel().tolist()
        self.reset()

    @property
    def numbers(self) -> dict[str, Any]:
        """What it was made of, plain data; raises DesignError if its other controller is none of numbers."""
        return {"controller": plain(self._controller), "feedforward": self._feedforward, "rate": self._rate}

    def reset(self) -> None:
        """Begin again at the first sample, with no sum of errors; so does the other controller."""
        self._ahead, self._sum = chain(self._feedforward, repeat(0.0)), 0.0
        if hasattr(self._controller, "reset"):
            self._controller.reset()

    def __call__(self, reference: float, theta: float, alpha: float) -> float:
        """Return the voltage (V) for a commanded servo angle (rad) and measured angles (rad)."""
        voltage = float(self._controller(reference + next(self._ahead) + self._sum, theta, alpha))
        error = reference - theta
        if abs(voltage) < DAC_LIMIT or voltage * error < 0:
            self._sum += self._step * error
        return voltage


def _system(A: ArrayLike, B: ArrayLike, C: ArrayLike, D: ArrayLike, sample_time: float) -> StateSpace:
    import control

    return control.StateSpace(A, B, C, D, sample_time, inputs=["theta", "alpha"], outputs=["vm"])


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
        self.numbers = {"K_p": K_p, "K_d": K_d, "sample_time": sample_time, "cutoff": cutoff}
        self._error_dot = BandLimitedDerivative(sample_time, cutoff)

    def reset(self) -> None:
        """Forget the derivative's past."""
        self._error_dot.reset()

    def __call__(self, reference: float, theta: float, alpha: float) -> float:
        """Return the voltage (V) for a commanded servo angle (rad) and measured angles (rad)."""
        error = reference - theta
        return self._K_p * error + self._K_d * self._error_dot(error)


class OpenLoop:
    """No feedback: the reference is the voltage."""

    numbers: Mapping[str, Any] = {}

    def __call__(self, reference: float, theta: float, alpha: float) -> float:
        """Return the reference (V) as it is."""
        return reference


_KINDS: dict[str, type] = {
    kind.__name__: kind
    for kind in (StateFeedback, ObserverFeedback, TwoDegreesOfFreedom, PositionServo, OpenLoop, SystemController)
}


def plain(controller: Controller) -> dict[str, Any]:
    """Return a controller of this module, or a discrete system, as plain data; :func:`of_plain` makes it again.

    Raises
    ------
    DesignError
        If it is another one, such as a function: no numbers say what that does.
    """
    kind = type(controller)
    if _KINDS.get(kind.__name__) is not kind:
        raise DesignError(
            f"{name_of(controller)} is Python code, which is not sent anywhere. Give a gain, a discrete system of "
            "python-control, or a controller of rotflex.hil.controllers."
        )
    of_kind: Any = controller  # each of these has numbers
    return {"kind": kind.__name__, **of_kind.numbers}


def of_plain(data: Mapping[str, Any]) -> Controller:
    """Return the controller of :func:`plain`.

    Raises
    ------
    DesignError
        If there is no such kind, or as its class says.
    TypeError, ValueError
        If its numbers are not those of its kind.
    """
    kind, numbers = str(data.get("kind")), {name: value for name, value in data.items() if name != "kind"}
    if kind not in _KINDS:
        raise DesignError(f"There is no controller {kind!r}; there are {', '.join(_KINDS)}.")
    if kind == SystemController.__name__:
        return SystemController.of(**numbers)
    if kind == TwoDegreesOfFreedom.__name__:
        numbers["controller"] = of_plain(numbers["controller"])
    made: Controller = _KINDS[kind](**numbers)
    return made
