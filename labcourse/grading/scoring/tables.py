"""Write scores into a table and read them back, for scoring without a browser: a row for each answer.

Only rows that were changed are taken. A row has a digest of its answer and mark, so that nothing is replaced that
somebody decided after the table was written.
"""

from __future__ import annotations

import hashlib
import io
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from labcourse import files, program
from labcourse.errors import GradingError
from labcourse.grading.gradebook import Act, Answer
from labcourse.grading.reports.result import points as shown_points
from labcourse.grading.reports.result import worth as in_points
from labcourse.grading.scoring.desk import Desk, Pick, key_of, seen, shuffled, state
from labcourse.safe_text import as_csv, from_csv, from_spreadsheet_cell, no_escapes

COLUMNS = ("key", "question", "part", "who", "answer", "out of", "level", "points", "remark", "state", "check")
NEEDED = ("key", "level", "points", "remark", "check")  #: columns without which it is no such table
MOST_BYTES = 50_000_000  #: of a table that is read; fifty answers of 5000 characters of each of 200 students
_NUMBERS = ("level", "points", "out of")
_WIDTHS = {"question": 10, "part": 14, "who": 14, "answer": 80, "remark": 50, "state": 30}
_HIDDEN = ("key", "check")
_KINDS = (".csv", ".xlsx")
_LONGEST_CELL = 32_000  # characters; a spreadsheet takes 32767
_CUT = " … (the rest does not fit into a cell: read it in the browser)"
_DIGITS = 8  # hexadecimal, of the digest of what a row says


@dataclass
class Taken:
    """What became of a table.

    Attributes
    ----------
    changed, same : number of rows that were scored, and that were as they were
    replaced : a message on each mark that was replaced, and that another person gave, or somebody after the table was
        written
    problems : a message on each row that was not taken
    """

    changed: int = 0
    same: int = 0
    replaced: list[str] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)

    def __str__(self) -> str:
        return f"{self.changed} scored, {self.same} as they were, {len(self.problems)} not taken."


class Score(NamedTuple):
    """What a row says of an answer, as text."""

    level: str
    points: str
    remark: str

    def digest(self) -> str:
        """Return a digest, by which a changed row is known."""
        return hashlib.sha256(json.dumps(self).encode()).hexdigest()[:_DIGITS]


def score_of(answer: Answer) -> Score:
    """Return what is decided on an answer; nothing while it waits."""
    if answer.waiting:
        return Score("", "", "")
    act, remark = answer.decision, _one_line(answer.mark.reason)
    if act is None or act.level is None:
        return Score("", shown_points(answer.mark.points), remark)
    return Score(str(act.level), "", remark)


def _one_line(remark: str) -> str:
    return " ".join(no_escapes(remark).split())


# --- out --------------------------------------------------------------------------------------------------------------


def write(desk: Desk, path: Path) -> tuple[int, int]:
    """Write all answers that a person reads into a table.

    Parameters
    ----------
    desk : where the class is scored
    path : .xlsx or .csv; replaced as a whole

    Returns
    -------
    tuple
        number of answers, and of those of which the instructor is asked

    Raises
    ------
    GradingError
        If it is of another kind, or cannot be written.
    """
    answers = desk.book.scores.answers()
    ranks = {where: rank for rank, where in enumerate(desk.in_order([one.where for one in answers]))}
    answers.sort(key=lambda one: (ranks[one.where], shuffled(one.student, one.where)))
    rows = [_row(desk, answer) for answer in answers]
    # By the mark at the beginning of a CSV a spreadsheet knows that it is UTF-8.
    content = _xlsx(rows) if _kind(path) == ".xlsx" else "\ufeff" + as_csv([COLUMNS, *rows])
    try:
        files.write(path, content)
    except OSError as error:
        raise GradingError(f"{path} cannot be written: {error.strerror}.") from None
    return len(answers), sum(one.asked for one in answers)


def _kind(path: Path) -> str:
    if path.suffix.lower() not in _KINDS:
        raise GradingError(f"{path}: a table ends in .xlsx or .csv.")
    return path.suffix.lower()


