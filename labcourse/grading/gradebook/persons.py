"""Look up students, add their records, copy all data of a person, and erase it.

Erasing deletes every row of the person, and replaces their names in what persons wrote about others' work by a marker.
What others wrote and handed in themselves does not change, even if it names the person; nor does the name of the person
who gave a mark. Both are reported.

The names of a person are their ID, name, e-mail address and the other names that platforms use for them, each as a
whole, in upper or lower case. A first name alone, or a misspelt name, is not recognised.
"""

from __future__ import annotations

import hmac
import json
import re
from base64 import b64encode
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from datetime import datetime
from typing import Any, TypeVar

from sqlalchemy import ColumnElement, Table, delete, func, inspect, select
from sqlalchemy.orm import Session

from labcourse import clock
from labcourse.errors import GradebookError
from labcourse.grading.gradebook import storable
from labcourse.grading.gradebook.database import Database
from labcourse.grading.gradebook.records import (
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
    Take,
)
from labcourse.problems import Problem, as_json, from_json
from labcourse.student_id import caseless

MARKER = "[erased]"  #: what replaces the names of a person who is erased
FEWEST_CHARACTERS = 3  #: of a name that is looked for in texts: shorter ones are in texts that name nobody
FEWEST_DIGITS = 5  #: of a number: points, years and frequencies have up to four
_AT_ONCE = 16  # rows in memory while all files and runs are read
#: Fields of records in which persons, or the software, write about students.
_WRITTEN = (
    *("source", "reason", "before", "after", "replaced", "remark", "text", "note", "problems", "notes", "versions"),
)
_OF_STUDENTS = [table for table in Base.metadata.sorted_tables if {"student_id", "run_id"} & set(table.c.keys())]
_Stored = TypeVar("_Stored", bound=OfAnswer | CommentRecord | Delivery | Excuse | Take)
_Named = TypeVar("_Named", bound=OfAnswer | CommentRecord | Excuse | Take)


def is_student(student: str) -> ColumnElement[bool]:
    """Return the condition that a row is a student's: equal IDs, without regard to capitals."""
    return StudentRecord.folded == caseless(student)


def find_student(session: Session, student: str) -> StudentRecord | None:
    """Look up a student by ID, without regard to capitals; return None if there is none."""
    return session.scalar(select(StudentRecord).where(is_student(student)))


def known_student(session: Session, student: str) -> StudentRecord:
    """Look up a student by ID, without regard to capitals. Raises GradebookError if there is none."""
    match = find_student(session, student)
    if match is None:
        raise GradebookError(f"There is no student {storable.text(student)!r} in the gradebook.")
    return match


def student_for(session: Session, student: str) -> StudentRecord:
    """Look up a student by ID, or add them. Raises GradebookError if the ID is not valid."""
    student = storable.student(student)
    return find_student(session, student) or add_student(session, StudentRecord(student))


def add_student(session: Session, student: StudentRecord) -> StudentRecord:
    """Add a student who is not in the gradebook yet; return the record, which then has a number."""
    student.folded = caseless(student.student)
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
    """Read the records of a table for which all conditions hold, with their students' IDs, in the order of writing."""
    statement = select(table, StudentRecord.student).join(StudentRecord, StudentRecord.id == table.student_id)
    records = []
    for record, student in session.execute(statement.where(*which).order_by(*inspect(table).primary_key)):
        record.student = student
        records.append(record)
    return records


# --- a person who is erased -------------------------------------------------------------------------------------------


