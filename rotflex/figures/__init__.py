"""The workbook's figures: drawings of the mechanism and of the loops, and plots of what is measured.

A drawing is an SVG file in ``rotflex/figures/drawings``, with its description for those who cannot see it;
:func:`show_drawing` puts it into a notebook, as in ``figures.show_drawing("joint_angles")``. A plot is drawn by a
function that returns a matplotlib figure, which carries its own description; :func:`show` puts it into a notebook.

================  ===========================================================
figure            drawing, or function of a plot
================  ===========================================================
2.1, 2.2          ``"joint_angles"``, ``"lumped_model"``
2.3               ``compound_sine_spectrum``
2.4, 2.6          ``"sweep_experiment"``, ``"validation_experiment"``
2.7, 2.8          ``validation``
3.1               ``"desired_poles"`` in symbols, ``pole_map`` in numbers
3.2, 3.3, 3.5     ``"state_feedback"``, ``"simulation_loop"``, ``"implementation_loop"``
3.4, 3.6, 3.7     ``tracking``
beyond the book   ``naive_against_true``, ``free_decay``, ``compare_tracking``, ``motions_of_poles``,
                  ``reading_a_response``, ``"trolley_with_pendulum"``
================  ===========================================================

The colours are Okabe and Ito's, which people with any kind of colour vision can tell apart. Each stands for one thing
throughout the course, and what is drawn together differs in line style too, so that a grey print can be read.
"""

from __future__ import annotations

import base64
import html
import io
import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import cycle
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import ArrayLike
from PIL import Image

from rotflex.errors import RotflexError
from rotflex.specifications import LIMITS, SETTLING_BAND
from rotflex.units import DEG

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from rotflex.recording import Recording

__all__ = [
    "ROLES",
    "Picture",
    "compare_tracking",
    "compound_sine_spectrum",
    "free_decay",
    "motions_of_poles",
    "naive_against_true",
    "new_picture",
    "pole_map",
    "reading_a_response",
    "show",
    "show_drawing",
    "style",
    "tracking",
    "validation",
]


def __dir__() -> list[str]:
    return __all__


BLACK, BLUE, VERMILLION, GREEN, PURPLE = "#000000", "#0072B2", "#D55E00", "#009E73", "#CC79A7"

#: What a line stands for -> how it is drawn. Keyword arguments of ``Axes.plot``.
ROLES: dict[str, dict[str, Any]] = {
    "reference": {"color": BLACK, "linestyle": (0, (5, 2)), "linewidth": 1.2},
    "measured": {"color": VERMILLION, "linestyle": "-", "linewidth": 1.5},
    "model": {"color": BLUE, "linestyle": (0, (6, 1.5, 1.5, 1.5)), "linewidth": 1.8},
    "voltage": {"color": GREEN, "linestyle": "-", "linewidth": 1.2},
    "highlight": {"color": PURPLE, "linestyle": (0, (1.2, 1.2)), "linewidth": 2.0},
}

WIDTH = 7.0  #: inches; the width of every plot
DOTS_PER_INCH = 130  # crisp on paper and on dense screens ...
SHOWN_PER_INCH = 100  # ... while the notebook shows it at this size
#: Environment variable; "off" draws no image, as where nobody looks at the notebook.
PICTURES_SWITCH = "LABCOURSE_PICTURES"

_DRAWINGS = Path(__file__).with_name("drawings")
_STYLE = mpl.rc_params_from_file(Path(__file__).with_name("laboratory.mplstyle"), use_default_template=False)
_THETA, _ALPHA, _VOLTS = r"$\theta$ (deg)", r"$\alpha$ (deg)", "$V_m$ (V)"  # labels of axes
_CHANNELS = {"theta": r"$\theta$", "alpha": r"$\alpha$", "vm": "$V_m$"}
_DRAWN_IN = "The settling band, the limits of alpha and of the voltage are drawn in."
_MARKS = (("x", BLUE), ("s", VERMILLION), ("D", GREEN), ("+", BLACK))  # groups of poles differ by shape, too
_SWEPT = (0.5, 6.0)  # Hz, that the spectra of sweeps are drawn for
_GRID_ZETA = (0.2, 0.4, 0.6, 0.8)


