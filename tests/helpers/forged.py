"""Forged recordings: what somebody might do to one, and whether its voltages or its arm show it."""

from collections.abc import Callable
from typing import Any

import numpy as np

from rotflex import experiments, hil
from rotflex.config import srv02
from rotflex.hil.controllers import StateFeedback
from rotflex.hil.replay import REPORTED, VOLTAGE_LIMIT, voltages
from rotflex.hil.student_benches import VirtualPlantSpec, student_bench
from rotflex.recording import Recording
from rotflex.units import DEG

COUNT = srv02().K_enc
GAIN = [18.2356, -17.1547, 1.5893, 0.6327]
OTHER_GAIN = [13.0384, -17.2586, 1.3198, -0.0461]
OURS, ANOTHER = student_bench(2**40), student_bench(2**40 + 3)
Made = dict[str, Recording]


def recorded(spec: VirtualPlantSpec) -> Made:
    """What a bench gives, by the experiment's name, as it is handed to whoever keeps recordings."""
    kept: list[Recording] = []
    with hil.open("virtual", plant=spec) as bench:
        bench.recorder.on_recorded = kept.append
        experiments.sweep(bench, progress=False)
        experiments.free_decay(bench, progress=False)
        experiments.tracking(bench, GAIN, progress=False)
        experiments.tracking(bench, GAIN, "partial", progress=False)
        experiments.tracking(bench, GAIN, amplitude=2 * DEG, duration=3.1, progress=False)
        model = np.diag([1.0, 1.0], 2) - np.diag([0.0, 0.0, 20.0, 20.0])
        experiments.validation(bench, model, [0.0, 0.0, 60.0, -60.0], progress=False)
        experiments.validation(bench, model, [0.0, 0.0, 60.0, -60.0], "step", progress=False)
        experiments.sweep(bench, drive="voltage", progress=False)
        experiments.watch(bench, 1.0, progress=False)
    names = ("sweep", "decay", "tracking", "partial", "trial", "square", "step", "driven", "watch")
    return dict(zip(names, kept, strict=True))


def changed(recording: Recording, **channels: Any) -> Recording:
    """A recording with other samples in some channels."""
    values = {name: channel.values for name, channel in recording.channels.items()}
    return Recording.of(recording.time, recording.metadata, **{**values, **channels})


def on_counts(values: Any) -> Any:
    return np.round(np.asarray(values) / COUNT) * COUNT


def consistent(recording: Recording, limit: float = 10.0) -> Recording:
    """With the voltage that the controller sets on the forged angles: by somebody who knows what is looked at."""
    controller = StateFeedback(recording.metadata["K"], recording.metadata["feedback"])
    return changed(recording, vm=voltages(recording, controller, recording["theta_ref"], limit))


def scaled(recording: Recording, factor: float) -> Recording:
    return changed(recording, theta=factor * recording["theta"], alpha=factor * recording["alpha"])


def noisy(recording: Recording, counts: float) -> Recording:
    draw = np.random.default_rng(1)
    noise = [on_counts(draw.normal(0, counts * COUNT, len(recording))) for _ in range(2)]
    return changed(recording, theta=recording["theta"] + noise[0], alpha=recording["alpha"] + noise[1])


def shifted(recording: Recording, samples: int, *names: str) -> Recording:
    return changed(recording, **{name: np.roll(recording[name], samples) for name in names})


def of_another_gain(recording: Recording) -> Recording:
    return Recording(recording.time, recording.channels, {**recording.metadata, "K": OTHER_GAIN})


def limited(recording: Recording, volts: float) -> Recording:
    """Of a bench that is said to have cut its voltages to that."""
    told = {REPORTED: {VOLTAGE_LIMIT: volts}}
    return Recording(recording.time, recording.channels, {**recording.metadata, **told})


#: What was done → the forged recording, of ours and of another bench's; and whether it is found.
FORGED: dict[str, tuple[Callable[[Made, Made], Recording], bool]] = {
    "alpha shifted by 1 sample": (lambda ours, other: shifted(ours["tracking"], 1, "alpha"), True),
    "vm shifted by 1 sample": (lambda ours, other: shifted(ours["tracking"], 1, "vm"), True),
    "all but the command shifted": (lambda ours, other: shifted(ours["tracking"], 5, "theta", "alpha", "vm"), True),
    "open loop: vm 20 ms earlier": (lambda ours, other: shifted(ours["square"], -10, "vm"), False),
    "scaled by 1.1, on counts": (
        lambda ours, other: changed(
            ours["tracking"],
            theta=on_counts(1.1 * ours["tracking"]["theta"]),
            alpha=on_counts(1.1 * ours["tracking"]["alpha"]),
        ),
        True,
    ),
    "alpha halved, on counts, open loop": (
        lambda ours, other: changed(ours["square"], alpha=on_counts(ours["square"]["alpha"] / 2)),
        True,
    ),
    "noise of a tenth of a count": (
        lambda ours, other: changed(
            ours["sweep"],
            alpha=ours["sweep"]["alpha"] + np.random.default_rng(1).normal(0, 0.1 * COUNT, len(ours["sweep"])),
        ),
        False,
    ),
    "noise of a count, on counts": (lambda ours, other: noisy(ours["tracking"], 1.0), True),
    "noise of a count, on counts, vm made to fit": (
        lambda ours, other: consistent(noisy(ours["tracking"], 1.0)),
        False,
    ),
    "from another K": (lambda ours, other: of_another_gain(ours["tracking"]), True),
    "from another K, vm made to fit": (lambda ours, other: consistent(of_another_gain(ours["tracking"])), False),
    "another bench's sweep": (lambda ours, other: other["sweep"], True),
    "partial called full": (
        lambda ours, other: Recording(
            ours["partial"].time, ours["partial"].channels, {**ours["partial"].metadata, "feedback": "full"}
        ),
        True,
    ),
    "cut to less than its voltages": (lambda ours, other: limited(ours["tracking"], 5.0), True),
    "cut to more than the servo can have, vm made to fit": (
        lambda ours, other: limited(consistent(scaled(ours["tracking"], 2.0), 40.0), 40.0),
        True,
    ),
    "a stretch repeated": (
        lambda ours, other: changed(
            ours["tracking"],
            **{name: np.resize(ours["tracking"][name][:2000], len(ours["tracking"])) for name in ("theta", "alpha")},
        ),
        True,
    ),
    "a simulation of this very bench": (lambda ours, other: recorded_again(), False),
}


def recorded_again() -> Recording:
    """What the bench's own parameters, if one knows them, give in a simulation with its delay and its encoders."""
    with hil.open("virtual", plant=OURS.run(2)) as bench:
        return experiments.tracking(bench, GAIN, progress=False)
