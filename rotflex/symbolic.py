"""The model derived by computer algebra, from where the bodies are to the matrices A and B.

Nothing that a student is asked for is typed in here. Given are the positions of the points of servo and arm, the law of
the spring, the torques of motor and dampers, the shape of the rods, and the circuit of the motor; sympy does the rest.

Symbols. ``t`` is the time, ``theta`` and ``alpha`` are functions of it (rad). Parameters are plain symbols called as
in the workbook: ``J_eq``, ``J_l``, ``B_eq``, ``B_l``, ``K_s``; ``eta_g``, ``eta_m``, ``K_g``, ``k_t``, ``k_m``,
``R_m``; ``m_1``, ``L_1``, ``m_2``, ``L_2``, ``d_12``. The inputs are ``tau`` (N·m) and ``V_m`` (V).
:func:`without_time` writes ``theta``, ``theta_dot``, ``theta_ddot`` (and so for alpha) for functions and derivatives.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import sympy
from numpy.typing import NDArray
from sympy import Eq, Expr, Matrix, Symbol

from rotflex.config import Joint, Servo, one_of

t = Symbol("t")
theta, alpha = sympy.Function("theta")(t), sympy.Function("alpha")(t)
J_eq, J_l, B_eq, B_l, K_s = sympy.symbols("J_eq J_l B_eq B_l K_s")
eta_g, eta_m, K_g, k_t, k_m, R_m = sympy.symbols("eta_g eta_m K_g k_t k_m R_m")
m_1, L_1, m_2, L_2, d_12 = sympy.symbols("m_1 L_1 m_2 L_2 d_12")
tau, V_m = sympy.symbols("tau V_m")

COORDINATES = (theta, alpha)
RATES = (theta.diff(t), alpha.diff(t))
INPUT_SYMBOLS = {"torque": tau, "voltage": V_m}


def without_time(expression: Expr) -> Expr:
    """An expression with symbols theta, theta_dot, theta_ddot, ... in place of functions of time and derivatives."""
    meant: dict[Expr, Symbol] = {}
    for q in COORDINATES:
        name = str(q.func)
        meant |= {q: Symbol(name), q.diff(t): Symbol(f"{name}_dot"), q.diff(t, 2): Symbol(f"{name}_ddot")}
    return expression.xreplace(meant)


# --- energies --------------------------------------------------------------------------------------------------------


def _rotational_energy(inertia: Expr, angle: Expr) -> Expr:
    """Kinetic energy of a body of given moment of inertia whose points turn about the pivot by ``angle``.

    The point at the distance r is at r (cos angle, sin angle). Its speed is proportional to r, so that the sum of
    dm v²/2 over the body is the sum of r² dm, which is the moment of inertia, times v²/(2 r²).
    """
    r = Symbol("r", positive=True)
    position = Matrix([r * sympy.cos(angle), r * sympy.sin(angle)])
    velocity = position.diff(t)
    return inertia * sympy.trigsimp(velocity.dot(velocity) / r**2) / 2


def kinetic_energy() -> Expr:
    """Kinetic energy T of servo and link (answer 2.2). The link turns with the servo, and deflects on top of that."""
    return _rotational_energy(J_eq, theta) + _rotational_energy(J_l, theta + alpha)


def potential_energy() -> Expr:
    """Potential energy V (answer 2.1): the work against the spring's torque K_s · angle, from 0 to alpha."""
    angle = Symbol("angle")
    return sympy.integrate(K_s * angle, (angle, 0, alpha))


def lagrangian() -> Expr:
    """Lagrangian L = T − V (Equation 2.5; answer 2.3)."""
    return kinetic_energy() - potential_energy()


# --- equations of motion ---------------------------------------------------------------------------------------------


def generalized_forces() -> tuple[Expr, Expr]:
    """Generalised forces Q of theta and alpha: motor and dampers (Equations 2.6 and 2.7)."""
    return tau - B_eq * RATES[0], -B_l * RATES[1]


@cache
def equations_of_motion() -> tuple[Eq, Eq]:
    """Both Euler–Lagrange equations d/dt(∂L/∂q̇) − ∂L/∂q = Q (Equations 2.3 and 2.4; answers 2.4 and 2.5).

    In the form J ẍ + B ẋ + K x = u: the torque on the right, all else on the left, collected by derivatives.
    """
    L = lagrangian()

    def equation(q: Expr, Q: Expr) -> Eq:
        torque = Q.coeff(tau) * tau
        left = L.diff(q.diff(t)).diff(t) - L.diff(q) - (Q - torque)
        terms = [x.diff(t, n) for n in (2, 1) for x in COORDINATES]
        return Eq(sympy.collect(sympy.expand(left), terms), torque)

    first, second = (equation(q, Q) for q, Q in zip(COORDINATES, generalized_forces(), strict=True))
    return first, second


