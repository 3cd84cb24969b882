"""The plant: an oven that its heater warms. Each student has an oven of their own."""

import numpy as np

from labcourse.answers.forms import Channel, Recording

STEP = 5.0  # V, of the heater
SAMPLE_TIME = 0.1  # s
DURATION = 100.0  # s
READING = 2  # decimals of a kelvin that the thermometer shows


def response(k: float, tau: float, time: np.ndarray) -> np.ndarray:
    """Temperature (n,) in K above the room, for a step of the heater at 0 s: gain in K/V, time constant in s."""
    return k * STEP * (1 - np.exp(-time / tau))


class Oven:
    """An oven of gain ``k`` (K/V) and time constant ``tau`` (s), drawn from a seed."""

    def __init__(self, seed: int) -> None:
        draw = np.random.default_rng(seed)
        self.k = float(draw.uniform(4.0, 8.0))
        self.tau = float(draw.uniform(10.0, 20.0))

    def step(self) -> Recording:
        """Switch the heater on, and record its voltage u and the temperature T. The same oven gives the same."""
        time = np.arange(0, DURATION, SAMPLE_TIME)
        u = Channel(np.full(time.size, STEP), "V")
        T = Channel(np.round(response(self.k, self.tau, time), READING), "K")
        return Recording({"u": u, "T": T}, SAMPLE_TIME, {"experiment": "step"})
