"""Checks of expressions, equations and matrices of expressions: any equivalent form is right.

Two expressions are taken as equal if they agree at a few random points. (A polynomial or a quotient of polynomials
that is not zero vanishes at random points with a probability of nothing; and numbers can be compared in bounded time,
where simplifying an untrusted expression cannot.)
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from labcourse.answers.parts import Part
from labcourse.grading.verdicts import (
    OWN_ANSWERS,
    Case,
    NothingFollows,
    Own,
    Verdict,
    follow_through,
    partly,
    right,
    wrong,
)

Point = Mapping[str, float]
Rule = Callable[[Point], float]  # a quantity as a function of all symbols' values
_POINTS = 6  # random points; two would do
_RTOL = 1e-7  # half the digits of a float; a tolerance for rounded coefficients is in the checks
_FLOAT_RTOL = 2e-3  # a student's 0.333 for a third is 1e-3 away


def points(symbols: tuple[str, ...], seed: int) -> list[dict[str, float]]:
    """Random values for symbols, from a half to two, the same for the same seed."""
    draw = np.random.default_rng(seed)
    return [dict(zip(symbols, draw.uniform(0.5, 2.0, len(symbols)).tolist(), strict=True)) for _ in range(_POINTS)]


def at(expression: Any, point: Point) -> float:
    """The value of a sympy expression at a point. Raises ArithmeticError where it has no real one."""
    import sympy

    number = sympy.sympify(expression).xreplace({sympy.Symbol(name): sympy.Float(v) for name, v in point.items()})
    value = complex(number)
    if not np.isfinite(value) or abs(value.imag) > 1e-9 * abs(value.real):
        raise ArithmeticError("not a real number")
    return value.real


def _agree(expression: Any, rule: Rule, where: list[dict[str, float]]) -> bool:
    """Whether an expression equals a rule at all points."""
    tolerance = _FLOAT_RTOL if _has_floats(expression) else _RTOL
    try:
        pairs = [(at(expression, point), rule(point)) for point in where]
    except (ArithmeticError, TypeError, ValueError, np.linalg.LinAlgError):
        return False
    return all(abs(given - wanted) <= tolerance * max(1e-3, abs(wanted)) for given, wanted in pairs)


def _has_floats(expression: Any) -> bool:
    import sympy

    return bool(sympy.sympify(expression).atoms(sympy.Float))


@dataclass(frozen=True)
class ExpressionIs:
    """An expression equal to the expected one, or to what the student's own earlier answers give.

    Parameters
    ----------
    expected : the quantity at a point
    follow : the same from the student's own answers; raises LookupError where there are none
    follow_what : what that is, in words
    slips : usual mistakes: what was done → the quantity that it leads to
    """

    expected: Rule
    follow: Callable[[Own, Point], float] | None = None
    follow_what: str = OWN_ANSWERS
    slips: Mapping[str, Rule] | None = None
    kinds = ("expression",)

    def verdict(self, part: Part, value: Any, case: Case) -> Verdict:
        """Compare at random points."""
        where = points(part.symbols, case.probe_seed)
        if _agree(value, self.expected, where):
            return right("Equal to what the derivation gives.")
        own, why_not = _from_own(self.follow, case.own, where)
        if own is not None and _agree(value, own, where):
            return follow_through(f"Not what the derivation gives, but it agrees with {self.follow_what}.")
        for slip, rule in (self.slips or {}).items():
            if _agree(value, rule, where):
                return wrong(f"Not equal to what the derivation gives: {slip}.")
        return wrong("Not equal to what the derivation gives." + why_not)


def _from_own(
    follow: Callable[[Own, Point], Any] | None, own: Own, where: list[dict[str, float]]
) -> tuple[Callable[[Point], Any] | None, str]:
    """The rule that the student's own answers give; None where they give none, and then why, if that is known."""
    if follow is None:
        return None, ""
    try:
        follow(own, where[0])
    except NothingFollows as why:
        return None, f" {why}"
    except (LookupError, ArithmeticError, TypeError, ValueError, np.linalg.LinAlgError):
        return None, ""
    return lambda point: follow(own, point), ""


