"""Mark claims by a key. Points need positive evidence: a missing, malformed or unknown answer earns none.

The reason of a mark is that of the key's check. Where no check gives one, it is given under these facts:

===========================================  ===========================================================================
reason                                       facts
===========================================  ===========================================================================
as :mod:`labcourse.run.reasons` says         the answer is missing, and the run or the hand-in tells why
There is no answer in what was left ...      it is missing from the answers that the run left; no more is known
No text for it was found ...                 no text was read for it in the notebook that was handed in
No text of the report was found ...          no text of the report was read there, and no PDF of it was handed in
Malformed: ...                               the answers have it, and it cannot be decoded as what is asked
It could not be compared ...                 the check failed with a value that can be the answer's fault; for a person
The key that it is marked by has a fault     the check failed otherwise
Your instructor supplied this value ...      an instructor supplied it
===========================================  ===========================================================================
"""

from __future__ import annotations

import math
import traceback
from collections.abc import Callable, Collection
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import labcourse
from labcourse.answers import forms
from labcourse.answers.parts import WHOLE, Part, Question
from labcourse.errors import CourseError
from labcourse.grading.course import Course, package_folder
from labcourse.grading.marking.decoding import Claims, time_limited, with_reports
from labcourse.grading.marks import Mark, Status
from labcourse.grading.submission import Submission
from labcourse.grading.verdicts import Case, Check, JudgesMissing, Key, OwnAnswers, Verdict
from labcourse.problems import Code, Problem, Reason, Where

#: Kind of a part → why there is no answer, where no more is known.
_ABSENT = {"prose": Problem.of(Code.NO_TEXT), WHOLE: Problem.of(Code.NO_REPORT_TEXT)}
_TIME_LIMIT = 60.0  # s for one answer; the slowest honest one takes a few
_LONGEST_SHOWN = 300  # characters of an expression


class KeyFault(Exception):
    """A check of the key that has a fault; the message names its place."""


def mark(course: Course, claims: Claims, bench: Any, submission: Submission) -> list[Mark]:
    """Mark each part that the release asks for, in the key's order.

    If a check has a fault, its part gets the status NOT_MARKED, and the fault becomes a problem; the others are marked.
    A part with a value that the instructor supplied earns nothing.

    Parameters
    ----------
    course : with the key
    claims : from :func:`labcourse.grading.marking.decoding.decode`; faults of the key are added to its problems
    bench : the student's own, as it really is: what ``course.true_bench`` returns
    submission : with what explaining its run fills in: ``missing`` (why answers are missing), ``asked``, ``documents``
    """
    claims = with_reports(claims, course.catalogue, submission.documents)
    case = case_of(course, claims, bench, submission.probe_seed)
    marks = []
    for number in course.key:
        question = course.catalogue.find_marked(number)
        for part in question.parts:
            where = (number, part.name)
            if not _is_asked(course, where, submission.asked):
                continue
            try:
                mark = mark_part(course, question, part, claims, case)
            except KeyFault as fault:
                about = {"question": number, "part": part.name, "error": str(fault)}
                claims.problems.append(Problem.of(Code.KEY_FAILED, **about))
                why, given = Problem.of(Code.KEY_HAS_FAULT), _as_text(part, claims, where)
                mark = Mark(number, part.name, Status.NOT_MARKED, 0.0, part.points, why, given)
            if where in submission.supplied_parts:
                why = Problem.of(Code.SUPPLIED, why=submission.missing.get(where))
                mark = replace(mark, status=Status.SUPPLIED, points=0.0, reason=why)
            elif mark.status is Status.MISSING and where in submission.missing:
                mark = replace(mark, reason=submission.missing[where])
            marks.append(mark)
    return marks


def _is_asked(course: Course, where: Where, asked: Collection[Where] | None) -> bool:
    """Return whether a release asks for a part; for a report as a whole, for any of its texts.

    ``asked`` is all that it asks for; None if that is all that the course asks for.
    """
    if asked is None:
        return True
    report = course.catalogue.report_judged.get(where[0])
    return where in asked if report is None else any(number == report for number, _part in asked)


def case_of(course: Course, claims: Claims, bench: Any, probe_seed: int) -> Case:
    """Return the data by which the answers of a submission are judged.

    Parameters as for :func:`mark`; ``probe_seed`` is that from which the inputs of functions were drawn. ``own`` of the
    case raises KeyError for a missing answer.
    """
    truth_is_known = course.knows_bench(course.parameters) and getattr(bench, "is_known", True)
    word = course.catalogue.bench_word
    return Case(bench, lambda question, part: claims.values[question, part], probe_seed, truth_is_known, word)


