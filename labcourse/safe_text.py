"""Untrusted text made harmless for a terminal and for a spreadsheet."""

from __future__ import annotations

import csv
import io
import re
import unicodedata
from collections.abc import Iterable

_NUMBER = re.compile(r"-?\d+(\.\d+)?(e[+-]?\d+)?", re.IGNORECASE)
#: Where a spreadsheet would begin to calculate: at the beginning of a cell; and behind a semicolon or a line's end,
#: because one that splits at semicolons, as in many countries, takes quotes in a line for letters.
_FORMULA = re.compile(r"(^[ \u3000\xa0]*(?=[=+\-@＝＋－＠\t\r\n])|[;\n][\s\"]*(?=[=+\-@＝＋－＠]))")
_KEPT = "\n\t\u200c\u200d"  # lines, tabs, and how letters and emoji join


def no_escapes(text: str) -> str:
    """Text without what steers a terminal or turns the direction of writing: each such character as "\\x1b"."""
    return "".join(one if one in _KEPT or not _steers(one) else ascii(one)[1:-1] for one in text)


def say(*lines: str, err: bool = False) -> None:
    """Print lines that may hold untrusted text, without what steers a terminal."""
    import typer

    for line in lines:
        typer.echo(no_escapes(line), err=err)


def _steers(character: str) -> bool:
    # Cc: escapes and other controls; Cf: invisible and direction marks; Cs: halves of characters.
    return unicodedata.category(character) in ("Cc", "Cf", "Cs")


def spreadsheet_cell(text: str) -> str:
    """Text that a spreadsheet takes for text: a ' stands before what would be a formula."""
    return _FORMULA.sub(
        lambda found: f"{found[0]}'" if found[0][:1] in (";", "\n") else f"'{found[0]}", no_escapes(text)
    )


def from_spreadsheet_cell(text: str) -> str:
    """Return a text without the signs that :func:`spreadsheet_cell` puts before what looks like a formula."""
    plain = re.sub(r"^'(?=[ \u3000\xa0]*[=+\-@＝＋－＠\t\r\n])|(?<=[;\s\"])'(?=[=+\-@＝＋－＠])", "", text)
    return plain if spreadsheet_cell(plain) == text else text


def as_csv(rows: Iterable[Iterable[str]]) -> str:
    """Return a table as CSV: every cell in quotes, and those that are no numbers as :func:`spreadsheet_cell` says."""
    table = io.StringIO(newline="")
    cells = ([cell if _NUMBER.fullmatch(cell) else spreadsheet_cell(cell) for cell in row] for row in rows)
    csv.writer(table, quoting=csv.QUOTE_ALL).writerows(cells)
    return table.getvalue()
