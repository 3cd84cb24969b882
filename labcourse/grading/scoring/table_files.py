"""Tables of scores as files, .xlsx or .csv: cells out and in, and nothing of what they mean."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from labcourse import files, program
from labcourse.errors import GradingError
from labcourse.safe_text import as_csv, from_csv, from_spreadsheet_cell

COLUMNS = ("key", "question", "part", "who", "answer", "out of", "level", "points", "remark", "state", "check")
MOST_BYTES = 50_000_000  #: of a table that is read; fifty answers of 5000 characters of each of 200 students
NEEDED = ("key", "level", "points", "remark", "check")  #: columns without which it is no such table
_NUMBERS = ("level", "points", "out of")
_WIDTHS = {"question": 10, "part": 14, "who": 14, "answer": 80, "remark": 50, "state": 30}

_FORMULA, _ERROR = "f", "e"  # types of cells, as openpyxl has them

Cell = str | None  #: None: a formula that has no result, or an error in its place


# --- out --------------------------------------------------------------------------------------------------------------


def write(path: Path, rows: Sequence[Mapping[str, str]]) -> None:
    """Write rows under their headings, in place of a file that is there.

    Raises
    ------
    GradingError
        If it is of another kind, or cannot be written.
    """
    try:
        files.write(path, _by_kind(path, _csv, _xlsx)(rows))
    except OSError as error:
        raise GradingError(f"{path} cannot be written: {error.strerror}.") from None


def _by_kind(path: Path, for_csv: Callable[..., Any], for_xlsx: Callable[..., Any]) -> Callable[..., Any]:
    kinds = {".csv": for_csv, ".xlsx": for_xlsx}
    if path.suffix.lower() not in kinds:
        raise GradingError(f"{path}: a table ends in .xlsx or .csv.")
    return kinds[path.suffix.lower()]


def _csv(rows: Sequence[Mapping[str, str]]) -> str:
    table = as_csv([COLUMNS, *([row[name] for name in COLUMNS] for row in rows)])
    return "\ufeff" + table  # by the mark at the beginning a spreadsheet knows that it is UTF-8


def _xlsx(rows: Sequence[Mapping[str, str]]) -> bytes:
    from openpyxl import Workbook
    from openpyxl.cell.cell import ILLEGAL_CHARACTERS_RE
    from openpyxl.styles import Alignment, Font

    book = Workbook()
    table = book.active
    table.title = "scores"
    table.append(list(COLUMNS))
    for number, row in enumerate(rows, start=2):
        for column, name in enumerate(COLUMNS, start=1):
            cell = table.cell(number, column)
            cell.value = ILLEGAL_CHARACTERS_RE.sub("\ufffd", row[name])
            cell.data_type = "s"  # text, also where it begins as a formula does
            cell.quotePrefix = True
            cell.alignment = Alignment(wrap_text=True, vertical="top")
            if name in _NUMBERS and row[name]:
                cell.value = float(row[name])
    for column, name in enumerate(COLUMNS, start=1):
        heading = table.cell(1, column)
        heading.font = Font(bold=True)
        table.column_dimensions[heading.column_letter].width = _WIDTHS.get(name, 8)
    for hidden in ("key", "check"):
        table.column_dimensions[table.cell(1, COLUMNS.index(hidden) + 1).column_letter].hidden = True
    table.freeze_panes = "A2"
    content = io.BytesIO()
    book.save(content)
    return content.getvalue()


# --- in ---------------------------------------------------------------------------------------------------------------


def rows(path: Path) -> Iterator[tuple[int, dict[str, Cell]]]:
    """Number and content of each row that is not empty.

    Raises
    ------
    GradingError
        If it cannot be read, or has other columns.
    """
    lines = _by_kind(path, _csv_lines, _xlsx_lines)(_content(path))
    heading = [(text or "").strip().casefold() for text in (lines[0] if lines else [])]
    missing = [name for name in NEEDED if name not in heading]
    if missing:
        raise GradingError(
            f"{path} is not a table of {program.name()} score --write: it has no column {', '.join(missing)}."
        )
    for number, line in enumerate(lines[1:], start=2):
        if any(text is None or text.strip() for text in line):
            cells = dict(zip(heading, [*line, *[""] * len(heading)], strict=False))
            yield number, {name: _typed(cells.get(name, "")) for name in COLUMNS}


def _typed(text: Cell) -> Cell:
    return None if text is None else from_spreadsheet_cell(text)


def _content(path: Path) -> bytes:
    try:
        content = path.read_bytes()
    except OSError as error:
        raise GradingError(f"{path} cannot be read: {error.strerror}.") from None
    if len(content) > MOST_BYTES:
        raise GradingError(f"{path} is larger than any such table.")
    return content


def _csv_lines(content: bytes) -> list[list[str]]:
    try:
        return from_csv(content)
    except UnicodeDecodeError:
        raise GradingError("The table is not UTF-8: save it as “CSV UTF-8”, or as .xlsx.") from None
    except ValueError as error:
        raise GradingError(f"The table cannot be read: {error}.") from None


def _xlsx_lines(content: bytes) -> list[list[Cell]]:
    try:
        with_formulas = _cells(content, data_only=False)
        if not any(kind == _FORMULA for line in with_formulas for _value, kind in line):
            return [[_text(*cell) for cell in line] for line in with_formulas]
        results = _cells(content, data_only=True)
        return [
            [
                None if kind == _FORMULA and cell[0] is None else _text(*cell)
                for cell, (_value, kind) in zip(*lines, strict=True)
            ]
            for lines in zip(results, with_formulas, strict=True)
        ]
    except Exception as error:  # of a broken or hostile file; openpyxl raises what its parts raise
        raise GradingError(f"The table cannot be read: {error}.") from None


def _cells(content: bytes, data_only: bool) -> list[list[tuple[Any, str]]]:
    """Value and type of each cell; of formulas what they are, or what came out when they were saved."""
    from openpyxl import load_workbook

    table = load_workbook(io.BytesIO(content), read_only=True, data_only=data_only).worksheets[0]
    return [[(cell.value, cell.data_type) for cell in line] for line in table.iter_rows()]


def _text(value: Any, kind: str) -> Cell:
    if kind == _ERROR:
        return None
    return "" if value is None else str(value)
