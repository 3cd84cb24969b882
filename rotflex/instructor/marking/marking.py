"""Claims and key to marks. Points need positive evidence: what is missing, malformed or unknown earns none."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from rotflex.courseware import forms
from rotflex.courseware.messages import _
from rotflex.courseware.parts import Part, Question
from rotflex.errors import RotflexError
from rotflex.instructor.course import Course
from rotflex.instructor.marking.decoding import Claims
from rotflex.instructor.marking.time_limit import within
from rotflex.instructor.verdicts import Case, Check, Key, Status, Verdict, for_a_person, wrong

_MISSING = "No answer was recorded when your notebooks were run; the line lab.answer(...) says why when you run it."

UNMARKED = "was answered; the key does not mark it."  #: how a note on that ends
_PATIENCE = 60.0  # s for one answer; the slowest honest one takes a few
_LONGEST_SHOWN = 300  # characters of an expression


@dataclass(frozen=True)
class Mark:
    """What became of the answer to one part.

    Attributes
    ----------
    question, part : which
    status : see :class:`~rotflex.instructor.verdicts.Status`
    points, out_of : earned, and possible
    reason : for the student
    given : the answer in a few words, all of it if it is prose; the student's own
    """

    question: str
    part: str
    status: Status
    points: float
    out_of: float
    reason: str
    given: str = ""

    @property
    def awaiting(self) -> float:
        """Points that a person has yet to give or not."""
        return self.out_of if self.status is Status.FOR_A_PERSON else 0.0


def mark(course: Course, claims: Claims, bench: Any, probe_seed: int) -> list[Mark]:
    """Marks for every part of every question in the key, in its order.

    Parameters
    ----------
    course : with the key
    claims : from :func:`rotflex.instructor.marking.decoding.decode`
    bench : the student's own, as it really is: what ``course.bench`` gives
    probe_seed : from which the inputs of functions were drawn
    """
    case = case_of(course, claims, bench, probe_seed)
    marks = []
    for number, checks in course.key.items():
        question = course.catalogue.find(number)
        marks += [mark_part(question, part, checks[part.name], claims, case) for part in question.parts]
    return marks


def case_of(course: Course, claims: Claims, bench: Any, probe_seed: int) -> Case:
    """What the answers of a submission are judged against. Parameters as for :func:`mark`."""

    def own(question: str, part: str) -> Any:
        return claims.values[question, part]  # a KeyError is a LookupError

    return Case(bench, own, probe_seed, course.knows_bench(claims.bench))


def mark_part(question: Question, part: Part, check: Check, claims: Claims, case: Case) -> Mark:
    """The mark for one part."""
    where = (question.number, part.name)
    given = ""
    if where in claims.values:
        verdict = _verdict(check, part, claims.values[where], case)
        given = _given(part, claims.contents[where], claims.values[where])
    elif where in claims.malformed:
        verdict = wrong(_("Malformed: {why}").format(why=claims.malformed[where]))
    else:
        verdict = Verdict(Status.MISSING, 0.0, _MISSING)
    points = round(verdict.share * part.points, 6)
    return Mark(question.number, part.name, verdict.status, points, part.points, verdict.reason, given)


def _verdict(check: Check, part: Part, value: Any, case: Case) -> Verdict:
    """The check's verdict; a person's, where a claim is so odd that the check fails on it. The other parts count."""
    try:
        # A claim may hold the largest numbers there are, and be built to be slow.
        with np.errstate(all="ignore"), within(_PATIENCE):
            return check.verdict(part, value, case)
    except (ArithmeticError, LookupError, ValueError, MemoryError, RecursionError, RotflexError) as error:
        return for_a_person(
            _("It could not be compared ({error_type}: {error}); a person will look at it.").format(
                error_type=type(error).__name__, error=error
            )
        )


def _given(part: Part, content: dict[str, Any], value: Any) -> str:
    if part.kind == "prose":
        return str(content["value"])
    if part.kind in ("expression", "equation"):
        sides = (value,) if part.kind == "expression" else (value.lhs, value.rhs)
        text = " = ".join(map(str, sides))
        return text if len(text) <= _LONGEST_SHOWN else f"{text[:_LONGEST_SHOWN]}…"
    return forms.show(part, content).removeprefix(part.name).lstrip(" :=")


def unmarked(key: Key, claims: Claims) -> list[str]:
    """A message on answers to questions that the key does not have."""
    numbers = dict.fromkeys(number for number, _part in claims.contents if number not in key)
    return [_("Question {number} {unmarked}").format(number=number, unmarked=UNMARKED) for number in numbers]


def nothing_earned(course: Course, reason: str) -> list[Mark]:
    """Marks for a submission of which nothing could be read."""
    return [
        Mark(number, part.name, Status.MISSING, 0.0, part.points, reason)
        for number in course.key
        for part in course.catalogue.find(number).parts
    ]
