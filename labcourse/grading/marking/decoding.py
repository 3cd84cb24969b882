"""An untrusted ``answers.json``, strictly read: bytes in, claims out. Nothing is evaluated or unpickled."""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from types import FrameType, MappingProxyType
from typing import Any

from labcourse.answers import answers, forms, report_files
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.parts import WHOLE, Part
from labcourse.answers.report_files import ReportFile
from labcourse.answers.words import TextAnswer
from labcourse.errors import AnswerError
from labcourse.problems import Code, Problem, Reason, Where


class TooSlow(ArithmeticError):
    """A calculation was stopped because it took too long."""


@contextlib.contextmanager
def time_limited(seconds: float) -> Iterator[None]:
    """Limit the time of a ``with`` block: raise :class:`TooSlow` in it after so many seconds, and again if it goes on.

    It works only in the main thread of a program on Linux or macOS, where answers are marked
    (:mod:`labcourse.grading.marking.marking_processes`); elsewhere there is no limit.
    """
    if threading.current_thread() is not threading.main_thread() or not hasattr(signal, "setitimer"):
        yield
        return

    def stop(number: int, frame: FrameType | None) -> None:
        """Handle the signal of the timer."""
        raise TooSlow(f"stopped after {seconds:g} s")

    previous = signal.signal(signal.SIGALRM, stop)
    # The timer repeats: code in the block may catch the first TooSlow as an error of arithmetic.
    signal.setitimer(signal.ITIMER_REAL, seconds, max(seconds / 10, 0.01))
    try:
        yield
    finally:
        try:
            signal.setitimer(signal.ITIMER_REAL, 0)
        finally:
            signal.signal(signal.SIGALRM, previous)


_MOST_NOTES = 20  # lines
_SHOWN = 40  # characters of untrusted text in a note
_TIME_LIMIT = 5.0  # s for one answer; it takes milliseconds


@dataclass
class Claims:
    """What a run claims to have answered.

    Attributes
    ----------
    student : ID of who answered, as the file claims
    bench : what the file claims of the bench on which it was made, as plain data
    values : (question, part) → value, see :func:`labcourse.answers.forms.decode`
    contents : (question, part) → the plain data that it was read from
    malformed : (question, part) → why the data is not an answer to it
    waiting : (question, part) that were marked, and wait for a person because they follow from an absurd answer
    problems, notes : what the instructor should read, and what they may read
    """

    student: str = ""
    bench: Mapping[str, Any] = field(default_factory=dict)
    values: dict[tuple[str, str], Any] = field(default_factory=dict)
    contents: dict[tuple[str, str], dict[str, Any]] = field(default_factory=dict)
    malformed: dict[tuple[str, str], str] = field(default_factory=dict)
    waiting: set[tuple[str, str]] = field(default_factory=set)
    problems: list[Reason] = field(default_factory=list)
    notes: list[Reason] = field(default_factory=list)


def decode(data: bytes | None, probe_seed: int, catalogue: Catalogue) -> Claims:
    """Read the bytes of an ``answers.json``.

    Parameters
    ----------
    data : as the run left them; None if it left no file
    probe_seed : from which the inputs of functions were to be drawn; with another seed in the file, its functions are
        malformed
    catalogue : of what can be answered

    Returns
    -------
    Claims
        What can be read; problems and notes say what cannot.
    """
    claims = Claims()
    if data is None:
        claims.notes.append(Problem.of(Code.NO_ANSWERS_LEFT))
        return claims
    try:
        content = answers.parse(data)
    except AnswerError as error:
        claims.problems.append(Problem.of(Code.ANSWERS_UNREAD, error=str(error)))
        return claims
    import sympy  # noqa: F401 - here, before the time of an answer begins: a starved machine needs longer for it

    claims.student, claims.bench = content["student"], content["bench"]
    for number, parts in content["answers"].items():
        for name, answer in parts.items():
            _add_answer(claims, catalogue, number, name, answer)
    if content["probe_seed"] != probe_seed:  # outputs on other inputs than those that were drawn say nothing
        for where in [where for where in claims.values if claims.contents[where]["kind"] == "function"]:
            del claims.values[where]
            claims.malformed[where] = "The function was not tried on the inputs that were drawn for it."
    if len(claims.notes) > _MOST_NOTES:
        claims.notes[_MOST_NOTES:] = [Problem.of(Code.MORE_OF_THIS_SORT, count=len(claims.notes) - _MOST_NOTES)]
    return claims


