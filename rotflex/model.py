"""The linear model of the rotary flexible joint, and what its poles and its controllability say.

The state is x = [theta, alpha, theta_dot, alpha_dot], in rad and rad/s; the outputs are the two angles. With the torque
tau at the load gear as input,

    J_eq θ̈ = tau − B_eq θ̇ + K_s α + B_l α̇,
    J_l (θ̈ + α̈) = −K_s α − B_l α̇.

:mod:`rotflex.symbolic` derives these equations. Here they are typed once more, as numbers, and the tests
hold the two together.
"""

from __future__ import annotations

import math
from numbers import Real
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotflex.config import Joint, Servo, one_of, positive
from rotflex.errors import ConfigurationError, DesignError
from rotflex.plant import Plant, PlantParameters, State
from rotflex.simulation import STATES, takes_systems, with_actuator
from rotflex.units import Array

if TYPE_CHECKING:
    from control import NonlinearIOSystem, StateSpace

    from rotflex.greybox import FitResult

__all__ = [
    "INPUTS",
    "OUTPUTS",
    "STATES",
    "Controllability",
    "controllability",
    "nonlinear",
    "of_fit",
    "of_plant",
    "poles",
    "stability",
    "state_space",
]


def __dir__() -> list[str]:
    return __all__


OUTPUTS = ("theta", "alpha")
INPUTS = ("voltage", "torque")
_NAMED = {"states": [*STATES], "inputs": ["vm"], "outputs": [*OUTPUTS], "name": "rotary_flexible_joint"}

POLE_TOLERANCE = 1e-6  #: of the largest pole: typed with seven digits
_DELAY_ORDER = 2  # of the approximation of a delay; the phase of 2 ms is exact to 0.01 deg up to 50 Hz
RANK_TOLERANCE = 1e-10  #: of the largest singular value of A, in balanced or natural units; far above rounding


# --- matrices --------------------------------------------------------------------------------------------------------


def finite(name: str, value: ArrayLike, dtype: type = float) -> NDArray[Any]:
    """``value`` as a non-empty array of finite real (or, with ``dtype=complex``, complex) numbers.

    Raises
    ------
    DesignError
        If it is not; the message calls it ``name``.
    """
    try:
        array = np.asarray(value)
    except ValueError:
        raise DesignError(f"{name} has rows of different lengths.") from None
    if array.dtype.kind not in ("iufc" if dtype is complex else "iuf"):
        raise DesignError(f"{name} must hold {'' if dtype is complex else 'real '}numbers; it is {value!r}.")
    if array.size == 0 or not np.isfinite(array).all():
        raise DesignError(f"{name} must hold finite numbers, at least one; it is {value!r}.")
    return array.astype(dtype)


def system_matrix(A: ArrayLike) -> Array:
    """``A`` as an array (n, n).

    Raises
    ------
    DesignError
        If it is no square matrix of finite real numbers.
    """
    matrix = finite("A", A)
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1]:
        raise DesignError(f"A must be a square matrix; its shape is {matrix.shape}.")
    return matrix


def system_pair(A: ArrayLike, B: ArrayLike) -> tuple[Array, Array]:
    """``A`` as an array (n, n) and ``B`` as a column (n, 1); a B of shape (n,) is taken as that column.

    Raises
    ------
    DesignError
        If A is not square, or B is not one column of as many rows.
    """
    A, B = system_matrix(A), finite("B", B)
    column = B[:, np.newaxis] if B.ndim == 1 else B
    if column.shape != (A.shape[0], 1):
        raise DesignError(f"B must be one column with a row for each row of A, {(A.shape[0], 1)}; it is {B.shape}.")
    return A, column


# --- the model -------------------------------------------------------------------------------------------------------


def state_space(
    servo: Servo, joint: Joint, stiffness: float, input: str = "voltage", link_damping: float | None = None
) -> StateSpace:
    """The linear model of servo and joint (Section 2.1.4; answers 2.7 and 2.13).

    Parameters
    ----------
    servo, joint : the parts
    stiffness : K_s of the joint, N·m/rad
    input : "voltage" (the motor's, V) or "torque" (at the load gear, N·m)
    link_damping : B_l, N·m/(rad/s); by default that of ``joint``

    Returns
    -------
    control.StateSpace
        A (4, 4), B (4, 1), C (2, 4), D (2, 1); states theta, alpha, theta_dot, alpha_dot; input vm or tau; outputs
        theta and alpha.

    Raises
    ------
    ConfigurationError
        If the stiffness is not a positive number, the damping a negative one, or the input none of the two.
    """
    one_of("input", input, INPUTS)
    K_s, B_l = stiffness, joint.B_l if link_damping is None else link_damping
    if not (isinstance(K_s, Real) and 0 < K_s < math.inf):
        raise ConfigurationError(f"stiffness must be a positive number of N·m/rad; it is {K_s!r}.")
    if not (isinstance(B_l, Real) and 0 <= B_l < math.inf):
        raise ConfigurationError(f"link_damping must be a number of N·m/(rad/s), not negative; it is {B_l!r}.")
    system = _driven_by_torque(servo.J_eq, servo.B_eq, joint.J_l, B_l, K_s)
    return with_actuator(system, servo) if input == "voltage" else system


