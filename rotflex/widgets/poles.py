"""The pole explorer: drag the desired poles, and see gain, response and verdicts follow (Section 3.4)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from rotflex.courseware.pictures import ROLES, WIDTH, Picture, new_picture, style
from rotflex.courseware.scene.explorer import Explorer
from rotflex.courseware.scene.saved_pictures import save
from rotflex.courseware.scene.scene import Button, Choice, Column, Panel, Readout, Row, Scene, Slider
from rotflex.errors import DesignError
from rotflex.specifications import AMPLITUDE, LIMITS, SETTLING_BAND
from rotflex.units import DEG
from rotflex.widgets.placement import Design, Dominant, Region, described, design, matrices, with_gain

if TYPE_CHECKING:
    from rotflex.lab import Lab

_FEEDBACK = {"full": "full state", "partial": "partial state (servo only)"}
_ZETA, _OMEGA, _REAL = (0.1, 0.99), (5.0, 40.0), (-80.0, -2.0)
_MOST_GHOSTS = 3
_PAIR, _P3, _P4 = "pair", "p3", "p4"
_BAND = tuple(AMPLITUDE / DEG * (1 + side * SETTLING_BAND) for side in (-1, 1))  # deg, about the final angle
_PLANE = (-82.0, 12.0), (-42.0, 42.0)  # rad/s: all places that a pole may be dragged to
_NAMES = ("settling time", "overshoot", "deflection", "voltage")
_UNITS = ("V/rad", "V/rad", "V/(rad/s)", "V/(rad/s)")
_MARKS = {True: ("met", "met"), False: ("missed", "not met"), None: ("unknown", "not measured")}
_GRID_ZETA = (0.2, 0.4, 0.6, 0.8)
_GRID_OMEGA = (10, 20, 30, 40)


class PoleExplorer(Explorer):
    """Desired poles to be dragged, on a student's own model.

    Parameters
    ----------
    A, B : (4, 4) and (4,) or (4, 1), the model with the motor voltage as input
    K : (1, 4) the student's own gain, drawn for comparison
    lab : the student's session; "Keep this design" stores the gain there
    question, part : the answer that it is stored as
    start : the poles to begin with, and to go back to

    Raises
    ------
    DesignError
        If a matrix has the wrong shape, or the model's poles cannot be placed.
    """

    def __init__(
        self,
        A: ArrayLike,
        B: ArrayLike,
        K: ArrayLike | None = None,
        lab: Lab | None = None,
        question: str = "3.8",
        part: str = "K",
        start: Dominant | None = None,
    ) -> None:
        self._a, self._b = matrices(A, B)
        self._lab, self._question, self._part = lab, question, part
        self._start = start or Dominant()
        self._outline: tuple[Any, Any] = (None, [])
        self.ghosts: list[Design] = []
        self.wanted, self.feedback = self._start, "full"
        self._own = None if K is None else with_gain(self._a, self._b, K)
        self.design = design(self._a, self._b, self._start.poles)  # first: it says so if the model cannot be controlled
        self._region = Region(self._a, self._b)
        super().__init__()

    # --- what the reader does ---------------------------------------------------------------------------------------

    def set(self, name: str, value: float | str) -> None:
        """A slider or the switch."""
        if name == "feedback":
            if value not in _FEEDBACK:
                raise DesignError(f"The feedback is full or partial; it was given as {value!r}.")
            self._redesign(self.wanted, str(value))
            return
        low, high = {"zeta": _ZETA, "omega_n": _OMEGA, _P3: _REAL, _P4: _REAL}[name]
        self._redesign(replace(self.wanted, **{name: min(max(float(value), low), high)}))

    def move(self, name: str, x: float, y: float) -> None:
        """A pole was dragged."""
        if name == _PAIR:
            omega_n = min(max(math.hypot(x, y), _OMEGA[0]), _OMEGA[1])
            zeta = min(max(-x / (math.hypot(x, y) or 1.0), _ZETA[0]), _ZETA[1])
            self._redesign(replace(self.wanted, zeta=zeta, omega_n=omega_n))
        else:
            self.set(name, x)

    def press(self, name: str) -> None:
        """A button."""
        if name == "reset":
            self._redesign(self._start, "full")
        elif name == "ghost":
            self.ghosts = [*self.ghosts, self.design][-_MOST_GHOSTS:]
        elif name == "forget":
            self.ghosts = []
        elif name == "keep":
            self.keep()
        elif name == "figure":
            files = save(self.picture(), Path.cwd(), "pole_design")
            self.notice = f"Saved for your report: {' and '.join(path.name for path in files)}."

    def keep(self) -> None:
        """Store the gain as the student's answer.

        Raises
        ------
        DesignError
            If there is no session to store it in.
        """
        if self._lab is None:
            raise DesignError("There is no session to keep the design in: make the explorer with lab=lab.")
        replies = self._lab.record(self._question, **{self._part: self.design.K})
        messages = [
            *replies,
            f"The notebooks that follow use it from now on. What is marked is the code in question {self._question}, "
            "which this button does not change.",
        ]
        if not np.allclose(self.design.wanted, self._start.poles):
            messages.append(
                f"Question {self._question} asks for the workbook's poles, and these are others: for the report, set "
                "them back, or explain your choice."
            )
        self.notice = "\n".join(messages)

    def _redesign(self, wanted: Dominant, feedback: str | None = None) -> None:
        chosen = feedback or self.feedback
        self.design = design(self._a, self._b, wanted.poles, chosen)
        self.wanted, self.feedback = wanted, chosen
        if self._own is not None and feedback is not None:
            self._own = with_gain(self._a, self._b, self._own.K, chosen)

    # --- what there is to see ---------------------------------------------------------------------------------------

    def view(self) -> Scene:
        """The s-plane beside the response, verdicts and gain below."""
        return Scene(
            alt=alt_text_of(self.design),
            columns=[Column([self._plane()], 1.0), Column(self._traces(), 1.1)],
            controls=self._controls(),
            readouts=[_verdicts(self.design), _gain(self.design), _polynomial(self.design)],
            height=460,
        )

    def picture(self) -> Picture:
        """The same as a static figure."""
        return picture(self.design, self.ghosts)

    def _controls(self) -> list[list[Slider | Choice | Button]]:
        wanted = self.wanted
        return [
            [
                Slider("zeta", "ζ", "", *_ZETA, 0.01, wanted.zeta),
                Slider("omega_n", "ωₙ", "rad/s", *_OMEGA, 0.1, wanted.omega_n),
            ],
            [
                Slider(_P3, "third pole", "rad/s", *_REAL, 0.5, wanted.p3),
                Slider(_P4, "fourth pole", "rad/s", *_REAL, 0.5, wanted.p4),
            ],
            [
                Choice("feedback", "feedback", _FEEDBACK, self.feedback),
                Button("reset", "Workbook's poles"),
                Button("ghost", "Leave a ghost", title="Keep this response in the plots, to compare others with it"),
                Button("forget", "Clear ghosts", disabled=not self.ghosts),
                Button("figure", "Figure for the report", title="Save it as PNG and SVG beside the notebook"),
                Button("keep", "Keep this design", "main", self._lab is None, f"Store K as answer {self._question}"),
            ],
        ]

    def _plane(self) -> Panel:
        plane = Panel("imaginary (rad/s)", *_PLANE, "real (rad/s)", equal=True, bare=True)
        turn = np.linspace(np.pi / 2, 3 * np.pi / 2, 61)
        for x, y in self._where_met():
            plane.area(x, y, "voltage", opacity=0.25)
            plane.area(x, -y, "voltage", opacity=0.25)
        if self._outline[1]:  # in the legend once
            plane.items[0]["label"] = "specifications met"
        for omega_n in _GRID_OMEGA:
            plane.line(omega_n * np.cos(turn), omega_n * np.sin(turn), "grid")
            plane.text(0.6, omega_n, f"{omega_n}", "left")
        for zeta in _GRID_ZETA:
            tip = 90 * np.array([-zeta, math.sqrt(1 - zeta**2)])
            plane.line([tip[0], 0, tip[0]], [tip[1], 0, -tip[1]], "grid")
            along = 33.0 / max(math.sqrt(1 - zeta**2), 0.75)
            word = "ζ " if zeta == _GRID_ZETA[-1] else ""
            plane.text(-zeta * along, math.sqrt(1 - zeta**2) * along, f"{word}{zeta:g}")
        plane.level(0.0, "axis", axis="x")
        for index, pole in enumerate(np.linalg.eigvals(self._a)):
            plane.mark(pole.real, pole.imag, "ghost", "circle", "open loop" if index == 0 else "")
        if self._own is not None:
            for index, pole in enumerate(self._own.poles):
                plane.mark(pole.real, pole.imag, "highlight", "square", "your K" if index == 0 else "")
        if self.feedback == "partial":
            for index, pole in enumerate(self.design.poles):
                label = "closed loop, partial" if index == 0 else ""
                plane.mark(pole.real, pole.imag, "model", "square", label)
        pair = self.wanted.pair
        plane.mark(pair.real, -pair.imag, "measured", "cross", size=7)
        text = f"{described(pair)} rad/s"
        plane.handle(
            _PAIR, pair.real, pair.imag, "dominant pair of poles", text, (0.5, 0.5), legend="desired poles: drag them"
        )
        for name, value, label in ((_P3, self.wanted.p3, "third pole"), (_P4, self.wanted.p4, "fourth pole")):
            text = f"{described(complex(value))} rad/s"
            plane.handle(name, value, 0.0, label, text, (0.5, 0.0), axis="x")
        return plane

    def _where_met(self) -> list[tuple[Any, Any]]:
        asked = (self.wanted.p3, self.wanted.p4, self.feedback)
        if self._outline[0] != asked:
            self._outline = (asked, self._region.outline(*asked))
        curves: list[tuple[Any, Any]] = self._outline[1]
        return curves

    def _traces(self) -> list[Panel]:
        span = (-0.06, 1.0)
        theta = Panel("θ (deg)", span, (-26.0, 30.0), height=1.3)
        alpha = Panel("α (deg)", span, (-16.0, 16.0))
        volts = Panel("Vₘ (V)", span, (-14.0, 14.0), "time after the step (s)", height=1.25)
        theta.band(_BAND[0], _BAND[1], "highlight", "settling band")
        theta.level(LIMITS["settling_time"], "highlight", "time limit", axis="x")
        for panel, limit in ((alpha, LIMITS["max_alpha"] / DEG), (volts, LIMITS["max_vm"])):
            panel.level(limit, "highlight", "limit")
            panel.level(-limit, "highlight")
        for index, ghost in enumerate(self.ghosts):
            _draw(ghost, (theta, alpha, volts), "ghost", "" if index else "ghost")
        recording = self.design.recording
        if recording is not None:
            theta.line(recording.time, recording.degrees("theta_ref"), "reference", "command")
            _draw(self.design, (theta, alpha, volts), "measured", "this design")
            for panel, values in ((alpha, recording.degrees("alpha")), (volts, recording["vm"])):
                reach = max(panel.y[1], 1.1 * float(np.abs(values).max()))
                panel.y = (-reach, reach)
        return [theta, alpha, volts]


def explore_poles(A: ArrayLike, B: ArrayLike, K: ArrayLike | None = None, lab: Lab | None = None) -> PoleExplorer:
    """The pole explorer, as a notebook makes it; see :class:`PoleExplorer`."""
    return PoleExplorer(A, B, K, lab)


def _draw(found: Design, panels: Sequence[Panel], role: str, label: str = "") -> None:
    if found.recording is None:
        return
    time = found.recording.time
    curves = (found.recording.degrees("theta"), found.recording.degrees("alpha"), found.recording["vm"])
    for panel, values in zip(panels, curves, strict=True):
        panel.line(time, values, role, label)
        label = ""  # in the legend once


# --- in words and numbers -------------------------------------------------------------------------------------------


def _verdicts(found: Design) -> Readout:
    rows = []
    for finding, name in zip(found.findings, _NAMES, strict=bool(found.findings)):
        unit = finding.specification.unit
        scale = DEG if unit == "rad" else 1.0
        unit = "deg" if unit == "rad" else unit
        value = finding.value
        shown = "–" if value is None else "does not settle" if math.isinf(value) else f"{value / scale:.3g} {unit}"
        mark, words = _MARKS[finding.met]
        rows.append(Row(name, (shown, f"≤ {finding.specification.limit / scale:g} {unit}"), mark, words))
    if not found.findings:
        rows = [Row("no response", (found.trouble.split(":")[0],), "missed", "not met")]
    return Readout("Specifications", rows)


def _gain(found: Design) -> Readout:
    names = ("k₁", "k₂", "k₃", "k₄")
    values = found.K.ravel().tolist()
    rows = [Row(name, (_number(value), unit)) for name, value, unit in zip(names, values, _UNITS, strict=True)]
    return Readout("Gain K", rows)


def _polynomial(found: Design) -> Readout:
    powers = ("s⁴", "s³", "s²", "s", "1")
    rows = [Row(power, (_number(value),)) for power, value in zip(powers, found.polynomial.tolist(), strict=True)]
    return Readout("Characteristic polynomial", rows, folded=True)


def _number(value: float) -> str:
    text = f"{value:.4g}" if abs(value) < 1e4 else f"{value:.0f}"
    return text.replace("-", "−")


def alt_text_of(found: Design) -> str:
    """A design in words, for somebody who cannot see it."""
    listed = ", ".join(described(pole) for pole in found.wanted)
    text = f"Desired poles {listed} rad/s, {found.feedback} state feedback. "
    return text + (" ".join(finding.words for finding in found.findings) or found.trouble)


# --- as a static figure ---------------------------------------------------------------------------------------------


def picture(found: Design, ghosts: Sequence[Design] = ()) -> Picture:
    """A design as a static figure: poles beside servo angle, deflection and voltage after a step of 40 deg.

    Parameters
    ----------
    found : from :func:`~rotflex.widgets.placement.design`
    ghosts : earlier designs, for comparison
    """
    faint: dict[str, Any] = {"color": "#777777", "linestyle": (0, (3, 3)), "linewidth": 1.2}
    with style():
        figure = new_picture(1.35 * WIDTH, 4.6)
        plane, *rest = figure.subplot_mosaic([["s", "theta"], ["s", "alpha"], ["s", "vm"]]).values()
        turn = np.linspace(np.pi / 2, 3 * np.pi / 2, 91)
        grid: dict[str, Any] = {"color": "#BBBBBB", "linewidth": 0.8, "zorder": 1}
        for omega_n in _GRID_OMEGA:
            plane.plot(omega_n * np.cos(turn), omega_n * np.sin(turn), **grid)
        for zeta in _GRID_ZETA:
            x, y = -90 * zeta, 90 * math.sqrt(1 - zeta**2)
            plane.plot([x, 0, x], [y, 0, -y], **grid)
        plane.axvline(0.0, color="black", linewidth=1.0)
        for points, marker, color, label in (
            (found.wanted, "x", ROLES["measured"]["color"], "desired"),
            (found.poles, "s", ROLES["model"]["color"], "closed loop"),
        ):
            look: dict[str, Any] = {"linestyle": "none", "markersize": 9, "markeredgewidth": 2, "fillstyle": "none"}
            plane.plot(points.real, points.imag, marker=marker, color=color, label=label, **look)
        lowest = min(float(found.wanted.real.min()), -46.0)
        plane.set(xlim=(1.12 * lowest, 6), ylim=(-36, 36), xlabel="real part (rad/s)", ylabel="imaginary part (rad/s)")
        plane.grid(False)
        plane.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
        shown = (("theta", "θ (deg)"), ("alpha", "α (deg)"), ("vm", "$V_m$ (V)"))
        for axes, (channel, label) in zip(rest, shown, strict=True):
            for one, drawn in [*((ghost, faint) for ghost in ghosts), (found, ROLES["measured"])]:
                if one.recording is not None:
                    values = one.recording[channel] if channel == "vm" else one.recording.degrees(channel)
                    axes.plot(one.recording.time, values, **drawn)
            axes.set(ylabel=label, xlim=(-0.06, 1.0))
        theta, alpha, volts = rest
        if found.recording is not None:
            theta.plot(found.recording.time, found.recording.degrees("theta_ref"), **ROLES["reference"])
        theta.axhspan(*_BAND, color=ROLES["highlight"]["color"], alpha=0.4)
        for axes, limit in ((alpha, LIMITS["max_alpha"] / DEG), (volts, LIMITS["max_vm"])):
            axes.axhline(limit, **ROLES["highlight"])
            axes.axhline(-limit, **ROLES["highlight"])
        volts.set_xlabel("time after the step (s)")
    figure.alt_text = alt_text_of(found)
    return figure
