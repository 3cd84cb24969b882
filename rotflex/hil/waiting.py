"""Recordings that a program left behind when it was killed, or a run when it was broken off: told, and put away.

They wait in a folder (:mod:`rotflex.hil.unfinished`) until somebody has them written to a place of his own. Of each, it
is told once that it waits when a bench is opened; the list always has all of them.
"""

from __future__ import annotations

import contextlib
import datetime
import os
import re
import uuid
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rotflex import files
from rotflex.errors import RecordingError
from rotflex.hil.unfinished import ENDED, beside, unfinished
from rotflex.recording import Recording

_TOLD = ".told"  # of an empty file beside a recording: a person was told of it


@dataclass(frozen=True)
class Waiting:
    """A recording that waits.

    Attributes
    ----------
    path : of its samples
    recording : what there is of it, with the reason in its metadata
    """

    path: Path
    recording: Recording

    @property
    def begun(self) -> datetime.datetime:
        """When the run began, or was broken off, in the computer's own time zone."""
        return datetime.datetime.fromtimestamp(beside(self.path, ".json").stat().st_mtime).astimezone()

    def __str__(self) -> str:
        about = self.recording.metadata
        known, experiment = about.get("bench"), about.get("experiment", "run")
        bench = known.get("uri", "?") if isinstance(known, dict) else "?"
        seconds = len(self.recording) * self.recording.sample_time
        return f"{self.begun:%Y-%m-%d %H:%M}  {experiment}, {seconds:.1f} s, {bench}\n    {about[ENDED]}"


def counted(found: Sequence[Waiting]) -> str:
    """Return "1 recording", or "2 recordings"."""
    return f"{len(found)} recording{'' if len(found) == 1 else 's'}"


def place() -> Path:
    """The folder in which real benches keep samples while they come."""
    return files.settings() / "unfinished"


def waiting(folder: Path) -> list[Waiting]:
    """All that wait, the oldest first. A run that still goes on is not among them.

    Parameters
    ----------
    folder : in which the bench keeps samples while they come
    """
    return sorted((Waiting(*one) for one in unfinished(folder).items()), key=lambda one: (one.begun, one.path))


def tell(folder: Path | None = None) -> None:
    """Print a line on those of which nobody was told yet. Nothing that fails here keeps a bench from being opened.

    Parameters
    ----------
    folder : in which they wait; that of real benches unless given
    """
    new: list[Waiting] = []
    with contextlib.suppress(Exception):  # whatever the file of a killed program holds
        for one in waiting(folder or place()):
            if not beside(one.path, _TOLD).exists():
                new.append(one)
                beside(one.path, _TOLD).touch()
    if new:
        print(f"Note      {counted(new)} of runs that did not end as they should: see rotflex bench unfinished.")


def put_by(recording: Recording, folder: Path | None) -> str:
    """Save a recording that is whole, and could not be kept where it should be; where it is now, in words.

    Parameters
    ----------
    recording : with its name in its metadata
    folder : in which the bench keeps samples while they come; None for a bench that keeps none
    """
    if folder is not None:
        name = f"{_named(recording)}-{datetime.datetime.now():%Y%m%d-%H%M%S}-{uuid.uuid4().hex[:8]}.mat"
        with contextlib.suppress(OSError, RecordingError):
            folder.mkdir(parents=True, exist_ok=True)
            path = recording.save(folder / name)
            return f"The recording is whole: it is in {path}, and in the bench's `kept`."
    return "The recording is whole: it is in the bench's `kept`, until the program ends."


def _named(recording: Recording) -> str:
    """What a file of a recording's is called."""
    return re.sub(r"\W+", "-", str(recording.metadata.get("experiment", "run"))).strip("-") or "run"


def write_out(one: Waiting, folder: Path) -> Path:
    """Write a recording as a .mat file with the reason in it, and take it out of those that wait.

    Parameters
    ----------
    one : the recording
    folder : where to; made if needed

    Raises
    ------
    RecordingError
        If it cannot be written, or not read again as it is. It waits on then.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RecordingError(f"{folder} cannot be made: {error.strerror or error}.") from None
    path = one.recording.save(folder / f"{_named(one.recording)}-{one.begun:%Y%m%d-%H%M%S}-{one.path.stem[:8]}.mat")
    written = Recording.load(path)
    if not _same(written, one.recording):
        raise RecordingError(f"{path} does not read as it was written. The recording is in {one.path} still.")
    remove(one)
    return path


def remove_same(recording: Recording, folder: Path) -> None:
    """Take a recording that was kept elsewhere out of those that wait."""
    for one in waiting(folder):
        if one.recording.metadata == dict(recording.metadata) and _same(one.recording, recording):
            remove(one)


def remove(one: Waiting) -> None:
    """Delete what is kept of a recording."""
    for ending in (_TOLD, ".lock", ".npy", ".json"):
        try:
            beside(one.path, ending).unlink(missing_ok=True)
        except PermissionError:  # on Windows, while the program that made it has it open: it is listed until then
            if os.name != "nt":
                raise
            return


def _same(one: Recording, other: Recording) -> bool:
    """Whether two are the same, but for the last digit, which a file in degrees may change."""
    return (
        len(one) == len(other)
        and set(one.channels) == set(other.channels)
        and all(np.allclose(one[name], other[name], rtol=1e-9, atol=1e-12) for name in one.channels)
    )
