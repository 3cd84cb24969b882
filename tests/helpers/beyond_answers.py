"""Answers to the questions of notebook 11, by python-control and numpy alone, as a student works them out.

Each question has its usual way (``Student``), and other ways that are as good (``WAYS``).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import control
import numpy as np
import scipy.optimize
import sympy
from numpy.polynomial import Polynomial
from working_through import Where, state_space

from rotflex import experiments, hil, response, signals, simulation
from rotflex.hil.controllers import ObserverFeedback, StateFeedback, TwoDegreesOfFreedom
from rotflex.hil.student_benches import student_seed
from rotflex.recording import Recording

COUNT = 2 * np.pi / 4096
POLES = np.array([-12 + 16j, -12 - 16j, -30, -40])
LINK, TRIED = "link", (2, 10, 20, 30, 50)
gamma_dot, gamma_ddot, gamma_3, gamma_4 = sympy.symbols("gamma_dot gamma_ddot gamma_3 gamma_4")
J_eq, J_l, K_s, B_eq, a, b = sympy.symbols("J_eq J_l K_s B_eq a b")
_TORQUE = J_eq * (gamma_ddot + J_l / K_s * gamma_4) + J_l * gamma_ddot
FLAT = {
    ("4.9", "alpha"): -J_l / K_s * gamma_ddot,
    ("4.9", "V_m"): (_TORQUE + (B_eq + b) * (gamma_dot + J_l / K_s * gamma_3)) / a,
}
SERVO_ONLY, BOTH = np.eye(1, 4), np.eye(2, 4)


def square(h: float) -> Any:
    return signals.smooth_square_wave(signals.time_axis(10.0, h), 0.33, np.deg2rad(20), 100)


def zoh(A: Any, B: Any, h: float) -> tuple[Any, Any]:
    system = control.c2d(control.ss(A, B, np.eye(4), np.zeros((4, 1))), h)
    return np.asarray(system.A), np.asarray(system.B)


def with_delay(A: Any, B: Any, h: float, delay: float) -> tuple[Any, Any]:
    """Phi (5, 5) and Gamma (5, 1)."""
    (all_of_it, _), (rest, new), (_, old) = zoh(A, B, h), zoh(A, B, h - delay), zoh(A, B, delay)
    Phi, Gamma = np.zeros((5, 5)), np.zeros((5, 1))
    Phi[:4, :4], Phi[:4, 4:], Gamma[:4], Gamma[4] = all_of_it, rest @ old, new, 1
    return Phi, Gamma


def peak(loop: Any, h: float, points: int = 20000) -> float:
    """M_s of a loop gain, off a grid of frequencies."""
    omega = np.linspace(0.01, 1, points) * np.pi / h
    return float(np.abs(1 / (1 + control.frequency_response(loop, omega).complex)).max())


@dataclass
class Student:
    """A student with a bench, a stiffness, and what they did before notebook 11.

    Attributes
    ----------
    name : of the student
    bench : as the key knows it; for the arm
    K_s : stiffness, N·m/rad
    count : what they take for a count of the encoder in the noise, rad
    """

    name: str
    bench: Any
    K_s: float
    count: float = COUNT

    @cached_property
    def torque_model(self) -> tuple[Any, Any]:
        servo = self.bench.servo
        return state_space(self.K_s, self.bench.J_l, servo.J_eq, servo.B_eq)[:2]

    @cached_property
    def model(self) -> tuple[Any, Any]:
        return simulation.with_actuator(*self.torque_model, self.bench.servo)

    @cached_property
    def K(self) -> Any:
        return np.asarray(control.place(*self.model, POLES))

    @property
    def before(self) -> dict[Where, Any]:
        """Answers of other notebooks on which these build."""
        A, B = self.torque_model
        return {
            ("2.12", "K_s"): self.K_s,
            ("2.12", "J_l"): self.bench.J_l,
            ("2.14", "A"): A,
            ("2.14", "B"): B,
            ("3.4", "desired_poles"): POLES,
            ("3.8", "K"): self.K,
        }

    def run(self, controller: Any, reference: Any, h: float = 0.002) -> Recording:
        with hil.open("virtual", seed=student_seed(self.name)) as opened:
            return experiments.follow(opened, controller, reference, h, progress=False)

    # --- observers ------------------------------------------------------------------------------------------------

    def deviation(self, C: Any, samples: Any = range(50)) -> float:
        """By a sum over the samples, deg/s."""
        Phi = zoh(*self.model, 0.002)[0]
        rows = np.vstack([C @ np.linalg.matrix_power(Phi, k) for k in samples])
        return float(np.rad2deg(COUNT * np.sqrt(np.linalg.inv(rows.T @ rows)[3, 3] / 12)))

    def noise(self, h: float) -> Any:
        A, B = self.model
        torque = np.array([[0], [0], [0], [1 / self.bench.J_l]])
        effects = zoh(A, B, h)[1] * 0.1, zoh(A, torque, h)[1] * 0.005
        return sum(effect @ effect.T for effect in effects)

    def filter_gain(self, Phi: Any, C: Any, h: float) -> Any:
        Q = np.zeros(Phi.shape)
        Q[:4, :4] = self.noise(h)
        R = np.eye(len(C)) * self.count**2 / 12
        P = control.dlqe(Phi, np.eye(len(Phi)), C, Q, R)[1]
        return P @ C.T @ np.linalg.inv(C @ P @ C.T + R)

    @cached_property
    def L(self) -> Any:
        return self.filter_gain(zoh(*self.model, 0.002)[0], SERVO_ONLY, 0.002)

    def controller(self, C: Any = SERVO_ONLY) -> ObserverFeedback:
        Phi, Gamma = zoh(*self.model, 0.002)
        L = self.L if C is SERVO_ONLY else self.filter_gain(Phi, C, 0.002)
        return ObserverFeedback(Phi, Gamma, L, self.K, 0.002)

    # --- sampled design -------------------------------------------------------------------------------------------

    def sampled(self, h: float) -> tuple[Any, Any, Any, Any]:
        """Phi, Gamma, L, K."""
        Phi, Gamma = with_delay(*self.model, h, 0.002)
        K = np.asarray(control.place(Phi, Gamma, [*np.exp(POLES * h), 0]))
        return Phi, Gamma, self.filter_gain(Phi, np.eye(1, 5), h), K

    def growth(self, h: float, delay: float = 0.002) -> float:
        """Largest pole in z of the emulated loop less 1; angles of the last sample are states."""
        Phi, Gamma = with_delay(*self.model, h, delay)
        controller = StateFeedback(self.K, sample_time=h, cutoff=1 / h).system()
        plant = control.ss(Phi, Gamma, np.eye(2, 5), np.zeros((2, 1)), h)
        return float(np.abs(control.feedback(plant, controller, sign=1).poles()).max() - 1)

    def limit_ms(self, delay: float = 0.002) -> float:
        return 1e3 * float(scipy.optimize.brentq(lambda h: self.growth(h, delay), 0.01, 0.06))

    def is_lost(self, ms: int) -> bool:
        h = ms / 1e3
        try:
            run = self.run(StateFeedback(self.K, sample_time=h, cutoff=1 / h), square(h), h)
        except hil.LimitExceeded:
            return True
        return any(turn.settling_time == np.inf for turn in response.measure(run))

    def loops(self) -> tuple[Any, Any]:
        """Loop gains at 20 ms, emulated and sampled."""
        Phi, Gamma, L, K = self.sampled(0.02)
        plant = control.ss(Phi, Gamma, np.eye(2, 5), np.zeros((2, 1)), 0.02)
        emulated = StateFeedback(self.K, sample_time=0.02, cutoff=50).system()
        return tuple(-one * plant for one in (emulated, ObserverFeedback(Phi, Gamma, L, K, 0.02).system()))

    # --- feed-forward ---------------------------------------------------------------------------------------------

    def gamma(self, t: Any, power: int = 4, start: float = 0.5) -> list[Any]:
        """A turn of gamma by 40 deg in 0.5 s, and four of its derivatives."""
        x = Polynomial([0, 1])
        bell = (x**power * (1 - x) ** power).integ()
        path, s = bell / bell(1) * np.deg2rad(40), np.clip((t - start) / 0.5, 0, 1)
        return [path.deriv(k)(s) / 0.5**k if k else path(s) for k in range(5)]

    def turn(self, t: Any, power: int = 4, start: float = 0.5) -> tuple[Any, Any]:
        """States (4, n) and voltage (n,) of this turn."""
        servo, c, g = self.bench.servo, self.bench.J_l / self.K_s, self.gamma(t, power, start)
        states = np.array([g[0] + c * g[2], -c * g[2], g[1] + c * g[3], -c * g[3]])
        torque = servo.J_eq * (g[2] + c * g[4]) + servo.B_eq * states[2] - self.K_s * states[1]
        return states, torque / servo.torque_per_volt + servo.k_m * servo.K_g * states[2]

    def turned(self, friction: float = 0.07, power: int = 4, start: float = 0.5) -> Recording:
        states, volts = self.turn(signals.time_axis(2.0 + start, 0.002), power, start)
        K = self.K.ravel()
        ahead = (volts + friction * np.sign(np.round(states[2], 2)) + K @ states) / K[0] - states[0]
        return self.run(TwoDegreesOfFreedom(StateFeedback(K), ahead), states[0])

    @cached_property
    def answers(self) -> dict[Where, Any]:
        """All answers of notebook 11 that are marked automatically."""
        A = self.model[0]
        run, turned = self.run(self.controller(), square(0.002)), self.turned()
        states, volts = self.turn(signals.time_axis(2.5, 0.002))
        Phi, Gamma, L, K = self.sampled(0.03)
        peaks = [peak(loop, 0.02) for loop in self.loops()]
        return {
            ("4.1", "rank_servo"): np.linalg.matrix_rank(control.obsv(A, SERVO_ONLY)),
            ("4.1", "rank_link"): np.linalg.matrix_rank(control.obsv(A, np.eye(1, 4, 1))),
            ("4.1", "spare"): LINK,
            ("4.2", "deviation_servo"): self.deviation(SERVO_ONLY),
            ("4.2", "deviation_both"): self.deviation(BOTH),
            ("4.3", "L"): self.L,
            ("4.4", "response"): run,
            ("4.4", "noise_derivatives"): response.voltage_noise(self.run(StateFeedback(self.K), square(0.002))),
            ("4.4", "noise_observer"): response.voltage_noise(run),
            ("4.4", "swing_deg"): np.rad2deg(response.swing(run)),
            ("4.5", "Phi"): Phi,
            ("4.5", "Gamma"): Gamma,
            ("4.6", "K"): K,
            ("4.6", "response"): self.run(ObserverFeedback(Phi, Gamma, L, K, 0.03), square(0.03), 0.03),
            ("4.7", "limit_ms"): self.limit_ms(),
            ("4.7", "lost_ms"): str(next(ms for ms in TRIED if self.is_lost(ms))),
            ("4.8", "peak_emulated"): peaks[0],
            ("4.8", "peak_sampled"): peaks[1],
            ("4.8", "forgives"): "sampled",
            **FLAT,
            ("4.10", "alpha_max_deg"): np.rad2deg(np.abs(states[1]).max()),
            ("4.10", "V_max"): np.abs(volts).max(),
            ("4.10", "response"): turned,
            ("4.10", "swing_deg"): np.rad2deg(response.swing(turned)),
        }
