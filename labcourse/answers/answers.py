"""The answer book, which stores a student's answers in ``answers.json``: plain data, never lost.

The file's form is that of ``answers.schema.json`` (:mod:`labcourse.answers.schema`). It is locked and read anew before
each change, so that two notebooks may record at once. It is written under a temporary name and renamed, so that a crash
leaves the old one.
"""

from __future__ import annotations

import contextlib
import errno
import itertools
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any

import labcourse
from labcourse import files, job
from labcourse.answers import forms, json_values
from labcourse.answers.forms import FormError, NotAnswered
from labcourse.answers.parts import Part, Question
from labcourse.errors import AnswerError
from labcourse.patterns import ANSWER, pattern
from labcourse.problems import Where
from labcourse.student_id import caseless

MAX_BYTES = ANSWER  #: of the whole file; docs/handing_in.md states it
_NO_FILE_NAME = pattern(r"[^\w.-]+", ANSWER)
_Sections = dict[str, dict[str, dict[str, Any]]]  # answers, cells, predictions: by question


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
    """Parse an ``answers.json`` and check its outer form; answers are read with :func:`forms.decode`.

    Raises
    ------
    AnswerError
        If it is too large, is not JSON, or is not such a file.
    """
    from labcourse.answers import schema

    if len(data) > MAX_BYTES:
        raise AnswerError(f"It has {len(data)} bytes; {MAX_BYTES} at most are read.")
    content: dict[str, Any] = schema.load(data)
    schema.check_file(content)
    return {"cells": {}, **content}


def content_of(data: bytes | None) -> dict[str, Any]:
    """Return the content of an ``answers.json`` as :func:`parse` does; {} if there is none, or it cannot be read."""
    try:
        return parse(data or b"")
    except AnswerError:
        return {}


def by_part(content: Mapping[str, Any]) -> dict[Where, dict[str, Any]]:
    """Return (question, part) → answer of what :func:`content_of` returned."""
    given = content.get("answers", {})
    return {(question, part): answer for question, parts in given.items() for part, answer in parts.items()}


def student_in(data: bytes | None) -> str:
    """Return the student whom an ``answers.json`` names; "" if there is none, or it cannot be read."""
    student = files.object_in(data or b"").get("student")
    return student if isinstance(student, str) else ""


def set_aside(path: Path, why: str) -> str:
    """Rename a file to a name that is not taken, as in ``answers.broken.json``, and return that name."""
    for count in itertools.count(1):
        suffix = f"-{count}" if count > 1 else ""
        aside = path.with_name(f"{path.stem}.{why}{suffix}{path.suffix}")
        if not aside.exists():
            break
    files.replace_file(path, aside)
    return aside.name


