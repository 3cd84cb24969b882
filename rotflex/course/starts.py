"""Where a class may begin in the middle (the workbook's ``CONTROL_TYPE = 'INSTRUCTOR'``): what is given and skipped.

The stiffness of a student's own virtual bench is known where the bench is drawn, on the student's machine. Model and
gain are not: what works them out is what other classes are asked for, and no student gets it. They are given as
numbers, to classes in which everybody has the same bench.
"""

from __future__ import annotations

from typing import Any

from labcourse.answers.starts import Start, Values
from rotflex.hil.student_benches import student_bench

DIGITS = 4  #: to which a stiffness is given: more than any sweep tells

_MODELING = ("01_modeling_prelab", "02_finding_stiffness")
_DESIGN = ("03_model_validation", "04_modeling_results", "05_control_prelab", "06_control_design")


def stiffness(K_s: float, J_l: float) -> Values:
    """What is given of a bench's stiffness: answer 2.12, from K_s (N·m/rad) and J_l (kg·m²)."""
    return {("2.12", "J_l"): J_l, ("2.12", "K_s"): float(f"{K_s:.{DIGITS}g}")}


def _of_own_bench(lab: Any) -> Values:
    return stiffness(student_bench(lab.seed, draw=lab.policy.draw).parameters.K_s, lab.joint.J_l)


STARTS = (
    Start(
        "stiffness",
        (("2.12", "J_l"), ("2.12", "K_s")),
        _MODELING,
        "the stiffness of your joint, and the inertia of your link",
        _of_own_bench,
    ),
    Start(
        "gain",
        (
            *(("2.12", "J_l"), ("2.12", "K_s")),
            *(("2.14", name) for name in "ABCD"),
            ("3.8", "K"),
        ),
        (*_MODELING, *_DESIGN),
        "the model of your bench, driven by the torque, and the gain",
    ),
)
