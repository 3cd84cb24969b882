"""Make the sample recordings of the workbook's Table 6, from the virtual bench of a fixed seed.

    python tools/make_data.py [FOLDER]

The laboratory's procedure is followed on that bench: sweep, stiffness from the sweep, model, gain, and from these the
validation and both kinds of feedback. Each file says in `rotflex_metadata` that it is from the virtual bench, and
from which seed.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from rotflex import design, experiments, hil, model
from rotflex.identification import SWEEP_BAND
from rotflex.recording import Recording
from rotflex.units import HZ

SEED = 38
DATA = Path(__file__).resolve().parents[1] / "data"


def recordings() -> dict[str, Recording]:
    """The four experiments, by the names that their files have."""
    with hil.open(f"virtual:?seed={SEED}&arm_position=1") as bench:
        sweep = experiments.sweep(bench, progress=False)
        K_s = bench.joint.J_l * peak(sweep) ** 2
        plant = model.state_space(bench.servo, bench.joint, K_s)
        K = design.gain_by_place(plant.A, plant.B, design.desired_poles(0.6, 20.0, -30.0, -40.0))
        return {
            "sweep": sweep,
            "val": experiments.validation(bench, plant.A, plant.B, progress=False),
            "fsf": experiments.tracking(bench, K, "full", progress=False),
            "psf": experiments.tracking(bench, K, "partial", progress=False),
        }


def peak(sweep: Recording) -> float:
    """Find where the spectrum of alpha is largest, rad/s, as the workbook's answer 2.11 does."""
    alpha = sweep["alpha"]
    padded = 2 ** int(np.ceil(np.log2(alpha.size)))
    f_hz = np.fft.rfftfreq(padded, sweep.sample_time)
    inside = (f_hz >= SWEEP_BAND[0]) & (f_hz <= SWEEP_BAND[1])
    return float(f_hz[inside][np.argmax(np.abs(np.fft.rfft(alpha, padded))[inside])]) * HZ


def main(folder: Path) -> None:
    """Write the eleven files."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, recording in recordings().items():
        for variable in ("theta", "alpha", "vm"):
            if (name, variable) != ("val", "vm"):  # Table 6 has none
                recording.save(folder / f"data_rotflex_{name}_{variable}.mat", variables=[f"data_{variable}"])


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else DATA)
