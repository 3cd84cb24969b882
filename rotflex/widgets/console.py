"""The bench console: connect, run, watch, stop; and pull the arm of a bench that is computed.

Experiments run in a thread of their own, so that STOP is heard: on the kernel's loop, or, where JupyterLab has a thread
for it, beside a cell that keeps Python busy. Where it has none, and when the page is closed, no sign of life comes any
more, and the run stops by itself. In a browser without threads, see :mod:`rotflex.widgets.running`.
"""

from __future__ import annotations

import asyncio
import atexit
import math
import time
import weakref
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from labcourse.scene.explorer import Explorer
from labcourse.scene.scene import Button, Choice, Column, Control, Panel, Readout, Row, Scene
from rotflex import experiments
from rotflex.config import one_of
from rotflex.course.practice import Practice
from rotflex.errors import BenchError
from rotflex.hil.bench import Bench
from rotflex.hil.board import WATCHDOG_TIMEOUT
from rotflex.hil.virtual import DRIVING, STANDING, Hand
from rotflex.recording import Recording
from rotflex.units import DEG
from rotflex.widgets import another_arm
from rotflex.widgets.mechanism import mechanism, played
from rotflex.widgets.running import Experiment, Running, can_wait, outcome

if TYPE_CHECKING:
    from labcourse.pictures import Picture
    from rotflex.course.lab import Lab

_COMPUTED = "This bench is computed: nothing can break. Pull the arm aside and let go. STOP, or Escape, ends a run."
_WHOLE = (
    "In this browser Python cannot wait while it computes. So a run is computed as a whole and then played, and you "
    "cannot pull the arm."
)
_READY_MADE = (
    "This is a practice bench with a ready-made controller. Answer 3.8, predict in 3.13, and run this cell again: then "
    "you have your own bench and your own gain."
)
SAFETY = (
    "The bench's own emergency stop comes first. STOP here (and the Escape key) is software: it works only "
    "while computer and page do. Interrupting the kernel does not stop a run."
)
_SILENT = "Nothing is heard of the running bench: another cell may be running, or the computer may be busy."
_MAY_BREAK = "STOP may not be heard either: use the bench's own emergency stop."
_SECONDS = 5.0  # that the scope shows of a run
_ANGLES = {1: "theta", 2: "alpha"}  # their rows among the samples
_FRAME = 1 / 40  # s between two pictures of a run
_SOON = 0.008  # s from a pull to a picture: the arm takes some time to begin to move
_SILENCE = 3.0  # s without a sign of life from the page, after which a hand lets go, and a real bench stops
_LONGEST_STOP = 10.0  # s to wait for a board that does not answer
VALIDATION, HOLD, WATCH = "validation", "hold", "watch"
FULL, PARTIAL = "tracking, full state", "tracking, partial state"
_FEEDBACK = {FULL: "full", PARTIAL: "partial"}
_SHOWN = {HOLD: "hold: the servo stands still", WATCH: "watch: no controller, 0 V"}
#: What starts when the arm is grabbed, if it is chosen. If another experiment is chosen, HOLD starts.
_BY_HAND = (HOLD, WATCH, FULL, PARTIAL)
#: By their names; a recording has them as they stand here.
_EXPERIMENTS: dict[str, Callable[..., Recording]] = {
    "free decay": experiments.free_decay,
    "sweep": experiments.sweep,
    VALIDATION: experiments.validation,
    **dict.fromkeys(_FEEDBACK, experiments.tracking),
    HOLD: experiments.hold,
    WATCH: experiments.watch,
}
_PRACTICE = 7  # the practice bench with the ready-made controller


def replayed_at(address: str) -> Recording | None:
    """Return the recording that a replay's address plays; None for another address."""
    if not address.startswith("replay:"):
        return None
    return Recording.load(address.removeprefix("replay:").partition("?")[0])


