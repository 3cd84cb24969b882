"""Poles: their map in the s-plane, and the motions that belong to them."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import cycle
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotflex.figures.pictures import BLACK, BLUE, GREEN, ROLES, VERMILLION, WIDTH, Picture, new_picture, style

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Groups differ by shape as well as by colour.
_MARKS = (("x", BLUE), ("s", VERMILLION), ("D", GREEN), ("+", BLACK))
_GRID_ZETA = (0.2, 0.4, 0.6, 0.8)


def pole_map(
    poles: ArrayLike | Mapping[str, ArrayLike], zeta: float | None = None, omega_n: float | None = None
) -> Picture:
    """Poles in the s-plane, over rays of constant damping ratio and arcs of constant natural frequency (Figure 3.1).

    Parameters
    ----------
    poles : (n,) complex poles, rad/s; or a mapping of a label to each group of poles
    zeta, omega_n : damping ratio and natural frequency (rad/s) to emphasise
    """
    given = poles if isinstance(poles, Mapping) else {"poles": poles}
    groups = {label: np.atleast_1d(np.asarray(group, dtype=complex)) for label, group in given.items()}
    every = np.concatenate(list(groups.values()))
    with style():
        figure = new_picture(WIDTH, 4.8)
        axes = figure.subplots()
        axes.grid(False)
        reach = 1.2 * max(float(np.abs(every.real).max()), 1.25 * float(np.abs(every.imag).max()), omega_n or 1.0)
        height = max(0.62 * reach, 1.2 * float(np.abs(every.imag).max()))
        right = max(0.18 * reach, 1.3 * float(every.real.max()))
        _grid(axes, reach, height, leave_out=zeta)
        if zeta is not None:
            _rays(axes, zeta, 3 * reach, ROLES["highlight"] | {"label": rf"$\zeta$ = {zeta:g}"})
        if omega_n is not None:
            _arc(axes, omega_n, ROLES["reference"] | {"label": rf"$\omega_n$ = {omega_n:g} rad/s"})
        for (label, group), (marker, color) in zip(groups.items(), cycle(_MARKS)):
            look: dict[str, Any] = {"color": color, "linestyle": "none", "markersize": 10, "markeredgewidth": 2.4}
            axes.plot(
                group.real, group.imag, marker=marker, fillstyle="none", label=label, zorder=5, clip_on=False, **look
            )
        axes.set(
            xlabel="real part (rad/s)",
            ylabel="imaginary part (rad/s)",
            xlim=(-reach, right),
            ylim=(-height, height),
        )
        axes.set_aspect("equal")
        axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=4, handlelength=2.2)
    listed = "; ".join(f"{label}: " + ", ".join(map(_spoken, group)) for label, group in groups.items())
    emphasis = [] if zeta is None else [f"the damping ratio {zeta:g}"]
    emphasis += [] if omega_n is None else [f"the natural frequency {omega_n:g} rad/s"]
    figure.alt_text = f"Poles in the s-plane. {listed}." + (
        f" Marked are {' and '.join(emphasis)}." if emphasis else ""
    )
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


def _grid(axes: Axes, reach: float, height: float, leave_out: float | None) -> None:
    """The imaginary axis, faint arcs, and faint rays with their damping ratios, but for one beside ``leave_out``."""
    from matplotlib.ticker import MaxNLocator

    faint: dict[str, Any] = {"color": "#BBBBBB", "linewidth": 0.8, "linestyle": "-", "zorder": 1}
    axes.axvline(0.0, color=BLACK, linewidth=1.0, zorder=1.5)
    axes.axhline(0.0, **faint)
    small: dict[str, Any] = {"fontsize": 9, "color": "#555555"}
    for zeta in _GRID_ZETA:
        if leave_out is not None and abs(zeta - leave_out) < 0.07:
            continue
        _rays(axes, zeta, 3 * reach, faint)
        slope = np.sqrt(1 - zeta**2) / zeta
        # Where the ray leaves the picture: through the top, or through the left side.
        x, y = (
            (-0.93 * height / slope, 0.93 * height) if height / slope < reach else (-0.93 * reach, 0.93 * reach * slope)
        )
        axes.text(
            x,
            y,
            rf"$\zeta$ {zeta:g}",
            ha="center",
            va="center",
            **small | {"bbox": {"fc": "white", "ec": "none", "pad": 1}},
        )
    for omega in MaxNLocator(5).tick_values(0.0, reach):
        if 0 < omega < 1.4 * reach:
            _arc(axes, omega, faint)


def _rays(axes: Axes, zeta: float, length: float, look: dict[str, Any]) -> None:
    """The two rays from the origin on which the damping ratio is ``zeta``."""
    x, y = -zeta * length, np.sqrt(1 - zeta**2) * length
    axes.plot([x, 0.0, x], [y, 0.0, -y], **look)


def _arc(axes: Axes, omega_n: float, look: dict[str, Any]) -> None:
    """The half circle on which the natural frequency is ``omega_n``."""
    turn: NDArray[np.float64] = np.linspace(np.pi / 2, 3 * np.pi / 2, 181)
    axes.plot(omega_n * np.cos(turn), omega_n * np.sin(turn), **look)
