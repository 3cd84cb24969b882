"""What is given to a class whose release leaves out the notebook that asks for it, of a bench as it really is.

The student "" stands for all students of a release. Where no value holds for all of them, the release is refused.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from labcourse.benches import OWN, REAL, BenchPolicy
from labcourse.errors import GradingError
from labcourse.problems import Where
from rotflex import design, model
from rotflex.config import Joint, Servo

from . import real_benches
from .true_bench import TrueBench
from .wanted import desired_poles


def _parts(student: str, policy: BenchPolicy) -> tuple[Servo, Joint, float]:
    """The servo, the joint and the stiffness of a student's bench.

    Raises
    ------
    GradingError
        If a release is for several of the laboratory's benches.
    """
    if not student and len(policy.benches) > 1:
        raise GradingError(
            "Notebook 02, 03 or 06 can be left out where the class has one bench: each bench has another stiffness. "
            "Make a release for each bench, from a copy of the course."
        )
    if policy.which == REAL:
        known = real_benches.read(policy.benches[0], real_benches.FOLDER)
        return known.servo, known.joint, known.parameters.K_s
    bench = TrueBench(student, policy)
    return bench.servo, bench.joint, bench.K_s


def _of_joint(name: str, student: str, policy: BenchPolicy) -> float | None:
    """J_l or K_s (2.12); None where students have benches of their own: their sessions know both."""
    if not student and policy.which == OWN:
        return None
    _servo, joint, K_s = _parts(student, policy)
    return joint.J_l if name == "J_l" else K_s


def _model(student: str, policy: BenchPolicy, by: str) -> Any:
    """The model with the torque or the voltage as input.

    Raises
    ------
    GradingError
        If a release is for benches of students' own. There, a student's session would have to work the model out, by
        code that answers what other classes are asked.
    """
    if not student and policy.which == OWN:
        raise GradingError(
            "A model or a gain is given for one bench: to leave out notebook 03 or 06, everybody needs the same. Say "
            '[bench] which = "same" or "preset", or "real" with one bench.'
        )
    return model.state_space(*_parts(student, policy), input=by, link_damping=0.0)


def _matrix(name: str, student: str, policy: BenchPolicy) -> Any:
    return np.asarray(getattr(_model(student, policy, "torque"), name))


def _gain(student: str, policy: BenchPolicy) -> Any:
    by_voltage = _model(student, policy, "voltage")
    return np.reshape(design.gain_by_place(by_voltage.A, by_voltage.B, desired_poles()), (1, 4))


GIVEN: dict[Where, Callable[[str, BenchPolicy], Any]] = {
    **{("2.12", name): partial(_of_joint, name) for name in ("J_l", "K_s")},
    **{("2.14", name): partial(_matrix, name) for name in "ABCD"},
    ("3.8", "K"): _gain,
}
