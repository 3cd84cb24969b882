"""How many virtual benches miss a specification: simulated, with full and with partial state feedback.

    python benchmarks/verdicts.py [--benches 200]

Seeds 0 to 199. Each bench is worked through as the notebooks do it: the natural frequency is the peak of the sweep's
spectrum, the gain is placed for it, and the worst of the full-size turns counts. Notebooks 08 to 10 and
docs/guide/benches.md have these shares.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "helpers")]

from working_through import spectrum  # noqa: E402

from rotflex import experiments, hil, response  # noqa: E402
from rotflex.config import srv02  # noqa: E402
from rotflex.hil.student_benches import student_bench  # noqa: E402
from rotflex.identification import SWEEP_BAND  # noqa: E402
from rotflex.recording import Recording  # noqa: E402
from rotflex.signals import smooth_square_wave, time_axis  # noqa: E402
from rotflex.simulation import closed_loop  # noqa: E402
from rotflex.specifications import AMPLITUDE, DURATION, FREQUENCY, LIMITS, RATE, SAMPLE_TIME  # noqa: E402
from rotflex.units import HZ  # noqa: E402
from solutions.design_checks import Design  # noqa: E402

COMMAND = smooth_square_wave(time_axis(DURATION, SAMPLE_TIME), FREQUENCY, AMPLITUDE, RATE)


def responses(seed: int) -> Iterator[tuple[str, Recording]]:
    """Yield the three responses of a bench, with their names."""
    with hil.open("virtual", seed=seed) as bench:
        sweep = experiments.sweep(bench, progress=False)
    f, amplitude = spectrum(sweep["alpha"], sweep.sample_time)
    omega_n = f[np.argmax(np.where((f >= SWEEP_BAND[0]) & (f <= SWEEP_BAND[1]), amplitude, 0))] * HZ
    joint = student_bench(seed).joint
    design = Design(srv02(), joint, joint.J_l * omega_n**2)
    yield "simulated", closed_loop(*design.voltage_model, design.K, COMMAND, saturation=None)
    for feedback in ("full", "partial"):
        with hil.open("virtual", seed=seed) as bench:
            yield feedback, experiments.tracking(bench, design.K.ravel().tolist(), feedback, progress=False)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--benches", type=int, default=200)
    parser.add_argument("--smoke", action="store_true", help="two benches")
    options = parser.parse_args()
    benches = 2 if options.smoke else options.benches
    missed: dict[str, list[list[bool]]] = {}
    for seed in range(benches):
        for name, recording in responses(seed):
            worst = response.worst(response.measure(recording))
            row = [not finding.met for finding in response.verdict(worst)]
            missed.setdefault(name, []).append([*row, any(row), worst.max_vm >= LIMITS["max_vm"]])
    print(f"of {benches}    settling  overshoot  deflection  voltage    any   10 V reached")
    for name, rows in missed.items():
        print(f"{name:9} {{:10}}{{:11}}{{:12}}{{:9}}{{:7}}{{:15}}".format(*np.sum(rows, axis=0)))


if __name__ == "__main__":
    main()
