"""The recordings that a student made at a laboratory's bench, in the folder ``recordings`` beside the notebooks.

Each has a file of its own, ``003-tracking.mat``, and beside it what the bench's machine says of it, where that signs
(``003-tracking.mat.signed``). They are handed in with the notebooks, and a graded run has them in the bench's place.
"""

from __future__ import annotations

import os
import re
import shlex
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from rotflex.config import Joint, Servo, joint, srv02
from rotflex.courseware import files, signed_files
from rotflex.courseware.messages import _
from rotflex.errors import RecordingError
from rotflex.hil import waiting
from rotflex.hil.answered import why_not
from rotflex.hil.bench import Bench, Limits
from rotflex.hil.clock import SimulatedClock
from rotflex.hil.recorded_runs import TOLD, VOLTAGE_LIMIT, RecordedRuns
from rotflex.hil.virtual import VirtualBoard
from rotflex.recording import Recording

FOLDER = "recordings"  #: beside the notebooks
SIGNER = "ROTFLEX_SIGNER"  #: environment variable: the command that starts the signing program at a bench
ADDRESS = "recorded"  #: of the bench whose plant these recordings are
_PATIENCE = 60.0  # s for a signature
_NUMBERED = re.compile(r"(\d{3,})-.*\.mat")


class RecordingsFolder:
    """A student's recordings.

    Parameters
    ----------
    beside : the folder of the notebooks
    student : whose they are
    signer : the command that starts the signing program; as the environment says unless given, "" for none
    """

    def __init__(self, beside: Path, student: str, signer: str | None = None) -> None:
        self.folder = beside / FOLDER
        self._student = student
        self._signer = os.environ.get(SIGNER, "") if signer is None else signer

    @property
    def paths(self) -> list[Path]:
        """The recordings' files, in the order in which they were made."""
        found = [(int(match[1]), path) for path in self._files() if (match := _NUMBERED.fullmatch(path.name))]
        return [path for _number, path in sorted(found)]

    def _files(self) -> list[Path]:
        try:
            return list(self.folder.iterdir())
        except OSError:
            return []

    def recordings(self) -> list[Recording]:
        """All of them, in order; a file that cannot be read is told by a line, and left out."""
        found = []
        for path in self.paths:
            try:
                found.append(Recording.load(path))
            except RecordingError as error:
                print(_("Note      {error} It is left out.").format(error=error))
        return found

    # --- at the bench ---------------------------------------------------------------------------------------------

    def keeping(self, bench: Bench, run: int) -> Bench:
        """A real bench, each of whose recordings is kept here as soon as it is made."""
        bench.identity["run"] = run
        limit = min(bench.limits.voltage, bench.servo.V_max)
        told = {"servo": asdict(bench.servo), "joint": asdict(bench.joint), VOLTAGE_LIMIT: limit}

        def keep(recording: Recording) -> None:
            try:
                self.keep(recording, told)
            except RecordingError as error:
                bench.kept = replace(recording, metadata={**recording.metadata, TOLD: told})
                where = waiting.put_by(bench.kept, bench.safety.folder)
                raise RecordingError(f"{error} {where}") from error

        bench.on_recorded = keep
        return bench

    def keep(self, recording: Recording, told: Mapping[str, Any]) -> Path:
        """Keep a recording, have it signed where there is a signer, and print a line of it.

        Where it cannot be signed it is kept without a signature, and the line says why: a person then looks at it.

        Parameters
        ----------
        recording : as the bench gave it
        told : the parts on the bench and its limit, as plain data

        Raises
        ------
        RecordingError
            If it cannot be written.
        """
        try:
            self.folder.mkdir(exist_ok=True)
        except OSError as error:
            raise RecordingError(
                _("{folder} cannot be made: {why}.").format(folder=self.folder, why=error.strerror)
            ) from None
        number = 1 + max((int(path.name.partition("-")[0]) for path in self.paths), default=0)
        name = re.sub(r"\W+", "-", str(recording.metadata.get("experiment", "run"))).strip("-") or "run"
        path = self.folder / f"{number:03d}-{name}.mat"
        replace(recording, metadata={**recording.metadata, TOLD: dict(told)}).save(path)
        print(_("Kept      {folder}/{name}: {how}").format(folder=FOLDER, name=path.name, how=self._signed(path)))
        why = why_not(recording)
        if why:
            print(
                _(
                    "Note      {name} will not count by itself: {why}. Close what else keeps this computer busy, and "
                    "run it again."
                ).format(name=path.name, why=why)
            )
        return path

    def _signed(self, path: Path) -> str:
        """Have a file signed, and how that ended."""
        if not self._signer.strip():
            return _("not signed, as this machine signs nothing")
        try:
            command, asked = started(self._signer), signed_files.request(self._student, path.read_bytes())
            done = subprocess.run(command, input=asked, capture_output=True, timeout=_PATIENCE, check=False)
        except ValueError as error:
            return _("not signed: {variable} is no command ({why})").format(variable=SIGNER, why=error)
        except (OSError, subprocess.TimeoutExpired) as error:
            return _("not signed: {why}").format(why=error)
        if done.returncode != 0 or not done.stdout:
            return _("not signed: {why}").format(why=done.stderr.decode(errors="replace").strip()[-500:])
        try:
            files.write(path.with_name(path.name + signed_files.ENDING), done.stdout)
        except OSError as error:
            return _("not signed: {why}").format(why=error)
        return _("signed")

    # --- in its place ---------------------------------------------------------------------------------------------

    def bench(self, run: int) -> Bench:
        """The bench that these recordings are of: each experiment gives its own, or says that it was not recorded."""
        return bench_of(self.recordings(), run)


def started(command: str, system: str = os.name) -> str | list[str]:
    """A command as a program is started by it: Windows takes the line as it is, and all others its words.

    Raises
    ------
    ValueError
        If it has one quote without the other.
    """
    return command if system == "nt" else shlex.split(command)


def bench_of(recordings: Sequence[Recording], run: int) -> Bench:
    """The bench that recordings are of, in the order in which they were made.

    Parameters
    ----------
    recordings : of one bench
    run : number of the run that is asked for
    """
    servo, arm = parts_of(recordings)
    runs = RecordedRuns(recordings, servo.V_max, run)
    about = recordings[-1].metadata.get("bench") if recordings else None
    identity = {**(about if isinstance(about, Mapping) else {}), "uri": ADDRESS, "run": run}
    return Bench(
        connect=lambda: VirtualBoard(runs, servo, clock=SimulatedClock()),
        servo=servo,
        joint=arm,
        identity={**identity, "clock": "simulated"},
        limits=Limits(theta=float("inf"), alpha=float("inf")),  # there is nothing to come to harm
        recorded=runs,
    )


def parts_of(recordings: Sequence[Recording]) -> tuple[Servo, Joint]:
    """The parts as the last recording says that they were told; those of the data sheet where none does."""
    for recording in reversed(recordings):
        told = recording.metadata.get(TOLD)
        try:
            encoder, arm = told["servo"]["encoder"], Joint(**told["joint"])  # type: ignore[index]
            return srv02(encoder=encoder), arm
        except (KeyError, TypeError, ValueError):
            continue
    return srv02(), joint(1)
