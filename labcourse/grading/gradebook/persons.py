"""Look up students, add their records, copy all data of a person, and erase it.

Erasing deletes every row of the person, and replaces their names in what persons wrote about others' work by a marker.
What others wrote and handed in themselves does not change, even if it names the person; nor does the name of the person
who gave a mark. Both are reported.

The names of a person are their ID, name, e-mail address and the other names that platforms use for them, each as a
whole. A first name alone, or a misspelt name, is not recognised. Where names are replaced, only letters from A to Z
match in either case, so that the triggers of :mod:`.database` can check it on every database.
"""

from __future__ import annotations

import hmac
import json
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from datetime import datetime
from functools import cached_property
from typing import Any, TypeVar

from sqlalchemy import ColumnElement, ScalarResult, Table, delete, func, inspect, select, update
from sqlalchemy.orm import Session

from labcourse import clock
from labcourse.errors import GradebookError
from labcourse.grading.gradebook import storable
from labcourse.grading.gradebook.database import Database
from labcourse.grading.gradebook.records import (
    WRITTEN,
    About,
    Base,
    CommentRecord,
    Delivery,
    Erased,
    Erasure,
    Excuse,
    MarkState,
    OfAnswer,
    RunRecord,
    StudentRecord,
)
from labcourse.student_id import caseless

FEWEST_CHARACTERS = 3  #: of a name that is looked for in texts: shorter ones are in texts that name nobody
FEWEST_DIGITS = 5  #: of a number: points, years and frequencies have up to four
_AT_ONCE = 16  # rows in memory while all files and runs are read
#: Tables with rows of students, or in which persons are named → name of a row in messages.
_CALLED = {
    "deliveries": "file that they handed in",
    "runs": "what their run left",
    "marks": "answer",
    "decisions": "mark by a person",
    "audit": "audit trail",
    "scores": "remark",
    "claims": "answer that is being read",
    "comments": "comment for them",
    "publications": "note on what was given back",
    "excuses": "excuse",
    "erasures": "erasure",
    "tokens": "address of a scorer",
}
_Stored = TypeVar("_Stored", bound=OfAnswer | CommentRecord | Delivery | Excuse)
_Named = TypeVar("_Named", bound=OfAnswer | CommentRecord | Excuse)
_OfOthers = TypeVar("_OfOthers", RunRecord, Delivery)
_TABLES = Base.metadata.tables
_OF_STUDENTS = [table for table in Base.metadata.sorted_tables if {"student_id", "run_id"} & set(table.c.keys())]


def is_student(student: str) -> ColumnElement[bool]:
    """Return the condition that a row is a student's: equal IDs, without regard to capitals."""
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
    """Store a record of a student, with values for columns that are not fields of the record.

    Returns
    -------
    same type as record
        The stored record: with clean text, and with the number that the database gave it.
    """
    stored = storable.cleaned(record, f"The {type(record).__name__.removesuffix('Record').lower()}")
    for name, value in {"student_id": student_id, **own}.items():
        setattr(stored, name, value)
    session.add(stored)
    session.flush()
    return stored


def read(session: Session, table: type[_Named], *which: Any) -> list[_Named]:
    """Read the records for which some conditions hold, with their student's ID, in the order of writing."""
    statement = select(table, StudentRecord.student).join(StudentRecord, StudentRecord.id == table.student_id)
    records = []
    for record, student in session.execute(statement.where(*which).order_by(*inspect(table).primary_key)):
        record.student = student
        records.append(record)
    return records


# --- a person who is erased -------------------------------------------------------------------------------------------


