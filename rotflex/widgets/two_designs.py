"""Two designs on the same bench at once: two arms that move, their responses, and a table beside them."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from labcourse.scene.scene import Choice, Column, Panel, Readout, Row, Scene, around
from rotflex import experiments
from rotflex.config import one_of
from rotflex.controller import Controller
from rotflex.errors import BenchError
from rotflex.hil import Bench
from rotflex.hil.bench import Measurement, Push
from rotflex.hil.controllers import DERIVATIVE_CUTOFF, StateFeedback
from rotflex.hil.loop import run
from rotflex.hil.replay import RecordedRuns
from rotflex.recording import Channel, Recording
from rotflex.signals import smooth_square_wave, time_axis
from rotflex.simulation import Vector
from rotflex.specifications import AMPLITUDE, FREQUENCY, RATE, SAMPLE_TIME, SETTLING_BAND
from rotflex.units import DEG
from rotflex.widgets import another_arm
from rotflex.widgets.arms import Arm, ArmsExplorer

if TYPE_CHECKING:
    from rotflex.course.lab import Lab

_ROLES = {"first": "measured", "second": "model"}  # choice → how its design is drawn
_PUSHES = ("none", "at rest")
_TORQUE, _PULSE = 0.1, 0.06  # N·m on the link; for how long, s
_BAND = SETTLING_BAND * AMPLITUDE  # rad, half width of the settling band
_TURN, _SWING, _REST = 0.5, 0.5, 1.0  # s: the command rests before a turn; after it, swing counts, and all is at rest
_STEADY, _WHOLE = 0.2, 0.75  # as in rotflex.response: last part of a turn; of the longest turn, to be measured
_STILL = 1e-6  # rad; smaller steps of the command are rounding
_LASTS = 1.5 / FREQUENCY  # s, of the ready-made command: three turns
_EVERY = (2, 20, 30)  # ms, sample times of the ready-made designs
_FIGURES = {  # → unit
    "settling time": "s",
    "largest deflection": "deg",
    f"swing after {_SWING:g} s": "deg",
    "largest voltage": "V",
    "voltage noise at rest (RMS)": "V",
}


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

    @property
    def time(self) -> Vector:
        """Sample times (n,), s."""
        return np.arange(len(self.reference), dtype=float) * self.sample_time


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
        names = tuple(designs)
        self._options = {"first": names, "second": names, "push": _PUSHES}
        self._show({"first": names[0], "second": names[:2][-1], "push": "none"})
        super().__init__(self.arms)

    def set(self, name: str, value: float | str) -> None:
        """Another design, or another push."""
        self._show({**self.choice, name: one_of(name, str(value), self._options[name])})

    def _show(self, choice: dict[str, str]) -> None:
        self.arms = [replace(self._arm(choice[which], choice["push"]), role=role) for which, role in _ROLES.items()]
        self.choice = choice

    def _tried(self, name: str, push: str) -> Arm:
        recording = self._run(self._designs[name], push != "none")
        part = recording if push == "none" or "ended" in recording.metadata else recording.between(*self._pushed)
        return Arm(name, "measured", recording, _figures(part))

    def _run(self, trial: Trial, pushed: bool) -> Recording:
        """Run a design; one that is lost gives what was recorded until then, with the reason in its metadata."""
        with self._bench() as bench:
            if isinstance(bench.recorded, RecordedRuns):
                settings = {"experiment": "tracking"}
                bench.recorded.choose(settings, trial.controller, trial.reference, trial.sample_time)
            bench.disturb(_pulse(self._pushed[0], trial.sample_time) if pushed else None)
            experiments.rest(bench)
            try:
                return run(bench, trial.controller, trial.reference, trial.sample_time, progress=False)
            except BenchError:
                if bench.kept is None:
                    raise
                command = Channel(trial.reference[: len(bench.kept)], "rad")
                return replace(bench.kept, channels={"theta_ref": command, **bench.kept.channels})

    def view(self) -> Scene:
        """One arm above the other, the responses over one another, and the table."""
        scene, table = super().view(), self._table()
        *arms, plots = scene.columns
        words = "; ".join(f"{row.label}: {' and '.join(row.values)}" for row in table.rows)
        ended = {arm.title: why for arm in self.arms if (why := arm.recording.metadata.get("ended"))}
        lost = [Row(title, (why.partition(": ")[2],)) for title, why in ended.items()]
        return replace(
            scene,
            alt=f"Two designs on the same bench, {' and '.join(arm.title for arm in self.arms)}. {words}.",
            columns=[Column([panel for column in arms for panel in column.panels], 0.42), plots],
            readouts=[table, *([Readout("Why a run stopped", lost)] if lost else []), *self._more],
            height=430,
            play=scene.play and replace(scene.play, auto=True),
        )

    def panels(self, duration: float) -> list[Panel]:
        """Servo angle with the commands, deflection, and voltage as it is held."""
        theta, alpha = super().panels(duration)
        theta.y = around(*(arm.recording.degrees(name) for arm in self.arms for name in ("theta", "theta_ref")))
        for which, label in zip(_ROLES, ("command", ""), strict=True):
            trial = self._designs[self.choice[which]]
            theta.line(trial.time, trial.reference / DEG, "reference", label)
        volts = Panel("Vₘ (V)", (0.0, duration), around(*(arm.recording["vm"] for arm in self.arms)), "time (s)", 1.25)
        alpha.xlabel = ""
        for arm in self.arms:
            volts.line(np.repeat(arm.recording.time, 2)[1:], np.repeat(arm.recording["vm"], 2)[:-1], arm.role)
        volts.level(0.0, "text", axis="x", clock=True)
        if self.choice["push"] != "none":
            alpha.band(self._pushed[0], self._pushed[0] + _PULSE, "highlight", "push", axis="x")
        return [theta, alpha, volts]

    def controls(self) -> list[list[Any]]:
        """The two designs, and the push."""
        options = {name: {one: one for one in found} for name, found in self._options.items()}
        labels = ("first design", "second design", "push the arm")
        named = zip(self.choice.items(), labels, strict=True)
        return [[Choice(name, label, options[name], value) for (name, value), label in named]]

    def _table(self) -> Readout:
        recordings = [arm.recording for arm in self.arms]
        ends = [f"lost at {one.time[-1]:.2f} s" if "ended" in one.metadata else "complete" for one in recordings]
        rows = [Row(name, [arm.figure(name, unit) for arm in self.arms]) for name, unit in _FIGURES.items()]
        title = "The worst of all turns" if self.choice["push"] == "none" else "After the push"
        return Readout(title, [Row("run", ends), *rows], ("", *(arm.title for arm in self.arms)))


def _pulse(start: float, sample_time: float) -> Push:
    """A torque pulse on the link; each sample has its share, so that all sample times push by the same impulse."""

    def torque(measured: Measurement, _plant: object) -> float:
        inside = min(start + _PULSE, measured.time + sample_time) - max(start, measured.time)
        return _TORQUE * max(0.0, inside) / sample_time

    return torque


def _moves(reference: Vector) -> NDArray[np.intp]:
    """The samples at which a command moves; it comes from 0."""
    return np.flatnonzero(np.abs(np.diff(reference, prepend=0.0)) > _STILL)


def _longest_rest(trials: Collection[Trial]) -> tuple[float, float]:
    """The middle and the end (s) of the longest time in which all commands rest: the push, and until when it counts."""
    end = min(float(one.time[-1]) for one in trials)
    moves = np.concatenate([[0.0, end], *(one.time[_moves(one.reference)] for one in trials)])
    edges = np.unique(moves[moves <= end])
    longest = int(np.argmax(np.round(np.diff(edges), 3)))
    return float(edges[longest : longest + 2].mean()), float(edges[longest + 1])


def _figures(recording: Recording) -> dict[str, float]:
    """Measure a run: the worst of its turns, by the names in ``_FIGURES``, in s, deg and V; NaN for what there is not.

    A turn begins where the command moves after half a second of rest: a command in several steps is one turn. All else
    is as in :mod:`rotflex.response`, with a settling band of ±0.8 deg.
    """
    moves = recording.time[_moves(recording["theta_ref"])]
    starts = moves[np.diff(moves, prepend=-np.inf) > _TURN] if moves.size else np.zeros(1)
    edges = [*starts.tolist(), float(recording.time[-1]) + recording.sample_time]
    whole = _WHOLE * max(np.diff(edges))
    turns = [_turn(recording.between(*part)) for part in pairwise(edges) if part[1] - part[0] >= whole]
    settling, swing, noise = np.fmax.reduce(turns).tolist()
    settling = np.inf if "ended" in recording.metadata else settling
    alpha, voltage = (float(np.abs(values).max()) for values in (recording.degrees("alpha"), recording["vm"]))
    return dict(zip(_FIGURES, (settling, alpha, swing, voltage, noise), strict=True))


def _turn(part: Recording) -> tuple[float, float, float]:
    """Settling time (s; infinite without), swing (deg) and the voltage's noise at rest (V) of one turn."""
    outside = part.time[np.abs(part["theta"] - part["theta_ref"][-1]) > _BAND]
    settled = float(outside[-1]) + part.sample_time if outside.size else 0.0
    swing, rest = np.abs(part.degrees("alpha"))[part.time > _SWING], part["vm"][part.time > _REST]
    return (
        settled if settled <= (1 - _STEADY) * len(part) * part.sample_time else np.inf,
        float(swing.max()) if swing.size else np.nan,
        float(rest.std()) if rest.size else np.nan,
    )


