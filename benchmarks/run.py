"""How quick things are, as ratios measured in one run.

    python benchmarks/run.py

* import of `rotflex` and of what a notebook starts with, in fresh interpreters;
* a 15 s sweep and 10 s of tracking on the virtual bench, as multiples of real time;
* the plant alone against scipy's solve_ivp on the same equations and voltages, at like accuracy.
"""

from __future__ import annotations

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


def seconds(action: Callable[[], object], repeats: int = REPEATS) -> float:
    """Median wall time of an action, s."""
    taken = []
    for _ in range(repeats):
        started = time.perf_counter()
        action()
        taken.append(time.perf_counter() - started)
    return median(taken)


def import_time(statement: str) -> float:
    """Wall time of an import in a fresh interpreter, less that of starting one, s."""

    def start(code: str) -> Callable[[], object]:
        return lambda: subprocess.run([sys.executable, "-c", code], check=True)

    return seconds(start(statement)) - seconds(start("pass"))


def against_solve_ivp() -> tuple[float, float, float, float]:
    """Wall times of the plant and of solve_ivp over the same 15 s, and the errors of both against a tight reference.

    Viscous damping only: Coulomb friction has jumps, which solve_ivp could only take with events, more slowly still.
    The voltage is held between samples, so solve_ivp is called once a sample, as a simulation of a sampled loop must.
    """
    with hil.open("virtual:?seed=1") as bench:
        # Only the virtual board has a plant to look into; the protocol of boards does not.
        drawn: PlantParameters = bench.board.plant.parameters  # type: ignore[attr-defined]
    parameters = replace(drawn, servo_friction=(0.0, 0.0), link_friction=(0.0, 0.0))
    volts = chirp(time_axis(15.0, SAMPLE_TIME), 1.0, 5.0, 1.0).tolist()

    def plant() -> np.ndarray:
        moving = Plant(parameters)
        return np.array([moving.advance(voltage, SAMPLE_TIME) for voltage in volts])

    def general(rtol: float, atol: float, samples: int) -> np.ndarray:
        state, states = np.zeros(4), []
        for voltage in volts[:samples]:
            solution = solve_ivp(
                lambda _, x, v=voltage: parameters.derivative(x, v, (0.0, 0.0)),
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
    return seconds(plant), seconds(lambda: general(1e-6, 1e-9, len(volts)), 1), own_error, their_error


def main() -> None:
    """Measure and print."""
    print(f"import rotflex                 {import_time('import rotflex') * 1e3:7.0f} ms")
    print(f"import rotflex.lab             {import_time('import rotflex.lab') * 1e3:7.0f} ms")
    print(f"import numpy (for comparison)  {import_time('import numpy') * 1e3:7.0f} ms")
    gain = [18.24, -17.15, 1.59, 0.633]
    with hil.open("virtual:?seed=1") as bench:
        sweep = seconds(lambda: experiments.sweep(bench, progress=False))
        tracking = seconds(lambda: experiments.tracking(bench, gain, progress=False))
    print(f"15 s sweep                     {15 / sweep:7.0f} times real time")
    print(f"10 s tracking                  {10 / tracking:7.0f} times real time")
    plant, general, own_error, their_error = against_solve_ivp()
    print(f"plant alone, 15 s              {15 / plant:7.0f} times real time, error {own_error:.1e} rad")
    print(f"solve_ivp, 15 s                {15 / general:7.1f} times real time, error {their_error:.1e} rad")
    print(f"plant against solve_ivp        {general / plant:7.0f} times faster")
    print(f"whole sweep against solve_ivp  {general / sweep:7.1f} times faster, though it has friction, board and loop")


if __name__ == "__main__":
    main()
