"""A closed loop: what is shown of its response, and an explorer of command and controller (Section 3.4.2)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from labcourse.scene.explorer import Explorer
from labcourse.scene.scene import Choice, Column, Panel, Play, Readout, Row, Scene, Slider, around
from rotflex.config import one_of
from rotflex.hil.bench import Limits
from rotflex.response import with_unit
from rotflex.simulation import matrices
from rotflex.specifications import AMPLITUDE, LIMITS, RATE, SETTLING_BAND
from rotflex.units import DEG, Vector
from rotflex.widgets import another_arm
from rotflex.widgets.mechanism import mechanism, played
from rotflex.widgets.placement import BORDER, HORIZON, LEAD, STEP, Design, Dominant, Runaway, design, with_gain

if TYPE_CHECKING:
    from rotflex.course.lab import Lab

_SERVO_ALONE = 15.0, 0.0, 0.6, 0.0  # V/rad and V/(rad/s): it leaves the arm to swing
_RANGES = {"amplitude": (5.0, 30.0, 1.0), "ramp": (0.02, 0.5, 0.01)}  # deg, s
_READY_MADE = {"soft": Dominant(0.7, 7.0, -20.0, -25.0), "firm": Dominant(0.7, 16.0, -30.0, -40.0)}
SHOWN_TIME = 1.0  #: s after the step
_NAMES = ("settling time", "overshoot", "deflection", "voltage")
_MARKS = {True: ("met", "met"), False: ("missed", "not met"), None: ("unknown", "not measured")}


# --- what is shown of a loop ------------------------------------------------------------------------------------------


def traces(design: Design, ghosts: Sequence[Design]) -> list[Panel]:
    """Servo angle, deflection and voltage after the step."""
    theta = _servo_angle(design)
    alpha = Panel("α (deg)", theta.x, (-16.0, 16.0))
    volts = Panel("Vₘ (V)", theta.x, (-14.0, 14.0), "time after the step (s)", 1.25)
    for panel, limit in ((alpha, LIMITS["max_alpha"] / DEG), (volts, LIMITS["max_vm"])):
        if design.runaway is None or panel is volts:
            panel.level(limit, "highlight", "limit")
            panel.level(-limit, "highlight")
    panels = [theta, alpha, volts]
    for index, ghost in enumerate(ghosts):
        _draw(ghost, panels, "ghost", "" if index else "ghost")
    _draw(design, panels, "measured", "this design")
    if design.runaway is not None:
        _limited(alpha, design.runaway.recording.degrees("alpha"), Limits().alpha / DEG)
    elif design.motion is not None:
        for panel, values in ((alpha, design.motion.degrees("alpha")), (volts, design.motion["vm"])):
            reach = max(panel.y[1], 1.1 * float(np.abs(values).max()))
            panel.y = (-reach, reach)
    for panel in panels:
        panel.level(0.0, "text", "now" if panel is theta else "", axis="x", clock=True)
    return panels


def _servo_angle(design: Design) -> Panel:
    """The plot of the servo angle with its command, band and limits, and no response yet."""
    theta = Panel("θ (deg)", (-LEAD, SHOWN_TIME), (-26.0, 30.0), height=1.3)
    if design.runaway is None:
        end = AMPLITUDE / DEG
        if design.recording is not None:
            low, high = around(design.recording.degrees("theta"))
            end, theta.y = float(design.recording.degrees("theta_ref")[-1]), (min(low, -26.0), max(high, 30.0))
        theta.band(end * (1 - SETTLING_BAND), end * (1 + SETTLING_BAND), "highlight", "settling band")
        theta.level(LIMITS["settling_time"], "highlight", "time limit", axis="x")
    else:
        recording, stopped = design.runaway.recording, design.runaway.stopped
        theta.x = (-LEAD, max(SHOWN_TIME, float(recording.time[-1])))
        _limited(theta, recording.degrees("theta"), Limits().theta / DEG)
        if stopped is not None:
            theta.level(stopped, "reference", "stopped by the safety", axis="x", dash=[], width=2)
    if design.motion is not None:
        theta.line(design.motion.time, design.motion.degrees("theta_ref"), "reference", "command")
    return theta


def _limited(panel: Panel, values: Vector, limit: float) -> None:
    """Make room for values (deg), and show the bench's limit where they come near it."""
    reach = 1.15 * float(np.abs(values).max())
    panel.y = (-reach, reach)
    if reach > limit:
        panel.level(limit, "highlight", "limit of the bench")
        panel.level(-limit, "highlight")


def _draw(design: Design, panels: Sequence[Panel], role: str, label: str = "") -> None:
    if design.motion is None:
        return
    time = design.motion.time
    curves = (design.motion.degrees("theta"), design.motion.degrees("alpha"), design.motion["vm"])
    for panel, values in zip(panels, curves, strict=True):
        panel.line(time, values, role, label if panel is panels[0] else "")


def played_by_arm(design: Design, at_once: bool = False) -> Play | None:
    """What the arm goes through from the step on, for the drawing of the mechanism; ``at_once``: before any touch."""
    if design.motion is None:
        return None
    end = SHOWN_TIME if design.runaway is None else float(design.motion.time[-1])
    return played(design.motion, 0.0, end, auto=True, at_once=at_once)


def verdicts(design: Design) -> Readout:
    """The four specifications, or why there is nothing to hold against them."""
    rows = []
    for finding, name in zip(design.findings, _NAMES, strict=bool(design.findings)):
        value, asked = finding.value, finding.specification
        shown = "–" if value is None else "does not settle" if math.isinf(value) else with_unit(value, asked.unit)
        rows.append(Row(name, (shown, f"≤ {with_unit(asked.limit, asked.unit)}"), *_MARKS[finding.met]))
    if design.runaway is not None:
        rows = _of_a_runaway(design.runaway)
    elif not design.findings:
        rows = [Row("no response", (design.trouble.split(":")[0],), "missed", "not met")]
    return Readout("Specifications", rows)


def _of_a_runaway(runaway: Runaway) -> list[Row]:
    """As many rows as there are specifications, so that nothing moves when a pole crosses the border."""
    grows = f"twice as large every {runaway.doubled:.2g} s" if runaway.growth > BORDER else "for ever"
    end = [Row("limit of the bench", (f"not within {HORIZON:g} s",)), Row("", ())]
    if runaway.stopped is not None:
        reached = f"{runaway.limit / DEG:.0f} deg of {runaway.what} after {runaway.stopped:.2f} s"
        end = [Row(f"step of {STEP / DEG:.0f} deg", (reached,)), Row("then", ("stopped by the safety, 0 V",))]
    where = f"at {number(round(runaway.growth, 3) + 0.0)} rad/s"
    words = "unstable" if runaway.growth > BORDER else "on the border"
    return [Row("rightmost pole", (where,), "missed", words), Row("swings", (grows,)), *end]


def number(value: float) -> str:
    """Four digits, with a true minus sign."""
    text = f"{value:.4g}" if abs(value) < 1e4 else f"{value:.0f}"
    return text.replace("-", "−")


# --- the explorer -----------------------------------------------------------------------------------------------------


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
            command[name] = float(value)
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
            columns=[Column([mechanism(start, 0.0)], 0.7), Column(traces(loop, []), 1.0)],
            controls=[[Choice("controller", "controller", names, self.controller), *sliders]],
            readouts=[verdicts(loop), *self._more],
            height=300,
            play=played_by_arm(loop, at_once=True),
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
