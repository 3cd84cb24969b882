"""What a student's own answers and recordings can be compared by (``lab.reflect()``).

All of it is what students could work out from what they have recorded themselves and are told of their parts. Nothing
here knows what is right: an answer on which all others are built consistently is not asked about.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

from labcourse.answers.reflection import Comparison
from rotflex.config import Joint, Servo
from rotflex.course.questions import CATALOGUE
from rotflex.course.reflection.common import StoredRecording
from rotflex.course.reflection.control import control_checks
from rotflex.course.reflection.modeling import modeling_checks

_SAME_BENCH = ("seed", "preset")  # what tells virtual benches apart


def checks(servo: Servo, joint: Joint, bench: Mapping[str, Any], probe_seed: int) -> list[Comparison]:
    """Return all checks, in the order of the questions.

    Parameters
    ----------
    servo, joint : as the student is told them
    bench : identity of the student's own bench
    probe_seed : from which the inputs of functions are drawn
    """
    recorded = [
        Comparison(((question.number, part.name),), partial(_on_another_bench, bench=bench))
        for question in CATALOGUE.questions.values()
        for part in question.parts
        if part.kind == "recording"
    ]
    order = {number: place for place, number in enumerate(CATALOGUE.everything)}
    found = (*recorded, *modeling_checks(servo, joint, probe_seed), *control_checks(servo))
    return sorted(found, key=lambda check: order[check.about[0][0]])


def _on_another_bench(stored: StoredRecording, *, bench: Mapping[str, Any]) -> str | None:
    made_on = stored["metadata"].get("bench")
    if isinstance(made_on, Mapping) and any(made_on.get(key) != bench.get(key) for key in _SAME_BENCH):
        return (
            "This recording is from another bench (a practice bench, or the bench of another student). Do you have a "
            "recording from your own bench, lab.bench()?"
        )
    return None
