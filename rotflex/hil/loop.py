"""The control loop: read, decide, write, once a sample.

Where time does not wait, samples that were late have no voltage written for them: the controller sees them, so that its
derivatives know what happened meanwhile, and only its answer to the newest one counts. What a run recorded that was
broken off stays with the bench, as ``bench.recorder.unfinished``, and says why; of a real bench it is saved in a file,
too.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from contextlib import nullcontext
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rotflex import __version__
from rotflex.config import real_array
from rotflex.controller import Controller, begun, name_of
from rotflex.errors import BenchError, MotorNotStopped
from rotflex.hil.bench import Bench, Measurement
from rotflex.hil.controllers import OpenLoop
from rotflex.hil.halt import note, reason, uninterrupted
from rotflex.hil.pace import undisturbed
from rotflex.hil.recorder import Stored, broken_off, pushed
from rotflex.progress import progress as with_progress
from rotflex.recording import Recording
from rotflex.units import Array, Vector

_DIGITS = 9  # of a command, rad or V: in later ones the sines of two C libraries differ, and two recordings would
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
    controller : a function (reference, theta, alpha) → V, or a discrete system of python-control, see
        :mod:`rotflex.controller`
    reference : (n,) array, rad (V for an open loop)
    sample_time : s
    metadata : what the recording should say of the experiment
    progress : show a progress bar when the run takes longer than a second

    Returns
    -------
    Recording
        theta_ref (not in an open loop), theta, alpha (rad) and the voltage that was set, vm (V), each (n,). A push
        at the arm adds tau_link (N·m).

    Raises
    ------
    DesignError
        If the controller is made for another sample time, or returns anything but one number.
    BenchError
        If the reference is not a list of finite numbers, if the bench is a replay of another run, if it is a real one
        that was not commissioned, or of which nobody knows where its arm stands, or for what the bench raises; the
        motor is at 0 V.
    """
    targets = real_array("The reference", reference, BenchError)
    if targets.ndim != 1 or targets.size < 2 or not np.isfinite(targets).all():
        raise BenchError("The reference must be a one-dimensional array of at least two finite numbers.")
    targets = np.round(targets, _DIGITS)
    bench.safety.require_place(bench.place)
    is_open = type(controller) is OpenLoop  # a class made of it may look at the angles
    if not is_open:
        bench.safety.require_commissioned()
    asked = str((metadata or {}).get("experiment", name_of(controller)))
    if bench.connection.recorded is not None:
        bench.connection.recorded.require_whole(targets.size, sample_time, asked)
    described = _described(bench, sample_time, metadata)
    theta, alpha, vm, torque = _sampled(bench, controller, targets, described, progress)
    if bench.connection.recorded is not None:
        vm = bench.connection.recorded.require_same(vm, asked)
    channels = {} if is_open else {"theta_ref": targets}
    return _recording(bench, described, torque, **channels, theta=theta, alpha=alpha, vm=vm)


