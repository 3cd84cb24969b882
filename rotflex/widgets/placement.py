"""A design without a page: poles in, gain and response out, and how good that is (Sections 3.1 and 3.4).

The program places the poles; how it is done by hand is what the notebooks ask. Beside the design: what an unstable loop
does on a bench, where the pair may lie so that all specifications are met, and the poles when the stiffness is not
quite what it was taken for. Margins and the linear quadratic regulator: ``control.margin`` and ``control.lqr``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import NormalDist
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import expm

from rotflex import response, simulation
from rotflex.errors import DesignError
from rotflex.hil.bench import Limits
from rotflex.recording import Recording
from rotflex.signals import rate_limit, step, time_axis
from rotflex.simulation import matrices
from rotflex.specifications import (
    AMPLITUDE,
    FREQUENCY,
    LIMITS,
    OMEGA_N,
    P_3,
    P_4,
    RATE,
    SAMPLE_TIME,
    SETTLING_BAND,
    ZETA,
)
from rotflex.units import DEG, HZ, Vector

_PARTIAL = np.array([1.0, 0.0, 1.0, 0.0])  # of the state, the servo's alone
HALF_PERIOD = 0.5 / FREQUENCY  #: s, of the square wave
STEP = 2 * DEG  #: rad; small, so that the swing can be seen to grow: the larger step meets a limit at its first swing
LEAD = 0.06  #: s before the step
HORIZON = 4.0  #: s, that a loop is followed after the step
_AFTER = 0.6  # s, that the arm is followed after the stop
BORDER = 1e-6  #: rad/s; a pole that is no further right than this is taken to lie on the imaginary axis
# s, sample time, beginning and end: fine enough for the peak of the voltage, then coarse
_PHASES = ((0.002, 0.0, 0.12), (0.01, 0.12, 1.0))
_GRID = (24, 22)  # damping ratios and natural frequencies tried
BIN = 1 / (8192 * SAMPLE_TIME)  #: Hz, of the notebooks' spectrum: the sweep, filled up with zeros to 8192 samples
#: Limits, relative, as ``04_modeling_results`` has them: of the peak, as the servo's loop gives way; of the inertia.
LOOP, INERTIA = 0.03, 0.01
COUNT = 41  #: stiffnesses that are tried


@dataclass(frozen=True)
class Dominant:
    """The desired poles (Equation 3.11): a dominant pair, and two real ones.

    Attributes
    ----------
    zeta : damping ratio, from -1 on; from 1 on the pair is two real poles
    omega_n : natural frequency, rad/s
    p3, p4 : rad/s
    """

    zeta: float = ZETA
    omega_n: float = OMEGA_N
    p3: float = P_3
    p4: float = P_4

    @property
    def pair(self) -> complex:
        """The upper pole of the pair, or the slower of two real ones."""
        if self.zeta < 1:
            return self.omega_n * complex(-self.zeta, math.sqrt(1 - self.zeta**2))
        return complex(-self.omega_n / (self.zeta + math.sqrt(self.zeta**2 - 1)))

    @property
    def partner(self) -> complex:
        """The lower pole of the pair, or the faster of two real ones."""
        if self.zeta < 1:
            return self.pair.conjugate()
        return complex(-self.omega_n * (self.zeta + math.sqrt(self.zeta**2 - 1)))

    @property
    def poles(self) -> NDArray[np.complex128]:
        """All four, rad/s."""
        return np.array([self.pair, self.partner, self.p3, self.p4])


@dataclass(frozen=True)
class Runaway:
    """A loop that does not settle.

    Attributes
    ----------
    growth : rad/s, the largest real part of its poles
    recording : theta_ref, theta, alpha (rad) and vm (V), until some time after the stop
    stopped : s after the step, when a limit of the bench was reached; None if none was
    what : the angle that reached it, or ""
    limit : rad
    """

    growth: float
    recording: Recording
    stopped: float | None
    what: str
    limit: float

    @property
    def doubled(self) -> float:
        """s, in which what swings becomes twice as large."""
        return math.log(2) / self.growth if self.growth > BORDER else math.inf

    @property
    def sentences(self) -> tuple[str, str, str]:
        """Where it lies, what it means, what comes of it."""
        where = "The closed loop is at the border of stability: a pole lies on the imaginary axis."
        means = "What swings there does not die away."
        if self.growth > BORDER:
            where = (
                f"The closed loop is unstable: a pole lies right of the imaginary axis, at +{self.growth:.2g} rad/s."
            )
            means = f"What swings grows: twice as large every {self.doubled:.2g} s."
        end = f"no limit of the bench is reached within {HORIZON:g} s."
        if self.stopped is not None:
            end = f"after {self.stopped:.2f} s the {self.what} is at its limit of {self.limit / DEG:.0f} deg, and the "
            end += "safety stops it at 0 V."
        return where, means, f"A step of {STEP / DEG:.0f} deg: {end}"


@dataclass(frozen=True)
class Design:
    """A gain and what it does.

    Attributes
    ----------
    wanted : (4,) poles asked for, rad/s
    feedback : "full" or "partial"
    K : (1, 4) gain, V/rad and V/(rad/s)
    polynomial : (5,) characteristic polynomial of the poles asked for, from s⁴ down
    poles : (4,) poles of the closed loop, rad/s: with partial feedback, not those asked for
    recording : the response to a step of 40 deg, with no limit on the voltage; None if the loop is unstable
    findings : the four specifications, held against it; empty if the loop is unstable
    trouble : why there is no response
    runaway : what it does instead, if the loop is unstable
    """

    wanted: NDArray[np.complex128]
    feedback: str
    K: Vector
    polynomial: Vector
    poles: NDArray[np.complex128]
    recording: Recording | None
    findings: Sequence[response.Finding]
    trouble: str = ""
    runaway: Runaway | None = None

    @property
    def applied(self) -> Vector:
        """The gain that is fed back: of the four numbers, with partial feedback two."""
        return self.K * _PARTIAL if self.feedback == "partial" else self.K

    @property
    def motion(self) -> Recording | None:
        """What the arm does: the response, or how it runs away."""
        return self.recording if self.runaway is None else self.runaway.recording


def reference(amplitude: float = AMPLITUDE, rate: float = RATE) -> tuple[Vector, Vector]:
    """Half a period of the ±20 deg wave, its step from -20 to 20 deg at the beginning.

    Parameters
    ----------
    amplitude : rad, in place of 20 deg
    rate : limit on the slope of the unit wave, 1/s

    Returns
    -------
    t, theta_ref : (n,) s, from -0.06 s on, and rad
    """
    t = time_axis(HALF_PERIOD + LEAD, SAMPLE_TIME) - LEAD
    return t, amplitude * rate_limit(step(t, 2.0) - 1, rate, SAMPLE_TIME, initial=-1.0)


def design(A: ArrayLike, B: ArrayLike, poles: ArrayLike, feedback: str = "full") -> Design:
    """Place poles by Ackermann's formula, and see what the closed loop does.

    Parameters
    ----------
    A, B : (4, 4) and (4,) or (4, 1), the model with the motor voltage as input
    poles : (4,) rad/s; complex ones in pairs
    feedback : "full" or "partial"

    Raises
    ------
    DesignError
        If a matrix is not of that shape, the poles are not four in conjugate pairs, or they cannot be placed.
    """
    a, b = matrices(A, B)
    wanted = np.asarray(poles, dtype=complex).ravel()
    polynomial = np.poly(wanted)
    if wanted.size != 4 or not np.isfinite(wanted).all() or np.abs(np.imag(polynomial)).max() > 1e-6:
        raise DesignError("Four poles are needed, complex ones in conjugate pairs.")
    gain = np.real(polynomial) @ _ackermann(a, b)
    return with_gain(a, b, gain, feedback, wanted)


def _ackermann(a: Vector, b: Vector) -> Vector:
    """Return the (5, 4) by which a desired polynomial (5,), from s⁴ down, is multiplied to get the gain (4,).

    This is Ackermann's formula. It inverts the controllability matrix: how exact the gain is depends on its condition.

    Raises
    ------
    DesignError
        If the input does not reach all four states: they are not controllable.
    """
    powers = [np.linalg.matrix_power(a, n) for n in range(5)]
    reach = np.hstack([power @ b for power in powers[:4]])
    if np.linalg.matrix_rank(reach) < 4:
        raise DesignError("The poles of this model cannot be placed: look at A and B.")
    last = np.linalg.solve(reach.T, np.array([0.0, 0.0, 0.0, 1.0]))
    return np.array([last @ power for power in powers[::-1]])


def with_gain(
    A: ArrayLike,
    B: ArrayLike,
    K: ArrayLike,
    feedback: str = "full",
    wanted: ArrayLike | None = None,
    amplitude: float = AMPLITUDE,
    rate: float = RATE,
) -> Design:
    """Compute what a gain does; ``wanted`` are the poles that it was made for, by default those of the closed loop.

    ``amplitude`` (rad) and ``rate`` (1/s) are those of the command, see :func:`reference`.

    Raises
    ------
    DesignError
        As :func:`design`.
    """
    a, b = matrices(A, B)
    gain = np.asarray(K, dtype=float).reshape(1, -1)
    if gain.shape != (1, 4) or not np.isfinite(gain).all():
        raise DesignError(f"K must be four finite numbers; it is {K!r}.")
    applied = gain * _PARTIAL if feedback == "partial" else gain
    found = np.linalg.eigvals(a - b @ applied)
    asked = np.linalg.eigvals(a - b @ gain) if wanted is None else np.asarray(wanted, dtype=complex)
    recording, findings, trouble, runaway = None, [], "", None
    growth = float(found.real.max())
    if growth > -BORDER:
        runaway = run_away(a, b, applied, growth)
        trouble = " ".join(runaway.sentences)
    else:
        t, theta_ref = reference(amplitude, rate)
        try:
            recording = simulation.closed_loop(
                a, b, gain, theta_ref, SAMPLE_TIME, feedback, saturation=None, x0=(-amplitude, 0, 0, 0)
            )
            recording = Recording(t, recording.channels, recording.metadata)
            findings = response.verdict(response.worst(response.measure(recording)))
        except DesignError as error:
            trouble = str(error)
    return Design(asked, feedback, gain, np.real(np.poly(asked)), found, recording, findings, trouble, runaway)


# --- an unstable loop: it swings up until the bench's safety stops it -------------------------------------------------


def run_away(a: Vector, b: Vector, applied: Vector, growth: float) -> Runaway:
    """Follow a small step until a limit of the bench stops it, and the arm after that.

    Parameters
    ----------
    a, b : (4, 4) and (4, 1), the model with the motor voltage as input; nothing limits the voltage here
    applied : (1, 4) gain that is fed back
    growth : rad/s, the largest real part of the loop's poles
    """
    driven, free = _transition(a - b @ applied, b * applied[0, 0]), _transition(a, 0 * b)
    what, limit, limits = "", 0.0, Limits()
    samples: list[tuple[float, float, float, float]] = []
    state, stopped = np.array([-STEP / 2, 0.0, 0.0, 0.0, 0.0]), None
    for number in range(round((LEAD + HORIZON) / SAMPLE_TIME) + 1):
        t = number * SAMPLE_TIME - LEAD
        command = STEP / 2 * min(max(RATE * (t + SAMPLE_TIME), 0.0) - 1, 1.0)
        state[4] = command
        theta, alpha = float(state[0]), float(state[1])
        for name, angle, most in (("servo angle", theta, limits.theta), ("deflection", alpha, limits.alpha)):
            if stopped is None and abs(angle) > most:
                what, limit, stopped = name, most, t
        volts = float(applied[0, 0] * command - applied[0] @ state[:4]) if stopped is None else 0.0
        samples.append((command, theta, alpha, volts))
        if stopped is not None and t >= stopped + _AFTER:
            break
        state = (driven if stopped is None else free) @ state
    command_, theta_, alpha_, vm = np.array(samples).T
    time = np.arange(len(samples)) * SAMPLE_TIME - LEAD
    about = {"source": "simulation", "experiment": "runaway"}
    recording = Recording.of(time, about, theta_ref=command_, theta=theta_, alpha=alpha_, vm=vm)
    return Runaway(growth, recording, stopped, what, limit)


def _transition(a: Vector, input_: Vector) -> Vector:
    """Of the state and an input that is held, from each sample to the next."""
    return np.asarray(expm(np.block([[a, input_], [np.zeros((1, 5))]]) * SAMPLE_TIME))


# --- where the dominant pair may lie: many designs, simulated at once -------------------------------------------------


class Region:
    """Where the dominant pair may lie so that all four specifications are met, the real poles being where they are.

    Many designs at once, at a coarse sample time: quick enough to follow a pole that is dragged.

    Parameters
    ----------
    A, B : as in :func:`design`
    """

    def __init__(self, A: ArrayLike, B: ArrayLike) -> None:
        self._a, self._b = matrices(A, B)
        self._rows = _ackermann(self._a, self._b)
        zeta, omega = np.meshgrid(np.linspace(0.2, 0.99, _GRID[0]), np.linspace(6.0, 40.0, _GRID[1]))
        self.zeta, self.omega = zeta, omega

    def excess(self, p3: float, p4: float, feedback: str = "full") -> Vector:
        """How far the worst specification is exceeded, as a fraction of its limit: negative where all are met.

        Returns
        -------
        (m, n) array over ``omega`` and ``zeta``
        """
        zeta, omega = self.zeta.ravel(), self.omega.ravel()
        fast = np.poly([p3, p4])
        pairs = np.stack([np.ones_like(zeta), 2 * zeta * omega, omega**2], axis=1)
        polynomials = np.zeros((zeta.size, 5))
        for shift, coefficient in enumerate(fast):
            polynomials[:, shift : shift + 3] += coefficient * pairs
        gains = polynomials @ self._rows
        applied = gains * [1, 0, 1, 0] if feedback == "partial" else gains
        return excess_of(self._a, self._b, applied).reshape(self.zeta.shape)

    def outline(self, p3: float, p4: float, feedback: str = "full") -> list[tuple[Vector, Vector]]:
        """The region's borders in the s-plane, upper half: closed curves (real part, imaginary part), rad/s."""
        import contourpy

        real = -self.zeta * self.omega
        imaginary = self.omega * np.sqrt(1 - self.zeta**2)
        excess = np.clip(self.excess(p3, p4, feedback), -1.0, 1.0)
        lines: Any = contourpy.contour_generator(real, imaginary, excess, fill_type=contourpy.FillType.OuterCode)
        curves, _ = lines.filled(-2.0, 0.0)
        return [(np.array(curve[:, 0]), np.array(curve[:, 1])) for curve in curves]


