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
from rotflex.hil.controllers import DERIVATIVE_CUTOFF, StateFeedback
from rotflex.hil.loop import run
from rotflex.hil.replay import RecordedRuns
from rotflex.recording import Channel, Recording
from rotflex.signals import smooth_square_wave, time_axis
from rotflex.simulation import Vector
from rotflex.specifications import AMPLITUDE, FREQUENCY, RATE, SAMPLE_TIME, SETTLING_BAND
from rotflex.widgets import another_arm
from rotflex.widgets.arms import Arm, ArmsExplorer

if TYPE_CHECKING:
    from rotflex.course.lab import Lab

_ROLES = {"first": "measured", "second": "model"}  # choice → how its design is drawn
_PUSH = "push the arm"
_TORQUE, _PULSE = 0.1, 0.06  # N·m on the link; for how long, s
_TURN, _SWING, _REST = 0.5, 0.5, 1.0  # s: the command rests before a turn; after it, swing counts, and all is at rest
_STEADY, _WHOLE = 0.2, 0.75  # as in rotflex.response: last part of a turn; of the longest turn, to be measured
_NAMES = ("settling time", "largest deflection", "swing after 0.5 s", "largest voltage", "voltage noise at rest")
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
            if isinstance(bench.recorded, RecordedRuns):
                bench.recorded.choose({"experiment": "tracking"}, trial.controller, trial.reference, trial.sample_time)
            bench.disturb(_pulse(self._pushed[0], trial) if pushed else None)
            experiments.rest(bench)
            try:
                recording = run(bench, trial.controller, trial.reference, trial.sample_time, progress=False)
                part = recording.between(*self._pushed) if pushed else recording
            except BenchError:
                if bench.kept is None:
                    raise
                command = Channel(trial.reference[: len(bench.kept)], "rad")
                part = recording = replace(bench.kept, channels={"theta_ref": command, **bench.kept.channels})
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

    def controls(self) -> list[list[Any]]:
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
    inside = np.minimum(start + _PULSE, trial.time + trial.sample_time) - np.maximum(start, trial.time)
    return np.asarray(_TORQUE * np.maximum(0.0, inside) / trial.sample_time)


def _moves(reference: Vector) -> NDArray[np.intp]:
    """The samples at which a command moves; it comes from 0."""
    return np.flatnonzero(~np.isclose(np.diff(reference, prepend=0.0), 0.0))


def _longest_rest(trials: Collection[Trial]) -> tuple[float, float]:
    """The middle and the end (s) of the longest time in which all commands rest: the push, and until when it counts."""
    end = min(float(one.time[-1]) for one in trials)
    moves = np.concatenate([[0.0, end], *(one.time[_moves(one.reference)] for one in trials)])
    edges = np.unique(moves[moves <= end])
    longest = int(np.argmax(np.round(np.diff(edges), 3)))
    return float(edges[longest : longest + 2].mean()), float(edges[longest + 1])


def _figures(recording: Recording) -> dict[str, float]:
    """Measure a run: the worst of its turns, by the names in ``_NAMES``, in s, deg and V; NaN for what there is not.

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
    return dict(zip(_NAMES, (settling, alpha, swing, voltage, noise), strict=True))


def _turn(part: Recording) -> tuple[float, float, float]:
    """Settling time (s; infinite without), swing (deg) and the voltage's noise at rest (V) of one turn."""
    outside = part.time[np.abs(part["theta"] - part["theta_ref"][-1]) > SETTLING_BAND * AMPLITUDE]
    settled = float(outside[-1]) + part.sample_time if outside.size else 0.0
    settled = settled if settled <= (1 - _STEADY) * len(part) * part.sample_time else np.inf
    swing, rest = np.abs(part.degrees("alpha"))[part.time > _SWING], part["vm"][part.time > _REST]
    return settled, max(swing.tolist(), default=np.nan), float(rest.std()) if rest.size else np.nan


def compare_designs(lab: Lab, designs: Mapping[str, Trial] | None = None) -> DesignsExplorer:
    """Two designs on the student's bench at once, as a notebook makes it.

    Parameters
    ----------
    lab : the student's session
    designs : name → design; without them, the student's gain of 3.8 at several sample times and with partial state
        feedback, or a ready-made gain on another arm: until there is one, and in place of a real bench
    """
    real = another_arm.own_bench(lab).recorded is not None
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

    full = {f"full state, {milliseconds} ms": trial(milliseconds / 1000) for milliseconds in (2, 20, 30)}
    return full | {"partial state, 2 ms": trial(SAMPLE_TIME, "partial")}