class BenchConsole(Explorer):
    """A bench to be run and watched.

    Parameters
    ----------
    lab : the student's session
    K : (1, 4) gain for the tracking experiments; the student's answer to 3.8 unless given
    addresses : benches besides the student's own, as :func:`rotflex.hil.open` takes them
    experiment : the one that is chosen to begin with; the first unless given
    model : A (4, 4) and B (4, 1) for voltage input, for the validation; the student's answer to 2.14 unless given
    offered : names of the experiments that can be chosen; all unless given
    practice : a bench in place of all others, with its ready-made controller

    Attributes
    ----------
    recording : what was recorded last, or None
    watched : whether a run can be watched and the arm pulled; if not, it is computed as a whole and then played
    """

    def __init__(
        self,
        lab: Lab,
        K: ArrayLike | None = None,
        addresses: Sequence[str] = (),
        experiment: str = "",
        model: tuple[ArrayLike, ArrayLike] | None = None,
        offered: Sequence[str] = tuple(_EXPERIMENTS),
        practice: Practice | None = None,
    ) -> None:
        self._lab, self._gain, self._model, self._offered, self._practice = lab, K, model, tuple(offered), practice
        self._addresses = list(dict.fromkeys([lab.address, *addresses])) if practice is None else ["virtual"]
        self._bench: Bench | None = None
        self._run: Running | None = None
        self._hand: Hand | None = None  # on the arm, in a run that a page shows
        self._pulled = asyncio.Event()
        self.watched = can_wait()
        self._choose(self._addresses[0], replayed_at(self._addresses[0]))
        if experiment:
            self.choice = one_of("experiment", experiment, self._names())
        self._settled = True  # whether what came of it has been taken in
        self._state, self._message = self._idle, ""
        self.recording: Recording | None = None
        self._last_message = 0.0
        self._page = False  # whether a page has ever spoken
        self._least_behind = np.inf  # s
        super().__init__()
        _left_open.add(self)

    # --- what the user does -----------------------------------------------------------------------------------------

    def hear(self, event: Mapping[str, Any]) -> None:
        """Take a message of the page; STOP and letting go count here and now, whichever thread this is."""
        self._last_message, self._page = time.monotonic(), True  # whatever the page says is a sign of life
        if event.get("kind") == "press" and event.get("name") == "stop":
            self.stop()
        if event.get("kind") == "grab" and "x" not in event and self._hand is not None:
            self._hand.let_go()
        super().hear(event)

    def receive(self, event: Mapping[str, Any]) -> None:
        """Take an event; what begins a run is not wanted any more where it has waited for a busy Python."""
        sent = event.get("at")
        if isinstance(sent, (int, float)):
            behind = time.time() - sent / 1000  # of the page's clock, which may not be ours
            self._least_behind = min(self._least_behind, behind)
            late = behind - self._least_behind
            begins = "The arm was pulled" if event.get("begins") else ""
            if event.get("name") == "start" and not self._is_computed():
                begins = "Start was pressed"
            if begins and late > _SILENCE:
                event = {**event, "kind": "late"}
                self._message = f"{begins} {late:.0f} s ago, while Python was busy. Do it again."
        super().receive(event)

    def set(self, name: str, value: float | str) -> None:
        """Another bench, or another experiment."""
        if self.running:
            raise BenchError("An experiment is running. Stop it first.")
        if name == "address" and value in self._addresses:
            replayed = replayed_at(str(value))  # first: with no such file, nothing changes
            self.disconnect()
            self._choose(str(value), replayed)
        elif name == "experiment" and value in self._names():
            self.choice = str(value)

    def grab(self, name: str, place: tuple[float, float] | None, begins: bool) -> None:
        """The arm is pulled to a place in the mechanism, or let go. Start what is chosen, if nothing runs."""
        if begins and not self.running:
            self.choice = self.choice if self.choice in _BY_HAND else HOLD
            self.start()
        if self._hand is not None and place is None:
            self._hand.let_go()
        elif self._hand is not None and place is not None:
            self._hand.pull(math.atan2(-place[0], place[1]))
            self._pulled.set()

    def press(self, name: str) -> None:
        """A button."""
        actions: dict[str, Callable[[], None]] = {"connect": self.connect, "disconnect": self.disconnect}
        actions |= {"start": self.start, "stop": self.stop, "save": self._save}
        actions[name]()

    def _choose(self, address: str, replayed: Recording | None) -> None:
        self.address, self._replayed = address, replayed
        self._idle = "ready" if self._is_computed() else "not connected"
        self.choice = self._names()[0]

    # --- the same, in words of a program ----------------------------------------------------------------------------

    @property
    def running(self) -> bool:
        """Whether an experiment runs, or has only just ended."""
        return self._run is not None and not self._settled

    def connect(self) -> None:
        """Open the bench, at 0 V.

        Raises
        ------
        BenchError
            If there is no such bench, or it cannot be opened.
        """
        if self._bench is None:
            self._state = self._idle
            bench = self._lab.bench(self.address) if self._practice is None else self._practice.bench()
            self._bench = bench.__enter__()
            self._state, self._message = "connected", str(bench.connection.outcome())

    def disconnect(self) -> None:
        """Stop what runs, and let go of the bench, at 0 V."""
        self.stop("The bench was disconnected.")
        if self._run is not None:
            if not self._run.wait(_LONGEST_STOP) and not self.kernel.threads:
                return  # its next sample comes when this has returned
            self._settle()
        bench, self._bench = self._bench, None
        if bench is not None:
            bench.__exit__(None, None, None)
            self._state, self._message = self._idle, ""

    def start(self) -> None:
        """Run the chosen experiment. A bench that is only computed is connected for it; a real one, on purpose, before.

        Raises
        ------
        BenchError
            If the bench is not connected, or runs already.
        """
        if self.running:
            raise BenchError("An experiment is running already.")
        experiment = self._experiment()
        if self._is_computed():
            self.connect()
        if self._bench is None:
            raise BenchError("Connect the bench first.")
        self.recording, self._settled = None, False
        self._bench.recorder.forget()
        self._last_message = time.monotonic()
        loop = self.kernel.loop if self.watched else None
        self._run = Running(self._bench, experiment, self._alive, paced=loop is not None)
        if self._grabs():
            self._hand = Hand(STANDING if self.choice in (HOLD, WATCH) else DRIVING) if loop is not None else None
            self._bench.disturb(self._hand)
        waits = "" if self.choice in (HOLD, WATCH) else "This experiment first waits until the arm stands still."
        self._state, self._message = "running", waits
        self._run.start()
        if loop is not None:
            self._task = loop.create_task(self._show(self._run))
            return
        try:
            self._run.wait()
        finally:  # an interrupt, too
            self._run.stop("It was interrupted.")
            self._run.wait(_LONGEST_STOP)
            self._settle()

    def stop(self, reason: str = "") -> None:
        """0 V at the next sample."""
        if self._run is not None:
            self._run.stop(reason)

    def close(self) -> None:
        """Let go of the bench, and take the console off the page."""
        self.disconnect()
        super().close()

    # --- while it runs ----------------------------------------------------------------------------------------------

    def _alive(self) -> str:
        silent = self._page and time.monotonic() - self._last_message > _SILENCE
        if silent and self._hand is not None:
            self._hand.let_go()
        if silent and not self._is_computed():  # of a computed bench nothing moves, so that nothing need be stopped
            return "Nothing was heard of the page any more (closed, or Python was kept busy), so the run was stopped."
        return ""

    async def _show(self, run: Running) -> None:
        while not run.done:
            self.refresh()
            with suppress(TimeoutError):
                await asyncio.wait_for(self._pulled.wait(), _FRAME)
                self._pulled.clear()
                await asyncio.sleep(_SOON)
        if run is self._run:  # else another has been started since, and this one was seen to
            self._settle()
            self.refresh()

    def _settle(self) -> None:
        """What is to be said and kept of a run that has ended."""
        if self._run is None or self._settled:
            return
        self._settled = True
        self._state, self._message = outcome(self._run)
        if self._bench is not None and self._bench.recorder.unfinished_file is not None:
            self._message += f" What was recorded until then is in {self._bench.recorder.unfinished_file}."
        self.notice = self._message
        self.recording = self._run.recording
        if self._bench is not None and not self._bench.board.is_valid():
            bench, self._bench = self._bench, None
            bench.__exit__(None, None, None)

    def _is_computed(self) -> bool:
        """Say whether the bench is computed in its own time, so that nothing can break and nothing is late."""
        return self.address.partition(":")[0] in ("virtual", "replay") and "clock=wall" not in self.address

    def _grabs(self) -> bool:
        """Return whether the arm can be pulled: only on a virtual bench in simulated time, in a run that is watched."""
        recorded = self._bench is not None and self._bench.connection.recorded is not None
        return self.watched and self._is_computed() and self._replayed is None and not recorded

    def _names(self) -> tuple[str, ...]:
        """What can be run on this bench."""
        return (WATCH,) if self._replayed is not None else self._offered

    def _experiment(self) -> Experiment:
        """What is to be run now."""
        if self._replayed is not None:
            duration = float(self._replayed.time[-1] - self._replayed.time[0])
            return lambda bench: experiments.watch(bench, duration, progress=False)
        if self.choice == VALIDATION:
            if self._model is None and not (self._lab.has("2.14", "A") and self._lab.has("2.14", "B")):
                raise BenchError(
                    "A validation needs your model: answer question 2.14 first, or make the console with model=(A, B)."
                )
            A, B = self._model or another_arm.own_model(self._lab)
            return lambda bench: experiments.validation(bench, A, B, progress=False)
        feedback = _FEEDBACK.get(self.choice)
        if feedback is None:
            run = _EXPERIMENTS[self.choice]
            return lambda bench: run(bench, progress=False)
        if self._practice is not None:
            controller = self._practice.controller()
            return lambda bench: experiments.tracking(bench, controller, progress=False)
        gain = self._gain
        if gain is None and self._lab.has("3.8", "K"):
            gain = self._lab.value("3.8", "K")
        if gain is None:
            raise BenchError("Tracking needs your gain K: answer question 3.8 first, or make the console with K=...")
        return lambda bench: experiments.tracking(bench, gain, feedback, progress=False)

    def _save(self) -> None:
        if self.recording is None:
            raise BenchError("There is nothing recorded yet.")
        about = self.recording.metadata
        words = [about.get("experiment", "recording"), about.get("feedback", "")]
        name = "_".join(["console", *(str(word).replace(" ", "_") for word in words if word)]) + ".mat"
        path = self.recording.save(Path.cwd() / name)
        self.notice = f'Saved as {path.name}: rotflex.recording.Recording.load("{path.name}") reads it again.'

    # --- what there is to see ---------------------------------------------------------------------------------------

    def view(self) -> Scene:
        """Servo and arm beside the scope."""
        samples, alt = self._samples(), f"The bench console: {self._state}. {self._message}"
        theta, alpha = samples[1:3, -1].tolist() if samples.size else (0.0, 0.0)
        if samples.size:
            alt += f" The servo stands at {theta / DEG:.0f} deg, the arm is deflected by {alpha / DEG:.1f} deg."
        silent = _SILENT if self._is_computed() else f"{_SILENT} {_MAY_BREAK}"
        play, recording = None, self.recording
        if recording is not None and not self.running:
            span, unseen = (float(recording.time[0]), float(recording.time[-1])), not self.watched
            play = played(recording, *span, auto=unseen, at_once=unseen)
        return Scene(
            alt=alt.strip(),
            columns=[
                Column([mechanism(theta, alpha, self._grabs())], 0.7),
                Column(_scope(samples, self.running, self._modelled()), 1.3),
            ],
            controls=self._controls(),
            readouts=[self._status(), _reported(self._bench)],
            height=320,
            play=play,
            live=silent if self.running else "",
        )

    def picture(self) -> Picture:
        """The last run as a still picture."""
        if not self._samples().size:
            raise BenchError("Nothing has been run yet.")
        return super().picture()

    def _samples(self) -> Any:
        if self.recording is not None and not self.running:
            one = self.recording
            volts = one["vm"] if "vm" in one else np.zeros(len(one))  # a replay may have none
            return np.stack([one.time, one["theta"], one["alpha"], volts])
        return np.empty((4, 0)) if self._run is None else self._run.samples(_SECONDS if self.running else np.inf)

    def _modelled(self) -> dict[str, Any]:
        """The angles of the model that ran beside the bench, rad, when it is done."""
        if self.recording is None or self.running or "theta_model" not in self.recording:
            return {}
        return {name: self.recording[f"{name}_model"] for name in ("theta", "alpha")}

    def _controls(self) -> list[list[Control]]:
        connected, running = self._bench is not None, self.running
        names = {one: _SHOWN.get(one, one) for one in self._names()}
        ready = (connected or self._is_computed()) and not running
        bench: list[Control] = []
        if len(self._addresses) > 1:
            bench.append(Choice("address", "bench", {one: one for one in self._addresses}, self.address, running))
        if not self._is_computed():
            bench += [
                Button("connect", "Connect", disabled=connected, look="" if connected else "main"),
                Button("disconnect", "Disconnect", disabled=not connected or running),
            ]
        return [
            *([bench] if bench else []),
            [
                Choice("experiment", "experiment", names, self.choice, running),
                Button("start", "Start", "main" if ready or connected else "", not ready),
                Button("stop", "STOP", "stop", title="0 V at once; also by the Escape key, while it runs"),
                Button("save", "Save the recording", disabled=self.recording is None),
            ],
        ]

    def _status(self) -> Readout:
        if self._is_computed():
            words = [self._message or (_COMPUTED if self.watched else "")]
            words += [_READY_MADE if self._practice is not None else "", "" if self.watched else _WHOLE]
            return Readout("State", [Row("state", (self._state,)), *(Row("", (text,)) for text in words if text)])
        run = self._run
        late = "–" if run is None else f"{run.late} of {run.samples().shape[1]} samples"
        rows = [
            Row("state", (self._state,)),
            Row("", (self._message or SAFETY,)),
            Row("missed deadlines", (late,)),
            *([Row("mind", (SAFETY,))] if self._message else []),
        ]
        return Readout("State", rows)