def excess_of(a: Vector, b: Vector, gains: Vector) -> Vector:
    """The worst of the four specifications, exceeded by this fraction (n,), for gains (n, 4).

    Parameters
    ----------
    a, b : (4, 4), or one for each gain (n, 4, 4), and (4, 1)
    gains : that are fed back, V/rad and V/(rad/s)
    """
    n = len(gains)
    M = np.zeros((n, 5, 5))
    M[:, :4, :4] = a - b[None] * gains[:, None, :]
    M[:, :4, 4] = b[:, 0] * gains[:, :1]
    phases = [(dt, expm(M * dt), round((until - since) / dt)) for dt, since, until in _PHASES]
    steps = [(dt, transition) for dt, transition, count in phases for _ in range(count)]
    t = np.cumsum([0.0, *(dt for dt, _ in steps)])
    theta_ref = np.minimum(AMPLITUDE * (RATE * (t + SAMPLE_TIME) - 1), AMPLITUDE)
    state = np.zeros((n, 5, 1))
    state[:, 0] = -AMPLITUDE
    theta, alpha, volts = np.empty((3, t.size, n))
    with np.errstate(over="ignore", invalid="ignore"):
        for k, target in enumerate(theta_ref.tolist()):
            state[:, 4] = target
            theta[k], alpha[k] = state[:, 0, 0], state[:, 1, 0]
            volts[k] = gains[:, 0] * target - (gains * state[:, :4, 0]).sum(axis=1)
            if k < len(steps):
                state = steps[k][1] @ state
    beyond = theta - AMPLITUDE
    overshoot = 100 * beyond.max(axis=0) / (2 * AMPLITUDE)
    late = t > LIMITS["settling_time"]
    band = SETTLING_BAND * AMPLITUDE
    settling = np.abs(beyond[late]).max(axis=0)  # in the band at the limit, and for good
    measures = (
        settling / band,
        overshoot / LIMITS["overshoot"],
        np.abs(alpha).max(axis=0) / LIMITS["max_alpha"],
        np.abs(volts).max(axis=0) / LIMITS["max_vm"],
    )
    excess: Vector = np.nan_to_num(np.max(measures, axis=0) - 1, nan=1e3, posinf=1e3)
    return excess


