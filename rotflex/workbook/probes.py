"""Probes: the inputs on which a student's function is tried, and what is kept of its outputs.

A function cannot be stored as plain data, so it is called when it is answered, on inputs drawn from a seed. Grading
draws the same inputs (with a seed that nobody knew before) and compares the outputs outside. What is kept:

* "compound sines", for ``spectrum(x, dt) -> (f_hz, amplitude)``. Four signals: x is a sum of three sines of random
  amplitude and phase. The first three have a power of two of samples and sines on exact bins; the fourth has 7500
  samples every 2 ms and sines between the bins. Kept for each: ``[f, a]``, the pairs with 0 <= f <= 10 Hz in their
  order; where they are more than 600, those at the indices of ``plain.thin``; rounded to 6 significant digits.
* "plant parameters", for ``state_space(K_s, J_l, J_eq, B_eq) -> (A, B, C, D)``. Three sets of parameters.
  Kept for each: ``[A, B, C, D]`` as lists of rows, rounded to 6 significant digits.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotflex.config import one_of
from rotflex.errors import AnswerError
from rotflex.workbook.plain import FormError, NotAnswered, read_list, read_matrix, read_vector, rounded, thin

HIGHEST_FREQUENCY = 10.0  #: Hz
MOST_POINTS = 600
_SIGNALS = ((2048, 0.005), (4096, 0.002), (1024, 0.01), (7500, 0.002))
_PARAMETER_SETS = 3
_SHAPES = {"A": (4, 4), "B": (4, 1), "C": (2, 4), "D": (2, 1)}


@dataclass(frozen=True)
class Probe:
    """Inputs for a function and the form of its outputs.

    Attributes
    ----------
    signature : of the function, for messages
    count : how many inputs there are
    draw : the inputs, a list of argument tuples, from a numpy Generator; calling the probe does the same
    keep : an output as plain data; raises FormError or NotAnswered where it is none
    read : an output's plain data as a tuple of arrays; raises AnswerError where it is none
    """

    signature: str
    count: int
    draw: Callable[[np.random.Generator], list[tuple[Any, ...]]]
    keep: Callable[[Any], list[Any]]
    read: Callable[[Any], tuple[NDArray[np.float64], ...]]

    def __call__(self, rng: np.random.Generator) -> list[tuple[Any, ...]]:
        return self.draw(rng)


def inputs(name: str, seed: int) -> list[tuple[Any, ...]]:
    """The argument tuples of a probe for a probe seed; probes of one seed do not depend on each other.

    Raises
    ------
    ConfigurationError
        If there is no probe of that name.
    """
    probe = PROBES[one_of("probe", name, PROBES)]
    return probe(np.random.default_rng([seed, zlib.crc32(name.encode())]))


# --- compound sines ---------------------------------------------------------------------------------------------------


def _compound_sines(rng: np.random.Generator) -> list[tuple[Any, ...]]:
    signals = []
    for samples, dt in _SIGNALS:
        t = dt * np.arange(samples)
        on_bins = samples & (samples - 1) == 0
        # One sine in each third of 1 to 8.5 Hz, apart enough not to touch each other.
        f = rng.uniform([1.0, 3.5, 6.0], [2.5, 5.0, 8.5])
        if on_bins:
            f = np.round(f * samples * dt) / (samples * dt)
        amplitude = rng.uniform(0.3, 3.0, 3)
        phase = rng.uniform(0, 2 * np.pi, 3)
        signals.append((np.sin(2 * np.pi * np.outer(t, f) + phase) @ amplitude, dt))
    return signals


def _keep_spectrum(output: Any) -> list[Any]:
    f, amplitude = _pieces(output, ("f_hz", "amplitude"))
    f, amplitude = f.ravel(), amplitude.ravel()
    if f.size != amplitude.size:
        raise FormError(
            f"f_hz has {f.size} values and amplitude has {amplitude.size}: keep one half of the spectrum, "
            "with a frequency for each value"
        )
    inside = (f >= 0) & (f <= HIGHEST_FREQUENCY)
    if inside.sum() < 2:
        raise FormError("there is nothing between 0 and 10 Hz in it: is f_hz in hertz?")
    kept = thin(int(inside.sum()), MOST_POINTS)
    return [rounded(f[inside][kept]), rounded(amplitude[inside][kept])]


def _read_spectrum(data: Any) -> tuple[NDArray[np.float64], ...]:
    pair = read_list("A spectrum", data, 2, 2)
    f = read_vector("Frequencies", pair[0], 2, MOST_POINTS)
    return f, read_vector("Amplitudes", pair[1], f.size, f.size)


# --- plant parameters -------------------------------------------------------------------------------------------------


def _plant_parameters(rng: np.random.Generator) -> list[tuple[Any, ...]]:
    lowest, highest = [0.8, 2e-3, 1e-3, 2e-3], [2.0, 5e-3, 4e-3, 2e-2]
    return [tuple(rng.uniform(lowest, highest).tolist()) for _ in range(_PARAMETER_SETS)]


def _keep_state_space(output: Any) -> list[Any]:
    if all(hasattr(output, name) for name in _SHAPES):  # a state-space object of a library
        output = tuple(getattr(output, name) for name in _SHAPES)
    kept = []
    for (name, shape), piece in zip(_SHAPES.items(), _pieces(output, tuple(_SHAPES)), strict=True):
        vector = 1 in shape
        if piece.shape != shape and not (vector and piece.size == max(shape) and piece.ndim <= 2):
            raise FormError(
                f"{name} is {' × '.join(map(str, piece.shape)) or 'a single number'}, not {shape[0]} × {shape[1]}"
            )
        kept.append([rounded(row) for row in piece.reshape(shape)])
    return kept


def _read_state_space(data: Any) -> tuple[NDArray[np.float64], ...]:
    pieces = read_list("A state-space model", data, len(_SHAPES), len(_SHAPES))
    return tuple(read_matrix(name, piece, shape) for (name, shape), piece in zip(_SHAPES.items(), pieces, strict=True))


def _pieces(output: Any, names: tuple[str, ...]) -> list[NDArray[np.float64]]:
    """A function's output as so many arrays of finite numbers."""
    wanted = f"it should return ({', '.join(names)})"
    if output is None or output is Ellipsis:
        raise NotAnswered("nothing yet")
    if not isinstance(output, tuple | list) or len(output) != len(names):
        raise FormError(f"{wanted}; it returned a {type(output).__name__}" + _how_many(output))
    if any(piece is None or piece is Ellipsis for piece in output):
        raise NotAnswered("nothing yet")
    pieces = []
    for name, piece in zip(names, output, strict=True):
        array = _array(piece)
        if array is None:
            raise FormError(f"{wanted}, all numbers; {name} is not")
        if array.dtype.kind == "c":
            raise FormError(f"{name} is complex: take the magnitude, or drop an imaginary part that is zero")
        if not np.isfinite(array).all():
            raise FormError(f"{name} has values that are not finite (NaN or infinite)")
        pieces.append(array.astype(np.float64))
    return pieces


def _how_many(output: Any) -> str:
    return f" of {len(output)}" if isinstance(output, tuple | list) else ""


def _array(piece: Any) -> NDArray[Any] | None:
    """A piece as an array of numbers, or None."""
    try:
        array = np.asarray(piece)
        if array.dtype.kind == "O":  # sympy's numbers and the like
            array = array.astype(np.float64)
    except (TypeError, ValueError):
        return None
    return array if array.dtype.kind in "iufc" else None


PROBES = {
    "compound sines": Probe("spectrum(x, dt)", len(_SIGNALS), _compound_sines, _keep_spectrum, _read_spectrum),
    "plant parameters": Probe(
        "state_space(K_s, J_l, J_eq, B_eq)", _PARAMETER_SETS, _plant_parameters, _keep_state_space, _read_state_space
    ),
}


def check_seed(text: str) -> int:
    """A probe seed from text (an environment variable).

    Raises
    ------
    AnswerError
        If it is not a non-negative integer.
    """
    if not text.isascii() or not text.isdigit() or len(text) > 30:
        raise AnswerError(f"The probe seed should be a non-negative integer; it is {text[:40]!r}.")
    return int(text)
