"""Signals that something can be identified from: finite, long enough, and moving."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotflex.errors import IdentificationError
from rotflex.recording import Recording

FEWEST_SAMPLES = 64

Vector = NDArray[np.float64]


def channel(recording: Recording, name: str, may_be_constant: bool = False) -> Vector:
    """Samples (n,) of a channel that identification needs.

    Raises
    ------
    IdentificationError
        If the recording lacks it, or if it is too short or constant.
    """
    if name not in recording:
        raise IdentificationError(
            f"This needs the channel {name!r}; the recording has {', '.join(recording.channels)}."
        )
    return signal_of(f"The channel {name!r}", recording[name], may_be_constant)


def signal_of(what: str, values: ArrayLike, may_be_constant: bool = False) -> Vector:
    """An array (n,) that identification can use.

    Parameters
    ----------
    what : it is, for the message
    values : as they were given
    may_be_constant : whether it need not move

    Raises
    ------
    IdentificationError
        If it is no vector of finite numbers, or too short or constant.
    """
    signal = np.asarray(values, dtype=float)
    if signal.ndim != 1 or not np.isfinite(signal).all():
        raise IdentificationError(f"{what} must be a vector of finite numbers; its shape is {signal.shape}.")
    if signal.size < FEWEST_SAMPLES:
        raise IdentificationError(f"{what} has {signal.size} samples; at least {FEWEST_SAMPLES} are needed.")
    if not may_be_constant and np.ptp(signal) == 0:
        raise IdentificationError(f"{what} is constant, {signal[0]:g}: nothing moved, or a cable is loose.")
    return signal
