"""What the pole explorer shows: the plane of the poles, the response, verdicts and gain."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labcourse.scene.scene import Panel, Play, Readout, Row, around
from rotflex.hil.bench import Limits
from rotflex.specifications import AMPLITUDE, LIMITS, SETTLING_BAND
from rotflex.units import DEG, Vector
from rotflex.widgets.mechanism import played
from rotflex.widgets.placement import (
    BORDER,
    COUNT,
    HORIZON,
    LEAD,
    STEP,
    Cloud,
    Design,
    Dominant,
    Runaway,
    pole_text,
)

PAIR, PARTNER, P3, P4 = "pair", "partner", "p3", "p4"  #: handles
PLANE = (-82.0, 12.0), (-42.0, 42.0)  #: rad/s: all places that a pole may be dragged to
GRID_ZETA = (0.2, 0.4, 0.6, 0.8)
_NAMED_ZETA = (0.2, 0.6, 0.8)  # with all four, their names would touch
GRID_OMEGA = (10, 20, 30, 40)  #: rad/s
SHOWN_TIME = 1.0  #: s after the step
_STEP = 0.5  # rad/s, of one press of a key
_OFF_AXIS = 1.5  # rad/s, by which a key takes a real pair off the axis
_NAMES = ("settling time", "overshoot", "deflection", "voltage")
_UNITS = ("V/rad", "V/rad", "V/(rad/s)", "V/(rad/s)")
_MARKS = {True: ("met", "met"), False: ("missed", "not met"), None: ("unknown", "not measured")}


def plane(a: Vector, wanted: Dominant, met: Sequence[tuple[Vector, Vector]], numbers: bool = True) -> Panel:
    """The s-plane with its grid, where the specifications are met, and the poles of the open loop.

    Without ``numbers``, the pair is described by ζ and ωₙ: to work out the poles is a question.
    """
    panel = Panel("imaginary (rad/s)", *PLANE, "real (rad/s)", equal=True, bare=True)
    turn = np.linspace(np.pi / 2, 3 * np.pi / 2, 61)
    for index, (x, y) in enumerate(met):
        panel.area(x, y, "voltage", "" if index else "specifications met", opacity=0.25)
        panel.area(x, -y, "voltage", opacity=0.25)
    panel.band(0.0, 500.0, "ghost", "unstable", axis="x")
    for omega_n in GRID_OMEGA:
        panel.line(omega_n * np.cos(turn), omega_n * np.sin(turn), "grid")
        panel.text(0.6, omega_n, f"{omega_n}", "left")
    for zeta in GRID_ZETA:
        tip = 90 * np.array([-zeta, math.sqrt(1 - zeta**2)])
        panel.line([tip[0], 0, tip[0]], [tip[1], 0, -tip[1]], "grid")
        along = 36.0 / max(math.sqrt(1 - zeta**2), 0.75)
        if zeta in _NAMED_ZETA:
            panel.text(-zeta * along, math.sqrt(1 - zeta**2) * along, f"ζ {zeta:g}")
    panel.level(0.0, "axis", axis="x")
    marks(panel, np.asarray(np.linalg.eigvals(a), dtype=complex), "ghost", "circle", "open loop")
    _handles(panel, wanted, numbers)
    return panel


def marks(panel: Panel, poles: NDArray[np.complex128], role: str, shape: str, label: str) -> None:
    """Poles that are not to be dragged, with one entry in the legend."""
    for index, pole in enumerate(poles):
        panel.mark(pole.real, pole.imag, role, shape, "" if index else label)


def scattered(panel: Panel, cloud: Cloud) -> None:
    """The poles with other stiffnesses."""
    poles = cloud.poles.ravel()
    panel.points(
        poles.real,
        poles.imag,
        "highlight",
        f"stiffness uncertain by {100 * cloud.spread:.2g} %",
        size=1.5,
    )


def _handles(panel: Panel, wanted: Dominant, numbers: bool) -> None:
    pair, partner = wanted.pair, wanted.partner
    legend, text = "desired poles: drag them", f"ζ {wanted.zeta:.2f}, ωₙ {wanted.omega_n:.1f} rad/s"

    def place(name: str, pole: complex, label: str, step: tuple[float, float], **more: Any) -> None:
        value = text if name in (PAIR, PARTNER) and not numbers else f"{pole_text(pole)} rad/s"
        panel.handle(name, pole.real, pole.imag, label, value, step, **more)

    if wanted.zeta < 1:
        panel.mark(partner.real, partner.imag, "measured", "cross", size=7)
        place(PAIR, pair, "dominant pair of poles", (_STEP, _STEP), legend=legend)
    else:
        place(PAIR, pair, "slower pole of the pair", (_STEP, _OFF_AXIS), legend=legend)
        place(PARTNER, partner, "faster pole of the pair", (_STEP, _OFF_AXIS))
    for name, value, label in ((P3, wanted.p3, "third pole"), (P4, wanted.p4, "fourth pole")):
        place(name, complex(value), label, (_STEP, 0.0), axis="x")


# --- the response -----------------------------------------------------------------------------------------------------


def traces(design: Design, ghosts: Sequence[Design]) -> list[Panel]:
    """Servo angle, deflection and voltage after the step."""
    theta, alpha = _servo_angle(design), Panel("α (deg)", (0, 1), (-16.0, 16.0))
    volts = Panel("", (0, 1), (-14.0, 14.0))
    volts.ylabel, volts.xlabel, volts.height = "Vₘ (V)", "time after the step (s)", 1.25
    alpha.x = volts.x = theta.x
    for panel, limit in ((alpha, LIMITS["max_alpha"] / DEG), (volts, LIMITS["max_vm"])):
        if design.runaway is None or panel is volts:
            panel.level(limit, "highlight", "limit")
            panel.level(-limit, "highlight")
    panels = (theta, alpha, volts)
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
    return [theta, alpha, volts]


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
    return replace(played(design.motion, 0.0, end, auto=True), at_once=at_once)


# --- in words ---------------------------------------------------------------------------------------------------------


def verdicts(design: Design) -> Readout:
    """The four specifications, or why there is nothing to hold against them."""
    rows = []
    for finding, name in zip(design.findings, _NAMES, strict=bool(design.findings)):
        unit = finding.specification.unit
        scale = DEG if unit == "rad" else 1.0
        unit = "deg" if unit == "rad" else unit
        value = finding.value
        shown = "–" if value is None else "does not settle" if math.isinf(value) else f"{value / scale:.3g} {unit}"
        mark, words = _MARKS[finding.met]
        rows.append(Row(name, (shown, f"≤ {finding.specification.limit / scale:g} {unit}"), mark, words))
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
        end = [
            Row(f"step of {STEP / DEG:.0f} deg", (reached,)),
            Row("then", ("stopped by the safety, 0 V",)),
        ]
    where = f"at {number(round(runaway.growth, 3) + 0.0)} rad/s"
    words = "unstable" if runaway.growth > BORDER else "on the border"
    return [Row("rightmost pole", (where,), "missed", words), Row("swings", (grows,)), *end]


def gain(design: Design) -> Readout:
    """Return the gain as a table, V/rad and V/(rad/s)."""
    values = zip(("k₁", "k₂", "k₃", "k₄"), design.K.ravel().tolist(), _UNITS, strict=True)
    return Readout("Gain K", [Row(name, (number(value), unit)) for name, value, unit in values])


def polynomial(design: Design) -> Readout:
    """The characteristic polynomial of the poles asked for."""
    powers = ("s⁴", "s³", "s²", "s", "1")
    rows = [Row(power, (number(value),)) for power, value in zip(powers, design.polynomial.tolist(), strict=True)]
    return Readout("Characteristic polynomial", rows, folded=True)


def cloud_rows(cloud: Cloud) -> Readout:
    """How certain the design is, with the student's own uncertainty of the stiffness."""
    return Readout(
        "If K_s is not quite that",
        [
            Row("u(K_s)/K_s", (f"{100 * cloud.spread:.2g} %",)),
            Row("stiffnesses tried", (f"{COUNT}",)),
            Row("all four met on", (f"{100 * cloud.share:.0f} %",)),
        ],
    )


def number(value: float) -> str:
    """Four digits, with a true minus sign."""
    text = f"{value:.4g}" if abs(value) < 1e4 else f"{value:.0f}"
    return text.replace("-", "−")


def design_alt_text(design: Design, numbers: bool = True) -> str:
    """Describe a design in words, for somebody who cannot see it; with the desired poles as ``numbers`` or without."""
    listed = ", ".join(pole_text(pole) for pole in design.wanted)
    text = f"Desired poles {listed} rad/s, {design.feedback} state feedback. " if numbers else "Another arm. "
    return text + (" ".join(finding.words for finding in design.findings) or design.trouble)
