"""Which cells of a course's notebooks record which answers: ``lab.answer(question, part=..., ...)``."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from labcourse.answers.notebooks import CODE
from labcourse.answers.parts import Question
from labcourse.run.alignment import Role, role_of, source_of


@dataclass(frozen=True)
class Recorded:
    """What a locked cell records.

    Attributes
    ----------
    cell : id of the cell
    question : its number
    names : part → the variable that is recorded for it, or None where it is not a plain name; None as a whole where the
        call does not write its parts out (``**``)
    """

    cell: str
    question: str
    names: Mapping[str, str | None] | None

    @property
    def parts(self) -> tuple[str, ...] | None:
        """Names of the parts, or None where the call does not write them out."""
        return None if self.names is None else tuple(self.names)

    def of(self, question: Question) -> tuple[str, ...]:
        """The names, all of the question's where they are not written out."""
        return question.names if self.parts is None else self.parts


def recorded(cells: Iterable[Mapping[str, Any]]) -> Iterator[Recorded]:
    """What the cells of a course's notebook record, in order. (Cells that are not Python alone record nothing.)"""
    for cell in cells:
        if cell["cell_type"] != CODE or role_of(cell) is Role.ANSWER:
            continue
        try:
            body = ast.parse(source_of(cell)).body
        except SyntaxError:
            continue
        for statement in body:
            match statement:
                case ast.Expr(
                    value=ast.Call(
                        func=ast.Attribute(attr="answer"), args=[ast.Constant(value=str() as number)]
                    ) as call
                ):
                    names = {
                        keyword.arg: keyword.value.id if isinstance(keyword.value, ast.Name) else None
                        for keyword in call.keywords
                        if keyword.arg is not None
                    }
                    yield Recorded(cell["id"], number, names if len(names) == len(call.keywords) else None)
