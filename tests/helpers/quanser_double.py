"""A double of the maker's Python package, as strict as its documentation: what that does not say fails the test.

It stands on the virtual board, which moves; all else is its own: signatures, types of buffers, the order of calls,
errors whose text is a number, and what a watchdog does once it has expired. Where that is not documented, there is a
:class:`Variant` for each possibility.
"""

from __future__ import annotations

import array
import math
import sys
from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum
from types import ModuleType
from typing import Any

import numpy as np

from rotflex.errors import HILError as OurError
from rotflex.hil.board import BufferOverflowMode, DigitalState
from rotflex.hil.virtual import VirtualBoard

FOREVER = 2**32 - 1


class Undocumented(AssertionError):
    """Something was asked for that the documentation does not promise."""


class GenericError(Exception):
    """The base of the maker's errors: its text is a number."""

    def __init__(self, error_code: int, words: str) -> None:
        super().__init__(str(error_code))
        self.error_code, self._words = error_code, words

    def get_error_message(self) -> str:
        if not self._words:
            raise GenericError(-1, "nothing")
        return self._words


class HILError(GenericError):
    """An error of a board."""


class StringProperty(IntEnum):
    SERIAL_NUMBER = 3


@dataclass(frozen=True)
class Variant:
    """What a board may do between the expiry of its watchdog and the next write.

    again : how often it expires again before something is written, once cleared; until it is stopped for ``inf``
    runs_on : whether it goes on running, once cleared
    restores : whether clearing it sets the outputs to what they were
    locks : what it locks: outputs, or inputs as well
    stops : whether it can be stopped while it is expired
    complains : whether clearing it fails though it is cleared; code that the maker's QUARC writes allows for that
    tristate : whether an expired watchdog sets analog outputs only where all digital ones are to go tristate
    zero : whether it sets 0 V though nothing was configured
    refuses : verbs that it does not have
    words : whether its errors have words
    serial : its serial number; None where it cannot tell it
    """

    again: float = 0
    runs_on: bool = False
    restores: bool = False
    locks: str = "outputs"
    stops: bool = True
    complains: bool = False
    tristate: bool = False
    zero: bool = False
    refuses: frozenset[str] = frozenset()
    words: bool = True
    serial: str | None = "1001"


VARIANTS = {
    "once cleared it stands": Variant(),
    "it runs on": Variant(runs_on=True),
    "the outputs come back": Variant(restores=True),
    "they come back and it runs on": Variant(restores=True, runs_on=True),
    "it expires once more before a write": Variant(again=1, runs_on=True),
    "they come back and it expires twice more": Variant(again=2, runs_on=True, restores=True),
    "it expires until it is stopped": Variant(again=math.inf, runs_on=True),
    "they come back and it expires until it is stopped": Variant(again=math.inf, runs_on=True, restores=True),
    "clearing it fails, and clears it": Variant(complains=True),
    "it locks inputs, too": Variant(locks="all"),
    "it locks inputs, too, and cannot be stopped": Variant(locks="all", stops=False, restores=True, runs_on=True),
}

#: What a board need not have.
OPTIONAL = frozenset(
    {
        "watchdog_set_analog_expiration_state",
        "watchdog_set_digital_expiration_state",
        "task_set_buffer_overflow_mode",
        "set_encoder_quadrature_mode",
        "set_encoder_filter_frequency",
    }
)
#: Digital outputs, where a watchdog looks at them.
LINES = 8

_TYPES: dict[str, tuple[Any, str]] = {
    "channels": (np.uint32, "I"),
    "modes": (np.uint32, "I"),
    "counts": (np.int32, "i"),
    "voltages": (np.float64, "d"),
    "levels": (np.int8, "b"),
    "states": (np.int32, "i"),
}


def _buffer(kind: str, buffer: Any, size: int) -> None:
    """A numpy array or an array.array of the documented type, long enough."""
    dtype, code = _TYPES[kind]
    if isinstance(buffer, np.ndarray):
        fits = buffer.dtype == dtype and buffer.ndim == 1
    else:
        fits = isinstance(buffer, array.array) and buffer.typecode == code
    if not fits or len(buffer) < size:
        raise TypeError(f"the buffer of {kind} is no array of {size} {np.dtype(dtype).name}")


def _count(*numbers: Any) -> None:
    for number in numbers:
        if not isinstance(number, int) or isinstance(number, bool) or number < 0:
            raise TypeError(f"an integer is required, not {number!r}")


