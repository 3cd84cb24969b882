"""The recordings that a student made at a laboratory's bench, in the folder ``recordings`` beside the notebooks.

Each has a file of its own, ``003-tracking.mat``. They are handed in with the notebooks, and a graded run has them in
the bench's place. Marking never opens these files: inside the sandbox, :func:`evidence` reads them and gives bounded
plain data (``solutions/evidence.py`` reads that, strictly).
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from labcourse import files
from rotflex import hil
from rotflex.config import Joint, Servo, joint, srv02
from rotflex.errors import RecordingError
from rotflex.hil.bench import Bench
from rotflex.hil.recorder import LONGEST, file_stem
from rotflex.hil.replay import REPORTED, SETTINGS, VOLTAGE_LIMIT, RecordedRuns, described, implausible_timing, run_of
from rotflex.recording import Recording
from rotflex.unanswered import HELD, LOST, TIMING, table_of

FOLDER = "recordings"  #: beside the notebooks
ADDRESS = "recorded"  #: of the bench in which these recordings stand in the plant's place
MOST_RECORDINGS = 20  #: that count, of one student
MOST_SAMPLES = 30_001  #: of one of them: 60 s at 2 ms
CHANNELS = ("theta_ref", "theta", "alpha", "vm")  #: what marking gets to see of a recording
_DIGITS = 9  # significant digits of a sample, as marking gets it: a billionth of a radian
_LINKED = f"The folder {FOLDER} is a link, which is not followed: put the folder itself there."
_NUMBERED = re.compile(r"(\d{3,})-.*\.mat")


class RecordingsFolder:
    """A student's recordings, in a folder beside the notebooks (``beside``)."""

    def __init__(self, beside: Path) -> None:
        self.folder = beside / FOLDER

    @property
    def paths(self) -> list[Path]:
        """The recordings' files, in the order in which they were made."""
        try:
            there = [] if self.folder.is_symlink() else list(self.folder.iterdir())
        except OSError:
            there = []
        found = [(int(match[1]), path) for path in there if (match := _NUMBERED.fullmatch(path.name))]
        return [path for _number, path in sorted(found)]

    def recordings(self) -> list[Recording]:
        """Load the recordings that count, in order; print a line on each that does not."""
        found, left_out = self.load()
        for line in left_out:
            print(f"Note      {line}")
        return list(found.values())

    def load(self) -> tuple[dict[str, Recording], list[str]]:
        """Load the recordings that count, by the stem of their file and in order, and say which do not, and why.

        A file that cannot be read does not count, nor does a recording that is too long. Of more than
        ``MOST_RECORDINGS``, those that were made once more with the same settings are left out first, then the oldest.
        """
        found: dict[str, Recording] = {}
        left_out = [_LINKED] if self.folder.is_symlink() else []
        for path in self.paths:
            try:
                files.ordinary(path)
                recording = Recording.load(path)
                if _is_too_long(recording):
                    raise RecordingError(
                        f"{path.name} is longer than {LONGEST:g} s, or has more than {MOST_SAMPLES} samples."
                    )
                found[path.stem] = recording
            except RecordingError as error:
                text = str(error) if path.name in str(error) else f"{path.name}: {error}"  # of uneven time
                left_out.append(f"{text.removesuffix('.')}. It is left out.")
            except OSError as error:
                left_out.append(f"{path.name}: {error.strerror}. It is left out.")
        surplus = max(len(found) - MOST_RECORDINGS, 0)
        newest = {(described(one.metadata), run_of(one), len(one)): name for name, one in found.items()}
        dropped = sorted(found, key=lambda name: name in newest.values())[:surplus]
        if dropped:
            left_out.append(
                f"Of {len(found)} recordings, {MOST_RECORDINGS} count; left out are: {', '.join(sorted(dropped))}. "
                "Delete those that you do not need."
            )
        return {name: one for name, one in found.items() if name not in dropped}, left_out

    # --- at the bench ---------------------------------------------------------------------------------------------

    def keeping(self, bench: Bench, run: int) -> Bench:
        """Have each recording of a real bench kept here as soon as it is made, and return the bench."""
        bench.identity["run"] = run
        reported = {"servo": asdict(bench.servo), "joint": asdict(bench.joint), VOLTAGE_LIMIT: bench.v_max}

        def keep(recording: Recording) -> None:
            whole = replace(recording, metadata={**recording.metadata, REPORTED: reported})
            bench.recorder.save_whole(whole, self.keep)

        bench.recorder.on_recorded = keep
        return bench

    def keep(self, recording: Recording) -> Path:
        """Keep a recording, and print a line of it, and another where it will not count.

        Raises
        ------
        RecordingError
            If it cannot be written.
        """
        if self.folder.is_symlink():
            raise RecordingError(_LINKED)
        try:
            self.folder.mkdir(exist_ok=True)
        except OSError as error:
            raise RecordingError(f"{self.folder} cannot be made: {error.strerror}.") from None
        number = 1 + max((int(path.name.partition("-")[0]) for path in self.paths), default=0)
        path = self.folder / f"{number:03d}-{file_stem(recording)}.mat"
        recording.save(path)
        print(f"Kept      {FOLDER}/{path.name}")
        if why := implausible_timing(recording):
            print(
                f"Note      {path.name} will not count by itself: {why}. Close what else keeps this computer busy, and "
                "run it again."
            )
        if len(self.paths) > MOST_RECORDINGS or _is_too_long(recording):
            print(
                f"Note      At most {MOST_RECORDINGS} recordings count, each of at most {LONGEST:g} s: delete from the "
                f"folder {FOLDER} those that you do not need."
            )
        return path

    # --- in its place ---------------------------------------------------------------------------------------------

    def bench(self, run: int) -> Bench:
        """Return the bench of these recordings: each experiment gives its own, or says that it was not recorded."""
        recordings = self.recordings()
        return bench_of(recordings, run, *parts_of(recordings))


