"""What a run records: samples that are stored while they come, and saved when the run does not end as it should."""

from __future__ import annotations

import contextlib
import datetime
import io
import json
import re
import sys
import uuid
from collections.abc import Callable, Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from rotflex import files
from rotflex.errors import RecordingError
from rotflex.hil.connection import Outcome
from rotflex.recording import PUSHED, Channel, Recording
from rotflex.units import Array, Vector

LONGEST = 60.0  #: s, of a recording that counts


class Recorder:
    """Where a bench's recordings go.

    Parameters
    ----------
    folder : where samples are stored while they come, and runs that were broken off; None for a bench that saves none

    Attributes
    ----------
    unfinished : what the last run recorded that did not end as it should, with the reason in its metadata
    unfinished_file : the file in which that is saved; None if it is in none
    path : a file for that, in place of one in the folder
    on_recorded : called with the recording of each experiment, once it is whole; None for nobody
    """

    def __init__(self, folder: Path | None = None) -> None:
        self.folder = folder
        self.path: Path | None = None
        self.on_recorded: Callable[[Recording], object] | None = None
        self.forget()

    def forget(self) -> None:
        """Keep nothing of the run before."""
        self.unfinished: Recording | None = None
        self.unfinished_file: Path | None = None

    def keep(self, recording: Recording) -> str:
        """Keep a recording, also in a file, and return where it is: "in …"."""
        self.unfinished = recording
        name = f"{file_stem(recording)}-{datetime.datetime.now():%Y%m%d-%H%M%S}-{uuid.uuid4().hex[:8]}.mat"
        for path in filter(None, (self.path, self.folder and self.folder / name)):
            with contextlib.suppress(OSError, RecordingError):
                path.parent.mkdir(parents=True, exist_ok=True)
                self.unfinished_file = recording.save(path)
                return f"in {self.unfinished_file}"
        return "in the bench's recorder.unfinished, until the program ends"

    def save_whole(self, recording: Recording, save: Callable[[Recording], object]) -> None:
        """Have a whole recording saved; keep it where that cannot be done.

        Raises
        ------
        RecordingError
            If ``save`` raises it; the message says where the recording is.
        """
        try:
            save(recording)
        except RecordingError as error:
            raise RecordingError(f"{error} The recording is whole: it is {self.keep(recording)}.") from error


class Stored:
    """The signals (4, n) of a run: theta, alpha (rad), vm (V), torque on the link (N·m); NaN where not sampled.

    Of a real bench they are written into a file as they come, through the operating system's own memory, which costs
    the loop nothing and which no end of the program takes away: :func:`recover` finds it. The file is written whole
    before the motor moves, for on a full disk a part of it that is not there yet would end the program.
    """

    def __init__(self, samples: int, folder: Path | None, described: Mapping[str, Any]) -> None:
        self._path: Path | None = None
        self.signals = np.full((4, samples), np.nan)
        if folder is None:
            return
        path = folder / f"{uuid.uuid4().hex}.npy"
        try:
            about, content = json.dumps(dict(described)), io.BytesIO()
            np.save(content, self.signals)
            folder.mkdir(parents=True, exist_ok=True)
            files.write(path.with_suffix(".json"), about)
            files.write(path, content.getvalue())
            self.signals = np.lib.format.open_memmap(path, mode="r+")
            self._file = path.open("r+b")  # over a network only a file that may be written can be locked
            self._path = path
            with contextlib.suppress(OSError):  # a file system without locks
                files.lock(self._file)
        except (TypeError, ValueError, RecursionError) as error:
            raise RecordingError(f"The metadata must be plain data, as JSON can hold: {error}.") from None
        except OSError as error:
            _delete(path)
            raise RecordingError(
                f"Samples cannot be stored in {folder} while they come: {error.strerror or error}. The motor was not "
                "driven. Make room there, make that folder writable, or name another one in the environment variable "
                f"{files.SETTINGS_VARIABLE}, and start again."
            ) from None

    def delete(self) -> Array:
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
            if recording := broken_off(signals, described | {"ended": ended}):
                saved = recording.save(folder / f"{file_stem(recording)}-{path.stem[:8]}.mat")
                path.unlink()
                note = f"Note      A program was killed in a run. What was recorded until then is in {saved}."
                print(note, file=sys.stderr)  # doctor's JSON is on the other one
            _delete(path)


def _delete(path: Path) -> None:
    for file in (path, path.with_suffix(".json")):
        with contextlib.suppress(OSError):
            file.unlink(missing_ok=True)


def broken_off(signals: Array, described: Mapping[str, Any], outcome: Outcome | None = None) -> Recording | None:
    """Return the recording of the samples that there are; None for fewer than two.

    What was missed in between lies on the line between its neighbours. The last samples, which were not answered any
    more, have the voltage that the motor was left with: as the outcome says, or, where nobody lived to see it, the one
    that it had.
    """
    places = np.flatnonzero(~np.isnan(signals[:2]).any(axis=0))
    if places.size < 2:
        return None
    every = np.arange(places[-1] + 1)
    theta, alpha = (np.interp(every, places, row[places]) for row in signals[:2])
    volts, *torques = signals[2:, : every.size].copy()
    answered = 1 + max(np.flatnonzero(~np.isnan(volts)), default=-1)
    left = outcome.volts if outcome is not None else volts[answered - 1] if answered else 0.0
    volts[answered:] = np.nan if left is None else left
    channels = {"theta": theta, "alpha": alpha, "vm": np.nan_to_num(volts)}
    if outcome is not None:
        described = {**described, "outcome": asdict(outcome)}
    recording = Recording.of(every * float(described["sample_time"]), described, **channels)
    return pushed(recording, np.nan_to_num(torques[0])) if torques else recording  # an older program left no torque


def pushed(recording: Recording, torque: Vector) -> Recording:
    """Return a recording with the torque (n,) that pushed the link, N·m; as it is, if there was none."""
    torque = np.nan_to_num(torque)  # samples that came late have none
    if not torque.any():
        return recording
    return replace(recording, channels={**recording.channels, PUSHED: Channel(torque, "N·m")})


def file_stem(recording: Recording) -> str:
    """Return the name of a recording's experiment as a part of a file's name."""
    return re.sub(r"\W+", "-", str(recording.metadata.get("experiment", "run"))).strip("-") or "run"
