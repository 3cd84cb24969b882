"""The pole explorer: drag the desired poles, and see gain, response and verdicts follow (Section 3.4)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from labcourse.scene.explorer import Explorer
from labcourse.scene.scene import Button, Choice, Column, Control, Panel, Readout, Row, Scene, Slider
from rotflex.config import one_of
from rotflex.errors import DesignError
from rotflex.simulation import matrices
from rotflex.specifications import AMPLITUDE
from rotflex.units import Vector
from rotflex.widgets import another_arm
from rotflex.widgets.loops import number, played_by_arm, traces, verdicts
from rotflex.widgets.mechanism import mechanism
from rotflex.widgets.placement import COUNT, Cloud, Design, Dominant, Region, cloud, design, spread_of, with_gain

if TYPE_CHECKING:
    from rotflex.course.lab import Lab

PAIR, PARTNER, P3, P4 = "pair", "partner", "p3", "p4"  #: handles
PLANE = (-82.0, 12.0), (-42.0, 42.0)  #: rad/s: all places that a pole may be dragged to
_GRID_ZETA = (0.2, 0.4, 0.6, 0.8)
_NAMED_ZETA = (0.2, 0.6, 0.8)  # with all four, their names would touch
_GRID_OMEGA = (10, 20, 30, 40)  # rad/s
_STEP = 0.5  # rad/s, of one press of a key
_OFF_AXIS = 1.5  # rad/s, by which a key takes a real pair off the axis
_UNITS = ("V/rad", "V/rad", "V/(rad/s)", "V/(rad/s)")
_FEEDBACK = {"full": "full state", "partial": "partial (servo only)"}
_BESIDE = {"step": "nothing", "cloud": "uncertain stiffness (cloud)"}
_MOST_GHOSTS = 3
_START = Dominant()  # the workbook's poles: to begin with, and to go back to
#: How far each may go: the damping ratio; rad/s; rad/s.
ZETA_RANGE, OMEGA_RANGE, REAL_RANGE = (-1.0, 3.0), (5.0, 40.0), (-80.0, 10.0)
_ON_AXIS = 1.2  # rad/s; a pair that is so near to the real axis is two real poles
_SLOWEST = -0.5  # rad/s, of two real poles of the pair


# --- where poles come to lie when they are dragged, or set by numbers -------------------------------------------------


def within(wanted: Dominant) -> Dominant:
    """The nearest poles that the explorer takes: a pair's faster real pole is no further left than the others."""
    omega_n = _clamped(wanted.omega_n, OMEGA_RANGE)
    fastest = -REAL_RANGE[0] / omega_n
    zeta = _clamped(wanted.zeta, (ZETA_RANGE[0], min(ZETA_RANGE[1], (fastest + 1 / fastest) / 2)))
    return Dominant(zeta, omega_n, _clamped(wanted.p3, REAL_RANGE), _clamped(wanted.p4, REAL_RANGE))


def dragged(wanted: Dominant, name: str, x: float, y: float) -> Dominant:
    """The poles, after the one with a name ("pair", "partner", "p3", "p4") was dragged to (x, y), rad/s.

    A pair that comes to the real axis becomes two real poles there, each of which then moves along it; away from the
    axis they are a pair again.
    """
    if name not in (PAIR, PARTNER):
        return within(replace(wanted, **{name: x}))
    if abs(y) > _ON_AXIS or x > _SLOWEST:
        size = math.hypot(x, y) or 1.0
        return within(replace(wanted, zeta=-x / size, omega_n=size))
    if wanted.zeta < 1:
        return within(replace(wanted, zeta=1.0, omega_n=-x))
    slow, fast = wanted.pair.real, wanted.partner.real
    slow, fast = (max(x, fast), fast) if name == PAIR else (slow, min(x, slow))
    omega_n = math.sqrt(slow * fast)
    return within(replace(wanted, zeta=max(1.0, -(slow + fast) / (2 * omega_n)), omega_n=omega_n))


