"""The closed loop, simulated with the student's own matrices and gain (Section 3.4.2).

The states are x = [theta, alpha, theta_dot, alpha_dot] and the control law is u = K (x_d - x), with
x_d = [theta_d, 0, 0, 0] (Equations 3.13 and 3.14). Two fidelities are worth having:

``exact``
    The plant and the feedback in continuous time, integrated with matrix exponentials: what the design promises.
``workbook``
    The arithmetic of the laboratory's real-time model: everything stepped by forward Euler, and velocities from the
    band-limited derivatives w_c s/(s + w_c) of the angles. At 2 ms and a rate limit of 100 /s this gives the workbook's
    0.38 s, 3.4 % and 10.9 deg; the exact solution settles in 0.40 s with 10.3 deg.

:func:`run` simulates the nonlinear plant, with its friction and its limits, under any controller.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import TYPE_CHECKING, Any, TypeVar, overload

import numpy as np
from scipy.linalg import expm

from rotflex import __version__
from rotflex.config import DAC_LIMIT, Servo, finite_vector, in_radians, one_of, positive, real_array
from rotflex.controller import Controller, begun, name_of
from rotflex.errors import ConfigurationError, DesignError, RecordingError
from rotflex.plant import Plant, PlantParameters, State
from rotflex.recording import Recording
from rotflex.units import HZ, Vector

if TYPE_CHECKING:
    from control import StateSpace

__all__ = ["DERIVATIVE_CUTOFF", "STATES", "along", "closed_loop", "run", "with_actuator"]


def __dir__() -> list[str]:
    return __all__


DERIVATIVE_CUTOFF = 33 * HZ  #: w_c of the real-time model's derivative filters, rad/s
STATES = ("theta", "alpha", "theta_dot", "alpha_dot")
_RUNAWAY = 1e2  # rad: no servo on a cable turns 16 times
_FINEST = 16  # a sample time is halved at most so many times: 2 ms to 30 ns

Advance = Callable[[Vector, float], Vector]  # (state, reference held) -> state one sample time later
Result = TypeVar("Result")


def takes_systems(function: Callable[..., Result]) -> Callable[..., Result]:
    """Let a function of the matrices A and B take a python-control system in place of the two."""

    @wraps(function)
    def taking(*given: Any, **named: Any) -> Result:
        parts: list[Any] = []
        for one in given:
            parts += _parts(one) if all(hasattr(one, name) for name in ("A", "B", "state_labels")) else (one,)
        return function(*parts, **named)

    return taking


def _parts(system: StateSpace) -> tuple[Vector, Vector]:
    """A and B of a continuous-time system, with the states in our order where they have our names.

    Raises
    ------
    DesignError
        If it is in discrete time, or has its states in another order.
    """
    if not system.isctime():
        raise DesignError(f"The system must be in continuous time; its sample time is {system.dt} s.")
    labels = system.state_labels
    if tuple(labels) != STATES and sorted(labels) == sorted(STATES):
        raise DesignError(f"The states must be in the order {', '.join(STATES)}; they are {', '.join(labels)}.")
    return system.A, system.B


def zero_order_hold(A: Vector, B: Vector, time: float) -> tuple[Vector, Vector]:
    """Discretise: return Phi (n, n), Gamma (n, m) of x(t + time) = Phi x(t) + Gamma u, with the input u held."""
    n, m = B.shape
    step = expm(np.block([[A, B], [np.zeros((m, n + m))]]) * time)
    return step[:n, :n], step[:n, n:]


def matrices(A: Any, B: Any) -> tuple[Vector, Vector]:
    """Check a model's matrices, and return them as arrays (4, 4) and (4, 1).

    Raises
    ------
    DesignError
        If one has the wrong shape or a value that is not finite.
    """
    return _matrix("A", A, [(4, 4)]), _matrix("B", B, [(4,), (4, 1)]).reshape(4, 1)


@takes_systems
def closed_loop(
    A: Any,
    B: Any,
    K: Any,
    reference: Any,
    sample_time: float = 0.002,
    feedback: str = "full",
    fidelity: str = "exact",
    saturation: float | None = DAC_LIMIT,
    x0: Any = (0.0, 0.0, 0.0, 0.0),
) -> Recording:
    """Simulate the state feedback that tracks a servo angle.

    In place of A and B, python-control's system will do: ``closed_loop(system, K, reference)``.

    Parameters
    ----------
    A : (4, 4) state matrix, with the motor voltage as input
    B : (4,) or (4, 1) input matrix
    K : (4,), (1, 4) or (4, 1) gain: V/rad for the angles, V/(rad/s) for the velocities
    reference : (n,) commanded servo angle, rad, held from each sample to the next
    sample_time : s, of ``reference`` and of the result; in the ``workbook`` fidelity also the integration step
    feedback : "full", or "partial": alpha and alpha_dot are not fed back (Section 3.4.4)
    fidelity : "exact" or "workbook", see the module
    saturation : the largest voltage, V; ``None`` for a plant that takes whatever the controller asks for
    x0 : (4,) initial state, rad and rad/s

    Returns
    -------
    Recording
        Channels theta_ref, theta, alpha (rad) and vm (V): the voltage that reaches the motor, just after the command
        was updated. With a saturation it can never break Specification 4: simulate with ``saturation=None`` to
        see what the controller asks for (an unlimited step of 40 deg asks for 12.7 V with the workbook's gain). The
        command is a staircase; its stairs on a ramp cost up to 0.3 V, and smooth out with a finer ``sample_time``.

    Raises
    ------
    DesignError
        If a matrix has the wrong shape or a value that is not finite, or if the loop runs away.
    RecordingError
        If ``reference`` is not a vector of two or more finite numbers.
    ConfigurationError
        If a choice does not exist, or ``sample_time`` or ``saturation`` is not positive.
    """
    A, B = matrices(A, B)
    B = B.reshape(4)
    K, state = _matrix("K", K, [(4,), (1, 4), (4, 1)]).reshape(4), _matrix("x0", x0, [(4,), (4, 1)]).reshape(4)
    theta_ref = _reference(reference)
    in_radians("reference", float(np.abs(theta_ref).max()))
    one_of("feedback", feedback, ("full", "partial"))
    one_of("fidelity", fidelity, ("exact", "workbook"))
    limit = np.inf if saturation is None else float(saturation)
    positive("sample_time", sample_time, "s")
    if not limit > 0:
        raise ConfigurationError(f"saturation is {saturation!r}; it must be a positive voltage, or None.")
    if feedback == "partial":
        K = K * [1.0, 0.0, 1.0, 0.0]

    gain_d = float(K[0])  # of theta_d, since x_d = [theta_d, 0, 0, 0]
    theta, alpha, vm = (np.empty(theta_ref.size) for _signal in range(3))
    with np.errstate(over="ignore", invalid="ignore"):  # a loop that runs away is reported below
        if fidelity == "exact":
            advance = _exact(A, B, K, sample_time, limit)
        else:
            A, B, K, state = _with_derivative_filters(A, B, K, state)
            advance = _euler(A, B, K, gain_d, sample_time, limit)
        for k, theta_d in enumerate(theta_ref.tolist()):
            theta[k], alpha[k] = state[0], state[1]
            vm[k] = min(max(gain_d * theta_d - float(K @ state), -limit), limit)
            # Written so that a NaN counts as run away, too.
            if not abs(theta[k]) + abs(alpha[k]) < _RUNAWAY:
                raise DesignError(_why_it_ran_away(A, B, K, sample_time, fidelity, k))
            state = advance(state, theta_d)

    settings = {"fidelity": fidelity, "feedback": feedback, "saturation": saturation}
    return _recorded("closed_loop", settings, sample_time, theta_ref=theta_ref, theta=theta, alpha=alpha, vm=vm)


def run(
    plant: PlantParameters,
    controller: Controller,
    reference: Any,
    sample_time: float = 0.002,
    x0: Any = (0.0, 0.0, 0.0, 0.0),
) -> Recording:
    """Simulate the nonlinear plant under a controller, without a bench.

    The controller sees the exact angles, and its voltage is at the motor at once. On a virtual bench
    (``hil.open(plant=...)``) the same plant has encoders, and outputs may come late.

    Parameters
    ----------
    plant : the plant, see :class:`rotflex.plant.PlantParameters`
    controller : function (theta_ref, theta, alpha) → V, in rad, or a discrete system of python-control, see
        :mod:`rotflex.controller`. For a gain K it is ``rotflex.hil.controllers.StateFeedback(K)``
    reference : (n,) commanded servo angle, rad, one per sample
    sample_time : s, for which each voltage is held
    x0 : (4,) initial state, rad and rad/s

    Returns
    -------
    Recording
        Channels theta_ref, theta, alpha (rad) and vm (V): the voltage within the amplifier's ±V_max.

    Raises
    ------
    DesignError
        If the controller is made for another sample time or returns anything but one finite number, or x0 is not four
        numbers.
    RecordingError
        If ``reference`` is not a vector of two or more finite numbers.
    ConfigurationError
        If ``sample_time`` is not positive.
    """
    theta_ref, state = _reference(reference), _matrix("x0", x0, [(4,), (4, 1)]).reshape(4)
    positive("sample_time", sample_time, "s")
    moving, control = Plant(plant, State(*state.tolist())), begun(controller, sample_time)
    theta, alpha, vm = (np.empty(theta_ref.size) for _signal in range(3))
    for k, theta_d in enumerate(theta_ref.tolist()):
        theta[k], alpha[k] = moving.state[:2]
        asked = control(theta_d, moving.state.theta, moving.state.alpha)
        if not np.isfinite(asked):
            raise DesignError(f"The controller returned {asked} V at t = {k * sample_time:.3g} s: check its gain.")
        vm[k] = min(max(asked, -plant.V_max), plant.V_max)
        moving.advance(vm[k], sample_time)
    settings = {"controller": name_of(controller)}
    return _recorded("run", settings, sample_time, theta_ref=theta_ref, theta=theta, alpha=alpha, vm=vm)


def along(
    A: Any, B: Any, volts: Vector, sample_time: float = 0.002, bound: float = np.inf
) -> tuple[Vector, int | None]:
    """Simulate a linear model from rest along a voltage that is held from each sample to the next.

    Parameters
    ----------
    A, B : (4, 4) and (4,) or (4, 1), with the motor voltage as input
    volts : (n,) V
    sample_time : s
    bound : rad; a model whose angle passes it is cut there, and stays there

    Returns
    -------
    angles : (2, n) theta and alpha, rad
    cut : the sample from which on the angles were cut; None if they were not

    Raises
    ------
    DesignError
        If a matrix has the wrong shape or a value that is not finite.
    """
    A, B = matrices(A, B)
    state, angles = np.zeros(4), np.empty((2, volts.size))
    with np.errstate(over="ignore", invalid="ignore"):
        a, b = zero_order_hold(A, B, sample_time)
        for k, voltage in enumerate(volts.tolist()):
            # Written so that a NaN counts as run away, too.
            if not np.abs(state[:2]).max() <= bound:
                angles[:, k:] = np.clip(np.nan_to_num(state[:2], nan=np.inf), -bound, bound)[:, np.newaxis]
                return angles, k
            angles[:, k] = state[:2]
            state = a @ state + b[:, 0] * voltage
    return angles, None


@overload
def with_actuator(A: StateSpace, B: Servo, /) -> StateSpace: ...


@overload
def with_actuator(A: Any, B: Any, servo: Servo) -> tuple[Vector, Vector]: ...


def with_actuator(A: Any, B: Any, servo: Servo | None = None) -> Any:
    """The model driven by the motor voltage, from the model driven by the torque (Equation 2.8).

    ``with_actuator(system, servo)`` does the same to a system of python-control; its input is called vm then.

    The motor's torque is tau = torque_per_volt * V_m - back_emf_damping * theta_dot: a gain in B, and, in A, a
    feedback of theta_dot through B.

    Parameters
    ----------
    A : (4, 4) state matrix, B : (4,) or (4, 1) input matrix, with the torque at the load gear as input
    servo : whose motor it is

    Returns
    -------
    A : (4, 4), B : (4, 1), with the motor voltage as input; or a system

    Raises
    ------
    DesignError
        If a matrix has the wrong shape or a value that is not finite.
    """
    system = None
    if servo is None:
        system, servo = A, B
        A, B = _parts(system)
    A, B = matrices(A, B)
    back_emf = np.array([[0.0, 0.0, servo.back_emf_damping, 0.0]])
    A, B = A - B @ back_emf, B * servo.torque_per_volt
    if system is None:
        return A, B
    import control

    C, D = system.C - system.D @ back_emf, system.D * servo.torque_per_volt
    names = {"states": system.state_labels, "outputs": system.output_labels, "name": system.name}
    return control.StateSpace(A, B, C, D, inputs=["vm"], **names)


# --- exact -----------------------------------------------------------------------------------------------------------


def _exact(A: Vector, B: Vector, K: Vector, sample_time: float, limit: float) -> Advance:
    """One sample time of the continuous-time loop, with the saturation entered and left at the right instants.

    The loop is linear as long as it stays in one regime: u = K (x_d - x), u = +limit, or u = -limit. A stride
    that would end in another regime is halved, down to 30 ns, and so finds the instant of the change. So is one in
    which u turns round, lest it pass the limit and come back unseen within the stride.
    """
    A_closed = A - np.outer(B, K)
    if not np.isfinite(limit):
        Phi, Gamma = _strides(A_closed, B * K[0], sample_time)[0]
        return lambda state, theta_d: Phi @ state + Gamma * theta_d

    feedback, saturated = _strides(A_closed, B * K[0], sample_time), _strides(A, B * limit, sample_time)
    gain_d, K_and_KA, KB = float(K[0]), np.vstack([K, K @ A]), float(K @ B)
    at_rest = 1e-9 * limit / sample_time  # V/s

    def regime(state: Vector, theta_d: float) -> tuple[int, int]:
        """Where u is (-1 and 1: beyond the limit), and which way it goes."""
        Kx, KAx = (K_and_KA @ state).tolist()
        u = gain_d * theta_d - Kx
        slope = -KAx - KB * min(max(u, -limit), limit)
        return (u > limit) - (u < -limit), (slope > at_rest) - (slope < -at_rest)

    def advance(state: Vector, theta_d: float) -> Vector:
        remaining, level, now = 2**_FINEST, 0, regime(state, theta_d)
        while remaining:
            stride = 2**_FINEST >> level
            if stride > remaining:
                level += 1
                continue
            Phi, Gamma = saturated[level] if now[0] else feedback[level]
            ahead = Phi @ state + Gamma * (now[0] or theta_d)
            after = regime(ahead, theta_d)
            if after != now:
                if level < _FINEST:
                    level += 1
                    continue
                level = 0
            state, now, remaining = ahead, after, remaining - stride
        return state

    return advance


def _strides(A: Vector, B: Vector, sample_time: float) -> list[tuple[Vector, Vector]]:
    """Phi (4, 4) and Gamma (4,) of x(t + h) = Phi x(t) + Gamma u, for an input that is held.

    One pair for each stride h = sample_time / 2**level. They are parts of exp(M h), M = [[A, B], [0, 0]], which is
    found by its series at a tiny h and by doubling: exp(2 M h) - I = 2 X + X² with X = exp(M h) - I. That keeps all
    digits, and is far quicker than a matrix exponential for each stride.
    """
    I, M = np.eye(5), np.zeros((5, 5))
    M[:4, :4], M[:4, 4] = A, B
    doublings = _FINEST + max(0, int(np.ceil(np.log2(np.linalg.norm(M, 1) * sample_time + 1e-300))))
    tiny = M * (sample_time / 2**doublings)  # of a norm of 2**-16 at most: four terms are exact
    X = tiny @ (I + tiny / 2 @ (I + tiny / 3 @ (I + tiny / 4)))
    exponentials = [I + X]
    for _time in range(doublings):
        X = 2 * X + X @ X
        exponentials.append(I + X)
    return [(E[:4, :4], E[:4, 4]) for E in reversed(exponentials[-_FINEST - 1 :])]


# --- workbook --------------------------------------------------------------------------------------------------------


def _with_derivative_filters(A: Vector, B: Vector, K: Vector, state: Vector) -> tuple[Vector, Vector, Vector, Vector]:
    """Plant and gain with two more states f, the angles behind the low-pass filter w_c/(s + w_c).

    The controller's velocities are w_c (angle - f), which is w_c s/(s + w_c) of the angle. The filters start at rest.
    """
    w_c, I, O = DERIVATIVE_CUTOFF, np.eye(2), np.zeros((2, 2))
    A_filters = np.hstack([w_c * I, O, -w_c * I])
    A_all = np.vstack([np.hstack([A, np.zeros((4, 2))]), A_filters])
    K_angles, K_velocities = K[:2], K[2:]
    K_all = np.concatenate([K_angles + w_c * K_velocities, [0.0, 0.0], -w_c * K_velocities])
    return A_all, np.concatenate([B, [0.0, 0.0]]), K_all, np.concatenate([state, state[:2]])


def _euler(A: Vector, B: Vector, K: Vector, gain_d: float, sample_time: float, limit: float) -> Advance:
    """One step of forward Euler, x + T_s (A x + B u)."""
    Phi, Gamma = np.eye(A.shape[0]) + sample_time * A, sample_time * B

    def advance(state: Vector, theta_d: float) -> Vector:
        u = min(max(gain_d * theta_d - float(K @ state), -limit), limit)
        return Phi @ state + Gamma * u

    return advance


def _recorded(experiment: str, settings: dict[str, Any], sample_time: float, **channels: Vector) -> Recording:
    about = {"source": "simulation", "experiment": experiment, **settings, "sample_time": sample_time}
    time = np.arange(channels["theta"].size) * sample_time
    return Recording.of(time, {**about, "software": f"rotflex {__version__}"}, **channels)


# --- what can be wrong -----------------------------------------------------------------------------------------------


def _matrix(name: str, value: Any, shapes: list[tuple[int, ...]]) -> Vector:
    wanted = " or ".join(str(shape) for shape in shapes)
    matrix = real_array(name, value, DesignError)
    if matrix.shape not in shapes:
        raise DesignError(f"{name} must have the shape {wanted}; its shape is {matrix.shape}. States: {STATES}.")
    if not np.isfinite(matrix).all():
        raise DesignError(f"{name} has a value that is not finite: {matrix.tolist()}.")
    return matrix


def _reference(value: Any) -> Vector:
    reference = finite_vector("The reference (angles in rad, one per sample)", value, RecordingError)
    if reference.size < 2:
        raise RecordingError(f"The reference must have two or more angles; it has {reference.size}.")
    return reference


def _why_it_ran_away(A: Vector, B: Vector, K: Vector, sample_time: float, fidelity: str, sample: int) -> str:
    poles = np.linalg.eigvals(A - np.outer(B, K))
    worst = poles[np.argmax(poles.real)]
    text = f"The simulation ran away: at t = {sample * sample_time:.3g} s an angle had left ±{_RUNAWAY:g} rad. "
    if worst.real > 0:
        loop = "closed loop" if fidelity == "exact" else "closed loop with its derivative filters"
        text += f"The {loop} has an unstable pole at {worst:.3g} rad/s"
        return text + ": look at the signs and the size of K, and at A and B."
    if fidelity == "workbook" and np.abs(1 + sample_time * poles).max() > 1:
        fastest = poles[np.argmax(np.abs(1 + sample_time * poles))]
        text += f"The closed loop is stable, but its pole at {fastest:.3g} rad/s is too fast for Euler steps "
        return text + f"of {sample_time:g} s: use a shorter sample_time or fidelity='exact'."
    return text + "Its poles are stable: look at the reference (is it in rad?) and at x0."