# --- what there is to see ---------------------------------------------------------------------------------------------


def _scope(samples: Any, live: bool, model: Mapping[str, Any] | None = None) -> list[Panel]:
    """Servo angle, deflection and voltage against time.

    Parameters
    ----------
    samples : (4, n) time (s), theta, alpha (rad), voltage (V)
    live : whether it is still coming; else a line shows where a player is
    model : "theta" and "alpha" (rad) of a model, at the same times
    """
    time_ = samples[0]
    span = (float(time_[0]), max(float(time_[-1]), float(time_[0]) + _SECONDS)) if time_.size else (0.0, _SECONDS)
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


def _reported(bench: Bench | None) -> Readout:
    """What a bench says of itself."""
    if bench is None:
        return Readout("The bench", [Row("not connected", ())])
    limits = bench.safety.limits
    rows = [Row(str(name), (str(value),)) for name, value in bench.identity.items() if name != "uri"]
    rows += [  # a replay has none
        Row(name, (f"within ±{limit / DEG:.0f} deg",))
        for name, limit in (("servo angle", limits.theta), ("deflection", limits.alpha))
        if np.isfinite(limit)
    ]
    rows.append(Row("motor", (f"within ±{min(limits.voltage, bench.servo.V_max):g} V",)))
    rows.append(Row("watchdog", (f"0 V after {WATCHDOG_TIMEOUT:g} s without the program",)))
    return Readout("The bench reports", rows, folded=True)


