"""What there is to see of a bench at work: a scope, the state of the bench, a run as a static figure."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from labcourse.pictures import ROLES, WIDTH, Picture, new_picture, style
from labcourse.scene.scene import Panel, Play, Readout, Row
from rotflex.hil.bench import WATCHDOG_TIMEOUT, Bench
from rotflex.recording import Recording
from rotflex.units import DEG

SECONDS = 5.0  #: that the scope shows of a run
_ANGLES = {1: "theta", 2: "alpha"}  # their rows among the samples
_SAMPLES_TO_PLAY = 60  # 1/s, of a recording that the mechanism goes through


def scope(samples: Any, live: bool, model: Mapping[str, Any] | None = None) -> list[Panel]:
    """Servo angle, deflection and voltage against time.

    Parameters
    ----------
    samples : (4, n) time (s), theta, alpha (rad), voltage (V)
    live : whether it is still coming; else a line shows where a player is
    model : "theta" and "alpha" (rad) of a model, at the same times
    """
    time_ = samples[0]
    span = (float(time_[0]), max(float(time_[-1]), float(time_[0]) + SECONDS)) if time_.size else (0.0, SECONDS)
    panels = []
    for index, label, scale, least, role in (
        (1, "θ (deg)", DEG, 25.0, "measured"),
        (2, "α (deg)", DEG, 15.0, "measured"),
        (3, "Vₘ (V)", 1.0, 10.0, "voltage"),
    ):
        values = samples[index] / scale
        reach = max(least, 1.1 * float(np.abs(values).max())) if values.size else least
        panel = Panel(label, span, (-reach, reach), "time (s)" if index == 3 else "", 1.25 if index == 3 else 1.0)
        if values.size:
            panel.line(time_, values, role)
            if model and index in _ANGLES:
                panel.line(time_, np.clip(model[_ANGLES[index]] / scale, -reach, reach), "model", "your model")
            if not live:
                panel.level(float(time_[0]), "highlight", axis="x", clock=True)
        panels.append(panel)
    return panels


def reported(bench: Bench | None) -> Readout:
    """What a bench says of itself."""
    if bench is None:
        return Readout("The bench", [Row("not connected", ())])
    limits = bench.limits
    rows = [Row(str(name), (str(value),)) for name, value in bench.identity.items() if name != "uri"]
    rows += [  # a replay has none
        Row(name, (f"within ±{limit / DEG:.0f} deg",))
        for name, limit in (("servo angle", limits.theta), ("deflection", limits.alpha))
        if np.isfinite(limit)
    ]
    rows += [
        Row("motor", (f"within ±{min(limits.voltage, bench.servo.V_max):g} V",)),
        Row(
            "watchdog",
            (f"0 V after {WATCHDOG_TIMEOUT:g} s without the program",),
        ),
    ]
    return Readout("The bench reports", rows, folded=True)


def playable(recording: Recording) -> Play:
    """A recording as the mechanism goes through it."""
    duration = float(recording.time[-1] - recording.time[0])
    instants = np.linspace(recording.time[0], recording.time[-1], max(2, round(duration * _SAMPLES_TO_PLAY)))
    signals = {name: np.interp(instants, recording.time, recording[name]) for name in ("theta", "alpha")}
    return Play(signals, duration)


def alt_text_of(samples: Any, state: str, message: str) -> str:
    """The console in words, for somebody who cannot see it."""
    begun = f"The bench console: {state}. {message}"
    if not samples.size:
        return begun.strip()
    theta, alpha = samples[1, -1] / DEG, samples[2, -1] / DEG
    return f"{begun} The servo stands at {theta:.0f} deg, the arm is deflected by {alpha:.1f} deg.".strip()


def picture(samples: Any, words: str) -> Picture:
    """A run as a static figure.

    Parameters
    ----------
    samples : (4, n) time (s), theta, alpha (rad), voltage (V)
    words : what is to be seen, for somebody who cannot see it
    """
    with style():
        figure = new_picture(WIDTH, 4.8)
        panels = figure.subplots(3, 1, sharex=True)
        for axes, values, scale, role, label in zip(
            panels,
            samples[1:],
            (DEG, DEG, 1.0),
            ("measured", "measured", "voltage"),
            ("θ (deg)", "α (deg)", "$V_m$ (V)"),
            strict=True,
        ):
            axes.plot(samples[0], values / scale, **ROLES[role])
            axes.set(ylabel=label)
        panels[-1].set_xlabel("time (s)")
    figure.alt_text = words
    return figure
