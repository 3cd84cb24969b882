"""A recording in the plant's place: what was measured once, through the same verbs."""

from __future__ import annotations

import math

from rotflex.errors import RecordingError
from rotflex.plant import State
from rotflex.recording import Recording


class RecordedPlant:
    """Moves as a recording says, whatever voltage it is given; at the end it stays where it is.

    Parameters
    ----------
    recording : with theta and alpha

    Raises
    ------
    RecordingError
        If one of them is missing.
    """

    def __init__(self, recording: Recording) -> None:
        missing = [name for name in ("theta", "alpha") if name not in recording]
        if missing:
            raise RecordingError(f"The recording has no {' and no '.join(missing)}: there is nothing to replay.")
        self.recording = recording
        self._theta, self._alpha = recording["theta"].tolist(), recording["alpha"].tolist()
        self._elapsed = 0.0

    @property
    def state(self) -> State:
        """Angles between two samples lie on a straight line, of which the rates are the slopes."""
        dt = self.recording.sample_time
        last = len(self._theta) - 1
        place = min(max(self._elapsed / dt, 0.0), float(last))
        index = min(math.floor(place), last - 1)
        part = place - index
        angles = (self._theta, self._alpha)
        rises = [values[index + 1] - values[index] for values in angles]
        theta, alpha = (values[index] + part * rise for values, rise in zip(angles, rises, strict=True))
        if place >= last:
            return State(theta, alpha, 0.0, 0.0)
        return State(theta, alpha, rises[0] / dt, rises[1] / dt)

    def advance(self, voltage: float, duration: float) -> State:
        """Let time pass; the voltage changes nothing."""
        self._elapsed += duration
        return self.state
