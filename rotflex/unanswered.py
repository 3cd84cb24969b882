"""Samples of a run that were not answered, as its recording says: the program had paused, or the sample never came.

In a recording's metadata, under ``timing``, ``held`` are the samples at which the motor had an older voltage than the
controller's answer to them, and ``lost`` those among them that never came, whose angles lie on the line between their
neighbours. Both are lists of stretches, each the number of its first sample and how many it has.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

TIMING, HELD, LOST = "timing", "held", "lost"
MOST_NOTED = 100  #: stretches; more would make a recording's metadata too long to be handed in
DRIFT = 2e-3  #: of the time; where the board's clock differs by more from the computer's, a run says so

Stretch = tuple[int, int]


def table_of(metadata: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    """Return a table of a recording's metadata, such as ``timing`` or ``bench``; an empty one where there is none."""
    table = metadata.get(name)
    return table if isinstance(table, Mapping) else {}


def drift_of(metadata: Mapping[str, Any]) -> float:
    """By how much of the time the board's clock was slower than the computer's; 0 where the metadata do not say."""
    drift = table_of(metadata, TIMING).get("drift")
    return drift if isinstance(drift, float) and abs(drift) < 1 else 0.0


def of_clock(drift: float) -> str:
    """By how much of the time the board's clock is slower (or, below 0, faster) than the computer's."""
    return f"The board's clock is {abs(drift):.3%} {'slower' if drift > 0 else 'faster'} than the computer's."


def counted(metadata: Mapping[str, Any]) -> tuple[int, int]:
    """Return how many samples came late and how many never; 0 where the metadata do not say."""
    counted = map(table_of(metadata, TIMING).get, ("late", "missed"))
    late, missed = (value if type(value) is int and value > 0 else 0 for value in counted)
    return late, missed


def stretches(metadata: Mapping[str, Any], name: str) -> list[Stretch]:
    """Those of a kind, in order; none where the metadata say nothing that can be understood."""
    noted, found = table_of(metadata, TIMING).get(name), []
    if not isinstance(noted, list | tuple):
        return []
    for one in noted:
        if not isinstance(one, list | tuple) or len(one) != 2 or not all(type(value) is int for value in one):
            return []
        first, count = one
        if first < 0 or count < 1:
            return []
        found.append((first, count))
    return sorted(found)


def mask(spans: list[Stretch], samples: int) -> NDArray[np.bool_]:
    """Return which of so many samples are in one of the stretches (samples,)."""
    inside = np.zeros(samples, dtype=bool)
    for first, count in spans:
        inside[first : first + count] = True
    return inside


def cut(metadata: Mapping[str, Any], first: int, samples: int) -> dict[str, Any]:
    """The metadata of a part of a recording: so many samples from one on.

    Late and lost samples of the part are counted anew. Where not all stretches are noted, the counts stay: there are no
    more.
    """
    timing = dict(table_of(metadata, TIMING))
    all_noted = 0 < len(stretches(metadata, HELD)) < MOST_NOTED
    for name in timing.keys() & {HELD, LOST}:
        ends = [
            (max(begin - first, 0), min(begin - first + count, samples)) for begin, count in stretches(metadata, name)
        ]
        timing[name] = [[begin, end - begin] for begin, end in ends if end > begin]
    if all_noted and "late" in timing:  # what is held and not lost came late, but for a sample before each pause
        held, lost = (sum(count for _first, count in timing.get(name, ())) for name in (HELD, LOST))
        timing |= {"late": min(counted(metadata)[0], held - lost), "missed": lost}
    return {**metadata, TIMING: timing} if timing else dict(metadata)


def resampled(metadata: Mapping[str, Any], ratio: float) -> dict[str, Any]:
    """Return the metadata of a recording with ``ratio`` times as many samples: counts in proportion, no stretches."""
    timing = {name: value for name, value in table_of(metadata, TIMING).items() if name not in (HELD, LOST)}
    if timing:
        timing |= dict(zip(("late", "missed"), (math.ceil(count * ratio) for count in counted(metadata)), strict=True))
    return {**metadata, TIMING: timing} if timing else dict(metadata)
