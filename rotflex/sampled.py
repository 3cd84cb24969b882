"""Design for a controller that samples: the plant from one sample to the next, with hold and delay.

The program reads the encoders every ``sample_time`` seconds, and holds each voltage until the next one. Between two
samples the plant is therefore exactly x[k+1] = Phi x[k] + Gamma u[k]. A voltage that comes late still acts in the next
interval, so earlier voltages become states (Åström and Wittenmark, *Computer-Controlled Systems*, section 2.3)::

    plant = sampled.sample(model.state_space(servo, joint, K_s), sample_time=0.02, delay=0.002)
    K = sampled.gain_by_place(plant, design.desired_poles(0.6, 20, -30, -40))
    K = control.dlqr(plant, Q, R)[0]              # or by weights
    L = observers.kalman_gain(plant, ...)
    controller = ObserverFeedback(plant.A, plant.B, L, K, 0.02)
    print(sampled.margins(plant, controller.system()))
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq

from rotflex import design
from rotflex.errors import DesignError
from rotflex.simulation import STATES, matrices, takes_systems, zero_order_hold
from rotflex.units import Array

if TYPE_CHECKING:
    from control import StateSpace

__all__ = ["Margins", "emulated_poles", "gain_by_place", "longest_sample_time", "margins", "poles_in_z", "sample"]


def __dir__() -> list[str]:
    return __all__


LONGEST_SAMPLE_TIME = 0.1  #: s; the longest sample time that :func:`longest_sample_time` looks at
_TRIED = 200  # sample times up to it
_BAND, _FREQUENCIES = (1e-4, 1.01), 1000  # of the Nyquist frequency, at and beyond which a crossing may lie


@takes_systems
def sample(A: ArrayLike, B: ArrayLike, sample_time: float, delay: float = 0.0) -> StateSpace:
    """Sample a plant with a zero-order hold and an input delay.

    Parameters
    ----------
    A, B : (4, 4) and (4, 1) or (4,), in continuous time; or a system of python-control in place of the two
    sample_time : s
    delay : of the voltage, s; it may be longer than a sample time

    Returns
    -------
    control.StateSpace
        In discrete time. Its states are the plant's and, with a delay, the last voltages (u_1 is the latest one).
        Its input is vm, and its outputs are theta and alpha.

    Raises
    ------
    DesignError
        If the matrices do not fit each other, the sample time is not positive, or the delay is negative.
    """
    import control

    A, B = matrices(A, B)
    if not 0 < sample_time < np.inf or not 0 <= delay < np.inf:
        raise DesignError(
            f"The sample time must be positive and the delay not negative, both in s; they are {sample_time!r} and "
            f"{delay!r}."
        )
    old = math.ceil(delay / sample_time - 1e-9)  # earlier voltages that still act; 1e-9 for rounding
    late = delay - (old - 1) * sample_time if old else 0.0  # how long the oldest of them acts
    (Phi_1, Gamma_1), (Phi_0, Gamma_0) = zero_order_hold(A, B, late), zero_order_hold(A, B, sample_time - late)
    n = len(STATES)
    inputs = np.zeros((n, old + 1))  # what u[k], u[k-1], … do until the next sample
    inputs[:, [old]] += Phi_0 @ Gamma_1
    inputs[:, [max(old - 1, 0)]] += Gamma_0
    Phi, Gamma = np.eye(n + old, k=-1), np.eye(n + old, 1, k=-n)
    Phi[: n + 1] = 0
    Phi[:n, :n], Phi[:n, n:], Gamma[:n] = Phi_0 @ Phi_1, inputs[:, 1:], inputs[:, :1]
    named = {"inputs": ["vm"], "outputs": list(STATES[:2]), "states": [*STATES, *(f"u_{i + 1}" for i in range(old))]}
    return control.StateSpace(Phi, Gamma, np.eye(2, n + old), np.zeros((2, 1)), sample_time, **named)


def period(plant: StateSpace) -> float:
    """Sample time (s) of a sampled plant.

    Raises
    ------
    DesignError
        If the plant is in continuous time.
    """
    if not plant.isdtime(strict=True):
        raise DesignError("The plant is in continuous time. Sample it first: sampled.sample(plant, sample_time).")
    return float(plant.dt)


# --- poles and gains --------------------------------------------------------------------------------------------------


def poles_in_z(desired: ArrayLike, plant: StateSpace) -> NDArray[np.complex128]:
    """Map desired poles (4,), rad/s, to z = exp(s sample_time), and add a zero for each voltage that is a state."""
    mapped = np.exp(design.paired(desired, len(STATES)) * period(plant))
    return np.concatenate([mapped, np.zeros(plant.nstates - mapped.size)])


def gain_by_place(plant: StateSpace, desired: ArrayLike) -> Array:
    """Gain K (1, n) that gives a sampled plant the behaviour of desired poles in s (4,), rad/s.

    Raises
    ------
    DesignError
        If there are not four poles, one is unpaired, or the plant is in continuous time or not controllable.
    """
    return design.gain_by_place(plant.A, plant.B, poles_in_z(desired, plant))


def emulated_poles(plant: StateSpace, K: ArrayLike) -> NDArray[np.complex128]:
    """Return the poles in z of a sampled plant under a continuous design K (4,).

    The rates are differences of two samples, as ``StateFeedback(K, sample_time=h, cutoff=1 / h)`` has them. The angles
    of the last sample are two more states.
    """
    angles, rates = np.hsplit(np.reshape(K, (1, 4)), 2)
    rates = rates / period(plant)
    loop = np.block([[plant.A - plant.B @ (angles + rates) @ plant.C, plant.B @ rates], [plant.C, np.zeros((2, 2))]])
    return np.linalg.eigvals(loop).astype(complex)


@takes_systems
def longest_sample_time(A: ArrayLike, B: ArrayLike, K: ArrayLike, delay: float = 0.0) -> float:
    """Longest sample time (s) up to which a continuous design K (4,) stays stable with differences for rates.

    Returns
    -------
    float
        ``LONGEST_SAMPLE_TIME`` (0.1 s) if the loop is stable up to there, and 0 if it is not even stable at 0.5 ms.
    """

    def growth(sample_time: float) -> float:
        return float(np.abs(emulated_poles(sample(A, B, sample_time, delay), K)).max()) - 1

    times = np.linspace(0, LONGEST_SAMPLE_TIME, _TRIED + 1)[1:]
    lost = next((place for place, time in enumerate(times) if growth(float(time)) >= 0), None)
    if lost is None:
        return LONGEST_SAMPLE_TIME
    return float(brentq(growth, times[lost - 1], times[lost])) if lost else 0.0


# --- robustness -------------------------------------------------------------------------------------------------------


class Margins(NamedTuple):
    """How far a loop is from instability.

    Attributes
    ----------
    sensitivity_peak : M_s, the largest |1/(1 + L)|; the Nyquist curve keeps a distance of 1/M_s from -1
    gain : factor by which the loop gain may grow
    phase : deg
    delay : s, by which the voltage may come later. It is the phase margin over the crossing's frequency, the least of
        all crossings. Where a crossing is near the Nyquist frequency, the loop bears a little less
    """

    sensitivity_peak: float
    gain: float
    phase: float
    delay: float


def margins(plant: StateSpace, controller: StateSpace) -> Margins:
    """Margins of the loop that is broken at the motor voltage, hold, delay and controller included.

    Parameters
    ----------
    plant : sampled, from vm to the two angles
    controller : from the two angles to vm, with the minus inside, as ``StateFeedback.system`` gives it; same sample
        time. Of a controller from the error theta_ref - theta to vm it is ``-controller``, with ``plant[0, 0]``

    Raises
    ------
    DesignError
        If the closed loop is unstable: then it has no margins.
    """
    import control

    loop = -(controller * plant)
    if np.abs(control.feedback(loop, 1).poles()).max() >= 1:
        raise DesignError("The closed loop is unstable, so it has no margins.")
    nyquist = np.pi / period(plant)
    omega = np.geomspace(*_BAND, _FREQUENCIES) * nyquist
    response = loop(np.exp(1j * omega * plant.dt))
    gains, phases, distances, _omega_180, omega_c, _omega_s = control.stability_margins(
        control.FRD(response, omega), returnall=True
    )
    phases, omega_c = phases[omega_c <= nyquist], omega_c[omega_c <= nyquist]  # those beyond are mirror images
    return Margins(
        float(1 / np.min(distances, initial=np.abs(1 + response).min())),
        float(np.min(gains[gains > 1], initial=np.inf)),
        float(np.min(np.abs(phases), initial=np.inf)),
        float(np.min(np.deg2rad(np.mod(phases, 360)) / omega_c, initial=np.inf)),
    )
