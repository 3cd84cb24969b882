"""What the pole explorer says: verdicts, gain, margins, and how certain they are."""

from __future__ import annotations

import math
from collections.abc import Mapping

from labcourse.scene.scene import Readout, Row
from rotflex.specifications import LIMITS
from rotflex.units import DEG
from rotflex.widgets.cloud import COUNT, Cloud
from rotflex.widgets.margins import DELAY, Margins
from rotflex.widgets.placement import Design, described
from rotflex.widgets.runaway import BORDER, LONGEST, STEP, Runaway

_FEEDBACK = {"full": "full", "partial": "partial"}
_NAMES = ("settling time", "overshoot", "deflection", "voltage")
_UNITS = ("V/rad", "V/rad", "V/(rad/s)", "V/(rad/s)")
_MARKS = {True: ("met", "met"), False: ("missed", "not met"), None: ("unknown", "not measured")}


def verdicts(found: Design) -> Readout:
    """The four specifications, or why there is nothing to hold against them."""
    rows = []
    for finding, name in zip(found.findings, _NAMES, strict=bool(found.findings)):
        unit = finding.specification.unit
        scale = DEG if unit == "rad" else 1.0
        unit = "deg" if unit == "rad" else unit
        value = finding.value
        shown = "–" if value is None else "does not settle" if math.isinf(value) else f"{value / scale:.3g} {unit}"
        mark, words = _MARKS[finding.met]
        rows.append(Row(name, (shown, f"≤ {finding.specification.limit / scale:g} {unit}"), mark, words))
    if found.runaway is not None:
        rows = _of_a_runaway(found.runaway)
    elif not found.findings:
        rows = [Row("no response", (found.trouble.split(":")[0],), "missed", "not met")]
    return Readout("Specifications", rows)


def _of_a_runaway(found: Runaway) -> list[Row]:
    """As many rows as there are specifications, so that nothing moves when a pole crosses the border."""
    grows = f"twice as large every {found.doubled:.2g} s" if found.growth > BORDER else "for ever"
    end = [Row("limit of the bench", (f"not within {LONGEST:g} s",)), Row("", ())]
    if found.stopped is not None:
        reached = f"{found.limit / DEG:.0f} deg of {found.what} after {found.stopped:.2f} s"
        end = [
            Row(f"step of {STEP / DEG:.0f} deg", (reached,)),
            Row("then", ("stopped by the safety, 0 V",)),
        ]
    where = f"at {number(round(found.growth, 3) + 0.0)} rad/s"
    words = "unstable" if found.growth > BORDER else "on the border"
    return [Row("rightmost pole", (where,), "missed", words), Row("swings", (grows,)), *end]


def gain(found: Design, other: Design | None) -> Readout:
    """The gain, beside the one that it is compared with."""
    names = ("k₁", "k₂", "k₃", "k₄")
    values: list[tuple[str, ...]] = [(number(value),) for value in found.K.ravel().tolist()]
    head: tuple[str, ...] = ()
    if other is not None:
        values = [(*one, number(value)) for one, value in zip(values, other.K.ravel().tolist(), strict=True)]
        head = ("", "placed", "LQR", "")
    rows = [Row(name, (*value, unit)) for name, value, unit in zip(names, values, _UNITS, strict=True)]
    return Readout("Gain K", rows, head)


def polynomial(found: Design) -> Readout:
    """The characteristic polynomial of the poles asked for."""
    powers = ("s⁴", "s³", "s²", "s", "1")
    rows = [Row(power, (number(value),)) for power, value in zip(powers, found.polynomial.tolist(), strict=True)]
    return Readout("Characteristic polynomial", rows, folded=True)


def margin_rows(margin: Margins | None) -> Readout:
    """Gain, phase and delay margin of the loop as it runs, each with the frequency at which it would swing."""
    heading = f"Margins with {1000 * DELAY:g} ms of delay"
    if margin is None:
        return Readout(heading, [Row("none", ("As it runs, the loop is unstable.",))])

    def at(omega: float) -> str:
        return f"at {omega:.3g} rad/s" if math.isfinite(omega) else ""

    up = f"× {margin.gain_up:.3g}" if math.isfinite(margin.gain_up) else "no limit"
    down = f"× {margin.gain_down:.3g}" if margin.gain_down > 0 else "no limit"
    phase = f"{margin.phase:.3g} deg" if math.isfinite(margin.phase) else "no limit"
    delay = f"{1000 * margin.delay:.3g} ms" if math.isfinite(margin.delay) else "no limit"
    return Readout(
        heading,
        [
            Row("gain, up to", (up, at(margin.gain_up_at))),
            Row("gain, down to", (down, at(margin.gain_down_at))),
            Row("phase", (phase, at(margin.phase_at))),
            Row("more delay", (delay, at(margin.delay_at))),
        ],
    )


def cloud_rows(found: Cloud) -> Readout:
    """How certain the design is, with the student's own uncertainty of the stiffness."""
    return Readout(
        "If K_s is not quite that",
        [
            Row("u(K_s)/K_s", (f"{100 * found.spread:.2g} %",)),
            Row("stiffnesses tried", (f"{COUNT}",)),
            Row("all four met on", (f"{100 * found.share:.0f} %",)),
        ],
    )


def weight_rows(weights: Mapping[str, float]) -> Readout:
    """What the regulator's weights say."""
    return Readout(
        f"LQR: as bad as {LIMITS['max_vm']:g} V",
        [Row("θ + α of", (f"{weights['error']:g} deg",)), Row("α of", (f"{weights['deflection']:g} deg",))],
    )


def number(value: float) -> str:
    """Four digits, with a true minus sign."""
    text = f"{value:.4g}" if abs(value) < 1e4 else f"{value:.0f}"
    return text.replace("-", "−")


def alt_text_of(found: Design) -> str:
    """A design in words, for somebody who cannot see it."""
    listed = ", ".join(described(pole) for pole in found.wanted)
    text = f"Desired poles {listed} rad/s, {_FEEDBACK[found.feedback]} state feedback. "
    return text + (" ".join(finding.words for finding in found.findings) or found.trouble)
