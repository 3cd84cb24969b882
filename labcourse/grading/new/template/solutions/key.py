"""How each answer is marked. ``bench`` is the student's oven as it really is, ``own`` are the student's answers."""

import math

import numpy as np
from NAME.plant import STEP, Oven, response

from labcourse.grading.marking.checks import (
    ChoiceIs,
    ForAPerson,
    FunctionIs,
    MatrixIs,
    Number,
    PolesAre,
    RecordingOf,
)
from labcourse.grading.marking.expression_checks import ExpressionIs
from labcourse.grading.marking.figure_checks import FigureFollows
from labcourse.grading.marking.units import quantity

KP, KI = 0.2, 0.05  # V/K, V/(K s)


def closed_loop(k: float, tau: float) -> np.ndarray:
    """Return the matrix of the closed loop."""
    return np.array([[-(1 + KP * k) / tau, KI * k / tau], [-1, 0]])


def carried_over(name: str, what: str) -> Number:
    """Check an entry of Table 1: right if it is right, or the student's own answer."""
    return Number(what, lambda bench: getattr(bench, name), follow=lambda own: own("1.2", name), follow_what="yours")


KEY = {
    "1.1": {
        "run": RecordingOf(Oven.step, channel="T", rtol=0.01),
        "plot": FigureFollows(Oven.step, ("1.1", "run"), "T", quantity("K", "°c", "kelvin"), largest=100.0),
    },
    "1.2": {
        "k": Number("the gain of your oven", lambda bench: bench.k, rtol=0.03),
        "tau": Number("the time constant of your oven", lambda bench: bench.tau, rtol=0.05),
    },
    "1.3": {"rise": ExpressionIs(lambda at: at["k"] * at["u"] * (1 - math.exp(-at["t"] / at["tau"])))},
    "1.4": {
        "model": FunctionIs(
            "the temperature of your oven",
            lambda bench, t: response(bench.k, bench.tau, t),
            rtol=0.05,
            follow=lambda own, t: own("1.2", "k") * STEP * (1 - math.exp(-t / own("1.2", "tau"))),
            follow_what="your own k and tau",
        )
    },
    "1.5": {
        "A": MatrixIs(
            "the matrix of your loop",
            lambda bench: closed_loop(bench.k, bench.tau),
            rtol=0.08,
            follow=lambda own: closed_loop(own("1.2", "k"), own("1.2", "tau")),
            follow_what="your own k and tau",
        ),
        "p": PolesAre(
            "the poles of your loop",
            lambda bench: np.linalg.eigvals(closed_loop(bench.k, bench.tau)),
            rtol=0.08,
            follow=lambda own: np.linalg.eigvals(own("1.5", "A")),
            follow_what="your own A",
        ),
        "overshoots": ChoiceIs("yes", "The poles are complex."),
        "why": ForAPerson(),
    },
    "Table 1": {
        "k": carried_over("k", "the gain of your oven"),
        "tau": carried_over("tau", "the time constant of your oven"),
    },
    "Report": {"procedure": ForAPerson(), "conclusion": ForAPerson()},
    "Report, as a whole": {"clarity": ForAPerson()},
}
