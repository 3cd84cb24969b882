"""Tasks for a board that has no clock of its own: the computer's clock paces them, with the same report.

A sample that nobody came for in time cannot be taken later. It is counted as lost, as a full buffer's would be, and the
next one that is due is taken.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass

from rotflex.courseware.messages import _
from rotflex.errors import HILError
from rotflex.hil.board import Channels, Counts
from rotflex.hil.clock import TimeSource, WallClock

_ReadEncoder = Callable[[Channels, int, Counts], None]


@dataclass
class _Task:
    channels: Channels
    number: int
    period: float = math.nan
    due: float = math.nan
    remaining: int = 0
    lost: int = 0


class SoftwareTasks:
    """A board's verbs ``task_…`` for encoders, above its ``read_encoder``.

    Parameters
    ----------
    read_encoder : the board's
    clock : the computer's unless given
    """

    def __init__(self, read_encoder: _ReadEncoder, clock: TimeSource | None = None) -> None:
        self._read, self._clock = read_encoder, clock or WallClock()
        self._tasks: dict[int, _Task] = {}
        self._handles = itertools.count(1)

    def create_encoder_reader(self, samples_in_buffer: int, channels: Channels, num_channels: int) -> int:
        """A task, of which no sample ever waits in a buffer."""
        if samples_in_buffer < 1:
            raise HILError(
                _("A task needs a buffer of at least one sample; it was given {samples_in_buffer}.").format(
                    samples_in_buffer=samples_in_buffer
                )
            )
        handle = next(self._handles)
        self._tasks[handle] = _Task(channels[:num_channels].copy(), num_channels)
        return handle

    def start(self, task: int, frequency: float, num_samples: int) -> None:
        """Take the first sample now."""
        if not 0 < frequency < math.inf or num_samples < 1:
            raise HILError(
                _("A task cannot take {num_samples} samples at {frequency} Hz.").format(
                    num_samples=num_samples, frequency=frequency
                )
            )
        one = self._task(task)
        one.period, one.due, one.remaining, one.lost = 1 / frequency, self._clock.now(), num_samples, 0

    def read_encoder(self, task: int, num_samples: int, buffer: Counts) -> int:
        """Wait for samples, and return how many came (fewer only at the end of the task)."""
        one = self._task(task)
        if math.isnan(one.due):
            raise HILError(_("Task {task} has not been started.").format(task=task))
        if num_samples < 1:
            raise HILError(
                _("A task gives one sample or more at a time; it was asked for {num_samples}.").format(
                    num_samples=num_samples
                )
            )
        if buffer.size < num_samples * one.number:
            raise HILError(
                _("The encoder buffer must hold {num_samples} counts.").format(num_samples=num_samples * one.number)
            )
        count = 0
        while count < num_samples and one.remaining:
            passed = min(max(math.floor((self._clock.now() - one.due) / one.period + 1e-9), 0), one.remaining)
            one.lost += passed
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

    def get_buffer_overflows(self, task: int) -> int:
        """How many samples nobody came for since the start."""
        return self._task(task).lost

    def stop(self, task: int) -> None:
        """Take no more samples."""
        self._task(task).due = math.nan

    def delete(self, task: int) -> None:
        """Forget a task."""
        self._task(task)
        del self._tasks[task]

    def _task(self, handle: int) -> _Task:
        if handle not in self._tasks:
            raise HILError(_("There is no task {handle}.").format(handle=handle))
        return self._tasks[handle]