class HIL:
    """The maker's class, with the documented methods and no others."""

    #: Set by :func:`package`: makes what hangs on the card, and says what happens after the watchdog expired.
    make: Callable[[], VirtualBoard]
    variant: Variant
    opened: list[HIL]

    def __init__(self, card_type: str | None = None, card_identifier: str = "0") -> None:
        self._inner: VirtualBoard | None = None
        self._watching = False
        self._again = 0.0
        self._held: dict[int, float] = {}
        self._capacity: dict[int, int] = {}
        self._running: set[int] = set()
        self._at_expiry: dict[int, float] = {}
        self._tristate: set[int] = set()
        if card_type is not None:
            self.open(card_type, card_identifier)

    def __getattr__(self, name: str) -> Any:
        raise Undocumented(f"HIL has no documented {name}")

    # --- the card ------------------------------------------------------------------------------------------------

    def open(self, card_type: str, card_identifier: str = "0") -> None:
        if self._inner is not None:
            raise Undocumented("a card is opened that is open")
        if not isinstance(card_type, str) or not isinstance(card_identifier, str):
            raise TypeError("card type and identifier are text")
        if card_type not in ("q2_usb", "q8_usb", "qpid_e"):
            raise HILError(-1075, f"The specified board type {card_type} is not supported.")
        if card_identifier != "0" and "@tcpip://" not in card_identifier:
            raise HILError(-1073, "The specified board was not found.")
        self.simulated = "@" in card_identifier
        self._inner = type(self).make()
        self._at_expiry = {0: 0.0, 1: 0.0} if self.variant.zero else {}
        self._arm()
        self.opened.append(self)

    def close(self) -> None:
        self._card()
        assert self._inner is not None
        self._inner.close()

    def is_valid(self) -> bool:
        return self._inner is not None and self._inner.is_valid()

    def set_card_specific_options(self, options: str, size: int) -> None:
        if not isinstance(options, str):
            raise TypeError("options are text")
        _count(size)
        if size != len(options.encode()):
            raise Undocumented("the size of the options is not theirs")
        self._do("set_card_specific_options", options, size)

    def get_string_property(self, property_code: int, buffer_size: int) -> str:
        self._card()
        _count(buffer_size)
        if property_code != StringProperty.SERIAL_NUMBER or self.variant.serial is None:
            raise HILError(-1091, "The property is not supported.")
        return self.variant.serial

    # --- immediate -----------------------------------------------------------------------------------------------

    def write_analog(self, channels: Any, num_channels: int, buffer: Any) -> None:
        self._channels(channels, num_channels)
        _buffer("voltages", buffer, num_channels)
        if not all(math.isfinite(value) for value in buffer[:num_channels]):
            raise Undocumented("a voltage is written that is no number")
        self._do("write_analog", channels, num_channels, buffer, writes=True)
        self._held |= dict(zip(list(channels)[:num_channels], list(buffer)[:num_channels], strict=True))

    def read(self, *arguments: Any) -> None:
        assert len(arguments) == 12
        kinds = ("voltages", "counts", "levels", "voltages")
        for kind, channels, number, buffer in zip(kinds, arguments[:8:2], arguments[1:8:2], arguments[8:], strict=True):
            self._channels(channels, number)
            if number:
                _buffer(kind, buffer, number)
        self._do("read", *arguments, reads=True)

    # --- tasks ---------------------------------------------------------------------------------------------------

    def task_create_encoder_reader(self, samples_in_buffer: int, channels: Any, num_channels: int) -> int:
        return self._create("task_create_encoder_reader", samples_in_buffer, channels, num_channels)

    def task_create_reader(self, samples_in_buffer: int, *asked: Any) -> int:
        assert len(asked) == 8
        return self._create("task_create_reader", samples_in_buffer, *asked)

    def _create(self, verb: str, samples_in_buffer: int, *asked: Any) -> int:
        _count(samples_in_buffer)
        for channels, number in zip(asked[::2], asked[1::2], strict=True):
            self._channels(channels, number)
        task = int(self._do(verb, samples_in_buffer, *asked))
        self._capacity[task] = samples_in_buffer
        return task

    def task_set_buffer_overflow_mode(self, task: int, mode: int) -> None:
        _count(task, mode)
        if task in self._running:
            raise Undocumented("the overflow mode of a task that is running is changed")
        if mode >= BufferOverflowMode.WAIT_ON_OVERFLOW and mode in list(BufferOverflowMode) and not self.simulated:
            raise HILError(-1120, "The overflow mode is for simulated cards only.")
        self._do("task_set_buffer_overflow_mode", task, mode)

    def task_start(self, task: int, clock: int, frequency: float, num_samples: int) -> None:
        _count(task, num_samples)
        if not isinstance(clock, int) or not isinstance(frequency, float) or num_samples > FOREVER:
            raise TypeError("a clock, a frequency and an unsigned number of samples are required")
        if task in self._running:
            raise Undocumented("a task is started that is running")
        self._do("task_start", task, clock, frequency, num_samples)
        self._running.add(task)

    def task_read_encoder(self, task: int, num_samples: int, buffer: Any) -> int:
        _count(task, num_samples)
        self._samples(task, num_samples)
        if task in self._running and num_samples:
            _buffer("counts", buffer, num_samples)
        return int(self._do("task_read_encoder", task, num_samples, buffer, reads=True))

    def task_read(self, task: int, num_samples: int, *buffers: Any) -> int:
        assert len(buffers) == 4
        _count(task, num_samples)
        self._samples(task, num_samples)
        return int(self._do("task_read", task, num_samples, *buffers, reads=True))

    def task_get_buffer_overflows(self, task: int) -> int:
        return int(self._of_task("task_get_buffer_overflows", task))

    def task_flush(self, task: int) -> None:
        self._of_task("task_flush", task)

    def task_stop(self, task: int) -> None:
        self._of_task("task_stop", task)
        self._running.discard(task)

    def task_delete(self, task: int) -> None:
        self._of_task("task_delete", task)
        self._running.discard(task)

    def _of_task(self, verb: str, task: int) -> Any:
        _count(task)
        return self._do(verb, task)

    # --- the watchdog --------------------------------------------------------------------------------------------

    def watchdog_set_analog_expiration_state(self, channels: Any, num_channels: int, voltages: Any) -> None:
        self._channels(channels, num_channels)
        _buffer("voltages", voltages, num_channels)
        self._do("watchdog_set_analog_expiration_state", channels, num_channels, voltages, writes=True)
        self._at_expiry |= dict(zip(list(channels)[:num_channels], list(voltages)[:num_channels], strict=True))
        self._arm()

    def watchdog_set_digital_expiration_state(self, channels: Any, num_channels: int, states: Any) -> None:
        self._channels(channels, num_channels)
        _buffer("states", states, num_channels)
        if self._watching:
            raise Undocumented("expiration states are set while a watchdog runs")
        self._do("watchdog_set_digital_expiration_state", channels, num_channels, states, writes=True)
        chosen = zip(list(channels)[:num_channels], list(states)[:num_channels], strict=True)
        self._tristate |= {channel for channel, state in chosen if state == DigitalState.TRISTATE}
        self._arm()

    def _arm(self) -> None:
        """What an expiry will do to the analog outputs."""
        configured = not self.variant.tristate or self._tristate == set(range(LINES))
        self._card()._watchdog.states = dict(self._at_expiry) if configured else {}

    def watchdog_start(self, timeout: float) -> None:
        if not isinstance(timeout, float):
            raise TypeError("a time-out is a float")
        if self._watching:
            raise Undocumented("a watchdog is started that is running")
        self._do("watchdog_start", timeout)
        self._watching, self._again = True, 0.0

    def watchdog_reload(self) -> bool:
        self._card()
        if not self._watching:
            raise Undocumented("a watchdog is reloaded that is not running")
        return bool(self._do("watchdog_reload"))

    def watchdog_is_expired(self) -> bool:
        return bool(self._do("watchdog_is_expired"))

    def watchdog_clear(self) -> None:
        expired, inner = self.watchdog_is_expired(), self._card()
        self._do("watchdog_clear")
        if expired:
            self._cleared(inner)
        if self.variant.complains:
            raise HILError(-1089, "It was not possible to restore what was before the watchdog expired.")

    def _cleared(self, inner: VirtualBoard) -> None:
        if self.variant.restores:
            inner.terminals.set(self._held)
        if self.variant.runs_on:
            inner._watchdog.deadline = inner.clock.now() + inner._watchdog.timeout
            self._again = self._again if self._again else self.variant.again + 1
        else:
            self._do("watchdog_stop")
            self._watching = False

    def watchdog_stop(self) -> None:
        if self.watchdog_is_expired() and not self.variant.stops:
            raise HILError(-1085, "The watchdog has expired.")
        self._do("watchdog_stop")
        self._watching, self._again = False, 0.0

    # --- how strict it is ----------------------------------------------------------------------------------------

    def _card(self) -> VirtualBoard:
        if self._inner is None or not self._inner.is_valid():
            raise HILError(-1074, "The board is closed: its handle is not valid.")
        return self._inner

    def _channels(self, channels: Any, number: int) -> None:
        self._card()
        _count(number)
        if number and channels is not None:
            _buffer("channels", channels, 1)
        elif number:
            raise TypeError("the channels are no array of uint32")

    def _samples(self, task: int, number: int) -> None:
        self._card()
        if number > self._capacity.get(task, number):
            raise Undocumented("more samples are asked for than the buffer holds")

    def _do(self, verb: str, *arguments: Any, reads: bool = False, writes: bool = False) -> Any:
        inner = self._card()
        if verb in self.variant.refuses:
            raise HILError(-1040, "The card does not support this." if self.variant.words else "")
        if writes and self._again > 1 and self._watching:  # it expires again before something is written
            self._again -= 1
            inner.terminals.set(inner._watchdog.states)
            inner._watchdog.expired = True
        if (writes or (reads and self.variant.locks == "all")) and inner.watchdog_is_expired():
            raise HILError(-1085, "The watchdog has expired, and prevents access.")
        try:
            return getattr(inner, verb)(*arguments)
        except OurError as error:
            raise HILError(-1001, str(error)) from None


