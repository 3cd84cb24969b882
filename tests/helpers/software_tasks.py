"""Tasks for a board that has no clock of its own: the computer's clock paces them.

A sample that is fetched too late cannot be taken any more. It is lost, and the next one that is due is taken.
"""

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass

from rotflex.hil.board import Channels, Counts
from rotflex.hil.virtual import TimeSource

_ReadEncoder = Callable[[Channels, int, Counts], None]


@dataclass
class _Task:
    channels: Channels
    number: int
    period: float = math.nan
    due: float = math.nan
    remaining: int = 0


class SoftwareTasks:
    """A board's verbs ``task_…`` for encoders, above its ``read_encoder``."""

    def __init__(self, read_encoder: _ReadEncoder, clock: TimeSource) -> None:
        self._read, self._clock = read_encoder, clock
        self._tasks: dict[int, _Task] = {}
        self._handles = itertools.count(1)

    def create_encoder_reader(self, _samples_in_buffer: int, channels: Channels, num_channels: int) -> int:
        """Make a task; none of its samples ever waits in a buffer."""
        handle = next(self._handles)
        self._tasks[handle] = _Task(channels[:num_channels].copy(), num_channels)
        return handle

    def start(self, task: int, frequency: float, num_samples: int) -> None:
        """Take the first sample now."""
        one = self._tasks[task]
        one.period, one.due, one.remaining = 1 / frequency, self._clock.now(), num_samples

    def read_encoder(self, task: int, num_samples: int, buffer: Counts) -> int:
        """Wait for samples, and return how many came (fewer only at the end of the task)."""
        one = self._tasks[task]
        count = 0
        while count < num_samples and one.remaining:
            passed = min(max(math.floor((self._clock.now() - one.due) / one.period + 1e-9), 0), one.remaining)
            one.due += passed * one.period
            one.remaining -= passed
            if not one.remaining:
                break
            self._clock.wait_until(one.due)
            self._read(one.channels, one.number, buffer[count * one.number : (count + 1) * one.number])
            one.due += one.period
            one.remaining -= 1
            count += 1
        return count

    def stop(self, task: int) -> None:
        """Take no more samples."""
        self._tasks[task].due = math.nan

    def delete(self, task: int) -> None:
        """Forget a task."""
        del self._tasks[task]
