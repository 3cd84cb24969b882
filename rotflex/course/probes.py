"""The probes of this course: inputs for students' functions, and what is kept of their outputs.

* "compound sines", for ``spectrum(x, dt) -> (f_hz, amplitude)``. Four signals: x is a sum of three sines of random
  amplitude and phase. The first three have a power of two of samples and sines on exact bins; the fourth has 7500
  samples every 2 ms and sines between the bins. Kept for each: ``[f, a]``, the pairs with 0 <= f <= 10 Hz in their
  order; where they are more than 600, those at the indices of ``json_values.thin``; rounded to 6 significant digits.
* "plant parameters", for ``state_space(K_s, J_l, J_eq, B_eq) -> (A, B, C, D)``. Three sets of parameters. D may be 0,
  and C and D may have rows for all states: the first two are kept.
  Kept for each: ``[A, B, C, D]`` as lists of rows, rounded to 6 significant digits.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from labcourse.answers.json_values import FormError, read_list, read_matrix, read_vector, rounded, thin
from labcourse.answers.parts import Probe, pieces

HIGHEST_FREQUENCY = 10.0  #: Hz
MOST_POINTS = 600
_SIGNALS = ((2048, 0.005), (4096, 0.002), (1024, 0.01), (7500, 0.002))
_PARAMETER_SETS = 5  # of fewer, wrong terms of a model may fit by chance (`solutions/own_model.py`)
_SHAPES = {"A": (4, 4), "B": (4, 1), "C": (2, 4), "D": (2, 1)}


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
    f, amplitude = pieces(output, ("f_hz", "amplitude"))
    f, amplitude = f.ravel(), amplitude.ravel()
    if f.size != amplitude.size:
        raise FormError(
            f"f_hz has {f.size} values and amplitude has {amplitude.size}: keep one half of the spectrum, with a "
            "frequency for each value"
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
    return [tuple(rng.uniform(lowest, highest).tolist()) for _set in range(_PARAMETER_SETS)]


def _of_two_outputs(name: str, piece: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return D in full for 0, and of C and D for all states the rows for theta and alpha."""
    shape, states = _SHAPES[name], _SHAPES["A"][0]
    if name == "D" and piece.size == 1 and not piece.any():
        return np.zeros(shape)
    if name in "CD" and max(piece.shape, default=0) == states and piece.size == states * shape[1]:
        return piece.reshape(states, shape[1])[: shape[0]]
    return piece


def _keep_state_space(output: Any) -> list[Any]:
    if all(hasattr(output, name) for name in _SHAPES):  # a state-space object of a library
        if getattr(output, "dt", None):
            raise FormError(f"it returns a model in discrete time ({output.dt} s): one in continuous time is asked for")
        output = tuple(getattr(output, name) for name in _SHAPES)
    kept = []
    for (name, shape), returned in zip(_SHAPES.items(), pieces(output, tuple(_SHAPES)), strict=True):
        piece = _of_two_outputs(name, returned)
        vector = 1 in shape
        if piece.shape != shape and not (vector and piece.size == max(shape) and piece.ndim <= 2):
            given = " × ".join(map(str, piece.shape)) or "a single number"
            outputs = ", for theta and alpha" if name in "CD" else ""
            raise FormError(f"{name} is {given}, not {shape[0]} × {shape[1]}{outputs}")
        kept.append([rounded(row) for row in piece.reshape(shape)])
    return kept


def _read_state_space(data: Any) -> tuple[NDArray[np.float64], ...]:
    blocks = read_list("A state-space model", data, len(_SHAPES), len(_SHAPES))
    return tuple(read_matrix(name, piece, shape) for (name, shape), piece in zip(_SHAPES.items(), blocks, strict=True))


COMPOUND_SINES = Probe(
    "compound sines", "spectrum(x, dt)", len(_SIGNALS), _compound_sines, _keep_spectrum, _read_spectrum
)
PLANT_PARAMETERS = Probe(
    "plant parameters",
    "state_space(K_s, J_l, J_eq, B_eq)",
    _PARAMETER_SETS,
    _plant_parameters,
    _keep_state_space,
    _read_state_space,
)
