"""A whole class, on the whole course: what each student does, and what it should earn.

Most students are *claims* (here): plain functions work through the course with the package's student side
(``working_through.py``), give their answers with ``lab.answer``, and the bytes of their ``answers.json`` are decoded
and marked. That is the same path as grading's but for the notebooks (``test_honest_class.py``), and takes seconds. What
a single slip costs stands in ``single_slips.py``.

The marks were worked out by hand: all points of the parts that are marked automatically, less what a student
``loses``, each loss with its reason. Policy and tolerances are those in ``solutions/key.py``.
"""

import contextlib
import io
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import sympy
from working_through import (
    FULL,
    JUDGED,
    PROSE,
    B_eq,
    Change,
    Pen,
    Where,
    design,
    digits,
    modeling,
    prelab,
    responses,
    state_space,
    theta_dot,
)

import rotflex.course.lab
from rotflex import config, experiments, hil, simulation
from rotflex.course.questions import CATALOGUE
from rotflex.hil.student_benches import student_seed


@dataclass(frozen=True)
class Student:
    """A student's way of working, and what it should cost.

    Attributes
    ----------
    mistakes : made at (question, part), and carried on in good faith
    written : how an answer is written down, with no effect on what comes after
    loses : (question, part) → points lost, and why
    leaves_out : whether a part is not answered; its points are lost, too
    follows : parts that are "right, given your own earlier answers"
    """

    mistakes: Mapping[Where, Change] = field(default_factory=dict)
    written: Mapping[Where, Change] = field(default_factory=dict)
    loses: Mapping[Where, tuple[float, str]] = field(default_factory=dict)
    leaves_out: Callable[[Where], bool] = lambda where: False
    follows: tuple[Where, ...] = ()

    def points(self) -> dict[Where, float]:
        """What the parts that are marked automatically should earn."""
        return {
            where: 0.0 if self.leaves_out(where) else full - self.loses.get(where, (0.0, ""))[0]
            for where, full in FULL.items()
            if where[0] != "0.1"
        }

    def awaiting(self) -> float:
        """Points that should wait for a person."""
        written = {where for where in PROSE if not self.leaves_out(where)}
        reports = {number for number, _part in written}
        wholes = sum(points for report, points in JUDGED.items() if report in reports)
        return sum(PROSE[where] for where in written) + wholes


def claims(name: str, student: Student, folder: Path) -> bytes | None:
    """The bytes of the ``answers.json`` of a student who works through the course; None if nothing was recorded."""
    with contextlib.redirect_stdout(io.StringIO()):
        lab = rotflex.course.lab.start(name, folder=folder, quiet=True)
        write = Pen(student.mistakes, student.written)
        write("0.1", "resolution", 2 * np.pi / 4096)
        prelab(write)
        A, B, poles = modeling(lab, write)
        responses(lab, write, A, B, design(write, A, B, poles))
        for number, part in PROSE:
            write(number, part, "Because it is so.")
        for number, parts in write.answers.items():
            kept = {part: value for part, value in parts.items() if not student.leaves_out((number, part))}
            if kept:
                lab.answer(number, **kept)
    return lab.book.path.read_bytes() if lab.book.path.exists() else None


def number_parts(*kinds: str) -> list[Where]:
    return [(q.number, p.name) for q in CATALOGUE.everything.values() for p in q.parts if p.kind in kinds]


def bench_of(name: str) -> Any:
    """What a student's bench really is, for those who are to be off by so much."""
    return hil.student_benches.student_bench(student_seed(name))


def omega_of(name: str) -> float:
    spec = bench_of(name)
    return float(np.sqrt(spec.parameters.K_s / spec.parameters.J_l))


def of_friend(experiment: Callable[..., Any], *arguments: Any) -> Change:
    """The same experiment on the bench of "ada", with what the recording says it was run with."""

    def borrowed(recording: Any) -> Any:
        own = [recording.metadata[name] for name in arguments]
        with hil.open("virtual", seed=student_seed("ada")) as bench:
            return experiment(bench, *own, progress=False)

    return borrowed


def friends_validation(recording: Any) -> Any:
    A, B = simulation.with_actuator(*state_space(1.5, 0.004, 0.0021, 0.004)[:2], config.srv02())
    with hil.open("virtual", seed=student_seed("ada")) as bench:
        return experiments.validation(bench, A, B, progress=False)