#: Verbs of channels, their number and buffers: the buffers' kinds, and whether one reads or writes.
_OF_CHANNELS: dict[str, tuple[tuple[str, ...], dict[str, bool]]] = {
    "set_encoder_counts": (("counts",), {}),
    "set_encoder_quadrature_mode": (("modes",), {}),
    "set_encoder_filter_frequency": (("voltages",), {}),
    "set_analog_input_ranges": (("voltages", "voltages"), {}),
    "set_analog_output_ranges": (("voltages", "voltages"), {}),
    "read_encoder": (("counts",), {"reads": True}),
    "read_analog": (("voltages",), {"reads": True}),
    "write_digital": (("levels",), {"writes": True}),
}


def _of_channels(verb: str, kinds: tuple[str, ...], access: dict[str, bool]) -> Callable[..., None]:
    def call(card: HIL, channels: Any, num_channels: int, *buffers: Any) -> None:
        card._channels(channels, num_channels)
        for kind, buffer in zip(kinds, buffers, strict=True):
            _buffer(kind, buffer, num_channels)
        card._do(verb, channels, num_channels, *buffers, **access)

    return call


for _verb, (_kinds, _access) in _OF_CHANNELS.items():
    setattr(HIL, _verb, _of_channels(_verb, _kinds, _access))