def listen(bench: Bench, samples: int, sample_time: float, metadata: Mapping[str, Any], progress: bool) -> Recording:
    """Record the angles at 0 V; of a replay at most what it holds, with the voltage that was recorded.

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
    volts: Vector | None = np.zeros(samples)
    if bench.connection.recorded is not None:
        samples = min(samples, bench.connection.recorded.samples(sample_time))
        volts = bench.connection.recorded.voltage(samples, sample_time)
    described = _described(bench, sample_time, metadata)
    targets = np.zeros(samples) if volts is None else volts
    theta, alpha, _vm, torque = _sampled(bench, OpenLoop(), targets, described, progress)
    channels = {} if volts is None else {"vm": volts}
    return _recording(bench, described, torque, theta=theta, alpha=alpha, **channels)


def _sampled(bench: Bench, controller: Controller, targets: Vector, described: dict[str, Any], progress: bool) -> Array:
    """Return theta, alpha, vm and the torque on the link (4, n) of a run; a replay begins at its beginning."""
    bench.recorder.forget()
    checked = begun(controller, described["sample_time"])
    stored = Stored(targets.size, bench.recorder.folder, described)
    if bench.connection.recorded is not None:
        bench.connection.recorded.rewind()
    # Whatever takes its time is done before the first sample: a bar, for one, that is imported, and rubbish.
    coming = with_progress(range(targets.size), "experiment", "sample", progress)
    with bench.running, nullcontext() if bench.is_simulated else undisturbed():
        try:
            bench.start(described["sample_time"])
            if type(controller) is not OpenLoop:  # now it is known what the board refuses
                bench.safety.require_commissioned()
        except BaseException:
            stored.delete()
            bench.stop()
            raise
        try:
            _sample(bench, checked, targets, coming, stored.signals)
            bench.stop()
        except BaseException as error:  # also of the stop in the end, where the run is whole
            with uninterrupted():
                try:
                    _break_off(bench, error, stored.signals, described)
                finally:
                    stored.delete()
            raise
    return stored.delete()


def _break_off(bench: Bench, error: BaseException, signals: Array, described: dict[str, Any]) -> None:
    """Set 0 V, and save what was recorded, whatever fails on the way."""
    raised = error
    try:
        bench.stop()
    except BaseException as failure:
        if not isinstance(error, MotorNotStopped):  # which says already what this failure would
            raised = failure
            if str(failure) != str(error):
                raised.add_note(f"Before that: {reason(error)}")
    _note_last(bench, signals)
    if bench.safety.outcome is not None:
        note(raised, bench.safety.outcome)
    ended = {"ended": reason(error)} | bench.timing
    if (recording := broken_off(signals, described | ended, bench.safety.outcome)) is not None:
        raised.add_note(f"What was recorded until then is {bench.recorder.keep(recording)}.")
    if raised is not error:
        raise raised


def _sample(bench: Bench, controller: Controller, targets: Vector, coming: Iterable[int], signals: Array) -> None:
    """Record each sample, and answer the newest; the controller sees those that came late or were lost, too."""
    theta, alpha, vm, torque = signals
    commands = targets.tolist()
    newest = -1  # the last sample that is dealt with
    for index in coming:
        if index <= newest:
            continue
        came = [bench.read()]
        newest = bench.sample
        if newest > index or bench.overdue:
            # An answer that was written periods after its sample was not at the motor before.
            for sample in range(max(index - 1, 0), min(newest, targets.size)):
                vm[sample] = bench.held(sample)
            came = [*bench.late, *came]
            came = [*_bridge(signals, index, newest + 1 - len(came), came[0]), *came]
            came = came[: targets.size - index]  # the last may come after the end
        for sample, measured in enumerate(came, index):
            _time, theta[sample], alpha[sample] = measured
            answer = controller(commands[sample], measured.theta, measured.alpha)
            if sample < newest and measured in bench.late and bench.on_sample is not None:
                bench.on_sample(measured, float(vm[sample]))
        if newest < targets.size:
            vm[newest] = bench.write(answer)
            torque[newest] = bench.push()


def _bridge(signals: Array, index: int, first: int, came: Measurement) -> list[Measurement]:
    """Return measurements for the lost samples ``index`` to ``first`` - 1: a line between their neighbours.

    The controller gets them, too. Else its derivatives would see the motion of several samples within one.
    """
    before = signals[:2, index - 1] if index else np.array(came[1:])
    parts = np.arange(1, first - index + 1) / (first - index + 1)
    return [Measurement(np.nan, *(before + part * (np.array(came[1:]) - before)).tolist()) for part in parts]


def _note_last(bench: Bench, signals: Array) -> None:
    """Note the samples that ended a run, which nobody answered any more."""
    for sample, (_time, *angles) in enumerate([*bench.late, bench.latest], bench.sample - len(bench.late)):
        if 0 <= sample < signals.shape[1] and np.isnan(signals[0, sample]):
            signals[:2, sample] = angles


def _recording(bench: Bench, described: dict[str, Any], torque: Vector, **channels: Vector) -> Recording:
    """Return the recording of a whole run; it says how steadily samples came, on a replay as its own recording does."""
    samples, sample_time, recorded = torque.size, described["sample_time"], bench.connection.recorded
    timing = bench.timing if recorded is None else recorded.timing(samples, sample_time)
    return pushed(Recording.of(np.arange(samples) * sample_time, described | timing, **channels), torque)


def _described(bench: Bench, sample_time: float, metadata: Mapping[str, Any] | None) -> dict[str, Any]:
    """Return where a recording comes from."""
    as_json = {key: value.tolist() if hasattr(value, "tolist") else value for key, value in (metadata or {}).items()}
    return {
        "source": next((source for key, source in _SOURCES.items() if key in bench.identity), "bench"),
        "bench": dict(bench.identity),
        "sample_time": sample_time,
        "software": f"rotflex {__version__}",
        **as_json,
    }
