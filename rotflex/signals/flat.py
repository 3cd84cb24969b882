"""Commands from the flat output: the motion is chosen, and angles and voltage follow from it without integration.

Where the damping B_l of the link is neglected, the direction of the link in the room, γ = θ + α, is a flat output
(Fliess and others, 1995): with a = K_s/J_l and the second equation of motion,

    α = −γ̈/a,    θ = γ − α,    V_m from the first equation of motion.

So a motion γ that starts and ends smoothly leaves no swing. In a turn of half a second, on benches of this laboratory,
the neglected B_l α̇ is less than 5 % of the largest spring torque.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import ArrayLike, NDArray

from rotflex.errors import DesignError
from rotflex.simulation import matrices, takes_systems
from rotflex.units import Vector

__all__ = ["FlatMotion", "turn"]


def __dir__() -> list[str]:
    return __all__


SMOOTH = 4  #: derivatives of γ that are zero at both ends, so that the voltage has no jump there


class FlatMotion(NamedTuple):
    """A motion of all states, with the voltage that makes it.

    Attributes
    ----------
    time : (n,) s
    states : (4, n) theta, alpha (rad) and their rates (rad/s)
    volts : (n,) V
    """

    time: Vector
    states: NDArray[np.float64]
    volts: Vector

    def feedforward(self, K: ArrayLike, friction: float = 0.0) -> Vector:
        """What to add (n,), rad, to the command theta of a state feedback K (4,), so that it sets these volts.

        The feedback is u = K (x_d − x) with x_d = [command, 0, 0, 0]. It sets volts + K (states − x) for the command
        (volts + K states)/K_1.

        Parameters
        ----------
        K : gain, V/rad and V/(rad/s)
        friction : V, that overcome the servo's friction while it moves
        """
        gain = np.ravel(K)[:4]
        helped = self.volts + friction * np.sign(np.round(self.states[2], 2))  # not below 0.005 rad/s
        return np.asarray((helped + gain @ self.states) / gain[0] - self.states[0])


@takes_systems
def turn(A: ArrayLike, B: ArrayLike, angle: float, duration: float, time: ArrayLike, start: float = 0.0) -> FlatMotion:
    """Turn by ``angle`` (rad) in ``duration`` (s), from rest to rest.

    Parameters
    ----------
    A, B : (4, 4) and (4, 1) or (4,), the model with the motor voltage as input; its damping of the link is neglected
    angle, duration : of the turn
    time : (n,) s, at which to evaluate the motion
    start : s

    Raises
    ------
    DesignError
        If the duration is not positive, or the model has no spring.
    """
    A, B = matrices(A, B)
    servo, spring = A[2], -(A[2, 1] + A[3, 1])  # spring is K_s/J_l
    if not duration > 0 or not spring > 0:
        raise DesignError(f"A turn needs a positive duration ({duration!r} s) and a spring (K_s/J_l is {spring:.3g}).")
    x = Polynomial([0.0, 1.0])
    bell = (x**SMOOTH * (1 - x) ** SMOOTH).integ()
    path, at = bell / bell(1.0) * angle, np.clip((np.asarray(time, dtype=float) - start) / duration, 0.0, 1.0)
    gamma, rate, acceleration, third, fourth = (path.deriv(k)(at) / duration**k if k else path(at) for k in range(5))
    alpha, alpha_dot, alpha_ddot = (-value / spring for value in (acceleration, third, fourth))
    states = np.array([gamma - alpha, alpha, rate - alpha_dot, alpha_dot])
    volts = (acceleration - alpha_ddot - servo[1] * alpha - servo[2] * states[2]) / B[2, 0]
    return FlatMotion(np.asarray(time, dtype=float), states, volts)
