"""The book in which a student's answers are kept: ``answers.json``, plain data, never lost.

The file is ``{"format": 2, "student", "bench", "software", "probe_seed", "answers": {question: {part: answer}},
"cells": {question: {part: id}}, "when": {question: {part: s since 1970}}, "predictions": {...}}``, an answer being the
plain data of :mod:`labcourse.answers.forms`, and the id that of the cell which recorded it, "" if none did (an
explorer's button). Runs by programs leave no times, so that they repeat to the byte. What was predicted of experiments
(:mod:`labcourse.answers.predictions`) is there where something was. Format 1 had no cells. It is read anew before each
change, so that two notebooks may be open at once, and is written under a temporary name and renamed, so that a crash
leaves the old one.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import labcourse
from labcourse import files
from labcourse.answers import forms, predictions, set_aside
from labcourse.answers.forms import FormError, NotAnswered
from labcourse.answers.parts import Question
from labcourse.errors import AnswerError
from labcourse.student_id import caseless

FORMAT = 2
MAX_BYTES = 1_000_000  #: of the whole file; docs/handing_in.md states it
_KEYS_1 = {"format", "student", "bench", "software", "probe_seed", "answers"}
_KEYS = {1: _KEYS_1, FORMAT: {*_KEYS_1, "cells"}}
WHEN = "when"  # of format 2, too, where a person ran the notebooks
_LATEST = 2**33  # s since 1970, in 2242; no platform can write years of many digits


@dataclass(frozen=True)
class Reply:
    """What became of the answer to one part. ``str()`` of it is the acknowledgement.

    ``refused`` says why an answer that was given is not recorded; it is empty where none was given.
    """

    question: str
    part: str
    recorded: bool
    text: str
    hints: tuple[str, ...] = ()
    refused: str = ""

    def __str__(self) -> str:
        return "\n".join([f"{self.question}  {self.text}", *(f"      hint: {hint}" for hint in self.hints)])


def parse(data: bytes) -> dict[str, Any]:
    """The content of an ``answers.json``, its outer form checked; answers are read with :func:`forms.decode`.

    Raises
    ------
    AnswerError
        If it is too large, is no JSON, or is not such a file.
    """
    if len(data) > MAX_BYTES:
        raise AnswerError(f"It has {len(data)} bytes; {MAX_BYTES} at most are read.")
    try:
        content = files.from_json(data, parse_constant=_refuse_constant)
    except ValueError as error:
        raise AnswerError(f"It is not JSON: {error}") from None
    number = content.get("format") if isinstance(content, dict) else None
    if not isinstance(number, int | None) or isinstance(number, bool) or number not in (None, *_KEYS):
        raise AnswerError(f"Its format is {repr(number)[:20]}; this version reads up to format {FORMAT}.")
    if not isinstance(content, dict) or content.keys() - {WHEN, predictions.SECTION} != _KEYS[number or FORMAT]:
        raise AnswerError(f"It should be an object with {', '.join(sorted(_KEYS[FORMAT]))}.")
    seed = content["probe_seed"]
    if not isinstance(seed, int) or isinstance(seed, bool) or seed < 0:
        raise AnswerError("Its probe_seed should be a non-negative integer.")
    if not isinstance(content["student"], str) or not isinstance(content["bench"], dict):
        raise AnswerError("Its student should be text, and its bench an object.")
    answers = content["answers"]
    if not isinstance(answers, dict) or not all(
        isinstance(parts, dict) and all(isinstance(answer, dict) for answer in parts.values())
        for parts in answers.values()
    ):
        raise AnswerError("Its answers should be objects by question and part.")
    cells = content.setdefault("cells", {})
    if not isinstance(cells, dict) or not all(
        isinstance(parts, dict) and all(isinstance(cell, str) for cell in parts.values()) for parts in cells.values()
    ):
        raise AnswerError("Its cells should be ids by question and part.")
    times = content.get(WHEN, {})
    if not isinstance(times, dict) or not all(
        isinstance(parts, dict) and all(type(time) is int and 0 <= time < _LATEST for time in parts.values())
        for parts in times.values()
    ):
        raise AnswerError("Its times should be seconds by question and part.")
    if not predictions.well_formed(content.get(predictions.SECTION, {})):
        raise AnswerError("Its predictions should be answers and a sentence by question.")
    return content


def _refuse_constant(name: str) -> float:
    raise ValueError(f"{name} is not a number")


def _identity(seen: os.stat_result) -> tuple[int, ...]:
    """What tells a file from any other that bears, or bore, its name."""
    return seen.st_dev, seen.st_ino, seen.st_size, seen.st_mtime_ns


class AnswerBook:
    """A student's answers, and the file that they are kept in.

    Parameters
    ----------
    path : of the file; it is written when the first answer is recorded
    student : whose answers these are
    bench : identity of the bench, plain data
    probe_seed : from which the inputs of functions are drawn
    clock : tells when an answer is recorded, s since 1970; None where a program runs the notebooks

    Attributes
    ----------
    notices : what happened that the student should know, such as a broken file that was put aside
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        student: str,
        bench: Mapping[str, Any],
        probe_seed: int,
        clock: Callable[[], float] | None = None,
    ) -> None:
        self.path = Path(path)
        self.student = student
        self.bench = dict(bench)
        self.probe_seed = probe_seed
        self._clock = clock
        self.notices: list[str] = []
        self._known: tuple[int, ...] | None = None  # the file as it was read or written last
        self.refresh()

    def refresh(self) -> None:
        """Read the file again if it has changed: another notebook may have written to it."""
        try:
            found = _identity(self.path.stat())
        except OSError:
            found = None
        if found is None or found != self._known:
            self._predictions: dict[str, dict[str, Any]] = {}
            self._most_bytes = len(self._text({}, {}, {}))  # that the file has with these answers
            content = self._load()
            self._predictions = content.get(predictions.SECTION, {})
            self._answers: dict[str, dict[str, Any]] = content.get("answers", {})
            self._cells: dict[str, dict[str, str]] = content.get("cells", {})
            self._when: dict[str, dict[str, int]] = content.get(WHEN, {})
            self._known = found

    def cell(self, question: str, part: str) -> str:
        """The id of the cell that recorded the answer to a part; "" if none did, or if it is not known."""
        return self._cells.get(question, {}).get(part, "")

    def get(self, question: str, part: str) -> dict[str, Any] | None:
        """The stored answer to a part as plain data, or None."""
        answer: dict[str, Any] | None = self._answers.get(question, {}).get(part)
        return answer

    def answer(self, question: Question, values: Mapping[str, Any], cell: str = "") -> list[Reply]:
        """Check the form of answers to some parts of a question and record those that have it.

        An earlier answer is kept where there is nothing yet, or something of another form.

        Parameters
        ----------
        question : which
        values : part's name → what is given
        cell : id of the notebook's cell that gives it; "" if none does

        Raises
        ------
        AnswerError
            If the question has no such part (nothing is recorded then), or if the file cannot be written.
        """
        parts = [question.part(name) for name in values]
        if not parts:
            raise AnswerError(f"Question {question.number} takes {', '.join(question.names)}; nothing was given.")
        self.refresh()
        replies = []
        for part in parts:
            stored = self.get(question.number, part.name)
            kept = " (the earlier answer is kept)" if stored else ""
            try:
                encoded = forms.encode(part, values[part.name], self.probe_seed)
                self._record(question.number, part.name, encoded.content, cell)
            except NotAnswered:
                text = f"{part.name}  not answered yet{kept}"
                replies.append(Reply(question.number, part.name, False, text))
            except FormError as error:
                text = f"{part.name}  not recorded: {error}{kept}"
                replies.append(Reply(question.number, part.name, False, text, refused=str(error)))
            else:
                text = f"{forms.show(part, encoded.content)}  recorded"
                replies.append(Reply(question.number, part.name, True, text, encoded.hints))
        if any(reply.recorded for reply in replies):
            self._save()
        return replies

    # --- predictions ---------------------------------------------------------------------------------------------

    def predicted(self, question: str) -> dict[str, Any]:
        """What was predicted of a question's experiment: see :mod:`labcourse.answers.predictions`."""
        return self._predictions.get(question, {})

    def predict(self, question: str, said: Mapping[str, dict[str, Any]], why: str | None = None) -> None:
        """Keep predictions, of which those stand that were there before, and what is thought of them afterwards.

        Parameters
        ----------
        question : number
        said : name → plain data of an answer
        why : a sentence, which takes the place of an earlier one; None to leave that

        Raises
        ------
        AnswerError
            If the file cannot be written.
        """
        self.refresh()
        before = self.predicted(question)
        kept = {**before, predictions.SAID: {**said, **before.get(predictions.SAID, {})}}
        if why is not None:
            kept[predictions.WHY] = why
        self._predictions = {**self._predictions, question: kept}
        self._save()

    # --- recording -----------------------------------------------------------------------------------------------

    def _record(self, question: str, part: str, content: dict[str, Any], cell: str) -> None:
        """Put an answer in its place, unless the file would grow too large with it."""
        cells = {**self._cells, question: {**self._cells.get(question, {}), part: cell}}
        changed = {**self._answers, question: {**self._answers.get(question, {}), part: content}}
        times = self._when
        if self._clock is not None:
            times = {**times, question: {**times.get(question, {}), part: int(self._clock())}}
        # Mostly the size of the answer by itself shows that it fits, and the whole need not be serialised to see it.
        new = [{question: {part: value}} for value in (content, cell, times.get(question, {}).get(part))]
        self._most_bytes += len(json.dumps(new)) + 2
        if self._most_bytes > MAX_BYTES:
            self._most_bytes = len(self._text(changed, cells, times))
            if self._most_bytes > MAX_BYTES:
                raise FormError(
                    f"with it, {self.path.name} would be larger than {MAX_BYTES} bytes: give smaller figures"
                )
        self._answers, self._cells, self._when = changed, cells, times

    # --- the file ------------------------------------------------------------------------------------------------

    def _text(self, answers: Mapping[str, Any], cells: Mapping[str, Any], times: Mapping[str, Any]) -> bytes:
        content = {
            "format": FORMAT,
            "student": self.student,
            "bench": self.bench,
            "software": f"labcourse {labcourse.__version__}",
            "probe_seed": self.probe_seed,
            "answers": answers,
            "cells": cells,
            **({WHEN: times} if times else {}),
            **({predictions.SECTION: self._predictions} if self._predictions else {}),
        }
        return (json.dumps(content, allow_nan=False, sort_keys=True) + "\n").encode()

    def _save(self) -> None:
        text = self._text(self._answers, self._cells, self._when)
        if len(text) > MAX_BYTES:  # else it could not be read again
            raise AnswerError(f"{self.path.name} would be larger than {MAX_BYTES} bytes. The answer is not kept.")
        try:
            self._known = _identity(files.write(self.path, text))
        except OSError as error:
            raise AnswerError(
                f"{self.path.name} cannot be written: {error.strerror}. The answer is not kept."
            ) from error

    def _load(self) -> dict[str, Any]:
        """What the file holds. One that is broken, or another student's, is put aside under another name."""
        try:
            data = files.read(self.path)
        except FileNotFoundError:
            return {}
        except OSError as error:
            raise AnswerError(f"{self.path.name} cannot be read: {error.strerror}.") from error
        try:
            content = parse(data)
            json.dumps(content, allow_nan=False)  # a number beyond all floats could not be saved again
            self._most_bytes += len(data)
        except (AnswerError, ValueError) as error:
            aside = set_aside.set_aside(self.path, "broken")
            self.notices.append(
                f"{self.path.name} could not be read, and was put aside as {aside}. {error} A new one is begun: "
                "run the notebooks again to answer again."
            )
            return {}
        if caseless(content["student"]) != caseless(self.student):
            aside = set_aside.set_aside(self.path, set_aside.label(content["student"]))
            self.notices.append(
                f"The answers of {content['student'][:40]!r} were put aside as {aside}. Run your notebooks again, "
                f"in order: your answers are then recorded for {self.student!r}."
            )
            return {}
        if content["probe_seed"] != self.probe_seed:
            # Outputs of functions belong to the inputs that another seed gave.
            content["answers"] = {
                question: {name: answer for name, answer in parts.items() if answer.get("kind") != "function"}
                for question, parts in content["answers"].items()
            }
        return content
