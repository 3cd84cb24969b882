"""Delay margin of every experiment's loop, on the workbook's bench and on drawn ones; and how the link rings on.

    python benchmarks/delay.py [--benches 200] [--log real_bench_lqr.mat]

Linear and sampled, with the derivatives' filters (``tests/helpers/delay_margin.py``). State feedback is by each bench's
own gain: the printed poles, placed for the data sheet's servo, the bench's arm and its true stiffness.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "helpers")]

from delay_margin import delay_margin  # noqa: E402

from rotflex import experiments, hil  # noqa: E402
from rotflex.config import srv02  # noqa: E402
from rotflex.hil.controllers import DERIVATIVE_CUTOFF, StateFeedback  # noqa: E402
from rotflex.hil.loop import run  # noqa: E402
from rotflex.hil.student_benches import VirtualPlantSpec, preset, student_bench  # noqa: E402
from rotflex.recording import Recording  # noqa: E402
from solutions.design_checks import Design  # noqa: E402

PLATEAU_END = 0.6  # s


def loops(bench: VirtualPlantSpec) -> dict[str, tuple[list[float], float]]:
    """Gain and cut-off of each experiment's loop."""
    held = {"sweep": experiments.FOLLOWING.keywords, "free decay": experiments.HOLDING.keywords}
    K = Design(srv02(), bench.joint, bench.parameters.K_s).K.ravel().tolist()
    return {
        **{n: ([g["K_p"], 0, g["K_d"], 0], g.get("cutoff", DERIVATIVE_CUTOFF)) for n, g in held.items()},
        "full-state feedback": (K, DERIVATIVE_CUTOFF),
        "partial-state feedback": ([K[0], 0, K[2], 0], DERIVATIVE_CUTOFF),
    }


def changes(log: Recording) -> list[int]:
    """How often alpha changes at the end of each plateau of the log's square wave."""
    ends = [log.between(turn - PLATEAU_END, turn)["alpha"] for turn in (2, 4, 6, 8, 10)]
    return [int(np.count_nonzero(np.diff(alpha))) for alpha in ends]


def main() -> None:
    """Print the margins, and the comparison with a log."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--benches", type=int, default=200)
    parser.add_argument("--log", type=Path)
    parser.add_argument("--smoke", action="store_true", help="two benches")
    options = parser.parse_args()
    if options.smoke:
        options.benches = 2

    nominal = preset("workbook")
    drawn = [student_bench(seed) for seed in range(options.benches)]
    print("delay margin, ms              workbook   drawn: least   median")
    for name in loops(nominal):
        margins = [1e3 * delay_margin(bench.parameters, *loops(bench)[name]) for bench in (nominal, *drawn)]
        print(f"{name:28} {margins[0]:9.1f} {min(margins[1:]):14.1f} {np.median(margins[1:]):8.1f}")
    if options.log:
        real = Recording.load(options.log)
        with hil.open("virtual:?preset=real_bench") as bench:
            ours = run(bench, StateFeedback([13.0384, -17.2586, 1.3198, -0.0461]), real["theta_ref"], progress=False)
        for name in ("theta", "alpha"):
            rms = np.sqrt(np.mean((ours.degrees(name) - real.degrees(name)) ** 2))
            print(f"{name}: {rms:.3f} deg RMS off the log")
        print(f"changes of alpha in the last {PLATEAU_END} s: log {changes(real)}, preset {changes(ours)}")


if __name__ == "__main__":
    main()
