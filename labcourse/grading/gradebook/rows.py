"""Records ↔ rows. Everything here happens inside a transaction that somebody else began, and will end."""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from typing import Any

from sqlalchemy import ColumnElement, Connection, Row, Select, delete, func, insert, select, update

from labcourse.errors import GradebookError
from labcourse.grading.gradebook.records import (
    DECIDED,
    GIVEN_BY_A_PERSON,
    Arrival,
    Delivery,
    GivenMark,
    Graded,
    MarkRecord,
    MarkState,
    RunRecord,
    StudentRecord,
)
from labcourse.grading.gradebook.tables import (
    answers,
    audit,
    decisions,
    deliveries,
    erasures,
    marks,
    runs,
    students,
    submissions,
)
from labcourse.student_id import caseless

NO_LONGER = "What was given, or what it is out of, is another: the mark that a person gave no longer holds."

Where = tuple[str, str]


@dataclass(frozen=True)
class Change:
    """Who changes something, and why."""

    actor: str
    reason: str


@dataclass(frozen=True)
class Stored:
    """A run that is there: the row's number, whose it is, and what it says, persons' marks included."""

    run_id: int
    student_id: int
    graded: Graded


def now() -> datetime:
    """The time, in UTC."""
    return datetime.now(UTC)


# --- students ---------------------------------------------------------------------------------------------------------


def find_student(connection: Connection, student: str) -> int | None:
    """The number of a student's row."""
    return connection.scalar(select(students.c.id).where(students.c.folded == caseless(student)))


def known_student(connection: Connection, student: str) -> int:
    """The number of a student's row. Raises GradebookError if there is none."""
    student_id = find_student(connection, student)
    if student_id is None:
        raise GradebookError(f"There is no student {student!r} in the gradebook.")
    return student_id


def student_record(row: Row[Any]) -> StudentRecord:
    """A student from their row."""
    details = (row.name, row.email, row.section)
    enrolled = any(details) if row.enrolled is None else row.enrolled
    return StudentRecord(row.student, *details, tuple(row.aliases or ()), enrolled)


def student_for(connection: Connection, student: str) -> int:
    """The number of a student's row, which is made if there is none."""
    there = find_student(connection, student)
    return add_student(connection, student, {}) if there is None else there


def add_student(connection: Connection, student: str, details: Mapping[str, Any]) -> int:
    """A new row for a student; its number, which nobody had before, erased or not."""
    taken = (connection.scalar(select(func.max(number))) or 0 for number in (students.c.id, erasures.c.number))
    nothing = {"name": "", "email": "", "section": "", "enrolled": False}
    row = {"id": max(taken) + 1, "student": student, "folded": caseless(student), **nothing, **details}
    return added(connection, insert(students).values(row))


def added(connection: Connection, statement: Any) -> int:
    """Carry an insertion out; the number of the new row."""
    number: int = connection.execute(statement).inserted_primary_key[0]  # type: ignore[index]
    return number


# --- what was handed in -----------------------------------------------------------------------------------------------


_WEAK_CLOCKS = (None, "", DECIDED)  # a time that is known so gives way to another one


def put_deliveries(connection: Connection, student_id: int, new: Sequence[Delivery]) -> int:
    """Write the files that are not there yet, and return how many.

    Another content of the same name, time and source is replaced: an instructor decided that another file counts.
    Another time of the same content and source is replaced where an instructor decided one of the two, or where nothing
    but the student's computer vouches for the old one.
    """
    columns = (getattr(deliveries.c, name) for name in ("id", "name", "digest", "received", "source", "clock"))
    there = connection.execute(select(*columns).where(deliveries.c.student_id == student_id)).all()
    wanted = {(one.name, one.digest, one.received): one for one in new}
    at_once = {(one.name, one.received, one.source) for one in new}
    alike = {(one.name, one.digest, one.source): (one.received, one.clock) for one in new}

    def is_replaced(row: Row[Any]) -> bool:
        received, clock = alike.get((row.name, row.digest, row.source), (row.received, row.clock))
        if (clock != row.clock and row.clock in _WEAK_CLOCKS) or (clock == DECIDED and received != row.received):
            return True
        same_time = (row.name, row.received, row.source) in at_once
        return same_time and (row.name, row.digest, row.received) not in wanted

    replaced = {row.id for row in there if is_replaced(row)}
    known = {(row.name, row.digest, row.received) for row in there if row.id not in replaced}
    connection.execute(delete(deliveries).where(deliveries.c.id.in_(replaced)))
    rows = [{"student_id": student_id, **vars(one)} for known_by, one in wanted.items() if known_by not in known]
    if rows:
        connection.execute(insert(deliveries), rows)
    return len(rows)


