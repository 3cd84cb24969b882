"""What a student hands in of a laboratory's bench: which bench each recording names, and whether it can be of that one.

What comes here is a claim. The files were read in the sandbox, where the student's own code runs, too
(:func:`rotflex.course.recordings_folder.evidence`); plain data came back, and is read strictly and within bounds.
Whoever makes up a recording well is believed: ``docs/real_bench_marks.md`` says so.
"""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labcourse.answers.json_values import clean, read_dict, read_list, read_number, read_text, read_vector
from labcourse.errors import AnswerError
from labcourse.problems import Code, Problem, Reason
from rotflex.course import plausible
from rotflex.course.recordings_folder import CHANNELS, MOST_RECORDINGS, MOST_SAMPLES
from rotflex.errors import RotflexError
from rotflex.hil.bench_file import LONGEST_NAME
from rotflex.hil.recorder import LONGEST
from rotflex.hil.replay import REPORTED, SETTINGS, VOLTAGE_LIMIT
from rotflex.recording import Recording
from rotflex.unanswered import HELD, LOST, MOST_NOTED, TIMING

from .real_benches import KnownBench

_FILE = re.compile(r"\d{3,9}-[^/\\\n]*")  # the stem of a file's name; no path
_LONGEST_FILE = 100  # characters of that
_ENTRIES = {"file", "experiment", "settings", "bench", "run", VOLTAGE_LIMIT, TIMING, "sample_time", "channels"}
_NEEDED = {"theta", "alpha", "vm"}
_LONGEST_TEXT = 40  # characters of a setting
_LONGEST_LINE = 600  # characters on what the reader left out
_MOST_NUMBERS = 16  # of a setting; a gain has four
_MOST_RUNS = 10**6  # numbers of runs
#: How many of these signs there may be, so that no more is built of it than of 20 recordings: of each, 4 objects,
#: 7 lists and those of its stretches, and the samples; and some more, as lines of text have them, too.
_MOST = {
    b"{": 10 * MOST_RECORDINGS,
    b"[": MOST_RECORDINGS * (20 + 2 * MOST_NOTED),
    b",": MOST_RECORDINGS * (len(CHANNELS) * MOST_SAMPLES + 1000),
}
_FASTEST, _SLOWEST = 1e-4, 0.1  # s, of a sample time
_LARGEST = 1e6  # rad and V: no bench gives it, and its square is a number still


@dataclass
class Evidence:
    """What was found.

    Attributes
    ----------
    bench : at which the recordings were made; None where none names a bench of the course's
    recordings : those that count, in the order in which they were made
    counted : their names
    problems, notes : what student and instructor should, or may want to, know
    doubted : whether a recording was left out that cannot be of its bench, or names none
    """

    bench: KnownBench | None = None
    recordings: list[Recording] = field(default_factory=list)
    counted: list[str] = field(default_factory=list)
    problems: list[Reason] = field(default_factory=list)
    notes: list[Reason] = field(default_factory=list)
    doubted: bool = False

    def doubt(self, name: str, why: str) -> None:
        """Not to count a recording, and to say why."""
        self.doubted = True
        self.problems.append(Problem.of(Code.DOUBTED_BY_COURSE, name, why=why))


def examine(benches: Sequence[KnownBench], data: bytes) -> Evidence:
    """Look at all recordings of a hand-in.

    Parameters
    ----------
    benches : of the course's
    data : what the sandbox gave back of the recordings, JSON; nothing in it is trusted
    """
    found = Evidence()
    by_name = {bench.name: bench for bench in benches}
    named = []
    for name, recording in _read(data, found):
        said = recording.metadata["bench"]["name"]
        if said in by_name:
            named.append((name, recording, by_name[said]))
        else:
            at = (
                f"it says that it was made at the bench {said!r}"
                if said
                else "it does not say at which bench it was made"
            )
            found.doubt(name, f"{at}, and the course's benches are {', '.join(by_name)}")
    if not named:
        found.problems.append(
            "No recording could be read that names a bench of the course's: what was measured is for a person."
        )
        return found
    most = Counter(bench.name for _name, _recording, bench in named).most_common(1)[0][0]
    found.bench = by_name[most]
    for name, recording, bench in named:
        if bench is found.bench:
            doubts = _doubts(recording, bench)
        else:
            doubts = f"it is of the bench {bench.name}, and most are of {most}"
        if doubts:
            found.doubt(name, doubts)
        else:
            found.recordings.append(recording)
            found.counted.append(name)
    number = len(found.counted)
    found.notes.append(
        f"Marked with the bench {most} and {number} recording{'' if number == 1 else 's'} of it: "
        f"{', '.join(found.counted) or 'none counts'}."
    )
    return found


