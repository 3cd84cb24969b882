"""The validation explorer: stiffness and damping by slider, over a recording, and a fit from there (Section 2.3.2)."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from labcourse.pictures import ROLES, WIDTH, Picture, new_picture, style
from labcourse.scene.explorer import Explorer
from labcourse.scene.scene import Button, Choice, Column, Panel, Readout, Row, Scene, Slider, around
from rotflex import greybox
from rotflex.config import Joint, Servo
from rotflex.errors import RotflexError
from rotflex.greybox import FitResult
from rotflex.plant import PlantParameters
from rotflex.recording import Recording
from rotflex.widgets.overlay import alt_text_of, fit_percent, overlay

_RANGES = {"K_s": (0.5, 4.0, 0.005), "B_eq": (0.0, 0.05, 0.0005), "B_l": (0.0, 0.01, 0.0001)}
_ANGLES = ("theta", "alpha")
_UNITS = {"K_s": "N·m/rad", "B_eq": "N·m·s/rad", "B_l": "N·m·s/rad"}
_TOLD = {"K_s": "N·m/rad", "B_l": "N·m·s/rad", "torque_per_volt": "N·m/V", "braking": "N·m·s/rad"}
_FRICTION = {"none": "left out (linear model)", "typical": "typical", "fitted": "as fitted"}
_TYPICAL: dict[str, Any] = {name: (greybox.TYPICAL[name],) * 2 for name in ("servo_friction", "link_friction")}
_NONE: dict[str, Any] = {"servo_friction": (0.0, 0.0), "link_friction": (0.0, 0.0)}


class ValidationExplorer(Explorer):
    """A model over a recording, with sliders.

    Parameters
    ----------
    recording : theta, alpha, vm, from :func:`rotflex.experiments.validation` for example
    servo, joint : nominal parts, ``lab.servo`` and ``lab.joint``
    K_s : N·m/rad, where the slider begins: the student's own

    Raises
    ------
    IdentificationError
        If the recording lacks a channel, or nothing moves in it.
    """

    def __init__(self, recording: Recording, servo: Servo, joint: Joint, K_s: float = 1.4) -> None:
        low, high, _step = _RANGES["K_s"]
        self._recording, self._servo, self._joint = recording, servo, joint
        nominal = PlantParameters.of(servo, joint, min(max(float(K_s), low), high))
        self.parameters = replace(nominal, B_l=greybox.TYPICAL["B_l"])
        self._start = self.parameters
        self.friction = "none"
        self.fitted: FitResult | None = None
        self.busy = False
        self.compared = overlay(recording, self.parameters)
        super().__init__()

    # --- what the reader does ---------------------------------------------------------------------------------------

    def set(self, name: str, value: float | str) -> None:
        """A slider, or what is done about dry friction."""
        if name == "friction":
            self._take(self._with_friction(self.parameters, str(value)))
            self.friction = str(value)
            return
        low, high, _step = _RANGES[name]
        changed: dict[str, Any] = {name: min(max(float(value), low), high)}
        self._take(replace(self.parameters, **changed))

    def press(self, name: str) -> None:
        """Fit, or go back."""
        if name == "reset":
            self._take(self._start)
            self.friction = "none"
        elif not self.busy:
            self.busy = True
            self.notice = "Fitting: the plant is simulated about seventy times, which takes some seconds."
            self.in_background(self.fit, self._fitted)

    def fit(self) -> FitResult:
        """The grey-box fit, from where the sliders stand.

        Raises
        ------
        IdentificationError
            As :func:`rotflex.greybox.fit`.
        """
        rubs = any(self.parameters.servo_friction + self.parameters.link_friction)
        begin = self.parameters if rubs else replace(self.parameters, **_TYPICAL)
        return greybox.fit(self._recording, self._servo, self._joint, initial=begin, progress=False)

    def _fitted(self, found: FitResult | Exception) -> None:
        try:
            if isinstance(found, Exception):
                raise found
            self._take(found.parameters)
            self.fitted, self.friction = found, "fitted"
        finally:
            self.busy = False
        values = ", ".join(f"{name} = {found.estimates[name]} {unit}" for name, unit in _TOLD.items())
        braking = "The braking is that of B_eq and of the back-EMF together: which part is whose, nothing tells."
        self.notice = " ".join([*found.doubts(), f"Fitted, with dry friction in both joints: {values}.", braking])

    def _with_friction(self, parameters: PlantParameters, choice: str) -> PlantParameters:
        if choice == "fitted":
            if self.fitted is None:
                raise RotflexError("Nothing has been fitted yet: press Fit first.")
            found = self.fitted.parameters
            return replace(parameters, servo_friction=found.servo_friction, link_friction=found.link_friction)
        return replace(parameters, **(_TYPICAL if choice == "typical" else _NONE))

    def _take(self, parameters: PlantParameters) -> None:
        self.compared = overlay(self._recording, parameters)
        self.parameters = parameters

    # --- what there is to see ---------------------------------------------------------------------------------------

    def view(self) -> Scene:
        """Both angles, measured and modelled, and what is left between them."""
        compared = self.compared
        span = (float(compared.time[0]), float(compared.time[-1]))
        panels = []
        for name, label in (("theta", "θ (deg)"), ("alpha", "α (deg)")):
            measured, model = compared.degrees(name), compared.degrees(f"{name}_model")
            panel = Panel(label, span, around(measured, model), height=1.3)
            panel.line(compared.time, measured, "measured", "measured")
            panel.line(compared.time, model, "model", "model")
            panels.append(panel)
        left_theta, left_alpha = self._residuals()
        residual = Panel("measured − model (deg)", span, around(left_theta, left_alpha), "time (s)", height=1.15)
        residual.line(compared.time, left_theta, "ghost", "θ")
        residual.line(compared.time, left_alpha, "voltage", "α")
        sliders: list[Slider | Choice | Button] = [
            Slider(name, name, _UNITS[name], *_RANGES[name], getattr(self.parameters, name), self.busy)
            for name in _RANGES
        ]
        options = {name: text for name, text in _FRICTION.items() if name != "fitted" or self.fitted}
        return Scene(
            alt=alt_text_of(compared),
            columns=[Column([*panels, residual])],
            controls=[
                sliders,
                [
                    Choice("friction", "dry friction", options, self.friction, self.busy),
                    Button("fit", "Fit", "main", self.busy, "Fit the model, from where the sliders are"),
                    Button("reset", "Back to the beginning", disabled=self.busy),
                ],
            ],
            readouts=[self._figures()],
            height=460,
        )

    def picture(self) -> Picture:
        """The same as a static figure."""
        return picture(self.compared)

    def _residuals(self) -> tuple[Any, Any]:
        theta, alpha = (self.compared.degrees(name) - self.compared.degrees(f"{name}_model") for name in _ANGLES)
        return theta, alpha

    def _figures(self) -> Readout:
        rows = []
        for name, symbol, left in zip(_ANGLES, "θα", self._residuals(), strict=True):
            explained = fit_percent(self.compared[name], self.compared[f"{name}_model"])
            rms = float(np.sqrt(np.mean(left**2)))
            rows.append(Row(symbol, (f"{explained:.1f} %", f"{rms:.3f} deg")))
        return Readout("Model against measurement", rows, ("", "model fit", "residual, RMS"))


def explore_validation(recording: Recording, servo: Servo, joint: Joint, K_s: float = 1.4) -> ValidationExplorer:
    """The validation explorer, as a notebook makes it; see :class:`ValidationExplorer`."""
    return ValidationExplorer(recording, servo, joint, K_s)


def picture(compared: Recording) -> Picture:
    """A comparison as a static figure: both angles and what is left of them.

    Parameters
    ----------
    compared : from :func:`~rotflex.widgets.overlay.overlay`
    """
    with style():
        figure = new_picture(WIDTH, 6.0)
        theta, alpha, residual = figure.subplots(3, 1, sharex=True)
        for axes, name, label in ((theta, "theta", "θ (deg)"), (alpha, "alpha", "α (deg)")):
            measured, model = compared.degrees(name), compared.degrees(f"{name}_model")
            axes.plot(compared.time, measured, label="measured", **ROLES["measured"])
            axes.plot(compared.time, model, label="model", **ROLES["model"])
            axes.set(ylabel=label)
            residual.plot(compared.time, measured - model, label=label[0], linewidth=1.2)
        residual.set(ylabel="left over (deg)", xlabel="time (s)")
        residual.axhline(0.0, color="black", linewidth=0.8)
        for axes in (theta, residual):
            axes.legend(loc="lower right", bbox_to_anchor=(1.0, 0.97), ncols=2, borderaxespad=0.0)
    theta.set_xlim(compared.time[0], compared.time[-1])
    figure.alt_text = alt_text_of(compared)
    return figure
