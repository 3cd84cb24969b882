"""The sweep explorer: what drives the servo, what the spectrum shows, which stiffness that means (Section 2.3.1)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from labcourse.pictures import ROLES, WIDTH, Picture, new_picture, style
from labcourse.scene.explorer import Explorer
from labcourse.scene.scene import Button, Choice, Column, Panel, Readout, Row, Scene, Slider, around
from rotflex import experiments
from rotflex.errors import BenchError
from rotflex.recording import Recording
from rotflex.units import DEG
from rotflex.widgets.spectra import SHOWN, Spectra, alt_text_of, spectra, stiffness_at

if TYPE_CHECKING:
    from rotflex.course.lab import Lab

_DRIVE = {"position": "position loop", "voltage": "motor voltage"}
_AMPLITUDE = {"position": (4.0, "deg", 0.5, 6.0, DEG), "voltage": (0.8, "V", 0.2, 2.0, 1.0)}
_RANGES = {"f_start": (0.5, 3.0, 0.1), "f_stop": (2.0, 8.0, 0.1), "duration": (5.0, 30.0, 1.0)}  # Hz, Hz, s
_LOOK = {"spectrum": "spectrum of α", "ratio": "ratio |α/θ|"}
_STEP = 0.01  # Hz, of the cursor


class SweepExplorer(Explorer):
    """Sweeps of the student's virtual bench, and a cursor on the peak.

    Parameters
    ----------
    lab : the student's session: on a virtual bench, every change of the sweep is run at once
    recording : a sweep to begin with; on any other bench, and without a session, it is all there is to look at
    J_l : kg·m², inertia of the link; that of the lab's arm unless given

    Raises
    ------
    BenchError
        If there is neither a recording nor a virtual bench, or no inertia.
    """

    def __init__(self, lab: Lab | None = None, recording: Recording | None = None, J_l: float | None = None) -> None:
        if J_l is None and lab is None:
            raise BenchError("The sweep explorer needs the link's inertia: give lab=lab, or J_l in kg·m².")
        self.J_l = lab.joint.J_l if J_l is None and lab is not None else float(J_l or 0.0)
        self._lab = lab if lab is not None and lab.bench().is_simulated else None
        if self._lab is None and recording is None:
            raise BenchError(
                "The sweep explorer runs sweeps on a virtual bench in simulated time only. On another bench, "
                "record one with experiments.sweep, or in the bench console, and give it here: recording=..."
            )
        self.settings = _settings_of(recording)
        self.look = "spectrum"
        self.recording = recording if recording is not None else self._sweep(self.settings)
        self.found = spectra(self.recording)
        self.cursor = self.found.peak(self.look)
        super().__init__()

    # --- what the reader does ---------------------------------------------------------------------------------------

    def set(self, name: str, value: float | str) -> None:
        """A setting of the sweep, or what the cursor is on."""
        if name == "look":
            self.look = "ratio" if value == "ratio" else "spectrum"
            self.cursor = self.found.peak(self.look)
        elif name == "cursor":
            self.move(name, float(value), 0.0)
        else:
            changed = {**self.settings, name: self._within(name, value)}
            if name == "drive":
                changed["drive"] = "voltage" if value == "voltage" else "position"
                changed["amplitude"] = _AMPLITUDE[changed["drive"]][0]
            recording = self._sweep(changed)
            found = spectra(recording)  # first everything, so that nothing is half changed should it fail
            self.settings, self.recording, self.found = changed, recording, found
            self.cursor = found.peak(self.look)

    def _within(self, name: str, value: float | str) -> float | str:
        """A setting within its slider's range: a number box keeps to none."""
        if isinstance(value, str):
            return value
        low, high = _RANGES[name][:2] if name in _RANGES else _AMPLITUDE[self.settings["drive"]][2:4]
        return min(max(value, low), high)

    def move(self, name: str, x: float, y: float) -> None:
        """The cursor was moved."""
        self.cursor = min(max(x, SHOWN[0]), SHOWN[1])

    def press(self, name: str) -> None:
        """The cursor goes to the peak."""
        self.cursor = self.found.peak(self.look)

    def _sweep(self, settings: dict[str, Any]) -> Recording:
        if self._lab is None:
            raise BenchError("This is a recording: what was recorded cannot be changed.")
        amplitude = float(settings["amplitude"]) * _AMPLITUDE[settings["drive"]][4]
        with self._lab.bench() as bench:
            return experiments.sweep(bench, **{**settings, "amplitude": amplitude}, progress=False)

    # --- what there is to see ---------------------------------------------------------------------------------------

    def view(self) -> Scene:
        """Both angles against time, the spectrum and the ratio against frequency, stiffness below."""
        recording, found = self.recording, self.found
        span = (float(recording.time[0]), float(recording.time[-1]))
        theta = Panel("θ (deg)", span, around(recording.degrees("theta")))
        alpha = Panel("α (deg)", span, around(recording.degrees("alpha")), "time (s)", height=1.15)
        if "theta_ref" in recording:
            theta.line(recording.time, recording.degrees("theta"), "measured", "servo angle")
            theta.line(recording.time, recording.degrees("theta_ref"), "reference", "command")
        else:
            theta.line(recording.time, recording.degrees("theta"), "measured", "servo angle")
        alpha.line(recording.time, recording.degrees("alpha"), "measured", "deflection")
        top = 1.25 * found.amplitude.max() / DEG
        spectrum = Panel("amplitude of α (deg)", SHOWN, (0.0, float(top)))
        spectrum.line(found.f_hz, found.amplitude / DEG, "measured", "spectrum")
        ratio = Panel("|α/θ|", SHOWN, (0.0, 1.25 * float(found.ratio.max())), "frequency (Hz)", height=1.15)
        ratio.line(found.f_ratio, found.ratio, "model", "ratio")
        text = f"{self.cursor:.2f} Hz"
        for panel, of in ((spectrum, "spectrum"), (ratio, "ratio")):
            panel.level(self.cursor, "highlight", axis="x", label="cursor" if of == "spectrum" else "")
            if of == self.look:
                height = found.height(self.cursor, of) / (DEG if of == "spectrum" else 1.0)
                panel.handle("cursor", self.cursor, height, "cursor", text, (_STEP, 0.0), "highlight", "cursor", "x")
        return Scene(
            alt=f"{alt_text_of(found, recording)} The cursor is at {text}.",
            columns=[Column([theta, alpha]), Column([spectrum, ratio])],
            controls=self._controls(),
            readouts=[self._stiffness(), self._peaks()],
            height=420,
        )

    def picture(self) -> Picture:
        """The same as a static figure."""
        return picture(self.recording, self.found, self.cursor)

    def _controls(self) -> list[list[Slider | Choice | Button]]:
        settings, fixed = self.settings, self._lab is None
        _start, unit, low, high, _scale = _AMPLITUDE[settings["drive"]]
        sweep: list[list[Slider | Choice | Button]] = [
            [
                Slider("f_start", "from", "Hz", *_RANGES["f_start"], settings["f_start"]),
                Slider("f_stop", "to", "Hz", *_RANGES["f_stop"], settings["f_stop"]),
            ],
            [
                Slider("duration", "duration", "s", *_RANGES["duration"], settings["duration"]),
                Slider("amplitude", "amplitude", unit, low, high, 0.1, settings["amplitude"]),
            ],
        ]
        below: list[Slider | Choice | Button] = [
            Choice("look", "cursor on the", _LOOK, self.look),
            Button("peak", "Cursor to the peak"),
        ]
        drive = Choice("drive", "the sweep drives", _DRIVE, settings["drive"])
        return [below] if fixed else [*sweep, [drive, *below]]

    def _stiffness(self) -> Readout:
        found = stiffness_at(self.cursor, self.J_l, self.found.spacing)
        rows = [
            Row("cursor", (f"{self.cursor:.2f} Hz", f"{self.cursor * 6.283185:.2f} rad/s")),
            Row("spacing of the spectrum", (f"{self.found.spacing:.3f} Hz", "")),
            Row("J_l", (f"{self.J_l:.4g} kg·m²", "")),
            Row("K_s, were it the link's ω_n", (f"{found.value:.3f} ± {found.uncertainty:.3f} N·m/rad", "")),
        ]
        return Readout("Stiffness by the cursor", rows)

    def _peaks(self) -> Readout:
        rows = [Row(text, (f"{self.found.peak(of):.2f} Hz",)) for of, text in _LOOK.items()]
        return Readout("Peaks", rows)


