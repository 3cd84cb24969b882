"""A controller: any function ``(reference, theta, alpha) -> V``, called once a sample.

Angles are in rad. A controller with a state also has a method ``reset()``, which is called before each run.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rotflex.errors import DesignError

#: (reference, theta, alpha), in rad (an open loop's reference in V) → the motor voltage, V
Controller = Callable[[float, float, float], float]


def begun(controller: Controller) -> Controller:
    """Reset a controller, and return a function that checks what it returns.

    Raises
    ------
    DesignError
        If the controller is not callable. The returned function raises it, too, if the controller does not return one
        real number.
    """
    if not callable(controller):
        raise DesignError(
            f"A controller is a function (reference, theta, alpha) that returns a voltage; this is {controller!r}."
        )
    if hasattr(controller, "reset"):
        controller.reset()

    def checked(reference: float, theta: float, alpha: float) -> float:
        answer = controller(reference, theta, alpha)
        if type(answer) is float:
            return answer
        value = np.asarray(answer)  # an array of one number, as K @ x may be
        try:
            if value.dtype.kind in "iufO":  # neither True nor "1.0"
                return float(value.item())
        except (TypeError, ValueError):
            pass
        raise DesignError(f"A controller should return the motor voltage, one number of V; it returned {answer!r}.")

    return checked


def name_of(controller: Controller) -> str:
    """Name of a function, or of an object's class."""
    return str(getattr(controller, "__name__", type(controller).__name__))