class Person:
    """The names of a person who is erased.

    Parameters
    ----------
    about : the person's record

    Attributes
    ----------
    student : ID of the person
    names : the person's names that are looked for in texts, the longest first
    too_short : the person's names that are not looked for, since they are too short
    """

    def __init__(self, about: StudentRecord) -> None:
        orders = [order for name in (about.name, *about.aliases) for order in _orders(name)]
        names = dict.fromkeys(filter(None, (about.student, about.email, *orders)))
        self.student = about.student
        self.names = tuple(sorted(filter(_is_long_enough, names), key=len, reverse=True))
        self.too_short = tuple(name for name in names if not _is_long_enough(name))
        spelled = [re.escape(form) for name in self.names for form in (name, json.dumps(name)[1:-1])]  # é is \u00e9
        self._named = re.compile(rf"(?<!\w)(?:{'|'.join(spelled)})(?!\w)" if spelled else r"(?!)", re.IGNORECASE)

    def redacted(self, value: Any) -> Any:
        """Return a value with :data:`MARKER` in place of each of the person's names.

        It may be a text, a problem, a list or tuple of these, the state of a mark, or a mapping; of one with a reason,
        only that is changed. Other values are returned as they are.
        """
        if isinstance(value, str):
            return self._named.sub(MARKER, value)
        if isinstance(value, Problem):
            about = {name: self.redacted(entry) for name, entry in value.parameters.items()}
            return replace(value, where=self.redacted(value.where), parameters=about)
        if isinstance(value, list | tuple):
            return type(value)(map(self.redacted, value))
        if isinstance(value, MarkState):
            return replace(value, reason=self.redacted(value.reason))
        if isinstance(value, Mapping):
            reason = {"reason": as_json(self.redacted(from_json(value["reason"])))} if "reason" in value else {}
            return {**value, **reason} if reason else {name: self.redacted(entry) for name, entry in value.items()}
        return value

    def is_named_in(self, value: Any) -> bool:
        """Return whether a text, the bytes of a file, a problem, the state of a mark, a dict or tuple names them."""
        if isinstance(value, bytes):
            value = value.replace(b"\0", b"").decode("utf-8", "replace")  # UTF-16 has a zero byte beside each letter
        elif isinstance(value, MarkState | Problem | dict | tuple):
            value = json.dumps(value, default=vars)
        return isinstance(value, str) and self._named.search(value) is not None


def _orders(name: str) -> tuple[str, ...]:
    """Return a name as it is written, and with the family name at its other end: "Bell, Bob" is "Bob Bell"."""
    family, comma, given = (word.strip() for word in name.partition(","))
    if comma:
        return name, f"{given} {family}"
    given, _space, family = name.strip().rpartition(" ")
    return (name, f"{family}, {given}") if given else (name,)


def _is_long_enough(name: str) -> bool:
    return len(name) >= (FEWEST_DIGITS if name.isdecimal() else FEWEST_CHARACTERS)


#: Function that takes a person out of another student's run or file: it changes the record.
Redaction = Callable[[RunRecord | Delivery, Person], None]


class Persons:
    """Persons in a gradebook. Each method is one transaction, and raises GradebookError if the database fails.

    Parameters
    ----------
    database : the gradebook's, with its tables
    """

    def __init__(self, database: Database) -> None:
        self._database = database

    def erase(
        self,
        student: str,
        actor: str,
        change: Redaction = lambda record, person: None,
        dry_run: bool = False,
    ) -> Erased:
        """Erase a person: all their rows, and their names in what persons wrote about others' work.

        Then the file, or the tables of a server, are written anew, so that no deleted byte is left in them. If that was
        interrupted, erasing the same person again completes it.

        Parameters
        ----------
        student, actor : the person to erase, and the person who does it
        change : function that takes the person out of other students' runs and files
        dry_run : whether only to return what would be done, and to change nothing

        Raises
        ------
        GradebookError
            If there is no such student; or if the last step fails: then the person is erased, and the message says so.
        """
        with self._database.writing() as session:
            done = _erase(session, student, actor, change)
            if dry_run:
                session.rollback()
                return done
        try:
            self._database.rebuild()
        except GradebookError as error:
            raise GradebookError(
                f"{student!r} is erased from the gradebook's tables, but the free space could not be overwritten. "
                f"Erase them again: {error}"
            ) from error
        return done

    def erased(self, students: Sequence[str]) -> dict[str, datetime]:
        """Return student → when they were erased, for those who were erased and have not been added again."""
        with self._database.reading() as session:
            return erased_students(session, students)

    def copy(self, student: str) -> str:
        """Return all rows of a student as the text of JSON: table → rows. Files that are not text are in base64.

        Raises
        ------
        GradebookError
            If there is no such student.
        """
        with self._database.reading() as session:
            about = known_student(session, student)
            rows = {table.name: _rows(session, table, about.id) for table in _OF_STUDENTS}
        everything = {"students": [asdict(about)], **rows}
        return json.dumps(everything, indent=1, ensure_ascii=False, default=_for_json_dumps) + "\n"


def _for_json_dumps(value: Any) -> Any:
    """Convert a value that json.dumps does not know.

    Bytes become text, or base64 if they are not UTF-8; a time becomes ISO text; any other object becomes the dict of
    its attributes.
    """
    if isinstance(value, bytes):
        try:
            return value.decode()
        except UnicodeDecodeError:
            return {"base64": b64encode(value).decode()}
    return value.isoformat() if isinstance(value, datetime) else vars(value)


