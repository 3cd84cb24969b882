"""The validation explorer: stiffness and damping by slider, over a recording, and a fit from there (Section 2.3.2)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from labcourse.scene.explorer import Explorer
from labcourse.scene.scene import Button, Choice, Column, Control, Panel, Readout, Row, Scene, Slider, around, thinned
from rotflex import experiments, greybox
from rotflex.config import Joint, Servo
from rotflex.errors import IdentificationError, RotflexError
from rotflex.greybox import Band, FitResult
from rotflex.greybox.problem import Record, rms
from rotflex.hil.controllers import OpenLoop
from rotflex.plant import PlantParameters
from rotflex.recording import Recording
from rotflex.units import DEG, Vector
from rotflex.widgets import another_arm

if TYPE_CHECKING:
    from rotflex.course.lab import Lab


_RANGES = {"K_s": (0.5, 4.0, 0.005), "B_eq": (0.0, 0.05, 0.0005), "B_l": (0.0, 0.01, 0.0001)}
_ANGLES = ("theta", "alpha")
_UNITS = {"K_s": "N·m/rad", "B_eq": "N·m·s/rad", "B_l": "N·m·s/rad"}
_TOLD = {"K_s": "N·m/rad", "B_l": "N·m·s/rad", "torque_per_volt": "N·m/V", "braking": "N·m·s/rad"}
_FRICTION = {"none": "left out (linear model)", "typical": "typical", "fitted": "as fitted"}
_TYPICAL: dict[str, Any] = {name: (greybox.TYPICAL[name],) * 2 for name in ("servo_friction", "link_friction")}
_NONE: dict[str, Any] = {"servo_friction": (0.0, 0.0), "link_friction": (0.0, 0.0)}


def overlay(recording: Recording, parameters: PlantParameters) -> Recording:
    """A recording with what a plant does under the same voltage: channels theta_model and alpha_model, rad.

    The model starts where the recording does, at rest; the voltage is held from each sample to the next.

    Parameters
    ----------
    recording : with theta, alpha and vm
    parameters : of the plant; with no friction, it is the linear model

    Raises
    ------
    IdentificationError
        If a channel is missing, or an angle does not move.
    """
    record = Record(recording)
    return record.beside(*record.simulate(parameters, delay=0.0, offset=0.0, rates=(0.0, 0.0)))


def fit_percent(measured: Vector, model: Vector) -> float:
    """How much of the measured motion the model explains, per cent: 100 (1 - |y - y_model| / |y - mean of y|).

    100 is a perfect fit; 0 is no better than a constant, and less is worse than that.

    Raises
    ------
    IdentificationError
        If the measured signal does not move.
    """
    motion = float(np.linalg.norm(measured - measured.mean()))
    if motion == 0:
        raise IdentificationError("The measured signal does not move: there is nothing to explain.")
    return 100 * (1 - float(np.linalg.norm(measured - model)) / motion)


def _shade(panel: Panel, time: Vector, edges: Sequence[Vector], role: str, label: str = "") -> None:
    """Shade what lies between a lower and an upper curve."""
    (left, lower), (right, upper) = (thinned(time, edge) for edge in edges)
    panel.area(np.append(left, right[::-1]), np.append(lower, upper[::-1]), role, label)


class ValidationExplorer(Explorer):
    """A model over a recording, with sliders.

    Parameters
    ----------
    recording : theta, alpha, vm, from :func:`rotflex.experiments.validation` for example
    servo, joint : nominal parts, ``lab.servo`` and ``lab.joint``
    K_s : N·m/rad, where the slider begins: the student's own
    another : whether it is a recording of another arm, which is shown more briefly

    Raises
    ------
    IdentificationError
        If the recording lacks a channel, or nothing moves in it.
    """

    def __init__(
        self, recording: Recording, servo: Servo, joint: Joint, K_s: float = 1.4, another: bool = False
    ) -> None:
        low, high, _step = _RANGES["K_s"]
        self._recording, self._servo, self._joint = recording, servo, joint
        self._another = another
        nominal = PlantParameters.of(servo, joint, min(max(float(K_s), low), high))
        self.parameters = replace(nominal, B_l=greybox.TYPICAL["B_l"])
        self._start = self.parameters
        self.friction = "none"
        self.fitted: FitResult | None = None
        self.band: Band | None = None
        self.compared = overlay(recording, self.parameters)
        super().__init__()

    # --- what the reader does ---------------------------------------------------------------------------------------

    def set(self, name: str, value: float | str) -> None:
        """A slider, or what is done about dry friction."""
        if name == "friction":
            self._take(self._with_friction(self.parameters, str(value)))
            self.friction = str(value)
            return
        changed: dict[str, Any] = {name: float(value)}
        self._take(replace(self.parameters, **changed))

    def press(self, name: str) -> None:
        """Fit, or go back."""
        if name == "reset":
            self._take(self._start)
            self.friction = "none"
        elif not self.busy:
            self.notice = "Fitting: the plant is simulated more than a hundred times, which takes some seconds."
            self.in_background(self._fit_and_predict, self._fitted)

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

    def _fit_and_predict(self) -> tuple[FitResult, Band]:
        """The fit, and the band that it predicts for the recording's voltage."""
        found = self.fit()
        return found, found.band(self._recording["vm"], OpenLoop(), self._recording.sample_time, progress=False)

    def _fitted(self, result: tuple[FitResult, Band]) -> None:
        found, band = result
        self._take(found.parameters)
        self.fitted, self.band, self.friction = found, band, "fitted"
        values = ", ".join(f"{name} = {found.estimates[name]} {unit}" for name, unit in _TOLD.items())
        braking = "The braking is the sum of B_eq and back-EMF. A recording cannot separate the two."
        band_means = "95 % of a new run should lie in the band; θ drifts, so its band follows it in windows of 1 s."
        fitted = f"Fitted, with dry friction in both joints: {values}."
        self.notice = " ".join([*found.doubts(), fitted, braking, band_means])

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
        fits = [fit_percent(compared[name], compared[f"{name}_model"]) for name in _ANGLES]
        panels, edges, left = [], self._edges(), dict(zip(_ANGLES, self._residuals(), strict=True))
        above = [edge - compared.degrees("alpha_model") for edge in edges.get("alpha", ())]
        residual = Panel("measured − model (deg)", span, around(*left.values(), *above), "time (s)", height=1.15)
        for name, symbol, role in (("theta", "θ", "ghost"), ("alpha", "α", "voltage")):
            measured, model = compared.degrees(name), compared.degrees(f"{name}_model")
            panel = Panel(f"{symbol} (deg)", span, around(measured, model), height=1.3)
            if name in edges:
                _shade(panel, compared.time, edges[name], "model", "band of 95 %")
                _shade(residual, compared.time, [edge - model for edge in edges[name]], role)
            panel.line(compared.time, measured, "measured", "measured")
            panel.line(compared.time, model, "model", "model")
            panels.append(panel)
            residual.line(compared.time, left[name], role, symbol)
        sliders: list[Control] = [
            Slider(name, name, _UNITS[name], *_RANGES[name], getattr(self.parameters, name), self.busy)
            for name in _RANGES
        ]
        options = {name: text for name, text in _FRICTION.items() if name != "fitted" or self.fitted}
        return Scene(
            alt=(
                f"Measured and modelled servo angle and deflection over {span[1] - span[0]:.3g} s. The model explains "
                f"{fits[0]:.0f} % of the servo angle's motion and {fits[1]:.0f} % of the deflection's."
            ),
            columns=[Column([*panels, residual])],
            controls=[
                sliders,
                [
                    Choice("friction", "dry friction", options, self.friction, self.busy),
                    Button("fit", "Fit", "main", self.busy, "Fit the model, from where the sliders are"),
                    Button("reset", "Back to the beginning", disabled=self.busy),
                ],
            ],
            readouts=[self._figures(), *([another_arm.notice("2.15")] if self._another else [])],
            height=300 if self._another else 460,
        )

    def _edges(self) -> dict[str, list[Vector]]:
        """Lower and upper curve of each angle, deg, as long as the curves are those of the fit."""
        if self.band is None or self.fitted is None or self.parameters != self.fitted.parameters:
            return {}
        curves = zip(_ANGLES, self.band.around(self._recording), strict=True)
        return {name: [one.lower / DEG, one.upper / DEG] for name, one in curves}

    def _residuals(self) -> tuple[Any, Any]:
        theta, alpha = (self.compared.degrees(name) - self.compared.degrees(f"{name}_model") for name in _ANGLES)
        return theta, alpha

    def _figures(self) -> Readout:
        rows = []
        for name, symbol, left in zip(_ANGLES, "θα", self._residuals(), strict=True):
            explained = fit_percent(self.compared[name], self.compared[f"{name}_model"])
            rows.append(Row(symbol, (f"{explained:.1f} %", f"{rms(left):.3f} deg")))
        if self.band is not None and self._edges():
            theta, alpha = self.band(self._recording)
            rows.append(Row("inside the band", (f"θ {theta:.1%}", f"α {alpha:.1%}")))
        return Readout("Model against measurement", rows, ("", "model fit", "residual, RMS"))


def explore_validation(lab: Lab) -> ValidationExplorer:
    """The validation explorer, as a notebook makes it; see :class:`ValidationExplorer`.

    It has the student's bench once question 2.15 is answered, and a practice bench before.
    """

    def own() -> ValidationExplorer:
        with another_arm.own_bench(lab) as bench:
            measured = experiments.validation(bench, *another_arm.own_model(lab), progress=False)
        return ValidationExplorer(measured, lab.servo, lab.joint, lab.value("2.12", "K_s"))

    def another() -> ValidationExplorer:
        practice = another_arm.practice()
        return ValidationExplorer(another_arm.validated(), practice.servo, practice.joint, another=True)

    return another_arm.unless_answered(lab, "2.12 K_s, 2.14 A, 2.14 B, 2.15 validation", own, another)
