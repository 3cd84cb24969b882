"""Samples that came unasked, kept for each task until it is asked for them."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field

from rotflex.errors import HILError
from rotflex.hil.board import BufferOverflowMode, Counts, Levels, Vector, check_buffer
from rotflex.hil.serial.protocol import Inputs

_VOLTS_PER_STEP = 5.0 / 1024
#: Modes in which the hardware would have to wait for the program. It does not.
_WAITING = ("WAIT_ON_OVERFLOW", "SYNCHRONIZED")


@dataclass
class Task:
    """What is sampled, and the samples that nobody has fetched.

    Attributes
    ----------
    analog, encoders, digital : channels
    capacity : how many samples are kept
    overflow : what happens to those for which there is no room
    remaining : how many are still to come
    lost : how many were lost since the start, on the line or for lack of room
    """

    analog: Sequence[int]
    encoders: Sequence[int]
    digital: Sequence[int]
    capacity: int
    overflow: BufferOverflowMode = BufferOverflowMode.ERROR_ON_OVERFLOW
    started: bool = False
    remaining: int = 0
    lost: int = 0
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

    def check_buffers(
        self, samples: int, analog: Vector | None, encoders: Counts | None, digital: Levels | None
    ) -> None:
        """Raise, if so many samples do not fit into the buffers.

        Raises
        ------
        HILError
            If so, or a buffer is of another type.
        """
        check_buffer(analog, samples * len(self.analog), "analog")
        check_buffer(encoders, samples * len(self.encoders), "encoder")
        check_buffer(digital, samples * len(self.digital), "digital")

    def fill(
        self, at: int, inputs: Inputs, analog: Vector | None, encoders: Counts | None, digital: Levels | None
    ) -> None:
        """Put a sample into the buffers, as number ``at``."""
        if analog is not None:
            for place, channel in enumerate(self.analog, at * len(self.analog)):
                analog[place] = inputs.analog[channel] * _VOLTS_PER_STEP
        if encoders is not None:
            for place, channel in enumerate(self.encoders, at * len(self.encoders)):
                encoders[place] = inputs.counts[channel]
        if digital is not None:
            for place, channel in enumerate(self.digital, at * len(self.digital)):
                digital[place] = inputs.lines >> channel & 1


def overflow_mode(mode: int) -> BufferOverflowMode:
    """A mode that this board can keep to.

    Raises
    ------
    HILError
        If there is no such mode, or the board would have to wait for the program.
    """
    try:
        chosen = BufferOverflowMode(mode)
    except ValueError:
        listed = ", ".join(f"{mode.value} ({mode.name})" for mode in BufferOverflowMode)
        raise HILError(f"There is no buffer overflow mode {mode}; there are {listed}.") from None
    if chosen.name in _WAITING:
        raise HILError(
            f"The board's clock waits for nobody: it cannot keep to overflow mode {chosen.name}, which is for "
            "simulators."
        )
    return chosen
