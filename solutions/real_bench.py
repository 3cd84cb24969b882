"""The bench of the laboratory's at which a student made their recordings, for comparison.

An experiment is not run again on it: what the student recorded stands in its place, where its controller fits.
"""

from __future__ import annotations

from labcourse.benches import BenchPolicy
from rotflex import hil
from rotflex.config import srv02
from rotflex.course.recordings_folder import bench_of
from rotflex.errors import BenchError
from rotflex.hil.student_benches import FIRST_RUN

from . import real_benches
from .evidence import examine
from .true_bench import TrueBench


class RealBench(TrueBench):
    """What ``solutions/key.py`` compares with, where students work at the laboratory's benches.

    Parameters
    ----------
    policy : with the benches that there are
    evidence : what the sandbox gave back of the recordings that were handed in, see :mod:`solutions.evidence`

    Attributes
    ----------
    problems, notes : what is to be said of the recordings
    is_known : whether all that was measured can be compared; else it is for a person

    Raises
    ------
    ConfigurationError
        If the truth of a bench cannot be read.
    """

    def __init__(self, policy: BenchPolicy, evidence: bytes) -> None:
        self._found = examine([real_benches.read(name, real_benches.FOLDER) for name in policy.benches], evidence)
        self.problems, self.notes = self._found.problems, self._found.notes
        self.is_known = bool(self._found.recordings) and not self._found.doubted
        self._begin()
        self.servo = srv02()
        bench = self._found.bench
        if bench is not None:
            self.servo, self.joint = bench.servo, bench.joint
            self.K_s = bench.parameters.K_s

    def __getattr__(self, name: str) -> float:
        """Nothing is known of a bench that nobody knows which it is: answers that depend on it are for a person."""
        if name in ("joint", "K_s"):
            raise BenchError("It is not known at which bench it was measured.")
        raise AttributeError(name)

    @property
    def identity(self) -> None:  # type: ignore[override]
        """Nothing to compare: each recording names its bench."""

    def _open(self, run: int = FIRST_RUN) -> hil.Bench:
        return bench_of(self._found.recordings, run, self.servo, self.joint)