def give_over_deliveries(connection: Connection, source: str, received: datetime, student_id: int) -> list[str]:
    """Delete what came in a submission from all but its owner, and return the IDs of those it was taken from."""
    same = (deliveries.c.source == source) & (deliveries.c.received == received)  # the name may be another week's, too
    others = same & (deliveries.c.student_id != student_id)
    of_them = select(students.c.student).join(deliveries, deliveries.c.student_id == students.c.id).where(others)
    found = list(connection.scalars(of_them.distinct()))
    connection.execute(delete(deliveries).where(others))
    return found


def newest_deliveries(connection: Connection, student_id: int) -> list[Delivery]:
    """The newest of each file, by name; of those that came at the same time, the one that was recorded last."""
    order = (deliveries.c.name, deliveries.c.received, deliveries.c.id)
    found = select(deliveries.c.name, deliveries.c.id).where(deliveries.c.student_id == student_id).order_by(*order)
    newest = {row.name: row.id for row in connection.execute(found)}
    columns = (getattr(deliveries.c, name) for name in Delivery.__dataclass_fields__)
    wanted = select(*columns).where(deliveries.c.id.in_(newest.values()))
    there = (Delivery(**{**row._asdict(), "content": bytes(row.content)}) for row in connection.execute(wanted))
    return sorted(there, key=lambda one: one.name)


def notebooks_received(connection: Connection, student_id: int) -> dict[str, Arrival]:
    """Return when each notebook's newest content came first: handing in the same once more makes nothing late.

    A time that only the student's computer wrote counts where there is no other.
    """
    columns = (deliveries.c.name, deliveries.c.digest, deliveries.c.received, deliveries.c.clock)
    which = (deliveries.c.student_id == student_id) & deliveries.c.name.endswith(".ipynb", autoescape=True)
    in_order = connection.execute(select(*columns).where(which).order_by(deliveries.c.received, deliveries.c.id))
    first: dict[tuple[str, str], Arrival] = {}
    newest: dict[str, str] = {}
    for row in in_order:
        if first.setdefault((row.name, row.digest), Arrival(row.received, row.clock)).clock == "":
            first[row.name, row.digest] = Arrival(row.received, row.clock)
        newest[row.name] = row.digest
    return {name: first[name, digest] for name, digest in sorted(newest.items())}


# --- reading a run ----------------------------------------------------------------------------------------------------


def find_run(connection: Connection, key: str) -> Stored | None:
    """The run with a content key."""
    return _stored(connection, runs.c.key == key)


def current_run(connection: Connection, student_id: int) -> Stored | None:
    """The run of a student that counts."""
    return _stored(connection, (runs.c.student_id == student_id) & runs.c.current)


def numbered_run(connection: Connection, run_id: int) -> RunRecord:
    """The run of a row that is there."""
    found = _stored(connection, runs.c.id == run_id)
    assert found is not None
    return found.graded.run


def _stored(connection: Connection, which: ColumnElement[bool]) -> Stored | None:
    found: Select[Any] = (
        select(runs, submissions.c.digest, answers.c.content)
        .join(submissions, submissions.c.id == runs.c.submission_id)
        .join(answers, answers.c.run_id == runs.c.id, isouter=True)
        .where(which)
    )
    row = connection.execute(found).one_or_none()
    if row is None:
        return None
    given = given_marks(connection, row.student_id)
    made = _marks(connection, row.id)
    shown = tuple(with_decision(mark, given) for mark in made)
    lapsed = tuple(given[mark.where] for mark in made if mark.where in given and not holds(given[mark.where], mark))
    return Stored(row.id, row.student_id, Graded(_run(row), shown, row.key_digest, lapsed))


