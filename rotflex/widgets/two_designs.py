"""Two designs on the same bench at once: two arms that move, their responses, and a table beside them."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from labcourse.scene.scene import Choice, Column, Control, Panel, Readout, Row, Scene, around
from rotflex import experiments, response
from rotflex.config import one_of
from rotflex.controller import Controller
from rotflex.errors import BenchError, RotflexError
from rotflex.hil import Bench
from rotflex.hil.controllers import StateFeedback
from rotflex.recording import Recording
from rotflex.signals import smooth_square_wave, time_axis
from rotflex.simulation import DERIVATIVE_CUTOFF
from rotflex.specifications import AMPLITUDE, FREQUENCY, RATE, SAMPLE_TIME, SETTLING_BAND
from rotflex.units import DEG, Vector
from rotflex.widgets import another_arm
from rotflex.widgets.arms import Arm, ArmsExplorer

if TYPE_CHECKING:
    from rotflex.course.lab import Lab

_ROLES = {"first": "measured", "second": "model"}  # choice → how its design is drawn
_PUSH = "push the arm"
_TORQUE, _PULSE = 0.1, 0.06  # N·m on the link; for how long, s
_TURN, _SWING, _NOISE = 0.5, 0.5, 0.2  # s: rest of the command before a turn; from then on they count, see response
_BAND = SETTLING_BAND * AMPLITUDE  # rad, half width of the settling band
_NAMES = ("settling time", "largest deflection", "swing after 0.5 s", "largest voltage", "voltage noise")
_UNITS = dict(zip(_NAMES, ("s", "deg", "deg", "V", "V"), strict=True))


@dataclass(frozen=True)
class Trial:
    """A design as it is tried on a bench.

    Attributes
    ----------
    controller : a function (reference, theta, alpha) → V, see :mod:`rotflex.controller`
    reference : (n,) command of the servo angle, rad
    sample_time : s
    """

    controller: Controller
    reference: Vector
    sample_time: float = SAMPLE_TIME


class DesignsExplorer(ArmsExplorer):
    """Two designs on the same bench: each runs on a fresh bench of the same seed and run number.

    Parameters
    ----------
    bench : returns the bench, not yet open, as ``lab.bench`` does
    designs : name → design; the first two are chosen to begin with
    readouts : shown with the table

    Raises
    ------
    RotflexError
        If one of the two cannot be run at all.
    """

    def __init__(self, bench: Callable[[], Bench], designs: Mapping[str, Trial], *readouts: Readout) -> None:
        self._bench, self._designs, self._more = bench, designs, readouts
        self._pushed = _longest_rest(designs.values())
        self._arm = cache(self._tried)
        names = {name: name for name in designs}
        self._options = {"first": names, "second": names, _PUSH: {"none": "none", "at rest": "at rest"}}
        self._show({"first": next(iter(names)), "second": [*names][:2][-1], _PUSH: "none"})
        super().__init__(self.arms)

    def set(self, name: str, value: float | str) -> None:
        """Another design, or another push."""
        self._show({**self.choice, name: one_of(name, str(value), self._options[name])})

    def _show(self, choice: dict[str, str]) -> None:
        self.arms = [replace(self._arm(choice[which], choice[_PUSH]), role=role) for which, role in _ROLES.items()]
        self.choice = choice

    def _tried(self, name: str, push: str) -> Arm:
        """Run a design; one that is lost gives what was recorded until then, with the reason in its metadata."""
        trial, pushed = self._designs[name], push != "none"
        with self._bench() as bench:
            bench.disturb(_pulse(self._pushed[0], trial) if pushed else None)
            try:
                recording = experiments.follow(bench, trial.controller, trial.reference, trial.sample_time, False)
                part = recording.between(*self._pushed) if pushed else recording
            except BenchError:
                kept = bench.recorder.unfinished
                if kept is None:
                    raise
                part = recording = kept.with_channels(theta_ref=trial.reference[: len(kept)])
        return Arm(name, "measured", recording, _figures(part))

    def view(self) -> Scene:
        """One arm above the other, the responses over one another, and the table."""
        scene, tables = super().view(), self._tables()
        *arms, plots = scene.columns
        words = "; ".join(f"{row.label}: {' and '.join(row.values)}" for row in tables[0].rows)
        scene.alt = f"Two designs on the same bench, {' and '.join(arm.title for arm in self.arms)}. {words}."
        scene.columns = [Column([panel for column in arms for panel in column.panels], 0.42), plots]
        scene.readouts = [*tables, *self._more]
        scene.height = 430
        return scene

    def panels(self, duration: float) -> list[Panel]:
        """Servo angle with the commands, deflection, and voltage as it is held."""
        theta, alpha = super().panels(duration)
        theta.y = around(*(arm.recording.degrees(name) for arm in self.arms for name in ("theta", "theta_ref")))
        volts = Panel("Vₘ (V)", (0.0, duration), around(*(arm.recording["vm"] for arm in self.arms)), "time (s)", 1.25)
        alpha.xlabel = ""
        for arm, label in zip(self.arms, ("command", ""), strict=True):
            time, volt = arm.recording.time, arm.recording["vm"]
            theta.line(time, arm.recording.degrees("theta_ref"), "reference", label)
            volts.line(np.repeat(time, 2)[1:], np.repeat(volt, 2)[:-1], arm.role)
        volts.level(0.0, "text", axis="x", clock=True)
        if self.choice[_PUSH] != "none":
            alpha.band(self._pushed[0], self._pushed[0] + _PULSE, "highlight", "push", axis="x")
        return [theta, alpha, volts]

    def controls(self) -> list[list[Control]]:
        """The two designs, and the push."""
        return [[Choice(name, name, options, self.choice[name]) for name, options in self._options.items()]]

    def _tables(self) -> list[Readout]:
        """The table, and why a run stopped early."""
        ended = {arm.title: str(arm.recording.metadata.get("ended", "")).partition(": ")[2] for arm in self.arms}
        runs = Row("run", ["lost" if ended[arm.title] else "complete" for arm in self.arms])
        rows = [Row(name, [arm.figure(name, unit) for arm in self.arms]) for name, unit in _UNITS.items()]
        title = "The worst of all turns" if self.choice[_PUSH] == "none" else "After the push"
        table = Readout(title, [runs, *rows], ("", *(arm.title for arm in self.arms)))
        return [table, *(Readout(f"Lost: {name}", [Row("", (why,))]) for name, why in ended.items() if why)]


def _pulse(start: float, trial: Trial) -> Vector:
    """Torque on the link (n,), N·m: each sample has its share of the pulse, so that the impulse is always the same."""
    time = np.arange(len(trial.reference)) * trial.sample_time
    inside = np.minimum(start + _PULSE, time + trial.sample_time) - np.maximum(start, time)
    return np.asarray(_TORQUE * np.maximum(0.0, inside) / trial.sample_time)


def _moves(reference: Vector) -> NDArray[np.intp]:
    """The samples at which a command moves; it comes from 0."""
    return np.flatnonzero(~np.isclose(np.diff(reference, prepend=0.0), 0.0))


def _longest_rest(trials: Collection[Trial]) -> tuple[float, float]:
    """The middle and the end (s) of the longest time in which all commands rest: the push, and until when it counts."""
    end = min((len(one.reference) - 1) * one.sample_time for one in trials)
    moves = np.concatenate([[0.0, end], *(_moves(one.reference) * one.sample_time for one in trials)])
    edges = np.unique(moves[moves <= end])
    longest = int(np.argmax(np.round(np.diff(edges), 3)))
    return float(edges[longest : longest + 2].mean()), float(edges[longest + 1])


def _figures(recording: Recording) -> dict[str, float]:
    """Measure a run as :mod:`rotflex.response` does, by the names in ``_NAMES``, in s, deg and V; NaN if not measured.

    A turn begins where the command moves after half a second of rest. It is taken as a step, in however many steps the
    command goes. The settling band is ±0.8 deg.
    """
    steps = recording["theta_ref"].copy()
    moves = _moves(steps)
    starts = moves[np.diff(recording.time[moves], prepend=-np.inf) > _TURN]
    for start, stop in pairwise([*starts.tolist(), len(steps)]):
        steps[start:stop] = steps[stop - 1]
    stepped = recording.with_channels(theta_ref=steps)
    try:
        settling = response.worst(response.measure(stepped, _BAND / max(np.abs(steps).max(), DEG))).settling_time
        swing, noise = response.swing(stepped) / DEG, response.voltage_noise(stepped)
    except RotflexError:
        settling, swing, noise = _without_step(recording)
    settling = np.inf if settling is None or "ended" in recording.metadata else settling
    alpha, voltage = (float(np.abs(values).max()) for values in (recording.degrees("alpha"), recording["vm"]))
    return dict(zip(_NAMES, (settling, alpha, swing, voltage, noise), strict=True))


def _without_step(part: Recording) -> tuple[float, float, float]:
    """Settling time (s), swing (deg) and noise (V) where the command has no step, as after a push."""
    outside = part.time[np.abs(part["theta"] - part["theta_ref"][-1]) > _BAND]
    settled = max((outside + part.sample_time).tolist(), default=0.0)
    swing, changes = np.abs(part.degrees("alpha"))[part.time > _SWING], np.diff(part["vm"][part.time > _NOISE])
    noise = float(np.sqrt(np.mean(changes**2))) if changes.size else np.nan
    return settled if settled <= part.time[-1] else np.inf, max(swing.tolist(), default=np.nan), noise


def compare_designs(lab: Lab, designs: Mapping[str, Trial] | None = None) -> DesignsExplorer:
    """Two designs on the student's bench at once, as a notebook makes it.

    Parameters
    ----------
    lab : the student's session
    designs : name → design; without them, the student's gain of 3.8 at several sample times and with partial state
        feedback, or a ready-made gain on another arm: until there is one, and in place of a real bench
    """
    real = another_arm.own_bench(lab).connection.recorded is not None
    why = "Nothing moves a real bench here." if real else "After question 3.8, you see your own here."

    def own() -> DesignsExplorer:
        return DesignsExplorer(lambda: another_arm.own_bench(lab), designs or _ready_made(lab.value("3.8", "K")))

    def another() -> DesignsExplorer:
        practice, more = another_arm.practice(), Readout("Another arm", [Row("", (why,))])
        return DesignsExplorer(practice.bench, _ready_made(practice.gain()), more)

    first = another if real and not designs else own
    return another_arm.unless_answered(lab, "" if designs else "3.8 K", first, another)


def _ready_made(K: ArrayLike) -> dict[str, Trial]:
    """State feedback with a gain (4,) or (1, 4); at slow sample times the derivatives are plain differences."""

    def trial(every: float, feedback: str = "full") -> Trial:
        controller = StateFeedback(K, feedback, every, min(DERIVATIVE_CUTOFF, 1 / every))
        time = time_axis(1.5 / FREQUENCY, every)  # three turns
        return Trial(controller, smooth_square_wave(time, FREQUENCY, AMPLITUDE, RATE), every)

    full = {f"full state, {milliseconds} ms": trial(milliseconds / 1000) for milliseconds in (2, 20, 10)}
    return full | {"partial state, 2 ms": trial(SAMPLE_TIME, "partial")}
