"""What ``lab.reflect()`` asks of a file of answers."""

import contextlib
import io
import tempfile
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

from working_through import ASKED, Where

import rotflex.course.lab
from labcourse.answers import answers, forms
from labcourse.answers.reflection import Comparison, Reflection, reflect
from labcourse.errors import AnswerError
from rotflex.course.questions import CATALOGUE


@cache
def lab_of(student: str) -> rotflex.course.lab.Lab:
    """A student's session, without answers."""
    with contextlib.redirect_stdout(io.StringIO()):
        return rotflex.course.lab.start(student, folder=Path(tempfile.gettempdir(), "no such folder"), quiet=True)


Said = tuple[tuple[Any, ...], tuple[Any, ...], tuple[Any, ...]]
NOTHING: Said = ((), (), ())


def said_by(found: Reflection) -> Said:
    """What is asked, what is missing for other questions, and what could not be compared."""
    return tuple(found.asked), tuple(found.missing), tuple(found.unclear)


def usual_checks(student: str) -> list[Comparison]:
    """What can be compared in a class without optional notebooks."""
    return [check for check in lab_of(student).checks() if ASKED.everything.keys() >= set(check.questions)]


def stored(given: Mapping[Where, Any], seed: int) -> dict[Where, Any]:
    """Answers as a file has them, and read again."""
    parts = {where: CATALOGUE.find(where[0]).part(where[1]) for where in given}
    return {where: forms.decode(part, forms.encode(part, given[where], seed).content) for where, part in parts.items()}


def asked_of(student: str, data: bytes) -> Reflection:
    """What the answers in a file ask each other."""
    given = answers.parse(data)["answers"]

    def find(question: str, part: str) -> Any:
        content = given.get(question, {}).get(part)
        if content is None:
            raise AnswerError("there is none")
        return forms.decode(ASKED.find(question).part(part), content)

    return reflect(usual_checks(student), find)
