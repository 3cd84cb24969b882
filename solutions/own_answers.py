"""The student's own answers as a basis for what follows from them, and which of them are degenerate.

What follows from an own answer is right, given that answer: full points. But an answer may be *degenerate*: what the
next step needs is not in it. Energies without motion, a matrix of zeros, poles that are all zero, a transformation that
cannot be inverted or that changes nothing, a polynomial that leaves the feedback nothing to do. Whatever follows from
that takes no work, and earns nothing. The table says, for each answer that others build on, what must be in it. What is
right always passes, so that an answer which fails is wrong besides.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any

import numpy as np

from labcourse.grading.marking.expression_checks import random_points
from labcourse.grading.verdicts import NothingFollows, OwnAnswers
from rotflex.course.questions import CATALOGUE

from .motion import COORDINATES, euler_lagrange, residual, slope
from .wanted import desired_polynomial

_SEED = 1  # of the points at which expressions are looked at: any will do
_NOTHING = 1e-9  # of the largest: what is smaller is zero, but for rounding
_STILL = 1e-6  # a slope; at points around 1, and found by differences
_AT_LEAST = 3  # poles, coefficients or rank: what is right has three or four
_ALIKE = 0.005  # relative: two polynomials that are the same, but for rounding

Where = tuple[str, str]


def usable(own: OwnAnswers, question: str, part: str) -> Any:
    """Return an own answer if something can follow from it.

    Raises
    ------
    LookupError
        If there is no such answer.
    NothingFollows
        If it is degenerate.
    """
    value = own(question, part)
    if (question, part) in _NEEDS:
        lacks, met = _NEEDS[question, part]
        if not met(value, own):
            raise NothingFollows(f"Your own {part} of question {question} is {lacks}, and nothing follows from that.")
    return value


# --- what moves -------------------------------------------------------------------------------------------------------


def _symbols(question: str, part: str) -> list[dict[str, float]]:
    return random_points((*CATALOGUE.find(question).part(part).symbols, "theta_ddot", "alpha_ddot", "tau"), _SEED)


@lru_cache(maxsize=256)
def _depends(expression: Any, names: tuple[str, ...], question: str, part: str) -> bool:
    """Whether an expression changes with one of these symbols, somewhere."""
    try:
        return any(abs(slope(expression, name, p)) > _STILL for p in _symbols(question, part) for name in names)
    except (ArithmeticError, TypeError, ValueError):
        return False


@lru_cache(maxsize=256)
def _has_inertia(energy: Any, question: str, part: str) -> bool:
    """Whether an energy gives each coordinate an equation with an acceleration in it."""
    where = _symbols(question, part)[0]

    def changes(coordinate: str, other: str) -> bool:
        faster = {**where, f"{other}_ddot": where[f"{other}_ddot"] + 1}
        return abs(euler_lagrange(energy, coordinate, faster) - euler_lagrange(energy, coordinate, where)) > _STILL

    try:
        return all(any(changes(q, other) for other in COORDINATES) for q in COORDINATES)
    except (ArithmeticError, TypeError, ValueError):
        return False


def _is_motion(question: str) -> Callable[[Any, OwnAnswers], bool]:
    def met(equation: Any, own: OwnAnswers) -> bool:
        left = residual(equation)
        moves = _depends(left, ("theta_ddot", "alpha_ddot"), question, "equation")
        return moves and _depends(left, ("theta", "alpha", "theta_dot", "alpha_dot", "tau"), question, "equation")

    return met


def _changes(question: str, part: str, *names: str) -> Callable[[Any, OwnAnswers], bool]:
    return lambda value, own: _depends(value, names, question, part)


# --- numbers ----------------------------------------------------------------------------------------------------------


def _count(value: Any) -> int:
    """How many entries are not zero."""
    sizes = np.abs(np.ravel(value))
    return int(np.sum(sizes > _NOTHING * max(sizes.max(), 1.0)))


def _enough(value: Any, own: OwnAnswers) -> bool:
    return _count(value) >= _AT_LEAST


def _not_zero(value: Any, own: OwnAnswers) -> bool:
    return _count(value) > 0


def _positive(value: Any, own: OwnAnswers) -> bool:
    return bool(float(value) > 0)


def _ranked(value: Any, own: OwnAnswers) -> bool:
    return bool(np.linalg.matrix_rank(np.asarray(value, dtype=float)) >= _AT_LEAST)


def _transforms(value: Any, own: OwnAnswers) -> bool:
    """Whether a matrix can be inverted, and is no multiple of the unit matrix."""
    matrix = np.asarray(value, dtype=float)
    lengths = np.linalg.norm(matrix, axis=0)
    if not np.isfinite(lengths).all() or lengths.min() == 0:
        return False
    changes = np.abs(matrix - matrix[0, 0] * np.eye(len(matrix))).max() > _NOTHING * np.abs(matrix).max()
    return bool(np.linalg.matrix_rank(matrix / lengths) == len(matrix) and changes)


def _moves_poles(of_poles: bool) -> Callable[[Any, OwnAnswers], bool]:
    """Whether desired poles, or their polynomial, are others than those of the student's open loop."""

    def met(value: Any, own: OwnAnswers) -> bool:
        wish = np.poly(np.ravel(value)).real if of_poles else np.ravel(value)
        if _alike(wish, desired_polynomial()):
            return True
        try:
            return _count(wish) >= _AT_LEAST and not _alike(wish, np.ravel(own("3.2", "polynomial")))
        except LookupError:
            return _count(wish) >= _AT_LEAST

    return met


