"""Another arm than the student's: explorers show it until the questions are answered that an explorer would give away.

Its numbers are stored, so that no formula that students work out is called: ``tools/make_another_arm.py`` makes them.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from labcourse.scene.explorer import Explorer
from labcourse.scene.scene import Readout, Row
from rotflex import experiments
from rotflex.course.practice import Practice
from rotflex.errors import RotflexError
from rotflex.hil import Bench
from rotflex.recording import Recording
from rotflex.simulation import with_actuator
from rotflex.units import Vector

if TYPE_CHECKING:
    from rotflex.course.lab import Lab

NUMBER = 6  # of the practice bench
Shown = TypeVar("Shown", bound=Explorer)


@cache
def numbers() -> dict[str, Any]:
    """Load what is stored: the model ``A`` and ``B``; recordings "free" and "held" every ``step`` (s)."""
    found: dict[str, Any] = json.loads(Path(__file__).with_name("another_arm.json").read_text(encoding="utf-8"))
    return found


def practice() -> Practice:
    """The practice bench with this arm."""
    return Practice(NUMBER)


def model() -> tuple[Vector, Vector]:
    """Its model A (4, 4) and B (4, 1), with the motor voltage as input."""
    return np.array(numbers()["A"]), np.array(numbers()["B"]).reshape(4, 1)


def validated() -> Recording:
    """Its validation, of 4 s."""
    with practice().bench() as bench:
        return experiments.validation(bench, *model(), duration=4.0, progress=False)


def own_model(lab: Lab) -> tuple[Vector, Vector]:
    """The student's model with the motor voltage as input, from answer 2.14."""
    A, B = with_actuator(lab.value("2.14", "A"), lab.value("2.14", "B"), lab.servo)
    return A, B


def own_bench(lab: Lab) -> Bench:
    """The student's bench, or the recordings that were made at it where it is a real one: nothing moves by itself."""
    bench = lab.bench()
    return bench if bench.is_simulated else lab.bench("recorded")


def unless_answered(lab: Lab, wanted: str, own: Callable[[], Shown], another: Callable[[], Shown]) -> Shown:
    """Make an explorer of the student's own work if it is there, and of another arm if not.

    Parameters
    ----------
    lab : the student's session
    wanted : questions and parts that the own work is made of, as "2.14 A, 3.8 K"; "" for work that needs no answer
    own, another : make the explorers; what goes wrong in the first one is shown in the second
    """
    trouble = ""
    if all(lab.has(*one.split()) for one in wanted.split(", ") if one):
        try:
            return own()
        except RotflexError as error:
            trouble = str(error)
    explorer = another()
    explorer.refresh(trouble)
    return explorer


def notice(questions: str, title: str = "Another arm") -> Readout:
    """Say which questions bring the student's own work."""
    return Readout(title, [Row("", (f"After question {questions}, you see your own here.",))])
