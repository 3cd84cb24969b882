"""How steady the control loop is in real time, and what it costs itself.

    python benchmarks/loop_timing.py              the cost of a sample, and 60 s at 500 Hz and at 1 kHz
    python benchmarks/loop_timing.py --busy       the same with another process that computes without end
    python benchmarks/loop_timing.py --seconds 5

Times are told as shares of the sample time. The board is the virtual one on the computer's clock, which costs more than
a real board's driver: its plant moves in the same process. The cost of a sample is the processor's time that the loop,
bench, guard and controller take together, on a board that does nothing.
"""

from __future__ import annotations

import argparse
import multiprocessing
import tempfile
import time
from pathlib import Path
from typing import Any, cast

import numpy as np

from rotflex import hil
from rotflex.config import joint, srv02
from rotflex.hil.bench import Bench, Connection, Recorder, Safety
from rotflex.hil.board import Board
from rotflex.hil.controllers import StateFeedback
from rotflex.hil.guard import Guard
from rotflex.hil.loop import run
from rotflex.signals import smooth_square_wave, time_axis
from rotflex.units import DEG

GAIN = [18.24, -17.15, 1.59, 0.63]
REPEATS = 5
SAMPLES = 20_000


class NullBoard:
    """Takes everything, at once, and stands still."""

    def __getattr__(self, verb: str) -> Any:
        return lambda *arguments: 0

    def is_valid(self) -> bool:
        return True

    def watchdog_reload(self) -> bool:
        return True

    def task_read_encoder(self, task: int, samples: int, buffer: Any) -> int:
        return samples


def cost(samples: int = SAMPLES) -> float:
    """Processor time of a sample, s: the least of a few runs."""
    taken = []
    for _repeat in range(REPEATS):
        with tempfile.TemporaryDirectory() as folder:
            connection, safety = Connection(lambda: cast(Board, NullBoard()), srv02()), Safety(guard=Guard(srv02()))
            identity = {"uri": "null", "clock": "wall"}
            bench = Bench(connection, srv02(), joint(1), identity, safety, Recorder(Path(folder)))
            with bench:
                started = time.process_time()
                run(bench, StateFeedback(GAIN), np.zeros(samples), progress=False)
                taken.append((time.process_time() - started) / samples)
    return min(taken)


def steadiness(rate: float, seconds: float) -> dict[str, Any]:
    """The report of a run in closed loop, in real time."""
    period = 1 / rate
    reference = smooth_square_wave(time_axis(seconds, period), 0.25, 20 * DEG, 100.0)
    with hil.open("virtual:?preset=real_bench&clock=wall") as bench:
        recording = run(bench, StateFeedback(GAIN, sample_time=period), reference, period, progress=False)
    told: dict[str, Any] = recording.metadata["timing"]
    return told


def compute() -> None:
    """Keep a processor busy."""
    while True:
        sum(range(10_000))


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--busy", action="store_true")
    parser.add_argument("--cost-only", action="store_true")
    parser.add_argument("--smoke", action="store_true", help="few samples, and 1 s")
    chosen = parser.parse_args()
    if chosen.smoke:
        chosen.seconds = 1.0
    ours = cost(500 if chosen.smoke else SAMPLES)
    print(f"cost of a sample    {ours * 1e6:6.1f} us, {ours * 500:6.2%} of 2 ms")
    if chosen.cost_only:
        return
    other = multiprocessing.Process(target=compute, daemon=True)
    if chosen.busy:
        other.start()
    for rate in (500.0, 1000.0):
        told = steadiness(rate, chosen.seconds)
        shares = {name: value * rate for name, value in told["period"].items()}
        listed = ", ".join(f"{name} {share:.3f}" for name, share in shares.items())
        print(f"{rate:5.0f} Hz, {chosen.seconds:g} s   period/sample time: {listed}; late {told['late']}")
    if chosen.busy:
        other.terminate()


if __name__ == "__main__":
    main()
