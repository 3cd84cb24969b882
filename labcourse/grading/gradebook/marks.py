"""Students, runs, marks, decisions and the audit trail, inside a transaction that the caller began and will end."""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from datetime import UTC, datetime
from typing import Any, TypeVar

from sqlalchemy import delete, func, insert, inspect, select, update
from sqlalchemy.orm import Session, defer

from labcourse.errors import GradebookError
from labcourse.grading.gradebook import storable
from labcourse.grading.gradebook.records import (
    DECIDED,
    GIVEN_BY_A_PERSON,
    Act,
    Arrival,
    AuditRecord,
    CommentRecord,
    Delivery,
    Erasure,
    GivenMark,
    Graded,
    Mark,
    MarkRecord,
    MarkState,
    Request,
    RunRecord,
    StudentRecord,
    Where,
)
from labcourse.student_id import caseless

_WEAK_CLOCKS = (None, "", DECIDED)  # a time that is known so gives way to another one
NO_LONGER = "The answer, or the points possible, changed: the mark that a person gave no longer holds."

_Stored = TypeVar("_Stored", RunRecord, CommentRecord, Act, Request, Delivery)
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


def find_student(session: Session, student: str) -> StudentRecord | None:
    """Look up a student, without regard to capitals."""
    return session.scalar(select(StudentRecord).where(StudentRecord.folded == caseless(storable.text(student))))


def known_student(session: Session, student: str) -> StudentRecord:
    """Look up a student. Raises GradebookError if there is none."""
    match = find_student(session, student)
    if match is None:
        raise GradebookError(f"There is no student {storable.text(student)!r} in the gradebook.")
    return match


def student_for(session: Session, student: str) -> StudentRecord:
    """Look up a student, or add them."""
    return find_student(session, student) or add_student(session, StudentRecord(student))


def add_student(session: Session, student: StudentRecord) -> StudentRecord:
    """Add a student, with a number that nobody had before, erased or not."""
    taken = (session.scalar(select(func.max(number))) or 0 for number in (StudentRecord.id, Erasure.number))
    student.id, student.folded = max(taken) + 1, caseless(student.student)
    session.add(student)
    session.flush()
    return student


def put(session: Session, student_id: int, record: _Stored, **own: Any) -> _Stored:
    """Add a student's record, with values for the database's own columns; its number follows from that."""
    for name, value in {"student_id": student_id, **own}.items():
        setattr(record, name, value)
    session.add(record)
    session.flush()
    return record


def read(session: Session, table: type[_Named], *which: Any) -> list[_Named]:
    """Read records with the ID of their student, in the order in which they were written."""
    statement = select(table, StudentRecord.student).join(StudentRecord, StudentRecord.id == table.student_id)
    records = []
    for record, student in session.execute(statement.where(*which).order_by(*inspect(table).primary_key)):
        record.student = student
        records.append(record)
    return records


# --- what was handed in -----------------------------------------------------------------------------------------------


def put_deliveries(session: Session, student_id: int, new: Sequence[Delivery]) -> int:
    """Write the files that are not there yet, and return how many.

    Another content of the same name, time and source is replaced: an instructor decided that another file counts.
    Another time of the same content and source is replaced where an instructor decided one of the two, or where only
    the student's computer wrote the old one.
    """
    wanted = {(file.name, file.digest, file.received): file for file in new}
    same_time = {(file.name, file.received, file.source) for file in new}
    same_content = {(file.name, file.digest, file.source): (file.received, file.clock) for file in new}

    def is_replaced(old: Delivery) -> bool:
        received, clock = same_content.get((old.name, old.digest, old.source), (old.received, old.clock))
        if (clock != old.clock and old.clock in _WEAK_CLOCKS) or (clock == DECIDED and received != old.received):
            return True
        came_with_it = (old.name, old.received, old.source) in same_time
        return came_with_it and (old.name, old.digest, old.received) not in wanted

    files = select(Delivery).where(Delivery.student_id == student_id).options(defer(Delivery.content))
    stored = list(session.scalars(files))
    replaced = {old.id for old in stored if is_replaced(old)}
    session.execute(delete(Delivery).where(Delivery.id.in_(replaced)))
    for old in stored:
        if old.id not in replaced:
            wanted.pop((old.name, old.digest, old.received), None)
    for file in wanted.values():
        put(session, student_id, file)
    return len(wanted)


def give_over_deliveries(session: Session, source: str, received: datetime, student_id: int) -> list[str]:
    """Delete what came in a submission from all but its owner, and return the IDs of those it was taken from."""
    same = (Delivery.source == source) & (Delivery.received == received)  # the name may be another week's, too
    others = same & (Delivery.student_id != student_id)
    students = list(session.scalars(select(StudentRecord.student).join(Delivery).where(others).distinct()))
    session.execute(delete(Delivery).where(others))
    return students