def _clamped(value: float, limits: tuple[float, float]) -> float:
    return min(max(float(value), limits[0]), limits[1])


# --- the s-plane ------------------------------------------------------------------------------------------------------


def _plane(a: Vector, wanted: Dominant, met: Sequence[tuple[Vector, Vector]], numbers: bool) -> Panel:
    """The s-plane with its grid, where the specifications are met, and the poles of the open loop.

    Without ``numbers``, the pair is described by ζ and ωₙ: to work out the poles is a question.
    """
    panel = Panel("imaginary (rad/s)", *PLANE, "real (rad/s)", equal=True, bare=True)
    turn = np.linspace(np.pi / 2, 3 * np.pi / 2, 61)
    for index, (x, y) in enumerate(met):
        panel.area(x, y, "voltage", "" if index else "specifications met", opacity=0.25)
        panel.area(x, -y, "voltage", opacity=0.25)
    panel.band(0.0, 500.0, "ghost", "unstable", axis="x")
    for omega_n in _GRID_OMEGA:
        panel.line(omega_n * np.cos(turn), omega_n * np.sin(turn), "grid")
        panel.text(0.6, omega_n, f"{omega_n}", "left")
    for zeta in _GRID_ZETA:
        tip = 90 * np.array([-zeta, math.sqrt(1 - zeta**2)])
        panel.line([tip[0], 0, tip[0]], [tip[1], 0, -tip[1]], "grid")
        along = 36.0 / max(math.sqrt(1 - zeta**2), 0.75)
        if zeta in _NAMED_ZETA:
            panel.text(-zeta * along, math.sqrt(1 - zeta**2) * along, f"ζ {zeta:g}")
    panel.level(0.0, "axis", axis="x")
    _mark(panel, np.asarray(np.linalg.eigvals(a), dtype=complex), "ghost", "circle", "open loop")
    _handles(panel, wanted, numbers)
    return panel


def _mark(panel: Panel, poles: NDArray[np.complex128], role: str, shape: str, label: str) -> None:
    """Poles that are not to be dragged, with one entry in the legend."""
    for index, pole in enumerate(poles):
        panel.mark(pole.real, pole.imag, role, shape, "" if index else label)


def _handles(panel: Panel, wanted: Dominant, numbers: bool) -> None:
    pair, partner = wanted.pair, wanted.partner
    legend, text = "desired poles: drag them", f"ζ {wanted.zeta:.2f}, ωₙ {wanted.omega_n:.1f} rad/s"

    def place(name: str, pole: complex, label: str, step: tuple[float, float], **more: Any) -> None:
        value = text if name in (PAIR, PARTNER) and not numbers else f"{_pole_text(pole)} rad/s"
        panel.handle(name, pole.real, pole.imag, label, value, step, **more)

    if wanted.zeta < 1:
        panel.mark(partner.real, partner.imag, "measured", "cross", size=7)
        place(PAIR, pair, "dominant pair of poles", (_STEP, _STEP), legend=legend)
    else:
        place(PAIR, pair, "slower pole of the pair", (_STEP, _OFF_AXIS), legend=legend)
        place(PARTNER, partner, "faster pole of the pair", (_STEP, _OFF_AXIS))
    for name, value, label in ((P3, wanted.p3, "third pole"), (P4, wanted.p4, "fourth pole")):
        place(name, complex(value), label, (_STEP, 0.0), axis="x")


# --- in words ---------------------------------------------------------------------------------------------------------


def _pole_text(value: complex) -> str:
    """Write a pole for people, to one decimal."""
    real, imaginary = round(value.real, 1) + 0.0, round(abs(value.imag), 1)
    text = f"{real:.1f}".replace("-", "−")
    return text if imaginary == 0 else f"{text} {'+' if value.imag > 0 else '−'} {imaginary:.1f}j"


