"""A design as a static figure, for reports and for pages without widgets."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from labcourse.pictures import ROLES, WIDTH, Picture, new_picture, style
from rotflex.specifications import LIMITS
from rotflex.units import DEG
from rotflex.widgets.placement import Design
from rotflex.widgets.pole_plots import BAND, GRID_OMEGA, GRID_ZETA
from rotflex.widgets.pole_words import alt_text_of
from rotflex.widgets.runaway import LEAD


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
        for omega_n in GRID_OMEGA:
            plane.plot(omega_n * np.cos(turn), omega_n * np.sin(turn), **grid)
        for zeta in GRID_ZETA:
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
        highest = 1.3 * max(float(found.wanted.real.max()), float(found.poles.real.max()))
        plane.set(xlim=(1.12 * lowest, max(6, highest)), ylim=(-42, 42))
        plane.set(xlabel="real part (rad/s)", ylabel="imaginary part (rad/s)")
        plane.grid(False)
        plane.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
        shown = (("theta", "θ (deg)"), ("alpha", "α (deg)"), ("vm", "$V_m$ (V)"))
        end = 1.0 if found.runaway is None else max(1.0, float(found.runaway.recording.time[-1]))
        for axes, (channel, label) in zip(rest, shown, strict=True):
            for one, drawn in [*((ghost, faint) for ghost in ghosts), (found, ROLES["measured"])]:
                if one.motion is not None:
                    values = one.motion[channel] if channel == "vm" else one.motion.degrees(channel)
                    axes.plot(one.motion.time, values, **drawn)
            axes.set(ylabel=label, xlim=(-LEAD, end))
        theta, alpha, volts = rest
        if found.motion is not None:
            theta.plot(found.motion.time, found.motion.degrees("theta_ref"), **ROLES["reference"])
        theta.axhspan(*BAND, color=ROLES["highlight"]["color"], alpha=0.4)
        for axes, limit in ((alpha, LIMITS["max_alpha"] / DEG), (volts, LIMITS["max_vm"])):
            axes.axhline(limit, **ROLES["highlight"])
            axes.axhline(-limit, **ROLES["highlight"])
        volts.set_xlabel("time after the step (s)")
    figure.alt_text = alt_text_of(found)
    return figure
