"""Signs recordings, keeps a journal of them, and refuses what the bench cannot have given in the time that passed.

It cannot see the bench. What it vouches for is what it sees: at this time, on this machine, these bytes were handed to
it in this student's name, in this order, and no more seconds of recordings than went by on its clock.
"""

from __future__ import annotations

import contextlib
import json
import os
import tempfile
import time
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from rotflex.courseware import signed_files, student_id
from rotflex.courseware.messages import _
from rotflex.errors import SignatureError
from rotflex.recording import Recording
from rotflex.signing.signer_settings import SignerSettings

MOST_BYTES = 5_000_000  #: of a recording's file
_SLACK = 1.0  # s: clocks of boards and of computers differ
_PATIENCE = 10.0  # s to wait for another request that is being signed


class Signer:
    """Signs recordings with the bench's key.

    Parameters
    ----------
    settings : of the program
    clock : s since 1970
    """

    def __init__(self, settings: SignerSettings, clock: Callable[[], float]) -> None:
        self._settings, self._clock = settings, clock
        self._key = signed_files.private_key(settings.key)

    def sign(self, student: str, content: bytes) -> bytes:
        """What is to lie beside a recording's file.

        Parameters
        ----------
        student : in whose name it was recorded
        content : of the file

        Raises
        ------
        SignatureError
            If it is no recording, if there cannot have been time for it, or the journal cannot be written.
        StudentIDError
            If the student's ID cannot be one.
        """
        student = student_id.normalised(student)
        recording = _read(content)
        try:
            with _alone(self._settings.journal):
                return self._entered(student, recording, content)
        except OSError as error:
            raise SignatureError(
                _("The journal {file} cannot be written: {error}. Nothing is signed without it.").format(
                    file=self._settings.journal, error=error
                )
            ) from None

    def _entered(self, student: str, recording: Recording, content: bytes) -> bytes:
        """The signature of a recording that is in the journal."""
        number, last, before = self._journal()
        samples = _samples(recording)
        if self._settings.real_time and samples in before:
            raise SignatureError(
                _(
                    "The same samples were signed before, in the name of {student}: no two runs of a bench are equal."
                ).format(student=before[samples])
            )
        now, seconds = self._clock(), float(recording.time[-1])
        passed = now - last if number else seconds
        if self._settings.real_time and 0 <= passed < seconds - _SLACK:  # a clock that was put back says nothing
            raise SignatureError(
                _(
                    "The recording is of {seconds:.1f} s, and only {passed:.1f} s have passed since the one that was "
                    "signed before: it cannot have been made at this bench."
                ).format(seconds=seconds, passed=passed)
            )
        about: dict[str, Any] = {
            "bench": self._settings.bench,
            "student": student,
            "number": number + 1,
            "signed": datetime.fromtimestamp(now, UTC).isoformat(timespec="seconds"),
            "seconds": round(seconds, 6),
            "real_time": self._settings.real_time,
        }
        made = signed_files.signed(content, about, self._key)
        entry = {**about, "time": now, "file": signed_files.digest(content), "samples": samples}
        with self._settings.journal.open("a", encoding="utf-8", newline="\n") as journal:
            journal.write(json.dumps(entry, sort_keys=True) + "\n")
        return made

    def _journal(self) -> tuple[int, float, dict[str, str]]:
        """The number of the last signature, and when it was made (s since 1970); and samples → in whose name."""
        try:
            lines = self._settings.journal.read_text(encoding="utf-8").splitlines()
            entries = [json.loads(line) for line in lines]
            before = {entry["samples"]: str(entry["student"]) for entry in entries if entry["samples"]}
            return (int(entries[-1]["number"]), float(entries[-1]["time"]), before) if entries else (0, 0.0, {})
        except FileNotFoundError:
            return 0, 0.0, {}
        except (ValueError, TypeError, KeyError) as error:
            raise SignatureError(
                _("The journal {file} is damaged: {error!r}. Put it aside for whoever looks after the bench.").format(
                    file=self._settings.journal, error=error
                )
            ) from None


def _samples(recording: Recording) -> str:
    """By which equal angles are known, whatever else a file says; "" where nothing moved."""
    angles = [np.round(recording[name], 9) + 0.0 for name in ("theta", "alpha") if name in recording]
    moved = any(np.ptp(one) > 0 for one in angles)
    return signed_files.digest(b"".join(one.astype("<f8").tobytes() for one in angles)) if moved else ""


def _read(content: bytes) -> Recording:
    """The recording in a file's content.

    Raises
    ------
    SignatureError
        If there is none.
    """
    if len(content) > MOST_BYTES:
        raise SignatureError(_("A recording of more than {most} bytes is not signed.").format(most=MOST_BYTES))
    with tempfile.TemporaryDirectory(prefix="rotflex-signing-") as folder:
        file = Path(folder, "recording.mat")
        file.write_bytes(content)
        try:
            return Recording.load(file)
        except ValueError as error:
            raise SignatureError(_("What came is no recording: {error}").format(error=error)) from None


@contextlib.contextmanager
def _alone(journal: Path) -> Iterator[None]:
    """While no other request is being signed. A lock that somebody left behind is told of."""
    lock = journal.with_name(f"{journal.name}.lock")
    until = time.monotonic() + _PATIENCE
    while True:
        try:
            os.close(os.open(lock, os.O_CREAT | os.O_EXCL | os.O_WRONLY))
            break
        except FileExistsError:
            if time.monotonic() > until:
                raise SignatureError(
                    _("Another recording is being signed, or the file {lock} was left behind: delete it then.").format(
                        lock=lock
                    )
                ) from None
            time.sleep(0.05)
    try:
        yield
    finally:
        lock.unlink()
