"""What the recordings of a student's own bench say of its natural frequency, read this way or that.

There are several honest ways to read it, and they do not agree: where a sweep's spectrum is highest depends on how the
sweep moved through the resonance, a window moves that towards the middle of the sweep, and in a free swing the held
servo gives way. A tolerance around the truth that is wide enough for all of them is wide enough for other benches'
numbers as well. So each way is gone on the student's own bench, and has a narrow place of its own.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotflex.errors import IdentificationError
from rotflex.identification import SWEEP_BAND, frequency_response, logarithmic_decrement
from rotflex.recording import Recording
from rotflex.units import HZ

from . import tolerances
from .true_bench import TrueBench

Vector = NDArray[np.float64]
_STANDS_WITHIN, _GIVES_WAY = 0.05, 0.1  # of its travel, of alpha: a servo so near to where it ends stands
_COUNTED = (4, 10)  # swings, from the first on
_FROM = (0.1, 0.2)  # s: with the first swing, while the servo still settles, or without; its give is in the widest ones
_ZEROS = (0, 1, 2, 16)  # appended: see _peaks
_WINDOWS: dict[str, Callable[[int], Vector]] = {"": np.ones, "Hann": np.hanning, "Hamming": np.hamming}
_KEPT = 32  # benches, for the next answer that is held against the same


class Span(NamedTuple):
    """A stretch of frequencies (rad/s) that is right, and what is read there.

    ``rounds``: a number of few digits may be beyond its ends by what was lost when it was rounded. That is so of the
    ways that the course teaches; on all stretches, it would let every third rounded number of a friend pass.
    """

    low: float
    high: float
    what: str
    rounds: bool = False


def spans(bench: TrueBench, run: int) -> Iterator[Span]:
    """Where readings of a bench are, whichever way they were made.

    Parameters
    ----------
    bench : the student's own
    run : of the sweep
    """
    yield around(bench.omega_n, tolerances.NEAR_TRUE, "the natural frequency of your bench", rounds=True)
    yield from of_sweep(bench, run, tolerances.BY_PROGRAM)
    for peak in (*_peaks(bench, run, over="theta"), _response_peak(bench, run)):
        yield around(peak, tolerances.BY_PROGRAM, "where the ratio of your bench has its peak", rounds=True)
    plotted = _peaks(bench, run)[1]
    yield around(plotted, tolerances.BY_EYE, "where the sweep of your bench has its peak")
    for window in filter(None, _WINDOWS):
        for peak in _peaks(bench, run, window):
            yield around(peak, tolerances.BY_PROGRAM, "where the sweep of your bench, windowed, has its peak")
    # This comes last: at a real bench the free swing may be missing, and without it nothing below is known.
    for omega in _decrement(bench):
        yield around(omega, tolerances.BY_PROGRAM, "what your bench's free swing tells, less the servo's part", True)
    swings = _swings(bench)
    low, high = around(min(swings), tolerances.BY_SWINGS), around(max(swings), tolerances.BY_SWINGS)
    yield Span(low.low, high.high, "how the link of your bench swings freely, with the servo held")


def of_sweep(bench: TrueBench, run: int, rtol: float) -> Iterator[Span]:
    """Where the spectrum of the sweep is highest, with no zeros appended, some, or many."""
    for peak in _peaks(bench, run):
        yield around(peak, rtol, "where the sweep of your bench has its peak", rounds=True)


def place(omega: float, among: Iterable[Span]) -> Span | None:
    """The first of some stretches that a frequency (rad/s) lies in, to the digits that it is given to."""
    rounding = half_a_digit(omega)
    for span in among:
        room = rounding if span.rounds else 0.0
        if span.low - room <= omega <= span.high + room:
            return span
    return None


def half_a_digit(value: float) -> float:
    """How much was lost when a number was rounded to the fewest digits; 0 where it has more."""
    if not (math.isfinite(value) and value):
        return 0.0
    step = 10.0 ** (math.floor(math.log10(abs(value))) + 1 - tolerances.FEWEST_DIGITS)
    return step / 2 if step and math.isclose(round(value / step) * step, value, rel_tol=1e-9) else 0.0


def around(value: float, rtol: float, what: str = "", rounds: bool = False) -> Span:
    """The stretch that is so near to a frequency."""
    return Span((1 - rtol) * value, (1 + rtol) * value, what, rounds)


@lru_cache(maxsize=(len(_WINDOWS) + 1) * _KEPT)
def _peaks(bench: TrueBench, run: int, window: str = "", over: str = "") -> tuple[float, ...]:
    """rad/s: where the amplitude spectrum of the deflection, over another's or by itself, is highest within the sweep.

    Zeros: none, up to a power of two, and to twice and 16 times that.
    """
    sweep = bench.sweep(run)
    length = sweep["alpha"].size
    power = 2 ** math.ceil(math.log2(length))
    channels = [_WINDOWS[window](length) * (sweep[name] - sweep[name].mean()) for name in ("alpha", over) if name]
    return tuple(HZ * _highest(channels, sweep.sample_time, zeros * power or length) for zeros in _ZEROS)


def _highest(channels: Sequence[Vector], dt: float, length: int) -> float:
    """Hz: where the amplitude spectrum of the first, over that of a second if there is one, is highest."""
    f = np.fft.rfftfreq(length, dt)[1:]
    amplitude, *over = (np.abs(np.fft.rfft(x, length))[1:] for x in channels)
    return _highest_of(f, amplitude / over[0] if over else amplitude)


def _highest_of(f: NDArray[np.floating[Any]], amplitude: NDArray[np.floating[Any]]) -> float:
    low, high = SWEEP_BAND
    swept = (f >= low) & (f <= high)
    return float(f[swept][np.argmax(amplitude[swept])])


@lru_cache(maxsize=_KEPT)
def _response_peak(bench: TrueBench, run: int) -> float:
    """rad/s: where the ratio is highest as ``identification.frequency_response`` has it."""
    response = frequency_response(bench.sweep(run))
    return HZ * _highest_of(response.f_hz, np.abs(response.ratio))


@lru_cache(maxsize=_KEPT)
def _decrement(bench: TrueBench) -> tuple[float, ...]:
    """rad/s: as ``identification.logarithmic_decrement`` has it; nothing where it finds no decay."""
    with contextlib.suppress(IdentificationError):
        return (logarithmic_decrement(bench.decay).omega_n.value,)
    return ()


@lru_cache(maxsize=_KEPT)
def _swings(bench: TrueBench) -> tuple[float, ...]:
    """rad/s: the free swing by its spectrum, once the servo stands, and by counting swings from then on or at once."""
    return tuple(_read_swings(bench.decay))


def _read_swings(decay: Recording) -> Iterator[float]:
    theta, alpha, dt = decay["theta"], decay["alpha"], decay.sample_time
    standing = max(_STANDS_WITHIN * np.ptp(theta), _GIVES_WAY * np.abs(alpha).max())
    stands = int(np.flatnonzero(np.abs(theta - theta[-1]) > standing)[-1]) + 1
    rest = np.median(alpha[-round(1 / dt) :])
    x = alpha[stands:] - rest
    for zeros in (2, 16):
        length = zeros * 2 ** math.ceil(math.log2(x.size))
        yield HZ * _highest([x - x.mean()], dt, length)
    for start in (*(round(begin / dt) for begin in _FROM), stands):
        upwards = _upwards(alpha[start:] - rest)
        for count in _COUNTED:
            if upwards.size > count:
                yield HZ * count / ((upwards[count] - upwards[0]) * dt)


def _upwards(x: Vector) -> NDArray[np.int_]:
    """The samples at which it passes zero upwards."""
    sides = np.flatnonzero(np.sign(x))
    return sides[1:][np.diff(np.sign(x[sides])) > 0]
