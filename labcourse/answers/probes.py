"""Probes: the inputs on which a student's function is tried, and what is stored of its outputs.

A function cannot be stored as plain data, so it is called when it is answered, on inputs drawn from a seed. Grading
draws the same inputs (with a seed that nobody knew before) and compares the outputs outside the sandbox. A course
defines its probes.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labcourse.answers.json_values import FormError, check_given, read_vector, rounded


@dataclass(frozen=True)
class Probe:
    """Inputs for a function and the form of its outputs.

    Attributes
    ----------
    name : of the probe; with the seed, it fixes the inputs
    signature : of the function, for messages
    count : how many inputs there are
    draw : the inputs, a list of argument tuples, from a numpy Generator
    keep : an output as plain data; raises FormError or NotAnswered where it is none
    read : an output's plain data as a tuple of arrays; raises AnswerError where it is none
    """

    name: str
    signature: str
    count: int
    draw: Callable[[np.random.Generator], list[tuple[Any, ...]]]
    keep: Callable[[Any], list[Any]]
    read: Callable[[Any], tuple[NDArray[np.float64], ...]]

    @classmethod
    def scalar(cls, signature: str, span: tuple[float, float], returns: str, count: int = 8) -> Probe:
        """Try a function of one number that gives one number.

        Parameters
        ----------
        signature : of the function, as in "outflow(h)"; also the name of the probe
        span : from which the inputs are drawn
        returns : what it gives, with its unit, as in "q in m³/s"
        count : how many inputs there are
        """

        def draw(rng: np.random.Generator) -> list[tuple[Any, ...]]:
            return [(value,) for value in rng.uniform(*span, count).tolist()]

        def keep(output: Any) -> list[Any]:
            (array,) = pieces((output,), (returns,))
            if array.size != 1:
                raise FormError(f"it should return one number, {returns}; it returned {array.size}")
            return rounded(array.ravel())

        def read(data: Any) -> tuple[NDArray[np.float64], ...]:
            return (read_vector(signature, data, 1, 1),)

        return cls(signature, signature, count, draw, keep, read)

    def inputs(self, seed: int) -> list[tuple[Any, ...]]:
        """Return the argument tuples for a probe seed; probes of one seed do not depend on each other."""
        return self.draw(np.random.default_rng([seed, zlib.crc32(self.name.encode())]))


def pieces(output: Any, names: tuple[str, ...]) -> list[NDArray[np.float64]]:
    """Return a function's output as so many arrays of finite numbers.

    Raises
    ------
    NotAnswered
        If there is nothing yet.
    FormError
        If it is anything else; the message is a hint for the student.
    """
    wanted = f"it should return ({', '.join(names)})"
    check_given(output)
    if isinstance(output, np.ndarray) and output.ndim > 1 and len(output) == len(names):  # its rows
        output = list(output)
    if not isinstance(output, tuple | list) or len(output) != len(names):
        length = f" of {len(output)}" if isinstance(output, tuple | list) else ""
        raise FormError(f"{wanted}; it returned a {type(output).__name__}{length}")
    arrays = []
    for name, piece in zip(names, output, strict=True):
        check_given(piece)
        array = _array(piece)
        if array is None:
            raise FormError(f"{wanted}, all numbers; {name} is not")
        if array.dtype.kind == "c":
            raise FormError(f"{name} is complex: take the magnitude, or drop an imaginary part that is zero")
        if not np.isfinite(array).all():
            raise FormError(f"{name} has values that are not finite (NaN or infinite)")
        arrays.append(array.astype(np.float64))
    return arrays


def _array(piece: Any) -> NDArray[Any] | None:
    """Return a piece as an array of numbers, or None."""
    try:
        array = np.asarray(piece)
        if array.dtype.kind == "O":  # sympy's numbers and the like
            array = array.astype(np.float64)
    except (TypeError, ValueError):
        return None
    return array if array.dtype.kind in "iufc" else None