def _doubts(recording: Recording, bench: KnownBench) -> str:
    try:
        with np.errstate(all="ignore"):
            return "; ".join(plausible.doubts(recording, bench.servo, bench.parameters))
    except (ArithmeticError, ValueError, RotflexError) as error:
        return f"it cannot be compared with its bench ({type(error).__name__}: {str(error)[:_LONGEST_TEXT]})"


# --- plain data, strictly ---------------------------------------------------------------------------------------------


def _read(data: bytes, found: Evidence) -> Iterator[tuple[str, Recording]]:
    """Give each recording, by the name of its file; one that is not as it should be is named in the problems."""
    try:
        if any(data.count(sign) > most for sign, most in _MOST.items()):
            raise AnswerError("there is more in it than in the recordings that count.")
        content = read_dict("it", json.loads(data), {"recordings", "left_out"})
        items = read_list("recordings", content["recordings"], longest=MOST_RECORDINGS)
        lines = read_list("left_out", content["left_out"], longest=MOST_RECORDINGS)
    except (ValueError, RecursionError, MemoryError) as error:  # an AnswerError is a ValueError
        why = str(error)[:_LONGEST_LINE] if isinstance(error, AnswerError) else type(error).__name__
        if data:
            found.problems.append(f"What the run gave back of the recordings is not as it should be: {why}")
        return
    for line in lines:
        shown = " ".join(clean(str(line)[:_LONGEST_LINE]).split())
        found.problems.append(f"The run says of the recordings: {shown}")
    for place, item in enumerate(items, 1):
        try:
            yield _recording(item)
        except (AnswerError, RotflexError) as error:
            found.problems.append(f"Recording {place} of the run is not as it should be, and does not count: {error}")


def _recording(item: Any) -> tuple[str, Recording]:
    """Read one recording, and the name of its file.

    Raises
    ------
    RotflexError
        If something in it is not as it should be.
    """
    read_dict("it", item, _ENTRIES)
    name = read_text("file", item["file"], _LONGEST_FILE)
    if not _FILE.fullmatch(name):
        raise AnswerError("file should be the name of a recording, as 003-tracking.")
    sample_time = read_number("sample_time", item["sample_time"])
    if not _FASTEST <= sample_time <= _SLOWEST:
        raise AnswerError(f"sample_time should be from {_FASTEST:g} to {_SLOWEST:g} s.")
    channels = item["channels"]
    if not isinstance(channels, dict) or not _NEEDED <= channels.keys() <= set(CHANNELS):
        raise AnswerError(f"channels should be some of {', '.join(CHANNELS)}, theta, alpha and vm among them.")
    longest = min(MOST_SAMPLES, int(LONGEST / sample_time) + 2)
    read = {name: _samples(name, values, longest) for name, values in channels.items()}
    time = np.arange(read["vm"].size) * sample_time
    return name, Recording.of(time, _metadata(item), **read)


def _samples(name: str, values: Any, longest: int) -> NDArray[np.float64]:
    samples = read_vector(name, values, 2, longest)
    if np.abs(samples).max() > _LARGEST:
        raise AnswerError(f"{name} should be within {_LARGEST:g}.")
    return samples


def _metadata(item: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a recording says of itself, so far as marking goes by it."""
    settings = item["settings"]
    if not isinstance(settings, dict) or not settings.keys() <= set(SETTINGS):
        raise AnswerError(f"settings should be some of {', '.join(SETTINGS)}.")
    timing = read_dict(TIMING, item[TIMING], {"late", "missed", HELD, LOST})
    limit = read_number(VOLTAGE_LIMIT, item[VOLTAGE_LIMIT])
    return {
        **{name: _setting(name, value) for name, value in settings.items()},
        "experiment": read_text("experiment", item["experiment"], _LONGEST_TEXT),
        "bench": {
            "name": read_text("bench", item["bench"], LONGEST_NAME),
            "run": _count("run", item["run"], _MOST_RUNS),
        },
        REPORTED: {VOLTAGE_LIMIT: limit},  # 0 for none
        TIMING: {name: _count(name, timing[name], MOST_SAMPLES) for name in ("late", "missed")}
        | {name: [_stretch(one) for one in read_list(name, timing[name], 0, MOST_NOTED)] for name in (HELD, LOST)},
    }


def _setting(name: str, value: Any) -> str | float | list[float]:
    if isinstance(value, str):
        return read_text(name, value, _LONGEST_TEXT)
    if isinstance(value, list):
        return [read_number(name, one) for one in read_list(name, value, 0, _MOST_NUMBERS)]
    return read_number(name, value)


def _stretch(item: Any) -> list[int]:
    return [_count("a stretch of samples", one, MOST_SAMPLES) for one in read_list("a stretch of samples", item, 2, 2)]


def _count(name: str, value: Any, most: int) -> int:
    if type(value) is not int or not 0 <= value <= most:
        raise AnswerError(f"{name} should be a whole number, at most {most}.")
    return value