def no_half(value: Any) -> Any:
    return 2 * value


def no_friction(equation: Any) -> Any:
    return sympy.Eq(equation.lhs - B_eq * theta_dot, equation.rhs)


def in_radians(value: float) -> float:
    return float(np.deg2rad(value))


ONLY_MODELING = tuple(f"2.{n}" for n in range(1, 19))

CLASS = {
    "ada": Student(),
    # Whoever copies three digits from the screen into each answer.
    "rounds": Student(written={where: digits(3) for where in number_parts("number", "matrix", "poles")}),
    # omega_n 1.9 % high, within its 2 %; K_s 3.8 % high. What builds on it is right for that stiffness.
    "rough": Student(mistakes={("2.11", "omega_n"): lambda _: 1.019 * omega_of("rough")}),
    # 30 % low: K_s is half of what it is. All the rest is consistent.
    "soft": Student(
        mistakes={("2.11", "omega_n"): lambda _: 0.7 * omega_of("soft")},
        loses={("2.11", "omega_n"): (2, "30 % off")},
        follows=(
            ("2.12", "K_s"),
            ("2.14", "A"),
            ("2.18", "poles"),
            ("3.2", "polynomial"),
            ("3.3", "A_c"),
            ("3.5", "K_c"),
            ("3.7", "T"),
            ("3.7", "T_c"),
            ("3.7", "W"),
            ("3.8", "K"),
            ("3.10", "K"),
            ("Table 2", "omega_n"),
            ("Table 3", "K_psf"),
        ),
    ),
    # Energies: no ½ in V. Motion: no friction of the servo. Each costs its own points; both are carried on.
    "paper-slips": Student(
        mistakes={("2.1", "V"): no_half, ("2.4", "equation"): no_friction},
        loses={("2.1", "V"): (2, "no factor ½"), ("2.4", "equation"): (2, "no friction")},
        follows=(
            ("2.3", "L"),
            ("2.5", "equation"),
            ("2.6", "theta_ddot"),
            ("2.6", "alpha_ddot"),
            ("2.7", "A"),
        ),
    ),
    # A slip in multiplying out costs 2; the companion form and its gain follow from it, and what is made of that gain.
    "polynomial-slip": Student(
        mistakes={("3.2", "polynomial"): lambda p: p * [1, 1, 1.2, 1, 1]},
        loses={("3.2", "polynomial"): (2, "a coefficient is 20 % off")},
        follows=(("3.3", "A_c"), ("3.5", "K_c"), ("3.8", "K"), ("3.9", "poles"), ("Table 3", "K_fsf")),
    ),
    # The deflection in radians, three times; Table 3 carries over what was measured, and the specification on it seems
    # to be met by the student's own numbers.
    "radians": Student(
        mistakes={(number, "alpha_max_deg"): in_radians for number in ("3.12", "3.14", "3.16")},
        loses={(number, "alpha_max_deg"): (1, "radians for degrees") for number in ("3.12", "3.14", "3.16")},
        follows=tuple(("Table 3", f"alpha_max_deg_{suffix}") for suffix in ("sim", "fsf", "psf")),
    ),
    # A friend's recordings of the bench. Each costs its point once; the figures show the student's own recordings,
    # which is what they are asked to show. No numbers are read off them.
    "borrower": Student(
        mistakes={
            ("2.15", "validation"): friends_validation,
            ("3.13", "response"): of_friend(experiments.tracking, "K", "feedback"),
            ("3.15", "response"): of_friend(experiments.tracking, "K", "feedback"),
        },
        loses={
            ("2.15", "validation"): (1, "of another student's bench"),
            ("3.13", "response"): (1, "of another student's bench"),
            ("3.15", "response"): (1, "of another student's bench"),
        },
        leaves_out=lambda where: where[0] in ("3.14", "3.16", "Table 3"),
    ),
    # Went home after notebook 03.
    "half": Student(leaves_out=lambda where: where[0] not in ONLY_MODELING),
    # Numbers only: nothing in words.
    "silent": Student(leaves_out=lambda where: where in PROSE),
    "empty": Student(leaves_out=lambda where: True),
}
