"""What a sine sweep tells of the stiffness, without a page (Section 2.3.1)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rotflex.errors import IdentificationError
from rotflex.identification import Estimate, frequency_response
from rotflex.recording import Recording
from rotflex.units import DEG

Vector = NDArray[np.float64]

SHOWN = (0.5, 8.0)  #: Hz, that spectra are drawn and peaks looked for in
_COHERENT = 0.5  # a ratio of signals that share less than this is not looked at


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
    inside = (found.f_hz >= SHOWN[0]) & (found.f_hz <= SHOWN[1]) & (found.coherence >= _COHERENT)
    f = np.asarray(np.fft.rfftfreq(alpha.size, recording.sample_time), dtype=np.float64)
    shown = (f >= SHOWN[0]) & (f <= SHOWN[1])
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


def alt_text_of(found: Spectra, recording: Recording) -> str:
    """A sweep in words, for somebody who cannot see it."""
    largest = np.abs(recording.degrees("alpha")).max()
    return (
        f"A sweep of {recording.time[-1]:.3g} s: the deflection reaches {largest:.2g} deg. Its spectrum peaks at "
        f"{found.peak():.2f} Hz, at {found.height(found.peak()) / DEG:.2g} deg; the ratio of deflection to servo "
        f"angle peaks at {found.peak('ratio'):.2f} Hz."
    )
