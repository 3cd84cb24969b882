"""What boards of ours have in common: verbs that come down to others, and checks of what the verbs are given.

Lists of channels, buffers and handles are checked here, so that a board itself sees plain Python values by channel.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from rotflex.errors import HILError
from rotflex.hil.board import CHANNEL, BufferOverflowMode, Channels, Clock, Counts, Levels, Vector, check_buffer

Values = tuple[Sequence[float], Sequence[float], Sequence[float]]  #: analog, encoders, digital; counts are numbers, too
Buffers = tuple[Vector | None, Counts | None, Levels | None]  #: for the same
Range = tuple[float, float]  #: V
ANALOG_INPUT, ANALOG_OUTPUT = "analog input", "analog output"


@dataclass
class OwnTask:
    """Sampling of some channels.

    Attributes
    ----------
    analog, encoders, digital : channels
    capacity : how many samples are kept until they are fetched
    overflow : what happens to those for which there is no room
    started : whether sampling has been started, and not been stopped
    remaining : how many samples are still to come
    lost : how many were lost since the start
    """

    analog: Sequence[int]
    encoders: Sequence[int]
    digital: Sequence[int]
    capacity: int = 1
    overflow: BufferOverflowMode = BufferOverflowMode.ERROR_ON_OVERFLOW
    started: bool = False
    remaining: int = 0
    lost: int = 0

    def check_buffers(self, samples: int, buffers: Buffers) -> None:
        """Check that so many samples fit into the buffers.

        Raises
        ------
        HILError
            If they do not, or a buffer is of another type.
        """
        for chosen, buffer, kind in zip(
            (self.analog, self.encoders, self.digital), buffers, ("analog", "encoder", "digital"), strict=True
        ):
            if chosen:
                check_buffer(buffer, samples * len(chosen), kind)


AnyTask = TypeVar("AnyTask", bound=OwnTask)


def put(values: Values, buffers: Buffers, at: int) -> None:
    """Put one sample of each channel into the buffers, as sample number ``at``."""
    for found, buffer in zip(values, buffers, strict=True):
        if found and buffer is not None:
            for place, value in enumerate(found, at * len(found)):
                buffer[place] = value


def finite(chosen: Sequence[int], buffer: Vector) -> list[float]:
    """Voltages, one for each analog output that was chosen.

    Raises
    ------
    HILError
        If the buffer is none of numbers, or a voltage is not finite.
    """
    check_buffer(buffer, len(chosen), "analog")
    values: list[float] = buffer[: len(chosen)].tolist()
    for channel, voltage in zip(chosen, values, strict=True):
        if not math.isfinite(voltage):
            raise HILError(f"Analog output {channel} cannot be set to {voltage}: not a finite voltage.")
    return values


class OwnBoard(ABC, Generic[AnyTask]):
    """A board of ours, open.

    Parameters
    ----------
    name : what it is called
    task : makes a task
    available : kind → how many channels of it there are
    """

    def __init__(self, name: str, task: type[AnyTask], available: Mapping[str, int]) -> None:
        self._name, self._new_task, self._available = name, task, available
        self._open = True
        self._tasks: dict[int, AnyTask] = {}
        self._next_task = 1
        self._known_channels: dict[tuple[bytes, int, str], tuple[int, ...]] = {}  # the same few come every sample

    def is_valid(self) -> bool:
        """Whether the board is open."""
        return self._open

    # --- immediate input and output -------------------------------------------------------------------------------

    def set_encoder_counts(self, channels: Channels, num_channels: int, counts: Counts) -> None:
        """Set what the counters read now."""
        chosen = self._chosen(channels, num_channels, "encoder")
        check_buffer(counts, num_channels, "encoder")
        self._set_counts(dict(zip(chosen, counts.tolist(), strict=False)))

    def set_encoder_quadrature_mode(self, channels: Channels, num_channels: int, modes: NDArray[Any]) -> None:
        """Choose how many edges are counted. What the counters read stays."""
        chosen = self._chosen(channels, num_channels, "encoder")
        check_buffer(modes, num_channels, "mode")
        self._set_modes(dict(zip(chosen, modes.tolist(), strict=False)))

    def set_analog_input_ranges(self, channels: Channels, num_channels: int, minima: Vector, maxima: Vector) -> None:
        """Choose the ranges (V) of analog inputs."""
        self._set_ranges(ANALOG_INPUT, self._ranges(ANALOG_INPUT, channels, num_channels, minima, maxima))

    def set_analog_output_ranges(self, channels: Channels, num_channels: int, minima: Vector, maxima: Vector) -> None:
        """Choose the ranges (V) of analog outputs."""
        self._set_ranges(ANALOG_OUTPUT, self._ranges(ANALOG_OUTPUT, channels, num_channels, minima, maxima))

    def read_encoder(self, channels: Channels, num_channels: int, buffer: Counts) -> None:
        """Read encoder counts."""
        self.read(None, 0, channels, num_channels, None, 0, None, 0, None, buffer, None, None)

    def read_analog(self, channels: Channels, num_channels: int, buffer: Vector) -> None:
        """Read analog inputs, V."""
        self.read(channels, num_channels, None, 0, None, 0, None, 0, buffer, None, None, None)

    def read(
        self,
        analog_channels: Channels | None,
        num_analog_channels: int,
        encoder_channels: Channels | None,
        num_encoder_channels: int,
        digital_channels: Channels | None,
        num_digital_channels: int,
        other_channels: Channels | None,
        num_other_channels: int,
        analog_buffer: Vector | None,
        encoder_buffer: Counts | None,
        digital_buffer: Levels | None,
        other_buffer: Vector | None,
    ) -> None:
        """Read inputs of all kinds at one instant. Boards of ours have no other channels."""
        analog = self._chosen(analog_channels, num_analog_channels, ANALOG_INPUT)
        encoders = self._chosen(encoder_channels, num_encoder_channels, "encoder")
        digital = self._chosen(digital_channels, num_digital_channels, "digital")
        self._chosen(other_channels, num_other_channels, "other")
        task, buffers = OwnTask(analog, encoders, digital), (analog_buffer, encoder_buffer, digital_buffer)
        task.check_buffers(1, buffers)
        put(self._values_now(task), buffers, 0)

    def write_digital(self, channels: Channels, num_channels: int, buffer: Levels) -> None:
        """Set digital lines: 0 low, anything else high."""
        chosen = self._chosen(channels, num_channels, "digital")
        check_buffer(buffer, num_channels, "digital")
        self._set_lines(dict(zip(chosen, buffer.tolist(), strict=False)))

    def set_card_specific_options(self, options: str, size: int) -> None:
        """Boards of ours have no options of their own: any but the empty string is refused."""
        self._check_open()
        if options:
            raise HILError(f"The {self._name} board has no options; it was given {options!r}.")

    # --- hardware-timed input -------------------------------------------------------------------------------------

    def task_create_encoder_reader(self, samples_in_buffer: int, channels: Channels, num_channels: int) -> int:
        """Create a task that samples encoders."""
        return self.task_create_reader(samples_in_buffer, None, 0, channels, num_channels, None, 0, None, 0)

    def task_create_reader(
        self,
        samples_in_buffer: int,
        analog_channels: Channels | None,
        num_analog_channels: int,
        encoder_channels: Channels | None,
        num_encoder_channels: int,
        digital_channels: Channels | None,
        num_digital_channels: int,
        other_channels: Channels | None,
        num_other_channels: int,
    ) -> int:
        """Create a task that samples inputs of all kinds."""
        analog = self._chosen(analog_channels, num_analog_channels, ANALOG_INPUT)
        encoders = self._chosen(encoder_channels, num_encoder_channels, "encoder")
        digital = self._chosen(digital_channels, num_digital_channels, "digital")
        self._chosen(other_channels, num_other_channels, "other")
        if samples_in_buffer < 1:
            raise HILError(f"A task needs a buffer of at least one sample; it was given {samples_in_buffer}.")
        handle, self._next_task = self._next_task, self._next_task + 1
        self._tasks[handle] = self._new_task(analog, encoders, digital, samples_in_buffer)
        return handle

    def task_set_buffer_overflow_mode(self, task: int, mode: int) -> None:
        """Choose what happens to samples that nobody fetched before the task's buffer was full."""
        chosen = self._task(task)
        try:
            chosen.overflow = BufferOverflowMode(mode)
        except ValueError:
            listed = ", ".join(f"{mode.value} ({mode.name})" for mode in BufferOverflowMode)
            raise HILError(f"There is no buffer overflow mode {mode}; there are {listed}.") from None

    def task_start(self, task: int, clock: int, frequency: float, num_samples: int) -> None:
        """Start sampling; the first sample is taken now."""
        chosen = self._task(task)
        if clock != Clock.HARDWARE_CLOCK_0:
            raise HILError(f"The {self._name} board has one clock, HARDWARE_CLOCK_0; it was asked for clock {clock}.")
        if not 0 < frequency < math.inf or num_samples < 1:
            raise HILError(f"A task cannot take {num_samples} samples at {frequency} Hz.")
        self._begin(chosen, frequency, num_samples)

    def task_read_encoder(self, task: int, num_samples: int, buffer: Counts) -> int:
        """Wait for samples of encoders, and return how many came."""
        return self.task_read(task, num_samples, None, buffer, None, None)

    def task_read(
        self,
        task: int,
        num_samples: int,
        analog_buffer: Vector | None,
        encoder_buffer: Counts | None,
        digital_buffer: Levels | None,
        other_buffer: Vector | None,
    ) -> int:
        """Wait for samples of all kinds, and return how many came (fewer only at the end of the task)."""
        chosen = self._task(task)
        if not chosen.started:
            raise HILError(f"Task {task} has not been started.")
        if num_samples < 1:
            raise HILError(f"A task gives one sample or more at a time; it was asked for {num_samples}.")
        buffers = (analog_buffer, encoder_buffer, digital_buffer)
        chosen.check_buffers(num_samples, buffers)
        count = 0
        while count < num_samples and (values := self._fetch(chosen)) is not None:
            put(values, buffers, count)
            count += 1
        return count

    def task_get_buffer_overflows(self, task: int) -> int:
        """How many samples were lost since the start."""
        return self._task(task).lost

    def task_flush(self, task: int) -> None:
        """Boards of ours have readers only, on which this has no effect: read what waits to be rid of it."""
        self._task(task)

    def watchdog_set_digital_expiration_state(self, channels: Channels, num_channels: int, states: Counts) -> None:
        """Nothing hangs on the digital lines: they stay as they are."""
        self._chosen(channels, num_channels, "digital")
        check_buffer(states, num_channels, "state")

    # --- what each board does in its own way ----------------------------------------------------------------------

    @abstractmethod
    def _set_counts(self, counts: Mapping[int, int]) -> None:
        """Set what counters read."""

    @abstractmethod
    def _set_modes(self, modes: Mapping[int, int]) -> None:
        """Set how many edges encoders count."""

    @abstractmethod
    def _set_ranges(self, kind: str, ranges: Mapping[int, Range]) -> None:
        """Set the ranges (V) of analog inputs or outputs."""

    @abstractmethod
    def _set_lines(self, levels: Mapping[int, int]) -> None:
        """Set digital lines."""

    @abstractmethod
    def _values_now(self, task: OwnTask) -> Values:
        """What the channels of a task read now."""

    @abstractmethod
    def _begin(self, task: AnyTask, frequency: float, samples: int) -> None:
        """Start a task."""

    @abstractmethod
    def _fetch(self, task: AnyTask) -> Values | None:
        """Wait for the next sample of a task; None at its end."""

    # --- checks ---------------------------------------------------------------------------------------------------

    def _check_open(self) -> None:
        if not self._open:
            raise HILError("The board is closed.")

    def _task(self, handle: int) -> AnyTask:
        self._check_open()
        if handle not in self._tasks:
            raise HILError(f"There is no task {handle}.")
        return self._tasks[handle]

    def _chosen(self, channels: Channels | None, count: int, kind: str) -> tuple[int, ...]:
        """The first ``count`` channel numbers.

        Raises
        ------
        HILError
            If they are no vector of uint32, or there are no such channels.
        """
        self._check_open()
        if count == 0:
            return ()
        if not isinstance(channels, np.ndarray) or channels.dtype != CHANNEL or channels.ndim != 1:
            raise HILError(f"The {kind} channels must be a numpy vector of uint32; they are {channels!r}.")
        key = (channels.tobytes(), count, kind)
        chosen = self._known_channels.get(key)
        if chosen is None:
            chosen, available = tuple(channels[:count].tolist()), self._available.get(kind, 0)
            if len(chosen) != count or any(channel >= available for channel in chosen):
                raise HILError(f"There are {available} {kind} channels, from 0; asked for: {channels.tolist()}.")
            self._known_channels[key] = chosen
        return chosen

    def _ranges(self, kind: str, channels: Channels, count: int, minima: Vector, maxima: Vector) -> dict[int, Range]:
        chosen = self._chosen(channels, count, kind)
        for buffer in (minima, maxima):
            check_buffer(buffer, count, "analog")
        return dict(zip(chosen, zip(minima.tolist(), maxima.tolist(), strict=True), strict=False))
