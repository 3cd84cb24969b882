"""Scores out and in as a table, for who scores where there is no browser or no time for one: a row for each answer.

Only rows that were changed in the table are taken. Each row holds what the answer and its mark were when it was
written, so that nothing is replaced that somebody else decided in between.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from labcourse.errors import GradingError
from labcourse.grading.gradebook import Act, Answer
from labcourse.grading.reports.result import points as shown_points
from labcourse.grading.reports.result import worth as in_points
from labcourse.grading.scoring import table_files
from labcourse.grading.scoring.desk import Desk, Pick, key_of, seen, shuffled, state
from labcourse.grading.scoring.table_files import NEEDED, Cell
from labcourse.messages import plural
from labcourse.safe_text import no_escapes

_LONGEST_CELL = 32_000  # characters; a spreadsheet takes 32767
_CUT = " … (the rest does not fit into a cell: read it in the browser)"
_BETWEEN = "/"  # parts of a cell: no digest and no number has it
_DIGITS = 8  # hexadecimal, of the digest of what a row says


@dataclass
class Taken:
    """What became of a table.

    Attributes
    ----------
    changed, same : numbers of rows: scored, and as they were
    asked, decided : questions to the instructor that stood in the table, and those of them that it decided
    replaced : in words, each mark of a person's that another took the place of
    problems : in words, each row that was not taken
    """

    changed: int = 0
    same: int = 0
    asked: int = 0
    decided: int = 0
    replaced: list[str] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)

    def __str__(self) -> str:
        told = f"{self.changed} scored, {self.same} as they were, {len(self.problems)} not taken."
        if self.asked:
            told += " Of {questions} to the instructor it decided {decided}.".format(
                questions=plural(self.asked, "{count} question", "{count} questions"), decided=self.decided
            )
        return told


@dataclass(frozen=True)
class _Said:
    """What a row says of an answer; all as text, as it is typed."""

    level: str
    points: str
    remark: str

    def digest(self) -> str:
        return _digest(self.level, self.points, self.remark)


@dataclass(frozen=True)
class _Before:
    """What a row was when it was written.

    Attributes
    ----------
    seen : digest of the answer and its mark
    text : digest of the answer alone
    last : number of the last act on it
    level, points : that stood in it
    said : digest of what stood in it
    """

    seen: str
    text: str
    last: int
    level: str
    points: str
    said: str

    def __str__(self) -> str:
        return _BETWEEN.join((self.seen, self.text, str(self.last), self.level, self.points, self.said))

    @classmethod
    def read(cls, cell: str) -> _Before:
        """From a cell. Raises GradingError if it is not as it was written."""
        parts = cell.split(_BETWEEN)
        if len(parts) != len(cls.__dataclass_fields__) or not parts[2].isdecimal():
            raise GradingError("its column “check” was changed, so nobody knows what it replaces.")
        return cls(parts[0], parts[1], int(parts[2]), *parts[3:])


def _digest(*texts: str) -> str:
    return hashlib.sha256(json.dumps(texts).encode()).hexdigest()[:_DIGITS]


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
        How many there are, and of how many the instructor is asked.

    Raises
    ------
    GradingError
        If it is of another kind, or cannot be written.
    """
    answers = desk.book.scores.answers()
    ranks = {where: rank for rank, where in enumerate(desk.in_order([one.where for one in answers]))}
    answers.sort(key=lambda one: (ranks[one.where], shuffled(one.student, one.where)))
    table_files.write(path, [_row(desk, one) for one in answers])
    return len(answers), sum(one.asked for one in answers)


def _row(desk: Desk, answer: Answer) -> dict[str, str]:
    said = _said(answer)
    text = no_escapes(answer.mark.given)
    last = max((act.number for act in answer.acts), default=0)
    return {
        "key": key_of(answer.student, answer.where),
        "question": answer.question,
        "part": answer.part,
        "who": desk.label(answer.student, answer.where),
        "answer": text if len(text) <= _LONGEST_CELL else text[:_LONGEST_CELL] + _CUT,
        "out of": shown_points(answer.mark.out_of),
        "level": said.level,
        "points": said.points,
        "remark": said.remark,
        "state": no_escapes(state(answer)) if answer.asked or not answer.waiting else "",
        "check": str(_Before(seen(answer), _digest(answer.mark.given), last, said.level, said.points, said.digest())),
    }


def _said(answer: Answer) -> _Said:
    """What is decided; nothing while the answer waits."""
    if answer.waiting:
        return _Said("", "", "")
    given = answer.decision
    level = "" if given is None or given.level is None else str(given.level)
    return _Said(level, shown_points(answer.mark.points), _one_line(answer.mark.reason))


def _one_line(remark: str) -> str:
    return " ".join(no_escapes(remark).split())


# --- in ---------------------------------------------------------------------------------------------------------------


def read(desk: Desk, path: Path, actor: str) -> Taken:
    """Take the rows of a table that were changed.

    Parameters
    ----------
    desk : where the class is scored
    path : a table that :func:`write` wrote; rows may be sorted or left out
    actor : who scored

    Raises
    ------
    GradingError
        If it cannot be read, or is no such table. Then nothing is taken.
    """
    taken = Taken()
    there = {key_of(one.student, one.where): one for one in desk.book.scores.answers()}
    used: dict[str, int] = {}
    for number, cells in list(table_files.rows(path)):
        try:
            row = _whole(cells)
            key = row["key"]
            if key in used:
                raise GradingError(f"this answer stands in row {used[key]}, too; that one counts.")
            used[key] = number
            answer = there.get(key)
            taken.asked += answer is not None and answer.asked
            was = _take(desk, row, answer, actor)
        except GradingError as error:
            taken.problems.append(f"Row {number}: {error}")
            continue
        if was is None:
            taken.same += 1
            continue
        taken.changed += 1
        taken.decided += was.asked
        if not was.waiting and (_decided_by(was) != actor or seen(was) != _Before.read(row["check"]).seen):
            taken.replaced.append(_replaced(desk, number, was))
    return taken


