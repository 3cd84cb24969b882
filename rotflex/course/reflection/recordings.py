"""Of recordings, as they are kept with the answers: what they were made with, and what is read off them.

A kept recording has 400 points of each channel, evenly spread; frequencies of the arm and sizes of a response are in
it, the height of a voltage's short peak is not.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from labcourse.answers.json_values import thin
from labcourse.answers.reflection import Check
from rotflex.course.questions import CATALOGUE
from rotflex.course.reflection.numbers import Array
from rotflex.identification import SWEEP_BAND
from rotflex.recording import UNITS, Recording
from rotflex.units import HZ

Kept = Mapping[str, Any]  # a recording as the answers have it

_ZEROS = 16  # times as many points, so that a peak is not held to the grid
_SAME_BENCH = ("seed", "preset")  # what tells virtual benches apart


def settings(bench: Mapping[str, Any]) -> tuple[Check, ...]:
    """Whether recordings were made as the questions ask, on the student's own bench.

    Parameters
    ----------
    bench : identity of the student's own
    """

    def of(question: str, name: str, wanted: tuple[tuple[str, str], ...]) -> Check:
        return Check(((question, name),), lambda kept: _made_otherwise(kept, wanted, bench))

    return tuple(
        of(question.number, part.name, part.settings)
        for question in CATALOGUE.questions.values()
        for part in question.parts
        if part.kind == "recording"
    )


def _made_otherwise(kept: Kept, wanted: tuple[tuple[str, str], ...], bench: Mapping[str, Any]) -> str:
    said = kept["metadata"]
    if said.get("drive") == "voltage":
        return "The motor had the sweep as a voltage here. Did you mean the one in which the servo follows the sweep?"
    for name, value in wanted:
        if said.get(name, value) != value:
            return (
                f"This recording's {name} is {str(said[name])[:40]!r}, and the question asks for {value!r}. Is "
                "it the one?"
            )
    made_on = said.get("bench")
    if isinstance(made_on, Mapping) and any(made_on.get(key) != bench.get(key) for key in _SAME_BENCH):
        return (
            "This was recorded on another bench than yours (a practice bench, or somebody else's). Is there one that "
            "you made with lab.bench()?"
        )
    return ""


def channel(kept: Kept, name: str) -> Array:
    """The kept points of a channel.

    Raises
    ------
    LookupError
        If it was not recorded.
    """
    found: Array = kept["channels"][name]["values"]
    return found


def recording(kept: Kept) -> Recording:
    """A kept recording as one of fewer samples."""
    time = kept["sample_time"] * thin_indices(kept)
    step = float(time[-1]) / (time.size - 1)
    channels = {name: one["values"] for name, one in kept["channels"].items() if name in UNITS}
    return Recording.of(step * np.arange(time.size), dict(kept["metadata"]), **channels)


def thin_indices(kept: Kept) -> Array:
    """Which samples were kept."""
    return thin(kept["n"], next(iter(kept["channels"].values()))["values"].size)


def sweep_spectrum(kept: Kept) -> tuple[Array, Array]:
    """Frequencies (rad/s) that the sweep goes through, and the amplitude of alpha there, of the largest."""
    alpha = channel(kept, "alpha")
    dt = kept["sample_time"] * (kept["n"] - 1) / (alpha.size - 1)
    f = np.fft.rfftfreq(_ZEROS * alpha.size, dt)
    amplitude = np.abs(np.fft.rfft(alpha - alpha.mean(), _ZEROS * alpha.size))
    swept = (f >= SWEEP_BAND[0]) & (f <= SWEEP_BAND[1])
    return HZ * f[swept], amplitude[swept] / amplitude[swept].max()
