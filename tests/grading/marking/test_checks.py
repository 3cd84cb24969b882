"""The stock checks: of numbers, matrices, poles and functions."""

import math

import control
import numpy as np
import pytest

from labcourse.answers import forms
from labcourse.answers.json_values import FormError
from labcourse.answers.parts import Part, Probe, function, matrix, number, poles
from labcourse.grading.marking.checks import FunctionIs, MatrixIs, Number, PolesAre
from labcourse.grading.marks import Status
from labcourse.grading.verdicts import Case, NothingFollows

SEED = 3
MATRIX, POLES = matrix("A", (2, 2), "", ""), poles("p", 2, "", "")
FLOW = Part("q", "function", 1, "", probe=Probe.scalar("flow(h)", (0.01, 0.4), "q in m³/s"))
PLANT = control.ss([[0, 1], [-4, -0.4]], [[0], [1]], [[1, 0]], [[0]])


def of(check, part, value, **own):
    def answers(question, name):
        return own[name]

    content = forms.encode(part, value, SEED).content
    return check.verdict(part, forms.decode(part, content), Case(PLANT, answers, SEED))


def test_a_tolerance_may_be_absolute_in_the_unit_of_the_part():
    settling = number("t", "s", None, "", "")
    check = Number("the settling time", lambda bench: 2.0, rtol=0.01, atol=0.1)
    assert [of(check, settling, t).status for t in (1.91, 2.09, 2.11)] == [Status.RIGHT, Status.RIGHT, Status.WRONG]
    assert "0.1 s" in of(check, settling, 3.0).reason
    error = Number("the error", lambda bench: 0.0, atol=1e-3)
    assert of(error, number("e", "m", None, "", ""), 9e-4).status is Status.RIGHT


def test_a_matrix_is_compared_with_the_bench_then_with_own_answers_then_with_slips():
    check = MatrixIs(
        "the matrix A",
        lambda bench: bench.A,
        follow=lambda own: [[0, 1], [-own("1", "k"), -0.4]],
        follow_what="your own k",
        slips=lambda bench: {"it is transposed": bench.A.T},
    )
    assert of(check, MATRIX, PLANT.A * 1.01, k=9.0).status is Status.RIGHT
    assert of(check, MATRIX, PLANT.A + np.diag([1e-6, 0]), k=9.0).status is Status.RIGHT  # a zero, but for rounding
    assert of(check, MATRIX, [[0, 1], [-9, -0.4]], k=9.0).status is Status.FOLLOW_THROUGH
    assert "transposed" in of(check, MATRIX, PLANT.A.T, k=9.0).reason
    assert of(check, MATRIX, PLANT.A * 1.05).status is Status.WRONG  # and no k of their own


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_poles_come_in_any_order(order):
    check = PolesAre(
        "the poles",
        control.poles,
        follow=lambda own: np.linalg.eigvals(own("1", "A")),
        follow_what="your own A",
    )
    right = control.poles(PLANT)[list(order)]
    own = np.array([[0, 1], [-9, -1]])
    assert of(check, POLES, right).status is Status.RIGHT
    assert of(check, POLES, np.roots([1, 1, 9])[list(order)], A=own).status is Status.FOLLOW_THROUGH
    assert "sign" in of(check, POLES, -right).reason
    assert of(check, POLES, np.roots([1, 1, 9])).status is Status.WRONG


def test_what_is_zero_follows_from_nothing_and_a_reason_is_passed_on():
    def follow(own):
        raise NothingFollows("Your own A is zero.")

    zeros = MatrixIs("the matrix", lambda bench: bench.A, follow=lambda own: np.zeros((2, 2)), follow_what="A")
    assert of(zeros, MATRIX, np.zeros((2, 2))).status is Status.WRONG
    said = MatrixIs("the matrix", lambda bench: bench.A, follow=follow, follow_what="A")
    assert "Your own A is zero." in of(said, MATRIX, np.zeros((2, 2))).reason


def test_a_function_of_one_number():
    check = FunctionIs(
        "the flow out of your tank",
        lambda bench, h: 2e-4 * math.sqrt(2 * 9.81 * h),
        follow=lambda own, h: own("1", "a") * math.sqrt(2 * 9.81 * h),
        follow_what="your own a",
        slips={"the factor 2 is missing": lambda bench, h: 2e-4 * math.sqrt(9.81 * h)},
    )

    def flow(a, factor=2):
        return lambda h: a * np.sqrt(factor * 9.81 * h)

    assert of(check, FLOW, flow(2e-4)).status is Status.RIGHT
    assert of(check, FLOW, flow(3e-4), a=3e-4).status is Status.FOLLOW_THROUGH
    assert "factor 2" in of(check, FLOW, flow(2e-4, factor=1)).reason
    assert of(check, FLOW, flow(3e-4)).status is Status.WRONG
    with pytest.raises(FormError, match="q in m³/s"):
        forms.encode(FLOW, lambda h: [h, h], SEED)


def test_a_function_with_several_outputs():
    def keep(output):
        return [np.asarray(one, dtype=float).tolist() for one in output]

    def read(data):
        return tuple(np.array(one) for one in data)

    part = function("m", Probe("mass", "m(k)", 3, lambda rng: [(k,) for k in rng.uniform(1, 2, 3)], keep, read), "", "")
    check = FunctionIs("the model", lambda bench, k: ([[0, 1], [-k, 0]], [0, 1]), follow=lambda own, k: ([[0]], [0]))
    assert of(check, part, lambda k: ([[0, 1], [-k, 0]], [0, 1])).status is Status.RIGHT
    assert of(check, part, lambda k: ([[0, 1], [-k, 0]], [0, 2])).status is Status.WRONG
