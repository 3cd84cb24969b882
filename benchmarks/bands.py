"""How much of a recording lies in the band of a fitted plant, on virtual benches as if they were real.

    python benchmarks/bands.py [--benches 200] [--logs 1] [--adapted]

Each bench is drawn: what a fit does not model is there (Stribeck's curve, load, rough gear, jitter), and each run has
other friction. The plant is fitted to one recording of run 1, under the gain that is placed for the bench. With
``--logs`` it is fitted to as many recordings of other runs, commands and controllers. Each band is judged on a run of
its own:

==========  ============================================================
same        the command that was fitted, the same controller
command     35 deg at 0.5 Hz, the same controller
controller  the command that was fitted, by partial feedback
open        a square wave of 1.5 V without feedback
==========  ============================================================

With ``--adapted`` each band but that of the open loop is also adapted to the first 2.4 s, and judged on the rest.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT)]

from rotflex import experiments, greybox, hil  # noqa: E402
from rotflex.config import srv02  # noqa: E402
from rotflex.controller import Controller  # noqa: E402
from rotflex.hil.controllers import OpenLoop, StateFeedback  # noqa: E402
from rotflex.hil.loop import run  # noqa: E402
from rotflex.hil.student_benches import student_bench  # noqa: E402
from rotflex.recording import Recording  # noqa: E402
from rotflex.signals import smooth_square_wave, square_wave, time_axis  # noqa: E402
from rotflex.specifications import AMPLITUDE, FREQUENCY, RATE, SAMPLE_TIME  # noqa: E402
from rotflex.units import DEG  # noqa: E402
from solutions.design_checks import Design  # noqa: E402

DURATION = 6.0  # s
FIRST = 1000  # seeds from here on are nobody's
ASKED = 0.95


class Loop(NamedTuple):
    """A command, a controller, and the run on which it is tried."""

    reference: NDArray[np.float64]
    controller: Controller
    run: int


def loops(seed: int) -> dict[str, Loop]:
    """What is tried on a bench; "first" is of run 1."""
    bench, t = student_bench(seed), time_axis(DURATION, SAMPLE_TIME)
    K = Design(srv02(), bench.joint, bench.parameters.K_s).K.ravel()
    usual = smooth_square_wave(t, FREQUENCY, AMPLITUDE, RATE)
    large = smooth_square_wave(t, 0.5, 35 * DEG, RATE)
    return {
        "first": Loop(usual, StateFeedback(K), 1),
        "same": Loop(usual, StateFeedback(K), 2),
        "command": Loop(large, StateFeedback(K), 3),
        "controller": Loop(usual, StateFeedback(K, "partial"), 8),
        "open": Loop(square_wave(t, 0.5, 1.5), OpenLoop(), 4),
        "large": Loop(large, StateFeedback(K), 5),
        "slow": Loop(smooth_square_wave(t, 0.25, 30 * DEG, RATE), StateFeedback(0.7 * K), 6),
        "partial": Loop(usual, StateFeedback(K, "partial"), 7),
    }


FITTED = {1: ("first",), 2: ("large", "partial"), 3: ("large", "partial", "slow")}
JUDGED = ("same", "command", "controller", "open")
UNTIL = 2.4  # s: 40 % of a recording


def recorded(seed: int, loop: Loop) -> Recording:
    """A recording of a loop on the bench of a seed."""
    with hil.open("virtual", seed=seed, run=loop.run) as bench:
        experiments.rest(bench)
        return run(bench, loop.controller, loop.reference, SAMPLE_TIME, progress=False)


def tried(seed: int, logs: int, adapt: bool) -> dict[str, list[float]]:
    """Shares inside of theta and alpha, and half widths (deg RMS), by what is judged."""
    every = loops(seed)
    recordings = [recorded(seed, every[name]) for name in FITTED[logs]]
    found = greybox.fit(recordings, srv02(), student_bench(seed).joint, progress=False)
    results = {}
    for name in JUDGED:
        band = found.band(every[name].reference, every[name].controller, progress=False)
        recording = recorded(seed, every[name])
        results[name] = [*band(recording), *(width / DEG for width in band.half_width.values())]
        if adapt and not band.is_open:
            adapted = band.adapted(recording, UNTIL, progress=False)
            results[f"{name}, adapted"] = [*adapted(recording), *(one / DEG for one in adapted.half_width.values())]
    return results


def main() -> None:
    """Print the shares of each bench, and what they come to."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--benches", type=int, default=200)
    parser.add_argument("--logs", type=int, choices=FITTED, default=1, help="recordings that are fitted")
    parser.add_argument("--adapted", action="store_true", help="also adapt each band to its run")
    parser.add_argument("--smoke", action="store_true", help="one bench")
    options = parser.parse_args()
    everything: dict[str, list[list[float]]] = {}
    benches = 1 if options.smoke else options.benches
    for number in range(1, benches + 1):
        seed = FIRST + number - 1
        row = tried(seed, options.logs, options.adapted)
        for name, values in row.items():
            everything.setdefault(name, []).append(values)
        figures = (f"{name} {100 * v[0]:.1f} {100 * v[1]:.1f} (±{v[2]:.2f} {v[3]:.2f})" for name, v in row.items())
        print(f"bench {seed}, inside (%) and half width (deg), theta and alpha: {'  '.join(figures)}", flush=True)
        if number % 10 == 0 or number == benches:
            summarise(everything)


def summarise(everything: dict[str, list[list[float]]]) -> None:
    """Print what the benches come to until now."""
    print(f"benches: {len(everything['same'])}")
    print(f"{'':20}{'angle':>6}{'median':>9}{'worst':>8}{'benches >= 95 %':>17}{'half width, deg RMS':>21}")
    for name, rows in everything.items():
        for angle, share, width in (("theta", 0, 2), ("alpha", 1, 3)):
            inside, widths = np.array(rows)[:, share], np.array(rows)[:, width]
            enough, root = np.mean(inside >= ASKED), np.sqrt(np.mean(widths**2))
            figures = f"{np.median(inside):9.1%}{inside.min():8.1%}{enough:17.1%}{root:21.2f}"
            print(f"{name:20}{angle:>6}{figures}", flush=True)


if __name__ == "__main__":
    main()
