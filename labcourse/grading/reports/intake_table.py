"""``intake.csv``: what intake cannot know for certain. An instructor writes a decision there, and grades again."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable
from dataclasses import asdict, fields
from pathlib import Path

from labcourse import files
from labcourse.errors import GradingError
from labcourse.grading.intake import Doubt
from labcourse.safe_text import as_csv, from_spreadsheet_cell

_DECISION = "decision"
_COLUMNS = [*(field.name for field in fields(Doubt)), _DECISION]
_MAX_BYTES = 10_000_000


def read(path: Path) -> dict[Doubt, str]:
    """Read each row of the table, and the decision on it; nothing without a file.

    Raises
    ------
    GradingError
        If the file cannot be read, is too long, or lacks a column.
    """
    if not path.exists():
        return {}
    try:
        with open(path, "rb") as file:
            data = file.read(_MAX_BYTES + 1)
        if len(data) > _MAX_BYTES:
            raise GradingError(f"{path} is too long: more than {_MAX_BYTES} bytes. Delete rows that are decided.")
        text = data.decode("utf-8-sig")
        first = text.partition("\n")[0]
        table = csv.DictReader(io.StringIO(text, newline=""), delimiter=max(",;\t", key=first.count))
        if missing := [name for name in _COLUMNS if name not in (table.fieldnames or ())]:
            raise GradingError(f"{path} has no column {missing[0]!r}. Its columns are: {', '.join(_COLUMNS)}.")
        rows = [{name: from_spreadsheet_cell((line[name] or "").strip()) for name in _COLUMNS} for line in table]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise GradingError(f"{path} cannot be read: {error}. Save it as CSV in UTF-8, or delete it.") from None
    return {Doubt(**{name: text for name, text in row.items() if name != _DECISION}): row[_DECISION] for row in rows}


def write(path: Path, doubts: Iterable[Doubt], earlier: dict[Doubt, str]) -> int:
    """Write the rows of the submissions that were read, and earlier decisions on others.

    Parameters
    ----------
    path : the file; without rows it is deleted
    doubts : rows of the submissions that were read
    earlier : rows and decisions, as :func:`read` returns them

    Returns
    -------
    int
        number of rows without a decision
    """
    decided = {doubt.key: (doubt, decision) for doubt, decision in earlier.items() if decision}
    rows = decided | {doubt.key: (doubt, decided.get(doubt.key, (doubt, ""))[1]) for doubt in doubts}
    if not rows:
        path.unlink(missing_ok=True)
        return 0
    lines = ((*asdict(doubt).values(), decision) for _key, (doubt, decision) in sorted(rows.items()))
    try:
        files.write(path, as_csv([_COLUMNS, *lines]).encode("utf-8-sig"))
    except OSError as error:
        raise GradingError(f"{path} cannot be written: {error.strerror}. Mend that, and grade again.") from None
    return sum(not decision for _doubt, decision in rows.values())
