"""What a gradebook holds: each table is a dataclass, and its rows are the records that methods take and return.

Attributes with an annotation are the fields of a record. Only the database uses columns without one, such as the
number of a row. Records can be used after the transaction that read them. Dataclasses that are no tables are frozen.

When a student's row is deleted, the database deletes all their other rows (``ON DELETE CASCADE``). In a table that only
grows, rows are added, and never changed or deleted, except when a person is erased.
"""

from __future__ import annotations

import hashlib
import math
import sys
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from typing import Any, ClassVar, NamedTuple

import sqlalchemy as sa
from sqlalchemy.orm import DeclarativeBase, Mapped, MappedAsDataclass, composite, mapped_column

from labcourse import clock
from labcourse.grading.gradebook import storable
from labcourse.grading.marks import Mark, Status
from labcourse.problems import Reason, Where, as_json, from_json

DECIDED = "as the instructor decided"  #: how a time of arrival, or an owner, may be known
ON_DISK = "the time of the file on the disk of whoever graded it"  #: how a time of arrival may be known
NEW: Any = None  #: number of a record that is not stored yet; the database gives it one

TOKEN_LASTS = timedelta(days=200)  #: a term with its examinations


@dataclass(frozen=True)
class MarkState:
    """What the audit trail stores of a mark when the mark changes. The status is stored under its name of that time."""

    status: str
    points: float
    out_of: float
    reason: Reason


class CleanText(sa.TypeDecorator[str]):
    """A text that is cleaned when it is stored or compared, see :mod:`labcourse.grading.gradebook.storable`."""

    impl = sa.Text
    cache_ok = True

    def process_bind_param(self, value: str | None, dialect: sa.Dialect) -> str | None:
        return None if value is None else storable.text(value)


class NameText(CleanText):
    """A text that many rows have, and that is in memory once: the number of a question, the name of a part."""

    cache_ok = True

    def process_result_value(self, value: str | None, dialect: sa.Dialect) -> str | None:
        return None if value is None else sys.intern(value)


class StatusText(CleanText):
    """The status of a mark."""

    cache_ok = True

    def process_result_value(self, value: str | None, dialect: sa.Dialect) -> Status | None:
        return None if value is None else Status(value)


class Instant(sa.TypeDecorator[datetime]):
    """A time in UTC, even in a database that stores no time zone (SQLite)."""

    impl = sa.DateTime(timezone=True)
    cache_ok = True

    def process_bind_param(self, value: datetime | None, dialect: sa.Dialect) -> datetime | None:
        return value and value.astimezone(UTC)

    def process_result_value(self, value: datetime | None, dialect: sa.Dialect) -> datetime | None:
        return value and (value.astimezone(UTC) if value.tzinfo else value.replace(tzinfo=UTC))


class Json(sa.TypeDecorator[Any]):
    """A tuple, stored as a list of JSON, or the state of a mark, stored as an object of JSON; None is NULL."""

    impl = sa.JSON(none_as_null=True)
    cache_ok = True

    def process_bind_param(self, value: Any, dialect: sa.Dialect) -> Any:
        return as_json(vars(value)) if isinstance(value, MarkState) else value

    def process_result_value(self, value: Any, dialect: sa.Dialect) -> Any:
        if isinstance(value, list):
            return tuple(value)
        return value and MarkState(**{**value, "reason": from_json(value["reason"])})


class ReasonJson(sa.TypeDecorator[Any]):
    """A reason, or a tuple of reasons, stored as JSON: a text, or the data of a problem."""

    impl = sa.JSON
    cache_ok = True

    def process_bind_param(self, value: Any, dialect: sa.Dialect) -> Any:
        return as_json(value)

    def process_result_value(self, value: Any, dialect: sa.Dialect) -> Any:
        read = from_json(value)
        return tuple(read) if isinstance(read, list) else read


