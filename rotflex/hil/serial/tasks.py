"""Samples that came unasked, kept for each task until it is asked for them."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

from rotflex.errors import HILError
from rotflex.hil.board import BufferOverflowMode
from rotflex.hil.own_board import OwnTask, Values
from rotflex.hil.serial.protocol import Inputs

_VOLTS_PER_STEP = 5.0 / 1024


@dataclass
class Task(OwnTask):
    """What is sampled, and the samples that nobody has fetched; those lost on the line are among the lost."""

    waiting: deque[Inputs] = field(default_factory=deque)

    def begin(self, samples: int) -> None:
        """Wait for so many samples."""
        self.started, self.remaining, self.lost = True, samples, 0
        self.waiting.clear()

    def end(self) -> None:
        """Wait for no more."""
        self.started, self.remaining = False, 0
        self.waiting.clear()

    def give(self, missing: int, inputs: Inputs) -> None:
        """A sample, before which some went missing."""
        missing = min(missing, self.remaining)
        self.remaining -= missing
        self.lost += missing
        if not self.remaining:
            return
        self.remaining -= 1
        if len(self.waiting) < self.capacity:
            self.waiting.append(inputs)
            return
        self.lost += 1
        if self.overflow is not BufferOverflowMode.OVERWRITE_ON_OVERFLOW:
            return
        self.waiting.popleft()
        self.waiting.append(inputs)

    def check(self) -> None:
        """Raise, if samples were lost and that is an error.

        Raises
        ------
        HILError
            If so.
        """
        if self.lost and self.overflow is BufferOverflowMode.ERROR_ON_OVERFLOW:
            raise HILError(f"The task lost {self.lost} samples: on the line, or because they were not fetched in time.")


def values(task: OwnTask, inputs: Inputs) -> Values:
    """What the channels of a task read in a sample."""
    return (
        [inputs.analog[channel] * _VOLTS_PER_STEP for channel in task.analog],
        [inputs.counts[channel] for channel in task.encoders],
        [inputs.lines >> channel & 1 for channel in task.digital],
    )