def package(
    make: Callable[[], VirtualBoard], variant: Variant | None = None
) -> tuple[dict[str, ModuleType], list[HIL]]:
    """The maker's modules by name, and a list of the cards that will be opened."""
    opened: list[HIL] = []
    card = type("HIL", (HIL,), {"make": staticmethod(make), "variant": variant or Variant(), "opened": opened})
    hardware, common, root = ModuleType("quanser.hardware"), ModuleType("quanser.common"), ModuleType("quanser")
    hardware.HILError, hardware.StringProperty = HILError, StringProperty  # type: ignore[attr-defined]
    hardware.HIL, common.GenericError = card, GenericError  # type: ignore[attr-defined]
    root.hardware, root.common = hardware, common  # type: ignore[attr-defined]
    return {"quanser": root, "quanser.hardware": hardware, "quanser.common": common}, opened


def install(monkeypatch: Any, make: Callable[[], VirtualBoard], variant: Variant | None = None) -> list[HIL]:
    """Have the maker's package imported in a test; return the list of the cards that will be opened."""
    modules, opened = package(make, variant)
    for name, module in modules.items():
        monkeypatch.setitem(sys.modules, name, module)
    return opened


def output(card: HIL, channel: int = 0) -> float:
    """What is on an output now, V."""
    assert card._inner is not None
    return card._inner.terminals.commanded[channel]
