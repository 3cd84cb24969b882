"""Experiments run again for marking, with the student's own model and gain.

Where these are such that nothing can be recorded (the loop runs away, the bench stops at a limit, the servo does not
follow), the right design for the bench stands in, as it does for answers that were not given; and so does the gain with
which the notebooks went on then (:mod:`rotflex.course.spare_design`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labcourse.grading.marking.checks import EVALUATION_ERRORS, claimed_run
from labcourse.grading.verdicts import Case
from rotflex.course import spare_design
from rotflex.errors import RotflexError
from rotflex.hil.student_benches import FIRST_RUN
from rotflex.recording import Recording

from .design_checks import Design
from .own_answers import usable
from .own_model import own_voltage_model

Vector = NDArray[np.float64]
#: (case, metadata of the student's recording) → the runs any of which it may be.
Again = Callable[[Case, dict[str, Any]], list[Recording]]


def right_design(case: Case) -> Design:
    """The design that is right for the student's bench."""
    return Design(case.bench.servo, case.bench.joint, case.bench.K_s)


def given_gain(case: Case) -> Vector | None:
    """The student's gain (3.8, else 3.10); None if they gave none."""
    for question in ("3.8", "3.10"):
        try:
            return np.reshape(usable(case.own, question, "K"), 4)
        except LookupError:
            continue
    return None


def own_gain(case: Case) -> Vector:
    """The student's gain, else the one that is right for their bench."""
    given = given_gain(case)
    return np.ravel(right_design(case).K) if given is None else given


def own_model(case: Case) -> tuple[Vector, Vector]:
    """The student's model with the voltage as input, else the one that is right for their bench."""
    try:
        return own_voltage_model(case.own, case.bench.servo)
    except EVALUATION_ERRORS:
        return right_design(case).voltage_model


def simulated_again(case: Case, metadata: dict[str, Any]) -> list[Recording]:
    """The simulation of 3.11 with the student's model and gain: either fidelity, with the limit or without.

    If that loop is of no use, simulations with a gain that stands in, and of the right design, are as good.
    """
    A, B = own_model(case)
    K = own_gain(case)
    runs: list[Recording] = list(case.bench.simulations(A, B, K))
    if not case.bench.holds(A, B, K):
        spare = spare_design.stand_in(A, B)
        if spare is not None:
            runs += case.bench.simulations(A, B, np.ravel(spare))
        ideal = right_design(case)
        runs += case.bench.simulations(*ideal.voltage_model, np.ravel(ideal.K))
    return runs


def torque_simulated(case: Case, metadata: dict[str, Any]) -> list[Recording]:
    """The same with the torque for the voltage: the student's matrices of 2.14 as they are."""
    try:
        A, B = usable(case.own, "2.14", "A"), usable(case.own, "2.14", "B")
    except LookupError:
        return []
    runs: list[Recording] = case.bench.simulations(A, B, own_gain(case))
    return runs


def run_again(feedback: str) -> Again:
    """The experiment of 3.13 or 3.15 on the student's bench, with the gain that their recording says, or their own."""

    def again(case: Case, metadata: dict[str, Any]) -> list[Recording]:
        number = run_of(metadata)
        runs = list(_runs(case, feedback, number, [*_said(metadata), own_gain(case)]))
        if any(spare_design.can_be_measured(run) for run in runs):
            return runs
        others = [np.array(spare_design.SPARE_GAIN), np.ravel(right_design(case).K)]
        return runs + list(_runs(case, feedback, number, others))

    return again


def run_of(metadata: dict[str, Any]) -> int:
    """The run that a recording says it is of; the first, where it says what cannot be, for which it is refused."""
    try:
        return claimed_run(metadata)
    except ValueError:
        return FIRST_RUN


def gain_used(case: Case, question: str) -> Vector:
    """The gain with which the student's recording says it was made. Raises LookupError if it does not."""
    for gain in _said(case.own(question, "response")["metadata"]):
        return gain
    raise LookupError(question)


def _said(metadata: dict[str, Any]) -> Iterator[Vector]:
    """The gain that a recording says it was made with, if it has the form of one."""
    said = metadata.get("K")
    if isinstance(said, list) and len(said) == 4 and all(isinstance(k, int | float) for k in said):
        yield np.array(said, dtype=float)


def _runs(case: Case, feedback: str, number: int, gains: list[Vector]) -> Iterator[Recording]:
    for gain in gains:
        try:
            yield case.bench.tracking(tuple(gain.tolist()), feedback, number)
        except RotflexError:  # a limit of the bench was passed
            continue


def validated_again(case: Case, metadata: dict[str, Any]) -> list[Recording]:
    """The validation of 2.15 on the student's bench, with their own model; square wave or step."""
    signal = "step" if metadata.get("signal") == "step" else "square"
    for A, B in (own_model(case), right_design(case).voltage_model):
        try:
            return [case.bench.validation(A, B, signal, run_of(metadata))]
        except EVALUATION_ERRORS:  # a model whose numbers are too large to be simulated
            continue
    return []