# --- how figures look, and how a notebook shows one -------------------------------------------------------------------


@contextmanager
def style() -> Iterator[None]:
    """Use the laboratory's matplotlib settings within a ``with`` block.

    Only these are restored afterwards. (``rc_context`` restores all: a pyplot that is first imported inside the block
    would lose its notebook backend's settings, and students' plots would not show.)
    """
    before = {name: mpl.rcParams[name] for name in _STYLE}
    mpl.rcParams.update(_STYLE)
    try:
        yield
    finally:
        mpl.rcParams.update(before)


class Picture(Figure):
    """A matplotlib figure that carries its own description.

    Attributes
    ----------
    alt_text : what is to be seen, for somebody who cannot see it

    It is not registered with pyplot: nothing has to be closed, and a notebook shows it once.
    """

    alt_text: str = ""

    def _repr_mimebundle_(self, **_: Any) -> tuple[dict[str, str], dict[str, Any]]:
        return bundle(self, self.alt_text)


def new_picture(width: float, height: float) -> Picture:
    """An empty picture of the given size (inches). Call it, and draw, within ``style()``."""
    return Picture(figsize=(width, height), layout="constrained")


def png(figure: Figure) -> bytes:
    """The figure as an opaque PNG image, of 128 colours: a third of the size, and none is missed in a plot."""
    drawn, packed = io.BytesIO(), io.BytesIO()
    if figure.get_layout_engine() is None and any(axes.get_subplotspec() for axes in figure.axes):
        # Else a label may be cut off.
        figure.set_layout_engine("constrained")
    with style():
        figure.savefig(drawn, format="png", dpi=DOTS_PER_INCH, facecolor="white")
    Image.open(drawn).convert("RGB").quantize(128, Image.Quantize.FASTOCTREE).save(packed, format="PNG", optimize=True)
    return packed.getvalue()


def bundle(figure: Figure, alt: str) -> tuple[dict[str, str], dict[str, Any]]:
    """A notebook's display data and metadata for a figure."""
    if os.environ.get(PICTURES_SWITCH) == "off":
        return {"text/plain": repr(figure)}, {}
    image = base64.b64encode(png(figure)).decode("ascii")
    width = round(figure.get_figwidth() * SHOWN_PER_INCH)
    return {"image/png": image, "text/plain": repr(figure)}, {"image/png": {"alt": alt, "width": width}}


def show(figure: Figure, alt: str | None = None, caption: str | None = None) -> None:
    """Show a figure in the notebook, with a description for those who cannot see it, and close it.

    Parameters
    ----------
    figure : any matplotlib figure
    alt : what is to be seen; the figures of this package bring their own
    caption : Markdown, shown below the figure

    The description goes into the image's metadata, and again below the caption, folded away: neither JupyterLab nor
    nbconvert's usual template hands an image's metadata to a screen reader. Outside a notebook there is nowhere to show
    the figure: it is checked and closed. Where nobody looks (``LABCOURSE_PICTURES=off`` in the environment), it is not
    drawn.

    Raises
    ------
    RotflexError
        If there is no description.
    """
    alt = alt or getattr(figure, "alt_text", "")
    if not alt:
        raise RotflexError(
            "The figure has no description: give one, as in show(figure, alt='The speed against time.')."
        )
    data, metadata = bundle(figure, alt)
    if "matplotlib.pyplot" in sys.modules:
        sys.modules["matplotlib.pyplot"].close(figure)
    _publish(data, metadata, alt, caption)


def show_drawing(name: str, caption: str | None = None) -> None:
    """Show a drawing of the laboratory in the notebook, with its description for those who cannot see it.

    Parameters
    ----------
    name : of a file in ``rotflex/figures/drawings``, without ``.svg``; the description is the file's ``<desc>``
    caption : Markdown, shown below the drawing

    If nobody looks (``LABCOURSE_PICTURES=off`` in the environment), the image is left out.

    Raises
    ------
    RotflexError
        If there is no drawing of this name.
    """
    files = {path.stem: path for path in _DRAWINGS.glob("*.svg")}
    if name not in files:
        raise RotflexError(f"There is no drawing {name!r}. These exist: {', '.join(sorted(files))}.")
    svg = files[name].read_bytes()
    alt = ElementTree.fromstring(svg).findtext("{*}desc", "")
    data = {"text/plain": f"<drawing {name}>"}
    if os.environ.get(PICTURES_SWITCH) != "off":
        # An image in HTML: JupyterLab shows image/svg+xml in trusted notebooks only, and without its description.
        source = base64.b64encode(svg).decode("ascii")
        data["text/html"] = f'<img alt="{html.escape(alt)}" src="data:image/svg+xml;base64,{source}">'
    _publish(data, {}, alt, caption)


