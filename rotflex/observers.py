"""What the encoders know of the state, and the gain of a discrete observer that finds it.

An observer runs the model beside the plant and corrects it at each sample: with x̂⁻ the prediction for this sample,

    x̂ = x̂⁻ + L (y − C x̂⁻),    x̂⁻[k+1] = Phi x̂ + Gamma u.

L is the gain of the *filter* form, which uses the newest sample. (Phi L is that of the predictor form, which does not.)
Poles p of the estimation error are placed by ``L = control.place(Phi.T, (C @ Phi).T, p).T``.
:class:`rotflex.hil.controllers.ObserverFeedback` runs it on a bench.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import matrix_balance

from rotflex.errors import DesignError
from rotflex.model import RANK_TOLERANCE, finite, system_matrix
from rotflex.sampled import period
from rotflex.simulation import zero_order_hold
from rotflex.units import Array

if TYPE_CHECKING:
    from control import StateSpace

__all__ = ["Observability", "gramian", "kalman_gain", "observability", "observer_poles", "process_noise", "uncertainty"]


def __dir__() -> list[str]:
    return __all__


class Observability(NamedTuple):
    """What :func:`observability` finds: the matrix (n p, n), its rank, and whether the pair is observable."""

    matrix: Array
    rank: int
    observable: bool


def observability(A: ArrayLike, C: ArrayLike) -> Observability:
    """Observability matrix [C; CA; …; CAⁿ⁻¹], its rank, and the verdict rank = n.

    The powers of A differ by many powers of ten. So the rank is found in balanced units, with A scaled to norm 1.

    Raises
    ------
    DesignError
        If A is not square, or C does not have as many columns.
    """
    import control

    A, C = _pair(A, C)
    balanced, units = matrix_balance(A, permute=False)
    size = np.linalg.norm(balanced, 2) or 1.0
    scaled = control.obsv(balanced / size, C @ units)
    rank = int(np.linalg.matrix_rank(scaled, tol=RANK_TOLERANCE * np.linalg.norm(scaled, 2)))
    return Observability(np.asarray(control.obsv(A, C)), rank, rank == len(A))


def gramian(A: ArrayLike, C: ArrayLike, horizon: float) -> Array:
    """Observability Gramian (n, n) over a finite time, ∫ exp(Aᵀt) CᵀC exp(At) dt from 0 to ``horizon`` (s).

    The Gramian over all time, ``control.gram``, does not exist for a plant with an integrator, as this one is. This
    one integrates Lyapunov's equation Ẇ = AᵀW + WA + CᵀC from zero, as a linear system with a constant input. (Van
    Loan's block exponential has exp(−At) in it, which grows without bound where A is stable.)
    """
    A, C = _pair(A, C)
    I = np.eye(len(A))
    return zero_order_hold(np.kron(A.T, I) + np.kron(I, A.T), (C.T @ C).reshape(-1, 1), horizon)[1].reshape(A.shape)


def uncertainty(A: ArrayLike, C: ArrayLike, horizon: float, sample_time: float, resolution: float) -> Array:
    """Standard deviation (n,) of the state at the start, from samples of the outputs until ``horizon``.

    Rounding to ``resolution`` (rad) counts as noise of variance resolution²/12, independent from sample to sample.
    The covariance is sample_time resolution²/12 times the inverse of :func:`gramian`.

    Raises
    ------
    DesignError
        If the pair is not observable.
    """
    if not observability(A, C).observable:
        raise DesignError("From these outputs the state cannot be known: the pair (A, C) is not observable.")
    inverse = np.linalg.inv(gramian(A, C, horizon))
    return np.asarray(resolution * np.sqrt(sample_time / 12 * np.diag(inverse)))


# --- observers --------------------------------------------------------------------------------------------------------


def process_noise(plant: StateSpace, *sources: tuple[Array, float]) -> Array:
    """Covariance (n, n) of what disturbs a sampled plant between two samples.

    Parameters
    ----------
    plant : sampled
    sources : pairs of the effect (4,) or (4, 1) on the state of one unit that is held for a sample time, such as
        ``sample(A, B, h).B``, and the standard deviation of the disturbance in that unit
    """
    noise = np.zeros((plant.nstates, plant.nstates))
    for effect, deviation in sources:
        column = np.ravel(effect)
        noise[: column.size, : column.size] += deviation**2 * np.outer(column, column)
    return noise


def kalman_gain(plant: StateSpace, process: ArrayLike, resolution: float, servo_only: bool = False) -> Array:
    """Gain L (n, p) of the stationary Kalman filter, in filter form.

    Parameters
    ----------
    plant : sampled, with the outputs theta and alpha
    process : (n, n), covariance of the process noise, see :func:`process_noise`
    resolution : of the encoders, rad; their rounding counts as noise of variance resolution²/12
    servo_only : use the servo's encoder alone

    Raises
    ------
    DesignError
        If the plant is in continuous time, or the covariance has a value that is not finite.
    """
    import control

    period(plant)
    C = plant.C[:1] if servo_only else plant.C
    R = np.eye(len(C)) * resolution**2 / 12
    _L, P, _poles = control.dlqe(plant.A, np.eye(plant.nstates), C, finite("The process noise", process), R)
    return np.asarray(P @ C.T @ np.linalg.inv(C @ P @ C.T + R))


def observer_poles(plant: StateSpace, L: ArrayLike) -> NDArray[np.complex128]:
    """Poles (n,) in z of the estimation error, (I − L C) Phi, for a gain L (n, p) on the first p outputs."""
    gain = finite("L", L).reshape(plant.nstates, -1)
    return np.linalg.eigvals(plant.A - gain @ plant.C[: gain.shape[1]] @ plant.A).astype(complex)


def _pair(A: ArrayLike, C: ArrayLike) -> tuple[Array, Array]:
    """A (n, n) and C (p, n), checked; a C of shape (n,) is one row."""
    A, C = system_matrix(A), np.atleast_2d(finite("C", C))
    if C.shape[1] != len(A):
        raise DesignError(f"C must have a column for each of the {len(A)} states; its shape is {C.shape}.")
    return A, C
