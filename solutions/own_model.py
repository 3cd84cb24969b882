"""The model that the student's own answers give: their matrices, and what their own function makes of their numbers.

Of a function only its outputs on drawn parameters are there (2.13). Each entry of a model that somebody derives is a
sum of one or two terms such as K_s/J_eq or B_eq/J_eq, with some factors. Three drawn sets of parameters settle which
terms and which factors these are, with a set to spare; and so what the function gives for other numbers.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labcourse.grading.verdicts import Case, NothingFollows, OwnAnswers
from rotflex.config import Servo
from rotflex.course.probes import PLANT_PARAMETERS
from rotflex.simulation import with_actuator

from .own_answers import usable

Array = NDArray[Any]
_EXACT = 1e-4  # relative: outputs are kept to six digits


def own_voltage_model(own: OwnAnswers, servo: Servo) -> tuple[Array, Array]:
    """A and B with the motor voltage as input, from the student's own matrices. Raises LookupError without them."""
    return with_actuator(usable(own, "2.14", "A"), np.reshape(usable(own, "2.14", "B"), (4, 1)), servo)


def from_own_function(case: Case, matrix: str) -> Array:
    """What the student's own function (2.13) gives for their own stiffness and inertia: one of A, B, C, D.

    Raises
    ------
    LookupError
        If there is no such function, or its entries are no sums of terms of a model.
    """
    outputs = [output["ABCD".index(matrix)] for output in case.own("2.13", "state_space")]
    inputs = PLANT_PARAMETERS.inputs(case.probe_seed)
    here = (_stiffness(case), _inertia(case), case.bench.servo.J_eq, case.bench.servo.B_eq)
    shape = np.shape(outputs[0])
    entries = [_entry([float(np.ravel(one)[i]) for one in outputs], inputs, here) for i in range(np.size(outputs[0]))]
    found = np.reshape(entries, shape)
    if matrix in "AB" and not np.any(found):
        raise NothingFollows(f"Your own function of question 2.13 gives nothing but zeros for {matrix}.")
    return found


def _stiffness(case: Case) -> float:
    try:
        return float(usable(case.own, "2.12", "K_s"))
    except LookupError:
        return float(case.bench.K_s)


def _inertia(case: Case) -> float:
    try:
        return float(usable(case.own, "2.12", "J_l"))
    except LookupError:
        return float(case.bench.J_l)


def _terms(K_s: float, J_l: float, J_eq: float, B_eq: float) -> list[float]:
    """What an entry may be made of."""
    inertias = (J_eq, J_l, J_eq + J_l)
    numerators = (K_s, B_eq, 1.0)
    return [1.0, K_s, B_eq, *(n / J for n in numerators for J in inertias), J_eq, J_l]


def _entry(values: Sequence[float], inputs: Sequence[tuple[float, ...]], here: tuple[float, ...]) -> float:
    """Return an entry of a matrix for the parameters `here`, from its values for other parameters.

    The entry is taken for a sum of one or two terms, and of those that fit the values the closest is used.
    """
    wanted = np.array(values)
    if not np.any(wanted):
        return 0.0
    drawn, there = np.array([_terms(*one) for one in inputs]), np.array(_terms(*here))
    for count in (1, 2):
        fits = []
        for chosen in combinations(range(len(there)), count):
            columns = list(chosen)
            factors = np.linalg.lstsq(drawn[:, columns], wanted, rcond=None)[0]
            error = np.max(np.abs(drawn[:, columns] @ factors - wanted) - _EXACT * np.abs(wanted))
            fits.append((error, float(there[columns] @ factors)))
        error, entry = min(fits)
        if error <= 0:
            return entry
    raise LookupError("no sum of terms of a model")
