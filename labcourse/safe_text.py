"""Make untrusted text harmless for a terminal and for a spreadsheet; read and write tables."""

from __future__ import annotations

import codecs
import csv
import io
import re
import unicodedata
from collections.abc import Iterable

from labcourse.patterns import ANSWER, pattern

_NUMBER = pattern(r"-?\d+(\.\d+)?(e[+-]?\d+)?", ANSWER, re.IGNORECASE)
#: The beginning of a formula: at the beginning of a cell; and after a semicolon or a line's end, as spreadsheets that
#: split at semicolons, which many countries use, read quotes within a line as letters. What stands between is read
#: once, also if no formula follows: the second group says whether one does.
_FORMULA = pattern(r"^[ \u3000\xa0]*(?=[=+\-@＝＋－＠\t\r\n])|([;\n][\s\"]*+)(?:(?=[=+\-@＝＋－＠])())?", ANSWER)
_MARKED = pattern(r"^'(?=[ \u3000\xa0]*[=+\-@＝＋－＠\t\r\n])|(?<=[;\s\"])'(?=[=+\-@＝＋－＠])", ANSWER)
_EXCELS_SEPARATOR = pattern(r"\Asep=[^\r\n]*", ANSWER, re.IGNORECASE)  # a line before the headings
_HARMLESS = "\n\t\u200c\u200d"  # lines, tabs, and how letters and emoji join


def no_escapes(text: str) -> str:
    """Replace characters that control a terminal or the direction of writing by codes as "\\x1b"."""
    if text.replace("\n", "").isprintable():  # as nearly all text is; looking at each character takes time
        return text
    return "".join(sign if sign in _HARMLESS or not _steers(sign) else ascii(sign)[1:-1] for sign in text)


def say(*lines: str, err: bool = False) -> None:
    """Print lines that may have untrusted text in them, without characters that control a terminal."""
    import typer

    for line in lines:
        typer.echo(no_escapes(line), err=err)


def _steers(character: str) -> bool:
    # Cc: escapes and other controls; Cf: invisible and direction marks; Cs: halves of characters.
    return unicodedata.category(character) in ("Cc", "Cf", "Cs")


def spreadsheet_cell(text: str) -> str:
    """Put a ' before each formula in a text, so that spreadsheets take it for text."""
    return _FORMULA.sub(
        lambda match: f"'{match[0]}" if match[1] is None else match[0] + "'" * (match[2] is not None), no_escapes(text)
    )


def from_spreadsheet_cell(text: str) -> str:
    """Remove the signs that :func:`spreadsheet_cell` puts before formulas."""
    original = _MARKED.sub("", text)
    return original if spreadsheet_cell(original) == text else text


def as_csv(rows: Iterable[Iterable[str]]) -> str:
    """Format a table as CSV, with quotes around each cell; :func:`spreadsheet_cell` is applied to all but numbers."""
    table = io.StringIO(newline="")
    cells = ([cell if _NUMBER.fullmatch(cell) else spreadsheet_cell(cell) for cell in row] for row in rows)
    csv.writer(table, quoting=csv.QUOTE_ALL).writerows(cells)
    return table.getvalue()


def from_csv(data: bytes) -> list[list[str]]:
    """Read a table in UTF-8 or Excel's UTF-16; a line ``sep=;`` of Excel's becomes an empty row.

    Its separator is the comma, semicolon or tab that is most frequent in the first line.

    Raises
    ------
    ValueError
        If it has another coding, or is not CSV.
    """
    coding = "utf-16" if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)) else "utf-8-sig"
    text = _EXCELS_SEPARATOR.sub("", data.decode(coding))
    first = text.lstrip().partition("\n")[0]
    try:
        return list(csv.reader(io.StringIO(text, newline=""), delimiter=max(",;\t", key=first.count)))
    except csv.Error as error:
        raise ValueError(error) from None
