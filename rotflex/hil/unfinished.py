"""Recordings of runs that did not end as they should: broken off, or of a program that was killed.

Where time does not wait for the program, a run writes its samples into a file as they come, through the operating
system's own memory, which costs the loop nothing and which no end of the program takes away. The file of a run that
ended well is deleted; the others wait in the folder until ``rotflex bench unfinished --out FOLDER`` writes them out.
"""

from __future__ import annotations

import contextlib
import datetime
import json
import os
import re
import sys
import uuid
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotflex import files
from rotflex.errors import RecordingError
from rotflex.recording import Recording

if sys.platform == "win32":
    import msvcrt

    def _lock(handle: int) -> None:
        msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)

else:
    import fcntl

    def _lock(handle: int) -> None:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)


ENDED = "ended"  #: why a recording is not whole, in its metadata
_WITHOUT_A_WORD = "The program ended without a word. The board's watchdog, where it works, then sets 0 V."
_ENDINGS = (".json", ".npy", ".lock")  # metadata, samples, and what the program that writes them holds a lock of
_noted: set[Path] = set()  # of which this program has printed a note


def place() -> Path:
    """Return the folder in which real benches keep samples while they come."""
    return files.settings() / "unfinished"


class Unfinished:
    """The signals (3, n) of a run, theta, alpha (rad) and vm (V); what was not sampled is no number.

    Parameters
    ----------
    samples : how many there will be at the most
    folder : where they are stored until the run is over; None keeps them in memory
    described : the recording's metadata

    Raises
    ------
    RecordingError
        If the folder cannot be written, or a file cannot hold the metadata.
    """

    def __init__(self, samples: int, folder: Path | None, described: Mapping[str, Any]) -> None:
        self.path: Path | None = None  #: of the samples
        self._lock: int | None = None
        self._described = dict(described)
        if folder is None:
            self.signals: NDArray[np.float64] = np.full((3, samples), np.nan)
            return
        try:
            json.dumps(self._described)
        except (TypeError, ValueError, RecursionError) as error:
            raise RecordingError(f"The metadata must be plain data, as JSON can hold: {error}.") from None
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self.path = folder / f"{uuid.uuid4().hex}.npy"
            self._lock = os.open(self.path.with_suffix(".lock"), os.O_RDWR | os.O_CREAT, 0o600)
            with contextlib.suppress(OSError):  # a file system without locks
                _lock(self._lock)
            self._describe(self.path)
            self.signals = np.lib.format.open_memmap(self.path, mode="w+", dtype=np.float64, shape=(3, samples))
        except OSError as error:
            raise RecordingError(
                f"Samples cannot be stored in {folder} while they come: {error.strerror or error}. Make that folder "
                f"writable, or name another one in the environment variable {files.FOLDER}, and start again."
            ) from None
        self.signals[:] = np.nan

    def broken_off(self, why: str, more: Mapping[str, Any]) -> Recording | None:
        """Return what was recorded until now, with the reason; its file stays. None for fewer than two samples."""
        self._described |= {ENDED: why, **more}
        if self.path is not None:
            self._describe(self.path)
        self._release()
        return _recording(self.signals, self._described)

    def finished(self) -> NDArray[np.float64]:
        """Return the signals, in memory; the file is deleted."""
        self.signals = np.array(self.signals)  # on Windows a file that is mapped cannot be deleted
        self._release()
        if self.path is not None:
            with contextlib.suppress(OSError):  # it is listed then, though the run is whole
                remove(self.path)
        return self.signals

    def _release(self) -> None:
        handle, self._lock = self._lock, None
        if handle is not None:
            os.close(handle)

    __del__ = _release

    def _describe(self, path: Path) -> None:
        files.write(path.with_suffix(".json"), json.dumps(self._described))


@dataclass(frozen=True)
class Waiting:
    """A recording that waits: the file of its samples, what there is of it, and when the run began or broke off."""

    path: Path
    recording: Recording
    begun: datetime.datetime

    def __str__(self) -> str:
        about = self.recording.metadata
        bench = about.get("bench")
        address = bench.get("uri", "?") if isinstance(bench, dict) else "?"
        seconds = len(self.recording) * self.recording.sample_time
        return f"{self.begun:%Y-%m-%d %H:%M}  {_name(self.recording)}, {seconds:.1f} s, {address}\n    {about[ENDED]}"


