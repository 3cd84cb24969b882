"""A whole class, on the whole course: what each student does, and what it should earn.

Most students are *claims* (here): plain functions work through the course with the package's student side
(``working_through.py``), give their answers with ``lab.answer``, and the bytes of their ``answers.json`` are decoded
and marked. That is the same path as grading's but for the notebooks, and takes seconds. Only where the running itself
matters do students hand in *notebooks* (``whole_class_notebooks.py``): other ways of writing an answer in a cell, a
mistake that is carried through eleven notebooks by ``lab.value``, and broken files and cells with an endless loop among
them. What a single slip costs is tried on one perfect file (``whole_class_slips.py``).

The marks were worked out by hand: all points of the parts that are marked automatically, less what a student
``loses``, each loss with its reason. Policy and tolerances are those in ``solutions/key.py``.
"""

import contextlib
import io
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import sympy
from matplotlib.figure import Figure
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
from rotflex.config import joint
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
    unusable : nothing that is given has the form of an answer
    """

    mistakes: Mapping[Where, Change] = field(default_factory=dict)
    written: Mapping[Where, Change] = field(default_factory=dict)
    loses: Mapping[Where, tuple[float, str]] = field(default_factory=dict)
    leaves_out: Callable[[Where], bool] = lambda where: False
    follows: tuple[Where, ...] = ()
    unusable: bool = False

    def points(self) -> dict[Where, float]:
        """What the parts that are marked automatically should earn."""
        return {
            where: 0.0 if self.unusable or self.leaves_out(where) else full - self.loses.get(where, (0.0, ""))[0]
            for where, full in FULL.items()
            if where[0] != "0.1"
        }

    def awaiting(self) -> float:
        """Points that should wait for a person."""
        written = {where for where in PROSE if not self.unusable and not self.leaves_out(where)}
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


def at_another_anchor(name: str) -> float:
    arm = bench_of(name).joint
    return replace(arm, d_12=joint(arm.arm_position % 3 + 1).d_12).J_l


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


def friction_drives(K_s: float, J_l: float, J_eq: float, B_eq: float) -> Any:
    """The model, but for a sign: the servo's friction drives it."""
    A, *others = state_space(K_s, J_l, J_eq, B_eq)
    A[2, 2] = B_eq / J_eq
    return A, *others


def no_half(value: Any) -> Any:
    return 2 * value


def no_friction(equation: Any) -> Any:
    return sympy.Eq(equation.lhs - B_eq * theta_dot, equation.rhs)


JUNK = {
    "number": ["much", np.array([1.0, 2.0]), float("nan"), -np.inf],
    "matrix": [np.full((4, 4), np.nan), [["1"] * 4] * 4, np.ones((2, 3)), np.inf, [[1, 2], [3]]],
    "poles": [[1, 2, 3], [np.nan] * 4, ["a", "b", "c", "d"], 7],
    "choice": ["perhaps", 1],
    "expression": [float("nan"), sympy.oo, sympy.Symbol("x")],
    "equation": [True, (1, 2, 3), "0 = 0"],
    "symbolic_matrix": [np.full((4, 4), np.inf), sympy.zeros(3, 3), sympy.Symbol("K_s")],
    "function": [lambda *arguments: None, lambda *arguments: np.nan, 3],
    "figure": ["a drawing", Figure()],
    "recording": [[1, 2, 3], {"alpha": 1}],
}


def junk() -> dict[Where, Change]:
    """Something that has not the form of an answer, for every part: each sort of it in turn."""
    parts = [(q.number, p) for q in CATALOGUE.everything.values() for p in q.parts]
    counted: dict[str, int] = {}
    changes: dict[Where, Change] = {}
    for number, part in parts:
        choices = JUNK.get(part.kind, [42, " "])
        counted[part.kind] = counted.get(part.kind, -1) + 1
        given = choices[counted[part.kind] % len(choices)]
        changes[number, part.name] = lambda value, given=given: given
    return changes


def in_radians(value: float) -> float:
    return float(np.deg2rad(value))


ONLY_MODELING = tuple(f"2.{n}" for n in range(1, 19))

CLASS = {
    "ada": Student(),
    # Whoever copies three digits from the screen into each answer.
    "rounds": Student(written={where: digits(3) for where in number_parts("number", "matrix", "poles")}),
    # ... and goes on with them: four, since differences of polynomials lose one.
    "rounds-on": Student(
        mistakes={where: digits(4) for where in number_parts("number", "matrix", "poles") if where[0][0] in "23"}
    ),
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
    # The length of the arm taken for that to another anchor. K_s = J_l·omega_n² follows, and so does all that follows.
    "other-anchor": Student(
        mistakes={("2.12", "J_l"): lambda _: at_another_anchor("other-anchor")},
        loses={("2.12", "J_l"): (1, "the top arm is elsewhere")},
        follows=(("2.12", "K_s"), ("2.14", "A"), ("2.18", "poles"), ("3.7", "T"), ("3.8", "K"), ("Table 2", "A")),
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
    # A of the code is wrong; A in numbers, poles, design and responses are right for that code.
    "wrong-code": Student(
        mistakes={("2.13", "state_space"): lambda _: friction_drives},
        loses={("2.13", "state_space"): (2, "it gives another A")},
        follows=(("2.14", "A"), ("2.18", "poles"), ("3.2", "polynomial"), ("3.7", "T"), ("3.8", "K"), ("Table 2", "A")),
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
    # Everything has some value, and no value the form of an answer: nothing is recorded.
    "nonsense": Student(written=junk(), unusable=True),
    "empty": Student(leaves_out=lambda where: True),
}
