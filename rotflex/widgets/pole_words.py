"""What the pole explorer says: verdicts, gain, margins, and how certain they are."""

from __future__ import annotations

import math
from collections.abc import Mapping

from rotflex.courseware.messages import N_, _
from rotflex.courseware.scene.scene import Readout, Row
from rotflex.specifications import LIMITS
from rotflex.units import DEG
from rotflex.widgets.cloud import COUNT, Cloud
from rotflex.widgets.margins import Margins
from rotflex.widgets.placement import Design, described
from rotflex.widgets.runaway import BORDER, LONGEST, STEP, Runaway

_FEEDBACK = {"full": N_("full"), "partial": N_("partial")}
_NAMES = (N_("settling time"), N_("overshoot"), N_("deflection"), N_("voltage"))
_UNITS = ("V/rad", "V/rad", "V/(rad/s)", "V/(rad/s)")
_MARKS = {True: ("met", N_("met")), False: ("missed", N_("not met")), None: ("unknown", N_("not measured"))}


def verdicts(found: Design) -> Readout:
    """The four specifications, or why there is nothing to hold against them."""
    rows = []
    for finding, name in zip(found.findings, _NAMES, strict=bool(found.findings)):
        unit = finding.specification.unit
        scale = DEG if unit == "rad" else 1.0
        unit = "deg" if unit == "rad" else unit
        value = finding.value
        shown = "–" if value is None else _("does not settle") if math.isinf(value) else f"{value / scale:.3g} {unit}"
        mark, words = _MARKS[finding.met]
        rows.append(Row(_(name), (shown, f"≤ {finding.specification.limit / scale:g} {unit}"), mark, _(words)))
    if found.runaway is not None:
        rows = _of_a_runaway(found.runaway)
    elif not found.findings:
        rows = [Row(_("no response"), (found.trouble.split(":")[0],), "missed", _("not met"))]
    return Readout(_("Specifications"), rows)


def _of_a_runaway(found: Runaway) -> list[Row]:
    """As many rows as there are specifications, so that nothing moves when a pole crosses the border."""
    grows = (
        _("twice as large every {doubled:.2g} s").format(doubled=found.doubled)
        if found.growth > BORDER
        else _("for ever")
    )
    end = [Row(_("limit of the bench"), (_("not within {longest:g} s").format(longest=LONGEST),)), Row("", ())]
    if found.stopped is not None:
        reached = _("{limit_deg:.0f} deg of {what} after {stopped:.2f} s").format(
            limit_deg=found.limit / DEG, what=found.what, stopped=found.stopped
        )
        end = [
            Row(_("step of {step_deg:.0f} deg").format(step_deg=STEP / DEG), (reached,)),
            Row(_("then"), (_("stopped by the safety, 0 V"),)),
        ]
    where = _("at {number} rad/s").format(number=number(round(found.growth, 3) + 0.0))
    words = _("unstable") if found.growth > BORDER else _("on the border")
    return [Row(_("rightmost pole"), (where,), "missed", words), Row(_("swings"), (grows,)), *end]


def gain(found: Design, other: Design | None) -> Readout:
    """The gain, beside the one that it is compared with."""
    names = ("k₁", "k₂", "k₃", "k₄")
    values: list[tuple[str, ...]] = [(number(value),) for value in found.K.ravel().tolist()]
    head: tuple[str, ...] = ()
    if other is not None:
        values = [(*one, number(value)) for one, value in zip(values, other.K.ravel().tolist(), strict=True)]
        head = ("", _("placed"), "LQR", "")
    rows = [Row(name, (*value, unit)) for name, value, unit in zip(names, values, _UNITS, strict=True)]
    return Readout(_("Gain K"), rows, head)


def polynomial(found: Design) -> Readout:
    """The characteristic polynomial of the poles asked for."""
    powers = ("s⁴", "s³", "s²", "s", "1")
    rows = [Row(power, (number(value),)) for power, value in zip(powers, found.polynomial.tolist(), strict=True)]
    return Readout(_("Characteristic polynomial"), rows, folded=True)


def margin_rows(margin: Margins | None) -> Readout:
    """Gain, phase and delay margin, each with the frequency of the swing that waits there."""
    if margin is None:
        return Readout(_("Margins of the loop"), [Row(_("none"), (_("The loop is not stable."),))])

    def at(omega: float) -> str:
        return _("at {omega:.3g} rad/s").format(omega=omega) if math.isfinite(omega) else ""

    up = f"× {margin.gain_up:.3g}" if math.isfinite(margin.gain_up) else _("no limit")
    down = f"× {margin.gain_down:.3g}" if margin.gain_down > 0 else _("no limit")
    phase = f"{margin.phase:.3g} deg" if math.isfinite(margin.phase) else _("no limit")
    delay = f"{1000 * margin.delay:.3g} ms" if math.isfinite(margin.delay) else _("no limit")
    return Readout(
        _("Margins of the loop"),
        [
            Row(_("gain, up to"), (up, at(margin.gain_up_at))),
            Row(_("gain, down to"), (down, at(margin.gain_down_at))),
            Row(_("phase"), (phase, at(margin.phase_at))),
            Row(_("delay"), (delay, at(margin.delay_at))),
        ],
    )


def cloud_rows(found: Cloud) -> Readout:
    """How certain the design is, with the student's own uncertainty of the stiffness."""
    return Readout(
        _("If K_s is not quite that"),
        [
            Row("u(K_s)/K_s", (f"{100 * found.spread:.2g} %",)),
            Row(_("stiffnesses tried"), (f"{COUNT}",)),
            Row(_("all four met on"), (f"{100 * found.share:.0f} %",)),
        ],
    )


def weight_rows(weights: Mapping[str, float]) -> Readout:
    """What the regulator's weights say."""
    return Readout(
        _("LQR: as bad as {limits:g} V").format(limits=LIMITS["max_vm"]),
        [Row(_("θ + α of"), (f"{weights['error']:g} deg",)), Row(_("α of"), (f"{weights['deflection']:g} deg",))],
    )


def number(value: float) -> str:
    """Four digits, with a true minus sign."""
    text = f"{value:.4g}" if abs(value) < 1e4 else f"{value:.0f}"
    return text.replace("-", "−")


def alt_text_of(found: Design) -> str:
    """A design in words, for somebody who cannot see it."""
    listed = ", ".join(described(pole) for pole in found.wanted)
    text = _("Desired poles {names} rad/s, {feedback} state feedback. ").format(
        names=listed, feedback=_(_FEEDBACK[found.feedback])
    )
    return text + (" ".join(finding.words for finding in found.findings) or found.trouble)