class Base(MappedAsDataclass, DeclarativeBase):
    """Base of all tables."""

    type_annotation_map: ClassVar = {
        str: CleanText,
        Status: StatusText,
        float: sa.Double,
        datetime: Instant,
        Mapping[str, Any]: sa.JSON,
        **dict.fromkeys((tuple[str, ...], tuple[Mapping[str, Any], ...], MarkState), Json),
    }


def _of_student(**options: Any) -> Any:
    """Return the column for the number of a student's row."""
    return mapped_column(sa.ForeignKey("students.id", ondelete="CASCADE"), nullable=False, **options)


def _mark_columns() -> list[Any]:
    """Return the columns of a :class:`Mark`."""
    keys = [mapped_column(name, NameText, primary_key=True) for name in ("question", "part")]
    numbers = map(mapped_column, ("status", "points", "out_of"))
    return [*keys, *numbers, mapped_column("reason", ReasonJson), mapped_column("given")]


class OfAnswer(MappedAsDataclass):
    """The common fields of the tables of events that concern an answer.

    Attributes
    ----------
    number : of the row, in the order of writing
    student, question, part : the student, and the answer
    """

    number: Mapped[int] = mapped_column("id", primary_key=True)
    student_id = _of_student(index=True)
    student: str
    question: Mapped[str]
    part: Mapped[str]

    @property
    def where(self) -> Where:
        """Question and part."""
        return self.question, self.part


class About(Base):
    """The version of the tables, and the gradebook's secret; a single row."""

    __tablename__ = "gradebook"

    version: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    secret: Mapped[bytes]


class StudentRecord(Base):
    """A student; all fields but the ID may be empty.

    ``aliases`` are other names that platforms use for them; ``enrolled`` is whether they are on a roster, and not only
    known from what they handed in; students of one ``group`` may hand in together.
    """

    __tablename__ = "students"

    id = mapped_column(sa.Integer, primary_key=True)
    folded = mapped_column(CleanText, unique=True, nullable=False)  # the ID without regard to capitals
    student: Mapped[str]
    name: Mapped[str] = mapped_column(default="")
    email: Mapped[str] = mapped_column(default="")
    section: Mapped[str] = mapped_column(default="")
    aliases: Mapped[tuple[str, ...]] = mapped_column(default=())
    enrolled: Mapped[bool] = mapped_column(default=False)
    group: Mapped[str] = mapped_column("laboratory_group", CleanText, default="")  # GROUP is a word of SQL


def _now() -> datetime:
    return clock.now()  # in a class with a column of that name, the module cannot be reached


class Delivery(Base):
    """A file that a student handed in; each version of it is a row.

    Attributes
    ----------
    name : a notebook's file name, an own file's path relative to the folder, "answers.json" or "course.json"
    digest : equal for equal content
    content : bytes as they were handed in; of a notebook, its cells without outputs
    received : time of receipt, UTC; when it was saved, if only that is known
    source : path of the folder, archive or file that it came in, in the class's folder
    clock : how the time is known; "" if only the student's computer wrote it, None if that was not recorded
    folder_of : ID of the student whom its course.json names, with the bench; "" without one
    assignment : title of the assignment for which it was graded; "" if nobody said so
    attempt, copy : numbers in the name; the higher, the later
    stored : when the gradebook got it, UTC
    """

    __tablename__ = "deliveries"
    __table_args__ = (sa.UniqueConstraint("student_id", "name", "digest", "received"),)

    id = mapped_column(sa.Integer, primary_key=True)
    student_id = _of_student()
    name: Mapped[str]
    digest: Mapped[str]
    content: Mapped[bytes]
    received: Mapped[datetime]
    source: Mapped[str] = mapped_column(default="")
    clock: Mapped[str | None] = mapped_column(default=None)
    folder_of: Mapped[str] = mapped_column(default="")
    assignment: Mapped[str] = mapped_column(default="")
    attempt: Mapped[int] = mapped_column(default=0)
    copy: Mapped[int] = mapped_column(default=0)
    stored: Mapped[datetime] = mapped_column(default_factory=_now)


