"""What the virtual board's inputs read of the plant: two encoders, a potentiometer, a tachometer."""

from __future__ import annotations

import math
from collections.abc import Mapping

from rotflex.config import Servo
from rotflex.errors import HILError
from rotflex.hil.board import EncoderQuadratureMode
from rotflex.plant import Moving
from rotflex.units import DEG

SERVO_ENCODER, LINK_ENCODER = 0, 1
POTENTIOMETER, TACHOMETER = 0, 1
ENCODERS, ANALOG_INPUTS = 2, 2
_EDGES = (EncoderQuadratureMode.X1, EncoderQuadratureMode.X2, EncoderQuadratureMode.X4)
_TRACK = 352 * DEG  # of the potentiometer; the remaining 8 deg are the gap


class Sensors:
    """Counters and analog inputs, wired as the laboratory is.

    Parameters
    ----------
    servo : the nominal servo, for the sensors' gains
    plant : what moves
    """

    def __init__(self, servo: Servo, plant: Moving) -> None:
        self._servo, self._plant = servo, plant
        self._offsets = [0] * ENCODERS
        self._per_count = [servo.K_enc] * ENCODERS  # rad
        #: V, by input; nothing cuts what comes, until told to
        self.ranges = dict.fromkeys(range(ANALOG_INPUTS), (-math.inf, math.inf))

    def counts(self, channel: int) -> int:
        """What an encoder's counter reads. The link's counts the other way."""
        state = self._plant.state
        angle = state.theta if channel == SERVO_ENCODER else -state.alpha
        return round(angle / self._per_count[channel]) + self._offsets[channel]

    def volts(self, channel: int) -> float:
        """What an analog input reads, V."""
        lowest, highest = self.ranges[channel]
        return min(max(self._signal(channel), lowest), highest)

    def _signal(self, channel: int) -> float:
        state = self._plant.state
        if channel == TACHOMETER:
            return state.theta_dot / self._servo.K_tach if self._servo.tachometer else 0.0
        wrapped = math.remainder(state.theta, 2 * math.pi)
        # In the gap the wiper touches nothing.
        return wrapped / self._servo.K_pot if abs(wrapped) <= _TRACK / 2 else 0.0

    def set_counts(self, counts: Mapping[int, int]) -> None:
        """Set what counters read now."""
        for channel, count in counts.items():
            self._offsets[channel] += count - self.counts(channel)

    def set_modes(self, modes: Mapping[int, int]) -> None:
        """Count all four edges, as the data sheet's counts per turn do, or fewer. What the counters read stays.

        Raises
        ------
        HILError
            If a mode is none of two lines in quadrature.
        """
        for channel, mode in modes.items():
            if mode not in _EDGES:
                raise HILError(f"Encoder {channel} counts one, two or four edges; it was given the mode {mode}.")
            before = self.counts(channel)
            self._per_count[channel] = self._servo.K_enc * EncoderQuadratureMode.X4 / mode
            self.set_counts({channel: before})
