"""The control loop: read, decide, write, once a sample."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rotflex import __version__
from rotflex.errors import BenchError
from rotflex.hil.bench import Bench
from rotflex.hil.controllers import Controller
from rotflex.progress import progress as with_progress
from rotflex.recording import Recording

_SOURCES = {"seed": "virtual bench", "preset": "virtual bench", "recording": "replay"}  # what its identity has


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
        If the reference is not a list of finite numbers, or for what the bench raises; the motor is at 0 V.
    """
    targets = np.asarray(reference, dtype=float)
    if targets.ndim != 1 or targets.size < 2 or not np.isfinite(targets).all():
        raise BenchError("The reference must be a one-dimensional array of at least two finite numbers.")
    theta, alpha, vm = np.empty((3, targets.size))
    controller.reset()
    bench.start(sample_time)
    try:
        for index, target in enumerate(with_progress(targets.tolist(), "experiment", "sample", progress)):
            _, theta[index], alpha[index] = measured = bench.read()
            vm[index] = bench.write(controller(target, measured.theta, measured.alpha))
    finally:
        bench.stop()
    described = {
        "source": next((source for key, source in _SOURCES.items() if key in bench.identity), "bench"),
        "bench": dict(bench.identity),
        "sample_time": sample_time,
        "software": f"rotflex {__version__}",
        **(metadata or {}),
    }
    return Recording.of(np.arange(targets.size) * sample_time, described, theta=theta, alpha=alpha, vm=vm)
