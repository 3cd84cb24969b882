"""A student's own bench as it really is, for comparison."""

from __future__ import annotations

import math
from functools import cached_property

from numpy.typing import ArrayLike

from rotflex import experiments, hil
from rotflex.config import Joint, Servo, joint, srv02
from rotflex.hil.draw import student_bench, student_seed
from rotflex.recording import Recording


class TrueBench:
    """What ``solutions/key.py`` compares with.

    Parameters
    ----------
    student : the ID from which the bench is drawn

    Attributes
    ----------
    servo, joint : the parts as the student is told them
    K_s : the stiffness that the bench really has, N·m/rad
    """

    def __init__(self, student: str) -> None:
        self._seed = student_seed(student)
        spec = student_bench(self._seed)
        self.servo: Servo = srv02()
        self.joint: Joint = joint(spec.arm_position)
        self.K_s = spec.parameters.K_s
        self._tracked: dict[tuple[tuple[float, ...], str], Recording] = {}

    @property
    def J_l(self) -> float:
        """Moment of inertia of the link, kg·m²."""
        return self.joint.J_l

    @property
    def omega_n(self) -> float:
        """Natural frequency of the link, rad/s."""
        return math.sqrt(self.K_s / self.J_l)

    @cached_property
    def sweep(self) -> Recording:
        """The sweep of question 2.9, run again: the virtual bench does the same every time."""
        with self._open() as bench:
            return experiments.sweep(bench, progress=False)

    def tracking(self, K: tuple[float, ...], feedback: str) -> Recording:
        """State feedback with a gain, run again (3.13, 3.15)."""
        if (K, feedback) not in self._tracked:
            with self._open() as bench:
                self._tracked[K, feedback] = experiments.tracking(bench, K, feedback, progress=False)
        return self._tracked[K, feedback]

    def validation(self, A: ArrayLike, B: ArrayLike, signal: str) -> Recording:
        """The validation with a model, run again (2.15)."""
        with self._open() as bench:
            return experiments.validation(bench, A, B, signal, progress=False)

    def _open(self) -> hil.Bench:
        return hil.open("virtual", seed=self._seed)
