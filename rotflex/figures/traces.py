"""Plots against time: the sweep, a free decay, the validation, tracking, and how a response is read."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from rotflex.figures.pictures import BLACK, BLUE, PURPLE, ROLES, VERMILLION, WIDTH, Picture, new_picture, style
from rotflex.specifications import LIMITS, SETTLING_BAND
from rotflex.units import DEG

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from rotflex.recording import Recording

_PARTIAL: dict[str, Any] = {"color": BLUE, "linestyle": (0, (4, 1.5)), "linewidth": 1.5}


def sweep_response(recording: Recording) -> Picture:
    """Servo angle and deflection during the sine sweep, in degrees against time (Figure 2.5).

    Parameters
    ----------
    recording : with channels ``theta`` and ``alpha``; ``theta_ref`` is drawn if it is there
    """
    with style():
        figure, (upper, lower) = _stack(2)
        if "theta_ref" in recording:
            _angle(upper, recording, "theta_ref", "reference", "reference")
        _angle(upper, recording, "theta", "measured", "measured")
        _angle(lower, recording, "alpha", "measured", "measured")
        _name_axes(upper, r"$\theta$ (deg)")
        _name_axes(lower, r"$\alpha$ (deg)")
        _legend(upper)
    alpha = np.abs(recording.degrees("alpha"))
    figure.alt_text = (
        f"Two plots against time, 0 to {recording.time[-1]:.2g} s. The servo angle theta swings ever faster. The "
        f"deflection alpha swings with it, and most of all near {recording.time[alpha.argmax()]:.0f} s, by about "
        f"{alpha.max():.0f} deg."
    )
    return figure


def free_decay(recording: Recording, peaks: ArrayLike | None = None) -> Picture:
    """Deflection after a release with the servo held, in degrees against time.

    Parameters
    ----------
    recording : with channel ``alpha``
    peaks : (n,) times of the peaks to mark, s
    """
    with style():
        figure, (axes,) = _stack(1)
        _angle(axes, recording, "alpha", "measured", "measured")
        if peaks is not None:
            times = np.asarray(peaks, dtype=float)
            heights = np.interp(times, recording.time, recording.degrees("alpha"))
            marks = {"color": ROLES["highlight"]["color"], "linestyle": "none", "markeredgecolor": "black"}
            axes.plot(times, heights, marker="o", label="peaks", zorder=4, **marks)
            _legend(axes)
        _name_axes(axes, r"$\alpha$ (deg)")
    figure.alt_text = (
        f"The deflection alpha against time, 0 to {recording.time[-1]:.2g} s: it swings back and forth and dies away."
    ) + ("" if peaks is None else f" Peaks marked: {times.size}.")
    return figure


def validation(recording: Recording) -> Picture:
    """Measured and modelled response to the same voltage: theta above, alpha below (Figures 2.7 and 2.8).

    Parameters
    ----------
    recording : with channels ``theta``, ``theta_model``, ``alpha`` and ``alpha_model``
    """
    with style():
        figure, panels = _stack(2)
        for axes, angle in zip(panels, ("theta", "alpha"), strict=True):
            _angle(axes, recording, angle, "measured", "measured")
            _angle(axes, recording, f"{angle}_model", "model", "model")
            _name_axes(axes, rf"$\{angle}$ (deg)")
        _legend(panels[0])
    figure.alt_text = (
        f"Two plots against time, 0 to {recording.time[-1]:.2g} s: the servo angle theta and the deflection "
        "alpha, each as measured (solid) and as the model has it (dash-dotted)."
    )
    return figure


def tracking(recording: Recording, specifications: bool = True) -> Picture:
    """The closed loop following its reference: theta, alpha and the voltage (Figures 3.4, 3.6 and 3.7).

    Parameters
    ----------
    recording : with channels ``theta_ref``, ``theta``, ``alpha`` and ``vm``
    specifications : whether to draw the settling band and the limits of Section 3.1
    """
    with style():
        figure, (upper, middle, lower) = _stack(3)
        _angle(upper, recording, "theta", "measured", r"$\theta$")
        _angle(upper, recording, "theta_ref", "reference", "reference")
        _angle(middle, recording, "alpha", "measured", r"$\alpha$")
        lower.plot(recording.time, recording["vm"], label="$V_m$", **ROLES["voltage"])
        if specifications:
            _settling_bands(upper, recording.degrees("theta_ref"))
            _limits(middle, LIMITS["max_alpha"] / DEG, "deg")
            _limits(lower, LIMITS["max_vm"], "V")
        for axes, name in ((upper, r"$\theta$ (deg)"), (middle, r"$\alpha$ (deg)"), (lower, "$V_m$ (V)")):
            _name_axes(axes, name)
            _legend(axes)
    reference, alpha, vm = recording.degrees("theta_ref"), recording.degrees("alpha"), recording["vm"]
    figure.alt_text = (
        f"Three plots against time, 0 to {recording.time[-1]:.2g} s. The servo angle theta follows a reference "
        f"between {reference.min():.0f} and {reference.max():.0f} deg; the deflection alpha goes up to about "
        f"{np.abs(alpha).max():.0f} deg and the voltage to about {np.abs(vm).max():.0f} V."
    ) + (" The settling band, the limits of alpha and of the voltage are drawn in." if specifications else "")
    return figure


def compare_tracking(full: Recording, partial: Recording) -> Picture:
    """Full and partial state feedback following the same reference, laid over each other (Section 3.4.4).

    Parameters
    ----------
    full, partial : with channels ``theta_ref``, ``theta``, ``alpha`` and ``vm``
    """
    runs = (("partial", partial, _PARTIAL), ("full", full, ROLES["measured"]))
    with style():
        figure, (upper, middle, lower) = _stack(3)
        for label, recording, look in runs:
            upper.plot(recording.time, recording.degrees("theta"), label=label, **look)
            middle.plot(recording.time, recording.degrees("alpha"), label=label, **look)
            lower.plot(recording.time, recording["vm"], label=label, **look | {"linewidth": 1.0})
        _angle(upper, full, "theta_ref", "reference", "reference")
        _settling_bands(upper, full.degrees("theta_ref"))
        _limits(middle, LIMITS["max_alpha"] / DEG, "deg")
        _limits(lower, LIMITS["max_vm"], "V")
        for axes, name in ((upper, r"$\theta$ (deg)"), (middle, r"$\alpha$ (deg)"), (lower, "$V_m$ (V)")):
            _name_axes(axes, name)
            _legend(axes)
    rms = [float(np.sqrt(np.mean(recording.degrees("alpha") ** 2))) for recording in (full, partial)]
    figure.alt_text = (
        f"Three plots against time, 0 to {full.time[-1]:.2g} s: the servo angle theta with its reference, the "
        "deflection alpha, and the voltage, each with full (solid) and with partial state feedback (dashed). "
        f"The deflection's root mean square is {rms[0]:.1f} deg with full and {rms[1]:.1f} deg with partial "
        "feedback. The settling band, the limits of alpha and of the voltage are drawn in."
    )
    return figure


def reading_a_response() -> Picture:
    """Draw how settling time and overshoot are read off a step from -20 to 20 degrees, on a made-up response."""
    zeta, omega = 0.55, 16.0
    omega_d = omega * np.sqrt(1 - zeta**2)
    time = np.linspace(0, 0.8, 801)
    decay = np.exp(-zeta * omega * time) * (np.cos(omega_d * time) + zeta * omega / omega_d * np.sin(omega_d * time))
    angle = 20 - 40 * decay
    band = SETTLING_BAND * 20
    settled = np.flatnonzero(np.abs(angle - 20) > band)[-1] + 1
    peak = angle.argmax()
    between: dict[str, Any] = {"arrowstyle": "<->", "shrinkA": 0, "shrinkB": 0}
    with style():
        figure = new_picture(WIDTH, 3.6)
        axes = figure.subplots()
        axes.axhspan(20 - band, 20 + band, color=PURPLE, alpha=0.35, label=f"band, 20 ± {band:g} deg")
        axes.plot([-0.1, 0, 0.02, 0.8], [-20, -20, 20, 20], label=r"command $\theta_d$", **ROLES["reference"])
        axes.plot([-0.1, *time], [-20, *angle], color=BLUE, label=r"servo angle $\theta$")
        axes.plot(time[settled], angle[settled], "o", color=VERMILLION, label="in the band for good")
        for moment in (0, time[settled]):
            axes.axvline(moment, color=BLACK, linewidth=0.8, linestyle=":")
        axes.annotate("", (0, -8), (time[settled], -8), arrowprops=between)
        axes.text(0.6 * time[settled], -6.5, "settling time $t_s$", ha="center")
        axes.annotate("", (time[peak], 20), (time[peak], angle[peak]), arrowprops=between)
        axes.annotate("overshoot (deg)", (time[peak], 22.6), (0.36, 26), arrowprops={"arrowstyle": "-"})
        axes.annotate("", (0.46, -20), (0.46, 20), arrowprops=between)
        axes.text(0.47, 3, "step, 40 deg")
        axes.set(xlabel="time since the command began to move (s)", ylabel="angle (deg)")
        axes.set(xlim=(-0.1, 0.8), ylim=(-24, 30))
        axes.legend(loc="lower right", fontsize=9)
    figure.alt_text = (
        "A made-up step response from -20 to 20 degrees. It overshoots, comes back, and stays within the band of 20 "
        "plus or minus 0.8 degrees; the settling time runs from the first movement of the command to the point at "
        "which the curve enters the band for the last time. The overshoot is the height of the peak above 20 "
        "degrees; the step is 40 degrees high."
    )
    return figure


def _stack(rows: int) -> tuple[Picture, Any]:
    """A picture with ``rows`` plots above each other, which share the time axis."""
    figure = new_picture(WIDTH, 0.9 + 1.75 * rows if rows > 1 else 3.0)
    panels = figure.subplots(rows, 1, sharex=True, squeeze=False)[:, 0]
    panels[-1].set_xlabel("time (s)")
    return figure, panels


def _angle(axes: Axes, recording: Recording, channel: str, role: str, label: str) -> None:
    axes.plot(recording.time, recording.degrees(channel), label=label, **ROLES[role])
    axes.set_xlim(recording.time[0], recording.time[-1])


def _name_axes(axes: Axes, quantity: str) -> None:
    axes.set_ylabel(quantity)
    axes.margins(y=0.08)


def _legend(axes: Axes) -> None:
    """A legend above the plot, where it hides nothing."""
    count = len(axes.get_legend_handles_labels()[0])
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 0.97), ncols=count, borderaxespad=0.0)


def _settling_bands(axes: Axes, reference_deg: Any) -> None:
    """The band that the servo must settle in, about each of the two angles that the reference goes between."""
    label = f"settling band, ±{100 * SETTLING_BAND:g} %"
    for level in sorted({float(reference_deg.min()), float(reference_deg.max())} - {0.0}):
        half = SETTLING_BAND * abs(level)
        axes.axhspan(
            level - half, level + half, facecolor=ROLES["highlight"]["color"], alpha=0.45, label=label, zorder=1
        )
        label = "_the same"


def _limits(axes: Axes, limit: float, unit: str) -> None:
    axes.axhline(limit, label=f"limit ±{limit:g} {unit}", **ROLES["highlight"])
    axes.axhline(-limit, **ROLES["highlight"])
