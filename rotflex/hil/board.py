"""The base class of data-acquisition boards, with the maker's verbs and the maker's numbers.

Everything above (bench, loop, experiments) uses these verbs alone, so that a virtual board and a real one are
interchangeable. Buffers and channel lists are numpy arrays: channels uint32, encoder counts int32, analog values
float64, digital values int8. Every verb raises :class:`~rotflex.errors.HILError` when it fails.

:class:`Board` checks what the verbs are given: channels, buffers, task handles, sample times, and whether the board is
open. A board of one's own is a subclass that moves data: it implements the methods that begin with an underscore, which
see plain Python values by channel, and the verbs of its watchdog. ``tests/hil/contract`` tests every board.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotflex.errors import HILError
from rotflex.units import Vector

CHANNEL = np.dtype(np.uint32)
BUFFERS: dict[str, np.dtype[Any]] = {
    "encoder": np.dtype(np.int32),
    "analog": np.dtype(np.float64),
    "digital": np.dtype(np.int8),
    "state": np.dtype(np.int32),
    "mode": CHANNEL,
}

WATCHDOG_TIMEOUT = 0.2  #: s; an arm at 30 rad/s turns a whole turn meanwhile, and no more

Channels = NDArray[np.uint32]
Counts = NDArray[np.int32]
Levels = NDArray[np.int8]


class Clock(IntEnum):
    """Clocks that can time a task: the computer's are negative, the board's own are not."""

    SYSTEM_CLOCK_4 = -4
    SYSTEM_CLOCK_3 = -3
    SYSTEM_CLOCK_2 = -2
    SYSTEM_CLOCK_1 = -1
    HARDWARE_CLOCK_0 = 0
    HARDWARE_CLOCK_1 = 1
    HARDWARE_CLOCK_2 = 2
    HARDWARE_CLOCK_3 = 3


class BufferOverflowMode(IntEnum):
    """What a task does with samples that nobody fetched in time."""

    ERROR_ON_OVERFLOW = 0
    OVERWRITE_ON_OVERFLOW = 1  #: the oldest are lost
    DISCARD_ON_OVERFLOW = 2  #: the newest are lost
    WAIT_ON_OVERFLOW = 3  #: simulated boards only: time waits
    SYNCHRONIZED = 4  #: simulated boards only: time waits


class EncoderQuadratureMode(IntEnum):
    """How many edges of an encoder's two lines are counted."""

    NONE = 0
    X1 = 1
    X2 = 2
    X4 = 4


class DigitalState(IntEnum):
    """What an expired watchdog does to a digital output. The numbers are those of the maker's C header."""

    LOW = 0
    HIGH = 1
    TRISTATE = 2
    NO_CHANGE = 3


Values = tuple[Sequence[float], Sequence[float], Sequence[float]]  #: a sample: analog, encoders, digital
Range = tuple[float, float]  #: lowest and highest, V
_Buffers = tuple[Vector | None, Counts | None, Levels | None]
ANALOG_INPUT, ANALOG_OUTPUT = "analog input", "analog output"


@dataclass
class Task:
    """Sampling of some channels at a fixed rate.

    Attributes
    ----------
    analog, encoders, digital : channels
    capacity : how many samples wait until they are fetched
    overflow : what happens to samples for which there is no room
    started : whether the task samples
    remaining : how many samples are still to be taken
    lost : how many samples were lost since the start
    waiting : samples that were not fetched yet
    period : s, between samples
    due : when the next sample is taken, s
    """

    analog: Sequence[int]
    encoders: Sequence[int]
    digital: Sequence[int]
    capacity: int = 1
    overflow: BufferOverflowMode = BufferOverflowMode.ERROR_ON_OVERFLOW
    started: bool = False
    remaining: int = 0
    lost: int = 0
    waiting: deque[Values] = field(default_factory=deque)
    period: float = math.nan
    due: float = math.nan

    def begin(self, samples: int) -> None:
        """Start to take samples."""
        self.started, self.remaining, self.lost = True, samples, 0
        self.waiting.clear()

    def end(self) -> None:
        """Take no more samples, and forget those that wait."""
        self.started, self.remaining = False, 0
        self.waiting.clear()

    def give(self, sample: Values) -> None:
        """Add a sample that was taken; the overflow mode says which one is lost where the buffer is full."""
        self.remaining -= 1
        if len(self.waiting) >= self.capacity:
            self.lost += 1
            if self.overflow is not BufferOverflowMode.OVERWRITE_ON_OVERFLOW:
                return
            self.waiting.popleft()
        self.waiting.append(sample)

    def miss(self, samples: int) -> None:
        """Count samples that never came."""
        missing = min(samples, self.remaining)
        self.remaining -= missing
        self.lost += missing

    def take(self) -> Values | None:
        """Return the next sample that waits; None if there is none.

        Raises
        ------
        HILError
            If samples were lost, and the overflow mode makes that an error.
        """
        if self.lost and self.overflow is BufferOverflowMode.ERROR_ON_OVERFLOW:
            raise HILError(f"The task lost {self.lost} samples: they did not arrive, or were not fetched in time.")
        return self.waiting.popleft() if self.waiting else None

    def check_buffers(self, samples: int, buffers: _Buffers) -> None:
        """Raise :class:`HILError` unless so many samples fit into the buffers."""
        channels = (self.analog, self.encoders, self.digital)
        for chosen, buffer, kind in zip(channels, buffers, ("analog", "encoder", "digital"), strict=True):
            if chosen:
                check_buffer(buffer, samples * len(chosen), kind)


