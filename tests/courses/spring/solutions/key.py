"""How each answer is marked."""

from __future__ import annotations

import math

from springlab.plant import MASS

from labcourse.grading.marking.checks import ForAPerson, Number, RecordingOf
from labcourse.grading.marking.expression_checks import ExpressionIs

KEY = {
    "1.1": {"run": RecordingOf(lambda bench: bench.release(), channel="x", rtol=0.01)},
    "1.2": {"k": Number("the stiffness of your spring", lambda bench: bench.k, rtol=0.05)},
    "1.3": {
        "formula": ExpressionIs(lambda at: math.sqrt(at["k"] / at["m"])),
        "omega": Number(
            "the natural frequency of your mass",
            lambda bench: bench.omega,
            rtol=0.02,
            follow=lambda own: math.sqrt(own("1.2", "k") / MASS),
            follow_what="the one that your own k gives",
        ),
    },
    "1.4": {"why": ForAPerson()},
}
