"""Arms that move side by side: another arm with its energies, bench and model, and the student's arm at the end."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from labcourse.scene.explorer import Explorer, written
from labcourse.scene.scene import Button, Choice, Column, Control, Moving, Panel, Play, Readout, Row, Scene, around
from rotflex import experiments, response, simulation
from rotflex.course.reflection.common import stored_recording
from rotflex.errors import NotRecorded, RotflexError
from rotflex.hil.controllers import PositionServo
from rotflex.plant import PlantParameters
from rotflex.recording import Recording
from rotflex.signals import smooth_square_wave, time_axis
from rotflex.specifications import AMPLITUDE, FREQUENCY, RATE, SAMPLE_TIME
from rotflex.units import DEG
from rotflex.widgets import another_arm
from rotflex.widgets.mechanism import mechanism, played

if TYPE_CHECKING:
    from PIL import Image

    from rotflex.course.lab import Lab

_ENERGIES = {"spring": "voltage", "servo": "model", "link": "measured"}  # in the order of the stack → role
_SERVO = {"free": "free", "held": "held"}
_SLOWER = 4.0  # than it was: the eye follows
_SERVO_ALONE = partial(PositionServo, K_p=20.0, K_d=1.6, sample_time=SAMPLE_TIME)
_PERIOD, _BEFORE = 1 / FREQUENCY, 0.1  # s, of the wave; before its step
_ALONE_LASTS = 1.6 * _PERIOD  # s, with a whole period after the first full step
_TYPICAL = 1.4  # N·m/rad, of a joint that is not measured yet
_FRAMES_PER_SECOND, _FRAME_DOTS = 20, 80  # of the film; an inch
# Feedback → its colour, the questions of its recording and of its figures.
_FEEDBACK = {"full state": ("measured", "3.13", "3.14"), "partial state": ("model", "3.15", "3.16")}
#: Figures of a response by the names of their answers → what they are, and their unit. The last one is not asked.
FIGURES = {
    "t_s": ("settling time of the servo", "s"),
    "PO": ("overshoot", "%"),
    "alpha_max_deg": ("largest deflection", "deg"),
    "V_max": ("largest voltage", "V"),
    "end": ("settling time of the arm's end", "s"),
}


@dataclass(frozen=True)
class Arm:
    """An arm that moves as it was recorded.

    Attributes
    ----------
    title : above it
    role : its colour
    recording : with theta and alpha, from 0 s on
    figures : what is known of its response, see :func:`figures_of`
    """

    title: str
    role: str
    recording: Recording
    figures: Mapping[str, float] = field(default_factory=dict)

    def figure(self, name: str, unit: str) -> str:
        """One of the figures with its unit, for a table."""
        value = self.figures.get(name, np.nan)
        return "–" if np.isnan(value) else "does not settle" if np.isinf(value) else f"{value:.3g} {unit}"

    def drawn(self, number: int, t: float = 0.0) -> Moving:
        """Servo and arm at an instant (s), with signals of their own: "theta 1", "alpha 1" for arm number 1."""
        one = self.recording
        theta, alpha = (float(np.interp(t, one.time, one[name])) for name in ("theta", "alpha"))
        drawing = mechanism(theta, alpha)

        def numbered(frame: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
            return [{"turn": f"{step['turn']} {number}"} for step in frame]

        shapes = [
            shape
            | {"role": self.role if shape["role"] == "measured" else shape["role"]}
            | {"points": [point | {"frame": numbered(point["frame"])} for point in shape["points"]]}
            for shape in drawing.shapes
        ]
        reading = drawing.readings[-1] | {"label": f"{self.title}   α", "signal": f"alpha {number}"}
        signals = {f"{name} {number}": value for name, value in drawing.signals.items()}
        return replace(drawing, signals=signals, shapes=shapes, readings=[reading])


class ArmsExplorer(Explorer):
    """Arms that move at the same time, beside their angles.

    Parameters
    ----------
    arms : one or more
    readouts : below
    """

    def __init__(self, arms: Sequence[Arm], readouts: Sequence[Readout] = ()) -> None:
        self.arms, self._readouts = arms, readouts
        super().__init__()

    def view(self) -> Scene:
        """The arms, and to their right both angles against time."""
        largest = [f"{arm.title} {np.abs(arm.recording.degrees('alpha')).max():.1f} deg" for arm in self.arms]
        duration = max(float(arm.recording.time[-1]) for arm in self.arms)
        play = [played(arm.recording, 0.0, duration) for arm in self.arms]
        signals = {f"{name} {n}": values for n, one in enumerate(play) for name, values in one.signals.items()}
        columns = [Column([arm.drawn(number)], 0.62) for number, arm in enumerate(self.arms)]
        return Scene(
            alt=f"Arms that move side by side. Largest deflections: {', '.join(largest)}.",
            columns=[*columns, Column(self.panels(duration), 1.0)],
            controls=self.controls(),
            readouts=self._readouts,
            height=300,
            play=replace(play[0], signals=signals, auto=True, at_once=True),
        )

    def panels(self, duration: float) -> list[Panel]:
        """Both angles of all arms against time, from their beginning on."""
        panels = []
        for name, label in (("theta", "θ (deg)"), ("alpha", "α (deg)")):
            values = [arm.recording.degrees(name) for arm in self.arms]
            panel = Panel(label, (0.0, duration), around(*values), "time (s)" if name == "alpha" else "")
            for arm, curve in zip(self.arms, values, strict=True):
                panel.line(arm.recording.time, curve, arm.role, arm.title if name == "theta" else "")
            panel.level(0.0, "text", axis="x", clock=True)
            panels.append(panel)
        return panels

    def controls(self) -> list[list[Control]]:
        """Nothing but the player."""
        return []


# --- energies (Section 2.2) -------------------------------------------------------------------------------------------


class EnergyExplorer(Explorer):
    """Another arm that was pulled aside and let go: its energies flow between spring, servo and link."""

    def __init__(self) -> None:
        self.servo = "free"
        super().__init__()

    def set(self, name: str, value: float | str) -> None:
        """The servo is free, or held."""
        self.servo = "held" if value == "held" else "free"

    def view(self) -> Scene:
        """The arm beside its energies, one on top of the other."""
        stored = another_arm.numbers()[self.servo]
        time = _SLOWER * another_arm.numbers()["step"] * np.arange(len(stored["spring"]))
        angles = {name: DEG * np.array(stored[f"{name}_deg"]) for name in ("theta", "alpha")}
        drawing = mechanism(0.0, float(angles["alpha"][0]))
        energies = {name: np.array(stored[name], dtype=float) for name in _ENERGIES}
        drawing.signals = {**drawing.signals, **{name: float(values[0]) for name, values in energies.items()}}
        drawing.readings.clear()
        end = float(time[-1])
        panel = Panel("energy (mJ)", (0.0, end), (0.0, 1.08 * stored["spring"][0]))
        panel.xlabel = "time (s), four times slower than it was"
        below = np.zeros_like(time)
        for name, role in _ENERGIES.items():
            drawing.reading(name, name, " mJ", digits=0)
            above = below + energies[name]
            panel.area(np.append(time, time[::-1]), np.append(above, below[::-1]), role, name, opacity=0.75)
            below = above
        panel.level(0.0, "text", axis="x", clock=True)
        instants = np.linspace(0.0, end, 60 * round(end))
        signals = {name: np.interp(instants, time, values) for name, values in {**angles, **energies}.items()}
        return Scene(
            alt=(
                f"An arm is pulled aside by 20 degrees and let go. The servo is {self.servo}. The spring's energy, "
                f"{stored['spring'][0]} mJ, flows to the link{' and the servo' if self.servo == 'free' else ''} and "
                "back. Friction takes it away."
            ),
            columns=[Column([drawing], 0.8), Column([panel], 1.2)],
            controls=[[Choice("servo", "the servo is", _SERVO, self.servo)]],
            height=300,
            play=Play(signals, end, auto=True, at_once=True),
        )


def watch_energy() -> EnergyExplorer:
    """An arm that was pulled and let go, with its energies, as a notebook makes it."""
    return EnergyExplorer()


# --- bench and model (Section 2.4) ------------------------------------------------------------------------------------


def watch_model(lab: Lab) -> ArmsExplorer:
    """Bench and model side by side, as a notebook makes it: answer 2.15, or another arm before."""

    def side_by_side(compared: Recording, *more: Readout) -> ArmsExplorer:
        model = compared.with_channels(theta=compared["theta_model"], alpha=compared["alpha_model"])
        return ArmsExplorer([Arm("bench", "measured", compared), Arm("model", "model", model)], more)

    return another_arm.unless_answered(
        lab,
        "2.15 validation",
        lambda: side_by_side(stored_recording(lab.value("2.15", "validation"))),
        lambda: side_by_side(another_arm.validated(), another_arm.notice("2.15")),
    )


# --- before and after the controller (Section 3.5) --------------------------------------------------------------------


class OwnArm(ArmsExplorer):
    """The student's arm before and after the controller; it can be kept as a film and as a picture."""

    def controls(self) -> list[list[Control]]:
        """A button to keep it."""
        return [[Button("keep", "Keep it as film and picture", "main", self.busy)]]

    def press(self, name: str) -> None:
        """Draw the film and the picture, and save them beside the notebook."""
        if not self.busy:
            self.notice = "The film is drawn. That takes some seconds."
            self.in_background(self.keep, self._kept)

    def keep(self) -> str:
        """Save ``my_arm.gif`` and ``my_arm.png`` beside the notebook, and return a message.

        Raises
        ------
        CourseError
            If they cannot be written.
        """
        from labcourse.pictures import png

        frames, picture = self.film(), png(self.picture())
        every = round(1000 / _FRAMES_PER_SECOND)

        def save(path: Path) -> None:
            frames[0].save(path, "GIF", save_all=True, append_images=frames[1:], duration=every, loop=0)

        written(Path.cwd() / "my_arm.gif", save)
        written(Path.cwd() / "my_arm.png", picture)
        return "Saved beside the notebook: my_arm.gif, which moves in every browser and every chat, and my_arm.png."

    def film(self) -> list[Image.Image]:
        """One period of the command, frame by frame."""
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from PIL import Image

        from labcourse.pictures import style
        from labcourse.scene import still

        scene, frames = self.view(), []
        duration = scene.play.duration if scene.play else 0.0
        with style():
            figure = still.picture(scene)
            figure.set_dpi(_FRAME_DOTS)
            canvas: Any = FigureCanvasAgg(figure)
            canvas.draw()
            figure.set_layout_engine("none")
            drawings, plots = figure.axes[: len(self.arms)], figure.axes[len(self.arms) :]
            now = [plot.axvline(0.0, color="black", linewidth=1.0, animated=True) for plot in plots]
            for axes in drawings:
                axes.set_animated(True)
            canvas.draw()
            behind = canvas.copy_from_bbox(figure.bbox)  # all that stands still
            for t in np.arange(0.0, duration, 1 / _FRAMES_PER_SECOND).tolist():
                canvas.restore_region(behind)
                for number, (axes, arm) in enumerate(zip(drawings, self.arms, strict=True)):
                    for artist in [*axes.lines, *axes.patches]:  # quicker than clear()
                        artist.remove()
                    still.draw_moving(axes, arm.drawn(number, t))
                    figure.draw_artist(axes)
                for line in now:
                    line.set_xdata([t, t])
                    figure.draw_artist(line)
                frames.append(Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB").quantize(64))
        return frames

    def _kept(self, message: str) -> None:
        self.notice = message


def show_arm(lab: Lab) -> OwnArm:
    """The student's arm before and after the controller, as a notebook makes it.

    The same command moves all: with the servo's position alone fed back, and with full and with partial state feedback
    as answers 3.13 and 3.15 have them.
    """
    arms, missing = [_servo_alone(lab)], []
    for title, (role, recorded, asked) in _FEEDBACK.items():
        if lab.has(recorded, "response"):
            response_ = stored_recording(lab.value(recorded, "response"))
            own = {name: lab.value(asked, name) for name in FIGURES if name != "end" and lab.has(asked, name)}
            arms.append(Arm(title, role, _one_period(response_), {**figures_of(response_), **own}))
        else:
            missing.append(recorded)
    rows = [Row(text, [arm.figure(name, unit) for arm in arms]) for name, (text, unit) in FIGURES.items()]
    readouts = [Readout("Your arm", rows, ("", *(arm.title for arm in arms)))]
    if missing:
        readouts.append(another_arm.notice(" and ".join(missing), "Your controller"))
    return OwnArm(arms, readouts)


def figures_of(recording: Recording) -> dict[str, float]:
    """Measure a response: the four figures of the specifications, and when the end of the arm settles.

    Returns
    -------
    dict
        By the names in :data:`FIGURES`: s, %, deg, V, s. What cannot be measured is left out.
    """
    end = recording.with_channels(theta=recording["theta"] + recording["alpha"])
    try:
        servo, arm = (response.worst(response.measure(one)) for one in (recording, end))
    except RotflexError:
        return {}
    found = {"t_s": servo.settling_time, "PO": servo.overshoot, "V_max": servo.max_vm, "end": arm.settling_time}
    found["alpha_max_deg"] = None if servo.max_alpha is None else servo.max_alpha / DEG
    return {name: value for name, value in found.items() if value is not None}


def _one_period(recording: Recording) -> Recording:
    """The first period of the command that begins with a full step, or what there is."""
    try:
        steps = response.measure(recording)
        start = next(step.start for step in steps if step.size > 0.9 * max(one.size for one in steps)) - _BEFORE
        return recording.between(start, start + _PERIOD)
    except RotflexError:
        return recording


def _servo_alone(lab: Lab) -> Arm:
    """The command without the design, on the student's virtual bench; else simulated, with their stiffness if known."""
    title, bench = "servo alone", lab.bench()
    try:
        if not bench.is_simulated:
            raise NotRecorded("Nothing moves a real bench here.")
        with bench:
            recording = experiments.tracking(bench, _SERVO_ALONE(), duration=_ALONE_LASTS, progress=False)
    except RotflexError:
        title = "servo alone, simulated"
        K_s = lab.value("2.12", "K_s") if lab.has("2.12", "K_s") else _TYPICAL
        command = smooth_square_wave(time_axis(_ALONE_LASTS, SAMPLE_TIME), FREQUENCY, AMPLITUDE, RATE)
        recording = simulation.run(PlantParameters.of(lab.servo, lab.joint, K_s), _SERVO_ALONE(), command)
    return Arm(title, "ghost", _one_period(recording), figures_of(recording))
