"""What a board of ours is told, checked: channels that exist, buffers of the right type, voltages that are numbers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotflex.errors import HILError
from rotflex.hil.board import CHANNEL, Channels, Vector, check_buffer


class KnownChannels:
    """Lists of channels that were found to be right: the same few come every sample."""

    def __init__(self) -> None:
        self._known: dict[tuple[bytes, int, str], tuple[int, ...]] = {}

    def of(self, channels: Channels | None, count: int, available: int, kind: str) -> tuple[int, ...]:
        """The first ``count`` channel numbers.

        Raises
        ------
        HILError
            If they are no vector of uint32, or there are no such channels.
        """
        if count == 0:
            return ()
        if not isinstance(channels, np.ndarray) or channels.dtype != CHANNEL or channels.ndim != 1:
            raise HILError(f"The {kind} channels must be a numpy vector of uint32; they are {channels!r}.")
        key = (channels.tobytes(), count, kind)
        chosen = self._known.get(key)
        if chosen is None:
            chosen = tuple(channels[:count].tolist())
            if len(chosen) != count or any(channel >= available for channel in chosen):
                raise HILError(f"There are {available} {kind} channels, from 0; asked for: {channels.tolist()}.")
            self._known[key] = chosen
        return chosen


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


def within(chosen: Sequence[int], buffer: Vector, ranges: Sequence[tuple[float, float]]) -> dict[int, float]:
    """Voltages by analog output, cut to what the converter can give in its range.

    Raises
    ------
    HILError
        As :func:`finite`.
    """
    bounds = (ranges[channel] for channel in chosen)
    return {
        channel: min(max(voltage, lowest), highest)
        for channel, voltage, (lowest, highest) in zip(chosen, finite(chosen, buffer), bounds, strict=True)
    }


def ranges(chosen: Sequence[int], minima: Vector, maxima: Vector, widest: float) -> dict[int, tuple[float, float]]:
    """Ranges (V) by channel.

    Raises
    ------
    HILError
        If one has its minimum above its maximum, or goes beyond ±``widest``.
    """
    for buffer in (minima, maxima):
        check_buffer(buffer, len(chosen), "analog")
    found = dict(zip(chosen, zip(minima.tolist(), maxima.tolist(), strict=True), strict=False))
    for channel, (lowest, highest) in found.items():
        if not -widest <= lowest < highest <= widest:
            raise HILError(f"Channel {channel} has no range from {lowest} V to {highest} V: ±{widest:g} V at the most.")
    return found


def check_modes(buffer: NDArray[Any] | None, size: int) -> None:
    """Check that quadrature modes are a vector of uint32.

    Raises
    ------
    HILError
        If they are not.
    """
    if not isinstance(buffer, np.ndarray) or buffer.dtype != CHANNEL or buffer.ndim != 1 or buffer.size < size:
        raise HILError(f"The modes must be a one-dimensional numpy array of {size} uint32.")


def same_for_all(given: NDArray[Any], count: int, only: float, refusal: str) -> None:
    """Check that the first ``count`` values are the only one that a board has.

    Raises
    ------
    HILError
        With that refusal, if one is another.
    """
    if not all(math.isclose(value, only, abs_tol=1e-6) for value in given[:count].tolist()):
        raise HILError(refusal)