def accelerations(link_damping: Expr | float = B_l) -> tuple[Expr, Expr]:
    """Accelerations of theta and alpha, solved from the equations of motion (answer 2.6, with ``link_damping=0``).

    Parameters
    ----------
    link_damping : what to put for B_l; the workbook neglects it
    """
    unknown = [q.diff(t, 2) for q in COORDINATES]
    solution = sympy.solve([equation.subs(B_l, link_damping) for equation in equations_of_motion()], unknown, dict=True)
    first, second = (sympy.collect(sympy.expand(solution[0][x]), (*COORDINATES, *RATES, tau)) for x in unknown)
    return first, second


# --- motor and arm ---------------------------------------------------------------------------------------------------


def motor_torque() -> Expr:
    """Torque at the load gear from motor voltage and servo rate (Equation 2.8).

    The armature circuit, V_m = R_m i + back-EMF at K_g times the rate of the load, gives the current; the current gives
    the torque of the motor, which the gearbox multiplies by K_g.
    """
    current = Symbol("i_m")
    back_emf = k_m * K_g * RATES[0]
    (i_m,) = sympy.solve(Eq(V_m, R_m * current + back_emf), current)
    return eta_g * K_g * eta_m * k_t * i_m


def link_inertia() -> Expr:
    """Moment of inertia J_l of the link about the pivot, from its two rods (answer 2.8).

    Each rod is integrated about an axis where that is easy: the bottom arm about its end, which is at the pivot; the
    top arm about its middle. The parallel-axis theorem takes the latter to the pivot.
    """
    r = Symbol("r")
    bottom = sympy.integrate(r**2 * m_1 / L_1, (r, 0, L_1))
    top = sympy.integrate(r**2 * m_2 / L_2, (r, -L_2 / 2, L_2 / 2))
    return bottom + top + m_2 * d_12**2


# --- state space -----------------------------------------------------------------------------------------------------


def state_space(input: str = "voltage", link_damping: Expr | float = B_l) -> tuple[Matrix, Matrix]:
    """Matrices A (4, 4) and B (4, 1) of x = [theta, alpha, theta_dot, alpha_dot], as Jacobians (answer 2.7).

    Parameters
    ----------
    input : "voltage" (V_m) or "torque" (tau, as answer 2.7 has it)
    link_damping : what to put for B_l; 0 for answer 2.7

    Raises
    ------
    ConfigurationError
        If the input is none of the two.
    """
    one_of("input", input, INPUT_SYMBOLS)
    motion = [*RATES, *accelerations(link_damping)]
    if input == "voltage":
        motion = [row.subs(tau, motor_torque()) for row in motion]
    f = Matrix([without_time(row) for row in motion])
    x = Matrix([without_time(state) for state in (*COORDINATES, *RATES)])
    A, B = f.jacobian(x), f.jacobian([INPUT_SYMBOLS[input]])
    return A.applyfunc(sympy.factor), B.applyfunc(sympy.factor)


def numeric_state_space(
    servo: Servo, joint: Joint, stiffness: float, input: str = "voltage", link_damping: float | None = None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The derived A (4, 4) and B (4, 1) as numbers, J_l from the rods: the counterpart of ``model.state_space``.

    Parameters
    ----------
    servo, joint : the parts
    stiffness : K_s of the joint, N·m/rad
    input : "voltage" or "torque"
    link_damping : B_l, N·m/(rad/s); by default that of ``joint``

    Raises
    ------
    ConfigurationError
        If the input is none of the two.
    """
    values = [getattr(servo, symbol.name) for symbol in _OF_SERVO]
    values += [getattr(joint, symbol.name) for symbol in _OF_ARM]
    A, B = _function_of_parameters(input)(*values, stiffness, joint.B_l if link_damping is None else link_damping)
    return A.astype(float), B.astype(float)


_OF_SERVO = (J_eq, B_eq, eta_g, eta_m, K_g, k_t, k_m, R_m)
_OF_ARM = (m_1, L_1, m_2, L_2, d_12)


@cache
def _function_of_parameters(input: str) -> Callable[..., list[NDArray[np.float64]]]:
    """A and B as a function of the numbers of servo and arm, K_s and B_l."""
    matrices = [matrix.subs(J_l, link_inertia()) for matrix in state_space(input)]
    function: Callable[..., list[NDArray[np.float64]]] = sympy.lambdify([*_OF_SERVO, *_OF_ARM, K_s, B_l], matrices)
    return function
