"""An untrusted ``answers.json``, strictly read: bytes in, claims out. Nothing is evaluated or unpickled."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

from labcourse.answers import answers, expressions, forms, report_files
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.parts import WHOLE
from labcourse.answers.report_files import ReportFile
from labcourse.answers.words import Words
from labcourse.errors import AnswerError
from labcourse.grading.marking.time_limit import within

MAX_DEPTH = 60  #: lists and objects in each other; an expression may have 40 levels of its own
MAX_INTEGER = expressions.MAX_INTEGER  #: those of an expression are the largest that there are
_MOST_NOTES = 20  # lines
_SHOWN = 40  # characters of untrusted text in a note
_PATIENCE = 5.0  # s for one answer; it takes milliseconds


@dataclass
class Claims:
    """What a run claims to have answered.

    Attributes
    ----------
    student, bench : whose answers, and on which bench, by their own account
    values : (question, part) → value, see :func:`labcourse.answers.forms.decode`
    contents : (question, part) → the plain data that it was read from
    malformed : (question, part) → why the data is not an answer to it
    problems, notes : what an instructor should, or may want to, know
    """

    student: str = ""
    bench: Mapping[str, Any] = field(default_factory=dict)
    values: dict[tuple[str, str], Any] = field(default_factory=dict)
    contents: dict[tuple[str, str], dict[str, Any]] = field(default_factory=dict)
    malformed: dict[tuple[str, str], str] = field(default_factory=dict)
    problems: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def decode(data: bytes | None, probe_seed: int, catalogue: Catalogue) -> Claims:
    """Read the bytes of an ``answers.json``; None is a file that is not there.

    Parameters
    ----------
    data : as the run left them
    probe_seed : from which the inputs of functions were to be drawn
    catalogue : of what can be answered
    """
    claims = Claims()
    if data is None:
        claims.notes.append("No answer was recorded when the notebooks were run.")
        return claims
    try:
        _strict(data)
        content = answers.parse(data)
    except AnswerError as error:
        claims.problems.append(f"answers.json cannot be read. {error}")
        return claims
    import sympy  # noqa: F401 - here, before the time of an answer begins: a starved machine needs longer for it

    claims.student, claims.bench = content["student"], content["bench"]
    for number, parts in content["answers"].items():
        for name, answer in parts.items():
            _claim(claims, catalogue, number, name, answer)
    if content["probe_seed"] != probe_seed:
        _drop_functions(claims, catalogue)
    if len(claims.notes) > _MOST_NOTES:
        claims.notes[_MOST_NOTES:] = [f"And {len(claims.notes) - _MOST_NOTES} more of this sort."]
    return claims


def _claim(claims: Claims, catalogue: Catalogue, number: str, name: str, answer: dict[str, Any]) -> None:
    """Read one answer."""
    # Not by find(), which takes its time to look for what may have been meant: there may be thousands of them.
    everything = catalogue.everything
    if number not in everything or name not in everything[number].names:
        claims.notes.append(f"Ignored an answer to {number[:_SHOWN]!r}, {name[:_SHOWN]!r}: there is no such thing.")
        return
    claims.contents[number, name] = answer
    try:
        with within(_PATIENCE):  # an expression can be built to be slow, or larger than anything can hold
            claims.values[number, name] = forms.decode(everything[number].part(name), answer)
    except AnswerError as error:
        claims.malformed[number, name] = str(error)
    except (ArithmeticError, ValueError, RecursionError, MemoryError) as error:
        claims.malformed[number, name] = f"It cannot be worked out ({type(error).__name__})."


def with_words(claims: Claims, written: Mapping[tuple[str, str], Words], catalogue: Catalogue) -> Claims:
    """Claims with the answers in words that the saved notebooks hold; they count before what a run recorded.

    Parameters
    ----------
    claims : of a run; they stay as they are
    written : (question, part) → words, see :mod:`labcourse.answers.words`
    catalogue : of what can be answered
    """
    found = replace(
        claims,
        values=dict(claims.values),
        contents=dict(claims.contents),
        malformed=dict(claims.malformed),
        problems=list(claims.problems),
        notes=list(claims.notes),
    )
    everything = catalogue.everything
    for (number, name), words in written.items():
        if number in everything and name in everything[number].names and everything[number].part(name).kind == "prose":
            found.malformed.pop((number, name), None)
            for kept in (found.values, found.contents):
                kept.pop((number, name), None)
            _claim(found, catalogue, number, name, {"kind": "prose", "value": words.text})
    return found


def with_reports(
    claims: Claims, catalogue: Catalogue, in_pdf: Mapping[str, ReportFile] = MappingProxyType({})
) -> Claims:
    """Claims with each report as a whole, where anything of it is written: all of its texts, under their headings.

    So a person who judges it has all of it before them, and their mark lapses when a text of it is changed. A PDF that
    was handed in is part of it, by its digest. Where it is the student's own, a text that is not in its cell may be in
    there: what is claimed then is the PDF, for a person to look.

    Parameters
    ----------
    claims : with the answers in words; they stay as they are, but for the messages, which both have
    catalogue : of what can be answered
    in_pdf : number of a report → the PDF that was handed in
    """
    found = replace(claims, values=dict(claims.values), contents=dict(claims.contents))
    for number, one in in_pdf.items():
        for name in catalogue.reports[number].names if one.own and number in catalogue.reports else ():
            if (number, name) not in claims.values and (number, name) not in claims.malformed:
                found.values[number, name] = one.given
                found.contents[number, name] = {"kind": "prose", "value": one.given}
    for number, question in catalogue.judged.items():
        report = catalogue.reports[catalogue.report_judged[number]]
        where = {name: (report.number, name) for name in report.names}
        texts = {name: claims.contents[place]["value"] for name, place in where.items() if place in claims.values}
        pdf = in_pdf.get(report.number)
        if texts or pdf is not None:
            pieces = [report_files.in_one_piece(catalogue.items(report.number), texts)] if texts else []
            text = "\n\n".join([*pieces, *([pdf.given] if pdf is not None else [])])
            for name in question.names:
                found.values[number, name] = text
                found.contents[number, name] = {"kind": WHOLE, "value": text}
    return found


def _drop_functions(claims: Claims, catalogue: Catalogue) -> None:
    """Outputs on other inputs than those that were drawn say nothing."""
    for where in [where for where in claims.values if catalogue.everything[where[0]].part(where[1]).kind == "function"]:
        del claims.values[where]
        claims.malformed[where] = "The function was not tried on the inputs that were drawn for it."


# --- JSON, strictly ---------------------------------------------------------------------------------------------------


def _strict(data: bytes) -> None:
    """Refuse what JSON allows and no ``lab.answer`` writes.

    Raises
    ------
    AnswerError
        If there are names twice in an object, larger integers than an answer can have, or more levels.
    """
    if len(data) > answers.MAX_BYTES:
        return  # refused, with its own message, by what reads it next
    try:
        content = json.loads(data, object_pairs_hook=_unique, parse_int=_bounded)
    except RecursionError:
        raise AnswerError("It is nested too deeply.") from None
    except ValueError as error:
        raise AnswerError(f"It is not JSON: {error}") from None
    level, depth = [content], 0
    while level:
        depth += 1
        if depth > MAX_DEPTH:
            raise AnswerError("It is nested too deeply.")
        level = [inner for item in level if isinstance(item, list | dict) for inner in _inside(item)]


def _inside(item: list[Any] | dict[str, Any]) -> list[Any]:
    return list(item.values()) if isinstance(item, dict) else item


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    content = dict(pairs)
    if len(content) != len(pairs):
        raise ValueError("a name is there twice in one object")
    return content


def _bounded(digits: str) -> int:
    if len(digits) > 25 or abs(int(digits)) > MAX_INTEGER:
        raise ValueError("an integer is too large")
    return int(digits)