def _driven_by_torque(J_eq: float, B_eq: float, J_l: float, B_l: float, K_s: float) -> StateSpace:
    """Return the linear model with the torque at the load gear as input, SI units."""
    import control

    both = 1 / J_eq + 1 / J_l
    A = np.array(
        [
            [0, 0, 1, 0],
            [0, 0, 0, 1],
            [0, K_s / J_eq, -B_eq / J_eq, B_l / J_eq],
            [0, -K_s * both, B_eq / J_eq, -B_l * both],
        ]
    )
    A += 0.0  # turns -0.0, which reads badly, into 0.0
    B = np.array([[0], [0], [1 / J_eq], [-1 / J_eq]])
    return control.StateSpace(A, B, np.eye(2, 4), np.zeros((2, 1)), **{**_NAMED, "inputs": ["tau"]})


def of_plant(parameters: PlantParameters, delay: float = 0.0) -> StateSpace:
    """Return the linear model of a plant, from the motor voltage to the two angles.

    It leaves out Coulomb friction, the cubic spring and the amplifier's limits; :func:`nonlinear` has them.

    Parameters
    ----------
    parameters : the plant
    delay : of the voltage, s. It is approximated (Padé, second order), and has the last two of six states then.
        ``sampled.sample(plant, sample_time, delay)`` is exact from sample to sample

    Returns
    -------
    control.StateSpace
        States, input vm and outputs as :func:`state_space` has them.

    Raises
    ------
    ConfigurationError
        If the delay is negative or not finite.
    """
    import control

    p = parameters
    if not 0 <= delay < math.inf:
        raise ConfigurationError(f"delay must be a number of seconds, not negative; it is {delay!r}.")
    braking = p.torque_per_volt * p.back_emf  # by the motor's own voltage, when the servo turns
    torque = _driven_by_torque(p.J_eq, p.B_eq + braking, p.J_l, p.B_l, p.K_s)
    late = control.tf2ss(*control.pade(delay, _DELAY_ORDER)) if delay else control.ss([], [], [], 1.0)
    B = torque.B * p.torque_per_volt
    A = np.block([[torque.A, B @ late.C], [np.zeros((late.nstates, 4)), late.A]])
    named = {**_NAMED, "states": [*STATES, *(f"delay_{i + 1}" for i in range(late.nstates))]}
    return control.StateSpace(A, np.vstack([B @ late.D, late.B]), np.eye(2, len(A)), np.zeros((2, 1)), **named)


def of_fit(found: FitResult, delay: bool = False) -> StateSpace:
    """Return the linear model of a fitted plant, see :func:`of_plant`; with the fitted delay if ``delay`` is set.

    Examples
    --------
    >>> found = greybox.fit(recording, servo, joint)             # doctest: +SKIP
    >>> K = control.lqr(model.of_fit(found), np.eye(4), 1)[0]    # doctest: +SKIP
    """
    return of_plant(found.parameters, found.delay if delay else 0.0)


def nonlinear(parameters: PlantParameters, sample_time: float = 0.002) -> NonlinearIOSystem:
    """Return a plant with its friction and its limits as a discrete system of python-control.

    A step of it is :meth:`rotflex.plant.Plant.advance`: from a state on, it gives the same to the last bit.

    Parameters
    ----------
    parameters : the plant
    sample_time : s, for which each voltage is held

    Returns
    -------
    control.NonlinearIOSystem
        States theta, alpha, theta_dot, alpha_dot; input vm; outputs theta and alpha.

    Raises
    ------
    ConfigurationError
        If the sample time is not positive.
    """
    import control

    positive("sample_time", sample_time, "s")
    moving = Plant(parameters)

    def update(_t: float, x: Array, u: Array, _params: object) -> Array:
        nonlocal moving
        state = State(*x.tolist())
        if state != moving.state:  # else it goes on: a plant remembers which of its joints stood
            moving = Plant(parameters, state)
        return np.array(moving.advance(float(u[0]), sample_time))

    return control.NonlinearIOSystem(update, lambda _t, x, _u, _params: x[:2], dt=sample_time, **_NAMED)


