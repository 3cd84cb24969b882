"""Students, and marks that count: read, replaced and audited inside a transaction that the caller began."""

from __future__ import annotations

import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from typing import Any, TypeVar

from sqlalchemy import ColumnElement, func, insert, inspect, select
from sqlalchemy.orm import Session

from labcourse.errors import GradebookError
from labcourse.grading.gradebook import storable
from labcourse.grading.gradebook.records import (
    GIVEN_BY_A_PERSON,
    Act,
    AuditRecord,
    CommentRecord,
    Delivery,
    Erasure,
    GivenMark,
    Mark,
    MarkRecord,
    MarkState,
    Request,
    RunRecord,
    StudentRecord,
    Where,
)
from labcourse.student_id import caseless

NO_LONGER = "The answer, or the points possible, changed: the mark that a person gave no longer holds."

_Stored = TypeVar("_Stored", CommentRecord, Act, Request, Delivery)
_Named = TypeVar("_Named", AuditRecord, CommentRecord, Act, Request)


@dataclass(frozen=True)
class Current:
    """A student, their run that counts, and its marks, persons' marks included."""

    student: StudentRecord
    run: RunRecord
    marks: Mapping[Where, MarkRecord]

    def mark(self, where: Where) -> MarkRecord:
        """Return the mark for a part. Raises GradebookError if there is none."""
        if where not in self.marks:
            question, part = where
            raise GradebookError(f"{self.run.student!r} has no mark for question {question}, {part}.")
        return self.marks[where]


def now() -> datetime:
    """Return the time, in UTC."""
    return datetime.now(UTC)


# --- students ---------------------------------------------------------------------------------------------------------


def is_student(student: str) -> ColumnElement[bool]:
    """Return the condition for a student's row: the ID, without regard to capitals."""
    return StudentRecord.folded == caseless(student)


def find_student(session: Session, student: str) -> StudentRecord | None:
    """Look up a student, without regard to capitals."""
    return session.scalar(select(StudentRecord).where(is_student(student)))


def known_student(session: Session, student: str) -> StudentRecord:
    """Look up a student. Raises GradebookError if there is none."""
    match = find_student(session, student)
    if match is None:
        raise GradebookError(f"There is no student {storable.text(student)!r} in the gradebook.")
    return match


def student_for(session: Session, student: str) -> StudentRecord:
    """Look up a student, or add them. Raises GradebookError if the ID cannot be one."""
    student = storable.student(student)
    return find_student(session, student) or add_student(session, StudentRecord(student))


def add_student(session: Session, student: StudentRecord) -> StudentRecord:
    """Add a student, with a number that nobody had before, erased or not."""
    taken = (session.scalar(select(func.max(number))) or 0 for number in (StudentRecord.id, Erasure.number))
    student.id, student.folded = max(taken) + 1, caseless(student.student)
    session.add(student)
    session.flush()
    return student


def put(session: Session, student_id: int, record: _Stored, **own: Any) -> _Stored:
    """Store a student's record, with values for the database's own columns.

    Returns
    -------
    CommentRecord, Act, Request or Delivery
        The record with clean text, and with the number that the database gave it.
    """
    stored = storable.cleaned(record, f"The {type(record).__name__.removesuffix('Record').lower()}")
    for name, value in {"student_id": student_id, **own}.items():
        setattr(stored, name, value)
    session.add(stored)
    session.flush()
    return stored


def read(session: Session, table: type[_Named], *which: Any) -> list[_Named]:
    """Read records with the ID of their student, in the order in which they were written."""
    statement = select(table, StudentRecord.student).join(StudentRecord, StudentRecord.id == table.student_id)
    records = []
    for record, student in session.execute(statement.where(*which).order_by(*inspect(table).primary_key)):
        record.student = student
        records.append(record)
    return records


# --- the marks that count ---------------------------------------------------------------------------------------------


def current_run(session: Session, student: str) -> RunRecord | None:
    """Return the run of a student that counts."""
    return session.scalar(select(RunRecord).join(StudentRecord).where(is_student(student), RunRecord.current))


def current(session: Session, student: str) -> Current:
    """Return what counts for a student. Raises GradebookError if there is no such student, or no run of theirs."""
    about, run = known_student(session, student), current_run(session, student)
    if run is None:
        raise GradebookError(f"Nothing of {student!r} has been graded.")
    return Current(about, run, current_marks(session, about.id))


def current_marks(session: Session, student_id: int) -> dict[Where, MarkRecord]:
    """Return the marks that count for a student."""
    given = given_marks(session, student_id)
    made = made_marks(session, RunRecord.student_id == student_id, RunRecord.current)
    return {mark.where: with_decision(mark, given.get(mark.where)) for mark in made}


