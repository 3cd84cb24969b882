"""What the virtual board takes for time, simulated or the computer's own, and sampling at a fixed rate in it."""

from __future__ import annotations

import math
import time
from collections import deque
from dataclasses import dataclass, field
from typing import Protocol

from rotflex.errors import HILError
from rotflex.hil.board import BufferOverflowMode


class TimeSource(Protocol):
    """What the virtual board takes for time."""

    def now(self) -> float:
        """Time, s."""

    def wait_until(self, instant: float) -> None:
        """Return when ``now()`` has reached ``instant``."""


class SimulatedClock:
    """Time that passes only while somebody waits."""

    def __init__(self) -> None:
        self._now = 0.0

    def now(self) -> float:
        """Simulated time, s."""
        return self._now

    def wait_until(self, instant: float) -> None:
        """Let time pass until ``instant``."""
        self._now = max(self._now, instant)


class WallClock:
    """The computer's own time."""

    def __init__(self) -> None:
        self._start = time.perf_counter()

    def now(self) -> float:
        """Seconds since the clock was made."""
        return time.perf_counter() - self._start

    def wait_until(self, instant: float) -> None:
        """Sleep until ``instant``."""
        remaining = instant - self.now()
        if remaining > 0:
            time.sleep(remaining)


#: Modes in which time waits for the program.
_TIME_WAITS = (BufferOverflowMode.WAIT_ON_OVERFLOW, BufferOverflowMode.SYNCHRONIZED)


@dataclass
class Sampling:
    """Samples that are taken at a fixed rate, and kept in a buffer until they are fetched.

    Attributes
    ----------
    capacity : how many samples the buffer holds
    overflow : what happens to those that nobody fetched before it was full
    period : s
    due : when the next sample to be fetched is, or was, taken, s; not a number before the start
    remaining : how many samples are still to be fetched
    lost : how many found the buffer full since the start
    """

    capacity: int
    overflow: BufferOverflowMode = BufferOverflowMode.ERROR_ON_OVERFLOW
    period: float = math.nan
    due: float = math.nan
    remaining: int = 0
    lost: int = 0
    #: Samples that were thrown away before the ones in front of them were fetched: what then remains, and how many.
    _gaps: deque[tuple[int, int]] = field(default_factory=deque)

    @property
    def started(self) -> bool:
        """Whether sampling has been started, and not been stopped."""
        return not math.isnan(self.due)

    @property
    def time_waits(self) -> bool:
        """Whether time waits for whoever fetches."""
        return self.overflow in _TIME_WAITS

    @property
    def keeps_oldest(self) -> bool:
        """Whether, when there is no more room, the samples that were taken first stay."""
        return self.overflow is not BufferOverflowMode.OVERWRITE_ON_OVERFLOW

    def start(self, now: float, frequency: float, samples: int) -> None:
        """Take the first sample now."""
        if not 0 < frequency < math.inf or samples < 1:
            raise HILError(f"A task cannot take {samples} samples at {frequency} Hz.")
        self.period, self.due, self.remaining, self.lost = 1.0 / frequency, now, samples, 0
        self._gaps.clear()

    def stop(self) -> None:
        """Take no more samples."""
        self.due, self.remaining = math.nan, 0

    def fetch(self) -> None:
        """Go on to the next sample that was not thrown away."""
        self._skip(1)
        while self._gaps and self._gaps[0][0] == self.remaining:
            self._skip(self._gaps.popleft()[1])

    def handle_overflow(self, now: float) -> None:
        """Deal with samples for which the buffer was full.

        Raises
        ------
        HILError
            If there are any and ``overflow`` forbids it.
        """
        if self.time_waits:
            return
        taken = math.floor((now - self.due) / self.period + 1e-9) + 1
        taken = min(max(taken, 0), self.remaining)
        lost = taken - sum(number for _remaining, number in self._gaps) - self.capacity
        if lost <= 0:
            return
        if self.overflow is BufferOverflowMode.ERROR_ON_OVERFLOW:
            self.lost = lost
            raise HILError(f"The task lost {lost} samples: they were not fetched before its buffer was full.")
        self.lost += lost
        if self.overflow is BufferOverflowMode.OVERWRITE_ON_OVERFLOW:
            self._skip(lost)
        else:
            self._gaps.append((self.remaining - taken + lost, lost))

    def _skip(self, samples: int) -> None:
        self.due += samples * self.period
        self.remaining -= samples