class AnswerBook:
    """A student's answers, and the file in which they are stored.

    Parameters
    ----------
    path : of the file; it is written when the first answer is recorded
    student : who answers
    bench : identity of the bench, plain data
    probe_seed : from which the inputs of functions are drawn

    Attributes
    ----------
    notices : messages for the student, such as about a broken file that was put aside
    """

    def __init__(self, path: Path, student: str, bench: Mapping[str, Any], probe_seed: int) -> None:
        self.path = path
        self.student = student
        self.bench = dict(bench)
        self.probe_seed = probe_seed
        self.notices: list[str] = []
        self._version: tuple[int, ...] | None = None  # of the file as it was read or written last
        self._is_warned = False  # that the file cannot be locked
        self.refresh()

    def refresh(self) -> None:
        """Read the file again if it has changed: another notebook may have written to it."""
        version = files.version(self.path)
        if version is None:
            self._sections: _Sections = {"answers": {}, "cells": {}}
        elif version != self._version:
            with self._locked():
                self._version = version

    def get(self, question: str, part: str) -> dict[str, Any] | None:
        """Return the stored answer to a part as plain data, or None."""
        answer: dict[str, Any] | None = self._sections["answers"].get(question, {}).get(part)
        return answer

    def answer(self, question: Question, values: Mapping[str, Any], cell: str = "") -> list[Reply]:
        """Check the form of answers to some parts of a question and record those that have it.

        Where nothing is given, or it has another form, an earlier answer stays.

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
        replies = [self._reply(question.number, part, values[part.name], cell) for part in parts]
        if recorded := [reply.part for reply in replies if reply.recorded]:
            contents = self._sections["answers"][question.number]
            with self._locked() as problem:  # which reads the file again: to try a function may have taken long
                for name in recorded:
                    self._add(question.number, name, contents[name], cell)
                self._save(problem)
        return replies

    def _reply(self, question: str, part: Part, value: Any, cell: str) -> Reply:
        """Add an answer that has the form of its part to what is to be written, and return the reply."""
        earlier = " (the earlier answer stays)" if self.get(question, part.name) else ""
        try:
            encoded = forms.encode(part, value, self.probe_seed)
            self._add(question, part.name, encoded.content, cell)
        except NotAnswered:
            return Reply(question, part.name, False, f"{part.name}  not answered yet{earlier}")
        except FormError as error:
            return Reply(question, part.name, False, f"{part.name}  not recorded: {error}{earlier}", refused=str(error))
        return Reply(question, part.name, True, f"{forms.show(part, encoded.content)}  recorded", encoded.hints)

    def _add(self, question: str, part: str, content: dict[str, Any], cell: str) -> None:
        """Add an answer to what is to be written; raise FormError if the file would grow too large with it."""
        sections = dict(self._sections)
        for section, entry in (("answers", content), ("cells", cell)):
            earlier = sections[section]
            sections[section] = {**earlier, question: {**earlier.get(question, {}), part: entry}}
        if len(self._as_json(sections)) > MAX_BYTES:
            raise FormError(f"with it, {self.path.name} would be larger than {MAX_BYTES} bytes: give smaller figures")
        self._sections = sections

    def predicted(self, question: str) -> dict[str, Any]:
        """Return what was predicted of a question's experiment: see :mod:`labcourse.answers.reflection`."""
        return self._sections.get("predictions", {}).get(question, {})

    def predict(self, question: str, values: Mapping[str, dict[str, Any]], why: str | None = None) -> None:
        """Record predictions, unless there are earlier ones, and a sentence about them, which replaces an earlier one.

        Parameters
        ----------
        question : number
        values : name → plain data of an answer
        why : the sentence; None to leave the earlier one

        Raises
        ------
        AnswerError
            If the file cannot be written.
        """
        with self._locked() as problem:
            entry = self._sections.setdefault("predictions", {}).setdefault(question, {})
            entry["said"] = {**values, **entry.get("said", {})}
            entry |= {} if why is None else {"why": why}
            self._save(problem)

    # --- the file ------------------------------------------------------------------------------------------------

    def _as_json(self, sections: _Sections) -> bytes:
        """Return the content of the file."""
        content = {
            "format": json_values.FORMAT,
            "student": self.student,
            "bench": self.bench,
            "software": f"labcourse {labcourse.__version__}",
            "probe_seed": self.probe_seed,
            **sections,
        }
        return (json.dumps(content, allow_nan=False, sort_keys=True) + "\n").encode()

    @contextlib.contextmanager
    def _locked(self) -> Iterator[str]:
        """Lock the file, read it, and yield why it cannot be locked, "" if it is.

        If it cannot be written in the meantime, the answers are again those of the file.
        """
        try:
            with files.locked(self.path) as problem:
                self._sections = self._load()
                yield problem
        except OSError as error:
            self._sections = self._load()
            raise AnswerError(
                f"{self.path.name} cannot be written: {error.strerror}. The answer is not recorded."
            ) from error

    def _save(self, problem: str) -> None:
        """Write the file; say once that it could not be locked, and why."""
        text = self._as_json(self._sections)
        if len(text) > MAX_BYTES:  # it could not be read again
            raise OSError(errno.EFBIG, f"it would be larger than {MAX_BYTES} bytes; give smaller figures")
        self._version = files.write(self.path, text)
        if problem and not self._is_warned:
            self._is_warned = True
            self.notices.append(
                f"{self.path.name} cannot be locked: {problem}. If two notebooks record an answer at the same moment, "
                "one answer may be lost: run one notebook at a time."
            )

    def _load(self) -> _Sections:
        """Read the file. One that is broken, or another student's, is put aside under another name.

        In a run by a check or by grading there is one student, whomever a cell makes the file name.
        """
        nothing: _Sections = {"answers": {}, "cells": {}}
        try:
            data = files.read(self.path)
        except FileNotFoundError:
            return nothing
        except OSError as error:
            raise AnswerError(f"{self.path.name} cannot be read: {error.strerror}.") from error
        try:
            content = parse(data)
        except AnswerError as error:
            aside = set_aside(self.path, "broken")
            self.notices.append(
                f"{self.path.name} could not be read, and was put aside as {aside}. {error} A new one is begun: "
                "run the notebooks again to answer again."
            )
            return nothing
        if not job.STUDENT and caseless(content["student"]) != caseless(self.student):
            aside = set_aside(self.path, _NO_FILE_NAME.sub("_", content["student"])[:40] or "nobody")
            self.notices.append(
                f"The answers of {content['student'][:40]!r} were put aside as {aside}. Run your notebooks again, "
                f"in order: your answers are then recorded for {self.student!r}."
            )
            return nothing
        if content["probe_seed"] != self.probe_seed:
            # Outputs of functions belong to the inputs that another seed gave.
            content["answers"] = {
                question: {name: answer for name, answer in parts.items() if answer.get("kind") != "function"}
                for question, parts in content["answers"].items()
            }
        return {name: content[name] for name in ("answers", "cells", "predictions") if name in content}


