"""Checks of expressions, equations and matrices of expressions: any equivalent form is right.

Two expressions are taken as equal if they agree at a few random points. (A polynomial or a quotient of polynomials
that is not zero vanishes at random points with a probability of zero; and numbers can be compared in bounded time,
where simplifying an untrusted expression cannot.)
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from labcourse.answers.parts import Part
from labcourse.grading import verdicts
from labcourse.grading.verdicts import EARLIER_ANSWERS, Case, NothingFollows, OwnAnswers, Verdict

SymbolValues = Mapping[str, float]  # symbol → value
Rule = Callable[[SymbolValues], Any]  # a quantity as a function of the values of all symbols
_POINTS = 6  # random points; two would do
_RTOL = 1e-7  # half the digits of a float; a tolerance for rounded coefficients is in the checks
_FLOAT_RTOL = 2e-3  # a student's 0.333 for a third is 1e-3 away
_LEAST_SHARE = 0.7  # of the rows; in a state-space model, half of them take no derivation
#: What the evaluation of an expression may raise where it has no value.
_NO_VALUE = (ArithmeticError, TypeError, ValueError)


def random_points(symbols: tuple[str, ...], seed: int) -> list[dict[str, float]]:
    """Draw a few random points: symbol → value, from a half to two; the same points for the same seed."""
    draw = np.random.default_rng(seed)
    return [dict(zip(symbols, draw.uniform(0.5, 2.0, len(symbols)).tolist(), strict=True)) for _ in range(_POINTS)]


def value_at(expression: Any, point: SymbolValues) -> float:
    """Return the value of a sympy expression at a point.

    Raises
    ------
    ArithmeticError
        If it has no real value there.
    TypeError
        If one of its symbols has no value in the point.
    """
    import sympy

    number = sympy.sympify(expression).xreplace({sympy.Symbol(name): sympy.Float(v) for name, v in point.items()})
    value = complex(number)
    if not np.isfinite(value) or abs(value.imag) > 1e-9 * abs(value.real):
        raise ArithmeticError("not a real number")
    return value.real


def _tolerance(expression: Any) -> float:
    """Return the relative tolerance for an expression: larger if it has rounded numbers in it."""
    import sympy

    return _FLOAT_RTOL if sympy.sympify(expression).atoms(sympy.Float) else _RTOL


def _equals_rule(expression: Any, rule: Rule, points: list[dict[str, float]]) -> bool:
    """Return whether an expression equals a rule at all points, within the tolerance; not if one has no value there."""
    tolerance = _tolerance(expression)
    try:
        pairs = [(value_at(expression, point), rule(point)) for point in points]
    except _NO_VALUE:
        return False
    return all(abs(answered - wanted) <= tolerance * max(1e-3, abs(wanted)) for answered, wanted in pairs)


@dataclass(frozen=True)
class ExpressionIs:
    """An expression equal to the expected one, or to what the student's own earlier answers give.

    Parameters
    ----------
    expected : function of a point (symbol → value) that returns the quantity there
    follow : function of the student's own answers and a point that returns the quantity from these answers; raises
        LookupError where there are none
    follow_what : name of that for messages, as "your own energy"
    slips : common mistakes: what was done → function of a point, for the quantity that it leads to
    """

    expected: Rule
    follow: Callable[[OwnAnswers, SymbolValues], Any] | None = None
    follow_what: str = EARLIER_ANSWERS
    slips: Mapping[str, Rule] | None = None
    kinds = ("expression",)
    _equals = "equal to"

    def verdict(self, part: Part, value: Any, case: Case) -> Verdict:
        """Compare at random points."""
        points = random_points(self._symbols(part), case.probe_seed)
        if any(self._follows(value, rule, points) for rule in self._right_rules()):
            return verdicts.right(f"{self._equals.capitalize()} what the derivation gives.")
        own, why = self._rule_from_own_answers(case.own, points[0])
        if own is not None and self._follows(value, own, points):
            return verdicts.follow_through(f"Not what the derivation gives, but it agrees with {self.follow_what}.")
        for slip, rule in (self.slips or {}).items():
            if self._follows(value, rule, points):
                return verdicts.wrong(f"Not {self._equals} what the derivation gives: {slip}.")
        return self._wrong_verdict(value, points, why)

    def _symbols(self, part: Part) -> tuple[str, ...]:
        return part.symbols

    def _right_rules(self) -> tuple[Rule, ...]:
        """Return the rules of which an answer has to agree with one to be right."""
        return (self.expected,)

    def _follows(self, value: Any, rule: Rule, points: list[dict[str, float]]) -> bool:
        """Return whether an answer agrees with a rule at all points."""
        return _equals_rule(value, rule, points)

    def _rule_from_own_answers(self, own: OwnAnswers, point: SymbolValues) -> tuple[Rule | None, str]:
        """Build the rule that the student's own earlier answers give, and try it once, at ``point``.

        Returns
        -------
        Rule or None
            None if no rule follows from these answers.
        str
            Why no rule follows, with a space before it; "" if one does, or if the reason is not known.
        """
        if self.follow is None:
            return None, ""
        try:
            self.follow(own, point)
        except NothingFollows as why:
            return None, f" {why}"
        except (LookupError, *_NO_VALUE):
            return None, ""
        return partial(self.follow, own), ""

    def _wrong_verdict(self, value: Any, points: list[dict[str, float]], why: str) -> Verdict:
        """Return the verdict on an answer that agrees with no rule; ``why`` is from :meth:`_rule_from_own_answers`."""
        return verdicts.wrong(f"Not {self._equals} what the derivation gives.{why}")


@dataclass(frozen=True, kw_only=True)
class EquationIs(ExpressionIs):
    """An equation equivalent to the expected one: the two differ by a factor that may hold parameters, but no motion.

    Parameters
    ----------
    expected : left side less right side, at a point
    motion : the symbols of what moves; the factor must not depend on them, as it may on the parameters
    others : the same as ``expected``, of equations that are as good: with another equation of the mechanism put into it
    follow, follow_what, slips : as for :class:`ExpressionIs`
    """

    motion: frozenset[str]
    others: tuple[Rule, ...] = ()
    kinds = ("equation",)
    _equals = "equivalent to"

    def _right_rules(self) -> tuple[Rule, ...]:
        return (self.expected, *self.others)

    def _follows(self, value: Any, rule: Rule, points: list[dict[str, float]]) -> bool:
        """Return whether left side less right side of an equation is a rule times a factor without the motion."""
        residual = value.lhs - value.rhs
        tolerance = _tolerance(residual)
        # The parameters stay, and the motion moves: then the factor is the same at all of these points.
        for parameters in points[: _POINTS // 2]:
            moved = [{**parameters, **{name: point[name] for name in point.keys() & self.motion}} for point in points]
            try:
                answered, wanted = np.array([(value_at(residual, point), rule(point)) for point in moved]).T
            except _NO_VALUE:
                return False
            largest = np.argmax(np.abs(wanted))
            if answered[largest] == 0 or wanted[largest] == 0:
                return False
            off = np.abs(answered - answered[largest] / wanted[largest] * wanted)
            if not np.all(off <= tolerance * abs(answered[largest])):
                return False
        return True


@dataclass(frozen=True, kw_only=True)
class SymbolicMatrixIs(ExpressionIs):
    """A matrix of expressions, entry by entry; some right rows earn their share.

    Parameters
    ----------
    expected : function of a point that returns the matrix there
    own_symbols : symbols in the student's own answers, besides those of the matrix
    follow, follow_what, slips : as for :class:`ExpressionIs`
    """

    own_symbols: tuple[str, ...] = ()
    kinds = ("symbolic_matrix",)
    _equals = "every entry equals"

    def _symbols(self, part: Part) -> tuple[str, ...]:
        return (*part.symbols, *self.own_symbols)

    def _follows(self, value: Any, rule: Rule, points: list[dict[str, float]]) -> bool:
        return bool(len(self._right_rows(value, rule, points)) == value.rows)

    def _wrong_verdict(self, value: Any, points: list[dict[str, float]], why: str) -> Verdict:
        """Return the verdict on a matrix that agrees with no rule: a share of the points if most of its rows are right.

        The reason names the rows that are not.
        """
        right_rows = self._right_rows(value, self.expected, points)
        bad = [str(row + 1) for row in range(value.rows) if row not in right_rows]
        share = 1 - len(bad) / value.rows
        reason = f"Rows that are not what the derivation gives: {', '.join(bad)}.{why}"
        return verdicts.partly(share, reason) if share >= _LEAST_SHARE else verdicts.wrong(reason)

    def _right_rows(self, value: Any, rule: Rule, points: list[dict[str, float]]) -> list[int]:
        """Return the indices of the rows of an answer in which each entry agrees with a rule."""

        def entry(i: int, j: int) -> Rule:
            """Return the rule of one entry of the matrix."""
            return lambda point: float(np.reshape(rule(point), value.shape)[i, j])

        rows, columns = value.shape
        return [i for i in range(rows) if all(_equals_rule(value[i, j], entry(i, j), points) for j in range(columns))]
