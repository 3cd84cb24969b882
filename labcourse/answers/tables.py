"""A course's results tables, as filled in so far."""

from __future__ import annotations

from html import escape
from typing import Any

from labcourse.answers import forms
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
    """Of the columns."""
    return "Description", "Name", "Value", "Unit"


def _entry(part: Part, content: dict[str, Any] | None) -> str:
    """An entry of the table for people: a matrix by its rows, all else as it is acknowledged, without name and unit."""
    if content is None:
        return ""
    try:
        forms.decode(part, content)
    except AnswerError:
        return "(unreadable: answer again)"
    if part.kind == "matrix":
        noise = 1e-9 * max(abs(number) for row in content["value"] for number in row)
        return "\n".join(
            "  ".join(f"{number if abs(number) > noise else 0:>9.4g}" for number in row) for row in content["value"]
        )
    shown = forms.show(part, content).removeprefix(part.name).removeprefix(" = ")
    return shown.removesuffix(part.unit).rstrip()