def _settings_of(recording: Recording | None) -> dict[str, Any]:
    """The settings of a recorded sweep, as far as it tells; else the laboratory's."""
    found: dict[str, Any] = {"f_start": 1.0, "f_stop": 5.0, "duration": 15.0, "drive": "position"}
    if recording is not None:
        found |= {name: value for name, value in recording.metadata.items() if name in ("f_start", "f_stop", "drive")}
        found["duration"] = float(recording.time[-1] - recording.time[0])
    return found | {"amplitude": _AMPLITUDE[found["drive"]][0]}


def explore_sweep(
    lab: Lab | None = None, recording: Recording | None = None, J_l: float | None = None
) -> SweepExplorer:
    """Make the sweep explorer; see :class:`SweepExplorer`."""
    return SweepExplorer(lab, recording, J_l)


def picture(recording: Recording, found: Spectra, cursor: float) -> Picture:
    """A sweep as a static figure: both angles against time, spectrum and ratio against frequency.

    Parameters
    ----------
    recording : the sweep
    found : from :func:`~rotflex.widgets.spectra.spectra`
    cursor : Hz, to be marked
    """
    with style():
        figure = new_picture(1.35 * WIDTH, 4.4)
        (theta, spectrum), (alpha, ratio) = figure.subplots(2, 2)
        theta.plot(recording.time, recording.degrees("theta"), **ROLES["measured"])
        alpha.plot(recording.time, recording.degrees("alpha"), **ROLES["measured"])
        spectrum.plot(found.f_hz, found.amplitude / DEG, **ROLES["measured"])
        ratio.plot(found.f_ratio, found.ratio, **ROLES["model"])
        for axes in (spectrum, ratio):
            axes.axvline(cursor, **ROLES["highlight"])
            axes.set(xlim=SHOWN)
        theta.set(ylabel="θ (deg)")
        alpha.set(ylabel="α (deg)", xlabel="time (s)")
        spectrum.set(ylabel="amplitude of α (deg)")
        ratio.set(ylabel="|α/θ| (rad/rad)", xlabel="frequency (Hz)")
    figure.alt_text = f"{alt_text_of(found, recording)} The cursor is at {cursor:.2f} Hz."
    return figure