def made_marks(session: Session, *which: Any) -> list[MarkRecord]:
    """Return marks as the software made them."""
    return list(session.scalars(select(Mark.record).join(RunRecord).where(*which).order_by(Mark.position)))


def given_marks(session: Session, student_id: int) -> dict[Where, GivenMark]:
    """Return the marks that persons gave a student."""
    decisions = session.scalars(select(GivenMark).where(GivenMark.student_id == student_id))
    return {decision.mark.where: decision for decision in decisions}


def with_decision(mark: MarkRecord, decision: GivenMark | None) -> MarkRecord:
    """Return a person's mark in place of the software's, if it was for the same answer."""
    return replace(decision.mark, given=mark.given) if decision and holds(decision.mark, mark) else mark


def holds(decision: MarkRecord | Act, mark: MarkRecord) -> bool:
    """Return whether a person decided on this answer, white space aside, and for as many points."""
    return decision.out_of == mark.out_of and same_answer(decision.given, mark.given)


def same_answer(first: str, second: str) -> bool:
    """Return whether two answers differ at most in white space, or in how accents are composed."""
    left, right = (" ".join(unicodedata.normalize("NFC", text).split()) for text in (first, second))
    return left == right


# --- the audit trail --------------------------------------------------------------------------------------------------


def put_audit(session: Session, before: Current, actor: str, reason: str) -> int:
    """Write a row for each mark that changed; return how many did.

    Parameters
    ----------
    before : the student, the run that counts now, and the marks that counted before
    actor, reason : who changed them, and why
    """
    old_states, new_states = _states(before.marks), _states(current_marks(session, before.student.id))
    same = {"student_id": before.student.id, "run": before.run.key, "actor": actor, "when": now()}
    rows = []
    for question, part in sorted(old_states.keys() | new_states.keys()):
        old, new = old_states.get((question, part)), new_states.get((question, part))
        if old != new:
            lapsed = _is_manual(old) and not _is_manual(new)
            why = f"{reason} {NO_LONGER if lapsed else ''}".strip()
            rows.append({**same, "question": question, "part": part, "before": old, "after": new, "reason": why})
    if rows:
        session.execute(insert(AuditRecord), rows)
    return len(rows)


def _states(marks: Mapping[Where, MarkRecord]) -> dict[Where, MarkState]:
    """Return what of marks is audited."""
    return {where: MarkState(mark.status, mark.points, mark.out_of, mark.reason) for where, mark in marks.items()}


def _is_manual(state: MarkState | None) -> bool:
    return state is not None and state.status == GIVEN_BY_A_PERSON


# --- a person's decision ----------------------------------------------------------------------------------------------


def decided(mark: MarkRecord, points: float, reason: str) -> MarkRecord:
    """Return a mark with a person's points. Raises GradebookError if there are not so many points for it."""
    if not 0 <= points <= mark.out_of:  # not a number is refused, too
        raise GradebookError(
            f"Question {mark.question}, {mark.part}: give 0 to {mark.out_of:g} points, not {points:g}."
        )
    return replace(mark, status=GIVEN_BY_A_PERSON, points=float(points) + 0.0, reason=storable.text(reason))


def decide(session: Session, before: Current, where: Where, given: GivenMark | None, actor: str, reason: str) -> int:
    """Write a person's mark in place of an earlier one, and the audit trail; None leaves the software's mark."""
    key = (before.student.id, *where)
    if given is not None:
        given.student_id = before.student.id
        session.merge(given)
    elif (earlier := session.get(GivenMark, key)) is not None:
        session.delete(earlier)
    return put_audit(session, before, actor, reason)


def check_expected(session: Session, before: Current, mark: MarkRecord, expected: MarkRecord | None) -> None:
    """Refuse to replace a mark that changed since it was seen."""
    if expected is None:
        return
    same = (mark.status, mark.points) == (expected.status, expected.points)
    if not same or not same_answer(mark.given, expected.given):
        raise changed_since(session, before, mark)


def changed_since(session: Session, before: Current, mark: MarkRecord) -> GradebookError:
    """Return the error for who would replace a mark that changed since they saw it: who changed it, when, and why."""
    which = (AuditRecord.question == mark.question, AuditRecord.part == mark.part)
    last = read(session, AuditRecord, AuditRecord.student_id == before.student.id, *which)[-1]
    return GradebookError(
        f"Question {mark.question}, {mark.part}: {before.run.student!r} has {mark.points:g} points ({mark.status}) by "
        f"now, from {last.actor}, {last.when:%Y-%m-%d %H:%M} UTC: {mark.reason!r}. Nothing was changed. If that is to "
        f"be replaced, say that you expect {mark.points:g} (mark --expect {mark.points:g})."
    )
