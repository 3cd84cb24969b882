"""The interface of a data-acquisition board, with the maker's verbs and the maker's numbers.

Everything above (bench, loop, experiments) speaks to a board through this protocol alone, so that a virtual board and
a real one are interchangeable. Buffers and channel lists are numpy arrays: channels uint32, encoder counts int32,
analog values float64, digital values int8. Every method raises :class:`~rotflex.errors.HILError` when it fails.

``tests/hil/contract`` holds every board against it.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from rotflex.errors import HILError

CHANNEL = np.dtype(np.uint32)
BUFFERS: dict[str, np.dtype[Any]] = {
    "encoder": np.dtype(np.int32),
    "analog": np.dtype(np.float64),
    "digital": np.dtype(np.int8),
    "state": np.dtype(np.int32),
    "mode": CHANNEL,
}

Channels = NDArray[np.uint32]
Counts = NDArray[np.int32]
Levels = NDArray[np.int8]
Vector = NDArray[np.float64]


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


@runtime_checkable
class Board(Protocol):
    """An open data-acquisition board."""

    def is_valid(self) -> bool:
        """Whether the board is open."""

    def close(self) -> None:
        """Close the board. Outputs keep their last value: set them to 0 V first."""

    # Immediate input and output ---------------------------------------------------------------------------------

    def set_encoder_counts(self, channels: Channels, num_channels: int, counts: Counts) -> None:
        """Set what the encoder counters read now."""

    def set_encoder_quadrature_mode(self, channels: Channels, num_channels: int, modes: Channels) -> None:
        """Choose how many edges each encoder counts, see :class:`EncoderQuadratureMode`."""

    def set_encoder_filter_frequency(self, channels: Channels, num_channels: int, frequencies: Vector) -> None:
        """Choose the frequency (Hz) above which edges of an encoder are taken for noise."""

    def set_analog_input_ranges(self, channels: Channels, num_channels: int, minima: Vector, maxima: Vector) -> None:
        """Choose the ranges (V) of analog inputs."""

    def set_analog_output_ranges(self, channels: Channels, num_channels: int, minima: Vector, maxima: Vector) -> None:
        """Choose the ranges (V) of analog outputs."""

    def read_encoder(self, channels: Channels, num_channels: int, buffer: Counts) -> None:
        """Read encoder counts into ``buffer``."""

    def read_analog(self, channels: Channels, num_channels: int, buffer: Vector) -> None:
        """Read analog inputs (V) into ``buffer``."""

    def write_analog(self, channels: Channels, num_channels: int, buffer: Vector) -> None:
        """Write analog outputs (V) from ``buffer``."""

    def write_digital(self, channels: Channels, num_channels: int, buffer: Levels) -> None:
        """Write digital outputs from ``buffer``."""

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

    def set_card_specific_options(self, options: str, size: int) -> None:
        """Set options that only this kind of board knows."""

    # Hardware-timed input ---------------------------------------------------------------------------------------

    def task_create_encoder_reader(self, samples_in_buffer: int, channels: Channels, num_channels: int) -> int:
        """Create a task that samples encoders, and return its handle."""

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

    def task_set_buffer_overflow_mode(self, task: int, mode: int) -> None:
        """Choose what happens to samples that nobody fetched in time."""

    def task_start(self, task: int, clock: int, frequency: float, num_samples: int) -> None:
        """Start sampling at ``frequency`` (Hz); with ``num_samples`` of 2**32 - 1, until stopped."""

    def task_read_encoder(self, task: int, num_samples: int, buffer: Counts) -> int:
        """Wait for samples, put them into ``buffer``, and return how many came."""

    def task_read(
        self,
        task: int,
        num_samples: int,
        analog_buffer: Vector | None,
        encoder_buffer: Counts | None,
        digital_buffer: Levels | None,
        other_buffer: Vector | None,
    ) -> int:
        """Wait for samples of all kinds, put them into the buffers, and return how many came."""

    def task_get_buffer_overflows(self, task: int) -> int:
        """How often the buffer overflowed since the start; the maker does not say how many samples each time lost."""

    def task_flush(self, task: int) -> None:
        """Wait until all that a writer was given is out. A reader's samples stay: they are dropped by reading them."""

    def task_stop(self, task: int) -> None:
        """Stop sampling."""

    def task_delete(self, task: int) -> None:
        """Delete the task."""

    # Watchdog ---------------------------------------------------------------------------------------------------

    def watchdog_set_analog_expiration_state(self, channels: Channels, num_channels: int, voltages: Vector) -> None:
        """Choose the analog outputs (V) that an expired watchdog sets."""

    def watchdog_set_digital_expiration_state(self, channels: Channels, num_channels: int, states: Counts) -> None:
        """Choose what an expired watchdog does to digital outputs, see :class:`DigitalState`."""

    def watchdog_start(self, timeout: float) -> None:
        """Start the watchdog: without a reload for ``timeout`` (s) it expires."""

    def watchdog_reload(self) -> bool:
        """Show that the program is alive, and whether it was in time: False if the watchdog had expired before."""

    def watchdog_is_expired(self) -> bool:
        """Whether the watchdog has expired."""

    def watchdog_clear(self) -> None:
        """Let the board be used again after the watchdog expired.

        A board may set its outputs to what they were before, and its watchdog may go on running: both are left open.
        """

    def watchdog_stop(self) -> None:
        """Stop the watchdog."""


#: The names of all verbs.
VERBS = tuple(name for name in vars(Board) if not name.startswith("_"))


def check_buffer(buffer: NDArray[Any] | None, size: int, kind: str) -> None:
    """Check that a buffer can hold ``size`` values of a kind ("encoder", "analog", "digital", "state" or "mode").

    Raises
    ------
    HILError
        If it is not a one-dimensional numpy array of that kind's type, or too small.
    """
    if size == 0:
        return
    dtype = BUFFERS[kind]
    if not isinstance(buffer, np.ndarray) or buffer.dtype != dtype or buffer.ndim != 1 or buffer.size < size:
        raise HILError(f"The {kind} buffer must be a one-dimensional numpy array of {size} {dtype.name}.")
