"""How near two own answers must be to agree, how numbers are shown, and what is read off stored recordings.

Tolerances are wide: an answer may be rounded to two digits, and what is built on it worked out from all of them. A
question to the student must be beyond all that honest work gives (``tests/whole/test_right_ways.py`` compares it with
the right ways on several benches).

A stored recording has 400 points of each channel, evenly spread; frequencies of the arm and sizes of a response are in
it, the height of a voltage's short peak is not.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from labcourse.answers.json_values import thin
from rotflex.identification import SWEEP_BAND
from rotflex.recording import UNITS, Recording
from rotflex.units import HZ

AnyArray = NDArray[Any]
StoredRecording = Mapping[str, Any]  # a recording as the answers have it

CARRIED = 0.06  #: relative: a number that is repeated, perhaps with two digits
BUILT = 0.12  #: relative: a number that follows from others of two digits, one of them squared
_LOST = 0.005  # of a power of the fastest pole: a coefficient that is smaller is lost in rounding
_ZEROS = 16  # times as many points, so that a peak is not held to the grid


def hertz(omega: float) -> str:
    """A frequency (rad/s) in Hz, for people."""
    return f"{omega / HZ:.3g} Hz"


def alike(first: ArrayLike, second: ArrayLike, rtol: float, atol: float = 0.0) -> bool:
    """Whether two numbers or arrays are the same, entry by entry; of 0 only ``atol`` is near."""
    a, b = np.ravel(first), np.ravel(second)
    return a.shape == b.shape and bool(np.all(np.abs(a - b) <= atol + rtol * np.maximum(np.abs(a), np.abs(b))))


def same_polynomial(first: ArrayLike, second: ArrayLike, rtol: float = CARRIED) -> bool:
    """Whether two polynomials, highest power first and 1, have the same coefficients."""
    a, b = np.ravel(np.real(first)), np.ravel(np.real(second))
    if a.shape != b.shape:
        return False
    fastest = max(1.0, float(np.abs(np.roots(b)).max(initial=0.0)))
    room = rtol * np.abs(b) + _LOST * fastest ** np.arange(b.size)
    return bool(np.all(np.abs(a - b) <= room))


def same_poles(first: ArrayLike, second: ArrayLike, rtol: float = CARRIED) -> bool:
    """Whether two sets of poles are the same, each within a part of the fastest one of the second."""
    left, right = list(np.ravel(first)), list(np.ravel(second))
    room = rtol * max(np.abs(right).max(), 1e-9)
    for pole in right:
        nearest = min(left, key=lambda candidate: abs(candidate - pole), default=None)
        if nearest is None or abs(nearest - pole) > room:
            return False
        left.remove(nearest)
    return not left


def listed(poles: ArrayLike) -> str:
    """Poles for people, slowest first."""
    every = sorted(np.ravel(np.asarray(poles, dtype=complex)), key=lambda p: (round(-p.real, 6), p.imag))
    return ", ".join(f"{complex(p):.3g}" if abs(p.imag) > 1e-6 else f"{p.real:.3g}" for p in every)


# --- stored recordings ------------------------------------------------------------------------------------------------


def stored_channel(stored: StoredRecording, name: str) -> AnyArray:
    """Return the stored points of a channel.

    Raises
    ------
    LookupError
        If it was not recorded.
    """
    points: AnyArray = stored["channels"][name]["values"]
    return points


def stored_recording(stored: StoredRecording) -> Recording:
    """Turn a stored recording into a Recording of fewer samples."""
    time = stored["sample_time"] * thin_indices(stored)
    step = float(time[-1]) / (time.size - 1)
    channels = {name: one["values"] for name, one in stored["channels"].items() if name in UNITS}
    return Recording.of(step * np.arange(time.size), dict(stored["metadata"]), **channels)


def thin_indices(stored: StoredRecording) -> AnyArray:
    """Which samples were stored."""
    return thin(stored["n"], next(iter(stored["channels"].values()))["values"].size)


def sweep_spectrum(stored: StoredRecording) -> tuple[AnyArray, AnyArray]:
    """Frequencies (rad/s) that the sweep goes through, and the amplitude of alpha there, of the largest."""
    alpha = stored_channel(stored, "alpha")
    dt = stored["sample_time"] * (stored["n"] - 1) / (alpha.size - 1)
    f = np.fft.rfftfreq(_ZEROS * alpha.size, dt)
    amplitude = np.abs(np.fft.rfft(alpha - alpha.mean(), _ZEROS * alpha.size))
    swept = (f >= SWEEP_BAND[0]) & (f <= SWEEP_BAND[1])
    return HZ * f[swept], amplitude[swept] / amplitude[swept].max()