def newest_deliveries(session: Session, student_id: int) -> list[Delivery]:
    """Return the newest of each file, by name; of those that came at the same time, the one recorded last."""
    order = (Delivery.received.desc(), Delivery.id.desc())
    rank = func.row_number().over(partition_by=Delivery.name, order_by=order).label("rank")
    ranked = select(Delivery.id, rank).where(Delivery.student_id == student_id).subquery()
    files = select(Delivery).where(Delivery.id.in_(select(ranked.c.id).where(ranked.c.rank == 1)))
    return sorted(session.scalars(files), key=lambda file: file.name)


def notebooks_received(session: Session, student_id: int) -> dict[str, Arrival]:
    """Return when each notebook's newest content came first: handing in the same once more makes nothing late.

    A time that only the student's computer wrote counts where there is no other.
    """
    first: dict[tuple[str, str], Arrival] = {}
    last: dict[str, str] = {}
    order = (Delivery.received, Delivery.id)
    notebooks = Delivery.name.endswith(".ipynb", autoescape=True)
    statement = select(Delivery).where(Delivery.student_id == student_id, notebooks).order_by(*order)
    for file in session.scalars(statement.options(defer(Delivery.content))):
        if first.setdefault((file.name, file.digest), Arrival(file.received, file.clock)).clock == "":
            first[file.name, file.digest] = Arrival(file.received, file.clock)
        last[file.name] = file.digest
    return {name: first[name, digest] for name, digest in sorted(last.items())}


# --- reading marks ----------------------------------------------------------------------------------------------------


def find_run(session: Session, key: str) -> RunRecord | None:
    """Look up a run by its content key."""
    return session.scalar(select(RunRecord).where(RunRecord.key == storable.text(key)))


def current_run(session: Session, student_id: int) -> RunRecord | None:
    """Return the run of a student that counts."""
    return session.scalar(select(RunRecord).where(RunRecord.student_id == student_id, RunRecord.current))


def current(session: Session, student: str) -> Current:
    """Return what counts for a student. Raises GradebookError if there is no such student, or no run of theirs."""
    about = known_student(session, student)
    run = current_run(session, about.id)
    if run is None:
        raise GradebookError(f"Nothing of {student!r} has been graded.")
    return Current(about, run, current_marks(session, about.id))


def current_marks(session: Session, student_id: int) -> dict[Where, MarkRecord]:
    """Return the marks that count for a student."""
    given = given_marks(session, student_id)
    made = _made(session, RunRecord.student_id == student_id, RunRecord.current)
    return {mark.where: with_decision(mark, given) for mark in made}


def graded(session: Session, run: RunRecord) -> Graded:
    """Return a run with its marks as they count now."""
    made, given = _made(session, RunRecord.id == run.id), given_marks(session, run.student_id)
    lapsed = [given[mark.where] for mark in made if mark.where in given and not holds(given[mark.where].mark, mark)]
    return Graded(run, tuple(with_decision(mark, given) for mark in made), run.key_digest, tuple(lapsed))


def _made(session: Session, *which: Any) -> list[MarkRecord]:
    """Return the marks of a run as the software made them."""
    return list(session.scalars(select(Mark.record).join(RunRecord).where(*which).order_by(Mark.position)))


def given_marks(session: Session, student_id: int) -> dict[Where, GivenMark]:
    """Return the marks that persons gave a student."""
    decisions = session.scalars(select(GivenMark).where(GivenMark.student_id == student_id))
    return {decision.mark.where: decision for decision in decisions}


def with_decision(mark: MarkRecord, given: Mapping[Where, GivenMark]) -> MarkRecord:
    """Return a person's mark in place of the software's, if it was for the same answer."""
    decision = given.get(mark.where)
    return replace(decision.mark, given=mark.given) if decision and holds(decision.mark, mark) else mark


def holds(decision: MarkRecord | Act, mark: MarkRecord) -> bool:
    """Return whether a person decided on this answer, white space aside, and for as many points."""
    return decision.out_of == mark.out_of and same_answer(decision.given, mark.given)


def same_answer(first: str, second: str) -> bool:
    """Return whether two answers differ at most in white space, or in how accents are composed."""
    left, right = (" ".join(unicodedata.normalize("NFC", text).split()) for text in (first, second))
    return left == right


# --- writing marks ----------------------------------------------------------------------------------------------------


def put_run(session: Session, student_id: int, graded: Graded) -> RunRecord:
    """Write a run, unless it is there already."""
    run, there = graded.run, find_run(session, graded.run.key)
    if there is None:
        return put(session, student_id, run, current=False, key_digest=graded.key_digest, recorded=now())
    if there.student_id != student_id:
        raise GradebookError(
            f"The run {run.key} of {run.student!r} has the key of a run of {there.student!r}: a key should depend on "
            "the student, too."
        )
    if there != run or there.key_digest != graded.key_digest:
        for field in fields(run):
            setattr(there, field.name, getattr(run, field.name))
        there.key_digest, there.recorded = graded.key_digest, now()
    return there


