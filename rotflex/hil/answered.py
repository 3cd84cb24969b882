"""Which voltages of a recording its controller set: not those of samples that came late, or never.

A recording says itself which those were. How many they may be is bounded, so that nobody can declare a run as held.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from rotflex.hil.halt import WATCHDOG_TIMEOUT
from rotflex.recording import Recording
from rotflex.unanswered import HELD, LOST, MOST_NOTED, TIMING, mask, stretches

MOST = 0.05  #: of a run; on a computer that was kept busy on purpose 0.006 of a minute's samples came late
_SAME = 5e-3  # of the recorded voltage (RMS); gains as a report prints them, with four digits, make a thirtieth of it
_SAME_VOLTS = 1e-3  # V, where hardly any voltage was recorded
_ROUNDING = 2  # samples: where a pause begins and ends within a period

Vector = NDArray[np.float64]


def why_not(recording: Recording) -> str:
    """Why what a recording says of samples that were not answered cannot be so, or is too much; "" where it is fine."""
    timing = recording.metadata.get(TIMING)
    if not isinstance(timing, Mapping):
        return ""
    held, samples = stretches(recording.metadata, HELD), len(recording)
    counted = [value for name in ("late", "missed") if type(value := timing.get(name)) is int]
    declared = sum(count for _first, count in held)
    if (timing.get(HELD, []) and not held) or declared > sum(counted) + len(held):
        return "what it says of samples that were not answered does not go together"
    if sum(counted) > declared and len(held) >= MOST_NOTED:
        return f"the program paused more than {MOST_NOTED} times in it"
    pause = round(WATCHDOG_TIMEOUT / recording.sample_time) + _ROUNDING
    longest = max((count for _first, count in held), default=0)
    if longest > pause:
        return (
            f"{longest} samples in a row are said not to have been answered, where the watchdog ends a run after "
            f"{pause}"
        )
    # A short run may have one whole pause.
    if declared > max(MOST * samples, pause):
        return f"{declared / samples:.0%} of its samples were not answered in time, and {MOST:.0%} may be"
    return ""


def lost(recording: Recording) -> NDArray[np.bool_]:
    """Which of a recording's samples (n,) never came, and have angles between those of their neighbours."""
    if why_not(recording):
        return np.zeros(len(recording), dtype=bool)
    held = mask(stretches(recording.metadata, HELD), len(recording))
    return held & mask(stretches(recording.metadata, LOST), len(recording))


def apart(recording: Recording, volts: Vector) -> Vector:
    """How far what a controller sets, fed with the recorded angles, is from what was recorded, V (samples,).

    Where a sample was not answered, what counts is what the motor had then: the voltage of the sample before the pause,
    or the answer to the one with which it began, where that came late.

    Parameters
    ----------
    recording : with vm, and at least as long as ``volts``
    volts : (samples,), what the controller sets, V
    """
    recorded = recording["vm"][: volts.size]
    difference: Vector = np.abs(volts - recorded)
    if why_not(recording):
        return difference
    for first, count in stretches(recording.metadata, HELD):
        if first >= volts.size:
            break
        part = slice(first, first + count)
        before = recorded[first - 1] if first else 0.0
        difference[part] = np.minimum(np.abs(recorded[part] - before), np.abs(recorded[part] - volts[first]))
    return difference


def is_same(recorded: Vector, apart: Vector) -> bool:
    """Whether voltages that are so far from those recorded (both (samples,), V) are the same controller's."""
    return _rms(apart) <= max(_SAME * _rms(recorded), _SAME_VOLTS)


def _rms(values: Vector) -> float:
    return float(np.sqrt(np.mean(values**2)))
