"""The nonlinear plant: servo, springy joint and arm, with friction that sticks, and the amplifier's limits.

The virtual bench and the grey-box fit stand on it. Students derive a model of the same servo and link; so its equations
of motion are not written out here, and nothing here returns them: a determined reader can work them out from the
matrices below, as from any textbook.

Friction, besides the viscous one, is Coulomb friction of servo and of link, f_s and f_l: F⁺ when moving in the positive
direction, −F⁻ in the negative one, and anything between when standing still, whatever it takes to stand still. The
servo's may fall with its rate (Stribeck's curve), vary with its angle (a rough gear), and grow with the torque of the
spring, which presses on the gear:

    F(θ, α, θ̇) = F± · waves(θ) · (1 + stribeck/(1 + (θ̇/v_s)²)) + load · |K_s α|

While it stands, F(θ, α, 0) is the most that holds it. The motor gives torque in proportion to its current,
i = (V − K_g k_m θ̇)/R_m within ±I_max, with V within ±V_max. The spring may have a cubic part, K_3 α³.

How it is integrated. Between changes of friction and current limit the plant is linear (the cubic spring aside), and
is propagated by its matrix exponential, exactly. Friction is held constant over a substep at a value for which the
velocities *at its end* agree with the friction law (Moreau's time stepping). With Coulomb friction alone that is exact
while both joints slide and while both stand still; a substep in which a motion begins or turns round, or the current
limit sets in, is halved again and again, and while one joint stands and the other moves they are short. Friction that
varies is that of the middle of a substep: its error falls with the square of the substep. After 3 s of stops and starts
angles are right to 2e-5 rad, at worst 5e-5 (20 drawn benches, against an integrator that finds each stop as an event);
an encoder's count is 1.5e-3 rad. A torque from outside on the link acts as friction of servo and link together would.
The cubic part of the spring is applied as half a kick before and half after each substep (Strang splitting), which
keeps the energy bounded.

Nothing here calls a sine or an exponential while it runs: C libraries differ in their last digits.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from rotflex.config import Joint, Servo
from rotflex.errors import ConfigurationError

SUBSTEP = 2e-3  #: s; the longest substep
CUBIC_SUBSTEP = 2.5e-4  #: s; the longest with a cubic spring, whose part is not exact
ONE_STANDS_SUBSTEP = 5e-4  #: s; the longest while one joint stands and the other moves
HALVINGS = 7  #: how often a substep is halved where a motion turns round
STRIBECK_RATE = 1.5  #: rad/s; v_s, at which half of what the friction at standstill has more is gone
# Friction of servo and link: each stands (0), or slides one way or the other.
_CASES = tuple((servo, link) for servo in (0, 1, -1) for link in (0, 1, -1))
_AFTER = {case: (case, *(other for other in _CASES if other != case)) for case in _CASES}  # in which they are tried
_TURNS = 1 / (2 * math.pi)  # in a radian
_MARGIN = 1 + 1e-9  # on the friction that holds a joint: rounding must not leave a border of two cases to neither


class State(NamedTuple):
    """theta, alpha (rad) and their rates (rad/s)."""

    theta: float
    alpha: float
    theta_dot: float
    alpha_dot: float


REST = State(0.0, 0.0, 0.0, 0.0)
#: The servo's friction (N·m) while it slides, and at most while it stands, each in the positive and in the negative
#: direction.
_Levels = tuple[float, float, float, float]
_new = tuple.__new__  # in half the time that State(...) takes


@dataclass(frozen=True)
class PlantParameters:
    """Parameters of the nonlinear plant, SI units.

    Parameters
    ----------
    J_eq, J_l : inertia of servo and link, kg·m²
    K_s : stiffness of the joint, N·m/rad
    B_eq, B_l : viscous damping of servo and link, N·m/(rad/s)
    torque_per_volt : eta_g K_g eta_m k_t / R_m, N·m/V
    back_emf : K_g k_m, V/(rad/s)
    resistance : R_m, ohm
    servo_friction, link_friction : (F⁺, F⁻), Coulomb friction in the positive and in the negative direction, N·m
    K_3 : cubic stiffness, N·m/rad³
    stribeck : by how much the servo's friction is larger at standstill than at high rates, relative
    load : by how much the servo's friction is larger for each N·m of the spring's torque
    gear : waves of the servo's friction over its angle, each (number in a turn, height relative to the friction, phase
        in turns); the heights sum to less than 1
    V_max, I_max : the amplifier's limits, V and A. With ``I_max=0`` the motor is disconnected.

    Raises
    ------
    ConfigurationError
        If an inertia, the stiffness or the resistance is not positive, another parameter is negative, one is not a
        finite number (only the amplifier's limits may be infinite), or a friction could become negative.
    """

    J_eq: float
    J_l: float
    K_s: float
    B_eq: float
    B_l: float
    torque_per_volt: float
    back_emf: float
    resistance: float
    servo_friction: tuple[float, float] = (0.0, 0.0)
    link_friction: tuple[float, float] = (0.0, 0.0)
    K_3: float = 0.0
    V_max: float = math.inf
    I_max: float = math.inf
    stribeck: float = 0.0
    load: float = 0.0
    gear: tuple[tuple[float, float, float], ...] = ()

    def __post_init__(self) -> None:
        for name in ("J_eq", "J_l", "K_s", "resistance"):
            if not 0 < getattr(self, name) < math.inf:
                raise ConfigurationError(f"{name} must be positive and finite; it is {getattr(self, name)!r}.")
        for name in ("B_eq", "B_l", "K_3", "torque_per_volt", "back_emf", "stribeck", "load"):
            if not 0 <= getattr(self, name) < math.inf:
                raise ConfigurationError(f"{name} must be finite and not negative; it is {getattr(self, name)!r}.")
        for name in ("V_max", "I_max"):
            if not getattr(self, name) >= 0:
                raise ConfigurationError(f"{name} must not be negative; it is {getattr(self, name)!r}.")
        for name in ("servo_friction", "link_friction"):
            if len(getattr(self, name)) != 2 or not all(0 <= bound < math.inf for bound in getattr(self, name)):
                raise ConfigurationError(f"{name} must be two torques, none negative; it is {getattr(self, name)!r}.")
        if not sum(abs(height) for _number, height, _phase in self.gear) < 1:
            raise ConfigurationError(f"The heights of the gear's waves must sum to less than 1; it is {self.gear!r}.")

    @classmethod
    def of(cls, servo: Servo, joint: Joint, K_s: float) -> PlantParameters:
        """The frictionless plant of nominal parts with a joint of stiffness ``K_s`` (N·m/rad)."""
        return cls(
            J_eq=servo.J_eq,
            J_l=joint.J_l,
            K_s=K_s,
            B_eq=servo.B_eq,
            B_l=joint.B_l,
            torque_per_volt=servo.torque_per_volt,
            back_emf=servo.K_g * servo.k_m,
            resistance=servo.R_m,
            V_max=servo.V_max,
            I_max=servo.amplifier.I_max,
        )

    def roughness(self, theta: float) -> float:
        """Return by what factor the gear's friction differs from its mean at a servo angle (rad)."""
        turns, factor = theta * _TURNS, 1.0  # not by sum(), which rounds in other ways from Python 3.12 on
        for number, height, phase in self.gear:
            x = number * turns + phase
            x -= math.floor(x)
            factor += height * 16 * (x * (0.5 - x) if x < 0.5 else (x - 0.5) * (x - 1))  # two parabolas for a sine
        return factor

    def current(self, voltage: float, theta_dot: float) -> float:
        """Motor current (A) at a commanded voltage, within the amplifier's limits."""
        voltage = min(max(voltage, -self.V_max), self.V_max)
        return min(max((voltage - self.back_emf * theta_dot) / self.resistance, -self.I_max), self.I_max)


class _Step(NamedTuple):
    """One substep of the linear part. Flat, for it is unpacked in every one.

    ``free`` (16), four each for theta, alpha, theta_dot, alpha_dot at its end, multiplies (alpha, theta_dot, alpha_dot,
    drive) before it (theta only adds up), where the drive is a voltage or a current; ``friction`` (8), two each,
    multiplies (f_s, f_l). ``sliding`` is what friction adds when servo and link slide in the positive direction or not
    (indices 0, 1), and the case that this is.
    """

    free: tuple[float, ...]
    friction: tuple[float, ...]
    sliding: tuple[tuple[tuple[float, float, float, float, tuple[int, int]], ...], ...]


class Moving(Protocol):
    """What can hang on a board's terminals: a plant, or something in its place."""

    @property
    def state(self) -> State:
        """Angles and rates now."""

    def advance(self, voltage: float, duration: float) -> State:
        """Hold a voltage (V) for a duration (s), and return the state at its end."""


class Plant:
    """The plant in motion.

    Parameters
    ----------
    parameters : the plant's parameters
    state : where it starts

    Attributes
    ----------
    torque : on the link, from outside, N·m
    """

    def __init__(self, parameters: PlantParameters, state: State = REST) -> None:
        self.parameters = parameters
        self.state = state
        self.torque = 0.0
        self._steps: tuple[dict[float, _Step], dict[float, _Step]] = {}, {}  # with the current not limited, or limited
        self._case = _CASES[0]
        self._rubs = any(parameters.servo_friction + parameters.link_friction)
        self._most_volts = parameters.I_max * parameters.resistance  # across the resistance
        self._spans: dict[float, tuple[int, float]] = {}
        # Looked up in every substep.
        self._V_max, self._back_emf, self._K_3 = parameters.V_max, parameters.back_emf, parameters.K_3
        self._I_max, self._levels = parameters.I_max, (*parameters.servo_friction, *parameters.servo_friction)
        self._varies = bool(parameters.gear or parameters.stribeck or parameters.load)
        self._stribeck, self._load = parameters.stribeck, parameters.load * parameters.K_s

    def advance(self, voltage: float, duration: float) -> State:
        """Hold a commanded voltage (V) for a duration (s) and return the state at its end.

        Raises
        ------
        ConfigurationError
            If the duration is negative or not finite.
        """
        count, h = self._spans.get(duration) or self._divide(duration)
        voltage = float(voltage)
        if not -self._V_max <= voltage <= self._V_max:
            voltage = min(max(voltage, -self._V_max), self._V_max)
        for _step in range(count):
            self._substep(voltage, h, HALVINGS)
        return self.state

    def prepare(self) -> None:
        """Find all matrices now, and not when they are needed first: for where time does not wait."""
        for limited in (False, True):
            for halvings in range(2 * HALVINGS + 1):  # whole spans down to ticks, and those halved again
                self._prepare(limited, SUBSTEP / 2**halvings)

    def _divide(self, duration: float) -> tuple[int, float]:
        """How many substeps there are in a duration, and how long each is (s)."""
        if not 0 <= duration < math.inf:
            raise ConfigurationError(f"The plant cannot be advanced by {duration!r} s.")
        count = math.ceil(duration / (CUBIC_SUBSTEP if self._K_3 else SUBSTEP) - 1e-9)
        if duration:
            count = max(1, count)
        self._spans[duration] = count, float(duration) / max(1, count)  # a float of numpy is no index of a case
        return self._spans[duration]

    def _substep(self, voltage: float, h: float, halvings: int) -> None:
        theta, alpha, theta_dot, alpha_dot = self.state
        if self._K_3:
            theta_dot, alpha_dot = self._kick(alpha, theta_dot, alpha_dot, h / 2)
        # Whether the current is limited is decided at the beginning of the substep.
        volts = voltage - self._back_emf * theta_dot
        limited = abs(volts) >= self._most_volts
        drive = math.copysign(self._I_max, volts) if limited else voltage
        free, friction, sliding = self._steps[limited].get(h) or self._prepare(limited, h)

        a1, a2, a3, a4, b1, b2, b3, b4, c1, c2, c3, c4, d1, d2, d3, d4 = free
        new_theta = theta + a1 * alpha + a2 * theta_dot + a3 * alpha_dot + a4 * drive
        new_alpha = b1 * alpha + b2 * theta_dot + b3 * alpha_dot + b4 * drive
        new_theta_dot = c1 * alpha + c2 * theta_dot + c3 * alpha_dot + c4 * drive
        new_alpha_dot = d1 * alpha + d2 * theta_dot + d3 * alpha_dot + d4 * drive
        if self.torque:
            p, q, r, s = _effect(friction, -self.torque, -self.torque)
            new_theta, new_alpha, new_theta_dot, new_alpha_dot = (
                new_theta + p,
                new_alpha + q,
                new_theta_dot + r,
                new_alpha_dot + s,
            )
        changed = (abs(voltage - self._back_emf * new_theta_dot) >= self._most_volts) is not limited

        if self._rubs:
            p1, p2, q1, q2, r1, r2, s1, s2 = friction
            levels = self._levels
            if self._varies:
                pressed = self._load * abs(alpha + new_alpha) / 2
                levels = self._varied(theta + theta_dot * h / 2, pressed, theta_dot, new_theta_dot, r1)
            slide = False
            if theta_dot and alpha_dot:
                # That both slide on as they did is tried first: nearly always it is so.
                p, q, r, s, case = sliding[theta_dot > 0][alpha_dot > 0]
                if self._varies:
                    more = levels[0] - self._levels[0] if theta_dot > 0 else self._levels[1] - levels[1]
                    p, q, r, s = p + p1 * more, q + q1 * more, r + r1 * more, s + s1 * more
                slide = theta_dot * (new_theta_dot + r) > 0 and alpha_dot * (new_alpha_dot + s) > 0
            if not slide:
                # A servo that stands may be held by more than brakes it when it slides: standing is tried first.
                tried = _CASES[0] if theta_dot == 0 and self._varies else self._case
                case, servo, link = self._friction(new_theta_dot, new_alpha_dot, (r1, r2, s1, s2), levels, tried)
                p, q, r, s = (
                    p1 * servo + p2 * link,
                    q1 * servo + q2 * link,
                    r1 * servo + r2 * link,
                    s1 * servo + s2 * link,
                )
            self._case = case
            new_theta, new_alpha, new_theta_dot, new_alpha_dot = (
                new_theta + p,
                new_alpha + q,
                new_theta_dot + r,
                new_alpha_dot + s,
            )
            # What friction holds stands still exactly: neither rounding nor the other joint may leave it creeping.
            if case[0] == 0:
                new_theta_dot = 0.0
                new_theta = new_theta if theta_dot else theta
            if case[1] == 0:
                new_alpha_dot = 0.0
                new_alpha = new_alpha if alpha_dot else alpha
            if (
                # A motion begins, stops or turns round ...
                (theta_dot * new_theta_dot <= 0 and theta_dot != new_theta_dot)
                or (alpha_dot * new_alpha_dot <= 0 and alpha_dot != new_alpha_dot)
                # ... or one joint stands, held by a constant torque against a spring whose torque is not constant.
                or (h > ONE_STANDS_SUBSTEP and (case[0] == 0) is not (case[1] == 0))
            ):
                changed = True
        if changed and halvings:
            self._substep(voltage, h / 2, halvings - 1)
            self._substep(voltage, h / 2, halvings - 1)
            return
        if self._K_3:
            new_theta_dot, new_alpha_dot = self._kick(new_alpha, new_theta_dot, new_alpha_dot, h / 2)
        self.state = _new(State, (new_theta, new_alpha, new_theta_dot, new_alpha_dot))

    def _varied(self, theta: float, pressed: float, begin: float, end: float, effect: float) -> _Levels:
        """Return the servo's friction in the middle of a substep, where it varies.

        Parameters
        ----------
        theta : rad, in the middle
        pressed : the load's part, N·m
        begin, end : rates at the beginning, and at the end without friction, rad/s
        effect : by how much 1 N·m of friction changes the rate at the end
        """
        (plus, minus), more = self.parameters.servo_friction, self._stribeck
        rough = self.parameters.roughness(theta)
        rate = begin / STRIBECK_RATE
        factor = rough * (1 + more / (1 + rate * rate))
        braking = factor * plus + pressed if begin > 0 else -factor * minus - pressed
        rate = (begin + end + effect * braking) / (2 * STRIBECK_RATE)
        factor, most = rough * (1 + more / (1 + rate * rate)), rough * (1 + more)
        return factor * plus + pressed, factor * minus + pressed, most * plus + pressed, most * minus + pressed

    def _kick(self, alpha: float, theta_dot: float, alpha_dot: float, h: float) -> tuple[float, float]:
        """Velocities after the cubic spring alone has acted for ``h``."""
        impulse = self.parameters.K_3 * alpha**3 * h
        servo = impulse / self.parameters.J_eq
        return theta_dot + servo, alpha_dot - impulse / self.parameters.J_l - servo

    def _friction(
        self,
        theta_dot: float,
        alpha_dot: float,
        effect: tuple[float, ...],
        levels: _Levels,
        tried: tuple[int, int],
    ) -> tuple[tuple[int, int], float, float]:
        """Friction torques for which the velocities at the end of the substep obey the friction law, and their case.

        ``theta_dot`` and ``alpha_dot`` are the velocities there without friction, ``effect`` the (2, 2) matrix by which
        friction changes them. Each joint stands, or slides one way or the other: one of nine cases is consistent, often
        the last, and where standing is held by more at times two, of which the one that is ``tried`` first counts.
        """
        r1, r2, s1, s2 = effect
        servo_plus, servo_minus, most_plus, most_minus = levels
        most_plus, most_minus = most_plus * _MARGIN, most_minus * _MARGIN
        link_plus, link_minus = self.parameters.link_friction
        for case in _AFTER[tried]:
            servo_case, link_case = case
            servo = servo_plus if servo_case > 0 else -servo_minus
            link = link_plus if link_case > 0 else -link_minus
            if servo_case == 0 and link_case == 0:
                determinant = r1 * s2 - r2 * s1
                servo = (r2 * alpha_dot - s2 * theta_dot) / determinant
                link = (s1 * theta_dot - r1 * alpha_dot) / determinant
            elif servo_case == 0:
                servo = -(theta_dot + r2 * link) / r1
            elif link_case == 0:
                link = -(alpha_dot + s1 * servo) / s2
            if servo_case == 0:
                if not -most_minus <= servo <= most_plus:
                    continue
            elif not servo_case * (theta_dot + r1 * servo + r2 * link) >= 0:
                continue
            if link_case == 0:
                agrees = -link_minus * _MARGIN <= link <= link_plus * _MARGIN
            else:
                agrees = link_case * (alpha_dot + s1 * servo + s2 * link) >= 0
            if agrees:
                return case, servo, link
        raise ConfigurationError(
            f"The plant's motion is not a number any more after {self.state}: look at its parameters and its voltage."
        )

    def _prepare(self, limited: bool, h: float) -> _Step:
        step = self._steps[limited][h] = _discretised(self.parameters, limited, h)
        return step


def driven(parameters: PlantParameters, state: State, volts: Sequence[float], dt: float) -> NDArray[np.float64]:
    """Drive a plant by voltages that are held from each sample to the next.

    Parameters
    ----------
    parameters, state : the plant, and where it starts
    volts : (n,) commanded voltages, V
    dt : s, between two samples

    Returns
    -------
    (n, 4) array
        theta, alpha (rad) and their rates (rad/s) at each sample; the first is ``state``.
    """
    plant, states = Plant(parameters, state), []
    for voltage in volts:
        states.append(plant.state)
        plant.advance(voltage, dt)
    return np.array(states)


@lru_cache(maxsize=512)  # an experiment needs some fifty, and the next one on the same bench needs them again
def _discretised(parameters: PlantParameters, limited: bool, h: float) -> _Step:
    """Discretise the linear part for one substep, with the drive a voltage or (``limited``) a current."""
    linear = replace(parameters, K_3=0.0, V_max=math.inf, I_max=math.inf)
    if limited:  # a current source: no back-EMF, and 1 A stands for R_m volts
        linear = replace(linear, back_emf=0.0, torque_per_volt=linear.torque_per_volt * linear.resistance)
    motion, inputs = _by_momenta(linear)
    transition = expm(np.block([[motion, inputs], [np.zeros((3, 7))]]) * h)
    rates = np.array([1 / linear.J_eq, 1 / linear.J_l])
    ours = np.kron(np.diag([1.0, 0.0]), _RELATIVE) + np.kron(np.diag([0.0, 1.0]), _RELATIVE * rates)
    transition[:4] = ours @ transition[:4]
    transition[:4, :4] = transition[:4, :4] @ np.linalg.inv(ours)
    friction = tuple(transition[:4, 5:7].ravel().tolist())
    servo, link = ({1: plus, -1: -minus} for plus, minus in (parameters.servo_friction, parameters.link_friction))
    return _Step(
        free=tuple(transition[:4, 1:5].ravel().tolist()),
        friction=friction,
        sliding=tuple(
            tuple((*_effect(friction, servo[way], link[other]), (way, other)) for other in (-1, 1)) for way in (-1, 1)
        ),
    )


_RELATIVE = np.array([[1.0, 0.0], [-1.0, 1.0]])  # theta and alpha from the directions of servo and link in the room


def _by_momenta(p: PlantParameters) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The linear part in the directions and momenta of servo and link: (4, 4), and for (drive, f_s, f_l), (4, 3)."""
    spring, damper = np.array([[-1.0, 1.0], [1.0, -1.0]]) * p.K_s, np.array([[-1.0, 1.0], [1.0, -1.0]]) * p.B_l
    damper[0, 0] -= p.B_eq + p.torque_per_volt * p.back_emf
    velocities = np.diag([1 / p.J_eq, 1 / p.J_l])
    motion = np.block([[np.zeros((2, 2)), velocities], [spring, damper @ velocities]])
    inputs = np.zeros((4, 3))
    inputs[2:] = [[p.torque_per_volt, -1.0, 1.0], [0.0, 0.0, -1.0]]
    return motion, inputs


def _effect(friction: tuple[float, ...], servo: float, link: float) -> tuple[float, float, float, float]:
    """What friction torques add to theta, alpha, theta_dot, alpha_dot in a substep."""
    p1, p2, q1, q2, r1, r2, s1, s2 = friction
    return p1 * servo + p2 * link, q1 * servo + q2 * link, r1 * servo + r2 * link, s1 * servo + s2 * link
