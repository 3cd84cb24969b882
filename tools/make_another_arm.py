"""Make rotflex/widgets/another_arm.json: numbers of another arm, for the openings of notebooks 01 and 03 to 07.

    python tools/make_another_arm.py

They are stored because students work out the formulas: the energies are asked in 2.1 and 2.2, the model in 2.14.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np

from rotflex.config import srv02
from rotflex.course.practice import Practice
from rotflex.hil.student_benches import student_bench
from rotflex.model import state_space
from rotflex.plant import PlantParameters, State, driven
from rotflex.units import DEG

TARGET = Path(__file__).resolve().parents[1] / "rotflex" / "widgets" / "another_arm.json"
BENCH = 6  # number of the practice bench
SEED = 2**32 + BENCH
PULLED, DURATION, STEP, FINE = 20 * DEG, 2.0, 0.01, 0.002  # rad, s, s, s
HEAVY = 1e6  # a servo that is so many times as heavy is held


def released(plant: PlantParameters) -> dict[str, list[float]]:
    """Angles (deg) and energies (mJ) every 10 ms after the arm was pulled aside and let go, the motor disconnected."""
    rest = State(0.0, PULLED, 0.0, 0.0)
    states = driven(plant, rest, np.zeros(round(DURATION / FINE) + 1).tolist(), FINE)[:: round(STEP / FINE)]
    theta, alpha, servo, link = states.T
    energies = {
        "spring": plant.K_s * alpha**2 / 2,
        "servo": plant.J_eq * servo**2 / 2,
        "link": plant.J_l * (servo + link) ** 2 / 2,
    }
    angles = {
        "theta_deg": (np.round(theta / DEG, 1) + 0.0).tolist(),
        "alpha_deg": (np.round(alpha / DEG, 1) + 0.0).tolist(),
    }
    return angles | {name: np.round(1000 * energy).astype(int).tolist() for name, energy in energies.items()}


def main() -> None:
    """Compute and write."""
    practice, plant = Practice(BENCH), replace(student_bench(SEED).parameters, I_max=0.0)
    system = state_space(srv02(), practice.joint, plant.K_s, input="voltage")
    held = replace(plant, J_eq=HEAVY * plant.J_eq)
    content = {
        "step": STEP,
        "free": released(plant),
        "held": released(held),
        "A": [[float(f"{value:.4g}") for value in row] for row in np.asarray(system.A).tolist()],
        "B": [float(f"{value:.4g}") for value in np.asarray(system.B).ravel().tolist()],
    }
    lines = json.dumps(content).replace('], "', '],\n"').replace('}, "', '},\n"')
    TARGET.write_text(lines + "\n", encoding="utf-8", newline="\n")
    print(f"{TARGET.name}: {TARGET.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