def waiting(folder: Path) -> list[Waiting]:
    """Return the recordings that wait in a folder, the oldest first; not those of runs that still go on."""
    found = []
    for path in folder.glob("*.npy"):
        if _is_locked(path.with_suffix(".lock")):
            continue
        about = path.with_suffix(".json")
        try:
            described = {ENDED: _WITHOUT_A_WORD} | dict(json.loads(about.read_text(encoding="utf-8")))
            recording = _recording(np.array(np.load(path, mmap_mode="r")), described)
            begun = datetime.datetime.fromtimestamp(about.stat().st_mtime).astimezone()
        except (OSError, EOFError, ValueError, TypeError, LookupError, RecordingError):
            continue  # killed before it was whole, or it is none of ours
        if recording is not None:
            found.append(Waiting(path, recording, begun))
    return sorted(found, key=lambda one: (one.begun, one.path))


def note() -> None:
    """Print, once a program, that recordings wait. Nothing that fails here keeps a bench from being opened."""
    with contextlib.suppress(OSError):
        new = {one.path for one in waiting(place())} - _noted
        _noted.update(new)
        if new:
            print(
                f"Note      {counted(len(new))} of runs that did not end as they should: see rotflex bench unfinished."
            )


def counted(number: int) -> str:
    """Return "1 recording", or "2 recordings"."""
    return f"{number} recording{'' if number == 1 else 's'}"


def write_out(one: Waiting, folder: Path) -> Path:
    """Write a recording as a .mat file with the reason in it, and delete it from those that wait.

    Raises
    ------
    RecordingError
        If it cannot be written. It still waits then.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RecordingError(f"{folder} cannot be made: {error.strerror or error}.") from None
    path = one.recording.save(folder / f"{_name(one.recording)}-{one.begun:%Y%m%d-%H%M%S}-{one.path.stem[:8]}.mat")
    with contextlib.suppress(PermissionError):  # on Windows, while the program that made it has it open
        remove(one.path)
    return path


def remove(path: Path) -> None:
    """Delete the files of a recording."""
    for ending in _ENDINGS:
        files.patiently(partial(path.with_suffix(ending).unlink, missing_ok=True))


def save_whole(recording: Recording, folder: Path | None) -> str:
    """Save a whole recording that could not be saved where it should be, and return a sentence that says where it is.

    Parameters
    ----------
    recording : with its name in its metadata
    folder : in which the bench keeps samples while they come; None for a bench that keeps none
    """
    if folder is not None:
        name = f"{_name(recording)}-{datetime.datetime.now():%Y%m%d-%H%M%S}-{uuid.uuid4().hex[:8]}.mat"
        with contextlib.suppress(OSError, RecordingError):
            folder.mkdir(parents=True, exist_ok=True)
            return f"The recording is whole: it is in {recording.save(folder / name)}, and in the bench's `kept`."
    return "The recording is whole: it is in the bench's `kept`, until the program ends."


def _name(recording: Recording) -> str:
    return re.sub(r"\W+", "-", str(recording.metadata.get("experiment", "run"))).strip("-") or "run"


def _is_locked(path: Path) -> bool:
    """Whether a program that is alive, this one or another, writes the run."""
    try:
        handle = os.open(path, os.O_RDWR)
    except OSError as error:
        return not isinstance(error, FileNotFoundError)  # it is somebody else's
    try:
        _lock(handle)
    except OSError:
        return True
    finally:
        os.close(handle)
    return False


def _recording(signals: NDArray[np.float64], described: Mapping[str, Any]) -> Recording | None:
    """Return the recording of the samples that there are; None for fewer than two.

    What was missed in between lies on the line between its neighbours.
    """
    known = ~np.isnan(signals[:2]).any(axis=0)
    places = np.flatnonzero(known)
    if places.size < 2:
        return None
    every = np.arange(places[-1] + 1)
    theta, alpha = (np.interp(every, places, row[places]) for row in signals[:2])
    # The last sample was not answered any more: the motor was set to 0 V.
    volts = np.nan_to_num(signals[2, : every.size], nan=0.0)
    return Recording.of(every * float(described["sample_time"]), described, theta=theta, alpha=alpha, vm=volts)