def _is_open_loop(value: Any, own: OwnAnswers) -> bool:
    """Whether a polynomial leaves the feedback something to do."""
    try:
        wish = np.ravel(own("3.4", "polynomial"))
    except LookupError:
        wish = desired_polynomial()
    return _enough(value, own) and not _alike(np.ravel(value), wish)


def _is_companion(value: Any, own: OwnAnswers) -> bool:
    """Whether a companion matrix leaves the feedback something to do."""
    last = np.asarray(value, dtype=float)[3]
    return _ranked(value, own) and _is_open_loop([1.0, *-last[::-1]], own)


def _alike(one: Any, other: Any) -> bool:
    return bool(np.shape(one) == np.shape(other) and np.allclose(one, other, rtol=_ALIKE, atol=_NOTHING))


# --- the table --------------------------------------------------------------------------------------------------------

_ZEROS = "nothing but zeros"
_FEW = "zero in nearly all of its entries"
_NO_CHANGE = "a matrix that cannot be inverted, or the unit matrix"
_NO_MOTION = "an equation in which nothing is accelerated by anything"
_GAMMA = ("gamma_dot", "gamma_ddot", "gamma_3", "gamma_4")
_NOTHING_TO_DO = "the same before and after, so that the feedback has nothing to do"

#: An answer that others build on → what it is if it fails, and what must be in it.
_NEEDS: Mapping[Where, tuple[str, Callable[[Any, OwnAnswers], bool]]] = {
    ("2.1", "V"): ("an energy that changes with no angle", _changes("2.1", "V", "theta", "alpha")),
    ("2.2", "T"): ("an energy without inertia", lambda value, own: _has_inertia(value, "2.2", "T")),
    ("2.3", "L"): (
        "a function without inertia or without a spring",
        lambda value, own: _has_inertia(value, "2.3", "L") and _depends(value, ("theta", "alpha"), "2.3", "L"),
    ),
    ("2.4", "equation"): (_NO_MOTION, _is_motion("2.4")),
    ("2.5", "equation"): (_NO_MOTION, _is_motion("2.5")),
    **{
        ("2.6", part): (
            "an acceleration that depends on no angle, rate or torque",
            _changes("2.6", part, "theta", "alpha", "theta_dot", "alpha_dot", "tau"),
        )
        for part in ("theta_ddot", "alpha_ddot")
    },
    ("2.11", "omega_n"): ("not positive", _positive),
    ("2.12", "J_l"): ("not positive", _positive),
    ("2.12", "K_s"): ("not positive", _positive),
    ("2.14", "A"): (_FEW, _ranked),
    ("2.14", "B"): (_ZEROS, _not_zero),
    ("2.18", "poles"): (_FEW, _enough),
    ("3.2", "polynomial"): (_NOTHING_TO_DO, _is_open_loop),
    ("3.3", "A_c"): (_NOTHING_TO_DO, _is_companion),
    ("3.3", "B_c"): (_ZEROS, _not_zero),
    ("3.4", "desired_poles"): (_NOTHING_TO_DO, _moves_poles(of_poles=True)),
    ("3.4", "polynomial"): (_NOTHING_TO_DO, _moves_poles(of_poles=False)),
    ("3.5", "K_c"): (_ZEROS, _not_zero),
    ("3.7", "T"): (_NO_CHANGE, _transforms),
    ("3.7", "T_c"): (_NO_CHANGE, _transforms),
    ("3.7", "W"): (_NO_CHANGE, _transforms),
    ("3.8", "K"): (_ZEROS, _not_zero),
    ("3.9", "poles"): (_FEW, _enough),
    ("3.10", "K"): (_ZEROS, _not_zero),
    **{
        (question, part): ("not positive", _positive)
        for question in ("3.12", "3.14", "3.16")
        for part in ("t_s", "alpha_max_deg", "V_max")
    },
    ("4.3", "L"): (_ZEROS, _not_zero),
    ("4.5", "Phi"): (_FEW, _ranked),
    ("4.5", "Gamma"): (_ZEROS, _not_zero),
    ("4.6", "K"): (_ZEROS, _not_zero),
    ("4.7", "limit_ms"): ("not positive", _positive),
    ("4.8", "peak_emulated"): ("not positive", _positive),
    ("4.8", "peak_sampled"): ("not positive", _positive),
    **{
        ("4.9", part): ("a quantity that changes with no derivative of gamma", _changes("4.9", part, *_GAMMA))
        for part in ("alpha", "V_m")
    },
}
