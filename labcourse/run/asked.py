"""What a course's notebooks ask for, part by part, and whether a student has begun to answer it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from labcourse.answers import words
from labcourse.answers.catalogue import Catalogue
from labcourse.run import alignment, merge
from labcourse.run.alignment import Role
from labcourse.run.merge import Merged
from labcourse.run.recorders import recorded

Where = tuple[str, str]  # question and part


@dataclass(frozen=True)
class Asked:
    """A part of a question, where it is asked.

    Attributes
    ----------
    notebook : file name
    where : question and part
    in_words : whether the answer is text, read from the saved notebook
    begun : whether the student wrote code for it, as far as the course leaves that to them
    """

    notebook: str
    where: Where
    in_words: bool
    begun: bool


def asked(masters: Mapping[str, dict[str, Any]], merged: Merged, catalogue: Catalogue) -> Iterator[Asked]:
    """All that the notebooks ask for, each part once, in order."""
    seen: set[Where] = set()
    for name, master in masters.items():
        begun = _begun(master, merged.notebooks[name])
        recorders = {one.cell: one for one in recorded(master["cells"])}
        for cell in master["cells"]:
            here: list[Asked] = []
            in_words = words.where_of(cell)
            if in_words is not None and _has(catalogue, in_words):
                here.append(Asked(name, in_words, True, False))
            one = recorders.get(alignment.name_of(cell))
            if one is not None and one.question in catalogue.everything:
                parts = one.of(catalogue.everything[one.question])
                those = [(one.question, part) for part in parts if _has(catalogue, (one.question, part))]
                here += [Asked(name, where, False, begun.get(one.cell, False)) for where in those]
            for part in here:
                if part.where not in seen:
                    seen.add(part.where)
                    yield part


def _has(catalogue: Catalogue, where: Where) -> bool:
    question = catalogue.everything.get(where[0])
    return question is not None and where[1] in question.names


def _begun(master: Mapping[str, Any], ran: Mapping[str, Any]) -> dict[str, bool]:
    """Id of each cell that records an answer → whether the student wrote something for it, or had nothing to."""
    released = {alignment.name_of(cell): alignment.source_of(cell) for cell in master["cells"]}
    recorders = {one.cell for one in recorded(master["cells"])}
    found: dict[str, bool] = {}
    left = written = False
    for cell in ran["cells"]:
        role, source = merge.role_of(cell), alignment.source_of(cell)
        left = left or role is Role.ANSWER
        written = written or role is Role.ADDED or (role is Role.ANSWER and source != released.get(cell["id"]))
        if cell["id"] in recorders:
            found[cell["id"]] = written or not left
            left = written = False
    return found