class Board:
    """An open data-acquisition board.

    Parameters
    ----------
    name : what messages call it
    available : kind of channel ("encoder", "analog input", "analog output", "digital") → how many there are
    """

    def __init__(self, name: str, available: Mapping[str, int]) -> None:
        self._name, self._available = name, available
        self._open = True
        self._tasks: dict[int, Task] = {}
        self._next_task = 1
        self._known_channels: dict[tuple[bytes, int, str], tuple[int, ...]] = {}  # the same few come every sample

    def is_valid(self) -> bool:
        """Return whether the board is open."""
        return self._open

    def close(self) -> None:
        """Close the board; a second call does nothing. Outputs keep their last value: set them to 0 V first."""
        self._tasks.clear()
        self._open = False

    # Immediate input and output ---------------------------------------------------------------------------------

    def set_encoder_counts(self, channels: Channels, num_channels: int, counts: Counts) -> None:
        """Set what the encoder counters read now."""
        self._set_counts(self._by_channel("encoder", channels, num_channels, counts, "encoder"))

    def set_encoder_quadrature_mode(self, channels: Channels, num_channels: int, modes: Channels) -> None:
        """Choose how many edges each encoder counts, see :class:`EncoderQuadratureMode`."""
        self._set_modes(self._by_channel("encoder", channels, num_channels, modes, "mode"))

    def set_encoder_filter_frequency(self, channels: Channels, num_channels: int, frequencies: Vector) -> None:
        """Choose the frequency (Hz) above which edges of an encoder are taken for noise."""
        self._set_filters(self._by_channel("encoder", channels, num_channels, frequencies, "analog"))

    def set_analog_input_ranges(self, channels: Channels, num_channels: int, minima: Vector, maxima: Vector) -> None:
        """Choose the ranges (V) of analog inputs."""
        self._choose_ranges(ANALOG_INPUT, channels, num_channels, minima, maxima)

    def set_analog_output_ranges(self, channels: Channels, num_channels: int, minima: Vector, maxima: Vector) -> None:
        """Choose the ranges (V) of analog outputs."""
        self._choose_ranges(ANALOG_OUTPUT, channels, num_channels, minima, maxima)

    def read_encoder(self, channels: Channels, num_channels: int, buffer: Counts) -> None:
        """Read encoder counts into ``buffer``."""
        self.read(None, 0, channels, num_channels, None, 0, None, 0, None, buffer, None, None)

    def read_analog(self, channels: Channels, num_channels: int, buffer: Vector) -> None:
        """Read analog inputs (V) into ``buffer``."""
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
        """Read inputs of all kinds at one instant."""
        analog = self._chosen(analog_channels, num_analog_channels, ANALOG_INPUT)
        encoders = self._chosen(encoder_channels, num_encoder_channels, "encoder")
        digital = self._chosen(digital_channels, num_digital_channels, "digital")
        self._chosen(other_channels, num_other_channels, "other")
        task, buffers = Task(analog, encoders, digital), (analog_buffer, encoder_buffer, digital_buffer)
        task.check_buffers(1, buffers)
        _put(self._read_now(task), buffers, 0)

    def write_analog(self, channels: Channels, num_channels: int, buffer: Vector) -> None:
        """Write analog outputs (V) from ``buffer``."""
        self._write(self._voltages(channels, num_channels, buffer))

    def write_digital(self, channels: Channels, num_channels: int, buffer: Levels) -> None:
        """Write digital outputs from ``buffer``: 0 low, anything else high."""
        self._set_lines(self._by_channel("digital", channels, num_channels, buffer, "digital"))

    def set_card_specific_options(self, options: str, size: int) -> None:
        """Set options that only this kind of board knows. A board has none unless it overrides this."""
        self._check_open()
        if options:
            raise HILError(f"The {self._name} board has no options; it was given {options!r}.")

    # Hardware-timed input ---------------------------------------------------------------------------------------

    def task_create_encoder_reader(self, samples_in_buffer: int, channels: Channels, num_channels: int) -> int:
        """Create a task that samples encoders, and return its handle."""
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
        """Create a task that samples inputs of all kinds, and return its handle."""
        analog = self._chosen(analog_channels, num_analog_channels, ANALOG_INPUT)
        encoders = self._chosen(encoder_channels, num_encoder_channels, "encoder")
        digital = self._chosen(digital_channels, num_digital_channels, "digital")
        self._chosen(other_channels, num_other_channels, "other")
        if samples_in_buffer < 1:
            raise HILError(f"A task needs a buffer of at least one sample; it was given {samples_in_buffer}.")
        handle, self._next_task = self._next_task, self._next_task + 1
        self._tasks[handle] = Task(analog, encoders, digital, samples_in_buffer)
        return handle

    def task_set_buffer_overflow_mode(self, task: int, mode: int) -> None:
        """Choose what happens to samples that nobody fetched in time, see :class:`BufferOverflowMode`."""
        chosen = self._task(task)
        if mode not in list(BufferOverflowMode):
            listed = ", ".join(f"{mode.value} ({mode.name})" for mode in BufferOverflowMode)
            raise HILError(f"There is no buffer overflow mode {mode}; there are {listed}.")
        chosen.overflow = BufferOverflowMode(mode)

    def task_start(self, task: int, clock: int, frequency: float, num_samples: int) -> None:
        """Start sampling at ``frequency`` (Hz); with ``num_samples`` of 2**32 - 1, until stopped."""
        chosen = self._task(task)
        if clock != Clock.HARDWARE_CLOCK_0:
            raise HILError(f"The {self._name} board has one clock, HARDWARE_CLOCK_0; it was asked for clock {clock}.")
        if not 0 < frequency < math.inf or num_samples < 1:
            raise HILError(f"A task cannot take {num_samples} samples at {frequency} Hz.")
        self._begin(chosen, frequency, num_samples)

    def task_read_encoder(self, task: int, num_samples: int, buffer: Counts) -> int:
        """Wait for samples, put them into ``buffer``, and return how many came."""
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
        """Wait for samples of all kinds, put them into the buffers, and return how many came (fewer at the end)."""
        chosen = self._task(task)
        if not chosen.started:
            raise HILError(f"Task {task} has not been started.")
        if num_samples < 1:
            raise HILError(f"A task gives one sample or more at a time; it was asked for {num_samples}.")
        buffers = (analog_buffer, encoder_buffer, digital_buffer)
        chosen.check_buffers(num_samples, buffers)
        count = 0
        while count < num_samples and (values := self._fetch(chosen)) is not None:
            _put(values, buffers, count)
            count += 1
        return count

    def task_get_buffer_overflows(self, task: int) -> int:
        """Return how many samples were lost since the start. (Of a burst, the maker's boards do not say how many.)"""
        return self._task(task).lost

    def task_flush(self, task: int) -> None:
        """Wait until all that a writer was given is out. It has no effect on readers: read what waits to drop it."""
        self._task(task)

    def task_stop(self, task: int) -> None:
        """Stop sampling."""
        self._task(task).end()

    def task_delete(self, task: int) -> None:
        """Delete the task."""
        self._task(task).end()
        del self._tasks[task]

    # Watchdog ---------------------------------------------------------------------------------------------------

    def watchdog_set_analog_expiration_state(self, channels: Channels, num_channels: int, voltages: Vector) -> None:
        """Choose the analog outputs (V) that an expired watchdog sets."""
        self._set_safe_voltages(self._voltages(channels, num_channels, voltages))

    def watchdog_set_digital_expiration_state(self, channels: Channels, num_channels: int, states: Counts) -> None:
        """Choose what an expired watchdog does to digital outputs, see :class:`DigitalState`."""
        self._by_channel("digital", channels, num_channels, states, "state")

    def watchdog_start(self, timeout: float) -> None:
        """Start the watchdog: without a reload for ``timeout`` (s) it expires."""
        raise NotImplementedError

    def watchdog_reload(self) -> bool:
        """Show that the program is alive, and return whether it was in time: False if the watchdog had expired."""
        raise NotImplementedError

    def watchdog_is_expired(self) -> bool:
        """Return whether the watchdog has expired."""
        raise NotImplementedError

    def watchdog_clear(self) -> None:
        """Let the board be used again after the watchdog expired.

        A board may set its outputs to what they were before, and its watchdog may go on running: both are left open.
        """
        raise NotImplementedError

    def watchdog_stop(self) -> None:
        """Stop the watchdog."""
        raise NotImplementedError

    # What each board does in its own way ------------------------------------------------------------------------

    def _set_counts(self, counts: Mapping[int, int]) -> None:
        """Set what counters read."""
        raise NotImplementedError

    def _set_modes(self, modes: Mapping[int, int]) -> None:
        """Set how many edges encoders count. What the counters read stays."""
        raise NotImplementedError

    def _set_filters(self, frequencies: Mapping[int, float]) -> None:
        """Set the filters of encoders, Hz."""
        raise NotImplementedError

    def _set_ranges(self, kind: str, ranges: Mapping[int, Range]) -> None:
        """Set the ranges (V) of analog inputs or outputs."""
        raise NotImplementedError

    def _read_now(self, task: Task) -> Values:
        """Return what the channels of a task read now."""
        raise NotImplementedError

    def _write(self, voltages: Mapping[int, float]) -> None:
        """Set analog outputs, V; the numbers are finite."""
        raise NotImplementedError

    def _set_safe_voltages(self, voltages: Mapping[int, float]) -> None:
        """Set the analog outputs (V) that an expired watchdog sets."""
        raise NotImplementedError

    def _set_lines(self, levels: Mapping[int, int]) -> None:
        """Set digital lines."""
        raise NotImplementedError

    def _begin(self, task: Task, frequency: float, samples: int) -> None:
        """Start a task; its first sample is taken now."""
        raise NotImplementedError

    def _fetch(self, task: Task) -> Values | None:
        """Wait for the next sample of a task; None at its end."""
        raise NotImplementedError

    # Checks -----------------------------------------------------------------------------------------------------

    def _check_open(self) -> None:
        if not self._open:
            raise HILError("The board is closed.")

    def _task(self, handle: int) -> Task:
        self._check_open()
        if handle not in self._tasks:
            raise HILError(f"There is no task {handle}.")
        return self._tasks[handle]

    def _chosen(self, channels: Channels | None, count: int, kind: str) -> tuple[int, ...]:
        """Return the first ``count`` channel numbers.

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

    def _by_channel(
        self, kind: str, channels: Channels, count: int, buffer: NDArray[Any], values: str
    ) -> dict[int, Any]:
        """Return the values in a buffer by channel, checked."""
        chosen = self._chosen(channels, count, kind)
        check_buffer(buffer, count, values)
        return dict(zip(chosen, buffer[:count].tolist(), strict=True)) if count else {}

    def _voltages(self, channels: Channels, count: int, buffer: Vector) -> dict[int, float]:
        voltages = self._by_channel(ANALOG_OUTPUT, channels, count, buffer, "analog")
        for channel, voltage in voltages.items():
            if not math.isfinite(voltage):
                raise HILError(f"Analog output {channel} cannot be set to {voltage}: not a finite voltage.")
        return voltages

    def _choose_ranges(self, kind: str, channels: Channels, count: int, minima: Vector, maxima: Vector) -> None:
        lowest = self._by_channel(kind, channels, count, minima, "analog")
        highest = self._by_channel(kind, channels, count, maxima, "analog")
        self._set_ranges(kind, {channel: (lowest[channel], highest[channel]) for channel in lowest})


#: The names of all verbs.
VERBS = tuple(name for name in vars(Board) if not name.startswith("_"))


def _put(values: Values, buffers: _Buffers, at: int) -> None:
    """Put one sample into the buffers, as sample number ``at``."""
    for sample, buffer in zip(values, buffers, strict=True):
        if sample and buffer is not None:
            for place, value in enumerate(sample, at * len(sample)):
                buffer[place] = value


def check_buffer(buffer: NDArray[Any] | None, size: int, kind: str) -> None:
    """Raise :class:`HILError` unless a buffer can hold ``size`` values of a kind.

    Parameters
    ----------
    buffer : one-dimensional numpy array of that kind's type
    size : nothing is checked where it is 0
    kind : "encoder", "analog", "digital", "state" or "mode"
    """
    dtype = BUFFERS[kind]
    if size and (not isinstance(buffer, np.ndarray) or buffer.dtype != dtype or buffer.ndim != 1 or buffer.size < size):
        raise HILError(f"The {kind} buffer must be a one-dimensional numpy array of {size} {dtype.name}.")