class Stored(NamedTuple):
    """What a gradebook stores of a file besides its content; see :class:`Delivery`."""

    name: str
    digest: str
    received: datetime
    source: str
    clock: str | None
    folder_of: str
    assignment: str
    attempt: int
    copy: int
    stored: datetime


class Arrival(NamedTuple):
    """When a file was received, and how that is known; see :class:`Delivery`."""

    received: datetime
    clock: str | None = None


class RunRecord(Base, kw_only=True):
    """One run of a submission.

    Attributes
    ----------
    key : hash of all that its marks depend on, besides the key of the course; the student, too
    student : ID
    submission : digest of the whole submission, problems and notes included
    master : digest of the bundle that it was run with
    software : name and version of the software that ran it
    probe_seed : seed from which the inputs of functions were drawn
    isolation : whether it was run in isolation, as text
    answers : content of the ``answers.json`` that it wrote; None if it wrote none
    problems : what went wrong
    notes : other messages
    cells : empty, or the facts that :mod:`labcourse.grading.graded_run` stores of the submission
    claim : question → part → id of the cell that recorded the answer when the student ran it
    words : question → part → ``{"text": ..., "pictures": {name: PNG in base64}}``: answers from text cells
    supplied : values that an instructor gave in place of missing ones: as "1.2.speed" → value
    release : name of the release that it was run with; "" if it has none
    files : names of the student's own files in the submission
    prepared_from : digest of all that it was prepared from; "" if it is to be prepared again
    ran : digest of what was run, whoever handed it in; "" if it was not run by itself
    versions : the versions of the student's notebooks, as :mod:`labcourse.grading.counting` writes them

    ``cells``, ``claim``, ``words``, ``supplied`` and ``versions`` are plain data of JSON: lists, no tuples, and finite
    numbers.
    """

    __tablename__ = "runs"

    id = mapped_column(sa.Integer, primary_key=True)
    student_id = _of_student(index=True)
    current = mapped_column(sa.Boolean, nullable=False)  # whether it is the student's run that counts
    key_digest = mapped_column(CleanText, nullable=False)  # of the key that its marks were made with
    recorded = mapped_column(Instant, nullable=False)
    key: Mapped[str] = mapped_column(unique=True)
    student: Mapped[str]
    submission: Mapped[str]
    master: Mapped[str]
    software: Mapped[str]
    probe_seed: Mapped[int] = mapped_column(sa.BigInteger)
    isolation: Mapped[str]
    answers: Mapped[bytes | None] = mapped_column(default=None)
    problems: Mapped[tuple[Reason, ...]] = mapped_column(ReasonJson, default=())
    notes: Mapped[tuple[Reason, ...]] = mapped_column(ReasonJson, default=())
    cells: Mapped[tuple[Mapping[str, Any], ...]] = mapped_column(default=())
    claim: Mapped[Mapping[str, Any]] = mapped_column(default_factory=dict)
    words: Mapped[Mapping[str, Any]] = mapped_column(default_factory=dict)
    supplied: Mapped[Mapping[str, Any]] = mapped_column(default_factory=dict)
    release: Mapped[str] = mapped_column(default="")
    files: Mapped[tuple[str, ...]] = mapped_column(default=())
    prepared_from: Mapped[str] = mapped_column(default="")
    ran: Mapped[str] = mapped_column(default="", index=True)
    versions: Mapped[tuple[Mapping[str, Any], ...]] = mapped_column(default=())


_COUNTS = sa.text("current")
sa.Index("uq_runs_one_current", RunRecord.student_id, unique=True, sqlite_where=_COUNTS, postgresql_where=_COUNTS)


def answer_digest(given: str) -> str:
    """Return a digest of an answer; answers that differ in white space or composed accents only have the same."""
    return hashlib.sha256(" ".join(unicodedata.normalize("NFC", given).split()).encode()).hexdigest()


