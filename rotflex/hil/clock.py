"""What the virtual board takes for time: simulated, or the computer's own."""

from __future__ import annotations

import time
from typing import Protocol


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
