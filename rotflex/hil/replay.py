"""A recording in the plant's place: what was measured once, through the same verbs.

A recording cannot be steered. So a replay gives a run only if it *is* that run: a controller that is fed with the
recorded angles has to set the voltages that were recorded. That needs no word of the recording's about itself, and
holds for the log of a real bench as well. All else is refused.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from rotflex.errors import BenchError, RecordingError
from rotflex.hil import answered
from rotflex.hil.board import Vector
from rotflex.plant import State
from rotflex.recording import Recording
from rotflex.unanswered import TIMING, cut

_SAME_PERIOD = 1e-6  # of the sample time


class RecordedPlant:
    """Moves as a recording says, whatever voltage it is given; at the end it stays where it is.

    Parameters
    ----------
    recording : with theta and alpha
    name : of its file

    Raises
    ------
    RecordingError
        If one of them is missing.
    """

    def __init__(self, recording: Recording, name: str = "the recording") -> None:
        missing = [name for name in ("theta", "alpha") if name not in recording]
        if missing:
            raise RecordingError(f"The recording lacks {' and '.join(missing)}: there is nothing to replay.")
        self.recording, self.name = recording, name
        self._theta, self._alpha = recording["theta"].tolist(), recording["alpha"].tolist()
        self._elapsed = 0.0

    # --- as a plant -------------------------------------------------------------------------------------------------

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

    def rewind(self) -> None:
        """Back to its beginning."""
        self._elapsed = 0.0

    # --- as a run ---------------------------------------------------------------------------------------------------

    @property
    def duration(self) -> float:
        """s, from the first sample to the last."""
        return float(self.recording.time[-1] - self.recording.time[0])

    def samples(self, sample_time: float) -> int:
        """How many samples at another sample time (s) it can give."""
        return math.floor(self.duration / sample_time + 1e-6) + 1

    def voltage(self, samples: int, sample_time: float) -> Vector | None:
        """The recorded voltage (samples,), V, held from one sample to the next; None where none was recorded."""
        if "vm" not in self.recording:
            return None
        places = np.arange(samples) * (sample_time / self.recording.sample_time)
        held: Vector = self.recording["vm"][np.minimum(np.floor(places + 1e-6).astype(int), len(self.recording) - 1)]
        return held

    def timing(self, samples: int, sample_time: float) -> dict[str, Any]:
        """What the recording says of how steadily its first samples came; nothing at another sample time."""
        about = self.recording.metadata
        same = abs(sample_time - self.recording.sample_time) <= _SAME_PERIOD * self.recording.sample_time
        return {TIMING: cut(about, 0, samples)[TIMING]} if same and TIMING in about else {}

    def require_whole(self, samples: int, sample_time: float, asked: str) -> None:
        """That it may be the run that is asked for.

        Raises
        ------
        BenchError
            If it is too short, sampled otherwise, or without the voltage.
        """
        held = self.recording.sample_time
        if abs(sample_time - held) > _SAME_PERIOD * held:
            why = f"it is sampled every {held * 1e3:g} ms, and this every {sample_time * 1e3:g} ms"
            raise self._refused(asked, why)
        if "vm" not in self.recording:
            raise self._refused(asked, "without vm, nothing tells whether it is this run")
        if samples > len(self.recording):
            why = f"it is of {self.duration:g} s, and {(samples - 1) * sample_time:g} s are asked for: see duration="
            raise self._refused(asked, why)

    def require_same(self, volts: Vector, asked: str) -> Vector:
        """The recorded voltage, if ``volts`` are it.

        Raises
        ------
        BenchError
            If the run that is asked for would have set another one.
        """
        recorded = self.recording["vm"][: volts.size]
        apart = answered.apart(self.recording, volts)
        if answered.is_same(recorded, apart):
            return recorded
        worst = int(np.argmax(apart))
        raise self._refused(
            asked,
            f"this would set {volts[worst]:.2f} V at t = {worst * self.recording.sample_time:.3f} s, where "
            f"{recorded[worst]:.2f} V were recorded",
        )

    def _refused(self, asked: str, why: str) -> BenchError:
        return BenchError(
            (
                "A recording cannot be steered, and {name} is not the run that is asked for ({asked}): {why}. It holds "
                "{held}: {channels}, {duration:g} s. experiments.watch(bench, duration={duration:g}) gives it as it "
                'is, and experiments.validation(bench, A, B, signal="recorded") a model beside it; for anything else, '
                "open another bench."
            ).format(
                name=self.name,
                asked=asked,
                why=why,
                held=self.recording.metadata.get("experiment", "a run that does not say which"),
                channels=", ".join(self.recording.channels),
                duration=self.duration,
            )
        )