class MarkRow(Base):
    """A mark of a run, as the software made it. A person's mark for the same answer counts in its place."""

    __tablename__ = "marks"

    run_id: Mapped[int] = mapped_column(sa.ForeignKey("runs.id", ondelete="CASCADE"), primary_key=True)
    mark: Mapped[Mark] = composite(*_mark_columns())
    position: Mapped[int]
    answer: Mapped[str] = mapped_column(default="")  # digest of the answer, by which a person's mark is found


class GivenMark(Base):
    """A mark that a person gave, who gave it, and when (UTC). It holds for this answer and these possible points.

    The marks of a student's earlier answers stay: they hold again in each version with such an answer.
    """

    __tablename__ = "decisions"

    student_id = _of_student(primary_key=True)
    answer: Mapped[str] = mapped_column(primary_key=True, init=False)
    mark: Mapped[Mark] = composite(*_mark_columns())
    actor: Mapped[str]
    when: Mapped[datetime] = mapped_column("decided")

    def __post_init__(self) -> None:
        self.answer = answer_digest(self.mark.given)

    def as_json(self) -> dict[str, Any]:
        """Return the mark as plain data, for :meth:`from_json`."""
        return {**as_json(vars(self.mark)), "actor": self.actor, "when": self.when.isoformat()}

    @staticmethod
    def from_json(actor: str, when: str, **mark: Any) -> GivenMark:
        """Return a person's mark that was stored as plain data."""
        made = {**mark, "status": Status(mark["status"]), "reason": from_json(mark["reason"])}
        return GivenMark(Mark(**made), actor, datetime.fromisoformat(when))


@dataclass(frozen=True)
class Graded:
    """A run with its marks.

    Attributes
    ----------
    run : the run
    marks : in the order of the key; a person's mark in place of the software's, if it holds
    key_digest : of the key that the software's marks were made with
    lapsed : persons' marks that do not hold for this run, because the answer or the possible points are different; the
        gradebook fills them in, and ignores them when a run is stored
    """

    run: RunRecord
    marks: tuple[Mark, ...]
    key_digest: str
    lapsed: tuple[GivenMark, ...] = ()

    def without_answers(self) -> Graded:
        """Return a copy without answers, words, and what cells said: a class's are not to be in memory at once."""
        facts = tuple({**one, "cell_reports": {}, "missing": [], "asked": None} for one in self.run.cells)
        marks = tuple(replace(mark, given="") for mark in self.marks)
        return replace(self, run=replace(self.run, answers=None, words={}, claim={}, cells=facts), marks=marks)


class CommentRecord(Base):
    """A person's comment for a student, or a student's request to look at an answer again.

    Attributes
    ----------
    student : ID
    question, part : what it is about; ``part`` is None if it is about the whole question, both if about everything
    text : for the student; of a request, what the student asks
    actor, when : who wrote it down, and when (UTC)
    asks : whether it is a request
    is_open : whether it is a request, and no person has marked the answer or commented on it since; it is not stored,
        :meth:`Gradebook.comments` sets it
    """

    __tablename__ = "comments"

    id = mapped_column(sa.Integer, primary_key=True)
    student_id = _of_student(index=True)
    student: str
    question: Mapped[str | None]
    text: Mapped[str]
    actor: Mapped[str]
    when: Mapped[datetime] = mapped_column("written")
    part: Mapped[str | None] = mapped_column(default=None)
    asks: Mapped[bool] = mapped_column(default=False)
    is_open: bool = False

    @property
    def where(self) -> Where:
        """Question and part; "" in place of None."""
        return self.question or "", self.part or ""


class AuditRecord(OfAnswer, Base):
    """One change of one mark. This table only grows.

    Attributes
    ----------
    before, after : the mark before and after the change; None if there was, or is, none
    run : key of the run that counts after the change
    actor, reason, when : who changed it, why, and when (UTC)
    """

    __tablename__ = "audit"

    before: Mapped[MarkState | None] = mapped_column("mark_before")
    after: Mapped[MarkState | None] = mapped_column("mark_after")
    run: Mapped[str]
    actor: Mapped[str]
    reason: Mapped[str]
    when: Mapped[datetime] = mapped_column("changed")