def open_console(
    lab: Lab,
    K: ArrayLike | None = None,
    addresses: Sequence[str] = (),
    experiment: str = "",
    model: tuple[ArrayLike, ArrayLike] | None = None,
) -> BenchConsole:
    """The bench console, as a notebook makes it; see :class:`BenchConsole`."""
    return BenchConsole(lab, K, addresses, experiment, model)


def feel_controller(lab: Lab) -> BenchConsole:
    """Make a console to feel a controller: flick the arm while it runs, and then without a controller.

    It has a practice bench and a ready-made controller until the student has predicted the result of 3.13 and answered
    3.8. From then on it has the student's own bench and gain. Partial state feedback is offered after the prediction of
    3.15.
    """
    own = _predicted(lab, "3.13", "largest_deflection_deg") and lab.has("3.8", "K")
    partial = (PARTIAL,) if own and _predicted(lab, "3.15", "arm_swings") else ()
    practice = None if own else Practice(_PRACTICE)
    return BenchConsole(lab, offered=(FULL, *partial, HOLD, WATCH), practice=practice)


def _predicted(lab: Lab, question: str, name: str) -> bool:
    """Return whether the student has predicted a result, or need not."""
    return question not in lab.catalogue.predictions or lab.predicted(question, name) is not None


_left_open: weakref.WeakSet[BenchConsole] = weakref.WeakSet()


@atexit.register
def _let_go() -> None:
    """The kernel ends: 0 V on every bench that is still open."""
    for console in list(_left_open):
        with suppress(Exception):  # nobody is there to hear of it, and the next bench is to get its 0 V, too
            console.disconnect()
