"""The control loop: read, decide, write, once a sample.

Where time does not wait, samples that were late have no voltage written for them: the controller sees them, so that its
derivatives know what happened meanwhile, and only its answer to the newest one counts. What a run recorded that was
broken off stays with the bench, as ``bench.kept``, and says why; of a real bench it is saved in a file as well.
"""

from __future__ import annotations

import contextlib
import datetime
import json
import re
import sys
import uuid
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotflex import __version__, files
from rotflex.controller import Controller, begun, name_of
from rotflex.errors import BenchError, RecordingError
from rotflex.hil.bench import Bench, Measurement
from rotflex.hil.controllers import OpenLoop
from rotflex.hil.halt import reason, uninterrupted
from rotflex.hil.pace import undisturbed
from rotflex.progress import progress as with_progress
from rotflex.recording import PUSHED, Channel, Recording

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
    controller : a function (reference, theta, alpha) → V, see :mod:`rotflex.controller`
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
        If the controller returns anything but one number.
    BenchError
        If the reference is not a list of finite numbers, if the bench is a replay of another run, if it is a real one
        that was not commissioned, or of which nobody knows where its arm stands, or for what the bench raises; the
        motor is at 0 V.
    """
    targets = np.asarray(reference, dtype=float)
    if targets.ndim != 1 or targets.size < 2 or not np.isfinite(targets).all():
        raise BenchError("The reference must be a one-dimensional array of at least two finite numbers.")
    bench.require_mark()
    is_open = type(controller) is OpenLoop  # a class made of it may look at the angles
    if not is_open:
        bench.require_commissioned()
    asked = str((metadata or {}).get("experiment", name_of(controller)))
    if bench.recorded is not None:
        bench.recorded.require_whole(targets.size, sample_time, asked)
    described = _described(bench, sample_time, metadata)
    theta, alpha, vm, torque = _sampled(bench, controller, targets, described, progress)
    if bench.recorded is not None:
        vm = bench.recorded.require_same(vm, asked)
    time = np.arange(targets.size) * sample_time
    channels = {} if is_open else {"theta_ref": targets}
    channels |= {"theta": theta, "alpha": alpha, "vm": vm}
    return pushed(Recording.of(time, described | _timing(bench, targets.size, sample_time), **channels), torque)


def listen(
    bench: Bench,
    samples: int,
    sample_time: float = 0.002,
    metadata: Mapping[str, Any] | None = None,
    progress: bool = True,
) -> Recording:
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
    volts: NDArray[np.float64] | None = np.zeros(samples)
    if bench.recorded is not None:
        samples = min(samples, bench.recorded.samples(sample_time))
        volts = bench.recorded.voltage(samples, sample_time)
    described = _described(bench, sample_time, metadata)
    signals = _sampled(bench, OpenLoop(), np.zeros(samples) if volts is None else volts, described, progress)
    channels = {"theta": signals[0], "alpha": signals[1]} | ({} if volts is None else {"vm": volts})
    described |= _timing(bench, samples, sample_time)
    return pushed(Recording.of(np.arange(samples) * sample_time, described, **channels), signals[3])


def pushed(recording: Recording, torque: NDArray[np.float64]) -> Recording:
    """Return a recording with the torque (n,) that pushed the link, N·m; as it is, if there was none."""
    torque = np.nan_to_num(torque)  # samples that came late have none
    if not torque.any():
        return recording
    channels = {**recording.channels, PUSHED: Channel(torque, "N·m")}
    return Recording(recording.time, channels, recording.metadata)


def _sampled(
    bench: Bench, controller: Controller, targets: NDArray[np.float64], described: dict[str, Any], progress: bool
) -> NDArray[np.float64]:
    """Return theta, alpha, vm and the torque on the link (4, n) of a run; a replay begins at its beginning."""
    bench.kept = bench.kept_in = None
    controller = begun(controller)
    stored = _Stored(targets.size, bench.safety.folder, described)
    if bench.recorded is not None:
        bench.recorded.rewind()
    # Whatever takes its time is done before the first sample: a bar, for one, that is imported, and rubbish.
    coming = enumerate(with_progress(targets.tolist(), "experiment", "sample", progress))
    with bench.running, undisturbed(not bench.is_simulated):
        try:
            bench.start(described["sample_time"])
        except BaseException:
            stored.delete()
            raise
        try:
            _sample(bench, controller, targets, coming, stored.signals)
            bench.stop()
        except BaseException as error:  # also of the stop in the end, where the run is whole
            with uninterrupted():
                try:
                    _break_off(bench, error, stored.signals, described)
                finally:
                    stored.delete()
            raise
    return stored.delete()


class _Stored:
    """The signals (4, n) of a run: theta, alpha (rad), vm (V), torque on the link (N·m); NaN where not sampled.

    Of a real bench they are written into a file as they come, through the operating system's own memory, which costs
    the loop nothing and which no end of the program takes away: :func:`recover` finds it.
    """

    def __init__(self, samples: int, folder: Path | None, described: Mapping[str, Any]) -> None:
        self._path: Path | None = None
        self.signals = np.full((4, samples), np.nan)
        if folder is None:
            return
        try:
            about = json.dumps(dict(described))
            folder.mkdir(parents=True, exist_ok=True)
            self._path = folder / f"{uuid.uuid4().hex}.npy"
            files.write(self._path.with_suffix(".json"), about)
            self.signals = np.lib.format.open_memmap(self._path, mode="w+", dtype=float, shape=(4, samples))
            self._file = self._path.open("r+b")  # over a network only a file that may be written can be locked
            with contextlib.suppress(OSError):  # a file system without locks
                files.lock(self._file)
        except (TypeError, ValueError, RecursionError) as error:
            raise RecordingError(f"The metadata must be plain data, as JSON can hold: {error}.") from None
        except OSError as error:
            raise RecordingError(
                f"Samples cannot be stored in {folder} while they come: {error.strerror or error}. Make that folder "
                f"writable, or name another one in the environment variable {files.FOLDER}, and start again."
            ) from None
        self.signals[:] = np.nan

    def delete(self) -> NDArray[np.float64]:
        """Delete the file, and return the signals in memory."""
        if self._path is not None:
            self.signals = np.array(self.signals)  # on Windows a file that is mapped cannot be deleted
            self._file.close()
            _delete(self._path)
        return self.signals


def recover(folder: Path) -> None:
    """Save what programs that were killed left in a folder as recordings, and print where they are."""
    for path in folder.glob("*.npy"):
        # What is not whole is left alone, and so is the run of a program that is alive.
        with contextlib.suppress(OSError, EOFError, ValueError, TypeError, LookupError, RecordingError):
            with path.open("r+b") as file:
                files.lock(file)
            signals = np.load(path)
            described = json.loads(path.with_suffix(".json").read_text(encoding="utf-8"))
            ended = "The program ended without a word. The board's watchdog, where it works, then sets 0 V."
            if recording := _broken_off(signals, described | {"ended": ended}):
                saved = recording.save(folder / f"{_name(recording)}-{path.stem[:8]}.mat")
                path.unlink()
                note = f"Note      A program was killed in a run. What was recorded until then is in {saved}."
                print(note, file=sys.stderr)  # doctor's JSON is on the other one
            _delete(path)


def _delete(path: Path) -> None:
    for file in (path, path.with_suffix(".json")):
        with contextlib.suppress(OSError):
            file.unlink(missing_ok=True)


def _break_off(bench: Bench, error: BaseException, signals: NDArray[np.float64], described: dict[str, Any]) -> None:
    """Set 0 V, and save what was recorded, whatever fails on the way."""
    try:
        bench.stop()
    finally:
        _note_last(bench, signals)
        bench.kept = _broken_off(signals, described | {"ended": reason(error)} | bench.timing)
        if bench.kept is not None:
            bench.kept_in = save_aside(bench.kept, bench.safety.folder)
            raised = sys.exception() or error  # the stop's own error, where it failed
            raised.add_note(f"What was recorded until then is {where(bench.kept_in)}.")
    if not isinstance(error, BenchError):  # the bench's own say so themselves
        error.add_note("The motor is at 0 V.")


def _broken_off(signals: NDArray[np.float64], described: Mapping[str, Any]) -> Recording | None:
    """Return the recording of the samples that there are; None for fewer than two.

    What was missed in between lies on the line between its neighbours.
    """
    places = np.flatnonzero(~np.isnan(signals[:2]).any(axis=0))
    if places.size < 2:
        return None
    every = np.arange(places[-1] + 1)
    theta, alpha = (np.interp(every, places, row[places]) for row in signals[:2])
    # The last sample was not answered any more: the motor was set to 0 V.
    volts, *torques = np.nan_to_num(signals[2:, : every.size], nan=0.0)
    recording = Recording.of(every * float(described["sample_time"]), described, theta=theta, alpha=alpha, vm=volts)
    return pushed(recording, torques[0]) if torques else recording  # an older program left no torque


def save_aside(recording: Recording, folder: Path | None) -> Path | None:
    """Save a recording that was broken off, or could not be saved where it should be; return its file, if it has one.

    Parameters
    ----------
    recording : with its name in its metadata
    folder : of the bench's safety; None for a bench that saves none
    """
    if folder is not None:
        file = folder / f"{_name(recording)}-{datetime.datetime.now():%Y%m%d-%H%M%S}-{uuid.uuid4().hex[:8]}.mat"
        with contextlib.suppress(OSError, RecordingError):
            folder.mkdir(parents=True, exist_ok=True)
            return recording.save(file)
    return None


def where(file: Path | None) -> str:
    """Return where a recording is that was saved aside: "in …"."""
    return f"in {file}, and in the bench's `kept`" if file else "in the bench's `kept`, until the program ends"


def _name(recording: Recording) -> str:
    return re.sub(r"\W+", "-", str(recording.metadata.get("experiment", "run"))).strip("-") or "run"


def _sample(
    bench: Bench,
    controller: Controller,
    targets: NDArray[np.float64],
    coming: Iterable[tuple[int, float]],
    signals: NDArray[np.float64],
) -> None:
    theta, alpha, vm, torque = signals
    passed = -1  # the last sample that is dealt with
    for index, target in coming:
        if index <= passed:
            continue
        measured = bench.read()
        if bench.late or bench.sample != index:
            passed = _catch_up(bench, controller, targets, signals, index)
            continue
        if bench.overdue:
            _hold(vm, index, index, bench.overdue)
        _now, theta[index], alpha[index] = measured
        vm[index] = bench.write(controller(target, measured.theta, measured.alpha))
        torque[index] = bench.push()


def _catch_up(
    bench: Bench, controller: Controller, targets: NDArray[np.float64], signals: NDArray[np.float64], index: int
) -> int:
    """Record the samples that were late, answer the newest, and return which it is."""
    newest, came = bench.sample, [*bench.late, bench.latest]
    first = newest - len(bench.late)
    _hold(signals[2], index, newest, bench.overdue)
    for sample, measured in enumerate([*_bridge(signals, index, first, came[0]), *came], index):
        if sample >= targets.size:
            return newest
        _time, signals[0, sample], signals[1, sample] = measured
        asked = controller(float(targets[sample]), measured.theta, measured.alpha)
        if first <= sample < newest and bench.on_sample is not None:
            bench.on_sample(measured, float(signals[2, sample]))
    signals[2, newest] = bench.write(asked)
    return newest


def _hold(vm: NDArray[np.float64], index: int, newest: int, overdue: int) -> None:
    """Note the voltage that the motor had from a sample to the newest one: the last answer, once it was written."""
    held = float(vm[index - 1]) if index else 0.0
    vm[index:newest] = held
    if index and overdue:  # an answer that was written periods after its sample was not at the motor before
        vm[index - 1 : min(index - 1 + overdue, newest)] = vm[index - 2] if index > 1 else 0.0


def _bridge(signals: NDArray[np.float64], index: int, first: int, came: Measurement) -> list[Measurement]:
    """Return measurements for the lost samples ``index`` to ``first`` - 1: a line between their neighbours.

    The controller gets them, too. Else its derivatives would see the motion of several samples within one.
    """
    before = signals[:2, index - 1] if index else np.array(came[1:])
    parts = np.arange(1, first - index + 1) / (first - index + 1)
    return [Measurement(np.nan, *(before + part * (np.array(came[1:]) - before)).tolist()) for part in parts]


def _note_last(bench: Bench, signals: NDArray[np.float64]) -> None:
    """Note the samples that ended a run, which nobody answered any more."""
    for sample, (_time, *angles) in enumerate([*bench.late, bench.latest], bench.sample - len(bench.late)):
        if 0 <= sample < signals.shape[1] and np.isnan(signals[0, sample]):
            signals[:2, sample] = angles


def _timing(bench: Bench, samples: int, sample_time: float) -> dict[str, Any]:
    """Return how steadily the samples came; on a replay, as its recording says."""
    return bench.timing if bench.recorded is None else bench.recorded.timing(samples, sample_time)


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
