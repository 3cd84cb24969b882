"""Signals that something can be identified from: finite, long enough, and moving."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotflex.courseware.messages import _
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
            _("This needs the channel {name!r}; the recording has {names}.").format(
                name=name, names=", ".join(recording.channels)
            )
        )
    return signal_of(_("The channel {name!r}").format(name=name), recording[name], may_be_constant)


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
        raise IdentificationError(
            _("{what} must be a vector of finite numbers; its shape is {signal_shape}.").format(
                what=what, signal_shape=signal.shape
            )
        )
    if signal.size < FEWEST_SAMPLES:
        raise IdentificationError(
            _("{what} has {signal_size} samples; at least {fewest_samples} are needed.").format(
                what=what, signal_size=signal.size, fewest_samples=FEWEST_SAMPLES
            )
        )
    if not may_be_constant and np.ptp(signal) == 0:
        raise IdentificationError(
            _("{what} is constant, {signal:g}: nothing moved, or a cable is loose.").format(what=what, signal=signal[0])
        )
    return signal
