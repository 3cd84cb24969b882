"""What hangs on the virtual board's terminals: a plant that moves under the voltage there, and when that arrives.

A real board's output comes a little after the sample that it answers, and never by quite the same time.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from rotflex.errors import ConfigurationError
from rotflex.plant import HALVINGS, SUBSTEP, Moving

#: s; whole ticks need few transition matrices of the plant, however irregular the calls are
TICK = SUBSTEP / 2**HALVINGS
_STEP = 8  # ticks; delays are multiples of it
_SPANS = frozenset(range(_STEP, 2**HALVINGS + 1, _STEP))  # moved in one go; others in powers of two
_AT_ONCE = 1000  # delays drawn at a time


@dataclass(frozen=True)
class Timing:
    """When an output that is written takes effect: at once by default, as it does on no real board.

    Parameters
    ----------
    delay : s, from the program's write to the voltage at the motor
    jitter : s, by which that varies either way
    late : the share of outputs that come late, 0 to 1
    late_by : s, how much later these are
    seed : of what is drawn

    Raises
    ------
    ConfigurationError
        If an output could come before it was written, or a share is none.
    """

    delay: float = 0.0
    jitter: float = 0.0
    late: float = 0.0
    late_by: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        if not (0 <= self.jitter <= self.delay < math.inf and 0 <= self.late <= 1 and 0 <= self.late_by < math.inf):
            raise ConfigurationError(
                f"A delay must be finite and not below its jitter, and the share of late outputs from 0 to 1: {self!r}."
            )

    @property
    def longest(self) -> float:
        """The longest that an output can take, s."""
        return self.delay + self.jitter + (self.late_by if self.late else 0.0)

    def ticks(self) -> Iterator[int]:
        """How long one output after the other takes, in ticks: the same for the same seed."""
        draw = np.random.default_rng(self.seed)
        while True:
            spread = self.delay + self.jitter * draw.uniform(-1, 1, _AT_ONCE)
            late = self.late_by * (draw.random(_AT_ONCE) < self.late)
            yield from (_STEP * np.round((spread + late) / (_STEP * TICK)).astype(int)).tolist()


AT_ONCE = Timing()  #: no delay at all


class Terminals:
    """A plant, and the voltages that drive it.

    Parameters
    ----------
    plant : what moves
    motor : the output that drives it
    gain : of the cable to the motor
    outputs : how many outputs there are
    timing : when outputs take effect
    now : time at which the plant is where it is, s
    """

    def __init__(self, plant: Moving, motor: int, gain: float, outputs: int, timing: Timing, now: float) -> None:
        self.plant = plant
        self._motor, self._gain, self._timing = motor, gain, timing
        self._voltages = [0.0] * outputs
        self._coming: deque[tuple[int, Mapping[int, float]]] = deque()  # by the tick at which they take effect
        self._ticks = round(now / TICK)
        self.begin()

    @property
    def commanded(self) -> list[float]:
        """The outputs (V) that were set last, arrived or on their way."""
        commanded = list(self._voltages)
        for _due, voltages in self._coming:
            for channel, voltage in voltages.items():
                commanded[channel] = voltage
        return commanded

    def begin(self) -> None:
        """Draw delays from the first one again: an experiment does not depend on those before it."""
        self._delays = self._timing.ticks()

    def send(self, voltages: Mapping[int, float]) -> None:
        """Set outputs (V), now that the plant has moved until now; they take effect after their delay."""
        due = self._ticks + next(self._delays)
        if self._coming:
            due = max(due, self._coming[-1][0])  # none overtakes the one before
        self._coming.append((due, voltages))
        if due <= self._ticks:
            self._arrive(self._ticks)

    def set(self, voltages: Mapping[int, float]) -> None:
        """Set outputs (V) at once, whatever was on its way."""
        self._coming.clear()
        for channel, voltage in voltages.items():
            self._voltages[channel] = voltage

    def move(self, instant: float) -> None:
        """Let the plant move until ``instant`` (s)."""
        target = round(instant / TICK)
        if self._coming:
            self._arrive(target)
        self._move(target)

    def _arrive(self, target: int) -> None:
        while self._coming and self._coming[0][0] <= target:
            due, voltages = self._coming.popleft()
            self._move(due)
            for channel, voltage in voltages.items():
                self._voltages[channel] = voltage

    def _move(self, target: int) -> None:
        ticks = target - self._ticks
        while ticks > 0:
            span = ticks if ticks in _SPANS else 1 << (ticks.bit_length() - 1)
            self.plant.advance(self._voltages[self._motor] * self._gain, span * TICK)
            ticks -= span
        self._ticks = max(target, self._ticks)
