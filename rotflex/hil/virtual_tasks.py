"""Hardware-timed sampling on the virtual board: what was sampled while nobody fetched stays as it was then."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field

from rotflex.errors import HILError
from rotflex.hil.board import BufferOverflowMode
from rotflex.hil.own_board import OwnTask, Values

#: Modes in which time waits for the program.
_TIME_WAITS = (BufferOverflowMode.WAIT_ON_OVERFLOW, BufferOverflowMode.SYNCHRONIZED)


@dataclass
class Task(OwnTask):
    """Samples that are taken at a fixed rate, and kept in a buffer until they are fetched.

    Samples are known by how many then remained to be fetched, which no two share.

    Attributes
    ----------
    period : s
    due : when the next sample to be fetched is, or was, taken, s
    """

    period: float = math.nan
    due: float = math.nan
    #: Samples that were thrown away before the ones in front of them were fetched: what then remains, and how many.
    _gaps: deque[tuple[int, int]] = field(default_factory=deque)
    _kept: dict[int, Values] = field(default_factory=dict)
    _next: int = 0

    def start(self, now: float, frequency: float, samples: int) -> None:
        """Take the first sample now."""
        self.period, self.due = 1.0 / frequency, now
        self.started, self.remaining, self.lost, self._next = True, samples, 0, samples
        self._gaps.clear()
        self._kept.clear()

    def stop(self) -> None:
        """Take no more samples."""
        self.started, self.remaining = False, 0

    def due_until(self, instant: float) -> Iterator[tuple[float, int]]:
        """When samples that were not seen yet are due until an instant, and which."""
        if self.overflow in _TIME_WAITS:
            return
        self._next = min(self._next, self.remaining)
        while self._next > 0:
            due = self.due + (self.remaining - self._next) * self.period
            if due >= instant:
                return
            yield due, self._next
            self._next -= 1

    def keep(self, sample: int, values: Values) -> None:
        """Put a sample aside until it is fetched."""
        self._kept[sample] = values
        while len(self._kept) > self.capacity:
            # Those that are lost are never asked for: the oldest where new ones write over them, else the newest.
            overwritten = self.overflow is BufferOverflowMode.OVERWRITE_ON_OVERFLOW
            del self._kept[max(self._kept) if overwritten else min(self._kept)]

    def kept(self) -> Values | None:
        """The sample that is fetched next, if it was put aside."""
        return self._kept.pop(self.remaining, None)

    def fetch(self) -> None:
        """Go on to the next sample that was not thrown away."""
        self.due += self.period
        self.remaining -= 1
        while self._gaps and self._gaps[0][0] == self.remaining:
            self._skip(self._gaps.popleft()[1])

    def handle_overflow(self, now: float) -> None:
        """Deal with samples for which the buffer was full.

        Raises
        ------
        HILError
            If there are any and ``overflow`` forbids it.
        """
        if self.overflow in _TIME_WAITS:
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