def _row(desk: Desk, answer: Answer) -> list[str]:
    score, text = score_of(answer), no_escapes(answer.mark.given)
    return [
        *(key_of(answer.student, answer.where), answer.question, answer.part, desk.label(answer.student, answer.where)),
        text if len(text) <= _LONGEST_CELL else text[:_LONGEST_CELL] + _CUT,
        shown_points(answer.mark.out_of),
        *score,
        no_escapes(state(answer)) if answer.asked or not answer.waiting else "",
        f"{seen(answer)}/{max((act.number for act in answer.acts), default=0)}/{score.digest()}",
    ]


def _xlsx(rows: Sequence[Sequence[str]]) -> bytes:
    from openpyxl import Workbook
    from openpyxl.cell.cell import ILLEGAL_CHARACTERS_RE
    from openpyxl.styles import Alignment, Font

    book = Workbook()
    table = book.active
    table.title = "scores"
    table.append(list(COLUMNS))
    for number, row in enumerate(rows, start=2):
        for column, (name, text) in enumerate(zip(COLUMNS, row, strict=True), start=1):
            cell = table.cell(number, column)
            cell.value = ILLEGAL_CHARACTERS_RE.sub("\ufffd", text)
            cell.data_type = "s"  # text, also if it begins as a formula does
            cell.quotePrefix = True
            cell.alignment = Alignment(wrap_text=True, vertical="top")
            if name in _NUMBERS and text:
                cell.value = float(text)
    for heading in table[1]:
        heading.font = Font(bold=True)
        column = table.column_dimensions[heading.column_letter]
        column.width, column.hidden = _WIDTHS.get(heading.value, 8), heading.value in _HIDDEN
    table.freeze_panes = "A2"
    content = io.BytesIO()
    book.save(content)
    return content.getvalue()


# --- in ---------------------------------------------------------------------------------------------------------------


def read(desk: Desk, path: Path, actor: str) -> Taken:
    """Take the rows of a table that were changed.

    Parameters
    ----------
    desk : where the class is scored
    path : a table that :func:`write` wrote; rows may be sorted or deleted
    actor : who scored

    Raises
    ------
    GradingError
        If it cannot be read, or is no such table. Then nothing is taken.
    """
    taken = Taken()
    answers = {key_of(one.student, one.where): one for one in desk.book.scores.answers()}
    used: dict[str, int] = {}
    for number, row in list(_rows(path)):
        answer = answers.get(row["key"] or "")
        try:
            if (first := used.setdefault(row["key"] or "", number)) != number:
                raise GradingError(f"this answer stands in row {first}, too; that one counts.")
            is_changed = _take(desk, row, answer, actor)
        except GradingError as error:
            taken.problems.append(f"Row {number}: {error}")
            continue
        taken.changed += is_changed
        taken.same += not is_changed
        is_new = answer is not None and not (row["check"] or "").startswith(seen(answer))
        if is_changed and answer and answer.given and (is_new or answer.given.actor != actor):
            label = desk.label(answer.student, answer.where)
            taken.replaced.append(f"Row {number}: {label} was scored before. {state(answer)}")
    return taken


def _rows(path: Path) -> Iterator[tuple[int, dict[str, str | None]]]:
    """Yield number and cells of each row that is not empty; a cell is None if it is a formula or an error."""
    heading, *lines = _lines(path) or [[]]
    names = [(text or "").strip().casefold() for text in heading]
    if missing := [name for name in NEEDED if name not in names]:
        raise GradingError(
            f"{path} is not a table of {program.name()} score --write: it has no column {', '.join(missing)}."
        )
    for number, line in enumerate(lines, start=2):
        if any(text is None or text.strip() for text in line):
            cells = dict(zip(names, [*line, *[""] * len(names)], strict=False))
            yield number, {name: text and from_spreadsheet_cell(text) for name, text in cells.items()}


def _lines(path: Path) -> Sequence[Sequence[str | None]]:
    kind = _kind(path)
    try:
        content = path.read_bytes()
        if len(content) > MOST_BYTES:
            raise GradingError(f"{path} is larger than any such table.")
        return from_csv(content) if kind == ".csv" else _xlsx_lines(content)
    except OSError as error:
        raise GradingError(f"{path} cannot be read: {error.strerror}.") from None
    except UnicodeDecodeError:
        raise GradingError("The table is not UTF-8: save it as “CSV UTF-8”, or as .xlsx.") from None
    except ValueError as error:
        raise GradingError(f"The table cannot be read: {error}.") from None


