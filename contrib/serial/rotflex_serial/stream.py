"""The samples that the board sends unasked, and the tasks that wait for them."""

from __future__ import annotations

import math
from collections.abc import Mapping

from rotflex.errors import HILError
from rotflex.hil.board import Task, Values
from rotflex_serial import protocol
from rotflex_serial.line import ALIVE_AFTER, Line
from rotflex_serial.protocol import Flag, Inputs, Sample, Type

SLOWEST = 10_000  #: ms between samples, at most; slower ones are no experiment
_LATE = 0.1  # s by which a sample may be late; twice the board's 50 ms of silence
_NUMBERS = 2**16
_VOLTS_PER_STEP = 5.0 / 1024


def values(task: Task, inputs: Inputs) -> Values:
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

    def fetch(self, task: Task) -> Values | None:
        """The next sample of a task, or None at its end.

        Raises
        ------
        HILError
            If none comes, if one was lost and that is an error, or if the encoders have miscounted.
        """
        if not task.waiting and task.remaining:
            self._await(task)
        sample = task.take()
        if Flag.MISCOUNTED in self._line.flags:
            raise HILError(
                "An encoder turned faster than the board can count, or its wires pick up noise: the counts are "
                "wrong from here on. Look at its wires, and set the counts anew."
            )
        return sample

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
                task.miss(missing)
                if task.remaining:
                    task.give(values(task, sample.inputs))

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