def _whole(cells: Mapping[str, Cell]) -> dict[str, str]:
    """The cells of a row. Raises GradingError where one that matters has no content that could be read."""
    for name in NEEDED:
        if cells[name] is None:
            raise GradingError(
                f"its {name} is a formula without a result, or an error. Type what it should be (as text, where "
                "it begins with “=”), and read the table again."
            )
    return {name: text or "" for name, text in cells.items()}


def _replaced(desk: Desk, number: int, was: Answer) -> str:
    """In words which mark another took the place of."""
    now = desk.find(was.where, key_of(was.student, was.where))
    return (
        f"Row {number}: {desk.label(was.student, was.where)} was scored before. {state(was)} Now: "
        f"{in_points(now.mark.points if now else 0.0)}."
    )


def _take(desk: Desk, row: Mapping[str, str], answer: Answer | None, actor: str) -> Answer | None:
    """Score one answer; what it was, or None where there is nothing to do. Raises GradingError if it is not taken."""
    said = _Said(_number(row["level"]), _number(row["points"]), " ".join(row["remark"].split()))
    before = _Before.read(row["check"])
    untouched = said.digest() == before.said
    if untouched and (answer is None or not (said.level or said.points)):
        return None
    if answer is None:
        raise GradingError("there is no such answer any more: it was handed in again, or another part was meant.")
    since = _own_acts_since(answer, before, actor)
    if untouched and not since:
        return None
    if seen(answer) != before.seen and not since:
        raise GradingError(desk.conflict(answer))
    level, points = _worth(desk, said, before, answer)
    worth = desk.points(level, answer.mark.out_of) if level is not None else points
    given = [_is_so(act, level, worth, said.remark) for act in since]
    if given and given[-1]:
        return None
    if untouched or any(given):  # which of the two is meant, nobody knows
        raise GradingError(
            f"{desk.conflict(answer)} You decided otherwise since this row said so: set it in the browser."
        )
    done = desk.give(
        actor,
        answer.where,
        [Pick(key_of(answer.student, answer.where), seen(answer))],
        level=level,
        points=points,
        remark=said.remark,
    )
    for problem in done.problems:
        raise GradingError(problem)
    return answer


def _decided_by(answer: Answer) -> str:
    """Whose the mark is; "" where it is nobody's who scores."""
    return answer.decision.actor if answer.decision is not None else ""


def _own_acts_since(answer: Answer, before: _Before, actor: str) -> Sequence[Act]:
    """What a scorer did to an answer after the table was written; nothing if anybody else, or a new answer, did."""
    since = [act for act in answer.acts if act.number > before.last]
    if not since or _digest(answer.mark.given) != before.text or any(act.actor != actor for act in since):
        return []
    return since if answer.asked or _decided_by(answer) else []  # else it is by labcourse mark


def _is_so(act: Act, level: int | None, points: float | None, remark: str) -> bool:
    """Whether an act gave just that."""
    if act.points is None or points is None:
        return False
    return act.level == level and math.isclose(act.points, points) and _one_line(act.remark) == remark


def _worth(desk: Desk, said: _Said, before: _Before, answer: Answer) -> tuple[int | None, float | None]:
    """Level or points that a row gives: that of the two which was changed."""
    if not said.level and not said.points:
        raise GradingError(
            "there is neither level nor points. (What was given is taken back in the browser, by the key u.)"
        )
    new_level, new_points = said.level != before.level, said.points != before.points
    level = _level(desk, said.level) if said.level else None
    if level is not None and (new_level or not new_points):
        worth = desk.points(level, answer.mark.out_of)
        if new_points and said.points and said.points != shown_points(worth) and _float(said.points) != worth:
            raise GradingError(f"level {level} is {in_points(worth)}, and not {said.points}: clear one of the two.")
        return level, None
    if not said.points:
        raise GradingError("there are no points, and the level is as it was: clear both, or give one.")
    exact = answer.mark.points
    if not new_points and said.points == shown_points(exact):  # 1/3 was written as 0.33, and stays 1/3
        return None, exact
    return None, _points(said.points, answer.mark.out_of)


def _level(desk: Desk, text: str) -> int:
    levels = {str(level): level for level in desk.levels.shares}
    if text not in levels:
        raise GradingError(f"there is no level {text!r}; there are {', '.join(sorted(levels))}.")
    return levels[text]


def _points(text: str, out_of: float) -> float:
    points = _float(text)
    if not 0 <= points <= out_of:
        raise GradingError(f"give 0 to {in_points(out_of)}, not {text!r}.")
    return points


def _number(text: str) -> str:
    """A number as we write it, however a spreadsheet does, with all that was typed; other text as it is."""
    plain = text.strip().removeprefix("'").replace(",", ".")
    value = _float(plain)
    if math.isnan(value):
        return text.strip()
    return repr(value + 0.0).removesuffix(".0") if math.isfinite(value) else plain


def _float(text: str) -> float:
    """A number that is written as we write it; NaN for what is none."""
    try:
        return float(text)
    except ValueError:
        return math.nan
