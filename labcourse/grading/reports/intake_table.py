"""``intake.csv``: what intake cannot know for certain. An instructor writes a decision there, and grades again."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import fields
from pathlib import Path

from labcourse import files
from labcourse.errors import GradingError
from labcourse.grading.gradebook.roster import read_table
from labcourse.grading.submission import Doubt
from labcourse.safe_text import as_csv, from_spreadsheet_cell
from labcourse.sentences import sentences

_DECISION, _CONTENT = "decision", "content"
_COLUMNS = [*(field.name for field in fields(Doubt)), _DECISION]


def read(path: Path) -> dict[Doubt, str]:
    """Return row → decision of the table, "" if there is none yet; empty without a file.

    Raises
    ------
    GradingError
        If the file cannot be read, is too long, or lacks a column.
    """
    if not path.exists():
        return {}
    headings, *rows = read_table(path) or [[]]
    if missing := [name for name in _COLUMNS if name not in (*headings, _CONTENT)]:  # earlier versions wrote none
        raise GradingError(f"{path} has no column {missing[0]!r}. Its columns are: {', '.join(_COLUMNS)}.")
    decisions = {}
    for row in filter(None, rows):
        cells = dict(zip(headings, [*row, *[""] * len(headings)], strict=False))
        doubt = {name: from_spreadsheet_cell(cells.get(name, "").strip()) for name in _COLUMNS}
        decision, why = doubt.pop(_DECISION), doubt.pop("why")
        decisions[Doubt(**doubt, why=(why,))] = decision
    return decisions


def write(path: Path, doubts: Iterable[Doubt], earlier: dict[Doubt, str], read_now: Collection[str] = ()) -> int:
    """Write the rows of the submissions that were read, earlier rows with a decision, and those of other submissions.

    Parameters
    ----------
    path : the file; without rows it is deleted
    doubts : rows of the submissions that were read
    earlier : rows and decisions, as :func:`read` returns them
    read_now : names of the submissions that were read; their earlier rows without a decision are not in doubt any more

    Returns
    -------
    int
        number of rows without a decision

    Raises
    ------
    GradingError
        If the file cannot be written.
    OSError
        If it has no rows, and cannot be deleted.
    """
    kept = {one: decision for one, decision in earlier.items() if decision or one.submission not in read_now}
    rows = {doubt.key: (doubt, decision) for doubt, decision in kept.items()}
    decisions = {key: decision for key, (_doubt, decision) in rows.items()}
    for doubt in doubts:
        if (decision := doubt.decided(decisions)) and doubt.key not in decisions:
            rows.pop((doubt.submission, doubt.about), None)  # it left the content open; now it holds for this alone
        rows[doubt.key] = (doubt, decision)
    if not rows:
        path.unlink(missing_ok=True)
        return 0
    lines = (
        (*{**vars(doubt), "why": " ".join(sentences(doubt.why))}.values(), decision)
        for _key, (doubt, decision) in sorted(rows.items())
    )
    try:
        files.write(path, as_csv([_COLUMNS, *lines]).encode("utf-8-sig"))
    except OSError as error:
        raise GradingError(f"{path} cannot be written: {error.strerror}. Mend that, and grade again.") from None
    return sum(not decision for _doubt, decision in rows.values())
