"""What a student's own answers ask each other: held against one another, and against no key.

A course gives :class:`Check` objects; a student's session puts their own answers in. What does not agree becomes a
question to the student, never a verdict. ``course.json`` may switch all of it off, or say from when on it asks.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from datetime import date, datetime, time
from typing import Any

import numpy as np

from labcourse.answers.catalogue import Catalogue, enumeration
from labcourse.course_file import OFF, ON, REFLECT
from labcourse.errors import AnswerError, ConfigurationError, CourseError
from labcourse.messages import plural

Where = tuple[str, str]  # question, part


@dataclass(frozen=True)
class Check:
    """Own answers that can be held against each other.

    Attributes
    ----------
    about : the answers that it needs, (question, part)
    ask : their values, in that order → a question in words, "" where they agree
    """

    about: tuple[Where, ...]
    ask: Callable[..., str]

    @property
    def questions(self) -> list[str]:
        """The numbers of the questions that it is about, each once."""
        return list(dict.fromkeys(question for question, _part in self.about))


@dataclass(frozen=True)
class Reflection:
    """What some checks have to ask.

    Attributes
    ----------
    asked : numbers of the questions to look at, and what is asked
    compared : how many checks were made
    missing : answers that are not there yet, or cannot be read
    unclear : numbers of questions of which something could not be worked out
    """

    asked: tuple[tuple[tuple[str, ...], str], ...]
    compared: int
    missing: tuple[Where, ...]
    unclear: tuple[str, ...]

    def __str__(self) -> str:
        return "\n".join(self._lines())

    def _lines(self) -> Iterable[str]:
        if self.asked:
            yield plural(
                len(self.asked),
                "{count} question, from your own answers alone.",
                "{count} questions, from your own answers alone. Begin with the first: others may go away with it.",
            )
            for numbers, text in self.asked:
                yield f"  {', '.join(numbers)}: {text}"
        elif self.compared:
            compared = plural(self.compared, "{count} comparison", "{count} comparisons")
            yield f"Nothing to ask: your answers agree with each other ({compared}). Right or wrong, this cannot say."
        if self.unclear:
            yield (
                f"Not to be worked out from what is there: {enumeration(list(self.unclear))}. Are these numbers "
                "very large or zero?"
            )
        if self.missing:
            yield "Not looked at yet, for there is no answer: {answers}.".format(
                answers=", ".join(f"{question} {part}" for question, part in self.missing)
            )
        if not (self.asked or self.compared or self.unclear or self.missing):
            yield "There is nothing here that could be held against anything else."


def reflect(checks: Iterable[Check], find: Callable[[str, str], Any]) -> Reflection:
    """Hold a student's own answers against each other.

    Parameters
    ----------
    checks : of the course, in order
    find : (question, part) → the answer; raises AnswerError where there is none
    """
    asked: list[tuple[tuple[str, ...], str]] = []
    missing: dict[Where, None] = {}
    unclear: dict[str, None] = {}
    compared = 0
    for check in checks:
        values, lacking = _values(check.about, find)
        missing |= dict.fromkeys(lacking)
        if lacking:
            continue
        try:
            with np.errstate(all="ignore"):
                text = check.ask(*values)
        except (
            ArithmeticError,
            LookupError,
            TypeError,
            ValueError,
            RuntimeError,
            CourseError,
        ):  # of numbers as a student may give
            unclear |= dict.fromkeys(check.questions)
            continue
        compared += 1
        if text:
            asked.append((tuple(check.questions), text))
    return Reflection(tuple(asked), compared, tuple(missing), tuple(unclear))


def _values(about: Iterable[Where], find: Callable[[str, str], Any]) -> tuple[list[Any], list[Where]]:
    values, lacking = [], []
    for where in about:
        try:
            values.append(find(*where))
        except AnswerError:
            lacking.append(where)
    return values, lacking


def of_notebooks(checks: Iterable[Check], catalogue: Catalogue, numbers: Iterable[str]) -> list[Check]:
    """The checks that can be made when some notebooks are done: those whose last answer is asked for there.

    Parameters
    ----------
    checks : of the course
    catalogue : says where questions are asked
    numbers : how the notebooks' names begin, as "02"; all unless given

    Raises
    ------
    AnswerError
        If there is no such notebook.
    """
    wanted = list(numbers)
    for number in wanted:
        if not isinstance(number, str) or not number or not any(n.startswith(number) for n in catalogue.notebooks):
            raise AnswerError(
                f"There is no notebook {number!r} with questions; there are {', '.join(catalogue.notebooks)}."
            )
    found = list(checks)
    if not wanted:
        return found
    return [one for one in found if _asked_last(one, catalogue).startswith(tuple(wanted))]


def _asked_last(check: Check, catalogue: Catalogue) -> str:
    return max(catalogue.everything[question].notebook for question in check.questions)


# --- the setting ------------------------------------------------------------------------------------------------------


def silence(course: Mapping[str, Any], now: datetime) -> str:
    """Why nothing is asked in a course at a time; "" where it is.

    Parameters
    ----------
    course : what course.json says
    now : with its time zone

    Raises
    ------
    ConfigurationError
        If the setting is none.
    """
    said = course.get(REFLECT, ON)
    if said == ON:
        return ""
    if said == OFF:
        return "It is switched off in this course: whoever teaches it decided so. All else works without it."
    opens = _instant(said)
    if now >= opens:
        return ""
    return f"It asks from {opens:%Y-%m-%d %H:%M} on: whoever teaches this course decided so."


def _instant(said: Any) -> datetime:
    try:
        if isinstance(said, str) and len(said) <= len("2026-12-01"):
            opens = datetime.combine(date.fromisoformat(said), time())
        else:
            opens = datetime.fromisoformat(said)
    except (TypeError, ValueError):
        raise ConfigurationError(
            f'course.json: "{REFLECT}" should be "on", "off" or a date as "2026-12-01"; it is {said!r:.80}.'
        ) from None
    return opens if opens.tzinfo else opens.astimezone()