def compare_designs(lab: Lab, designs: Mapping[str, Trial] | None = None) -> DesignsExplorer:
    """Two designs on the student's bench at once, as a notebook makes it.

    Parameters
    ----------
    lab : the student's session
    designs : name → design; without them, the student's gain of 3.8 at several sample times and with partial state
        feedback, or a ready-made gain on another arm: until there is one, and in place of a real bench
    """
    real = not lab.bench().is_simulated
    why = "Nothing moves a real bench here." if real else "After question 3.8, you see your own here."

    def own() -> DesignsExplorer:
        return DesignsExplorer(lambda: another_arm.own_bench(lab), designs or _ready_made(lab.value("3.8", "K")))

    def another() -> DesignsExplorer:
        practice, more = another_arm.practice(), Readout("Another arm", [Row("", (why,))])
        return DesignsExplorer(practice.bench, _ready_made(practice.gain()), more)

    if real and not designs:
        return another()
    return another_arm.unless_answered(lab, "" if designs else "3.8 K", own, another)


def _ready_made(K: ArrayLike) -> dict[str, Trial]:
    """State feedback with a gain (4,) or (1, 4); at slow sample times the derivatives are plain differences."""
    found = {}
    for milliseconds in _EVERY:
        every = milliseconds / 1000
        controller = StateFeedback(K, sample_time=every, cutoff=min(DERIVATIVE_CUTOFF, 1 / every))
        command = smooth_square_wave(time_axis(_LASTS, every), FREQUENCY, AMPLITUDE, RATE)
        found[f"full state, {milliseconds} ms"] = Trial(controller, command, every)
    first = found["full state, 2 ms"]
    return found | {"partial state, 2 ms": replace(first, controller=StateFeedback(K, "partial"))}
