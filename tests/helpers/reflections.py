"""What ``lab.reflect()`` asks of a file of answers."""

from __future__ import annotations

import contextlib
import io
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

import rotflex.lab
from rotflex.courseware import answers, forms
from rotflex.courseware.reflection import reflect
from rotflex.errors import AnswerError
from rotflex.workbook.questions import CATALOGUE


@cache
def lab_of(student: str) -> rotflex.lab.Lab:
    """A student's session, without answers."""
    with contextlib.redirect_stdout(io.StringIO()):
        return rotflex.lab.start(student, folder=Path(tempfile.gettempdir(), "no such folder"), quiet=True)


NOTHING = ((), (), ())


def asked_of(student: str, data: bytes) -> tuple[tuple[Any, ...], tuple[Any, ...], tuple[Any, ...]]:
    """What the answers in a file ask each other, what is missing for that, and what could not be read."""
    given = answers.parse(data)["answers"]

    def find(question: str, part: str) -> Any:
        content = given.get(question, {}).get(part)
        if content is None:
            raise AnswerError("there is none")
        return forms.decode(CATALOGUE.find(question).part(part), content)

    found = reflect(lab_of(student).checks(), find)
    return found.asked, found.missing, found.unclear