def _publish(data: dict[str, str], metadata: dict[str, Any], alt: str, caption: str | None) -> None:
    """Display a figure's data, then its caption and its folded description; nothing outside a notebook."""
    from IPython.core.interactiveshell import InteractiveShell
    from IPython.display import display

    if not InteractiveShell.initialized():
        return
    display(data, metadata=metadata, raw=True)
    folded = f"<details><summary>The figure in words</summary>{html.escape(alt)}</details>"
    words = [caption, folded] if caption else [folded]
    display({"text/markdown": "\n\n".join(words), "text/plain": caption or alt}, raw=True)


# --- against time -----------------------------------------------------------------------------------------------------


def free_decay(recording: Recording) -> Picture:
    """Deflection after a release with the servo held, in degrees against time.

    Parameters
    ----------
    recording : with channel ``alpha``
    """
    with style():
        figure, (axes,) = _stack(_ALPHA)
        _draw(axes, recording, "alpha", "measured", ROLES["measured"])
    figure.alt_text = (
        f"The deflection alpha against time, 0 to {recording.time[-1]:.2g} s: it swings back and forth and dies away."
    )
    return figure


def validation(recording: Recording) -> Picture:
    """Measured and modelled response to the same voltage: theta above, alpha below (Figures 2.7 and 2.8).

    Parameters
    ----------
    recording : with channels ``theta``, ``theta_model``, ``alpha`` and ``alpha_model``
    """
    with style():
        figure, panels = _stack(_THETA, _ALPHA)
        for axes, angle in zip(panels, ("theta", "alpha"), strict=True):
            _draw(axes, recording, angle, "measured", ROLES["measured"])
            _draw(axes, recording, f"{angle}_model", "model", ROLES["model"])
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
        figure, panels = _stack(_THETA, _ALPHA, _VOLTS)
        for axes, channel, role in zip(panels, _CHANNELS, ("measured", "measured", "voltage"), strict=True):
            _draw(axes, recording, channel, _CHANNELS[channel], ROLES[role])
        _command(panels, recording, specifications)
    reference, alpha, vm = recording.degrees("theta_ref"), recording.degrees("alpha"), recording["vm"]
    figure.alt_text = (
        f"Three plots against time, 0 to {recording.time[-1]:.2g} s. The servo angle theta follows a reference "
        f"between {reference.min():.0f} and {reference.max():.0f} deg; the deflection alpha goes up to about "
        f"{np.abs(alpha).max():.0f} deg and the voltage to about {np.abs(vm).max():.0f} V."
    ) + (f" {_DRAWN_IN}" if specifications else "")
    return figure


