"""Erasing a person: every row of theirs, and their name in what others are told. Inside a transaction.

What others wrote and handed in is theirs and stays as it is, also where it names the person; so does who gave a mark.
Both are told.
"""

from __future__ import annotations

import hmac
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from sqlalchemy import ColumnElement, Connection, Row, Table, and_, delete, func, insert, select, update

from labcourse.grading.gradebook import rows
from labcourse.grading.gradebook.naming import Person
from labcourse.grading.gradebook.records import Delivery, Erased, RunRecord
from labcourse.grading.gradebook.tables import (
    answers,
    audit,
    claims,
    comments,
    decisions,
    deliveries,
    erasures,
    marks,
    publications,
    requests,
    runs,
    scores,
    students,
    submissions,
)
from labcourse.student_id import caseless

#: Tables with rows of one student, each after those that refer to it; what hangs on a run comes before.
_OF_RUNS = (answers, marks)
_OF_STUDENTS = (scores, audit, claims, requests, comments, decisions, runs, submissions, deliveries)
#: What persons write about others' work, and requests: table → columns of text.
_WRITTEN = {
    comments: ("text",),
    decisions: ("reason",),
    audit: ("reason_before", "reason_after", "why"),
    scores: ("remark",),
    requests: ("text", "answer"),
    publications: ("note",),
    deliveries: ("source",),
}
_ACTORS = {
    **dict.fromkeys((audit, scores, decisions, comments, publications, erasures), "actor"),
    requests: "answered_by",
}


@dataclass(frozen=True)
class OfOthers:
    """What becomes of others' records that name a person; each is given the person, and leaves alone what does not.

    Attributes
    ----------
    run : a run of another student → the same without the person
    file : name and content of a file that another handed in → the content without the person
    shares : whether a run of another is of what the person handed in, and so of their common work
    """

    run: Callable[[RunRecord, Person], RunRecord] = lambda run, person: run
    file: Callable[[str, bytes, Person], bytes] = lambda name, content, person: content
    shares: Callable[[RunRecord, Person], bool] = lambda run, person: False


def erase(connection: Connection, student: str, actor: str, secret: bytes, of_others: OfOthers) -> Erased:
    """Erase a person. Raises GradebookError if there is no such student."""
    number = rows.known_student(connection, student)
    about = rows.student_record(connection.execute(select(students).where(students.c.id == number)).one())
    person = Person(about, number)
    counts = {table.name: _count(connection, table, number) for table in (*_OF_RUNS, *_OF_STUDENTS)}
    sources = tuple(connection.scalars(_sources(number)))
    connection.execute(
        insert(erasures).values(
            number=number,
            gone=-number,
            fingerprint=fingerprint(secret, about.student),
            actor=actor,
            lines=sum(counts.values()),
            erased=rows.now(),
        )
    )
    whose = {row.id: row.student for row in connection.execute(select(students.c.id, students.c.student))}
    _hand_over(connection, person, number, of_others)
    struck = [*_strike(connection, person, number, whose), *_rewrite(connection, person, number, whose, of_others)]
    for table in (*_OF_RUNS, *_OF_STUDENTS):
        connection.execute(delete(table).where(_theirs(table, number)))
    connection.execute(delete(students).where(students.c.id == number))
    left = tuple(sorted(set(_left(connection, person, whose))))
    return Erased(about, counts, tuple(dict.fromkeys(struck)), left, sources, person.unsought)


def fingerprint(secret: bytes, student: str) -> bytes:
    """By what a student is known who is in the gradebook no more; only the gradebook's secret makes it of an ID."""
    return hmac.digest(secret, f"erased: {caseless(student)}".encode(), "sha256")


def erased(connection: Connection, secret: bytes, given: Sequence[str]) -> dict[str, datetime]:
    """Of some students, those who were erased and have not come again, and when that was."""
    when = {row.fingerprint: row.erased for row in connection.execute(select(erasures).order_by(erasures.c.number))}
    by_id = {one: when.get(fingerprint(secret, one)) for one in given} if when else {}
    return {one: at for one, at in by_id.items() if at is not None and rows.find_student(connection, one) is None}


def everything_of(connection: Connection, student: str) -> tuple[dict[str, list[dict[str, Any]]], list[Delivery]]:
    """All rows of a student, by table, and all that they handed in. Raises GradebookError if there is none."""
    number = rows.known_student(connection, student)
    tables = (students, *(table for table in reversed(_OF_STUDENTS) if table is not deliveries), *_OF_RUNS)
    found = {}
    for table in tables:
        which = students.c.id == number if table is students else _theirs(table, number)
        columns = [column for column in table.columns if column.name != "folded"]
        there = connection.execute(select(*columns).where(which).order_by(*table.primary_key.columns))
        found[table.name] = [dict(row) for row in there.mappings()]
    columns = [getattr(deliveries.c, name) for name in Delivery.__dataclass_fields__]
    handed_in = select(*columns).where(deliveries.c.student_id == number).order_by(deliveries.c.received)
    files = [Delivery(**{**row._asdict(), "content": bytes(row.content)}) for row in connection.execute(handed_in)]
    return found, files


def _theirs(table: Table, number: int) -> ColumnElement[bool]:
    """Which rows of a table are a student's."""
    if "student_id" in table.c:
        return table.c.student_id == number
    return table.c.run_id.in_(select(runs.c.id).where(runs.c.student_id == number))


def _count(connection: Connection, table: Table, number: int) -> int:
    return connection.scalar(select(func.count()).select_from(table).where(_theirs(table, number))) or 0


def _sources(number: int) -> Any:
    return select(deliveries.c.source).distinct().where(deliveries.c.student_id == number, deliveries.c.source != "")


# --- in what others are told ------------------------------------------------------------------------------------------


