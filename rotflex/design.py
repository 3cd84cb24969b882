"""Pole placement: by way of the companion form, as the workbook teaches it, and by python-control.

Polynomials are arrays of coefficients, highest power first, as numpy and python-control have them. The workbook counts
the coefficients from the other end: sⁿ + a_n sⁿ⁻¹ + ... + a_1. Gains are rows (1, n), for the control law u = −K x.
In place of the matrices A and B, each function takes python-control's system: ``gain_by_place(system, desired)``.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import hankel

from rotflex.errors import DesignError
from rotflex.model import STATES, Array, controllability, finite, natural_units, poles, system_pair
from rotflex.simulation import takes_systems

if TYPE_CHECKING:
    from control import StateSpace

__all__ = [
    "Transformation",
    "characteristic_polynomial",
    "check_placement",
    "closed_loop",
    "companion",
    "companion_gain",
    "desired_poles",
    "gain_by_companion",
    "gain_by_place",
    "transformation",
]


def __dir__() -> list[str]:
    return __all__


PAIR_TOLERANCE = 1e-6  #: of the largest pole: as exactly must complex poles be conjugate
SMALL_POLE = 1e-2  #: of the largest pole: a smaller one is checked no more closely than one of this size


# --- poles and polynomials -------------------------------------------------------------------------------------------


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


def paired(desired: ArrayLike, count: int | None = None) -> NDArray[np.complex128]:
    """``desired`` as an array (n,) of poles that a real system can have; ``count`` says how many there must be.

    Raises
    ------
    DesignError
        If it is no list of finite numbers, if there are more or fewer than ``count``, or if a complex pole lacks its
        conjugate.
    """
    array = finite("The list of poles", desired, complex)
    if array.ndim != 1:
        raise DesignError(f"The poles must be a list; the shape is {array.shape}.")
    if count is not None and len(array) != count:
        raise DesignError(f"There are {count} states, so {count} poles must be given; there are {len(array)}.")
    close = PAIR_TOLERANCE * np.abs(array).max()
    for pole in array:
        if np.sum(abs(array - pole) <= close) != np.sum(abs(array - pole.conjugate()) <= close):
            raise DesignError(f"Complex poles must come in conjugate pairs; the pole {pole:.6g} lacks its partner.")
    return array


def characteristic_polynomial(poles_or_A: ArrayLike) -> Array:
    """Characteristic polynomial (n + 1,), highest power first and 1, of poles (n,) or of a matrix A (n, n).

    Raises
    ------
    DesignError
        If it is neither a list of poles in conjugate pairs nor a square matrix of finite real numbers.
    """
    is_matrix = finite("What is given as poles or A", poles_or_A, complex).ndim == 2
    return np.real(np.poly(poles(poles_or_A) if is_matrix else paired(poles_or_A)))


def _monic(polynomial: ArrayLike) -> Array:
    """A polynomial divided by its leading coefficient."""
    coefficients = finite("The polynomial", polynomial)
    if coefficients.ndim != 1 or len(coefficients) < 2 or coefficients[0] == 0:
        raise DesignError(
            "A polynomial must be a list of at least two coefficients, highest power first and not zero; it is "
            f"{polynomial!r}."
        )
    monic: Array = coefficients / coefficients[0]
    return monic


# --- by way of the companion form ------------------------------------------------------------------------------------


class Transformation(NamedTuple):
    """What :func:`transformation` finds: T, T_tilde and W = T T_tilde⁻¹, each (n, n)."""

    T: Array
    T_tilde: Array
    W: Array


def companion(polynomial: ArrayLike) -> tuple[Array, Array]:
    """Companion matrices A_tilde (n, n) and B_tilde (n, 1) of a polynomial (n + 1,) (Equations 3.4 and 3.5).

    Raises
    ------
    DesignError
        If it is no list of two or more coefficients that starts with one other than zero.
    """
    a = _monic(polynomial)[:0:-1]  # a_1, ..., a_n
    A_tilde = np.eye(len(a), k=1)
    A_tilde[-1] = 0 - a
    B_tilde = np.zeros((len(a), 1))
    B_tilde[-1] = 1
    return A_tilde, B_tilde


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
    polynomial = characteristic_polynomial(A)
    T_tilde = controllability(*companion(polynomial)).T
    # T_tilde⁻¹ need not be computed: its rows are the coefficients a_2, ..., a_n, 1, each row shifted by one.
    return Transformation(T, T_tilde, T @ hankel(polynomial[-2::-1]))


def companion_gain(polynomial: ArrayLike, desired: ArrayLike) -> Array:
    """Gain K_tilde (1, n) that turns the polynomial of a companion form into the desired one (Equation 3.10).

    Raises
    ------
    DesignError
        If one is no polynomial, or their degrees differ.
    """
    before, after = _monic(polynomial), _monic(desired)
    if len(before) != len(after):
        raise DesignError(
            f"The polynomials must be of the same degree; they are of degree {len(before) - 1} and {len(after) - 1}."
        )
    return (after - before)[np.newaxis, :0:-1]


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
    wanted = characteristic_polynomial(paired(desired, len(A)))
    K_tilde = companion_gain(characteristic_polynomial(A), wanted)
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


@takes_systems
def check_placement(A: ArrayLike, B: ArrayLike, K: ArrayLike, desired: ArrayLike, rtol: float = 1e-6) -> bool:
    """Whether K places the poles of A − B K where they are wanted (answer 3.9).

    What is compared are the coefficients of the characteristic polynomials: each may be off by ``rtol`` of what it
    would be were the poles as large as they are but all real and negative. Poles themselves will not do: where p of
    them coincide, an error of 1e-16 moves each by the p-th root of that.

    Parameters
    ----------
    A : (n, n), B : (n, 1) or (n,)
    K : (1, n) or (n,)
    desired : the poles (n,), complex ones in conjugate pairs
    rtol : the tolerance, above zero

    Raises
    ------
    DesignError
        If the matrices do not fit each other, the poles are too few, too many or unpaired, or the tolerance is not
        above zero.
    """
    A, B = system_pair(A, B)
    gain = finite("K", K)
    if gain.shape not in ((1, len(A)), (len(A),)):
        raise DesignError(f"K must be one row with a gain for each state, {(1, len(A))}; it is {gain.shape}.")
    if not rtol > 0:
        raise DesignError(f"The tolerance must be above zero; it is {rtol!r}.")
    wanted = paired(desired, len(A))
    sizes = np.abs(wanted)
    scale = np.poly(-np.maximum(sizes, SMALL_POLE * sizes.max()))
    got = characteristic_polynomial(A - B @ gain.reshape(1, -1))
    return bool(np.all(np.abs(got - characteristic_polynomial(wanted)) <= rtol * scale))


# --- the loop --------------------------------------------------------------------------------------------------------


def closed_loop(system: StateSpace, K: ArrayLike) -> StateSpace:
    """The plant with the state feedback V_m = K (x_d − x), x_d = [theta_ref, 0, 0, 0] (Equations 3.13 and 3.14).

    Parameters
    ----------
    system : the model for voltage input, as :func:`rotflex.model.state_space` returns it
    K : (1, 4) or (4,)

    Returns
    -------
    control.StateSpace
        The states of ``system``; input theta_ref (rad), outputs theta, alpha (rad) and V_m (V).

    Raises
    ------
    DesignError
        If the system has no voltage input or other states, or K is not four finite numbers.
    """
    import control

    gain = finite("K", K)
    if system.input_labels != ["V_m"] or tuple(system.state_labels) != STATES:
        raise DesignError(f"The system must have the input V_m and the states {', '.join(STATES)}; it is {system!r}.")
    if gain.shape not in ((1, 4), (4,)):
        raise DesignError(f"K must be one row with a gain for each state, (1, 4); it is {gain.shape}.")
    gain = gain.reshape(1, 4)
    return control.StateSpace(
        system.A - system.B @ gain,
        system.B * gain[0, 0],
        np.vstack([system.C - system.D @ gain, -gain]),
        np.vstack([system.D * gain[0, 0], gain[:, :1]]),
        states=list(STATES),
        inputs=["theta_ref"],
        outputs=[*system.output_labels, "V_m"],
        name="closed_loop",
    )


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