class Act(OfAnswer, Base):
    """One thing that a scorer did to one answer: give points, ask the instructor, or take an act back.

    This table only grows.

    Attributes
    ----------
    actor : the scorer
    level : level that was given; None if points were given without a level, or no points were given
    points, out_of : points given, and possible; ``points`` is None if no points were given
    remark : for the student; if the instructor is asked, for the instructor
    given : the student's answer as the scorer read it
    referred : whether the instructor is asked; then the answer waits
    undoes : number of the act that this act takes back
    when : time of the act, UTC
    """

    __tablename__ = "scores"
    __table_args__ = (sa.Index("ix_scores_question_part", "question", "part"),)

    # The decision that this act replaced, for undo; NULL if there was none.
    replaced = mapped_column(sa.JSON(none_as_null=True))
    actor: Mapped[str]
    level: Mapped[int | None]
    points: Mapped[float | None]
    out_of: Mapped[float]
    remark: Mapped[str]
    given: Mapped[str]
    referred: Mapped[bool] = mapped_column("asked")
    undoes: Mapped[int | None] = mapped_column(sa.ForeignKey("scores.id"))
    when: Mapped[datetime] = mapped_column("acted")

    def still_stands(self, given: GivenMark | None) -> bool:
        """Return whether a person's mark on the answer (None if there is none) is the one that this act left."""
        if given is None or self.points is None:
            return given is None and self.points is None
        mark, own = given.mark, (self.actor, self.out_of, self.given)
        is_same = given.when == self.when or mark.reason == self.remark
        return is_same and own == (given.actor, mark.out_of, mark.given) and math.isclose(self.points, mark.points)


class Claim(Base):
    """Which scorer is reading an answer, and until when (UTC) no other scorer gets it."""

    __tablename__ = "claims"

    student_id: Mapped[int] = mapped_column(sa.ForeignKey("students.id", ondelete="CASCADE"), primary_key=True)
    question: Mapped[str] = mapped_column(primary_key=True)
    part: Mapped[str] = mapped_column(primary_key=True)
    actor: Mapped[str]
    until: Mapped[datetime]


@dataclass(frozen=True)
class Answer:
    """An answer as it is now.

    Attributes
    ----------
    student, question, part : the student, and the answer
    mark : the mark that counts
    acts : acts of scorers on the present answer, in order; without those that were taken back
    given : the mark that a person gave, by an act or by ``labcourse mark``; None if nobody gave one
    made : the mark that the software made; None if it is not known
    """

    student: str
    question: str
    part: str
    mark: Mark
    acts: tuple[Act, ...] = ()
    given: GivenMark | None = None
    made: Mark | None = None

    @property
    def where(self) -> Where:
        """Question and part."""
        return self.mark.where

    def last(self) -> Act | None:
        """Return the last act; None without one."""
        return self.acts[-1] if self.acts else None

    @property
    def decision(self) -> Act | None:
        """The act that gave the mark that counts; None if the answer waits, or the mark was given otherwise."""
        last = self.last()
        return last if last is not None and last.points is not None and last.still_stands(self.given) else None

    @property
    def remark(self) -> Reason:
        """What a person wrote to the student beside the mark that counts; "" if a key gave it alone."""
        return self.decision.remark if self.decision else self.mark.reason

    @property
    def referred(self) -> bool:
        """Whether the answer waits for the instructor, who was asked, and nobody decided since."""
        last = self.last()
        return last is not None and last.referred and self.mark.status != Status.BY_A_PERSON

    @property
    def waiting(self) -> bool:
        """Whether nobody has decided yet."""
        return self.referred or self.mark.status == Status.FOR_A_PERSON