def _strike(connection: Connection, person: Person, number: int, whose: Mapping[int, str]) -> Iterator[str]:
    """Strike a person out of what was written about others; where it was."""
    for table, names in _WRITTEN.items():
        for row in _others(connection, table, number):
            now = dict(row._mapping)
            for word in person.words:  # one at a time: the guards look at one
                new: dict[str, Any] = {name: person.struck_once(now[name], word) for name in names if now[name]}
                if table is scores and now["replaced"]:
                    reason = person.struck_once(now["replaced"]["reason"], word)
                    new["replaced"] = {**now["replaced"], "reason": reason}
                changed = {name: value for name, value in new.items() if value != now[name]}
                if changed:
                    key = and_(*(column == now[column.name] for column in table.primary_key.columns))
                    connection.execute(update(table).where(key).values(changed))
                    yield _place(table, now, whose)
                now |= changed


def _others(connection: Connection, table: Table, number: int) -> list[Row[Any]]:
    """The rows of a table that are not the person's."""
    found = select(*(column for column in table.columns if column.name != "content"))
    if "student_id" in table.c:
        found = found.where(table.c.student_id != number)
    return list(connection.execute(found))


def _place(table: Table, about: Mapping[str, Any], whose: Mapping[int, str]) -> str:
    called = {
        comments: "word to them",
        decisions: "reason of a mark",
        audit: "audit trail",
        scores: "remark",
        requests: "request to look again",
        publications: "note on what was given back",
        deliveries: "name of what they handed in",
    }[table]
    parts = [called, about.get("question"), about.get("part"), about.get("name"), about.get("actor")]
    if table is publications:
        return called
    return f"{whose[about['student_id']]}: {', '.join(filter(None, parts))}"


# --- in what others handed in -----------------------------------------------------------------------------------------


def _rewrite(
    connection: Connection, person: Person, number: int, whose: Mapping[int, str], of_others: OfOthers
) -> Iterator[str]:
    """Let others' runs and files be without a person, as far as the course's machinery knows how; where it was."""
    there = select(runs.c.id, runs.c.student_id).where(runs.c.student_id != number).order_by(runs.c.id)
    for run_id, student_id in connection.execute(there).all():
        stored = rows.numbered_run(connection, run_id)
        new = of_others.run(stored, person)
        if new == stored:
            continue
        values = {"problems": list(new.problems), "notes": list(new.notes), "cells": list(new.cells)}
        connection.execute(update(runs).where(runs.c.id == run_id).values(values))
        if new.answers != stored.answers:
            connection.execute(update(answers).where(answers.c.run_id == run_id).values(content=new.answers))
        yield f"{whose[student_id]}: what is said of their run"
    for row in connection.execute(select(deliveries).where(deliveries.c.student_id != number)).all():
        content = of_others.file(row.name, bytes(row.content), person)
        if content != row.content:
            connection.execute(update(deliveries).where(deliveries.c.id == row.id).values(content=content))
            yield f"{whose[row.student_id]}: {row.name}"


def _hand_over(connection: Connection, person: Person, number: int, of_others: OfOthers) -> None:
    """Let files that a person handed in be kept as those of others, too, whose work they are by the person's word."""
    found = connection.execute(select(deliveries).where(deliveries.c.student_id == number)).mappings().all()
    theirs = [{name: value for name, value in row.items() if name != "id"} for row in found]
    for student_id in connection.scalars(select(runs.c.student_id).where(runs.c.current, runs.c.student_id != number)):
        current = rows.current_run(connection, student_id)
        if current is not None and of_others.shares(current.graded.run, person):
            own = set(connection.scalars(select(deliveries.c.name).where(deliveries.c.student_id == student_id)))
            new = [{**row, "student_id": student_id} for row in theirs if row["name"] not in own]
            if new:
                connection.execute(insert(deliveries), new)


# --- what stays -------------------------------------------------------------------------------------------------------


def _left(connection: Connection, person: Person, whose: Mapping[int, str]) -> Iterator[str]:
    """Where a person is named still."""
    yield from _in_own_work(connection, person, whose)
    for table, names in _WRITTEN.items():
        for row in connection.execute(select(table)):
            if _is_named(person, *(row._mapping[name] for name in names), row._mapping.get("replaced")):
                yield _place(table, dict(row._mapping), whose)
    for table, column in _ACTORS.items():
        for actor in connection.scalars(select(table.c[column]).distinct()):
            if _is_named(person, actor):
                yield f"{actor} is named as who marked, wrote, published or erased"


def _in_own_work(connection: Connection, person: Person, whose: Mapping[int, str]) -> Iterator[str]:
    """Where others wrote of a person, in what they handed in."""
    for row in connection.execute(select(deliveries.c.student_id, deliveries.c.name, deliveries.c.content)):
        if _is_named(person, row.name, row.content):
            yield f"{whose[row.student_id]} handed in: {row.name}"
    for row in connection.execute(select(runs, answers.c.content).join(answers, isouter=True)):
        if _is_named(person, *row):
            yield f"{whose[row.student_id]}: what their run left"
    of_runs = select(runs.c.student_id, marks).join(runs, runs.c.id == marks.c.run_id)
    for found in (of_runs, select(decisions), select(scores)):
        for row in connection.execute(found):
            if _is_named(person, row.given, row._mapping.get("status") and row.reason):
                yield f"{whose[row.student_id]}: answer {row.question}, {row.part}"


def _is_named(person: Person, *contents: Any) -> bool:
    for content in contents:
        if isinstance(content, dict | list):
            found = person.named_in(json.dumps(content, ensure_ascii=False))
        elif isinstance(content, str):
            found = person.named_in(content)
        else:
            found = isinstance(content, bytes | memoryview) and person.named_in(bytes(content))
        if found:
            return True
    return False
