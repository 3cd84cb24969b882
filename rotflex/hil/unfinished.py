"""Samples that outlive the program: what was recorded when it was killed, or when a run was broken off.

Where time does not wait for the program, a run writes its samples into a file as they come, through the operating
system's own memory, which costs the loop nothing and which no end of the program takes away.
"""

from __future__ import annotations

import contextlib
import json
import os
import uuid
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotflex import files
from rotflex.errors import RecordingError
from rotflex.hil.held import Held, is_held
from rotflex.recording import Recording

ENDED = "ended"  #: why a recording is not whole, in its metadata
_WITHOUT_A_WORD = "The program ended without a word. The board's watchdog, where it works, then sets 0 V."
_LOCK = ".lock"  # of an empty file beside the samples
_OVER = ".over"  # of an empty file beside one that could not be deleted, of a run that ended as it should


class Unfinished:
    """The signals (3, n) of a run, theta, alpha (rad) and vm (V); what was not sampled is no number.

    Parameters
    ----------
    samples : how many there will be at the most
    folder : where they are kept until the run is over; None keeps them in memory
    described : the recording's metadata
    """

    def __init__(self, samples: int, folder: Path | None, described: Mapping[str, Any]) -> None:
        self._path: Path | None = None
        self._held: Held | None = None
        self._described = dict(described)
        if folder is None:
            self.signals: NDArray[np.float64] = np.full((3, samples), np.nan)
            return
        _require_plain(self._described)
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self._path = folder / f"{uuid.uuid4().hex}.npy"
            self._held = Held(beside(self._path, _LOCK))
            self._describe(self._path)
            self.signals = np.lib.format.open_memmap(self._path, mode="w+", dtype=np.float64, shape=(3, samples))
        except OSError as error:
            raise RecordingError(
                f"Samples cannot be kept in {folder} while they come: {error.strerror or error}. Make that "
                "folder writable, or name another one for settings in the environment variable "
                f"{files.FOLDER}, and start again."
            ) from None
        self.signals[:] = np.nan

    def broken_off(self, why: str, more: Mapping[str, Any]) -> Recording | None:
        """What was recorded until then, with the reason; the file stays until it is taken away."""
        self._described |= {ENDED: why, **more}
        if self._path is not None:
            self._describe(self._path)
        self._release()
        return _recording(self.signals, self._described)

    def finished(self) -> NDArray[np.float64]:
        """The signals in memory; the file is gone."""
        if self._path is None:
            return self.signals
        self.signals = np.array(self.signals)  # on Windows a file that is mapped cannot be deleted
        _discard(self._path)  # the lock last: nobody is to take it for what a killed program left
        self._release()
        _discard(self._path)
        return self.signals

    def _release(self) -> None:
        if self._held is not None:
            self._held.release()

    def _describe(self, path: Path) -> None:
        files.write(
            beside(path, ".json"), lambda scratch: scratch.write_text(json.dumps(self._described), encoding="utf-8")
        )


def unfinished(folder: str | os.PathLike[str]) -> dict[Path, Recording]:
    """Recordings of runs that did not end as they should, by their files; not of those that still go on.

    Parameters
    ----------
    folder : in which the bench keeps samples while they come
    """
    found = {}
    for over in list(Path(folder).glob(f"*{_OVER}")):
        _discard(over)
    for path in sorted(Path(folder).glob("*.npy")):
        if is_held(beside(path, _LOCK)) or beside(path, _OVER).exists():
            continue
        try:
            recording = _left_behind(path)
        except (OSError, EOFError, ValueError, TypeError, LookupError, RecordingError):
            continue  # killed before it was whole, or it is none of ours
        if recording is not None:
            found[path] = recording
    return found


def _left_behind(path: Path) -> Recording | None:
    described = dict(json.loads(beside(path, ".json").read_text(encoding="utf-8")))
    signals = np.load(path, mmap_mode="r")
    described.setdefault(ENDED, _WITHOUT_A_WORD)
    return _recording(np.array(signals), described)


def filled(signals: NDArray[np.float64]) -> NDArray[np.float64]:
    """Signals (3, n) with what was missed in between: angles on the line between their neighbours, voltages held."""
    known = ~np.isnan(signals[0])
    if known.all() or not known.any():
        return signals
    places = np.arange(signals.shape[1])
    whole = signals.copy()
    for row in whole[:2]:
        row[~known] = np.interp(places[~known], places[known], row[known])
    return whole


def _recording(signals: NDArray[np.float64], described: Mapping[str, Any]) -> Recording | None:
    """The recording of the samples that there are; None for fewer than two."""
    known = np.flatnonzero(~np.isnan(signals[:2]).any(axis=0))
    if known.size < 2:
        return None
    signals = filled(signals[:, : known[-1] + 1])
    # The last sample was not answered any more: the motor was set to 0 V.
    volts = np.nan_to_num(signals[2], nan=0.0)
    time = np.arange(volts.size) * float(described["sample_time"])
    return Recording.of(time, described, theta=signals[0], alpha=signals[1], vm=volts)


def beside(path: Path, ending: str) -> Path:
    """Another file of the same recording."""
    return path.with_suffix(ending)


def _require_plain(described: dict[str, Any]) -> None:
    """Metadata that a file cannot hold are told before anything moves."""
    try:
        json.dumps(described)
    except (TypeError, ValueError, RecursionError) as error:
        raise RecordingError(f"The metadata must be plain data, as JSON can hold: {error}.") from None


def _discard(path: Path) -> None:
    """Delete the files of a run that ended as it should: now, or where a program has one open, once it does not.

    On Windows the system's search may have it open, or another program that asks whether this one still lives.
    """
    files_of_it = [beside(path, ending) for ending in (".json", ".npy", _LOCK)]
    for one in files_of_it:
        with contextlib.suppress(OSError):
            one.unlink(missing_ok=True)
    with contextlib.suppress(OSError):
        if any(one.exists() for one in files_of_it):
            beside(path, _OVER).touch()
        else:
            beside(path, _OVER).unlink(missing_ok=True)
