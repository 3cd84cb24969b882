"""Find what a recording tells of the bench: spectra, the natural frequency of the link, its damping.

Why not simply read the peak of alpha's spectrum? The link, seen from the servo, is a second-order system
(Equations 2.6 and 2.21),

    alpha/theta = ω²/(ω_n² − ω² + 2ζω_n ω j),     ω_n² = K_s/J_l,

whatever turns the servo. Its *deflection* alone peaks at ω_n only if the servo moves with equal strength at all
frequencies. A sweep that is fed to the motor as a voltage does not do that: the servo gives way to the link, alpha
peaks a seventh to a half too high, and the stiffness comes out 1.3 to more than 2 times as large. The *ratio* of alpha
to theta is free of that.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotflex import doubts
from rotflex.config import finite_vector
from rotflex.errors import IdentificationError
from rotflex.recording import Recording
from rotflex.units import DEG, HZ, Vector

if TYPE_CHECKING:
    from control import FRD

__all__ = [
    "SWEEP_BAND",
    "Estimate",
    "FreeDecay",
    "FrequencyResponse",
    "channel",
    "frequency_response",
    "logarithmic_decrement",
    "resonance",
]


def __dir__() -> list[str]:
    return __all__


SWEEP_BAND = (1.0, 5.0)  #: Hz, of the laboratory's sine sweep
_HANN_BANDWIDTH = 1.5  # of the Hann window, in units of 1/length: it blurs a spectrum by this much
_SEGMENT = 2 / 3  # of the recording
_STRIDE = 1 / 8  # of a segment, from one to the next
_ZERO_PADDING = 4
_AROUND_PEAK = 0.2  # of its frequency, to either side: the part of a response that a resonance is fitted to
_COHERENT = 0.5  # a ratio of signals that share less than this is not looked at
_LARGEST_DAMPING = 0.5  # beyond, there is hardly a peak
_LARGEST_MISFIT = 0.2  # of the response, in the mean square
_FEWEST_PEAKS = 6
_FEWEST_SAMPLES = 64
_FLOOR = 0.05  # of the largest swing; smaller ones are not used
_FLOOR_STEPS = 6  # of the encoder; the same
_PARABOLA = 0.2  # of a half period, to either side of a turning point
_STANDS_WITHIN, _GIVES_WAY = 0.05, 0.1  # of its travel, of alpha: a servo so near to where it ends stands
_UNSURE_OF_SERVO = 0.15  # of the correction for a servo that gives way: it sticks in small swings


def channel(recording: Recording, name: str, may_be_constant: bool = False) -> Vector:
    """Samples (n,) of a channel that identification needs.

    Raises
    ------
    IdentificationError
        If the recording lacks it or is not to be relied on (:mod:`rotflex.doubts`), or if it is too short or constant.
    """
    doubts.require_reliable(recording.doubts)
    if name not in recording:
        raise IdentificationError(
            f"This needs the channel {name!r}; the recording has {', '.join(recording.channels)}."
        )
    return _signal(f"The channel {name!r}", recording[name], may_be_constant)


def _signal(what: str, values: ArrayLike, may_be_constant: bool = False) -> Vector:
    """An array (n,) that identification can use.

    Parameters
    ----------
    what : it is, for the message
    values : as they were given
    may_be_constant : whether it need not move

    Raises
    ------
    IdentificationError
        If it is no vector of finite numbers, or too short or constant.
    """
    signal = finite_vector(what, values, IdentificationError)
    if signal.size < _FEWEST_SAMPLES:
        raise IdentificationError(f"{what} has {signal.size} samples; at least {_FEWEST_SAMPLES} are needed.")
    if not may_be_constant and np.ptp(signal) == 0:
        raise IdentificationError(f"{what} is constant, {signal[0]:g}: nothing moved, or a cable is loose.")
    return signal


@dataclass(frozen=True)
class Estimate:
    """A value and its standard uncertainty, in the same unit."""

    value: float
    uncertainty: float

    def __str__(self) -> str:
        return f"{self.value:.4g} ± {self.uncertainty:.2g}"


@dataclass(frozen=True)
class FrequencyResponse:
    """The ratio of signals to an input against frequency.

    Attributes
    ----------
    f_hz : (n,) frequencies, Hz
    ratio : (n,) complex ratio of output to input; (p, n) for several outputs
    coherence : as ``ratio``, from 0 to 1: how much of the output the input explains
    resolution : Hz; details closer than this are blurred
    input : name of the signal
    output : name of the signal, or names of several
    swept : Hz, from where to where the input was swept, if the recording says it
    """

    f_hz: Vector
    ratio: NDArray[np.complex128]
    coherence: Vector
    resolution: float
    input: str = "theta"
    output: str | tuple[str, ...] = "alpha"
    swept: tuple[float, float] = (0.0, math.inf)

    def to_frd(self, band: tuple[float, float] = (0.0, math.inf)) -> FRD:
        """Convert to python-control, with named signals.

        Parameters
        ----------
        band : Hz, the frequencies to keep. Outside of what was swept nothing is kept, for there is noise alone; keep
            also off its ends by the resolution. 0 Hz is always left out: means were removed

        Returns
        -------
        control.FRD
            Frequencies in rad/s.

        Raises
        ------
        IdentificationError
            If there is no frequency in the band.
        """
        import control

        low, high = max(band[0], self.swept[0]), min(band[1], self.swept[1])
        kept = (self.f_hz > 0) & (self.f_hz >= low) & (self.f_hz <= high)
        if not kept.any():
            raise IdentificationError(
                f"The response has no frequency from {band[0]:g} to {band[1]:g} Hz: it was excited from "
                f"{self.swept[0]:g} Hz on, and ends at {min(self.swept[1], self.f_hz[-1]):g} Hz."
            )
        outputs = [self.output] if isinstance(self.output, str) else [*self.output]
        ratio = self.ratio[..., kept].reshape(len(outputs), 1, -1)
        return control.frd(ratio, self.f_hz[kept] * HZ, inputs=[self.input], outputs=outputs, name="measured")


def frequency_response(
    data: Recording | tuple[ArrayLike, ArrayLike, float],
    input: str = "theta",
    output: str | Sequence[str] = "alpha",
    segment: float | None = None,
) -> FrequencyResponse:
    """Frequency response by the H1 estimate: cross-spectrum over spectrum of the input.

    Segments two thirds of the recording long, closely overlapping, resolve the link's narrow peak (0.1 Hz wide; a 15 s
    sweep gives 0.15 Hz). A segment cuts the sweep off on either side; since the segments follow each other closely,
    that widens the peak without moving it. For the same reason the coherence is high for any pair of signals, and says
    only which frequencies to leave out.

    Parameters
    ----------
    data : a recording, or (input, output, sample time in s)
    input, output : channels of the recording; for arrays, what to call them. Several outputs give a row for each
    segment : length of a segment, s; two thirds of the recording unless given

    Raises
    ------
    IdentificationError
        If a channel is missing, or a signal is too short or constant.
    """
    from scipy.signal import csd, welch

    outputs = (output,) if isinstance(output, str) else tuple(output)
    if isinstance(data, Recording):
        doubts.warn(data.doubts)
        x, rows, dt = channel(data, input), [channel(data, name) for name in outputs], data.sample_time
    else:
        given: Any = [data[1]] if isinstance(output, str) else data[1]
        x, rows, dt = _signal("The input", data[0]), [_signal("The output", row) for row in given], float(data[2])
    if len(rows) != len(outputs):
        raise IdentificationError(f"There are {len(rows)} outputs, and names for {len(outputs)}.")
    for row in rows:
        if x.size != row.size:
            raise IdentificationError(f"The input has {x.size} samples, the output {row.size}; record them together.")
    y = rows[0] if isinstance(output, str) else np.array(rows)
    options = _segments(x.size, dt, segment)
    f, power_x = welch(x, **options)
    power_y = welch(y, **options)[1]
    cross = csd(x, y, **options)[1]
    tiny = np.finfo(float).tiny
    return FrequencyResponse(
        f_hz=f,
        ratio=cross / np.maximum(power_x, tiny),
        coherence=np.abs(cross) ** 2 / np.maximum(power_x * power_y, tiny),
        resolution=_HANN_BANDWIDTH / (options["nperseg"] * dt),
        input=input,
        output=output if isinstance(output, str) else outputs,
        swept=_swept(data.metadata) if isinstance(data, Recording) else (0.0, math.inf),
    )


def _swept(metadata: Mapping[str, Any]) -> tuple[float, float]:
    """Return the frequencies (Hz) that a sweep went through; all, where it is none or does not say it."""
    ends = [metadata.get(name) for name in ("f_start", "f_stop")]
    known = [float(end) for end in ends if isinstance(end, int | float)]
    return (min(known), max(known)) if len(known) == len(ends) else (0.0, math.inf)


def resonance(response: FrequencyResponse, band: tuple[float, float] = SWEEP_BAND) -> Estimate:
    """Natural frequency ω_n (rad/s) from the response of alpha to theta.

    A least-squares fit of ω²/(ω_n² − ω² + 2ζω_n ω j) around the peak, each frequency weighted by its coherence. The
    damping ratio of the fit is not returned: the segments' blur and friction are in it.

    Parameters
    ----------
    response : of alpha to theta, by :func:`frequency_response`
    band : Hz, to look for the peak in; what the sweep went through

    Returns
    -------
    Estimate
        rad/s. The uncertainty is that of the fit, for as many independent values as the resolution leaves. It reads a
        little high: on 3000 virtual benches, with a 15 s sweep, by 0.16 % in the median and by 1.2 % at most.

    Raises
    ------
    IdentificationError
        If the response is of several outputs, is too coarse for the band, or has no resonance in it.
    """
    from scipy.optimize import least_squares

    if response.ratio.ndim > 1:
        raise IdentificationError("A resonance is found in the response of one output; this one has several.")
    f, low, high = response.f_hz, *band
    if response.resolution > (high - low) / 4:
        raise IdentificationError(
            f"The response resolves {response.resolution:.2g} Hz: too coarse to find a peak between {low:g} and "
            f"{high:g} Hz. Record for longer, or use longer segments."
        )
    usable = (f >= low) & (f <= high) & (f > 0) & (response.coherence >= _COHERENT)
    gain = np.where(usable, np.abs(response.ratio), 0.0)
    peak = float(f[np.argmax(gain)])
    nothing = f"There is no resonance between {low:g} and {high:g} Hz"
    advice = "Check that the sweep went through it, and that alpha and theta are what they are called."
    near = usable & (np.abs(f - peak) <= _AROUND_PEAK * peak)
    if not near.sum() > 2 or peak - low < response.resolution / 2 or high - peak < response.resolution / 2:
        raise IdentificationError(f"{nothing}: the response has no peak inside the band. {advice}")
    omega, ratio, coherence = f[near] * HZ, response.ratio[near], response.coherence[near]
    # The relative variance of an H1 estimate goes with (1 − coherence)/coherence.
    weight = np.sqrt(coherence / np.maximum(1 - coherence, 0.01)) / np.abs(ratio)

    def misfit(unknown: Vector) -> Vector:
        omega_n, zeta = unknown
        difference = weight * (omega**2 / (omega_n**2 - omega**2 + 2j * zeta * omega_n * omega) - ratio)
        return np.concatenate([difference.real, difference.imag])

    found = least_squares(misfit, [peak * HZ, 0.03], bounds=(0, np.inf), x_scale=[1.0, 0.01])
    omega_n, zeta = map(float, found.x)
    unexplained = 2 * found.cost / np.sum((weight * np.abs(ratio)) ** 2)
    at_peak = abs(omega_n - peak * HZ) < _AROUND_PEAK / 2 * peak * HZ
    if not (at_peak and zeta < _LARGEST_DAMPING and unexplained < _LARGEST_MISFIT):
        raise IdentificationError(f"{nothing}: the response around {peak:.2f} Hz does not look like one. {advice}")
    repeats = max(1.0, response.resolution / float(f[1] - f[0]))  # neighbouring frequencies say the same
    jacobian = np.asarray(found.jac)
    covariance = 2 * found.cost / (jacobian.shape[0] - 2) * repeats * np.linalg.inv(jacobian.T @ jacobian)
    return Estimate(omega_n, math.sqrt(covariance[0, 0]))


# --- free decay ------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class FreeDecay:
    """What a free swing of the link tells.

    Attributes
    ----------
    omega_n : natural frequency, rad/s
    zeta : damping ratio of the viscous damping alone
    peak_times, peaks : (n,) when the link turned round, s, and where, rad: what was used
    """

    omega_n: Estimate
    zeta: Estimate
    peak_times: Vector
    peaks: Vector


def logarithmic_decrement(
    data: Recording | ArrayLike, dt: float | None = None, floor: float | None = None
) -> FreeDecay:
    """Natural frequency and damping from a free decay (Section 2.1.5).

    Viscous damping makes each swing smaller than the last by the same *ratio* r = exp(−πζ/√(1 − ζ²)); Coulomb friction
    by the same *amount*, for it shifts the middle c of the half swing, up or down with the direction:

        x_{k+1} − c = −r (x_k − c).

    The plain decrement ln(x_k/x_{k+2}) takes the two for one and comes out too large, the more so the smaller the
    swing. Here r and both c are fitted to all turning points. Friction does not change the period.

    A servo that is held by a position loop gives way a little. If the recording has theta, the part of it that swings
    with alpha is allowed for, in ω_n (2 to 6 % on the virtual bench) and in ζ (most of it), and a part of the
    correction goes into the uncertainty, since the servo sticks in small swings.

    Parameters
    ----------
    data : a recording with alpha (what comes before the servo stands is left out), or alpha itself, (n,) rad
    dt : sample time, s, for an array
    floor : smallest swing to use, rad; a twentieth of the largest, or six steps of the encoder, unless given

    Raises
    ------
    IdentificationError
        If there are fewer than six turning points above the floor, or the swing does not decay.
    """
    if isinstance(data, Recording):
        doubts.warn(data.doubts)
        x, dt = channel(data, "alpha"), data.sample_time
        theta = data["theta"] if "theta" in data else np.zeros(x.size)
        standing = max(_STANDS_WITHIN * np.ptp(theta), _GIVES_WAY * np.abs(x).max())
        moving = np.abs(theta - theta[-1]) > standing
        start = int(np.flatnonzero(moving)[-1]) + 1 if moving.any() else 0
    else:
        x, theta, start = _signal("alpha", data), np.zeros(np.size(data)), 0
    if dt is None or not dt > 0:
        raise IdentificationError(f"The sample time is {dt!r}; give dt, in s, with an array.")
    times, peaks = _turning_points(x[start:], dt, floor)
    ratio = _ratio_of_swings(peaks)
    decrement = -math.log(ratio.value)  # of half a period
    zeta = decrement / math.hypot(math.pi, decrement)
    # Wide swings count more, as they do where the servo's part is found: in small ones the servo sticks.
    (half_period, _first), spread = np.polyfit(np.arange(times.size), times, 1, w=np.abs(peaks), cov=True)
    omega_d = math.pi / half_period
    own = omega_d * math.sqrt(spread[0, 0]) / half_period, ratio.uncertainty / (math.pi * ratio.value)
    held = omega_d / math.sqrt(1 - zeta**2), zeta
    used = slice(start + round(times[0] / dt), start + round(times[-1] / dt) + 1)
    clamped = _with_servo_clamped(complex(-zeta * held[0], omega_d), x[used], theta[used], dt)
    omega_n, zeta_n = (
        Estimate(value, math.hypot(uncertainty, _UNSURE_OF_SERVO * (value - uncorrected)))
        for value, uncertainty, uncorrected in zip(clamped, own, held, strict=True)
    )
    return FreeDecay(omega_n, zeta_n, start * dt + times, peaks)


def _ratio_of_swings(peaks: Vector) -> Estimate:
    """The ratio r of :func:`logarithmic_decrement`, with the middles of upward and downward half swings left free."""
    from scipy.optimize import least_squares

    upwards = np.diff(peaks) > 0

    def misfit(unknown: Vector) -> Vector:
        ratio, middle_up, middle_down, first = unknown
        swings = [first]
        for middle in np.where(upwards, middle_up, middle_down):
            swings.append(middle - ratio * (swings[-1] - middle))
        return np.array(swings) - peaks

    found = least_squares(misfit, [0.95, 0.0, 0.0, peaks[0]], x_scale="jac")
    ratio, jacobian = float(found.x[0]), np.asarray(found.jac)
    if not 0 < ratio < 1:
        raise IdentificationError("The swings do not become smaller: this is no free decay.")
    covariance = 2 * found.cost / (peaks.size - found.x.size) * np.linalg.inv(jacobian.T @ jacobian)
    return Estimate(ratio, math.sqrt(covariance[0, 0]))


def _turning_points(x: Vector, dt: float, floor: float | None) -> tuple[Vector, Vector]:
    """Times (s) and values of the extremes, to either side by turns, refined by parabolas."""
    swing = x - np.median(x)
    changes = np.abs(np.diff(x))
    if floor is None:
        step = float(changes[changes > 0].min()) if changes.any() else 0.0
        floor = max(_FLOOR * float(np.abs(swing).max()), _FLOOR_STEPS * step)
    beyond = np.flatnonzero(np.abs(swing) > floor)
    lobes = np.split(beyond, np.flatnonzero(np.diff(np.sign(swing[beyond]))) + 1)
    heights = [np.abs(swing[lobe]) for lobe in lobes if lobe.size]
    tops = [int(np.mean(lobe[high == high.max()])) for lobe, high in zip(lobes, heights, strict=False)]
    half_width = max(2, round(_PARABOLA * float(np.median(np.diff(tops))))) if len(tops) > 1 else 2
    around = np.arange(-half_width, half_width + 1)
    points = []
    for top in tops:
        if top >= half_width and top + half_width < x.size:
            a, b, c = np.polyfit(around * dt, x[top + around], 2)
            if abs(b) < 2 * abs(a) * half_width * dt:  # else the record begins or ends on a slope
                points.append((top * dt - b / (2 * a), c - b**2 / (4 * a)))
    if len(points) < _FEWEST_PEAKS:
        raise IdentificationError(
            f"Only {len(points)} turning points beyond {floor / DEG:.2g} deg; {_FEWEST_PEAKS} are needed. Let "
            "the link swing wider, or for longer, with the servo held."
        )
    return np.array([time for time, _value in points]), np.array([value for _time, value in points])


def _with_servo_clamped(s: complex, alpha: Vector, theta: Vector, dt: float) -> tuple[float, float]:
    """ω_n and ζ of a link that decays like exp(st) while the servo swings along.

    Both solve s²(alpha + theta) + 2ζω_n s alpha + ω_n² alpha = 0, with alpha and theta the phasors of what swings.
    """
    t = np.arange(alpha.size) * dt
    basis = np.column_stack([np.cos(s.imag * t), np.sin(s.imag * t), np.ones(t.size)])
    (cosine, sine, _offset) = np.linalg.lstsq(basis, np.column_stack([alpha, theta]), rcond=None)[0]
    phasors = cosine - 1j * sine
    inertia = s**2 * (1 + phasors[1] / phasors[0])
    damping = -inertia.imag / s.imag  # 2ζω_n
    omega_n = math.sqrt(-inertia.real - damping * s.real)
    return omega_n, damping / (2 * omega_n)


def _segments(samples: int, dt: float, segment: float | None) -> dict[str, Any]:
    """How scipy.signal should cut ``samples`` into segments."""
    if not (math.isfinite(dt) and dt > 0):
        raise IdentificationError(f"The sample time is {dt!r}; it must be a positive number, in s.")
    length = round(samples * _SEGMENT if segment is None else segment / dt)
    if not _FEWEST_SAMPLES // 2 <= length <= samples:
        raise IdentificationError(
            f"Segments of {length * dt:g} s do not fit a signal of {samples * dt:g} s; choose between "
            f"{_FEWEST_SAMPLES // 2 * dt:g} s and its length."
        )
    return {
        "fs": 1 / dt,
        "window": "hann",
        "nperseg": length,
        "noverlap": length - max(1, round(length * _STRIDE)),
        "nfft": _ZERO_PADDING * 2 ** math.ceil(math.log2(length)),
        "detrend": "constant",
    }
