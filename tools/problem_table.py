"""Write the table of all messages about students' work to ``docs/reference/problems.md``.

    python tools/problem_table.py

Codes and groups come from :class:`labcourse.problems.Code`, and sentences from :mod:`labcourse.sentences`. Who reads
them, and what to do, is in ``tools/problem_table.toml``. ``tests/docs/test_problem_table.py`` compares the page with
all of these.
"""

from __future__ import annotations

import inspect
import re
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from string import Formatter
from typing import Any

from labcourse.problems import Code, Problem
from labcourse.sentences import template

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "reference" / "problems.md"
ROWS = Path(__file__).with_suffix(".toml")

#: Where a sentence is read: the name in the rows → who reads it, and where.
PLACES = {
    "check": ("student", "`check`"),
    "notebook": ("student", "notebook"),
    "receipt": ("student", "receipt of `submit`"),
    "page": ("student", "feedback page"),
    "terminal": ("instructor", "terminal"),
    "intake": ("instructor", "`intake.csv`"),
    "status": ("instructor", "`status`"),
}
#: Parameters with which a sentence has its fullest form.
_GIVEN: dict[str, Any] = {
    **dict.fromkeys(("with_others", "own", "earlier", "saved", "text", "why"), True),
    "line": 1,
    "files": ["", ""],
    "building": ["*question*", "*question*"],
    "similar": [""],
    "cells": [""],
}
#: Parameter → words that stand for it. All others stand for themselves.
_WORDS = {
    **dict.fromkeys(("count", "line", "most", "nested", "number", "seconds", "times"), "number"),
    **dict.fromkeys(("where", "file", "chosen"), "file"),
    **dict.fromkeys(("files", "some_files", "similar"), "files"),
    **dict.fromkeys(("begun", "closest", "release"), "release"),
    **dict.fromkeys(("here", "needed", "there"), "version"),
    **dict.fromkeys(("saved", "time"), "time"),
    **{"bytes": "size", "error": "error", "named": "name", "on": "question", "parts": "answers", "problem": "message"},
    **{"refusal": "reason", "text": "message", "type": "error", "when": "date", "why": "reason", "cell_name": "cell"},
}
_OPTION = re.compile(r"--[a-z][a-z-]*")
_INTRODUCTION = """\
<!-- Made by tools/problem_table.py of its rows in tools/problem_table.toml. Change these, and run it. -->

# What a message means

All that the program says about a student's work: who reads it, and what to do. Look for the words that do not change;
what stands in *italics* is filled in. Where a sentence has several forms, the fullest is shown.

* **Students** read messages at home: from `rotflex check` and `lab.check()`; in the *notebook*, when the laboratory
  starts, an answer is recorded or a report is made; and in the *receipt* of `rotflex submit`. Later they read them on
  their *feedback page*.
* **Instructors** read them in the *terminal* where they grade, in `intake.csv`, and in `rotflex status`, which is also
  the page of the class. All messages of a feedback page are in `marks.json`; except for the reasons of single marks,
  they are in `grades.csv`, too, in the column "notes".
* *Only inside* means that it is a part of another sentence, named by its code: whoever reads that one reads it.

To *grade again* is to run `rotflex grade` once more with the same submissions. To *decide* a row of
[`intake.csv`](../handing_in.md#what-is-not-certain-intakecsv) is to write into its column "decision", and to grade
again. The code is what the gradebook stores.
"""


def groups() -> dict[str, list[Code]]:
    """Return the groups of the codes: the comment above each in the source → its codes."""
    found: dict[str, list[Code]] = {}
    for line in map(str.strip, inspect.getsource(Code).splitlines()):
        if line.startswith("# "):
            found[line.removeprefix("# ")] = codes = []
        elif line.endswith(" = auto()"):
            codes.append(Code[line.removesuffix(" = auto()")])
    return found


def rows() -> dict[str, dict[str, Any]]:
    """Return what the file says of each code.

    ``read`` are names of :data:`PLACES`; ``inside`` codes of sentences of which this is a part; ``do`` what to do; and
    ``words`` what stands for a parameter of this sentence.
    """
    return tomllib.loads(ROWS.read_text(encoding="utf-8"))


def fullest(code: Code) -> str:
    """Return the longest form of the sentence of a code, with its parameters in braces."""
    return max((template(Problem(code, "", given)) for given in ({}, _GIVEN)), key=len)


def shown(code: Code, words: Mapping[str, str]) -> str:
    """Return the sentence of a code in Markdown, with words in italics for its parameters.

    Parameters
    ----------
    code : of the problem
    words : what stands for some of the parameters, before :data:`_WORDS`
    """
    pieces = []
    for text, name, form, conversion in Formatter().parse(fullest(code)):
        pieces.append(_OPTION.sub(r"`\g<0>`", text))
        if name is not None:
            pieces.append(_filled_in(name.partition("[")[0], form, conversion, words))
    return "".join(pieces)


def _filled_in(name: str, form: str | None, conversion: str | None, words: Mapping[str, str]) -> str:
    """Return what stands for a parameter, or the word for several where the form is "one|several"."""
    if form and "|" in form:
        return form.rpartition("|")[2]
    if name == "command":
        return "rotflex"
    if name == "place":
        return f"*{words.get(name, 'file: question, part')}*: "
    quote = "'" if conversion in ("q", "l", "r") or name == "some_files" else ""
    word = words.get(name) or ("size" if form == "MB" else _WORDS.get(name, name))
    return f"{quote}*{word}*{quote}"


def _readers(row: Mapping[str, Any]) -> str:
    """Return who reads a sentence, and where."""
    places: dict[str, list[str]] = {}
    for name in row.get("read", ()):
        who, where = PLACES[name]
        places.setdefault(who, []).append(where)
    texts = [f"{who}: {', '.join(those)}" for who, those in places.items()]
    if inside := ", ".join(f"`{code}`" for code in row.get("inside", ())):
        texts.append(f"{'inside' if texts else '*only inside*'} {inside}")
    return "; ".join(texts)


def _lines() -> Iterator[str]:
    about = rows()
    yield _INTRODUCTION
    for title, codes in groups().items():
        yield from (f"## {title[0].upper()}{title[1:]}", "", "| code | sentence | who reads it | what to do |")
        yield "|---|---|---|---|"
        for code in codes:
            row = about[code]
            yield f"| `{code}` | {shown(code, row.get('words', {}))} | {_readers(row)} | {row['do']} |"
        yield ""


def text() -> str:
    """Return the page."""
    return "\n".join(_lines()).rstrip() + "\n"


if __name__ == "__main__":
    PAGE.write_text(text(), encoding="utf-8")
