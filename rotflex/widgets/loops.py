"""The loop explorer: change the command and the controller, and the arm moves (Section 3.4.2)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

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
    controllers : name → gain (4,) or (1, 4), and "full" or "partial" feedback
    readouts : shown beside the specifications

    Raises
    ------
    DesignError
        If a matrix or a gain has the wrong shape.
    """

    def __init__(
        self,
        A: ArrayLike,
        B: ArrayLike,
        controllers: dict[str, tuple[ArrayLike, str]],
        readouts: tuple[Readout, ...] = (),
    ) -> None:
        self._model, self._controllers, self._more = matrices(A, B), controllers, readouts
        self.controller = next(iter(controllers))
        self.command = {"amplitude": AMPLITUDE / DEG, "ramp": 2 / RATE}
        self.found = self._simulated(self.controller, self.command)
        super().__init__()

    def set(self, name: str, value: float | str) -> None:
        """Another controller, or another command."""
        controller, command = self.controller, dict(self.command)
        if name == "controller":
            controller = one_of("controller", str(value), self._controllers)
        else:
            low, high, _step = _RANGES[name]
            command[name] = min(max(float(value), low), high)
        self.found = self._simulated(controller, command)
        self.controller, self.command = controller, command

    def _simulated(self, controller: str, command: dict[str, float]) -> Design:
        gain, feedback = self._controllers[controller]
        return with_gain(*self._model, gain, feedback, amplitude=command["amplitude"] * DEG, rate=2 / command["ramp"])

    def view(self) -> Scene:
        """The arm beside the response."""
        found = self.found
        start = 0.0 if found.motion is None else float(found.motion["theta"][0])
        return Scene(
            alt=f"A closed loop, {self.controller}. " + " ".join(one.words for one in found.findings),
            columns=[
                Column([mechanism(start, 0.0)], 0.7),
                Column(pole_views.traces(found, [], None), 1.0),
            ],
            controls=[
                [
                    Choice("controller", "controller", {one: one for one in self._controllers}, self.controller),
                    Slider("amplitude", "command ±", "deg", *_RANGES["amplitude"], self.command["amplitude"]),
                    Slider("ramp", "takes", "s", *_RANGES["ramp"], self.command["ramp"]),
                ]
            ],
            readouts=[pole_views.verdicts(found), *self._more],
            height=300,
            play=pole_views.played_by_arm(found, at_once=True),
        )


def explore_loop(lab: Lab) -> LoopExplorer:
    """The loop explorer, as a notebook makes it: with the student's model and gain once question 3.11 is answered.

    Until then it has another arm, with a soft and a firm controller, and one for the servo alone.
    """
    alone: tuple[Any, str] = (_SERVO_ALONE, "partial")

    def own() -> LoopExplorer:
        K: Any = lab.value("3.8", "K")
        controllers = {"your K": (K, "full"), "your K, partial": (K, "partial"), "none for the swing": alone}
        return LoopExplorer(*another_arm.own_model(lab), controllers)

    def another() -> LoopExplorer:
        A, B = another_arm.model()
        placed = {name: (design(A, B, poles.poles).K, "full") for name, poles in _READY_MADE.items()}
        return LoopExplorer(A, B, {"none for the swing": alone, **placed}, (another_arm.notice("3.11"),))

    return another_arm.unless_answered(lab, "3.11 response, 2.14 A, 2.14 B, 3.8 K", own, another)