# --- results tables ---------------------------------------------------------------------------------------------------

HEADS = ("Description", "Name", "Value", "Unit")  #: of the columns
_LEFT = "text-align: left"  # JupyterLab sets cells to the right
_ENTRY = "font-family: monospace; white-space: pre; background: none; text-align: left; margin: 0"


class ResultsTable:
    """A results table with a student's entries; Jupyter shows it as a table, ``print`` as text.

    Parameters
    ----------
    table : one of the catalogue's
    book : the student's answers
    """

    def __init__(self, table: Question, book: AnswerBook) -> None:
        self.title = f"{table.number}: {table.title}"
        #: prompt, name, entry ("" where there is none), unit
        self.rows = [
            (part.prompt, part.name, _entry(part, book.get(table.number, part.name)), part.unit) for part in table.parts
        ]

    def __str__(self) -> str:
        lines = [self.title]
        for _prompt, name, entry, unit in self.rows:
            first, *rest = (entry or "(not filled in yet)").split("\n")
            lines.append(f"  {name:<20}{first} {unit if entry else ''}".rstrip())
            lines += [f"  {'':<20}{line}" for line in rest]
        return "\n".join(lines)

    __repr__ = __str__

    def _repr_html_(self) -> str:
        head = "".join(f'<th scope="col" style="{_LEFT}">{heading}</th>' for heading in HEADS)
        body = "".join(
            f'<tr><td style="{_LEFT}">{escape(prompt)}</td><th scope="row" style="{_LEFT}">{escape(name)}</th>'
            f'<td style="{_LEFT}"><pre style="{_ENTRY}">{escape(entry) or "not filled in yet"}</pre></td>'
            f"<td>{escape(unit)}</td></tr>"
            for prompt, name, entry, unit in self.rows
        )
        return (
            f"<table><caption>{escape(self.title)}</caption><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
        )


def _entry(part: Part, content: dict[str, Any] | None) -> str:
    """Show an entry: a matrix by its rows, all else as it is acknowledged, without name and unit."""
    if content is None:
        return ""
    from labcourse.answers import schema

    try:
        answer = schema.read_answer(part, content)
        answer.decode(part)
    except AnswerError:
        return "(unreadable: answer again)"
    if part.kind == "matrix":
        return "\n".join("  ".join(f"{number:>9.4g}" for number in row) for row in answer.rows())
    return str(answer.show(part)).removeprefix(" = ").removesuffix(part.unit).rstrip()