def _gain(design: Design) -> Readout:
    """Return the gain as a table, V/rad and V/(rad/s)."""
    values = zip(("k₁", "k₂", "k₃", "k₄"), design.K.ravel().tolist(), _UNITS, strict=True)
    return Readout("Gain K", [Row(name, (number(value), unit)) for name, value, unit in values])


def _polynomial(design: Design) -> Readout:
    """The characteristic polynomial of the poles asked for."""
    powers = ("s⁴", "s³", "s²", "s", "1")
    rows = [Row(power, (number(value),)) for power, value in zip(powers, design.polynomial.tolist(), strict=True)]
    return Readout("Characteristic polynomial", rows, folded=True)


def _certainty(cloud: Cloud) -> Readout:
    """How certain the design is, with the student's own uncertainty of the stiffness."""
    values = {
        "u(K_s)/K_s": f"{100 * cloud.spread:.2g} %",
        "stiffnesses tried": f"{COUNT}",
        "all four met on": f"{100 * cloud.share:.0f} %",
    }
    return Readout("If K_s is not quite that", [Row(label, (value,)) for label, value in values.items()])


def _alt_text(design: Design, numbers: bool) -> str:
    """Describe a design in words, for somebody who cannot see it; with the desired poles as ``numbers`` or without."""
    listed = ", ".join(_pole_text(pole) for pole in design.wanted)
    text = f"Desired poles {listed} rad/s, {design.feedback} state feedback. " if numbers else "Another arm. "
    return text + (" ".join(finding.words for finding in design.findings) or design.trouble)


# --- the explorer -----------------------------------------------------------------------------------------------------