def mark_part(course: Course, question: Question, part: Part, claims: Claims, case: Case) -> Mark:
    """Mark one part: an answer by its check in the key, a malformed answer as wrong, and a missing one.

    Raises
    ------
    KeyFault
        If its check has a fault.
    """
    where, check = (question.number, part.name), course.key[question.number][part.name]
    if where in claims.values:
        own = _Remembered(case.own)
        verdict = _judge(course, lambda: check.verdict(part, claims.values[where], replace(case, own=own)))
        absurd = [", ".join(at) for at in own.used if at in claims.waiting or is_absurd(course, at, own.used[at])]
        if absurd and verdict.status is Status.FOLLOW_THROUGH:
            why = Problem.of(Code.FOLLOWS_FROM_ABSURD, reason=verdict.reason, own="; ".join(absurd))
            verdict = Verdict(Status.FOR_A_PERSON, 0.0, why)
            claims.waiting.add(where)
    elif where in claims.malformed:
        verdict = Verdict(Status.WRONG, 0.0, Problem.of(Code.MALFORMED, error=claims.malformed[where]))
    else:
        verdict = _verdict_on_missing(course, part, check, case)
    points = round(verdict.share * part.points, 6)
    given = _as_text(part, claims, where)
    return Mark(question.number, part.name, verdict.status, points, part.points, verdict.reason, given)


class _Remembered:
    """The other answers of a student, as ``own`` of a case; ``used`` are those that were used."""

    def __init__(self, own: OwnAnswers) -> None:
        self._own, self.used = own, dict[Where, Any]()

    def __call__(self, question: str, part: str) -> Any:
        """Return an answer; raise LookupError if there is none."""
        return self.used.setdefault((question, part), self._own(question, part))


def is_absurd(course: Course, where: Where, value: Any) -> bool:
    """Return whether a number is farther from its plausible range than the course's limit for follow-through."""
    plausible = course.catalogue.find_marked(where[0]).part(where[1]).plausible
    if plausible is None or math.isinf(course.follow_limit):
        return False
    low, high = sorted(plausible, key=abs)
    has_sign = low * high > 0
    size = value * math.copysign(1.0, high) if has_sign else abs(value)
    return not (abs(low) / course.follow_limit if has_sign else 0.0) <= size <= abs(high) * course.follow_limit


def _verdict_on_missing(course: Course, part: Part, check: Check, case: Case) -> Verdict:
    """Return the verdict on a missing answer: missing, unless the check gives it points."""
    absent = Verdict(Status.MISSING, 0.0, _ABSENT.get(part.kind, Problem.of(Code.NOT_IN_THE_RUN)))
    if not isinstance(check, JudgesMissing):
        return absent
    verdict = _judge(course, lambda: check.missing(part, case) or absent)
    return verdict if verdict.share > 0 else absent


def _judge(course: Course, judge: Callable[[], Verdict]) -> Verdict:
    """Return a check's verdict; leave the answer to a person if calculating with it fails or takes too long.

    Raises
    ------
    KeyFault
        If the check fails by an error that is the key's fault, not the answer's.
    """
    try:
        # An answer may have the largest numbers there are, and be built to be slow.
        with np.errstate(all="ignore"), time_limited(_TIME_LIMIT):
            return judge()
    except (ArithmeticError, LookupError, ValueError, MemoryError, RuntimeError, CourseError) as error:
        why = Problem.of(Code.NOT_COMPARED, error=f"{type(error).__name__}: {error}")
        return Verdict(Status.FOR_A_PERSON, 0.0, why)
    except Exception as error:
        raise KeyFault(error_and_line(course, error)) from error


def error_and_line(course: Course, error: Exception) -> str:
    """Return an error as text, with file and line of the course's last code that it passed.

    If it passed none in the course's folder and packages, they are those of the last code outside of labcourse.
    """
    engine = Path(labcourse.__file__).resolve().parent
    own = [folder.resolve() for folder in (course.folder, *map(package_folder, course.packages))]
    frames = [(Path(frame.filename).resolve(), frame.lineno) for frame in traceback.extract_tb(error.__traceback__)]
    others = [frame for frame in frames if not frame[0].is_relative_to(engine)]
    of_course = [frame for frame in others if any(map(frame[0].is_relative_to, own))]
    place = "".join(f" ({path.name}, line {line})" for path, line in (of_course or others)[-1:])
    return f"{type(error).__name__}: {error}{place}"


def _as_text(part: Part, claims: Claims, where: tuple[str, str]) -> str:
    """Return a student's answer to a part as text, for the marks; "" if it is missing or malformed."""
    if where not in claims.values:
        return ""
    content, value = claims.contents[where], claims.values[where]
    if part.kind in ("prose", WHOLE):
        return str(content["value"])
    if part.kind in ("expression", "equation"):
        sides = (value,) if part.kind == "expression" else (value.lhs, value.rhs)
        text = " = ".join(map(str, sides))
        return text if len(text) <= _LONGEST_SHOWN else f"{text[:_LONGEST_SHOWN]}…"
    return forms.show(part, content).removeprefix(part.name).lstrip(" :=")


def unmarked(key: Key, claims: Claims) -> list[Problem]:
    """Return a note for each question that is answered and that the key does not have."""
    numbers = dict.fromkeys(number for number, _part in claims.contents if number not in key)
    return [Problem.of(Code.NOT_IN_KEY, number) for number in numbers]


def nothing_earned(
    course: Course, reason: Reason, status: Status, asked: Collection[Where] | None = None
) -> tuple[Mark, ...]:
    """Return a mark of 0 points, with this status and reason, for each part that the release asks for.

    ``asked`` is all that its release asks for; None if that is all that the course asks for.
    """
    return tuple(
        Mark(number, part.name, status, 0.0, part.points, reason)
        for number in course.key
        for part in course.catalogue.find_marked(number).parts
        if _is_asked(course, (number, part.name), asked)
    )
