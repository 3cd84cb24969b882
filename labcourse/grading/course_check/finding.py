"""What a check of a course finds."""

from __future__ import annotations

from dataclasses import dataclass

from labcourse.answers.parts import Part, Question


@dataclass(frozen=True)
class Finding:
    """Something that is missing, or that contradicts something else: where, and what."""

    where: str
    what: str

    def __str__(self) -> str:
        return f"{self.where}: {self.what}"


def in_cell(notebook: str, cell: str) -> str:
    """The place of a cell."""
    return f"{notebook}, cell {cell!r}"


def in_key(question: Question, part: Part) -> str:
    """The place of a check."""
    return f"the key, {question.number} {part.name}"