class Publication(Base):
    """A publication of feedback to the class.

    Attributes
    ----------
    actor, note, when : who gave feedback back, a note, and when (UTC)
    notebooks : names, without ending, of the notebooks of which feedback was given back; empty for all
    """

    __tablename__ = "publications"

    number: Mapped[int] = mapped_column("id", primary_key=True)
    actor: Mapped[str]
    note: Mapped[str]
    when: Mapped[datetime] = mapped_column("published")
    notebooks: Mapped[tuple[str, ...]] = mapped_column(default=())


class Excuse(Base):
    """An act that excuses a student from a notebook, or takes that back. This table only grows.

    Attributes
    ----------
    number : of the row, in the order of writing
    student, notebook : the student, and the notebook without ending
    excused : whether they are excused from now on
    actor, reason, when : who decided it, why, and when (UTC)
    """

    __tablename__ = "excuses"

    number: Mapped[int] = mapped_column("id", primary_key=True)
    student_id = _of_student(index=True)
    student: str
    notebook: Mapped[str]
    excused: Mapped[bool]
    actor: Mapped[str]
    reason: Mapped[str]
    when: Mapped[datetime] = mapped_column("decided")


class Take(Base):
    """An act by which an instructor takes a version of a notebook, or lets the rule decide again. It only grows.

    Attributes
    ----------
    number : of the row, in the order of writing
    student, notebook : the student, and the notebook without ending
    source, received : of the hand-in that is taken; "" and None if the rule decides again
    actor, reason, when : who decided it, why, and when (UTC)
    """

    __tablename__ = "takes"

    number: Mapped[int] = mapped_column("id", primary_key=True)
    student_id = _of_student(index=True)
    student: str
    notebook: Mapped[str]
    source: Mapped[str]
    received: Mapped[datetime | None]
    actor: Mapped[str]
    reason: Mapped[str]
    when: Mapped[datetime] = mapped_column("decided")


class Erasure(Base):
    """A record that a person was erased, without their name. This table only grows.

    Attributes
    ----------
    digest : of the person's ID, keyed with the gradebook's secret: it recognises the ID in a later submission
    actor, erased : who erased the person, and when (UTC)
    """

    __tablename__ = "erasures"

    number = mapped_column("id", sa.Integer, primary_key=True)
    digest: Mapped[bytes]
    actor: Mapped[str]
    erased: Mapped[datetime]


class Token(Base):
    """A token by which a scorer opens the scoring page from another computer. Only its digest is stored.

    Attributes
    ----------
    actor : the scorer
    digest : SHA-256 of the token, in hexadecimal digits
    made, revoked : when it was made, and when revoked (UTC); ``revoked`` is None if it was not
    """

    __tablename__ = "tokens"

    number = mapped_column("id", sa.Integer, primary_key=True)
    actor: Mapped[str]
    digest: Mapped[str] = mapped_column(unique=True)
    made: Mapped[datetime]
    revoked: Mapped[datetime | None] = mapped_column(default=None)

    @property
    def is_valid(self) -> bool:
        """Whether the token opens the page now: it is neither revoked nor too old."""
        return self.revoked is None and clock.now() < self.made + TOKEN_LASTS


@dataclass(frozen=True)
class RosterReport:
    """The result of importing a roster.

    Attributes
    ----------
    added, changed, unchanged : numbers of students
    problems : a message on each line that was not taken
    notes : a message on each student for whom a value was added, replaced or removed, and on what was not read
    """

    added: int
    changed: int
    unchanged: int
    problems: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Erased:
    """What erasing a person changes, or would change.

    Attributes
    ----------
    about : the person's record
    counts : name of a table → number of the person's rows in it; empty if they were erased before
    redacted : where their names are replaced, as text
    still_named : where they are still named, as text: in others' own work, and as who decided
    too_short : names that are not looked for in texts
    """

    about: StudentRecord
    counts: Mapping[str, int]
    redacted: tuple[str, ...] = ()
    still_named: tuple[str, ...] = ()
    too_short: tuple[str, ...] = ()
