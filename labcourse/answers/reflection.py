"""Compare a student's own answers with each other, without the correct answers.

A course defines :class:`Check` objects; a student's session fills in the answers. Answers that do not agree become
questions to the student, never verdicts. ``course.json`` may switch this off, or allow it from some time on.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from datetime import datetime
from typing import Any

import numpy as np

from labcourse.answers.catalogue import Catalogue
from labcourse.answers.parts import Where
from labcourse.course_file import OFF, ON, REFLECT
from labcourse.errors import AnswerError, ConfigurationError, CourseError
from labcourse.messages import plural

#: What a check may raise for some student's numbers.
_COMPUTATION_ERRORS = (ArithmeticError, LookupError, TypeError, ValueError, RuntimeError, CourseError)


@dataclass(frozen=True)
class Check:
    """A comparison of a student's own answers.

    Attributes
    ----------
    about : the answers that it needs, (question, part)
    ask : their values, in that order → a question to the student; None if they agree
    """

    about: tuple[Where, ...]
    ask: Callable[..., str | None]

    @property
    def questions(self) -> list[str]:
        """The numbers of its questions, each once."""
        return list(dict.fromkeys(question for question, _part in self.about))


@dataclass(frozen=True)
class Reflection:
    """The result of some checks.

    Attributes
    ----------
    asked : numbers of the questions to look at, and the question to the student
    compared : how many checks were made
    missing : answers that are not there yet, or cannot be read
    unclear : numbers of the questions for which a check failed to compute
    """

    asked: tuple[tuple[tuple[str, ...], str], ...]
    compared: int
    missing: tuple[Where, ...]
    unclear: tuple[str, ...]

    def __str__(self) -> str:
        return "\n".join(self._lines())

    def _lines(self) -> Iterable[str]:
        """Describe the result, a line for each question to the student."""
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
                f"Nothing can be computed from your answers to {', '.join(self.unclear)}. Are these numbers "
                "very large or zero?"
            )
        if self.missing:
            missing = ", ".join(f"{question} {part}" for question, part in self.missing)
            yield f"Not compared yet, as there is no answer: {missing}."
        if not (self.asked or self.compared or self.unclear or self.missing):
            yield "There is nothing here to compare."


def reflect(checks: Iterable[Check], find: Callable[[str, str], Any]) -> Reflection:
    """Compare a student's own answers with each other.

    Parameters
    ----------
    checks : of the course, in order
    find : (question, part) → the answer; raises AnswerError if there is none
    """
    asked: list[tuple[tuple[str, ...], str]] = []
    missing: dict[Where, None] = {}
    unclear: dict[str, None] = {}
    compared = 0
    for check in checks:
        values = []
        for where in check.about:
            try:
                values.append(find(*where))
            except AnswerError:
                missing[where] = None
        if len(values) < len(check.about):
            continue
        try:
            with np.errstate(all="ignore"):
                text = check.ask(*values)
        except _COMPUTATION_ERRORS:
            unclear |= dict.fromkeys(check.questions)
            continue
        compared += 1
        if text:
            asked.append((tuple(check.questions), text))
    return Reflection(tuple(asked), compared, tuple(missing), tuple(unclear))


def of_notebooks(checks: Iterable[Check], catalogue: Catalogue, numbers: Iterable[str]) -> list[Check]:
    """Select the checks that are possible when some notebooks are done: their last answer is asked there.

    Parameters
    ----------
    checks : of the course
    catalogue : says where questions are asked
    numbers : beginnings of the notebooks' names, as "02"; all unless given

    Raises
    ------
    AnswerError
        If there is no such notebook.
    """
    notebooks = catalogue.find_notebooks(*numbers)
    return [
        check
        for check in checks
        if max(catalogue.everything[number].notebook for number in check.questions) in notebooks
    ]


# --- the setting ------------------------------------------------------------------------------------------------------


def silence(course: Mapping[str, Any], now: datetime) -> str | None:
    """Return why answers are not compared now; None if they are.

    Parameters
    ----------
    course : content of ``course.json``
    now : with its time zone

    Raises
    ------
    ConfigurationError
        If the setting is not valid.
    """
    setting = course.get(REFLECT, ON)
    if setting == ON:
        return None
    if setting == OFF:
        return "Your instructor has switched this off. Everything else works without it."
    try:
        opens = datetime.fromisoformat(setting)  # of a date alone: midnight
    except (TypeError, ValueError):
        raise ConfigurationError(
            f'course.json: "{REFLECT}" should be "on", "off" or a date as "2026-12-01"; it is {setting!r:.80}.'
        ) from None
    opens = opens if opens.tzinfo else opens.astimezone()
    return None if now >= opens else f"Your instructor allows this from {opens:%Y-%m-%d %H:%M} on."