def erased_students(session: Session, students: Iterable[str]) -> dict[str, datetime]:
    """Return student → when they were erased, for those who were erased and have not been added again."""
    when = {erasure.digest: erasure.erased for erasure in session.scalars(select(Erasure).order_by(Erasure.number))}
    digests = {student: _digest(session, student) for student in students if when}
    erased = {student: when[digest] for student, digest in digests.items() if digest in when}
    return {student: moment for student, moment in erased.items() if find_student(session, student) is None}


def _digest(session: Session, student: str) -> bytes:
    """Return the digest by which an erased student is recognised. It is made of the ID and the gradebook's secret."""
    secret = session.scalars(select(About.secret)).one()
    return hmac.digest(secret, f"erased: {caseless(student)}".encode(), "sha256")


def remove(session: Session, student: str) -> StudentRecord:
    """Delete a student's row, and return it. Raises GradebookError without such a row, or if the student has others."""
    about = known_student(session, student)
    if counts := _counts(session, about.id):
        raise GradebookError(
            f"{about.student!r} is not removed: the gradebook has more of them than a line of a roster: "
            f"{', '.join(counts)}."
        )
    session.execute(delete(StudentRecord).where(StudentRecord.id == about.id))
    return about


def _of(table: Table, number: int) -> ColumnElement[bool]:
    """Return the condition for the rows of a table that belong to a student, by the number of the student's row."""
    if "student_id" in table.c:
        return table.c.student_id == number
    return table.c.run_id.in_(select(RunRecord.id).where(RunRecord.student_id == number))


def _rows(session: Session, table: Table, number: int) -> list[dict[str, Any]]:
    """Return the rows of a table that belong to a student (by number), in the order of writing."""
    own = select(table).where(_of(table, number)).order_by(*table.primary_key)
    return list(map(dict, session.execute(own).mappings()))


def _counts(session: Session, number: int) -> dict[str, int]:
    """Return name of a table → count of rows that belong to a student (by number); tables without any are left out."""
    counted = {table.name: select(func.count()).where(_of(table, number)) for table in _OF_STUDENTS}
    counts = {name: session.scalar(statement) or 0 for name, statement in counted.items()}
    return {name: count for name, count in counts.items() if count}


def _erase(session: Session, student: str, actor: str, change: Redaction) -> Erased:
    """Delete a person's rows, and replace their names in rows of others; do nothing if they were erased before."""
    if erased_students(session, [student]):
        return Erased(StudentRecord(student), {})
    stored = known_student(session, student)
    about, number = replace(stored), stored.id  # a copy, which outlives the row
    person, counts = Person(about), _counts(session, number)
    session.add(Erasure(_digest(session, student), actor, clock.now()))
    session.execute(delete(StudentRecord).where(StudentRecord.id == number))
    redacted, still_named = dict[str, None](), set[str]()
    for record, where in _records(session):
        if isinstance(record, RunRecord | Delivery):
            change(record, person)
        for name in (column.key for column in inspect(type(record)).column_attrs):
            value = getattr(record, name)
            if name in _WRITTEN:
                value = person.redacted(value)
                setattr(record, name, value)
            if person.is_named_in(value):
                still_named.add(f"{value} as who marked or wrote" if name == "actor" else where)
        if session.is_modified(record):
            redacted[where] = None
    return Erased(about, counts, tuple(redacted), tuple(sorted(still_named)), person.too_short)


def _records(session: Session) -> Iterator[tuple[Any, str]]:
    """Yield all records of tables in which persons may be named, each with a text that says where it is."""
    students: dict[Any, str] = dict(session.execute(select(StudentRecord.id, StudentRecord.student)).all())
    runs: dict[Any, int] = dict(session.execute(select(RunRecord.id, RunRecord.student_id)).all())
    for table in sorted({mapper.class_ for mapper in Base.registry.mappers} - {About, StudentRecord}, key=repr):
        for record in session.scalars(select(table).execution_options(yield_per=_AT_ONCE)):
            student = students.get(getattr(record, "student_id", None) or runs.get(getattr(record, "run_id", None)))
            about = (getattr(record, name, None) for name in ("question", "part", "name", "notebook"))
            yield record, ", ".join(filter(None, (student, table.__tablename__, *about)))
