"""What can be predicted of this course's experiments, and what a recording shows of it. Never marked."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from labcourse.answers.parts import Predictable, choice, number
from rotflex.units import DEG

Kept = Mapping[str, Any]  # a recording as the answers have it: 400 points of each channel

_ALIKE = 0.1  # relative: swings whose times differ by less are "about as long"
_AS_FAR = 0.03  # relative: so much a bench and its model differ by a count or two and the friction of a day
_SWINGS = 1 * DEG  # rad: a deflection beyond this is seen


def _values(kept: Kept, name: str) -> Any:
    return kept["channels"][name]["values"]


def _time_of_largest_swing(sweep: Kept) -> float:
    alpha = np.abs(_values(sweep, "alpha"))
    duration = (sweep["n"] - 1) * sweep["sample_time"]
    return float(duration * np.argmax(alpha) / (alpha.size - 1))


def _compared(ratio: float, room: float, more: str, same: str, less: str) -> str:
    if abs(ratio - 1) <= room:
        return same
    return more if ratio > 1 else less


def _turns_farther(validation: Kept) -> str:
    # All the way, there and back: friction that differs between the directions makes a bench drift.
    bench, model = (float(np.abs(np.diff(_values(validation, name))).sum()) for name in ("theta", "theta_model"))
    return _compared(bench / model, _AS_FAR, "bench", "about the same", "model")


def _largest_deflection(response: Kept) -> float:
    return float(np.abs(_values(response, "alpha")).max() / DEG)


def _arm_swings(partial: Kept, full: Kept) -> str:
    longer, shorter = (float(np.mean(np.abs(_values(one, "alpha")) > _SWINGS)) for one in (partial, full))
    return _compared(longer / shorter, _ALIKE, "longer", "about as long", "less long")


_WHEN = "The sweep goes from 1 Hz to 5 Hz in 15 s. When will the arm swing widest?"
_TURNS_FARTHER = (
    f"Your bench and your model get the same voltage (up to {_AS_FAR:.0%} of difference is about the same). "
    "Which servo turns farther?"
)
_LARGEST = "Your simulation gave a largest deflection of the arm. What will it be on your bench?"
_HOW_LONG = "Without feedback of the arm: how long will it swing after each turn, compared with full feedback?"

_ALL = (
    Predictable(
        number("time_of_largest_swing", "s", (0.0, 15.0), "", _WHEN, points=0),
        (("2.9", "sweep"),),
        _time_of_largest_swing,
        "Which frequency did the sweep have then? Why does the arm swing widest there, in one sentence?",
    ),
    Predictable(
        choice("turns_farther", ("bench", "model", "about the same"), "", _TURNS_FARTHER, points=0),
        (("2.15", "validation"),),
        _turns_farther,
        "What does the bench have that is missing in the model, and where do you see it, in one sentence?",
    ),
    Predictable(
        number("largest_deflection_deg", "deg", (2.0, 60.0), "", _LARGEST, points=0),
        (("3.13", "response"),),
        _largest_deflection,
        "Why is it larger or smaller than you expected, in one sentence?",
    ),
    Predictable(
        choice("arm_swings", ("longer", "about as long", "less long"), "", _HOW_LONG, points=0),
        (("3.15", "response"), ("3.13", "response")),
        _arm_swings,
        "What took the energy out of the swing with full feedback, and what does it now, in one sentence?",
    ),
)
#: Question → what is predicted there: what its own recording shows, which comes first in ``found_in``.
PREDICTIONS = {one.found_in[0][0]: (one,) for one in _ALL}