def compare_tracking(full: Recording, partial: Recording) -> Picture:
    """Full and partial state feedback following the same reference, laid over each other (Section 3.4.4).

    Parameters
    ----------
    full, partial : with channels ``theta_ref``, ``theta``, ``alpha`` and ``vm``
    """
    dashed: dict[str, Any] = {"color": BLUE, "linestyle": (0, (4, 1.5)), "linewidth": 1.5}
    with style():
        figure, panels = _stack(_THETA, _ALPHA, _VOLTS)
        for label, recording, look in (("partial", partial, dashed), ("full", full, ROLES["measured"])):
            for axes, channel in zip(panels, _CHANNELS, strict=True):
                _draw(axes, recording, channel, label, look | ({"linewidth": 1.0} if channel == "vm" else {}))
        _command(panels, full)
    rms = [float(np.sqrt(np.mean(recording.degrees("alpha") ** 2))) for recording in (full, partial)]
    figure.alt_text = (
        f"Three plots against time, 0 to {full.time[-1]:.2g} s: the servo angle theta with its reference, the "
        "deflection alpha, and the voltage, each with full (solid) and with partial state feedback (dashed). "
        f"The deflection's root mean square is {rms[0]:.1f} deg with full and {rms[1]:.1f} deg with partial "
        f"feedback. {_DRAWN_IN}"
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


def _stack(*labels: str) -> tuple[Picture, Any]:
    """Make plots above each other, with these y labels, which share the time axis."""
    figure = new_picture(WIDTH, 0.9 + 1.75 * len(labels) if len(labels) > 1 else 3.0)
    panels = figure.subplots(len(labels), 1, sharex=True, squeeze=False)[:, 0]
    for axes, label in zip(panels, labels, strict=True):
        axes.set_ylabel(label)
        axes.margins(y=0.08)
    panels[-1].set_xlabel("time (s)")
    return figure, panels


def _draw(axes: Axes, recording: Recording, channel: str, label: str, look: dict[str, Any]) -> None:
    """Draw a channel, angles in degrees, and end the time axis where the recording ends."""
    values = recording["vm"] if channel == "vm" else recording.degrees(channel)
    axes.plot(recording.time, values, label=label, **look)
    axes.set_xlim(recording.time[0], recording.time[-1])


def _legend(axes: Axes) -> None:
    """A legend above the plot, where it hides nothing."""
    count = len(axes.get_legend_handles_labels()[0])
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 0.97), ncols=count, borderaxespad=0.0)


def _command(panels: Sequence[Axes], recording: Recording, specifications: bool = True) -> None:
    """Draw the command and, if asked, the specifications: the settling bands about its two levels, and the limits."""
    _draw(panels[0], recording, "theta_ref", "reference", ROLES["reference"])
    if specifications:
        reference = recording.degrees("theta_ref")
        label = f"settling band, ±{100 * SETTLING_BAND:g} %"
        for level in sorted({float(reference.min()), float(reference.max())} - {0.0}):
            half = SETTLING_BAND * abs(level)
            panels[0].axhspan(level - half, level + half, label=label, facecolor=PURPLE, alpha=0.45, zorder=1)
            label = "_the same"
        for axes, limit, unit in ((panels[1], LIMITS["max_alpha"] / DEG, "deg"), (panels[2], LIMITS["max_vm"], "V")):
            axes.axhline(limit, label=f"limit ±{limit:g} {unit}", **ROLES["highlight"])
            axes.axhline(-limit, **ROLES["highlight"])
    for axes in panels:
        _legend(axes)


# --- against frequency ------------------------------------------------------------------------------------------------


def compound_sine_spectrum() -> Picture:
    """A sum of three sines, and the amplitude spectrum in which each stands alone (Figure 2.3)."""
    duration, sample_time = 10.0, 0.01
    t = np.arange(0.0, duration, sample_time)
    g = 3 * np.sin(2 * np.pi * t) + 2 * np.sin(4 * np.pi * t) + 0.5 * np.sin(10 * np.pi * t)
    f = np.fft.rfftfreq(t.size, sample_time)
    # A sine of amplitude a puts N a/2 into its bin and N a/2 into the bin of the negative frequency. (There is nothing
    # at 0 Hz or at half the sampling rate, which have no such twin.)
    amplitude = 2 * np.abs(np.fft.rfft(g)) / t.size
    with style():
        figure = new_picture(WIDTH, 5.0)
        signal, spectrum = figure.subplots(2, 1)
        signal.plot(t, g, **ROLES["measured"])
        signal.set(xlabel="time (s)", ylabel="$g(t)$ (–)", xlim=(0, 3))
        inside = f <= 8
        spectrum.plot(f[inside], amplitude[inside], marker=".", **ROLES["model"] | {"linestyle": "-", "linewidth": 1.2})
        for frequency in (1, 2, 5):
            height = float(amplitude[f.searchsorted(frequency)])
            label = f"{frequency} Hz: {height:.1f}"
            spectrum.annotate(label, (frequency, height), xytext=(8, -3), textcoords="offset points")
        spectrum.set(xlabel="frequency (Hz)", ylabel="amplitude of $g$ (–)", xlim=(0, 8), ylim=(0, 3.4))
    figure.alt_text = (
        "Above, the sum of three sine waves against time, which repeats every second. Below, its amplitude "
        "spectrum: three narrow peaks, of 3 at 1 Hz, 2 at 2 Hz and 0.5 at 5 Hz, and nothing in between."
    )
    return figure


