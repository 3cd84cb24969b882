"""A person's decision on a mark: what there has to be, what is refused, and what is written. Inside a transaction."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime
from typing import Any

from sqlalchemy import Connection, delete, insert, select

from labcourse.errors import GradebookError
from labcourse.grading.gradebook import rows, storable
from labcourse.grading.gradebook.records import GIVEN_BY_A_PERSON, MarkRecord
from labcourse.grading.gradebook.tables import audit, decisions


def run_of(connection: Connection, student: str) -> rows.Stored:
    """The run of a student that counts. Raises GradebookError if there is none."""
    found = rows.current_run(connection, rows.known_student(connection, storable.text(student)))
    if found is None:
        raise GradebookError(f"Nothing of {student!r} has been graded.")
    return found


def mark_of(stored: rows.Stored, where: rows.Where) -> MarkRecord:
    """The mark for a part. Raises GradebookError if there is none."""
    for mark in stored.graded.marks:
        if mark.where == where:
            return mark
    question, part = where
    raise GradebookError(f"{stored.graded.run.student!r} has no mark for question {question}, {part}.")


def check_points(mark: MarkRecord, points: float) -> None:
    """Refuse points that there are not for a part."""
    if not 0 <= points <= mark.out_of:  # nor not a number
        raise GradebookError(
            f"Question {mark.question}, {mark.part}: give 0 to {mark.out_of:g} points, not {points:g}."
        )


def check_expected(connection: Connection, stored: rows.Stored, mark: MarkRecord, expected: MarkRecord | None) -> None:
    """Refuse to replace a mark that is another than was seen last."""
    if expected is not None and not _as_expected(mark, expected):
        raise taken(connection, stored, mark)


def _as_expected(mark: MarkRecord, expected: MarkRecord) -> bool:
    same = (mark.status, mark.points) == (storable.text(expected.status), expected.points)
    return same and rows.same_answer(mark.given, storable.text(expected.given))


def decided(mark: MarkRecord, points: float, reason: str) -> MarkRecord:
    """A mark with a person's points in place of what was there."""
    return replace(mark, status=GIVEN_BY_A_PERSON, points=float(points) + 0.0, reason=reason)


def stored_decision(connection: Connection, student_id: int, where: rows.Where) -> dict[str, Any] | None:
    """A person's decision as it lies in its table, as plain data; None if there is none."""
    found = connection.execute(select(decisions).where(*_which(student_id, where))).mappings().one_or_none()
    return None if found is None else {**found, "decided": found["decided"].isoformat()}


def put_back(connection: Connection, student_id: int, where: rows.Where, was: dict[str, Any] | None) -> None:
    """Let a decision be as it was; none where it was None."""
    connection.execute(delete(decisions).where(*_which(student_id, where)))
    if was is not None:
        connection.execute(insert(decisions).values({**was, "decided": datetime.fromisoformat(was["decided"])}))


def _which(student_id: int, where: rows.Where) -> list[Any]:
    key = (student_id, *where)
    return [column == value for column, value in zip(decisions.primary_key.columns, key, strict=True)]


def taken(connection: Connection, stored: rows.Stored, mark: MarkRecord) -> GradebookError:
    """The error for whoever would replace a mark that is another than they have seen: who made it so, when, and why."""
    which = (audit.c.student_id == stored.student_id, audit.c.question == mark.question, audit.c.part == mark.part)
    last = connection.execute(select(audit).where(*which).order_by(audit.c.id.desc()).limit(1)).one()
    return GradebookError(
        f"Question {mark.question}, {mark.part}: {stored.graded.run.student!r} has {mark.points:g} points "
        f"({mark.status}) by now, from {last.actor}, {last.changed:%Y-%m-%d %H:%M} UTC: {mark.reason!r}. Nothing "
        f"was changed. If that is to be replaced, say that you expect {mark.points:g} (mark --expect "
        f"{mark.points:g})."
    )