# --- poles and stability ---------------------------------------------------------------------------------------------


def poles(A: ArrayLike) -> NDArray[np.complex128]:
    """Poles (n,) of a system: the eigenvalues of A, by rising real part (Equation 3.1).

    Raises
    ------
    DesignError
        If A is no square matrix of finite real numbers.
    """
    return np.sort_complex(np.linalg.eigvals(system_matrix(A)).astype(complex))


def stability(poles_or_A: ArrayLike) -> str:
    """Whether a system is stable, from its poles (n,) or (n, 1), or its matrix A (n, n) (Section 3.2.1).

    * "stable": all poles have negative real parts;
    * "unstable": a pole has a positive real part, or one on the imaginary axis is repeated;
    * "marginally stable": anything else, that is, there are poles on the imaginary axis.

    A pole is on the axis, or equal to another, to within ``POLE_TOLERANCE`` of the largest.

    Raises
    ------
    DesignError
        If it is neither a list of poles nor a square matrix of finite real numbers.
    """
    values = finite("What is given as poles or A", poles_or_A, complex)
    if values.ndim == 2:
        values = values[:, 0] if values.shape[1] == 1 < values.shape[0] else poles(poles_or_A)
    if values.ndim != 1:
        raise DesignError(f"Poles must be a list, (n,), and A a matrix, (n, n); this is {values.shape}.")
    tolerance = POLE_TOLERANCE * np.abs(values).max()
    if (values.real > tolerance).any():
        return "unstable"
    on_axis = np.sort(values.imag[np.abs(values.real) <= tolerance])
    if not on_axis.size:
        return "stable"
    return "unstable" if (np.diff(on_axis) <= 2 * tolerance).any() else "marginally stable"


# --- controllability -------------------------------------------------------------------------------------------------


def natural_units(A: Array, B: Array) -> tuple[Array, float]:
    """Units of the states (n,), and a rate, in which an (A, B) of any origin is of the size of 1.

    A state's unit is how far B can get into it in fewer than n steps of A / rate, if nothing cancels. With
    ``units, rate = natural_units(A, B)``, the scaled pair is ``A * units / units[:, None] / rate``,
    ``B / units[:, None]``, and a gain K for (A, B) becomes ``K * units / rate``. The scaled pair is the same whatever
    units A and B were in.
    """
    size = np.abs(A)
    rate = float(np.abs(np.linalg.eigvals(size)).max()) or 1.0  # it is zero for integrators in a row
    steps = [np.abs(B[:, 0])]
    for _step in range(len(A) - 1):
        steps.append(size @ steps[-1] / rate)
    units: Array = np.max(steps, axis=0)
    return np.where(units > 0, units, 1.0), rate


class Controllability(NamedTuple):
    """What :func:`controllability` finds: the matrix T (n, n), its rank, and whether the system is controllable."""

    T: Array
    rank: int
    controllable: bool


@takes_systems
def controllability(A: ArrayLike, B: ArrayLike) -> Controllability:
    """Controllability matrix T = [B, AB, ..., Aⁿ⁻¹B], its rank, and the verdict rank = n (Equations 3.2 and 3.3).

    The columns of T differ by many powers of ten, so that its singular values say little. The rank is found in natural
    units by Arnoldi's method: A is applied to the last vector of an orthonormal basis, which begins with B. The result
    is made orthogonal to the basis, and counts if its norm exceeds ``RANK_TOLERANCE`` times the spectral norm of A.

    Raises
    ------
    DesignError
        If A is not square, or B is not one column of as many rows.
    """
    A, B = system_pair(A, B)
    n = len(A)
    columns = [B]
    for _step in range(n - 1):
        columns.append(A @ columns[-1])

    units, rate = natural_units(A, B)
    A_scaled, new = A * units / units[:, np.newaxis] / rate, B / units[:, np.newaxis]
    threshold = 0.0  # B counts unless it is zero
    basis = np.zeros((n, 0))
    while basis.shape[1] < n:
        new = new - basis @ (basis.T @ new)
        if np.linalg.norm(new) <= threshold:
            break
        basis = np.hstack([basis, new / np.linalg.norm(new)])
        new = A_scaled @ basis[:, -1:]
        threshold = RANK_TOLERANCE * float(np.linalg.norm(A_scaled, 2))
    rank = basis.shape[1]
    return Controllability(np.hstack(columns), rank, rank == n)
