"""Make the sample recordings of the workbook's Table 6, from the virtual bench of a fixed seed.

    python tools/make_data.py [FOLDER]

The laboratory's procedure is followed on that bench: sweep, stiffness from the sweep, model, gain, and from these the
validation and both kinds of feedback. Each file says in `rotflex_metadata` that it is from the virtual bench, and
from which seed.
"""

from __future__ import annotations

import sys
from pathlib import Path

from rotflex import experiments, hil
from rotflex.instructor import design, model, stiffness
from rotflex.recording import Recording

SEED = 2011
DATA = Path(__file__).resolve().parents[1] / "data"


def recordings() -> dict[str, Recording]:
    """The four experiments, by the names that their files have."""
    with hil.open(f"virtual:?seed={SEED}&arm_position=1") as bench:
        sweep = experiments.sweep(bench, progress=False)
        f_hz, amplitude = stiffness.amplitude_spectrum(sweep.degrees("alpha"), sweep.sample_time)
        omega_n = stiffness.natural_frequency(f_hz, amplitude).value
        K_s = bench.joint.J_l * omega_n**2
        plant = model.state_space(bench.servo, bench.joint, K_s)
        K = design.gain_by_place(plant.A, plant.B, design.desired_poles(0.6, 20.0, -30.0, -40.0))
        return {
            "sweep": sweep,
            "val": experiments.validation(bench, plant.A, plant.B, progress=False),
            "fsf": experiments.tracking(bench, K, "full", progress=False),
            "psf": experiments.tracking(bench, K, "partial", progress=False),
        }


def main(folder: Path) -> None:
    """Write the eleven files."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, recording in recordings().items():
        for variable in ("theta", "alpha", "vm"):
            if (name, variable) != ("val", "vm"):  # Table 6 has none
                recording.save(folder / f"data_rotflex_{name}_{variable}.mat", variables=[f"data_{variable}"])


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else DATA)
