"""How steadily samples come, where time does not wait: which come late, which never, and how long an answer takes.

A board's samples wait in its buffer until they are fetched, and it does not say how many wait. The computer's clock
does: the quickest arrival tells when samples are due, and one that comes more than a period after that has others
behind it. Where fetching these takes time, they were not waiting: samples before them never came. (The maker counts
overflows, and does not say how many samples each of them lost.) The clocks of board and computer are never quite alike,
so what is known of the quickest arrival fades.
"""

from __future__ import annotations

import gc
import math
import sys
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from rotflex.unanswered import HELD, LOST, MOST_NOTED

LARGEST_DRIFT = 5e-3  #: of the time that passes: by so much a board's clock may be slow; a fast one is seen at once
WAITED_DRIFT = 2e-2  #: the same, while each sample is waited for: then none can be behind it
TOO_SLOW = 5  #: calls of a controller of which most take longer than a period: it is no pause, they take too long
_NEARLY = 0.1  # periods: a sample that is due so soon is taken for one that waits
_BLOCKED = 0.5, 1.5  # periods that a fetch takes if its sample was not waiting; longer, the computer was held up
_TWICE = 2  # fetches in a row that block; a single one may only have been held up by the computer
_FRESH = 2.0  # periods after the start in which a first sample is no old one
_SWITCH = 0.0005  # s, a quarter of a sample: threads take turns so often, so that others do not hold up the loop


class Pace:
    """The arrivals of one run.

    Parameters
    ----------
    period : s
    clock : what paces the samples, for the report
    now : the computer's time, s

    Attributes
    ----------
    late, missed : samples that came late, and that never came
    waited : s from the last answer to the last arrival
    overdue : whole periods after its sample at which the last answer before this sample was written
    """

    def __init__(self, period: float, clock: str, now: Callable[[], float]) -> None:
        self._period, self._clock, self.now = period, clock, now
        self._begun = self._arrival = self._answered = now()
        self._base = math.nan  # when sample 0 was, or would have been, here at the earliest
        self._arrivals: list[float] = []
        self._numbers: list[int] = []  # of the samples that arrived then
        self._answers: deque[float] = deque(maxlen=TOO_SLOW)  # s, each of the last few
        self._together = 1  # samples that the next answer is for: those that waited, and the newest
        self._blocked = 0  # fetches in a row, until the last one
        self._overdue = 0  # of the answer to the sample that came last
        self._held: list[list[int]] = []
        self._lost: list[list[int]] = []
        self.overdue = self.late = self.missed = 0
        self.waited = 0.0

    def stale(self, sample: int) -> int:
        """Return how many samples of before the run wait, where its first one, number 0, has just come."""
        waited = (self.now() - self._begun) / self._period
        return int(waited) if sample == 0 and waited >= _FRESH else 0

    def arrived(self, sample: int) -> int:
        """Note an arrival, and return how many samples wait behind it."""
        now = self._arrival = self.now()
        self.waited = now - self._answered
        if math.isnan(self._base):
            self._base = now - sample * self._period
        passed = sample - self._numbers[-1] if self._numbers else 1
        self._arrivals.append(now)
        self._numbers.append(sample)
        behind, lateness = self._behind(sample), now - (self._base + sample * self._period)
        is_waited_for = passed == 1 and self.waited > _NEARLY * self._period
        self._base += min(lateness, (WAITED_DRIFT if is_waited_for else LARGEST_DRIFT) * passed * self._period)
        self._blocked = 0
        self.overdue, self._overdue = self._overdue, 0
        return behind

    def fetched(self, sample: int) -> tuple[int, int]:
        """Return how many samples wait behind this one, which was believed to wait, and how many were lost before."""
        requested, self._arrival = self._arrival, self.now()
        self._blocked = self._blocked + 1 if self.blocked(requested, self._arrival) else 0
        behind = self._behind(sample)
        return (0, behind) if self._blocked == _TWICE else (behind, 0)

    def blocked(self, requested: float, arrived: float) -> bool:
        """Return whether a sample had to be waited for from its request to its arrival."""
        least, most = _BLOCKED
        return least < (arrived - requested) / self._period < most

    def _behind(self, sample: int) -> int:
        """Return how many samples should wait behind this one, which came last, by the time."""
        return max(math.floor((self._arrival - self._base) / self._period - sample + _NEARLY), 0)

    def skipped(self, sample: int, lost: int, waiting: int) -> None:
        """Note that from a sample on some never came, and after them some came late: the motor keeps what it has."""
        self.missed += lost
        self.late += waiting
        self._together = 1 + waiting
        self._numbers[-1] += lost
        if not (lost or waiting or self.overdue) or len(self._held) >= MOST_NOTED:
            return
        # A late answer was not at the motor at its own sample either.
        first = max(sample - 1, 0) if self.overdue else sample
        self._held.append([first, sample - first + lost + waiting])
        if lost:
            self._lost.append([sample, lost])

    def answered(self) -> None:
        """Note that the voltage for the sample that came last is written."""
        self._answered = self.now()
        took = self._answered - self._arrival
        self._overdue = int(took / self._period + 1e-9)
        self._answers += [took / self._together] * self._together

    @property
    def too_slow(self) -> str | None:
        """Why answers are too slow, if most of the last few took longer than the period; None if they are not."""
        took = float(np.median(self._answers)) if len(self._answers) == TOO_SLOW else 0.0
        if took <= self._period:
            return None
        return (
            f"A sample comes every {self._period * 1e3:.3g} ms, and each answer takes {took * 1e3:.3g} ms: the "
            "controller is too slow for its sample time."
        )

    def report(self) -> dict[str, Any]:
        """Return a few numbers for a recording's metadata, times in s."""
        report: dict[str, Any] = {"clock": self._clock, "late": self.late, "missed": self.missed}
        report |= {name: noted for name, noted in ((HELD, self._held), (LOST, self._lost)) if noted}
        if len(self._arrivals) > 1:
            shares = {"p50": 50.0, "p99": 99.0, "p99.9": 99.9, "max": 100.0}
            periods = np.diff(self._arrivals)
            report["period"] = {name: round(float(np.percentile(periods, one)), 6) for name, one in shares.items()}
            report["drift"] = round(self._drift(), 6)
        return report

    def _drift(self) -> float:
        """Return by how much of the time the board's clock is slower than the computer's, late arrivals left out."""
        times, numbers = np.array(self._arrivals), np.array(self._numbers)
        half = times.size // 2
        took = (times[half:] - times[:-half]) / (numbers[half:] - numbers[:-half])
        return float(np.median(took)) / self._period - 1


@contextmanager
def undisturbed() -> Iterator[None]:
    """Prevent pauses of Python's own: rubbish is collected before and not during, and threads take short turns."""
    collecting, switching = gc.isenabled(), sys.getswitchinterval()
    gc.collect()
    gc.disable()
    sys.setswitchinterval(min(_SWITCH, switching))
    try:
        yield
    finally:
        sys.setswitchinterval(switching)
        if collecting:
            gc.enable()