# --- a stiffness that is not quite certain ----------------------------------------------------------------------------


@dataclass(frozen=True)
class Cloud:
    """One gain on many models.

    Attributes
    ----------
    spread : relative standard uncertainty of K_s
    factors : (n,) of K_s, all equally likely
    poles : (n, 4) of the closed loop, rad/s
    share : of the models, on which all four specifications are met
    """

    spread: float
    factors: Vector
    poles: NDArray[np.complex128]
    share: float


def spread_of(a: Vector) -> float:
    """The relative standard uncertainty of K_s = J_l·omega_n², as the notebooks work it out.

    Of what may lie anywhere within a limit, it is the limit over √3; omega_n counts twice. Limits: half a bin of the
    spectrum, the loop, the inertia.

    Raises
    ------
    DesignError
        If the model has no spring between servo and link.
    """
    squared = -a[3, 1] - a[2, 1]  # K_s / J_l
    if not squared > 0:
        raise DesignError("The model has no spring between servo and link: look at the second column of A.")
    half_a_bin = BIN / 2 * HZ / np.sqrt(squared)
    return float(np.hypot(INERTIA, 2 * np.hypot(half_a_bin, LOOP)) / np.sqrt(3))


def cloud(a: Vector, b: Vector, applied: Vector, spread: float) -> Cloud:
    """Put a gain on models whose stiffness differs.

    Parameters
    ----------
    a, b : (4, 4) and (4, 1), the model with the motor voltage as input; K_s is in the second column of its lower half
    applied : (1, 4) gain that is fed back
    spread : relative standard uncertainty of K_s
    """
    factors = np.array([1 + spread * NormalDist().inv_cdf((k + 0.5) / COUNT) for k in range(COUNT)]).clip(0.0)
    models = np.repeat(a[None], COUNT, axis=0)
    models[:, 2:, 1] *= factors[:, None]
    poles = np.asarray(np.linalg.eigvals(models - b @ applied), dtype=complex)
    met = excess_of(models, b, np.repeat(applied, COUNT, axis=0)) <= 0
    return Cloud(spread, factors, poles, float(met.mean()))
