"""``intake.csv``: what intake cannot know for certain. An instructor writes a decision there, and grades again."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable
from dataclasses import asdict, fields
from pathlib import Path

from labcourse import files
from labcourse.errors import GradingError
from labcourse.grading.running.intake import Doubt
from labcourse.safe_text import as_csv, from_spreadsheet_cell

_DECISION = "decision"
_COLUMNS = [*(field.name for field in fields(Doubt)), _DECISION]
_MAX_BYTES = 10_000_000


def read(path: Path) -> dict[Doubt, str]:
    """Read the table: each row, and what was decided; nothing where there is no file.

    Raises
    ------
    GradingError
        If the file cannot be read, or lacks a column.
    """
    if not path.exists():
        return {}
    try:
        with open(path, "rb") as file:
            text = file.read(_MAX_BYTES).decode("utf-8-sig")
        first = text.partition("\n")[0]
        table = csv.DictReader(io.StringIO(text, newline=""), delimiter=max(",;\t", key=first.count))
        if missing := [name for name in _COLUMNS if name not in (table.fieldnames or ())]:
            raise GradingError(f"{path} has no column {missing[0]!r}. Its columns are: {', '.join(_COLUMNS)}.")
        rows = [{name: from_spreadsheet_cell((line[name] or "").strip()) for name in _COLUMNS} for line in table]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise GradingError(f"{path} cannot be read: {error}. Save it as CSV in UTF-8, or delete it.") from None
    return {Doubt(**{name: text for name, text in row.items() if name != _DECISION}): row[_DECISION] for row in rows}


def write(path: Path, doubts: Iterable[Doubt], earlier: dict[Doubt, str]) -> int:
    """Write what is in doubt now, with the decisions on it, and earlier decisions on what was not graded now.

    Parameters
    ----------
    path : the file; without rows it is deleted
    doubts : of the submissions that were read
    earlier : from :func:`read`

    Returns
    -------
    int
        How many rows have no decision.
    """
    decided = {one.key: (one, decision) for one, decision in earlier.items() if decision}
    rows = dict(decided)
    for one in doubts:
        rows[one.key] = one, decided.get(one.key, (one, ""))[1]
    if not rows:
        path.unlink(missing_ok=True)
        return 0
    lines = ((*asdict(one).values(), decision) for _key, (one, decision) in sorted(rows.items()))
    try:
        files.write(path, as_csv([_COLUMNS, *lines]).encode("utf-8-sig"))
    except OSError as error:
        raise GradingError(f"{path} cannot be written: {error.strerror}. Mend that, and grade again.") from None
    return sum(not decision for _one, decision in rows.values())
