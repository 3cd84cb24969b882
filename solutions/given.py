"""What is given to a class that begins in the middle (``rotflex/course/starts.py``), of a bench as it really is."""

from __future__ import annotations

import numpy as np

from labcourse.answers.starts import Values
from labcourse.benches import REAL, BenchPolicy
from rotflex import design, model
from rotflex.course import starts

from . import real_benches
from .true_bench import TrueBench
from .wanted import desired_poles


def given(name: str, student: str, policy: BenchPolicy) -> Values:
    """The values of a start.

    Parameters
    ----------
    name : "stiffness" or "gain"
    student : whose bench it is; of no matter where everybody has the same
    policy : which bench each student has; of the laboratory's, the first
    """
    if policy.which == REAL:
        known = real_benches.read(policy.benches[0], real_benches.FOLDER)
        servo, joint, K_s = known.servo, known.joint, known.parameters.K_s
    else:
        bench = TrueBench(student, policy)
        servo, joint, K_s = bench.servo, bench.joint, bench.K_s
    found = dict(starts.stiffness(K_s, joint.J_l))
    if name == "gain":
        by_torque = model.state_space(servo, joint, found["2.12", "K_s"], input="torque", link_damping=0.0)
        by_voltage = model.state_space(servo, joint, found["2.12", "K_s"], link_damping=0.0)
        found |= {("2.14", matrix): np.asarray(getattr(by_torque, matrix)) for matrix in "ABCD"}
        found["3.8", "K"] = np.reshape(design.gain_by_place(by_voltage.A, by_voltage.B, desired_poles()), (1, 4))
    return found
