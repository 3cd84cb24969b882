"""The nonlinear plant against general-purpose integrators on equations written out here, and against energy."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from rotflex import plant
from rotflex.config import joint, srv02
from rotflex.errors import ConfigurationError
from rotflex.plant import REST, STRIBECK_RATE, Plant, PlantParameters, State

SAMPLE_TIME = 0.002
TIGHT = {"method": "DOP853", "rtol": 1e-11, "atol": 1e-13}

SMOOTH = PlantParameters(
    J_eq=2.08e-3, J_l=3.28e-3, K_s=1.4, B_eq=0.004, B_l=0.001, torque_per_volt=0.12845, back_emf=0.53743, resistance=2.6
)
ROUGH = replace(SMOOTH, B_eq=0.0095, B_l=0.0021, servo_friction=(0.0076, 0.014), link_friction=(0.0028, 0.0036))
STICKY = replace(ROUGH, stribeck=0.4, load=0.13, gear=((5, 0.2, 0.15), (70, 0.1, 0.3)))
LOSSLESS = replace(SMOOTH, B_eq=0.0, B_l=0.0, I_max=0.0)


def drive(parameters: PlantParameters, voltages: Sequence[float], hold: float, state: State = REST) -> np.ndarray:
    """States (n, 4) of the plant after every sample time, each voltage held for ``hold``."""
    plant = Plant(parameters, state)
    samples = round(hold / SAMPLE_TIME)
    return np.array([plant.advance(v, SAMPLE_TIME) for v in voltages for _ in range(samples)])


def reference_of(p: PlantParameters, voltages: Sequence[float], hold: float, alpha: float = 0.0) -> np.ndarray:
    """States (n, 4) at every sample time of the frictionless plant, from rest at a deflection.

    Integrated anew from each change of the voltage.
    """

    def equations(_, x, voltage):
        theta, phi, theta_dot, phi_dot = x
        current = np.clip(
            (np.clip(voltage, -p.V_max, p.V_max) - p.back_emf * theta_dot) / p.resistance, -p.I_max, p.I_max
        )
        torque = p.torque_per_volt * p.resistance * current
        spring = p.K_s * (phi - theta) + p.K_3 * (phi - theta) ** 3 + p.B_l * (phi_dot - theta_dot)
        return [theta_dot, phi_dot, (torque - p.B_eq * theta_dot + spring) / p.J_eq, -spring / p.J_l]

    x, pieces = np.array([0.0, alpha, 0.0, 0.0]), []
    instants = np.arange(1, round(hold / SAMPLE_TIME) + 1) * SAMPLE_TIME
    for voltage in voltages:
        x = solve_ivp(equations, (0, instants[-1]), x, args=(voltage,), t_eval=instants, **TIGHT).y
        pieces.append(x)
        x = x[:, -1]
    theta, phi, theta_dot, phi_dot = np.hstack(pieces)
    return np.column_stack([theta, phi - theta, theta_dot, phi_dot - theta_dot])


def energy_of(p: PlantParameters, states: Sequence[float]) -> np.ndarray:
    """Kinetic and elastic energy (J) of states (..., 4)."""
    _theta, alpha, theta_dot, alpha_dot = np.moveaxis(np.asarray(states, dtype=float), -1, 0)
    kinetic = p.J_eq * theta_dot**2 / 2 + p.J_l * (theta_dot + alpha_dot) ** 2 / 2
    return kinetic + p.K_s * alpha**2 / 2 + p.K_3 * alpha**4 / 4


def waves_of(p: PlantParameters, theta: float) -> float:
    """The factor of a rough gear: each half wave is a parabola."""
    turned = [((number * theta / (2 * math.pi) + phase) % 1, height) for number, height, phase in p.gear]
    return 1 + sum(height * math.copysign(1 - (4 * (part % 0.5) - 1) ** 2, 0.5 - part) for part, height in turned)


class StickSlip:
    """The plant with Coulomb friction as a machine of nine modes: each joint stands (0) or slides (+1, -1).

    Each mode has its own smooth equations, and ends at an event: a sliding joint comes to a stop, or the torque on a
    standing one passes what friction can hold.
    """

    def __init__(self, p: PlantParameters) -> None:
        self.p = p

    def bounds(self, x: np.ndarray) -> list[tuple[float, float]]:
        """Friction of servo and link in a state, one way and the other; what a joint that stands is held by at most."""
        factor = waves_of(self.p, x[0]) * (1 + self.p.stribeck / (1 + (x[2] / STRIBECK_RATE) ** 2))
        pressed = self.p.load * abs(self.p.K_s * x[1])
        return [tuple(factor * bound + pressed for bound in self.p.servo_friction), self.p.link_friction]

    def accelerations(self, x: np.ndarray, voltage: float, mode: tuple[int, int]) -> tuple[float, float, float, float]:
        """theta_ddot, alpha_ddot, and the friction torques of servo and link, in a mode."""
        p = self.p
        _, alpha, theta_dot, alpha_dot = x
        motor = p.torque_per_volt * (voltage - p.back_emf * theta_dot) - p.B_eq * theta_dot
        servo, link = (plus if way > 0 else -minus for way, (plus, minus) in zip(mode, self.bounds(x), strict=True))
        arm = p.K_s * alpha + p.B_l * alpha_dot + link  # torque between servo and arm while the link slides
        if mode[0] and mode[1]:
            theta_ddot = (motor - servo + arm) / p.J_eq
            return theta_ddot, -arm / p.J_l - theta_ddot, servo, link
        if mode[0]:  # servo and arm turn as one body
            theta_ddot = (motor - servo) / (p.J_eq + p.J_l)
            return theta_ddot, 0.0, servo, -p.J_l * theta_ddot - p.K_s * alpha
        if mode[1]:
            return 0.0, -arm / p.J_l, motor + arm, link
        return 0.0, 0.0, motor, -p.K_s * alpha

    def mode(self, x: np.ndarray, voltage: float, leaving: dict[int, int]) -> tuple[int, int]:
        """The mode that a state goes on in; ``leaving`` says which way a joint has just been torn loose."""
        choices = [
            [leaving[i]] if i in leaving else [int(np.sign(rate))] if rate else [0, 1, -1]
            for i, rate in enumerate(x[2:])
        ]
        margins = {}
        for mode in product(*choices):
            *rates, servo, link = self.accelerations(x, voltage, mode)
            margin = 1.0
            for i, torque in enumerate((servo, link)):
                if x[2 + i] == 0 and i not in leaving:
                    plus, minus = self.bounds(x)[i]
                    held_by = min(plus - torque, torque + minus) / max(plus, minus)
                    held_by += 10 * (held_by > 0)  # what can stand does, though it could slide on as well
                    margin = min(margin, mode[i] * rates[i] if mode[i] else held_by)
            margins[mode] = margin
        return max(margins, key=margins.__getitem__)

    def run(self, voltages: Sequence[float], hold: float, alpha: float = 0.0) -> tuple[np.ndarray, int]:
        """States (n, 4) at every fifth sample time, from rest at a deflection, and how many modes there were."""
        x, states, modes = np.array([0.0, alpha, 0.0, 0.0]), [], 0
        for voltage in voltages:
            t, leaving = 0.0, {}
            instants = np.arange(5, round(hold / SAMPLE_TIME) + 1, 5) * SAMPLE_TIME
            while t < hold - 1e-12:
                modes += 1
                mode = self.mode(x, voltage, leaving)
                events, meanings = self.events(mode, voltage, t)
                solution = solve_ivp(
                    lambda _, y, voltage=voltage, mode=mode: [y[2], y[3], *self.accelerations(y, voltage, mode)[:2]],
                    (t, hold),
                    x,
                    events=events,
                    dense_output=True,
                    max_step=0.005,
                    **TIGHT,
                )
                t, x, leaving = solution.t[-1], solution.y[:, -1].copy(), {}
                reached = instants[instants <= t + 1e-12]
                states += [solution.sol(min(instant, t)) for instant in reached]
                instants = instants[reached.size :]
                for (joint_, way), when in zip(meanings, solution.t_events, strict=True):
                    if when.size and way:
                        leaving[joint_] = way
                    elif when.size:
                        x[2 + joint_] = 0.0
        return np.array(states), modes

    def events(self, mode: tuple[int, int], voltage: float, start: float):
        """What ends a mode, as solve_ivp wants it, and its meaning: the joint, and the way it is torn (0: it stops)."""
        events, meanings = [], []
        for i, way in enumerate(mode):
            for direction in (0,) if way else (1, -1):

                def event(t, y, i=i, way=way, direction=direction):
                    if way:  # a joint that has just been torn loose has no speed yet
                        return way * y[2 + i] if t > start else 1.0
                    plus, minus = self.bounds(y)[i]
                    return direction * self.accelerations(y, voltage, mode)[2 + i] - (plus if direction > 0 else minus)

                event.terminal, event.direction = True, -1 if way else 1
                events.append(event)
                meanings.append((i, direction))
        return events, meanings


def test_time_goes_forward_only_and_the_same_voltages_give_the_same_motion():
    plant = Plant(ROUGH, State(0.1, 0.2, 0.3, 0.4))
    assert plant.advance(5.0, 0.0) == State(0.1, 0.2, 0.3, 0.4)
    for voltage, duration in ((1.0, -0.002), (1.0, math.nan), (1.0, math.inf), (math.nan, SAMPLE_TIME)):
        with pytest.raises(ConfigurationError, match=r"cannot be advanced|not a number"):
            plant.advance(voltage, duration)
    voltages = np.random.default_rng(5).uniform(-4, 4, 50)
    np.testing.assert_array_equal(drive(ROUGH, voltages, 0.02), drive(ROUGH, voltages, 0.02))


def test_energy_in_a_cubic_spring_stays_within_a_bound():
    hard = replace(LOSSLESS, K_3=8.0)
    energy = energy_of(hard, drive(hard, [0.0], 20.0, State(0.0, 0.4, 0.0, 0.0)))
    start = 1.4 * 0.4**2 / 2 + 8.0 * 0.4**4 / 4
    first, last = energy[: len(energy) // 4] / start - 1, energy[-len(energy) // 4 :] / start - 1
    assert np.abs(energy / start - 1).max() < 2e-5
    assert np.abs(last).max() < 1.05 * np.abs(first).max()  # it swings, and does not drift


parameter_sets = st.builds(
    lambda J_eq, J_l, K_s: replace(LOSSLESS, J_eq=J_eq, J_l=J_l, K_s=K_s),
    *(st.floats(5e-4, 1e-2), st.floats(5e-4, 1e-2), st.floats(0.3, 5.0)),
)
states = st.builds(State, st.floats(-3, 3), st.floats(-0.5, 0.5), st.floats(-10, 10), st.floats(-10, 10))
frictions = st.tuples(st.floats(0, 0.05), st.floats(0, 0.05))


@settings(max_examples=30)
@given(parameter_sets, states, frictions, frictions, st.floats(0, 0.02), st.sampled_from([0.0, math.inf]))
def test_energy_never_grows_without_input(parameters, state, servo_friction, link_friction, damping, I_max):
    rough = replace(parameters, servo_friction=servo_friction, link_friction=link_friction)
    rough = replace(rough, B_eq=damping, B_l=damping / 5, I_max=I_max)
    energy = energy_of(rough, np.vstack([state, drive(rough, [0.0], 0.3, state)]))
    # While a joint breaks loose or turns round, or stands while the other moves, friction is constant for one substep:
    # it gives back next to nothing.
    assert np.diff(energy).max() <= 1e-7 + 1e-12 * energy[0]  # J; measured 5e-10


# Mostly the error is 5e-6 rad. Where the motion hangs on a stop that is nearly none, it can be some 4e-5 rad.
@pytest.mark.parametrize("parameters", [ROUGH, STICKY], ids=["smooth gear", "rough gear"])
@pytest.mark.parametrize(("seed", "amplitude", "alpha"), [(2, 3.0, 0.15), (3, 0.3, 0.2), (5, 6.0, -0.2)])
def test_friction_is_that_of_an_event_based_integration(seed, amplitude, alpha, parameters):
    voltages = amplitude * np.random.default_rng(seed).uniform(-1, 1, 16)
    reference, modes = StickSlip(parameters).run(voltages, 0.25, alpha)
    reversals = np.count_nonzero(np.diff(np.sign(reference[:, 2])))
    assert modes > 40
    assert reversals >= 4
    error = np.abs(drive(parameters, voltages, 0.25, State(0.0, alpha, 0.0, 0.0))[4::5] - reference)
    assert error[:, :2].max() < (4e-5 if parameters.gear else 2e-5)  # an encoder count is 1.5e-3 rad


@pytest.mark.parametrize("parameters", [ROUGH, STICKY], ids=["smooth gear", "rough gear"])
@pytest.mark.parametrize("way", [1, -1])
def test_break_away_needs_the_friction_of_that_direction(way, parameters):
    at_rest = (1 + parameters.stribeck) * waves_of(parameters, 0.0)
    bound = at_rest * parameters.servo_friction[0 if way > 0 else 1] / parameters.torque_per_volt
    holding, moving = Plant(parameters), Plant(parameters)
    for _ in range(500):
        holding.advance(0.999 * way * bound, SAMPLE_TIME)
        moving.advance(1.01 * way * bound, SAMPLE_TIME)
    assert holding.state == REST
    assert way * moving.state.theta > 1e-4


@pytest.mark.parametrize("way", [1, -1])
def test_a_small_deflection_is_held_where_it_is(way):
    bound = ROUGH.link_friction[1 if way > 0 else 0] / ROUGH.K_s  # it would move back
    holding, moving = (Plant(ROUGH, State(0.5, share * way * bound, 0.0, 0.0)) for share in (0.99, 1.02))
    for _ in range(500):
        holding.advance(0.0, SAMPLE_TIME)
        moving.advance(0.0, SAMPLE_TIME)
    assert holding.state == (0.5, 0.99 * way * bound, 0.0, 0.0)
    assert way * moving.state.alpha < 1.02 * bound


ulps = st.integers(-3, 3)


@settings(max_examples=100)
@given(st.sampled_from([1, -1]), st.sampled_from([1, 0, -1]), ulps, ulps, st.sampled_from([1, 2, 7]))
def test_at_the_very_border_of_break_away_nothing_moves(link_way, servo_way, link_ulps, servo_ulps, milliseconds):
    """To rounding, neither standing nor sliding may seem possible there."""
    rough = replace(ROUGH, servo_friction=(0.01, 0.008), link_friction=(0.002, 0.003), K_s=1.4)
    alpha = link_way * rough.link_friction[link_way > 0] / rough.K_s * (1 + link_ulps * 2**-52)
    bound = {1: 0.01, 0: 0.0, -1: -0.008}[servo_way]
    plant = Plant(rough, State(0.0, alpha, 0.0, 0.0))
    for _ in range(5):
        plant.advance(bound / rough.torque_per_volt * (1 + servo_ulps * 2**-52), milliseconds / 1000)
    np.testing.assert_allclose(plant.state, [0.0, alpha, 0.0, 0.0], atol=1e-10)


def test_a_servo_that_stops_stands_exactly_while_the_link_swings_on():
    """Slower than 1 mrad/s, and pushed with less than half of what friction holds, it has stopped a sample later."""
    rough = replace(ROUGH, link_friction=(0.001, 0.001))
    _, alpha, theta_dot, alpha_dot = drive(rough, [0.0], 1.0, State(0.0, 0.25, 0.0, 0.0)).T
    pushed = np.abs(rough.K_s * alpha + rough.B_l * alpha_dot) + max(rough.link_friction)
    weak = pushed < 0.5 * min(rough.servo_friction)
    held = weak[:-1] & weak[1:] & (np.abs(theta_dot[:-1]) < 1e-3)
    assert held.sum() > 50 and np.abs(alpha_dot[1:][held]).max() > 0.1
    assert not theta_dot[1:][held].any()


def test_a_link_that_stops_stands_exactly_while_the_servo_turns_on():
    rough = replace(ROUGH, servo_friction=(0.001, 0.001))
    _, alpha, theta_dot, alpha_dot = drive(rough, [3.0], 2.0, State(0.0, 0.1, 0.0, 0.0)).T
    late = slice(500, None)  # after 1 s
    assert theta_dot[late].min() > 1.0
    assert not alpha_dot[late].any() and np.ptp(alpha[late]) == 0.0


def test_everything_stops_in_the_end_and_stays():
    plant = Plant(ROUGH, State(0.0, 0.25, 3.0, -2.0))
    plant.advance(0.0, 5.0)
    resting = plant.state
    assert resting.theta_dot == resting.alpha_dot == 0.0
    assert abs(resting.alpha) <= max(ROUGH.link_friction) / ROUGH.K_s
    plant.advance(0.0, 5.0)
    assert plant.state == resting


SWITCHED = [24.0, -24.0, 5.0, -1.0, 12.0, 30.0, -30.0, 0.0]


@pytest.mark.parametrize(
    ("changes", "angle", "tolerance"),
    [
        ({"I_max": 1.0}, 0, 1e-7),
        ({"V_max": 6.0}, 0, 1e-7),
        ({"V_max": 10.0, "I_max": 2.0}, 0, 1e-7),
        ({"I_max": 0.0}, 0, 1e-7),
        ({"K_3": 20.0, "V_max": 6.0}, 1, 1e-5),
    ],
)
def test_amplifiers_limits_and_cubic_spring_are_those_of_an_independent_integration(changes, angle, tolerance):
    plant = replace(SMOOTH, **changes)
    reference = reference_of(plant, SWITCHED, 0.2, alpha=0.1)
    without = reference_of(SMOOTH if angle == 0 else replace(plant, K_3=0.0), SWITCHED, 0.2, alpha=0.1)
    assert np.abs(reference - without)[:, angle].max() > 0.05
    error = np.abs(drive(plant, SWITCHED, 0.2, State(0, 0.1, 0, 0)) - reference)
    assert error[:, :2].max() < tolerance


def test_a_current_limit_holds_the_torque_whatever_the_voltage():
    limited = replace(SMOOTH, I_max=0.5, V_max=math.inf)
    assert limited.current(100.0, 0.0) == 0.5
    assert limited.current(-100.0, 5.0) == -0.5
    assert limited.current(1.0, 0.0) == pytest.approx(1.0 / 2.6)
    assert replace(SMOOTH, V_max=6.0).current(100.0, 2.0) == pytest.approx((6.0 - 0.53743 * 2.0) / 2.6)


def test_nominal_parts_give_the_nominal_plant():
    servo, arm = srv02(amplifier="UPM_1503", cable_gain=3), joint(2)
    plant = PlantParameters.of(servo, arm, 1.3)
    assert (plant.J_eq, plant.B_eq, plant.J_l, plant.K_s) == (servo.J_eq, 0.004, arm.J_l, 1.3)
    assert plant.torque_per_volt == pytest.approx(0.128453, abs=1e-6)
    assert plant.torque_per_volt * plant.back_emf + plant.B_eq == pytest.approx(0.073035, abs=1e-6)
    assert (plant.V_max, plant.I_max) == (15.0, 3.0)
    assert plant.servo_friction == plant.link_friction == (0.0, 0.0)


def test_impossible_parameters_are_named():
    impossible = [("J_eq", 0.0), ("J_l", -1e-3), ("K_s", math.nan), ("resistance", math.inf), ("B_eq", -0.001)]
    impossible += [("B_l", math.inf), ("K_3", -1.0), ("back_emf", math.nan), ("torque_per_volt", -0.1), ("I_max", -1.0)]
    impossible += [("V_max", math.nan), ("servo_friction", (0.01, -0.01)), ("stribeck", -0.1), ("load", math.nan)]
    impossible += [("gear", ((5, 0.6, 0.0), (70, 0.5, 0.0))), ("gear", ((5, math.nan, 0.0),))]
    for name, value in [*impossible, ("link_friction", (0.01, math.inf)), ("link_friction", (0.01,))]:
        with pytest.raises(ConfigurationError, match=name):
            replace(SMOOTH, **{name: value})


@pytest.mark.parametrize("start", [State(0.0, 0.05, 4.0, 0.0), State(1.0, -0.05, -3.0, 1.0)])
def test_while_the_servo_slides_the_error_falls_with_the_square_of_the_substep(monkeypatch, start):
    p = replace(STICKY, link_friction=(0.0, 0.0), gear=((5, 0.2, 0.15),))
    way = math.copysign(1, start.theta_dot)

    def equations(_, x):
        accelerations = machine.accelerations(x, 4.0 * way, (int(way), int(math.copysign(1, x[3]))))
        return [x[2], x[3], *accelerations[:2]]

    machine, errors = StickSlip(p), []
    exact = solve_ivp(equations, (0, 0.2), start, max_step=1e-3, **TIGHT).y[:2, -1]
    for substep in (2e-3, 1e-3, 5e-4):
        monkeypatch.setattr(plant, "SUBSTEP", substep)
        monkeypatch.setattr(plant, "ONE_STANDS_SUBSTEP", substep)
        found = drive(p, [4.0 * way], 0.2, start)
        assert (found[:, 2] * way > 1.0).all()
        errors.append(np.abs(found[-1, :2] - exact).max())
    assert errors[0] < 1e-5
    assert errors[-1] < errors[0] / 10  # of the first order, it would be a fourth
