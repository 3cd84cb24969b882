"""The samples that the board sends unasked, and the tasks that wait for them."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field

from rotflex.errors import HILError
from rotflex.hil.board import BufferOverflowMode
from rotflex.hil.own_board import OwnTask, Values
from rotflex_serial import protocol
from rotflex_serial.line import ALIVE_AFTER, Line
from rotflex_serial.protocol import Flag, Inputs, Sample, Type

SLOWEST = 10_000  #: ms between samples, at most; slower ones are no experiment
_LATE = 0.1  # s by which a sample may be late; twice the board's 50 ms of silence
_NUMBERS = 2**16
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


class Stream:
    """Samples, given to all tasks that are started.

    Parameters
    ----------
    line : the line to the board
    tasks : by their handles

    Attributes
    ----------
    lost : how many samples did not come, since the board was opened
    """

    def __init__(self, line: Line, tasks: Mapping[int, Task]) -> None:
        self.lost = 0
        self._line, self._tasks = line, tasks
        self._period = 0  # ms; 0 while nothing is sampled
        self._expected = 0  # number of the next sample
        line.on_sample = self._on_sample

    @property
    def running(self) -> bool:
        """Whether the board has been asked for samples."""
        return self._period > 0

    def start(self, task: Task, frequency: float, samples: int) -> None:
        """Begin a task; the first sample is taken now, or with those of the other tasks.

        Raises
        ------
        HILError
            If the board cannot sample at that rate (Hz), or does so at another.
        """
        period = milliseconds(frequency)
        task.end()
        if not self._wanted():
            self._line.ask(Type.START, protocol.PERIOD.pack(period))
            self._period, self._expected = period, 0
        elif period != self._period:
            raise HILError(
                f"The board samples at one rate at a time, which is {1000 / self._period:g} Hz now: stop the "
                "other task first."
            )
        task.begin(samples)

    def rest(self) -> None:
        """Sample no more, if no task wants it."""
        if self.running and not self._wanted():
            self._period = 0
            self._line.ask(Type.STOP)

    def fetch(self, task: Task) -> Inputs | None:
        """The next sample of a task, or None at its end.

        Raises
        ------
        HILError
            If none comes, if one was lost and that is an error, or if the encoders have miscounted.
        """
        if not task.waiting and task.remaining:
            self._await(task)
        task.check()
        if Flag.MISCOUNTED in self._line.flags:
            raise HILError(
                "An encoder turned faster than the board can count, or its wires pick up noise: the counts are "
                "wrong from here on. Look at its wires, and set the counts anew."
            )
        return task.waiting.popleft() if task.waiting else None

    def _await(self, task: Task) -> None:
        """Wait until a sample is there, or the task is at its end."""
        port, patience = self._line.port, self._period / 1000 + _LATE
        latest = port.now() + patience
        while task.remaining and not task.waiting:
            self._line.keep_alive()
            self._line.listen(min(latest, port.now() + ALIVE_AFTER))
            if port.now() >= latest and not task.waiting:
                raise HILError(
                    f"The board gave no sample for {patience:.2f} s. Look at the cable, and whether the board "
                    "has power."
                )

    def _on_sample(self, sample: Sample) -> None:
        if not self.running:
            return
        missing = (sample.number - self._expected) % _NUMBERS
        self._expected = (sample.number + 1) % _NUMBERS
        self.lost += missing
        for task in self._tasks.values():
            if task.started:
                task.give(missing, sample.inputs)

    def _wanted(self) -> bool:
        """Whether any task wants samples."""
        return any(task.started for task in self._tasks.values())


def milliseconds(frequency: float) -> int:
    """The time between samples, in ms.

    Raises
    ------
    HILError
        If it is none that the board can keep.
    """
    period = 1000 / frequency
    if not math.isclose(period, round(period), rel_tol=1e-6) or not 1 <= round(period) <= SLOWEST:
        raise HILError(
            f"The board cannot take samples at {frequency:g} Hz: the time between two is a whole number of "
            f"milliseconds, from 1 to {SLOWEST}, as at 500 Hz or 1000 Hz."
        )
    return round(period)
