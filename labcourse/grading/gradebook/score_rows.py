"""Acts of scoring, claims, and answers as scorers see them ↔ rows. Inside a transaction that somebody else began."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Sequence
from datetime import datetime, timedelta
from typing import Any

from sqlalchemy import Connection, Row, delete, insert, select, tuple_

from labcourse.grading.gradebook import rows
from labcourse.grading.gradebook.decided import Act, Answer
from labcourse.grading.gradebook.records import FOR_A_PERSON, GivenMark, MarkRecord
from labcourse.grading.gradebook.rows import Where
from labcourse.grading.gradebook.tables import claims, decisions, marks, runs, scores, students
from labcourse.student_id import caseless

#: The only round of scoring. Gradebooks of earlier versions may hold acts of a second, blind round as well: it changed
#: no mark, and is not read any more. The columns stay, so that those gradebooks need no migration.
ROUND = 1


def acts(connection: Connection, *which: Any) -> list[Act]:
    """Read acts in the order in which they were done."""
    read = select(scores, students.c.student).join(students).where(scores.c.round == ROUND, *which)
    found = read.order_by(scores.c.id)
    return [_act(row) for row in connection.execute(found)]


def acts_of(connection: Connection, parts: Collection[Where] | None = None, actor: str | None = None) -> list[Act]:
    """Acts on some parts, or all, by one scorer, or all."""
    whose = [] if actor is None else [scores.c.actor == actor]
    return acts(connection, *_among(scores, parts), *whose)


def _act(row: Row[Any]) -> Act:
    return Act(
        row.id,
        row.student,
        row.question,
        row.part,
        row.actor,
        row.level,
        row.points,
        row.out_of,
        row.remark,
        row.given,
        row.asked,
        row.undoes,
        row.acted,
    )


def put_act(connection: Connection, student_id: int, act: Act, replaced: dict[str, Any] | None) -> Act:
    """Write an act, which gets its number and time here."""
    values = {
        "student_id": student_id,
        "question": act.question,
        "part": act.part,
        "round": ROUND,
        "actor": act.actor,
        "level": act.level,
        "points": act.points,
        "out_of": act.out_of,
        "remark": act.remark,
        "given": act.given,
        "asked": act.asked,
        "undoes": act.undoes,
        "acted": rows.now(),
    }
    if replaced is not None:
        values["replaced"] = replaced
    number = rows.added(connection, insert(scores).values(values))
    return acts(connection, scores.c.id == number)[0]


def replaced(connection: Connection, number: int) -> dict[str, Any] | None:
    """The decision that an act took the place of."""
    found: dict[str, Any] | None = connection.scalar(select(scores.c.replaced).where(scores.c.id == number))
    return found


def standing(all_acts: Sequence[Act]) -> list[Act]:
    """Acts without those that were taken back, and without the taking back."""
    undone = {one.undoes for one in all_acts if one.undoes is not None}
    return [one for one in all_acts if one.undoes is None and one.number not in undone]


# --- answers ----------------------------------------------------------------------------------------------------------


def answers(connection: Connection, parts: Collection[Where] | None = None) -> list[Answer]:
    """Everybody's answers that a person reads or has marked, by student; of some parts, or all."""
    made = _made(connection, parts)
    given = _decisions(connection, parts)
    done: dict[tuple[str, Where], list[Act]] = defaultdict(list)
    for act in standing(acts_of(connection, parts)):
        done[act.student, act.where].append(act)
    found = []
    for student, mark in made:
        own = given.get((student, mark.where))
        if own is not None and not rows.holds(own, mark):
            own = None
        now = rows.with_decision(mark, {mark.where: own} if own else {})
        seen = tuple(one for one in done[student, mark.where] if _same(one, mark))
        if mark.status == FOR_A_PERSON or own is not None or seen:
            found.append(Answer(student, mark.question, mark.part, now, seen, own))
    return found


def _same(act: Act, mark: MarkRecord) -> bool:
    return act.out_of == mark.out_of and rows.same_answer(act.given, mark.given)


def _made(connection: Connection, parts: Collection[Where] | None) -> list[tuple[str, MarkRecord]]:
    """Student and mark, as the software made it, of all runs that count."""
    columns = [getattr(marks.c, name) for name in MarkRecord.__dataclass_fields__]
    found = (
        select(students.c.student, *columns)
        .join(runs, runs.c.student_id == students.c.id)
        .join(marks, marks.c.run_id == runs.c.id)
        .where(runs.c.current, *_among(marks, parts))
        .order_by(students.c.folded, marks.c.position)
    )
    return [(row[0], MarkRecord(*row[1:])) for row in connection.execute(found)]


def _decisions(connection: Connection, parts: Collection[Where] | None) -> dict[tuple[str, Where], GivenMark]:
    found = select(decisions, students.c.student).join(students).where(*_among(decisions, parts))
    return {(row.student, (row.question, row.part)): rows.given_mark(row) for row in connection.execute(found)}


def _among(table: Any, parts: Collection[Where] | None) -> list[Any]:
    return [] if parts is None else [tuple_(table.c.question, table.c.part).in_([tuple(one) for one in parts])]


# --- claims -----------------------------------------------------------------------------------------------------------


def claimed(connection: Connection, where: Where) -> dict[str, tuple[str, datetime]]:
    """Student → who reads their answer, and until when; claims that have run out are taken away by :func:`claim`."""
    found = (
        select(students.c.student, claims.c.actor, claims.c.until)
        .join(students)
        .where(*_of(where), claims.c.until > rows.now())
    )
    return {row.student: (row.actor, row.until) for row in connection.execute(found)}


def claim(connection: Connection, student: str, where: Where, actor: str, seconds: float) -> None:
    """Note who reads an answer, in place of who did."""
    student_id = rows.known_student(connection, student)
    question, part = where
    connection.execute(delete(claims).where(claims.c.student_id == student_id, *_of(where)))
    key = {"student_id": student_id, "question": question, "part": part, "round": ROUND}
    connection.execute(insert(claims).values(**key, actor=actor, until=rows.now() + timedelta(seconds=seconds)))


def let_go(connection: Connection, actor: str) -> None:
    """Take away what an actor has claimed, and all claims that have run out."""
    connection.execute(delete(claims).where((claims.c.actor == actor) | (claims.c.until <= rows.now())))


def _of(where: Where) -> list[Any]:
    return [claims.c.question == where[0], claims.c.part == where[1], claims.c.round == ROUND]


def first_free(order: Sequence[str], free: Collection[str]) -> str | None:
    """The first of an order that is free, without regard to capitals."""
    known = {caseless(one): one for one in free}
    return next((known[caseless(one)] for one in order if caseless(one) in known), None)