class Person:
    """A person who is erased.

    Parameters
    ----------
    about : who
    number : of the student's row

    Attributes
    ----------
    student : the ID
    names : that are looked for in texts, the longest first
    too_short : names that are not looked for
    marker : what replaces each name
    """

    def __init__(self, about: StudentRecord, number: int) -> None:
        names = dict.fromkeys(filter(None, (about.student, about.name, about.email, *about.aliases)))
        self.student = about.student
        self.names = tuple(sorted(filter(_is_long_enough, names), key=len, reverse=True))
        self.too_short = tuple(name for name in names if not _is_long_enough(name))
        self.marker = f"[erased {number}]"

    def redacted(self, text: str, names: Iterable[str] = ()) -> str:
        """Return a text with the marker in place of the person's names, or of some of them."""
        for name in names or self.names:
            text = re.sub(rf"(?<!\w)(?ai:{re.escape(name)})(?!\w)", self.marker, text)
        return text

    def named_in(self, content: str | bytes) -> bool:
        """Return whether a text or a file names the person, in any case, and as text or as JSON (``\\u00e9``)."""
        if not self.names:
            return False
        text = content if isinstance(content, str) else content.decode("utf-8", "replace")
        return self._anywhere.search(text) is not None

    @cached_property
    def _anywhere(self) -> re.Pattern[str]:
        """Return the pattern of all names, as text and as JSON."""
        spelled = dict.fromkeys(form for name in self.names for form in (name, json.dumps(name)[1:-1]))
        return re.compile("|".join(rf"(?<!\w){re.escape(form)}(?!\w)" for form in spelled), re.IGNORECASE)


def _is_long_enough(name: str) -> bool:
    return len(name) >= (FEWEST_DIGITS if name.isdecimal() else FEWEST_CHARACTERS)


@dataclass(frozen=True)
class OfOthers:
    """How other students' records change when a person is erased. Records that do not name the person stay.

    Attributes
    ----------
    run : another student's run → the run without the person
    file : name and content of a file that another student handed in → the content without the person
    shares : whether another student's run is of files that the person handed in, as partners' runs are
    """

    run: Callable[[RunRecord, Person], RunRecord] = lambda run, person: run
    file: Callable[[str, bytes, Person], bytes] = lambda name, content, person: content
    shares: Callable[[RunRecord, Person], bool] = lambda run, person: False


class Persons:
    """Persons in a gradebook. Each method is one transaction, and raises GradebookError if the database fails.

    Parameters
    ----------
    database : the gradebook's, with its tables
    """

    def __init__(self, database: Database) -> None:
        self._database = database

    def erase(self, student: str, actor: str, of_others: OfOthers = OfOthers()) -> Erased:
        """Erase a person: all their rows, and their names in what persons wrote about others' work.

        Then the file, or the tables of a server, are written anew, so that no deleted byte is left in them.

        Parameters
        ----------
        student, actor : the person to erase, and the person who does it
        of_others : how other students' runs and files change; they do not change if it is not given

        Raises
        ------
        GradebookError
            If there is no such student; or if the last step fails: then the person is erased, and the message says so.
        """
        with self._database.writing() as session:
            done = _Erasing(session, student, of_others).erase(actor)
        try:
            self._database.rebuild()
        except GradebookError as error:
            raise GradebookError(
                f"{student!r} is erased from the gradebook's tables, but the free space could not be overwritten. The "
                f"next erasure will do it: {error}"
            ) from error
        return done

    def would_be_erased(self, student: str, of_others: OfOthers = OfOthers()) -> Erased:
        """Return what :meth:`erase` would do, and change nothing. Raises GradebookError if there is no such student."""
        with self._database.writing() as session:
            done = _Erasing(session, student, of_others).erase("")
            session.rollback()
        return done

    def erased(self, students: Sequence[str]) -> dict[str, datetime]:
        """Return student → when they were erased, for those who were erased and have not been added again."""
        with self._database.reading() as session:
            return erased_students(session, students)

    def everything_of(self, student: str) -> tuple[dict[str, list[dict[str, Any]]], list[Delivery]]:
        """Return a student's rows, by table, and each version of each file that they handed in, in order of arrival.

        Raises
        ------
        GradebookError
            If there is no such student.
        """
        with self._database.reading() as session:
            about = known_student(session, student)
            rows = {table.name: _rows(session, table, about.id) for table in _OF_STUDENTS if table.name != "deliveries"}
            statement = select(Delivery).where(Delivery.student_id == about.id).order_by(Delivery.received, Delivery.id)
            return {"students": [{"id": about.id, **asdict(about)}], **rows}, list(session.scalars(statement))