class PoleExplorer(Explorer):
    """Desired poles to be dragged, on a student's own model.

    Parameters
    ----------
    A, B : (4, 4) and (4,) or (4, 1), the model with the motor voltage as input
    K : (1, 4) the student's own gain, drawn for comparison

    Raises
    ------
    DesignError
        If a matrix has the wrong shape, or the model's poles cannot be placed.
    """

    _another, _start = False, _START

    def __init__(self, A: ArrayLike, B: ArrayLike, K: ArrayLike | None = None) -> None:
        self._a, self._b = matrices(A, B)
        self.ghosts: list[Design] = []
        self.wanted, self.feedback, self.beside = self._start, "full", "step"
        self._own = None if K is None else with_gain(self._a, self._b, K)
        self.design = design(self._a, self._b, self.wanted.poles)  # first: it says so if the model cannot be controlled
        self._where_met = lru_cache(1)(Region(self._a, self._b).outline)
        super().__init__()

    # --- what the reader does ---------------------------------------------------------------------------------------

    def set(self, name: str, value: float | str) -> None:
        """A slider or the switch."""
        if name == "feedback":
            self._redesign(self.wanted, one_of("feedback", str(value), _FEEDBACK))
        elif name == "beside":
            self.beside = one_of("beside", str(value), _BESIDE)
        else:
            self._redesign(within(replace(self.wanted, **{name: float(value)})))

    def move(self, name: str, x: float, y: float) -> None:
        """A pole was dragged."""
        self._redesign(dragged(self.wanted, name, x, y))

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
            self.save_picture("pole_design")

    def keep(self) -> None:
        """Show the line of code that gives this gain; no answer changes."""
        messages = [
            "Your answer to question 3.8 stays as it is. To use this gain, write this line at the end of your cell:",
            f"K = np.array([[{', '.join(f'{entry:.6g}' for entry in self.design.K.ravel())}]])",
        ]
        if self.design.runaway is not None:
            messages.append("This design is unstable: nothing can be recorded with it on a bench.")
        if not np.allclose(self.design.wanted, _START.poles):
            messages.append(
                "Question 3.8 asks for the workbook's poles. These are different: for the report, set them back, or "
                "explain your choice."
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
        """The s-plane beside the response and the arm, verdicts and gain below."""
        found, a, b = self.design, self._a, self._b
        met = self._where_met(self.wanted.p3, self.wanted.p4, self.feedback)
        plane = _plane(a, self.wanted, met, not self._another)
        readouts = [verdicts(found), another_arm.notice("3.8")]
        if not self._another:
            readouts = [verdicts(found), _gain(found), _polynomial(found)]
        start = -AMPLITUDE if found.motion is None else float(found.motion["theta"][0])
        if self._own is not None:
            _mark(plane, self._own.poles, "highlight", "square", "your K")
        if self.feedback == "partial":
            _mark(plane, found.poles, "model", "square", "closed loop, partial")
        if self.beside == "cloud":
            uncertain = cloud(a, b, found.applied, spread_of(a))
            poles, label = uncertain.poles.ravel(), f"stiffness uncertain by {100 * uncertain.spread:.2g} %"
            plane.points(poles.real, poles.imag, "highlight", label, size=1.5)
            readouts.insert(2, _certainty(uncertain))
        return Scene(
            alt=_alt_text(found, not self._another),
            columns=[
                Column([plane], 1.0),
                Column(traces(found, self.ghosts), 1.1),
                Column([mechanism(start, 0.0)], 0.55),
            ],
            controls=self._controls(),
            readouts=readouts,
            height=300 if self._another else 460,
            play=played_by_arm(found),
        )

    def _controls(self) -> list[list[Control]]:
        wanted = self.wanted
        rows: list[list[Control]] = [
            [
                Slider("zeta", "ζ", "", *ZETA_RANGE, 0.01, wanted.zeta),
                Slider("omega_n", "ωₙ", "rad/s", *OMEGA_RANGE, 0.1, wanted.omega_n),
            ],
            [
                Slider(P3, "third pole", "rad/s", *REAL_RANGE, 0.5, wanted.p3),
                Slider(P4, "fourth pole", "rad/s", *REAL_RANGE, 0.5, wanted.p4),
            ],
        ]
        feedback = Choice("feedback", "feedback", _FEEDBACK, self.feedback)
        if self._another:
            return [*rows, [feedback, Button("reset", "Back to the beginning")]]
        keep = "Show K as a line of code for your cell of question 3.8"
        return [
            *rows,
            [feedback, Choice("beside", "show as well", _BESIDE, self.beside)],
            [
                Button("reset", "Workbook's poles"),
                Button("ghost", "Leave a ghost", title="Keep this response in the plots, to compare others with it"),
                Button("forget", "Clear ghosts", disabled=not self.ghosts),
                Button("figure", "Figure for the report", title="Save it as PNG and SVG beside the notebook"),
                Button("keep", "Keep this design", "main", title=keep),
            ],
        ]


class OtherPoles(PoleExplorer):
    """The pole explorer on another arm: it shows neither gain nor polynomial, and no complex pole as a number."""

    _another, _start = True, Dominant(0.35, 14.0, -25.0, -35.0)


def explore_poles(
    A: ArrayLike | None = None, B: ArrayLike | None = None, K: ArrayLike | None = None, lab: Lab | None = None
) -> PoleExplorer:
    """The pole explorer, as a notebook makes it; see :class:`PoleExplorer`.

    With ``lab`` alone it has the student's model and gain once question 3.8 is answered, and another arm before.

    Raises
    ------
    DesignError
        As :class:`PoleExplorer`, and if there is neither a model nor a session.
    """
    if A is not None and B is not None:
        return PoleExplorer(A, B, K)
    if lab is None:
        raise DesignError("The pole explorer needs a model A and B, or lab=lab.")
    return another_arm.unless_answered(
        lab,
        "2.14 A, 2.14 B, 3.8 K",
        lambda: PoleExplorer(*another_arm.own_model(lab), lab.value("3.8", "K")),
        lambda: OtherPoles(*another_arm.model()),
    )
