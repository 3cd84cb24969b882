"""Pole placement: by way of the companion form, as the workbook teaches it, and by python-control.

Gains are rows (1, n), for the control law u = −K x.
In place of the matrices A and B, each function takes python-control's system: ``gain_by_place(system, desired)``.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import hankel

from rotflex.errors import DesignError
from rotflex.model import controllability, finite, natural_units, poles, system_pair
from rotflex.simulation import takes_systems
from rotflex.units import Array

__all__ = ["Transformation", "desired_poles", "gain_by_companion", "gain_by_place", "transformation"]


def __dir__() -> list[str]:
    return __all__


PAIR_TOLERANCE = 1e-6  #: of the largest pole: as exactly must complex poles be conjugate


# --- poles ------------------------------------------------------------------------------------------------------------


def desired_poles(zeta: float, omega_n: float, p_3: float, p_4: float) -> NDArray[np.complex128]:
    """Desired closed-loop poles (4,): a dominant pair and two real ones (Equations 3.11 and 3.12).

    Parameters
    ----------
    zeta : damping ratio of the dominant pair, 0 < zeta <= 1
    omega_n : its natural frequency, rad/s
    p_3, p_4 : the other two, real and negative, rad/s

    Raises
    ------
    DesignError
        If a value is no finite real number, or out of its range.
    """
    zeta, omega_n, p_3, p_4 = finite("The list [zeta, omega_n, p_3, p_4]", [zeta, omega_n, p_3, p_4])
    if not 0 < zeta <= 1:
        raise DesignError(f"The damping ratio must be above 0 and at most 1; it is {zeta:g}.")
    if not omega_n > 0:
        raise DesignError(f"The natural frequency must be a positive number of rad/s; it is {omega_n:g}.")
    for name, pole in (("p_3", p_3), ("p_4", p_4)):
        if not pole < 0:
            raise DesignError(f"{name} must be a negative real number; it is {pole:g}.")
    sigma, omega_d = zeta * omega_n, omega_n * math.sqrt(1 - zeta**2)
    return np.array([-sigma + 1j * omega_d, -sigma - 1j * omega_d, p_3, p_4])


def paired(desired: ArrayLike, count: int) -> NDArray[np.complex128]:
    """``desired`` as an array (count,) of poles that a real system can have.

    Raises
    ------
    DesignError
        If it is no list of finite numbers, if there are more or fewer than ``count``, or if a complex pole lacks its
        conjugate.
    """
    array = finite("The list of poles", desired, complex)
    if array.ndim == 2 and array.shape[1] == 1:  # a column
        array = array[:, 0]
    if array.ndim != 1:
        raise DesignError(f"The poles must be a list; the shape is {array.shape}.")
    if len(array) != count:
        raise DesignError(f"There are {count} states, so {count} poles must be given; there are {len(array)}.")
    close = PAIR_TOLERANCE * np.abs(array).max()
    for pole in array:
        if np.sum(abs(array - pole) <= close) != np.sum(abs(array - pole.conjugate()) <= close):
            raise DesignError(f"Complex poles must come in conjugate pairs; the pole {pole:.6g} lacks its partner.")
    return array


# --- by way of the companion form ------------------------------------------------------------------------------------


class Transformation(NamedTuple):
    """What :func:`transformation` finds: T, T_tilde and W = T T_tilde⁻¹, each (n, n)."""

    T: Array
    T_tilde: Array
    W: Array


@takes_systems
def transformation(A: ArrayLike, B: ArrayLike) -> Transformation:
    """Controllability matrices T and T_tilde and the W that takes (A, B) to companion form (Section 3.2.3; answer 3.7).

    W⁻¹ A W = A_tilde and W⁻¹ B = B_tilde.

    Raises
    ------
    DesignError
        If the matrices do not fit each other, or the pair is not controllable.
    """
    A, B, T = _controllable(A, B)
    polynomial = np.real(np.poly(poles(A)))
    A_tilde = np.eye(len(A), k=1)
    A_tilde[-1] = 0 - polynomial[:0:-1]
    T_tilde = controllability(A_tilde, np.eye(len(A))[:, -1:]).T
    # T_tilde⁻¹ need not be computed: its rows are the coefficients a_2, ..., a_n, 1, each row shifted by one.
    return Transformation(T, T_tilde, T @ hankel(polynomial[-2::-1]))


@takes_systems
def gain_by_companion(A: ArrayLike, B: ArrayLike, desired: ArrayLike) -> Array:
    """Gain K = K_tilde W⁻¹ (1, n) that places the poles of A − B K (Section 3.2.4; answers 3.5, 3.7 and 3.8).

    Good for teaching and for this bench. Where poles lie further apart than a factor of about 1000, W is so uneven that
    digits are lost; :func:`gain_by_place` keeps them.

    Parameters
    ----------
    A : (n, n), B : (n, 1) or (n,)
    desired : the poles (n,), complex ones in conjugate pairs

    Raises
    ------
    DesignError
        If the matrices do not fit each other, the pair is not controllable, or the poles are too few, too many or
        unpaired.
    """
    A, B = system_pair(A, B)
    wanted = np.poly(paired(desired, len(A)))
    K_tilde: Array = np.real(wanted - np.poly(poles(A)))[np.newaxis, :0:-1]  # Equation 3.10
    return K_tilde @ np.linalg.inv(transformation(A, B).W)


# --- by python-control -----------------------------------------------------------------------------------------------


@takes_systems
def gain_by_place(A: ArrayLike, B: ArrayLike, desired: ArrayLike) -> Array:
    """Gain K (1, n) that places the poles of A − B K, by python-control (answer 3.10).

    With one input there is only one such gain. ``control.acker`` finds it for repeated poles too, which
    ``control.place`` refuses. Parameters and errors are those of :func:`gain_by_companion`.
    """
    import control

    A, B, _T = _controllable(A, B)
    wanted = paired(desired, len(A))
    # Ackermann's formula is as good as its matrix of powers of A: give it units in which these are of the size of 1.
    units, rate = natural_units(A, B)
    A, B = A * units / units[:, np.newaxis] / rate, B / units[:, np.newaxis]
    try:
        K = control.acker(A, B, wanted / rate)
    except ValueError as error:
        raise DesignError(f"python-control cannot place these poles: {error}") from error
    return np.reshape(K, (1, -1)) * rate / units


def _controllable(A: ArrayLike, B: ArrayLike) -> tuple[Array, Array, Array]:
    """A, B and the controllability matrix T of a controllable pair."""
    A, B = system_pair(A, B)
    T, rank, verdict = controllability(A, B)
    if not verdict:
        raise DesignError(
            f"The pair (A, B) is not controllable: its controllability matrix has rank {rank}, not {len(A)}, so "
            "that some poles cannot be moved. Check A and B."
        )
    return A, B, T