def erased_students(session: Session, students: Iterable[str]) -> dict[str, datetime]:
    """Return student → when they were erased, for those who were erased and have not been added again."""
    secret = session.scalars(select(About.secret)).one()
    erasures = session.scalars(select(Erasure).order_by(Erasure.number))
    when = {erasure.fingerprint: erasure.erased for erasure in erasures}
    prints = {student: _fingerprint(secret, student) for student in students if when}
    erased = {student: when[fingerprint] for student, fingerprint in prints.items() if fingerprint in when}
    return {student: moment for student, moment in erased.items() if find_student(session, student) is None}


def _fingerprint(secret: bytes, student: str) -> bytes:
    """Return what identifies an erased student. Without the gradebook's secret it cannot be made of an ID."""
    return hmac.digest(secret, f"erased: {caseless(student)}".encode(), "sha256")


def remove(session: Session, student: str) -> StudentRecord:
    """Delete a student's row, and return it. Raises GradebookError if there is no such student, or any other row."""
    about = known_student(session, student)
    if more := [_CALLED[name] for name, count in _counts(session, about.id).items() if count]:
        raise GradebookError(
            f"{about.student!r} is not removed: the gradebook has more of them than a line of a roster: "
            f"{', '.join(more)}."
        )
    session.execute(delete(StudentRecord).where(StudentRecord.id == about.id))
    return about


def _of(table: Table, number: int) -> ColumnElement[bool]:
    """Return the condition for a student's rows of a table."""
    if "student_id" in table.c:
        return table.c.student_id == number
    return table.c.run_id.in_(select(RunRecord.id).where(RunRecord.student_id == number))


def _counts(session: Session, number: int) -> dict[str, int]:
    """Count a student's rows, by table."""
    counted = {table.name: select(func.count()).where(_of(table, number)) for table in _OF_STUDENTS}
    return {name: session.scalar(statement) or 0 for name, statement in counted.items()}


def _rows(session: Session, table: Table, number: int) -> list[dict[str, Any]]:
    """Return a student's rows of a table as plain data."""
    rows = session.execute(select(table).where(_of(table, number)).order_by(*table.primary_key)).mappings()
    return [{name: _as_json(value) for name, value in row.items()} for row in rows]


def _as_json(value: Any) -> Any:
    return vars(value) if isinstance(value, MarkState) else value


_ACTED = "{} is named as who marked, wrote, opened, published or erased"


