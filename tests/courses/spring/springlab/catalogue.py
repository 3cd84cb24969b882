"""The questions of the course."""

from __future__ import annotations

from labcourse.answers.catalogue import Catalogue
from labcourse.answers.parts import Question, expression, number, prose, recording

UNITS = {"x": "m"}

CATALOGUE = Catalogue(
    [
        Question("1.1", "1", "01_spring", "The motion after release", ("measures",), (
            recording("run", {"experiment": "release"}, ("x",), "measures", "Your mass, let go.", units=UNITS),
        )),
        Question("1.2", "1", "01_spring", "Stiffness", ("measures",), (
            number("k", "N/m", (1.0, 1000.0), "measures", "The stiffness of your spring.", points=2),
        )),
        Question("1.3", "1", "01_spring", "Natural frequency", ("models",), (
            expression("formula", ("k", "m"), "models", "The natural frequency.", points=3),
            number("omega", "rad/s", (0.1, 100.0), "models", "That of your own mass and spring."),
        )),
        Question("1.4", "1", "01_spring", "What was left out", ("models",), (
            prose("why", "models", "Why would a real mass come to rest?"),
        )),
    ],
    outcomes={"measures": "measures with care", "models": "finds a model, and its limits"},
)  # fmt: skip