def _is_too_long(recording: Recording) -> bool:
    return len(recording) > MOST_SAMPLES or recording.time[-1] > LONGEST + recording.sample_time


def bench_of(recordings: Sequence[Recording], run: int, servo: Servo, arm: Joint) -> Bench:
    """Return the bench that recordings are of.

    Parameters
    ----------
    recordings : of one bench, in the order in which they were made
    run : number of the run that is asked for
    servo, arm : the bench's parts
    """
    about = table_of(recordings[-1].metadata, "bench") if recordings else {}
    identity = {**about, "uri": ADDRESS, "run": run, "clock": "simulated"}
    return hil.recorded_bench(RecordedRuns(recordings, servo.V_max, run), servo, arm, identity)


def parts_of(recordings: Sequence[Recording]) -> tuple[Servo, Joint]:
    """Return the parts that the last recording reports, or those of the data sheet if none does."""
    for recording in reversed(recordings):
        reported = recording.metadata.get(REPORTED)
        try:
            encoder, arm = reported["servo"]["encoder"], Joint(**reported["joint"])  # type: ignore[index]
            return srv02(encoder=encoder), arm
        except (KeyError, TypeError, ValueError):
            continue
    return srv02(), joint(1)


# --- for marking ------------------------------------------------------------------------------------------------------


def evidence(beside: Path) -> dict[str, Any]:
    """Read the recordings beside the notebooks as plain data, which is all that marking gets to see of them.

    A graded run calls it inside the sandbox, before any cell of the student's runs.
    """
    found, left_out = RecordingsFolder(beside).load()
    recordings = [{"file": name, **_plain(one)} for name, one in found.items()]
    return {"recordings": recordings, "left_out": left_out[:MOST_RECORDINGS]}


def _plain(recording: Recording) -> dict[str, Any]:
    """Return a recording's samples, and of its metadata what marking goes by."""
    about = recording.metadata
    bench, reported, timing = (table_of(about, name) for name in ("bench", REPORTED, TIMING))
    return {
        "experiment": about.get("experiment", ""),
        "settings": {name: about[name] for name in SETTINGS if name in about},
        "bench": bench.get("name", ""),
        "run": run_of(recording),
        VOLTAGE_LIMIT: reported.get(VOLTAGE_LIMIT, 0.0),
        TIMING: {name: timing.get(name, 0) for name in ("late", "missed")}
        | {name: timing.get(name, []) for name in (HELD, LOST)},
        "sample_time": recording.sample_time,
        "channels": {
            name: [float(f"{value:.{_DIGITS}g}") for value in recording[name].tolist()]
            for name in CHANNELS
            if name in recording
        },
    }
