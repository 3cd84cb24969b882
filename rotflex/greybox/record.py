"""One recording as the fit sees it: where its encoders count, and the plant simulated along its voltage."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rotflex.channels import Vector, channel
from rotflex.plant import Plant, PlantParameters, State
from rotflex.recording import Channel, Recording

WINDOW = 1.0  #: s, in which theta is compared less its mean, and beyond which residuals are independent
_BEGINNING = 10  # samples without a count, after which a recording is taken to begin at rest


class Record:
    """A recording with theta, alpha and vm.

    Attributes
    ----------
    begins_at_rest : whether nothing moves in its first samples
    windows : of each value of the residual, the window that it lies in (0, 1, ...)

    Raises
    ------
    IdentificationError
        If a channel is missing, or an angle constant.
    """

    def __init__(self, recording: Recording) -> None:
        self.recording = recording
        self.theta, self.alpha = channel(recording, "theta"), channel(recording, "alpha")
        self._volts: list[float] = channel(recording, "vm", may_be_constant=True).tolist()
        self.begins_at_rest = _stands(self.theta) and _stands(self.alpha)
        self._counts = [_counted(self.theta), _counted(self.alpha)]
        self._windows = [self._window(at) for at in self._counts]
        self.windows = np.concatenate(self._windows)

    def simulate(
        self, plant: PlantParameters, delay: float, offset: float, rates: tuple[float, float]
    ) -> tuple[Vector, Vector]:
        """theta and alpha (n,), rad, as the encoders would see them."""
        begin = State(float(self.theta[0]), float(self.alpha[0]) - offset, *rates)
        moving = Plant(plant, begin)
        dt = self.recording.sample_time
        states = []
        for volts in self._volts:
            states.append(moving.state)
            moving.advance(volts, dt)
        angles, speeds = np.hsplit(np.array(states), 2)
        late = angles - delay * speeds  # a delay is short beside all that moves
        return late[:, 0], late[:, 1] + offset

    def residual(self, theta: Vector, alpha: Vector) -> Vector:
        """Measured minus simulated where the encoders count, rad: theta less its mean in each window, then alpha."""
        difference = _less_mean(_between(self.theta - theta, self._counts[0]), self._windows[0])
        return np.concatenate([difference, _between(self.alpha - alpha, self._counts[1])])

    def rms(self, theta: Vector, alpha: Vector) -> dict[str, float]:
        """Root mean square of measured minus simulated over all samples, rad: see ``FitResult.residual_rms``."""
        left = _less_mean(self.theta - theta, self._window(np.arange(len(self.recording))))
        return {"theta": rms(left), "alpha": rms(self.alpha - alpha)}

    def beside(self, theta: Vector, alpha: Vector) -> Recording:
        """The recording with what was simulated, for plots."""
        kept = {name: self.recording.channels[name] for name in ("theta", "alpha", "vm")}
        simulated = {"theta_model": Channel(theta, "rad"), "alpha_model": Channel(alpha, "rad")}
        return Recording(self.recording.time, {**kept, **simulated}, self.recording.metadata)

    def _window(self, samples: NDArray[np.intp]) -> NDArray[np.intp]:
        """The window of each sample; a rest at the end belongs to the last whole one."""
        window = (samples * self.recording.sample_time / WINDOW + 1e-9).astype(np.intp)
        whole = int(len(self.recording) * self.recording.sample_time / WINDOW + 1e-9)
        return np.minimum(window, max(whole - 1, 0))


def rms(values: Vector) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(values**2)))


def _counted(angle: Vector) -> NDArray[np.intp]:
    """Samples after which the angle has changed."""
    return np.flatnonzero(np.diff(angle))


def _between(signal: Vector, samples: NDArray[np.intp]) -> Vector:
    """Mean of each sample and the next."""
    return (signal[samples] + signal[samples + 1]) / 2


def _less_mean(signal: Vector, windows: NDArray[np.intp]) -> Vector:
    """The signal less its mean in each window."""
    return signal - (np.bincount(windows, signal) / np.maximum(np.bincount(windows), 1))[windows]


def _stands(angle: Vector) -> bool:
    """Whether a recording begins at rest."""
    return bool(np.ptp(angle[:_BEGINNING]) == 0)
