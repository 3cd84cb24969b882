"""The control loop: read, decide, write, once a sample."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotflex import __version__
from rotflex.errors import BenchError
from rotflex.hil.bench import Bench
from rotflex.hil.controllers import Controller, OpenLoop
from rotflex.progress import progress as with_progress
from rotflex.recording import Recording

#: By what a bench's identity has.
_SOURCES = {"seed": "virtual bench", "preset": "virtual bench", "plant": "virtual bench", "recording": "replay"}


def run(
    bench: Bench,
    controller: Controller,
    reference: ArrayLike,
    sample_time: float = 0.002,
    metadata: Mapping[str, Any] | None = None,
    progress: bool = True,
) -> Recording:
    """Run a controller on a bench along a reference, one entry a sample, and leave the motor at 0 V.

    Parameters
    ----------
    bench : an open bench
    controller : see :mod:`rotflex.hil.controllers`
    reference : (n,) array, rad (V for an open loop)
    sample_time : s
    metadata : what the recording should say of the experiment
    progress : show a progress bar when the run takes longer than a second

    Returns
    -------
    Recording
        theta, alpha (rad) and the voltage that was set, vm (V), each (n,).

    Raises
    ------
    BenchError
        If the reference is not a list of finite numbers, if the bench is a replay of another run, or for what the
        bench raises; the motor is at 0 V.
    """
    targets = np.asarray(reference, dtype=float)
    if targets.ndim != 1 or targets.size < 2 or not np.isfinite(targets).all():
        raise BenchError("The reference must be a one-dimensional array of at least two finite numbers.")
    asked = str((metadata or {}).get("experiment", type(controller).__name__))
    if bench.recorded is not None:
        bench.recorded.require_whole(targets.size, sample_time, asked)
    theta, alpha, vm = _sampled(bench, controller, targets, sample_time, progress)
    if bench.recorded is not None:
        vm = bench.recorded.require_same(vm, asked)
    time, described = np.arange(targets.size) * sample_time, _described(bench, sample_time, metadata)
    return Recording.of(time, described, theta=theta, alpha=alpha, vm=vm)


def listen(
    bench: Bench,
    samples: int,
    sample_time: float = 0.002,
    metadata: Mapping[str, Any] | None = None,
    progress: bool = True,
) -> Recording:
    """The angles at 0 V; of a replay at most what it holds, with the voltage that was recorded.

    Parameters
    ----------
    bench : an open bench
    samples : how many
    sample_time, metadata, progress : as for :func:`run`

    Returns
    -------
    Recording
        theta, alpha (rad), and vm (V) unless a replayed recording has none.
    """
    volts: NDArray[np.float64] | None = np.zeros(samples)
    if bench.recorded is not None:
        samples = min(samples, bench.recorded.samples(sample_time))
        volts = bench.recorded.voltage(samples, sample_time)
    heard = _sampled(bench, OpenLoop(), np.zeros(samples) if volts is None else volts, sample_time, progress)
    channels = {"theta": heard[0], "alpha": heard[1]} | ({} if volts is None else {"vm": volts})
    return Recording.of(np.arange(samples) * sample_time, _described(bench, sample_time, metadata), **channels)


def _sampled(
    bench: Bench, controller: Controller, targets: NDArray[np.float64], sample_time: float, progress: bool
) -> NDArray[np.float64]:
    """theta, alpha and vm (3, n) of a run; a replay begins at its beginning."""
    theta, alpha, vm = signals = np.empty((3, targets.size))
    controller.reset()
    if bench.recorded is not None:
        bench.recorded.rewind()
    bench.start(sample_time)
    try:
        for index, target in enumerate(with_progress(targets.tolist(), "experiment", "sample", progress)):
            _, theta[index], alpha[index] = measured = bench.read()
            vm[index] = bench.write(controller(target, measured.theta, measured.alpha))
    finally:
        bench.stop()
    return signals


def _described(bench: Bench, sample_time: float, metadata: Mapping[str, Any] | None) -> dict[str, Any]:
    """Where a recording comes from."""
    return {
        "source": next((source for key, source in _SOURCES.items() if key in bench.identity), "bench"),
        "bench": dict(bench.identity),
        "sample_time": sample_time,
        "software": f"rotflex {__version__}",
        **(metadata or {}),
    }