def _run(row: Row[Any]) -> RunRecord:
    return RunRecord(
        key=row.key,
        student=row.spelled,
        submission=row.digest,
        master=row.master,
        software=row.software,
        probe_seed=row.probe_seed,
        isolation=row.isolation,
        answers=None if row.content is None else bytes(row.content),
        problems=tuple(row.problems),
        notes=tuple(row.notes),
        cells=tuple(row.cells or ()),
        claim=row.claim or {},
        words=row.words or {},
        supplied=row.supplied or {},
        release=row.release or "",
        files=tuple(row.files or ()),
    )


def _marks(connection: Connection, run_id: int) -> list[MarkRecord]:
    """Marks as the software made them."""
    columns = (getattr(marks.c, name) for name in MarkRecord.__dataclass_fields__)
    found = select(*columns).where(marks.c.run_id == run_id).order_by(marks.c.position)
    return [MarkRecord(*row) for row in connection.execute(found)]


def given_marks(connection: Connection, student_id: int) -> dict[Where, GivenMark]:
    """The marks that persons set for a student."""
    found = connection.execute(select(decisions).where(decisions.c.student_id == student_id))
    given = map(given_mark, found)
    return {one.mark.where: one for one in given}


def given_mark(row: Row[Any]) -> GivenMark:
    """A mark that a person set, from its row."""
    mark = MarkRecord(row.question, row.part, GIVEN_BY_A_PERSON, row.points, row.out_of, row.reason, row.given)
    return GivenMark(mark, row.actor, row.decided)


def with_decision(mark: MarkRecord, given: Mapping[Where, GivenMark]) -> MarkRecord:
    """A person's mark in place of the software's, if it was for the same thing."""
    decided = given.get(mark.where)
    return replace(decided.mark, given=mark.given) if decided and holds(decided, mark) else mark


def holds(decided: GivenMark, mark: MarkRecord) -> bool:
    """Whether a person's mark was for what is given now, white space aside, and for as many points."""
    return decided.mark.out_of == mark.out_of and same_answer(decided.mark.given, mark.given)


def same_answer(one: str, other: str) -> bool:
    """Whether two answers differ in white space, or in how accents are put together, at most."""
    first, second = (" ".join(unicodedata.normalize("NFC", text).split()) for text in (one, other))
    return first == second


# --- writing a run ----------------------------------------------------------------------------------------------------


def put_run(connection: Connection, student_id: int, graded: Graded, there: Stored | None) -> int:
    """Write a run and what it left, unless that is there already; its row's number."""
    if there is not None and there.student_id != student_id:
        raise GradebookError(
            f"The run {graded.run.key} of {graded.run.student!r} has the key of a run of "
            f"{there.graded.run.student!r}: a key should depend on the student, too."
        )
    run = graded.run
    if there and there.graded.run == run and there.graded.key_digest == graded.key_digest:
        return there.run_id
    row = {
        "student_id": student_id,
        "submission_id": _submission(connection, student_id, run.submission),
        "key": run.key,
        "spelled": run.student,
        "master": run.master,
        "software": run.software,
        "probe_seed": run.probe_seed,
        "isolation": run.isolation,
        "problems": list(run.problems),
        "notes": list(run.notes),
        "cells": list(run.cells),
        "claim": run.claim,
        "words": run.words,
        "supplied": run.supplied,
        "release": run.release,
        "files": list(run.files),
        "key_digest": graded.key_digest,
        "recorded": now(),
    }
    if there is None:
        run_id = added(connection, insert(runs).values({**row, "current": False}))
    else:
        run_id = there.run_id
        connection.execute(update(runs).where(runs.c.id == run_id).values(row))
        connection.execute(delete(answers).where(answers.c.run_id == run_id))
    if run.answers is not None:
        connection.execute(insert(answers).values(run_id=run_id, content=run.answers))
    return run_id


