"""Plots against frequency: spectra, and the frequency response from theta to alpha."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotflex.figures.pictures import BLACK, ROLES, WIDTH, Picture, new_picture, style

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Vector = NDArray[np.float64]


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


def spectrum_plot(
    f_hz: ArrayLike,
    amplitude_deg: ArrayLike,
    peak: float | None = None,
    f_max: float = 10.0,
    quantity: str = r"$\alpha$",
) -> Picture:
    """An amplitude spectrum.

    Parameters
    ----------
    f_hz : (n,) frequencies, Hz
    amplitude_deg : (n,) amplitudes, deg
    peak : frequency to mark, Hz
    f_max : draw up to this frequency, Hz
    quantity : what the amplitude is of, for the axis
    """
    with style():
        figure = new_picture(WIDTH, 3.2)
        axes = figure.subplots()
        f, amplitude = _curve(axes, f_hz, amplitude_deg, (0.0, f_max), ROLES["measured"])
        axes.set(
            xlabel="frequency (Hz)",
            ylabel=f"amplitude of {quantity} (deg)",
            ylim=(0, 1.15 * amplitude.max()),
        )
        if peak is not None:
            _mark(axes, peak, f"{peak:.2f} Hz")
    figure.alt_text = f"An amplitude spectrum against frequency, up to {f.max():.0f} Hz." + (
        "" if peak is None else f" Its peak at {peak:.1f} Hz is marked."
    )
    return figure


def frequency_response(
    f_hz: ArrayLike,
    ratio: ArrayLike,
    coherence: ArrayLike | None = None,
    peak: float | None = None,
    f_range: tuple[float, float] = (0.5, 6.0),
) -> Picture:
    """The gain from servo angle to deflection, |alpha/theta|, against frequency, and the coherence below it.

    Parameters
    ----------
    f_hz : (n,) frequencies, Hz
    ratio : (n,) gains |alpha/theta|
    coherence : (n,) coherence of theta and alpha, 0 to 1
    peak : frequency to mark, Hz
    f_range : the frequencies between which to draw, Hz
    """
    with style():
        rows = 1 if coherence is None else 2
        figure = new_picture(WIDTH, 3.0 if rows == 1 else 4.6)
        panels = figure.subplots(rows, 1, sharex=True, squeeze=False, height_ratios=(2.2, 1)[:rows])[:, 0]
        _f, gain = _curve(panels[0], f_hz, ratio, f_range, ROLES["measured"])
        panels[0].set(ylabel="$|\\alpha/\\theta|$ (rad/rad)", ylim=(0, 1.15 * gain.max()))
        if peak is not None:
            _mark(panels[0], peak, f"{peak:.2f} Hz")
        if coherence is not None:
            _curve(panels[1], f_hz, coherence, f_range, ROLES["measured"])
            panels[1].set(ylabel="coherence (–)", ylim=(0, 1.05))
        panels[-1].set_xlabel("frequency (Hz)")
    figure.alt_text = (
        f"The ratio of deflection to servo angle against frequency, {f_range[0]:g} to {f_range[1]:g} Hz."
        + ("" if peak is None else f" Its peak at {peak:.1f} Hz is marked.")
        + ("" if coherence is None else " Below it, the coherence of the two signals.")
    )
    return figure


def naive_against_true(
    voltage_driven: Sequence[ArrayLike],
    position_driven: Sequence[ArrayLike],
    ratio: Sequence[ArrayLike],
    resonance: float,
    f_range: tuple[float, float] = (0.5, 6.0),
) -> Picture:
    """Why the peak of a spectrum is not yet the natural frequency: two sweeps and |alpha/theta|.

    Parameters
    ----------
    voltage_driven, position_driven : (f, amplitude): Hz and deg, the spectrum of alpha when the sweep is the motor's
        voltage, and when the servo follows it
    ratio : (f, |alpha/theta|): Hz and rad/rad
    resonance : the link's natural frequency with the servo held, sqrt(K_s/J_l), Hz
    f_range : the frequencies between which to draw, Hz
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
            f, curve = _curve(axes, f_hz, values, f_range, ROLES[role])
            peaks.append(float(f[curve.argmax()]))
            axes.plot(peaks[-1], curve.max(), marker="v", markersize=8, color=BLACK, linestyle="none", zorder=5)
            axes.axvline(resonance, **ROLES["highlight"])
            axes.set(ylabel=quantity, ylim=(0, 1.2 * curve.max()))
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


def _curve(
    axes: Axes, f_hz: ArrayLike, values: ArrayLike, f_range: tuple[float, float], look: dict[str, Any]
) -> tuple[Vector, Vector]:
    """Draw the part of a curve within ``f_range``, and return it."""
    f, y = np.asarray(f_hz, dtype=float), np.asarray(values, dtype=float)
    inside = (f >= f_range[0]) & (f <= f_range[1])
    axes.plot(f[inside], y[inside], **look)
    axes.set_xlim(*f_range)
    return f[inside], y[inside]


def _mark(axes: Axes, frequency: float, label: str) -> None:
    """A vertical line at a frequency, with its name beside its top."""
    axes.axvline(frequency, **ROLES["highlight"])
    place: dict[str, Any] = {"xycoords": ("data", "axes fraction"), "textcoords": "offset points", "va": "top"}
    axes.annotate(label, (frequency, 1.0), xytext=(6, 0), **place)