@dataclass(frozen=True)
class EquationIs:
    """An equation equivalent to the expected one: the two differ by a factor, such as a mass, but not by a motion.

    Parameters
    ----------
    expected : left side less right side, at a point
    motion : the symbols of what moves; the factor must not depend on them, as it may on the parameters
    others : the same, of equations that are as good: with another equation of the mechanism put into the expected one
    follow, follow_what, slips : as for :class:`ExpressionIs`
    """

    expected: Rule
    motion: frozenset[str]
    others: tuple[Rule, ...] = ()
    follow: Callable[[Own, Point], float] | None = None
    follow_what: str = OWN_ANSWERS
    slips: Mapping[str, Rule] | None = None
    kinds = ("equation",)

    def verdict(self, part: Part, value: Any, case: Case) -> Verdict:
        """Compare at random points, up to a factor."""
        where = points(part.symbols, case.probe_seed)
        residual = value.lhs - value.rhs
        if any(self._proportional(residual, rule, where) for rule in (self.expected, *self.others)):
            return right("Equivalent to what the derivation gives.")
        own, why_not = _from_own(self.follow, case.own, where)
        if own is not None and self._proportional(residual, own, where):
            return follow_through(f"Not what the derivation gives, but it agrees with {self.follow_what}.")
        for slip, rule in (self.slips or {}).items():
            if self._proportional(residual, rule, where):
                return wrong(f"Not equivalent to what the derivation gives: {slip}.")
        return wrong("Not equivalent to what the derivation gives." + why_not)

    def _proportional(self, residual: Any, rule: Rule, where: list[dict[str, float]]) -> bool:
        """Whether a residual is a rule times a factor that the parameters may be in, but not the motion."""
        tolerance = _FLOAT_RTOL if _has_floats(residual) else _RTOL
        for parameters in where[: _POINTS // 2]:
            moved = [{**parameters, **{name: point[name] for name in point.keys() & self.motion}} for point in where]
            try:
                given, wanted = np.array([(at(residual, point), rule(point)) for point in moved]).T
            except (ArithmeticError, TypeError, ValueError, np.linalg.LinAlgError):
                return False
            largest = np.argmax(np.abs(wanted))
            if given[largest] == 0 or wanted[largest] == 0:
                return False
            factor = given[largest] / wanted[largest]
            if not np.all(np.abs(given - factor * wanted) <= tolerance * abs(given[largest])):
                return False
        return True


@dataclass(frozen=True)
class SymbolicMatrixIs:
    """A matrix of expressions, entry by entry; some right entries earn their share.

    Parameters
    ----------
    expected : the matrix at a point
    follow : the same from the student's own answers
    follow_what : what that is, in words
    own_symbols : that the student's own answers have besides those of the matrix
    """

    expected: Callable[[Point], Any]
    follow: Callable[[Own, Point], Any] | None = None
    follow_what: str = OWN_ANSWERS
    own_symbols: tuple[str, ...] = ()
    kinds = ("symbolic_matrix",)

    def verdict(self, part: Part, value: Any, case: Case) -> Verdict:
        """Compare the entries at random points."""
        where = points((*part.symbols, *self.own_symbols), case.probe_seed)
        if np.all(self._entries(value, self.expected, where)):
            return right("Every entry equals what the derivation gives.")
        own, why_not = _from_own(self.follow, case.own, where)
        if own is not None and np.all(self._entries(value, own, where)):
            return follow_through(f"Not what the derivation gives, but it agrees with {self.follow_what}.")
        rows = [i + 1 for i in range(part.shape[0]) if not all(self._entries(value, self.expected, where)[i])]
        share = 1 - len(rows) / part.shape[0]
        reason = f"Rows that are not what the derivation gives: {', '.join(map(str, rows))}." + why_not
        return partly(share, reason) if share >= _WORTH_A_SHARE else wrong(reason)

    def _entries(self, matrix: Any, rule: Callable[[Point], Any], where: list[dict[str, float]]) -> list[list[bool]]:
        """For each entry, whether it agrees with a rule."""
        rows, columns = matrix.shape

        def entry(i: int, j: int) -> Rule:
            return lambda point: float(np.reshape(rule(point), (rows, columns))[i, j])

        return [[_agree(matrix[i, j], entry(i, j), where) for j in range(columns)] for i in range(rows)]


_WORTH_A_SHARE = 0.7  # of the rows; in a state-space model, half of them take no derivation