def naive_against_true(
    voltage_driven: Sequence[ArrayLike],
    position_driven: Sequence[ArrayLike],
    ratio: Sequence[ArrayLike],
    resonance: float,
) -> Picture:
    """Why the peak of a spectrum is not yet the natural frequency: two sweeps and |alpha/theta|.

    Parameters
    ----------
    voltage_driven, position_driven : (f, amplitude): Hz and deg, the spectrum of alpha when the sweep is the motor's
        voltage, and when the servo follows it
    ratio : (f, |alpha/theta|): Hz and rad/rad
    resonance : the link's natural frequency with the servo held, sqrt(K_s/J_l), Hz
    """
    rows = (
        (voltage_driven, "voltage", "amplitude of $\\alpha$ (deg)", "the sweep is the motor's voltage"),
        (position_driven, "measured", "amplitude of $\\alpha$ (deg)", "the servo follows the sweep"),
        (ratio, "measured", r"$|\alpha/\theta|$ (rad/rad)", "deflection per servo angle"),
    )
    peaks = []
    with style():
        figure = new_picture(WIDTH, 6.8)
        panels = figure.subplots(3, 1, sharex=True)
        for axes, ((f_hz, values), role, quantity, title) in zip(panels, rows, strict=True):
            f, curve = np.asarray(f_hz, dtype=float), np.asarray(values, dtype=float)
            inside = (f >= _SWEPT[0]) & (f <= _SWEPT[1])
            f, curve = f[inside], curve[inside]
            axes.plot(f, curve, **ROLES[role])
            peaks.append(float(f[curve.argmax()]))
            axes.plot(peaks[-1], curve.max(), marker="v", markersize=8, color=BLACK, linestyle="none", zorder=5)
            axes.axvline(resonance, **ROLES["highlight"])
            axes.set(ylabel=quantity, xlim=_SWEPT, ylim=(0, 1.2 * curve.max()))
            axes.set_title(f"{title}: peak at {peaks[-1]:.2f} Hz", loc="left", fontsize=11)
        label = rf"$\sqrt{{K_s/J_l}}$ = {resonance:.2f} Hz"
        panels[0].legend(
            [panels[0].lines[-1]], [label], loc="lower right", bbox_to_anchor=(1.0, 0.98), borderaxespad=0.0
        )
        panels[-1].set_xlabel("frequency (Hz)")
    figure.alt_text = (
        f"Three plots against frequency, each with the link's natural frequency of {resonance:.1f} Hz marked. "
        f"When the sweep is the motor's voltage, the spectrum of alpha peaks at {peaks[0]:.1f} Hz; when the "
        f"servo follows the sweep, at {peaks[1]:.1f} Hz; the ratio of alpha to theta peaks at {peaks[2]:.1f} Hz."
    )
    return figure


# --- in the s-plane ---------------------------------------------------------------------------------------------------


def pole_map(poles: ArrayLike | Mapping[str, ArrayLike]) -> Picture:
    """Poles in the s-plane, over rays of constant damping ratio and arcs of constant natural frequency (Figure 3.1).

    Parameters
    ----------
    poles : (n,) complex poles, rad/s; or a mapping of a label to each group of poles
    """
    given = poles if isinstance(poles, Mapping) else {"poles": poles}
    groups = {label: np.atleast_1d(np.asarray(group, dtype=complex)) for label, group in given.items()}
    every = np.concatenate(list(groups.values()))
    with style():
        figure = new_picture(WIDTH, 4.8)
        axes = figure.subplots()
        axes.grid(False)
        reach = 1.2 * max(float(np.abs(every.real).max()), 1.25 * float(np.abs(every.imag).max()), 1.0)
        height = max(0.62 * reach, 1.2 * float(np.abs(every.imag).max()))
        right = max(0.18 * reach, 1.3 * float(every.real.max()))
        _grid(axes, reach, height)
        for (label, group), (marker, color) in zip(groups.items(), cycle(_MARKS)):
            look: dict[str, Any] = {"color": color, "linestyle": "none", "markersize": 10, "markeredgewidth": 2.4}
            look |= {"marker": marker, "fillstyle": "none", "zorder": 5, "clip_on": False}
            axes.plot(group.real, group.imag, label=label, **look)
        axes.set(xlabel="real part (rad/s)", ylabel="imaginary part (rad/s)")
        axes.set(xlim=(-reach, right), ylim=(-height, height))
        axes.set_aspect("equal")
        axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=4, handlelength=2.2)
    listed = "; ".join(f"{label}: " + ", ".join(map(_spoken, group)) for label, group in groups.items())
    figure.alt_text = f"Poles in the s-plane. {listed}."
    return figure


