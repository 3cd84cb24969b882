"""A student's own bench as it really is, for comparison."""

from __future__ import annotations

import contextlib
import math
import pickle
from collections.abc import Iterator
from functools import cached_property

import control
import numpy as np
from numpy.typing import ArrayLike

from labcourse.benches import PRESET, THEIR_OWN, BenchPolicy
from rotflex import experiments, hil
from rotflex.config import Joint, Servo, srv02
from rotflex.controller import Controller
from rotflex.course import spare_design
from rotflex.errors import RotflexError
from rotflex.hil.student_benches import DRAW, FIRST_RUN, preset, student_bench, student_seed
from rotflex.recording import Recording
from rotflex.signals import smooth_square_wave, time_axis
from rotflex.simulation import closed_loop
from rotflex.specifications import AMPLITUDE, DURATION, FREQUENCY, LIMITS, RATE, SAMPLE_TIME


class TrueBench:
    """What ``solutions/key.py`` compares with.

    Parameters
    ----------
    student : the ID from which the bench is drawn
    policy : which bench each student has

    Attributes
    ----------
    servo, joint : the parts as the student is told them
    K_s : the stiffness that the bench really has, N·m/rad: the one that goes with the joint's stated moment of inertia,
        should a preset's own be another
    """

    def __init__(self, student: str, policy: BenchPolicy = THEIR_OWN) -> None:
        self._seed, self._draw = policy.seed_for(student, student_seed), policy.draw or DRAW
        self._preset = policy.preset if policy.which == PRESET else None
        spec = student_bench(self._seed, draw=self._draw) if self._preset is None else preset(self._preset)
        self.servo: Servo = srv02()
        self.joint: Joint = spec.joint
        self.K_s = spec.parameters.K_s * (self.joint.J_l / spec.parameters.J_l)
        self._begin()

    def _begin(self) -> None:
        """Nothing has been run again yet."""
        self._simulated: dict[bytes, list[Recording]] = {}
        self._held: dict[bytes, bool] = {}
        self._validated: dict[tuple[bytes, str, int], Recording] = {}
        self._swept: dict[int, Recording] = {}
        self._tracked: dict[tuple[tuple[float, ...], str, int], Recording] = {}
        self._followed: dict[bytes, Recording] = {}

    @property
    def J_l(self) -> float:
        """Moment of inertia of the link, kg·m²."""
        return self.joint.J_l

    @property
    def omega_n(self) -> float:
        """Natural frequency of the link, rad/s."""
        return math.sqrt(self.K_s / self.J_l)

    @cached_property
    def identity(self) -> dict[str, str | int]:
        """What answers from this bench say of it: plain data. The run is theirs to choose, and so not among it."""
        return {name: value for name, value in self._open().identity.items() if name != "run"}

    def sweep(self, run: int = FIRST_RUN) -> Recording:
        """The sweep of question 2.9, run again: with one number of the run, the bench does the same every time."""
        if run not in self._swept:
            with self._open(run) as bench:
                self._swept[run] = experiments.sweep(bench, progress=False)
        return self._swept[run]

    @cached_property
    def decay(self) -> Recording:
        """The free swing that students look at beside their sweep."""
        with self._open() as bench:
            return experiments.free_decay(bench, progress=False)

    def tracking(self, K: tuple[float, ...], feedback: str, run: int = FIRST_RUN) -> Recording:
        """State feedback with a gain, run again (3.13, 3.15)."""
        which = K, feedback, run
        if which not in self._tracked:
            with self._open(run) as bench:
                self._tracked[which] = experiments.tracking(bench, K, feedback, progress=False)
        return self._tracked[which]

    def follow(
        self, controller: Controller, reference: ArrayLike, sample_time: float, run: int = FIRST_RUN
    ) -> Recording:
        """A controller along a command, run again (4.4 to 4.10)."""
        which = pickle.dumps((controller, _content(reference), sample_time, run))
        if which not in self._followed:
            with self._open(run) as bench:
                self._followed[which] = experiments.follow(bench, controller, reference, sample_time, progress=False)
        return self._followed[which]

    def simulations(self, A: ArrayLike, B: ArrayLike, K: ArrayLike) -> list[Recording]:
        """The simulation of 3.11 with a model and a gain: either fidelity, with the limit or without.

        So is that of python-control, without the limit. One is left out where its loop runs away.
        """
        which = _content(A, B, K)
        if which not in self._simulated:
            self._simulated[which] = list(_simulations(A, B, K))
        return self._simulated[which]

    def holds(self, A: ArrayLike, B: ArrayLike, K: ArrayLike) -> bool:
        """Whether a gain holds a model, see :func:`rotflex.course.spare_design.holds`."""
        which = _content(A, B, K)
        if which not in self._held:
            self._held[which] = spare_design.holds(A, B, K)
        return self._held[which]

    def validation(self, A: ArrayLike, B: ArrayLike, signal: str, run: int = FIRST_RUN) -> Recording:
        """The validation with a model, run again (2.15)."""
        which = _content(A, B), signal, run
        if which not in self._validated:
            with self._open(run) as opened:
                self._validated[which] = experiments.validation(opened, A, B, signal, progress=False)
        return self._validated[which]

    def _open(self, run: int = FIRST_RUN) -> hil.Bench:
        return hil.open("virtual", seed=self._seed, preset=self._preset, draw=self._draw, run=run)


def _content(*matrices: ArrayLike) -> bytes:
    """Numbers of matrices, as the key of what was run with them."""
    return b"".join(np.asarray(matrix, dtype=float).tobytes() for matrix in matrices)


def _simulations(A: ArrayLike, B: ArrayLike, K: ArrayLike) -> Iterator[Recording]:
    command = smooth_square_wave(time_axis(DURATION, SAMPLE_TIME), FREQUENCY, AMPLITUDE, RATE)
    for fidelity in ("exact", "workbook"):
        for saturation in (None, LIMITS["max_vm"]):
            with contextlib.suppress(RotflexError):  # this loop runs away, this way at least
                yield closed_loop(A, B, K, command, fidelity=fidelity, saturation=saturation)
                if (fidelity, saturation) == ("exact", None):
                    yield _along_straight_lines(A, B, K, command)


def _along_straight_lines(A: ArrayLike, B: ArrayLike, K: ArrayLike, command: ArrayLike) -> Recording:
    """Simulate the loop as ``control.forced_response`` does, with straight lines from one command to the next."""
    K, B = np.reshape(K, (1, 4)), np.reshape(B, (4, 1))
    C, D = np.vstack([np.eye(2, 4), -K]), [[0], [0], [K[0, 0]]]
    loop = control.ss(A - B @ K, K[0, 0] * B, C, D, inputs="theta_ref", outputs=["theta", "alpha", "vm"])
    return Recording.of_response(control.forced_response(loop, time_axis(DURATION, SAMPLE_TIME), command))
