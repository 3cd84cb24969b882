"""A plant of one's own on the virtual bench: any object with ``state`` and ``advance(voltage, duration)``."""

from __future__ import annotations

import copy
import inspect
import math
from typing import Any

from rotflex.errors import BenchError
from rotflex.plant import Moving, State

_WANTED = (
    "an object of its class has state, four numbers theta, alpha, theta_dot, alpha_dot in rad and rad/s, and a method "
    "advance(voltage, duration) in V and s, which moves it on. Or give rotflex.plant.PlantParameters."
)


class OwnPlant:
    """A copy of somebody's plant, which checks what it says of its state.

    Raises
    ------
    BenchError
        If the object is no plant; later, if its state is not four finite numbers.
    """

    def __init__(self, plant: Moving) -> None:
        kind = type(plant).__name__
        if isinstance(plant, type) or not hasattr(plant, "state") or not callable(getattr(plant, "advance", None)):
            lacking = "a class" if isinstance(plant, type) else f"a {kind}, which lacks state or advance()"
            raise BenchError(f"plant= was given {lacking}. To be a plant, {_WANTED}")
        try:
            inspect.signature(plant.advance).bind(0.0, 0.0)
        except TypeError as error:
            raise BenchError(f"plant= was given a {kind} with another advance() ({error}). {_WANTED}") from None
        self._plant, self._kind = copy.deepcopy(plant), kind
        self._checked()

    @property
    def state(self) -> State:
        """Angles and rates now."""
        return self._checked()

    def _checked(self) -> State:
        said: Any = self._plant.state
        try:
            state = State(*map(float, said))
        except (TypeError, ValueError):
            state = None
        if state is None or not all(map(math.isfinite, state)):
            raise BenchError(f"The state of your {self._kind} is {said!r}. In a plant, {_WANTED}")
        return state

    def advance(self, voltage: float, duration: float) -> State:
        """Hold a voltage (V) for a duration (s), and return the state at its end."""
        self._plant.advance(voltage, duration)
        return self._checked()
