"""A course's rubric: what to look for in each answer that a person reads, and what tells one level from the next.

It is a file of the course's folder, ``rubric.toml``, with a table for each part that a person marks::

    ["1.4".why]
    look_for = "Names a loss that the model leaves out, and where it would be seen in the recording."
    4 = "Names the loss, says how it would show, and shows it in the student's own recording."
    3 = "Names the loss and says how it would show."
    2 = "Names a loss without saying what it does."
    1 = "Names none, or one that the model has."
    remarks = ["Look at the height of one swing after the next: what does it tell you?"]

Remarks are for students, and may be used again. A course need not have a rubric; one that has it has all of it.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from labcourse.answers.catalogue import Catalogue
from labcourse.errors import AnswerError, GradingError
from labcourse.grading.course import RUBRIC_FILE

LEVELS = (4, 3, 2, 1)  #: exemplary, proficient, developing, beginning
LONGEST = 500  #: characters of a text; five lines, read before each of eighty answers

Where = tuple[str, str]  #: question, part

_NAMES = ("look_for", *map(str, LEVELS), "remarks")


@dataclass(frozen=True)
class Item:
    """What a scorer has before them when they read the answers to one part.

    Attributes
    ----------
    where : question and part
    look_for : what has to be there
    levels : level, from 4 to 1 → what an answer of that level is like
    remarks : to students, to be used again
    """

    where: Where
    look_for: str
    levels: Mapping[int, str]
    remarks: tuple[str, ...] = ()


def read(folder: Path, catalogue: Catalogue) -> Mapping[Where, Item]:
    """The rubric of the course in a folder, in the catalogue's order; empty where there is no file.

    Parameters
    ----------
    folder : of the course
    catalogue : of its questions

    Raises
    ------
    GradingError
        If the file cannot be read, or is not the rubric of this course: each fault is told.
    """
    items, faults = examine(folder, catalogue)
    if faults:
        file = folder / RUBRIC_FILE
        raise GradingError("\n  ".join([f"{file} cannot be used:", *faults]))
    return items


def examine(folder: Path, catalogue: Catalogue) -> tuple[dict[Where, Item], list[str]]:
    """What is right in a rubric, and each fault of it in words. Parameters as for :func:`read`."""
    try:
        content = tomllib.loads((folder / RUBRIC_FILE).read_text(encoding="utf-8"))
    except FileNotFoundError:
        return {}, []
    except (OSError, UnicodeDecodeError) as error:
        return {}, [f"it cannot be read: {error}"]
    except tomllib.TOMLDecodeError as error:
        return {}, [f"it is not TOML: {error}"]
    wanted = [(q.number, part.name) for q in catalogue.marked.values() for part in q.parts if part.marked == "person"]
    entries = {(number, name): one for number, parts in content.items() for name, one in _entries(parts)}
    faults = [*_unknown(content, wanted, catalogue)]
    items = {}
    for where in wanted:
        place = _place(where)
        if where not in entries:
            faults.append(f"{place} is missing: a person marks it.")
            continue
        found = [f"{place}: {fault}" for fault in _misfits(entries[where])]
        if not found:
            items[where] = _item(where, entries[where])
        faults += found
    return items, faults


def _entries(parts: Any) -> list[tuple[str, Any]]:
    return list(parts.items()) if isinstance(parts, Mapping) else []


def _place(where: Where) -> str:
    """As it stands in the file."""
    return f'["{where[0]}".{where[1]}]'


def _unknown(content: Mapping[str, Any], wanted: list[Where], catalogue: Catalogue) -> Iterator[str]:
    """Tables of questions and parts that there are not, or that no person marks."""
    for number, parts in content.items():
        try:
            question = catalogue.find_marked(number)
        except AnswerError as error:
            yield str(error)
            continue
        if not isinstance(parts, Mapping):
            yield (
                f"{number!r} should be a table, a line {_place((number, question.names[0]))} with its entries below."
            )
        for name, _entry in _entries(parts):
            try:
                question.part(name)
            except AnswerError as error:
                yield str(error)
                continue
            if (number, name) not in wanted:
                yield f"{_place((number, name))}: the key marks it, and no person does. Take it out."


def _misfits(entry: Any) -> Iterator[str]:
    """What is wrong with what stands of one part."""
    if not isinstance(entry, Mapping):
        yield f"it should be a table with {', '.join(_NAMES)}."
        return
    for name in entry:
        if name not in _NAMES:
            yield f"there is no entry {name!a}; there are {', '.join(_NAMES)}."
    for name in _NAMES[:-1]:
        if name not in entry:
            yield f"{name} is missing."
        elif not _is_text(entry[name]):
            yield f"{name}: {_EXPECTED}"
    remarks = entry.get("remarks", [])
    if not (isinstance(remarks, list) and all(map(_is_text, remarks))):
        yield f"remarks: a list, and in it {_EXPECTED}"
    levels = [_plain(entry[name]) for name in map(str, LEVELS) if _is_text(entry.get(name))]
    if len(set(levels)) < len(levels):
        yield "two of its levels say the same, so nobody can tell them apart."


_EXPECTED = f"a text of 1 to {LONGEST} characters is expected."


def _is_text(value: object) -> bool:
    return isinstance(value, str) and 1 <= len(_plain(value)) <= LONGEST and _plain(value).isprintable()


def _plain(text: str) -> str:
    """A text that was written over several lines, in one."""
    return " ".join(text.split())


def _item(where: Where, entry: Mapping[str, Any]) -> Item:
    levels = {level: _plain(entry[str(level)]) for level in LEVELS}
    return Item(where, _plain(entry["look_for"]), levels, tuple(map(_plain, entry.get("remarks", ()))))