def _submission(connection: Connection, student_id: int, digest: str) -> int:
    which = (submissions.c.student_id == student_id) & (submissions.c.digest == digest)
    found: int | None = connection.scalar(select(submissions.c.id).where(which))
    if found is not None:
        return found
    return added(connection, insert(submissions).values(student_id=student_id, digest=digest, first_seen=now()))


def put_marks(connection: Connection, run_id: int, new: Iterable[MarkRecord]) -> None:
    """Replace a run's marks. One that a person gave, read from here, leaves the software's beneath it as it is."""
    stored = _marks(connection, run_id)
    beneath = {mark.where: mark for mark in stored}
    wanted = []
    for mark in new:
        is_manual = mark.status == GIVEN_BY_A_PERSON
        if is_manual and mark.where not in beneath:
            raise GradebookError(f"Question {mark.question}, {mark.part}: a person's mark is set by set_mark only.")
        wanted.append(beneath[mark.where] if is_manual else mark)
    if wanted == stored:
        return
    connection.execute(delete(marks).where(marks.c.run_id == run_id))
    if wanted:
        rows = [{"run_id": run_id, "position": place, **vars(mark)} for place, mark in enumerate(wanted)]
        connection.execute(insert(marks), rows)


def make_current(connection: Connection, student_id: int, run_id: int) -> None:
    """Let a run be the one that counts."""
    others = (runs.c.student_id == student_id) & runs.c.current & (runs.c.id != run_id)
    connection.execute(update(runs).where(others).values(current=False))
    connection.execute(update(runs).where((runs.c.id == run_id) & ~runs.c.current).values(current=True))


def put_decision(connection: Connection, student_id: int, mark: MarkRecord, change: Change) -> None:
    """Write a person's mark in place of an earlier one."""
    key = {"student_id": student_id, "question": mark.question, "part": mark.part}
    connection.execute(delete(decisions).where(*(decisions.c[name] == value for name, value in key.items())))
    values = {"points": mark.points, "out_of": mark.out_of, "reason": mark.reason, "given": mark.given}
    connection.execute(insert(decisions).values(**key, **values, actor=change.actor, decided=now()))


def put_audit(connection: Connection, student_id: int, before: Stored | None, change: Change) -> int:
    """A row for each mark of a student that is another now than it was before; how many."""
    after = current_run(connection, student_id)
    old = {mark.where: mark for mark in before.graded.marks} if before else {}
    new = {mark.where: mark for mark in after.graded.marks} if after else {}
    rows = [
        {
            "student_id": student_id,
            "question": where[0],
            "part": where[1],
            **_side("before", old.get(where)),
            **_side("after", new.get(where)),
            "run": after.graded.run.key if after else "",
            "actor": change.actor,
            "why": f"{change.reason} {_note_on_manual_mark(old.get(where), new.get(where))}".strip(),
            "changed": now(),
        }
        for where in sorted(old.keys() | new.keys())
        if state(old.get(where)) != state(new.get(where))
    ]
    if rows:
        connection.execute(insert(audit), rows)
    return len(rows)


def state(mark: MarkRecord | None) -> MarkState | None:
    """What of a mark is audited."""
    return None if mark is None else MarkState(mark.status, mark.points, mark.out_of, mark.reason)


def _side(side: str, mark: MarkRecord | None) -> dict[str, Any]:
    names = MarkState.__dataclass_fields__
    return {f"{name}_{side}": getattr(mark, name, None) for name in names}


def _note_on_manual_mark(old: MarkRecord | None, new: MarkRecord | None) -> str:
    """A word on a person's decision that comes or goes, without a person's doing it."""
    was, is_now = (mark is not None and mark.status == GIVEN_BY_A_PERSON for mark in (old, new))
    return NO_LONGER if was and not is_now else ""