def _xlsx_lines(content: bytes) -> list[list[str | None]]:
    from openpyxl import load_workbook

    try:
        table = load_workbook(io.BytesIO(content), read_only=True).worksheets[0]
        return [[_text(cell) for cell in line] for line in table.iter_rows()]
    except Exception as error:  # of a broken or hostile file; openpyxl raises what its parts raise
        raise ValueError(error) from None


def _text(cell: Any) -> str | None:
    if cell.data_type in ("f", "e"):
        return None
    return "" if cell.value is None else str(cell.value)


def _take(desk: Desk, row: Mapping[str, str | None], answer: Answer | None, actor: str) -> bool:
    """Score one answer; return whether there was anything to do. Raises GradingError if the row is not taken."""
    for name in NEEDED:
        if row[name] is None:
            raise GradingError(f"its {name} is a formula, or an error. Type what it should be, and read it again.")
    score = Score(_number(row["level"] or ""), _number(row["points"] or ""), " ".join((row["remark"] or "").split()))
    check = (row["check"] or "").split("/")
    if len(check) != 3 or not check[1].isdecimal():
        raise GradingError("its column “check” was changed, so nobody knows what it replaces.")
    before, last, digest = check
    is_untouched, since = score.digest() == digest, _own_acts(answer, int(last), actor)
    if is_untouched and not (since and (score.level or score.points)):
        return False
    if answer is None:
        raise GradingError("there is no such answer any more: it was handed in again, or another part was meant.")
    level, points = _worth(desk, score, answer)
    same = [_gave(act, level, points, score.remark) for act in since]
    if same and same[-1]:
        return False  # the table was read before
    if is_untouched or any(same):  # nobody knows which of the two decisions is meant
        raise GradingError(f"{desk.conflict(answer)} You decided otherwise since the table was written or read.")
    if seen(answer) != before and not since:
        raise GradingError(f"{desk.conflict(answer)} Score it in the browser, or write the table anew.")
    pick = Pick(key_of(answer.student, answer.where), seen(answer))
    done = desk.give(actor, answer.where, [pick], level=level, points=points, remark=score.remark)
    for problem in done.problems:
        raise GradingError(problem)
    return True


def _own_acts(answer: Answer | None, last: int, actor: str) -> list[Act]:
    """Return what a scorer did to an answer since the act ``last``; nothing if somebody else changed it, too."""
    since = [] if answer is None else [act for act in answer.acts if act.number > last]
    is_own = answer is not None and (answer.asked or answer.decision is not None)  # else it is by labcourse mark
    return since if is_own and all(act.actor == actor for act in since) else []


def _gave(act: Act, level: int | None, points: float | None, remark: str) -> bool:
    """Return whether an act gave just that."""
    is_same = act.level == level and _one_line(act.remark) == remark
    return is_same and (points is None or (act.points is not None and math.isclose(act.points, points)))


def _worth(desk: Desk, score: Score, answer: Answer) -> tuple[int | None, float | None]:
    """Return the level, or the points, of a row."""
    levels = {str(level): level for level in desk.levels.shares}
    if bool(score.level) == bool(score.points):
        raise GradingError("give either a level or points. (A score is taken back in the browser, by the key u.)")
    if score.level and score.level not in levels:
        raise GradingError(f"there is no level {score.level!r}; there are {', '.join(sorted(levels))}.")
    if score.level:
        return levels[score.level], None
    if score.points == shown_points(answer.mark.points):  # 1/3 was written as 0.33, and stays 1/3
        return None, answer.mark.points
    try:
        points = float(score.points)
    except ValueError:
        points = math.nan
    if not 0 <= points <= answer.mark.out_of:
        raise GradingError(f"give 0 to {in_points(answer.mark.out_of)}, not {score.points!r}.")
    return None, points


def _number(text: str) -> str:
    """Return a number as it is written into a table, however a spreadsheet writes it; other text as it is."""
    return text.strip().removeprefix("'").replace(",", ".").removesuffix(".0")
