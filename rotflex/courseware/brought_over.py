"""Answers that were given under a mistyped ID become those of the right one.

(Those under the right ID, which were set aside while the mistyped one worked in the folder, come back by themselves:
:mod:`rotflex.courseware.answers`.)
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rotflex.courseware import files, set_aside
from rotflex.courseware.answers import FORMAT, WHEN, parse
from rotflex.courseware.files import ANSWERS_FILE
from rotflex.courseware.messages import _, plural
from rotflex.courseware.student_id import caseless
from rotflex.errors import AnswerError, ConfigurationError

Parts = Mapping[str, Mapping[str, Any]]  # question → part → something

#: Kinds of answers that hold what an ID's own bench or inputs gave: they are nobody else's.
OF_ONE_ID = ("recording", "figure", "function")


def any_of(folder: Path, student: str) -> bool:
    """Whether a folder holds answers of a student."""
    return _of(folder / ANSWERS_FILE, student) is not None


def nothing_yet(folder: Path) -> bool:
    """Whether nobody has answered anything in a folder."""
    path = folder / ANSWERS_FILE
    return not (path.exists() or set_aside.of_anybody(path))


def refusal(folder: Path, was: str) -> str:
    """Why there is nothing to be brought over from an ID though the folder has answers; "" if there is, or none yet."""
    return "" if nothing_yet(folder) or any_of(folder, was) else _none_of(folder, was)


def bring_over(folder: Path, was: str, student: str) -> list[str]:
    """Make answers that were given under a mistyped ID those of the right one, and say what came and what did not.

    What the right ID has answered stays. The other file is set aside as it was.

    Parameters
    ----------
    folder : with the notebooks
    was, student : the mistyped ID and the right one

    Raises
    ------
    ConfigurationError
        If the folder has no answers under the mistyped ID, or the file cannot be written.
    """
    path = folder / ANSWERS_FILE
    source = _of(path, was)
    if source is None:
        raise ConfigurationError(_none_of(folder, was))
    theirs = _read(source) or {}
    own_path = _of(path, student)
    own = (_read(own_path) if own_path else None) or {}
    brought = {
        question: {name: one for name, one in parts.items() if name not in own.get("answers", {}).get(question, {})}
        for question, parts in _carried(theirs["answers"]).items()
    }
    content = {**theirs, **own, "student": student, "format": FORMAT}
    for key, values in (("answers", brought), *((key, _only(theirs.get(key, {}), brought)) for key in ("cells", WHEN))):
        if key in content:
            content[key] = _joined(values, own.get(key, {}))
    try:
        if path.exists() and own_path != path:
            there = _read(path)
            set_aside.set_aside(path, set_aside.label(there["student"]) if there else "broken")
        files.write(path, json.dumps(content, allow_nan=False, sort_keys=True) + "\n")
    except OSError as error:
        raise ConfigurationError(_("{file} cannot be written: {why}.").format(file=path, why=error.strerror)) from None
    return _told(was, student, sum(map(len, brought.values())), _left(theirs["answers"]))


def _none_of(folder: Path, was: str) -> str:
    said = _("{folder} has no answers of {was!r}: look at the ID, in quotes if it has blanks.")
    return said.format(folder=folder, was=was)


def _told(was: str, student: str, count: int, left: list[str]) -> list[str]:
    lines = [
        _("Brought over to {student!r}: {answers} that {was!r} had given.").format(
            answers=plural(count, "{count} answer", "{count} answers"), was=was, student=student
        )
    ]
    if left:
        lines.append(
            _("Not brought over: {left}. Recordings, figures and functions belong to the bench of {was!r}.").format(
                left=", ".join(left), was=was
            )
        )
    lines.append(
        _(
            "Your ID has another bench. Run your notebooks again, in order: what you measured under {was!r} was "
            "measured there."
        ).format(was=was)
    )
    return lines


def _carried(answers: Parts) -> dict[str, dict[str, Any]]:
    return {
        question: {name: one for name, one in parts.items() if one.get("kind") not in OF_ONE_ID}
        for question, parts in answers.items()
    }


def _left(answers: Parts) -> list[str]:
    """Questions and parts that are not brought over."""
    return [
        f"{question} {name}"
        for question, parts in answers.items()
        for name, one in parts.items()
        if one.get("kind") in OF_ONE_ID
    ]


def _only(known: Parts, wanted: Parts) -> dict[str, dict[str, Any]]:
    """Of what is known by question and part, that of the wanted ones."""
    found = {
        question: {name: one for name, one in parts.items() if name in wanted.get(question, {})}
        for question, parts in known.items()
    }
    return {question: parts for question, parts in found.items() if parts}


def _joined(first: Parts, then: Parts) -> dict[str, dict[str, Any]]:
    """Both, the second's where both have one."""
    joined = {question: {**first.get(question, {}), **then.get(question, {})} for question in {**first, **then}}
    return {question: parts for question, parts in joined.items() if parts}


def _of(path: Path, student: str) -> Path | None:
    """The file with a student's answers: ``answers.json``, or the newest that was set aside."""
    return next((one for one in (path, *set_aside.of_student(path, student)) if _belongs(_read(one), student)), None)


def _read(path: Path) -> dict[str, Any] | None:
    """The content of a file of answers; None if it is none that can be read."""
    try:
        return parse(path.read_bytes())
    except (OSError, AnswerError):
        return None


def _belongs(content: Mapping[str, Any] | None, student: str) -> bool:
    return content is not None and caseless(content["student"]) == caseless(student)