class _Erasing:
    """The erasure of a person, inside a transaction."""

    def __init__(self, session: Session, student: str, of_others: OfOthers) -> None:
        about = known_student(session, student)
        self._session, self._of_others, self._number = session, of_others, about.id
        self._about = replace(about)  # a copy, which outlives the row
        self._person = Person(self._about, self._number)
        rows = session.execute(select(StudentRecord.id, StudentRecord.student))
        self._names: dict[int, str] = {number: name for number, name in rows}

    def erase(self, actor: str) -> Erased:
        """Delete the person's rows, and replace their names in the rows of others."""
        session, number = self._session, self._number
        counts = _counts(session, number)
        own = Delivery.student_id == number, Delivery.source != ""
        sources = tuple(session.scalars(select(Delivery.source).distinct().where(*own)))
        fingerprint = _fingerprint(session.scalars(select(About.secret)).one(), self._about.student)
        session.add(Erasure(number, -number, fingerprint, actor, sum(counts.values()), clock.now()))
        session.flush()
        self._hand_over()
        redacted = dict.fromkeys([*self._redact(), *self._rewrite()])
        session.execute(delete(StudentRecord).where(StudentRecord.id == number))
        still_named = tuple(sorted(set(self._still_named())))
        return Erased(self._about, counts, tuple(redacted), still_named, sources, self._person.too_short)

    def _others(self, table: type[_OfOthers], *conditions: Any) -> ScalarResult[_OfOthers]:
        """Return the rows of other students that fulfil SQL conditions; few of them are in memory at a time."""
        others = select(table).where(table.student_id != self._number, *conditions)
        return self._session.scalars(others.execution_options(yield_per=_AT_ONCE))

    def _hand_over(self) -> None:
        """Store the person's files for partners, too, who have no file of that name."""
        session, number = self._session, self._number
        files = list(session.scalars(select(Delivery).where(Delivery.student_id == number).order_by(Delivery.id)))
        for run in self._others(RunRecord, RunRecord.current):
            if self._of_others.shares(run, self._person):
                own = set(session.scalars(select(Delivery.name).where(Delivery.student_id == run.student_id)))
                for file in files:
                    if file.name not in own:
                        put(session, run.student_id, file)

    def _redact(self) -> Iterator[str]:
        """Replace the person's names in what was written about others; yield where."""
        for table in map(_TABLES.__getitem__, _CALLED):
            written = [column.name for column in table.columns if column.info == WRITTEN]
            columns = [column for column in table.columns if column.name != "content"]
            others = [table.c.student_id != self._number] if "student_id" in table.c else []
            for row in self._session.execute(select(*columns).where(*others)).mappings().all() if written else ():
                key = [column == row[column.name] for column in table.primary_key]
                old = {column: row[column] for column in written}
                for name in self._person.names:  # one at a time, as the triggers of the tables allow
                    new = {column: self._redacted(value, name) for column, value in old.items()}
                    if new != old:
                        self._session.execute(update(table).where(*key).values(new))
                        yield self._place(table, row)
                    old = new

    def _redacted(self, value: Any, name: str) -> Any:
        """Return the value of a column with the marker in place of one of the person's names."""
        if isinstance(value, str):
            return self._person.redacted(value, [name])
        if isinstance(value, MarkState):
            return replace(value, reason=self._redacted(value.reason, name))
        return value and {**value, "reason": self._redacted(value["reason"], name)}

    def _rewrite(self) -> Iterator[str]:
        """Change others' runs and files as :class:`OfOthers` says; yield where."""
        for run in self._others(RunRecord):
            new = self._of_others.run(run, self._person)
            if new != run:
                for name in ("problems", "notes", "cells", "answers"):
                    setattr(run, name, getattr(new, name))
                yield f"{self._names[run.student_id]}: messages on their run"
        for file in self._others(Delivery):
            content = self._of_others.file(file.name, file.content, self._person)
            if content != file.content:
                file.content = content
                yield f"{self._names[file.student_id]}: {file.name}"
        self._session.flush()

    def _still_named(self) -> Iterator[str]:
        """Yield where the person is still named."""
        runs: dict[Any, int] = dict(self._session.execute(select(RunRecord.id, RunRecord.student_id)).all())
        for table in (_TABLES[name] for name in _CALLED if name != "claims"):  # claims run out
            for row in self._session.execute(select(table).execution_options(yield_per=_AT_ONCE)).mappings():
                if self._is_named(row.get("actor")):
                    yield _ACTED.format(row["actor"])
                if any(self._is_named(value) for name, value in row.items() if name != "actor"):
                    yield self._place(table, {"student_id": runs.get(row.get("run_id"), 0), **row})

    def _is_named(self, value: Any) -> bool:
        """Return whether the value of a column names the person."""
        if isinstance(value, MarkState | dict | tuple):
            value = json.dumps(value, default=vars, ensure_ascii=False)
        return isinstance(value, str | bytes) and self._person.named_in(value)

    def _place(self, table: Table, row: Any) -> str:
        """Return where a row is, as text."""
        if not row.get("student_id"):
            return _CALLED[table.name]
        about = (row.get(name) for name in ("question", "part", "name", "actor"))
        return f"{self._names[row['student_id']]}: {', '.join(filter(None, (_CALLED[table.name], *about)))}"
