"""The sweep explorer: what drives the servo, what the spectrum shows, which stiffness that means (Section 2.3.1)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from labcourse.scene.explorer import Explorer
from labcourse.scene.scene import Button, Choice, Column, Control, Panel, Readout, Row, Scene, Slider, around
from rotflex import experiments
from rotflex.course.practice import Practice
from rotflex.errors import BenchError, IdentificationError
from rotflex.identification import Estimate, frequency_response
from rotflex.recording import Recording
from rotflex.units import DEG, Vector
from rotflex.widgets import another_arm

if TYPE_CHECKING:
    from rotflex.course.lab import Lab


SHOWN_BAND = (0.5, 8.0)  #: Hz, that spectra are drawn and peaks looked for in
_COHERENT = 0.5  # a ratio of signals that share less than this is not looked at
_DRIVE = {"position": "position loop", "voltage": "motor voltage"}
_AMPLITUDE = {"position": (4.0, "deg", 0.5, 6.0, DEG), "voltage": (0.8, "V", 0.2, 2.0, 1.0)}
_RANGES = {"f_start": (0.5, 3.0, 0.1), "f_stop": (2.0, 8.0, 0.1), "duration": (5.0, 30.0, 1.0)}  # Hz, Hz, s
_LOOK = {"spectrum": "spectrum of α", "ratio": "ratio |α/θ|"}
_STEP = 0.01  # Hz, of the cursor


@dataclass(frozen=True)
class Spectra:
    """A sweep in terms of frequency.

    Attributes
    ----------
    f_hz, amplitude : (n,) Hz and rad, the amplitude spectrum of the deflection
    f_ratio, ratio : (m,) Hz and rad/rad, |alpha/theta|, where the two belong together
    spacing : Hz, from one point of the spectrum to the next: 1/duration
    """

    f_hz: Vector
    amplitude: Vector
    f_ratio: Vector
    ratio: Vector
    spacing: float

    def peak(self, of: str = "spectrum") -> float:
        """Frequency (Hz) of the largest value of the "spectrum" or of the "ratio"."""
        f, values = (self.f_hz, self.amplitude) if of == "spectrum" else (self.f_ratio, self.ratio)
        return float(f[values.argmax()])

    def height(self, f: float, of: str = "spectrum") -> float:
        """The value at a frequency (Hz)."""
        x, values = (self.f_hz, self.amplitude) if of == "spectrum" else (self.f_ratio, self.ratio)
        return float(np.interp(f, x, values))


def spectra(recording: Recording) -> Spectra:
    """The deflection's amplitude spectrum, and the ratio of deflection to servo angle, of a sweep.

    Raises
    ------
    IdentificationError
        If the recording is too short, or nothing moves.
    RecordingError
        If theta or alpha is missing.
    """
    alpha = recording["alpha"]
    found = frequency_response(recording)
    inside = (found.f_hz >= SHOWN_BAND[0]) & (found.f_hz <= SHOWN_BAND[1]) & (found.coherence >= _COHERENT)
    f = np.asarray(np.fft.rfftfreq(alpha.size, recording.sample_time), dtype=np.float64)
    shown = (f >= SHOWN_BAND[0]) & (f <= SHOWN_BAND[1])
    if not inside.any() or shown.sum() < 3:
        raise IdentificationError("The recording has too little between 0.5 and 8 Hz. Sweep for longer.")
    amplitude: Vector = 2 * np.abs(np.fft.rfft(alpha - alpha.mean())) / alpha.size
    ratio: Vector = np.abs(found.ratio)
    return Spectra(f[shown], amplitude[shown], found.f_hz[inside], ratio[inside], float(f[1]))


def stiffness_at(f: float, J_l: float, spacing: float) -> Estimate:
    """The stiffness (N·m/rad), if the link's natural frequency is where the cursor stands: K_s = J_l ω_n².

    Parameters
    ----------
    f : Hz
    J_l : kg·m²
    spacing : Hz; the frequency is known to half of it either way, evenly spread
    """
    omega, spread = 2 * np.pi * f, 2 * np.pi * spacing / np.sqrt(12)
    return Estimate(J_l * omega**2, 2 * J_l * omega * spread)


class SweepExplorer(Explorer):
    """Sweeps of the student's virtual bench, and a cursor on the peak.

    Parameters
    ----------
    lab : the student's session, or a practice bench, which shows no stiffness: on a virtual bench, every change of the
        sweep is run at once
    recording : a sweep to begin with; on any other bench, and without a session, it is all there is to look at
    J_l : kg·m², inertia of the link; that of the lab's arm unless given

    Raises
    ------
    BenchError
        If there is neither a recording nor a virtual bench, or no inertia.
    """

    def __init__(
        self, lab: Lab | Practice | None = None, recording: Recording | None = None, J_l: float | None = None
    ) -> None:
        if J_l is None and lab is None:
            raise BenchError("The sweep explorer needs the link's inertia: give lab=lab, or J_l in kg·m².")
        self.J_l = lab.joint.J_l if J_l is None and lab is not None else float(J_l or 0.0)
        self._lab = lab if lab is not None and lab.bench().is_simulated else None
        self._another = isinstance(lab, Practice)
        if self._lab is None and recording is None:
            raise BenchError(
                "The sweep explorer runs sweeps on a virtual bench in simulated time only. On another bench, "
                "record one with experiments.sweep, or in the bench console, and give it here: recording=..."
            )
        self.settings = _settings_of(recording)
        self.look = "spectrum"
        self.recording = recording if recording is not None else self._sweep(self.settings)
        self.spectra = spectra(self.recording)
        self.cursor = self.spectra.peak(self.look)
        super().__init__()

    # --- what the reader does ---------------------------------------------------------------------------------------

    def set(self, name: str, value: float | str) -> None:
        """A setting of the sweep, or what the cursor is on."""
        if name == "look":
            self.look = "ratio" if value == "ratio" else "spectrum"
            self.cursor = self.spectra.peak(self.look)
        else:
            changed = {**self.settings, name: value}
            if name == "drive":
                changed["drive"] = "voltage" if value == "voltage" else "position"
                changed["amplitude"] = _AMPLITUDE[changed["drive"]][0]
            recording = self._sweep(changed)
            found = spectra(recording)  # first everything, so that nothing is half changed should it fail
            self.settings, self.recording, self.spectra = changed, recording, found
            self.cursor = found.peak(self.look)

    def move(self, name: str, x: float, y: float) -> None:
        """The cursor was moved."""
        self.cursor = min(max(x, SHOWN_BAND[0]), SHOWN_BAND[1])

    def press(self, name: str) -> None:
        """The cursor goes to the peak."""
        self.cursor = self.spectra.peak(self.look)

    def _sweep(self, settings: dict[str, Any]) -> Recording:
        if self._lab is None:
            raise BenchError("This is a recording: what was recorded cannot be changed.")
        amplitude = float(settings["amplitude"]) * _AMPLITUDE[settings["drive"]][4]
        with self._lab.bench() as bench:
            return experiments.sweep(bench, **{**settings, "amplitude": amplitude}, progress=False)

    # --- what there is to see ---------------------------------------------------------------------------------------

    def view(self) -> Scene:
        """Both angles against time, the spectrum and the ratio against frequency, stiffness below."""
        recording, found = self.recording, self.spectra
        span = (float(recording.time[0]), float(recording.time[-1]))
        theta = Panel("θ (deg)", span, around(recording.degrees("theta")))
        alpha = Panel("α (deg)", span, around(recording.degrees("alpha")), "time (s)", height=1.15)
        theta.line(recording.time, recording.degrees("theta"), "measured", "servo angle")
        if "theta_ref" in recording:
            theta.line(recording.time, recording.degrees("theta_ref"), "reference", "command")
        alpha.line(recording.time, recording.degrees("alpha"), "measured", "deflection")
        top = 1.25 * found.amplitude.max() / DEG
        spectrum = Panel("amplitude of α (deg)", SHOWN_BAND, (0.0, float(top)))
        spectrum.line(found.f_hz, found.amplitude / DEG, "measured", "spectrum")
        ratio = Panel("|α/θ|", SHOWN_BAND, (0.0, 1.25 * float(found.ratio.max())), "frequency (Hz)", height=1.15)
        ratio.line(found.f_ratio, found.ratio, "model", "ratio")
        text = f"{self.cursor:.2f} Hz"
        peaks = [Row(name, (f"{found.peak(of):.2f} Hz",)) for of, name in _LOOK.items()]
        for panel, of in ((spectrum, "spectrum"), (ratio, "ratio")):
            panel.level(self.cursor, "highlight", axis="x", label="cursor" if of == "spectrum" else "")
            if of == self.look:
                height = found.height(self.cursor, of) / (DEG if of == "spectrum" else 1.0)
                panel.handle("cursor", self.cursor, height, "cursor", text, (_STEP, 0.0), "highlight", "cursor", "x")
        return Scene(
            alt=(
                f"A sweep of {span[1]:.3g} s: the deflection reaches {np.abs(recording.degrees('alpha')).max():.2g} "
                f"deg. Its spectrum peaks at {found.peak():.2f} Hz, at {found.height(found.peak()) / DEG:.2g} deg; the "
                f"ratio of deflection to servo angle peaks at {found.peak('ratio'):.2f} Hz. The cursor is at {text}."
            ),
            columns=[Column([theta, alpha]), Column([spectrum, ratio])],
            controls=self._controls(),
            readouts=[another_arm.notice("2.12") if self._another else self._stiffness(), Readout("Peaks", peaks)],
            height=300 if self._another else 420,
        )

    def _controls(self) -> list[list[Control]]:
        below: list[Control] = [Choice("look", "cursor on the", _LOOK, self.look), Button("peak", "Cursor to the peak")]
        if self._lab is None:
            return [below]
        settings = self.settings
        _start, unit, low, high, _scale = _AMPLITUDE[settings["drive"]]
        start, stop, duration = (
            Slider(name, label, of, *_RANGES[name], settings[name])
            for name, label, of in (("f_start", "from", "Hz"), ("f_stop", "to", "Hz"), ("duration", "duration", "s"))
        )
        amplitude = Slider("amplitude", "amplitude", unit, low, high, 0.1, settings["amplitude"])
        drive = Choice("drive", "the sweep drives", _DRIVE, settings["drive"])
        return [[start, stop], [duration, amplitude], [drive, *below]]

    def _stiffness(self) -> Readout:
        found = stiffness_at(self.cursor, self.J_l, self.spectra.spacing)
        rows = [
            Row("cursor", (f"{self.cursor:.2f} Hz", f"{self.cursor * 6.283185:.2f} rad/s")),
            Row("spacing of the spectrum", (f"{self.spectra.spacing:.3f} Hz", "")),
            Row("J_l", (f"{self.J_l:.4g} kg·m²", "")),
            Row("K_s, if this is ω_n", (f"{found.value:.3f} ± {found.uncertainty:.3f} N·m/rad", "")),
        ]
        return Readout("Stiffness by the cursor", rows)


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
    """Make the sweep explorer; see :class:`SweepExplorer`.

    With ``lab`` alone it has the student's bench once question 2.12 is answered, and a practice bench before.
    """
    if lab is None or recording is not None or J_l is not None:
        return SweepExplorer(lab, recording, J_l)

    def own() -> SweepExplorer:
        if lab.bench().is_simulated:
            return SweepExplorer(lab)
        with another_arm.own_bench(lab) as bench:
            return SweepExplorer(lab, experiments.sweep(bench, progress=False))

    return another_arm.unless_answered(lab, "2.12 K_s", own, lambda: SweepExplorer(another_arm.practice()))
