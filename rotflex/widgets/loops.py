"""The loop explorer: change the command and the controller, and the arm moves (Section 3.4.2)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from labcourse.scene.explorer import Explorer
from labcourse.scene.scene import Choice, Column, Readout, Scene, Slider
from rotflex.config import one_of
from rotflex.simulation import matrices
from rotflex.specifications import AMPLITUDE, RATE
from rotflex.units import DEG
from rotflex.widgets import another_arm, pole_views
from rotflex.widgets.mechanism import mechanism
from rotflex.widgets.placement import Design, Dominant, design, with_gain

if TYPE_CHECKING:
    from rotflex.course.lab import Lab

_SERVO_ALONE = 15.0, 0.0, 0.6, 0.0  # V/rad and V/(rad/s): it leaves the arm to swing
_RANGES = {"amplitude": (5.0, 30.0, 1.0), "ramp": (0.02, 0.5, 0.01)}  # deg, s
_READY_MADE = {"soft": Dominant(0.7, 7.0, -20.0, -25.0), "firm": Dominant(0.7, 16.0, -30.0, -40.0)}


class LoopExplorer(Explorer):
    """A closed loop under a step.

    Parameters
    ----------
    A, B : (4, 4) and (4,) or (4, 1), the model with the motor voltage as input
    controllers : name → gain (4,) or (1, 4) that is fed back
    readouts : shown beside the specifications

    Raises
    ------
    DesignError
        If a matrix or a gain has the wrong shape.
    """

    def __init__(self, A: ArrayLike, B: ArrayLike, controllers: dict[str, Any], *readouts: Readout) -> None:
        self._model, self._controllers, self._more = matrices(A, B), controllers, readouts
        self.controller = next(iter(controllers))
        self.command = {"amplitude": AMPLITUDE / DEG, "ramp": 2 / RATE}
        self.loop = self._simulated(self.controller, self.command)
        super().__init__()

    def set(self, name: str, value: float | str) -> None:
        """Another controller, or another command."""
        controller, command = self.controller, dict(self.command)
        if name == "controller":
            controller = one_of("controller", str(value), self._controllers)
        else:
            low, high, _step = _RANGES[name]
            command[name] = min(max(float(value), low), high)
        self.loop = self._simulated(controller, command)
        self.controller, self.command = controller, command

    def _simulated(self, controller: str, command: dict[str, float]) -> Design:
        amplitude, rate = command["amplitude"] * DEG, 2 / command["ramp"]
        return with_gain(*self._model, self._controllers[controller], amplitude=amplitude, rate=rate)

    def view(self) -> Scene:
        """The arm beside the response."""
        loop = self.loop
        start = 0.0 if loop.motion is None else float(loop.motion["theta"][0])
        names = {name: name for name in self._controllers}
        labels = {"amplitude": ("command ±", "deg"), "ramp": ("takes", "s")}
        sliders = [Slider(name, *labels[name], *_RANGES[name], value) for name, value in self.command.items()]
        return Scene(
            alt=f"A closed loop, {self.controller}. " + " ".join(one.words for one in loop.findings),
            columns=[Column([mechanism(start, 0.0)], 0.7), Column(pole_views.traces(loop, []), 1.0)],
            controls=[[Choice("controller", "controller", names, self.controller), *sliders]],
            readouts=[pole_views.verdicts(loop), *self._more],
            height=300,
            play=pole_views.played_by_arm(loop, at_once=True),
        )


def explore_loop(lab: Lab) -> LoopExplorer:
    """The loop explorer, as a notebook makes it: with the student's model and gain once question 3.11 is answered.

    Until then it has another arm, with a soft and a firm controller, and one for the servo alone.
    """
    alone = {"none for the swing": _SERVO_ALONE}

    def own() -> LoopExplorer:
        K = np.ravel(lab.value("3.8", "K"))
        return LoopExplorer(*another_arm.own_model(lab), {"your K": K, "your K, partial": K * (1, 0, 1, 0), **alone})

    def another() -> LoopExplorer:
        A, B = another_arm.model()
        placed = {name: design(A, B, wanted.poles).K for name, wanted in _READY_MADE.items()}
        return LoopExplorer(A, B, {**alone, **placed}, another_arm.notice("3.11"))

    return another_arm.unless_answered(lab, "3.11 response, 2.14 A, 2.14 B, 3.8 K", own, another)