def _find_part(catalogue: Catalogue, number: str, name: str) -> Part | None:
    """Return the part of a question by number and name; None if there is none.

    ``Catalogue.find`` would look for similar names: too slow for thousands of hostile ones.
    """
    question = catalogue.everything.get(number)
    return question.part(name) if question is not None and name in question.names else None


def _add_answer(claims: Claims, catalogue: Catalogue, number: str, name: str, answer: dict[str, Any]) -> None:
    """Decode one answer, and add it to the claims: as a value, as malformed, or as a note if there is no such part."""
    part = _find_part(catalogue, number, name)
    if part is None:
        claims.notes.append(Problem.of(Code.ANSWER_TO_NOTHING, number=number[:_SHOWN], name=name[:_SHOWN]))
        return
    claims.contents[number, name] = answer
    try:
        with time_limited(_TIME_LIMIT):  # an expression can be built to be slow, or larger than anything can hold
            claims.values[number, name] = forms.decode(part, answer)
    except AnswerError as error:
        claims.malformed[number, name] = str(error)
    except (ArithmeticError, ValueError, RecursionError, MemoryError) as error:
        claims.malformed[number, name] = f"It cannot be worked out ({type(error).__name__})."


def add_words(claims: Claims, written: Mapping[Where, TextAnswer], catalogue: Catalogue) -> None:
    """Add the texts of the saved notebooks to the claims of a run, in place of what the run recorded for these parts.

    Parameters
    ----------
    claims : of a run
    written : (question, part) → text, see :mod:`labcourse.answers.words`
    catalogue : of what can be answered
    """
    for where, text in written.items():
        part = _find_part(catalogue, *where)
        if part is not None and part.kind == "prose":
            for claimed in (claims.malformed, claims.values, claims.contents):
                claimed.pop(where, None)
            _add_answer(claims, catalogue, *where, {"kind": "prose", "value": text.text})


def with_reports(
    claims: Claims, catalogue: Catalogue, in_pdf: Mapping[str, ReportFile] = MappingProxyType({})
) -> Claims:
    """Return claims that also have each report as a whole: its texts under their headings, if any is written.

    So a person who judges the report sees all of it, and their mark lapses when one of its texts changes. A PDF that
    was handed in is named in the report, with its digest. If students wrote the PDF themselves, it may have a text that
    the notebook lacks: then the PDF is claimed as the answer to that part, for a person to look at.

    Parameters
    ----------
    claims : with the texts of the notebooks; they do not change, but both share the lists of messages
    catalogue : of what can be answered
    in_pdf : number of a report → the PDF that was handed in
    """
    added = replace(claims, values=dict(claims.values), contents=dict(claims.contents))
    for number, pdf in in_pdf.items():
        for name in catalogue.reports[number].names if pdf.own and number in catalogue.reports else ():
            if (number, name) not in claims.values and (number, name) not in claims.malformed:
                added.values[number, name] = pdf.given
                added.contents[number, name] = {"kind": "prose", "value": pdf.given}
    for number, question in catalogue.judged.items():
        report = catalogue.reports[catalogue.report_judged[number]]
        places = {name: (report.number, name) for name in report.names}
        texts = {name: claims.contents[where]["value"] for name, where in places.items() if where in claims.values}
        pieces = [report_files.in_one_piece(catalogue.items(report.number), texts)] if texts else []
        pieces += [in_pdf[report.number].given] if report.number in in_pdf else []
        if pieces:
            text = "\n\n".join(pieces)
            added.values.update({(number, name): text for name in question.names})
            added.contents.update({(number, name): {"kind": WHOLE, "value": text} for name in question.names})
    return added
