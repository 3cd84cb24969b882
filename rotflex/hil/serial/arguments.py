"""What the board's verbs are given, checked."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotflex.courseware.messages import _
from rotflex.errors import HILError
from rotflex.hil.board import CHANNEL, check_buffer


def chosen(channels: NDArray[Any] | None, count: int, available: int, kind: str) -> tuple[int, ...]:
    """The first ``count`` of the channels.

    Raises
    ------
    HILError
        If there are not so many, or not such ones.
    """
    if count == 0:
        return ()
    if not isinstance(channels, np.ndarray) or channels.dtype != CHANNEL or channels.ndim != 1:
        raise HILError(
            _("The {kind} channels must be a numpy vector of uint32; they are {channels!r}.").format(
                kind=kind, channels=channels
            )
        )
    numbers = tuple(channels[:count].tolist())
    if len(numbers) != count or any(number >= available for number in numbers):
        raise HILError(
            _("There are {available} {kind} channels, from 0; asked for: {channels}.").format(
                available=available, kind=kind, channels=channels.tolist()
            )
        )
    return numbers


def finite_voltages(count: int, buffer: NDArray[Any]) -> list[float]:
    """The first ``count`` voltages.

    Raises
    ------
    HILError
        If there are not so many, or one is not a finite number.
    """
    check_buffer(buffer, count, "analog")
    values: list[float] = buffer[:count].tolist()
    for value in values:
        if not math.isfinite(value):
            raise HILError(_("An analog output cannot be set to {value}: not a finite voltage.").format(value=value))
    return values


def same_for_all(given: NDArray[Any], count: int, only: float, refusal: str) -> None:
    """Raise ``refusal``, unless the first ``count`` values are what the board has.

    Raises
    ------
    HILError
        If one is another.
    """
    if not all(math.isclose(value, only, abs_tol=1e-6) for value in np.asarray(given).ravel()[:count].tolist()):
        raise HILError(refusal)
