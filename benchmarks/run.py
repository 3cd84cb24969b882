"""How quick things are, as ratios measured in one run.

    python benchmarks/run.py [--smoke]

* import of `rotflex` and of what a notebook starts with, in fresh interpreters;
* a 15 s sweep and 10 s of tracking on the virtual bench, as multiples of real time;
* the plant alone against scipy's solve_ivp on the same equations and voltages, at like accuracy.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from statistics import median

import numpy as np
from scipy.integrate import solve_ivp

from rotflex import experiments, hil
from rotflex.plant import Plant, PlantParameters
from rotflex.signals import chirp, time_axis

REPEATS = 5
SAMPLE_TIME = 0.002


def seconds(action: Callable[[], object], repeats: int) -> float:
    """Median wall time of an action, s."""
    taken = []
    for _ in range(repeats):
        started = time.perf_counter()
        action()
        taken.append(time.perf_counter() - started)
    return median(taken)


def import_time(statement: str, repeats: int) -> float:
    """Wall time of an import in a fresh interpreter, less that of starting one, s."""

    def start(code: str) -> Callable[[], object]:
        return lambda: subprocess.run([sys.executable, "-c", code], check=True)

    return seconds(start(statement), repeats) - seconds(start("pass"), repeats)


def derivative(p: PlantParameters, state: np.ndarray, voltage: float) -> list[float]:
    """Return the rates of theta, alpha (rad) and of theirs (rad/s) without Coulomb friction."""
    _theta, alpha, theta_dot, alpha_dot = state
    spring = p.K_s * alpha + p.K_3 * alpha**3 + p.B_l * alpha_dot
    torque = p.torque_per_volt * p.resistance * p.current(voltage, theta_dot)
    theta_ddot = (torque - p.B_eq * theta_dot + spring) / p.J_eq
    return [theta_dot, alpha_dot, theta_ddot, -spring / p.J_l - theta_ddot]


def against_solve_ivp(duration: float, repeats: int) -> tuple[float, float, float, float]:
    """Wall times of the plant and of solve_ivp over the same time, and the errors of both against a tight reference.

    Viscous damping only: Coulomb friction has jumps, which solve_ivp could only take with events, more slowly still.
    The voltage is held between samples, so solve_ivp is called once a sample, as a simulation of a sampled loop must.
    """
    with hil.open("virtual:?seed=1") as bench:
        # Only the virtual board has a plant to look into; the protocol of boards does not.
        drawn: PlantParameters = bench.board.plant.parameters  # type: ignore[attr-defined]
    parameters = replace(drawn, servo_friction=(0.0, 0.0), link_friction=(0.0, 0.0))
    volts = chirp(time_axis(duration, SAMPLE_TIME), 1.0, 5.0, 1.0).tolist()

    def plant() -> np.ndarray:
        moving = Plant(parameters)
        return np.array([moving.advance(voltage, SAMPLE_TIME) for voltage in volts])

    def general(rtol: float, atol: float, samples: int) -> np.ndarray:
        state, states = np.zeros(4), []
        for voltage in volts[:samples]:
            solution = solve_ivp(
                lambda _, x, v=voltage: derivative(parameters, x, v),
                (0.0, SAMPLE_TIME),
                state,
                rtol=rtol,
                atol=atol,
            )
            state = solution.y[:, -1]
            states.append(state)
        return np.array(states)

    reference = general(1e-12, 1e-14, 1000)
    ours, theirs = plant(), general(1e-6, 1e-9, len(volts))
    own_error = np.abs(ours[:1000, :2] - reference[:, :2]).max()
    their_error = np.abs(theirs[:1000, :2] - reference[:, :2]).max()
    return seconds(plant, repeats), seconds(lambda: general(1e-6, 1e-9, len(volts)), 1), own_error, their_error


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--smoke", action="store_true", help="once, and on 2 s instead of 15")
    smoke = parser.parse_args().smoke
    repeats, swept, tracked = (1, 2.0, 2.0) if smoke else (REPEATS, 15.0, 10.0)
    for module in ("rotflex", "rotflex.course.lab", "numpy"):
        print(f"import {module:<24}{import_time(f'import {module}', repeats) * 1e3:7.0f} ms")
    gain = [18.24, -17.15, 1.59, 0.633]
    with hil.open("virtual:?seed=1") as bench:
        sweep = seconds(lambda: experiments.sweep(bench, duration=swept, progress=False), repeats)
        tracking = seconds(lambda: experiments.tracking(bench, gain, duration=tracked, progress=False), repeats)
    print(f"{swept:g} s sweep".ljust(31) + f"{swept / sweep:7.0f} times real time")
    print(f"{tracked:g} s tracking".ljust(31) + f"{tracked / tracking:7.0f} times real time")
    plant, general, own_error, their_error = against_solve_ivp(swept, repeats)
    print(f"plant alone, {swept:g} s".ljust(31) + f"{swept / plant:7.0f} times real time, error {own_error:.1e} rad")
    print(f"solve_ivp, {swept:g} s".ljust(31) + f"{swept / general:7.1f} times real time, error {their_error:.1e} rad")
    print(f"plant against solve_ivp        {general / plant:7.0f} times faster")
    print(f"whole sweep against solve_ivp  {general / sweep:7.1f} times faster, though it has friction, board and loop")


if __name__ == "__main__":
    main()
