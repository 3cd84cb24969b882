"""What a student's own answers and recordings can be held against each other by (``lab.reflect()``).

All of it is what students could work out from what they have recorded themselves and are told of their parts. Nothing
here knows what is right: an answer on which all others are built consistently is not asked about.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from labcourse.answers.reflection import Check
from rotflex.config import Joint, Servo
from rotflex.course.questions import CATALOGUE
from rotflex.course.reflection import derivation, design, model, recordings, responses


def checks(servo: Servo, joint: Joint, bench: Mapping[str, Any], probe_seed: int) -> list[Check]:
    """All that can be held against each other, in the order of the questions.

    Parameters
    ----------
    servo, joint : as the student is told them
    bench : identity of the student's own bench
    probe_seed : from which the inputs of functions are drawn
    """
    found = (
        *derivation.checks(servo, joint),
        *recordings.settings(bench),
        *model.checks(servo, probe_seed),
        *design.checks(servo),
        *responses.checks(servo),
    )
    order = {number: place for place, number in enumerate(CATALOGUE.everything)}
    return sorted(found, key=lambda check: order[check.about[0][0]])
