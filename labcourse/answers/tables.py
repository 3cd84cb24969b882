"""A course's results tables, as filled in so far."""

from __future__ import annotations

from html import escape
from typing import Any

from labcourse.answers.answers import AnswerBook
from labcourse.answers.parts import Part, Question
from labcourse.errors import AnswerError

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
        head = "".join(f'<th scope="col" style="{_LEFT}">{heading}</th>' for heading in heads())
        body = "".join(
            f'<tr><td style="{_LEFT}">{escape(prompt)}</td><th scope="row" style="{_LEFT}">{escape(name)}</th>'
            f'<td style="{_LEFT}"><pre style="{_ENTRY}">{escape(entry) or "not filled in yet"}</pre></td>'
            f"<td>{escape(unit)}</td></tr>"
            for prompt, name, entry, unit in self.rows
        )
        return (
            f"<table><caption>{escape(self.title)}</caption><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
        )


def heads() -> tuple[str, ...]:
    """Return the headings of the columns."""
    return "Description", "Name", "Value", "Unit"


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
