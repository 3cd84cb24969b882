"""Where drawn benches come to rest, beside the logs of a real bench: docs/guide/benches.md has the table.

    python benchmarks/rests.py [LOG.mat ...] [--benches 60]

Each drawn bench follows 30 deg at 0.25 Hz for 10 s on two runs, under the gains of three logs of one real bench. For
each turn, and each log that is given, the last 0.25 s before the next turn are looked at:

==========  ============================================================================
rest        how far the servo stands off its command, deg, on average of a side
larger      the same, of the side with the larger one
voltage     the motor's, V, on average of a side
spread      of the rests of one side, deg
until rest  from the turn until the servo stays within 0.1 deg of where it rests, s
noise       changes of alpha's count in the last 0.6 s
==========  ============================================================================
"""

from __future__ import annotations

import argparse
import sys
from collections import defaultdict
from itertools import pairwise
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT)]

from rotflex import hil  # noqa: E402
from rotflex.hil.controllers import StateFeedback  # noqa: E402
from rotflex.hil.loop import run  # noqa: E402
from rotflex.recording import Recording  # noqa: E402
from rotflex.signals import smooth_square_wave, time_axis  # noqa: E402
from rotflex.specifications import RATE, SAMPLE_TIME  # noqa: E402
from rotflex.units import DEG  # noqa: E402

GAINS = {
    "LQR": [13.0384, -17.2586, 1.3198, -0.0461],
    "PD": [4.74, 4.74, 0.2133, 0.2133],
    "weak PD": [4.74, 0.0, 0.2133, 0.0],
}
REFERENCE = smooth_square_wave(time_axis(10.0, SAMPLE_TIME), 0.25, 30 * DEG, RATE)
SHORTEST = 1.2  # s, between turns


def rests(recording: Recording) -> dict[str, list[float]]:
    """Return the figures of the module's table, a value for each side, or for each turn."""
    time, command = recording.time, recording.degrees("theta_ref")
    theta, volts, alpha = recording.degrees("theta"), recording["vm"], recording["alpha"]
    turns = [0, *np.flatnonzero(np.diff(np.sign(command))), time.size - 1]
    sides, found = defaultdict[float, list[tuple[float, float]]](list), defaultdict[str, list[float]](list)
    for begin, end in pairwise(turns):
        if time[end] - time[begin] < SHORTEST:
            continue
        last = slice(end - round(0.25 / SAMPLE_TIME), end - round(0.02 / SAMPLE_TIME))
        off = float(np.mean(theta[last] - command[last]))
        sides[np.sign(command[last][0])].append((off, float(np.mean(volts[last]))))
        moving = np.flatnonzero(np.abs(theta[begin : last.stop] - theta[last.stop - 1]) > 0.1)
        found["until rest"].append(float(time[begin + moving[-1]] - time[begin]))
        found["noise"].append(np.count_nonzero(np.diff(alpha[end - round(0.6 / SAMPLE_TIME) : last.stop])))
    for pairs in sides.values():
        off, applied = np.array(pairs).T
        found["rest"].append(abs(off.mean()))
        found["voltage"].append(abs(applied.mean()))
        found["spread"].append(float(np.ptp(off)))
    found["larger"] = [max(found["rest"])]
    return dict(found)


def main() -> None:
    """Print the figures of the logs, and percentiles of those of drawn benches."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("logs", nargs="*", metavar="LOG.mat")
    parser.add_argument("--benches", type=int, default=60)
    parser.add_argument("--smoke", action="store_true", help="one bench")
    options = parser.parse_args()
    for log in options.logs:
        print(log, {name: np.round(values, 2).tolist() for name, values in rests(Recording.load(log)).items()})
    for name, gain in GAINS.items():
        every = defaultdict[str, list[float]](list)
        for seed in range(1 if options.smoke else options.benches):
            for number in (1, 2):
                with hil.open("virtual", seed=seed, run=number) as bench:
                    recording = run(bench, StateFeedback(gain), REFERENCE, SAMPLE_TIME, progress=False)
                for what, values in rests(recording).items():
                    every[what] += values
        print(f"{name}: 5, 50 and 95 %")
        for what, values in every.items():
            print(f"    {what:12}", *(f"{value:8.2f}" for value in np.percentile(values, [5, 50, 95])))


if __name__ == "__main__":
    main()