def put_marks(session: Session, run_id: int, new: Iterable[MarkRecord]) -> None:
    """Replace a run's marks. A person's mark among them leaves the software's mark beneath it as it is."""
    stored = _made(session, RunRecord.id == run_id)
    beneath = {mark.where: mark for mark in stored}
    wanted = []
    for mark in new:
        is_manual = mark.status == GIVEN_BY_A_PERSON
        if is_manual and mark.where not in beneath:
            raise GradebookError(f"Question {mark.question}, {mark.part}: a person's mark is set by set_mark only.")
        wanted.append(beneath[mark.where] if is_manual else mark)
    if wanted != stored:
        session.execute(delete(Mark).where(Mark.run_id == run_id))
        rows = [{"run_id": run_id, "position": place, **vars(mark)} for place, mark in enumerate(wanted)]
        if rows:
            session.execute(insert(Mark), rows)


def make_current(session: Session, run: RunRecord) -> None:
    """Make a run the one that counts."""
    if not run.current:
        session.execute(update(RunRecord).where(RunRecord.student_id == run.student_id).values(current=False))
        run.current = True


def decision(session: Session, student_id: int, where: Where) -> GivenMark | None:
    """Return a person's mark, whether it holds or not."""
    return session.get(GivenMark, (student_id, *where))


def put_decision(session: Session, student_id: int, given: GivenMark) -> None:
    """Write a person's mark in place of an earlier one."""
    given.student_id = student_id
    session.merge(given)


def put_audit(session: Session, before: Current, actor: str, reason: str) -> int:
    """Write a row for each mark that changed; return how many did.

    Parameters
    ----------
    before : the student, the run that counts now, and the marks that counted before
    actor, reason : who changed them, and why
    """
    now_marks, when = current_marks(session, before.student.id), now()
    rows = [
        {
            **{"student_id": before.student.id, "question": where[0], "part": where[1], "run": before.run.key},
            **{"before": _state(old), "after": _state(new), "actor": actor, "when": when},
            "reason": f"{reason} {_note_on_manual_mark(old, new)}".strip(),
        }
        for where in sorted(before.marks.keys() | now_marks.keys())
        if _state(old := before.marks.get(where)) != _state(new := now_marks.get(where))
    ]
    if rows:
        session.execute(insert(AuditRecord), rows)
    return len(rows)


def _state(mark: MarkRecord | None) -> MarkState | None:
    """Return what of a mark is audited."""
    return None if mark is None else MarkState(mark.status, mark.points, mark.out_of, mark.reason)


def _note_on_manual_mark(old: MarkRecord | None, new: MarkRecord | None) -> str:
    """Say that a person's mark no longer holds, where that changed a mark."""
    was, is_now = (mark is not None and mark.status == GIVEN_BY_A_PERSON for mark in (old, new))
    return NO_LONGER if was and not is_now else ""


# --- a person's decision ----------------------------------------------------------------------------------------------


def decided(mark: MarkRecord, points: float, reason: str) -> MarkRecord:
    """Return a mark with a person's points. Raises GradebookError if there are not so many points for it."""
    if not 0 <= points <= mark.out_of:  # not a number is refused, too
        raise GradebookError(
            f"Question {mark.question}, {mark.part}: give 0 to {mark.out_of:g} points, not {points:g}."
        )
    return replace(mark, status=GIVEN_BY_A_PERSON, points=float(points) + 0.0, reason=reason)


def check_expected(session: Session, current: Current, where: Where, expected: MarkRecord | None) -> None:
    """Refuse to replace a mark that changed since it was seen."""
    if expected is None:
        return
    mark = current.mark(where)
    same = (mark.status, mark.points) == (storable.text(expected.status), expected.points)
    if not same or not same_answer(mark.given, storable.text(expected.given)):
        raise changed_since(session, current, where)


def changed_since(session: Session, current: Current, where: Where) -> GradebookError:
    """Return the error for who would replace a mark that changed since they saw it: who changed it, when, and why."""
    mark, (question, part) = current.mark(where), where
    which = (AuditRecord.question == question, AuditRecord.part == part)
    last = read(session, AuditRecord, AuditRecord.student_id == current.student.id, *which)[-1]
    return GradebookError(
        f"Question {question}, {part}: {current.run.student!r} has {mark.points:g} points ({mark.status}) by now, from "
        f"{last.actor}, {last.when:%Y-%m-%d %H:%M} UTC: {mark.reason!r}. Nothing was changed. If that is to be "
        f"replaced, say that you expect {mark.points:g} (mark --expect {mark.points:g})."
    )


def as_json(given: GivenMark) -> dict[str, Any]:
    """Return a person's mark as plain data, from which :func:`from_json` makes it again."""
    return {**vars(given.mark), "actor": given.actor, "when": given.when.isoformat()}


def from_json(data: Mapping[str, Any]) -> GivenMark:
    """Make a person's mark again."""
    mark = MarkRecord(**{field.name: data[field.name] for field in fields(MarkRecord)})
    return GivenMark(mark, data["actor"], datetime.fromisoformat(data["when"]))