def motions_of_poles() -> Picture:
    """Draw the motions that belong to stable, marginally stable and unstable poles, in eight panels against time."""
    t = np.linspace(0, 6, 601)
    motions = (
        ("−1", np.exp(-t), "stable"),
        ("−0.4 ± 3j", np.exp(-0.4 * t) * np.cos(3 * t), "stable"),
        ("0", np.ones_like(t), "marginally stable"),
        ("± 3j", np.cos(3 * t), "marginally stable"),
        ("0.4", np.exp(0.4 * t), "unstable"),
        ("0.2 ± 3j", np.exp(0.2 * t) * np.cos(3 * t), "unstable"),
        ("0, twice", 0.5 * t, "unstable"),
        ("± 3j, twice", 0.5 * t * np.sin(3 * t), "unstable"),
    )
    colors = {"stable": GREEN, "marginally stable": BLUE, "unstable": VERMILLION}
    with style():
        figure = new_picture(WIDTH, 3.8)
        panels = figure.subplots(2, 4, sharex=True, sharey=True)
        for axes, (poles, motion, verdict) in zip(panels.flat, motions, strict=True):
            axes.plot(t, motion, color=colors[verdict])
            axes.axhline(0, color=BLACK, linewidth=0.6)
            axes.set_title(f"{poles}\n{verdict}", fontsize=9.5)
            axes.set(xlim=(0, 6), ylim=(-3, 3), yticks=(-2, 0, 2))
        figure.supxlabel("time (s)", fontsize=11)
        figure.supylabel("motion (any unit)", fontsize=11)
    figure.alt_text = (
        "Eight small plots of motion against time. Poles -1 and -0.4 plus or minus 3j: it dies away. Poles 0 and "
        "plus or minus 3j: it stays as large as it is. Poles 0.4 and 0.2 plus or minus 3j: it grows. The poles 0 "
        "and plus or minus 3j, each twice: it grows, too."
    )
    return figure


def _spoken(pole: complex) -> str:
    """A pole to one decimal, without a negative zero."""
    real, imag = round(float(pole.real), 1) + 0.0, round(float(pole.imag), 1) + 0.0
    return f"{real:g}" if imag == 0 else f"{real:g} {'+' if imag > 0 else '-'} {abs(imag):g}j"


def _grid(axes: Axes, reach: float, height: float) -> None:
    """Draw the imaginary axis, faint arcs, and faint rays with their damping ratios."""
    faint: dict[str, Any] = {"color": "#BBBBBB", "linewidth": 0.8, "linestyle": "-", "zorder": 1}
    axes.axvline(0.0, color=BLACK, linewidth=1.0, zorder=1.5)
    axes.axhline(0.0, **faint)
    small: dict[str, Any] = {"fontsize": 9, "color": "#555555", "ha": "center", "va": "center"}
    for zeta in _GRID_ZETA:
        slope, far = np.sqrt(1 - zeta**2) / zeta, 3 * reach * zeta
        axes.plot([-far, 0.0, -far], [far * slope, 0.0, -far * slope], **faint)
        side = min(reach, height / slope)  # the ray leaves the picture through the left side, or through the top
        place = (-0.93 * side, 0.93 * side * slope)
        axes.text(*place, rf"$\zeta$ {zeta:g}", bbox={"fc": "white", "ec": "none", "pad": 1}, **small)
    turn = np.linspace(np.pi / 2, 3 * np.pi / 2, 181)
    for omega_n in MaxNLocator(5).tick_values(0.0, reach):
        if 0 < omega_n < 1.4 * reach:
            axes.plot(omega_n * np.cos(turn), omega_n * np.sin(turn), **faint)
