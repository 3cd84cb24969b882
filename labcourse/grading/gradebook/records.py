"""What a gradebook holds: each table is a dataclass, and its rows are the records that methods take and return.

An attribute with an annotation is a field of the record. A column without one belongs to the database alone: the number
of a row, and what it refers to. Records outlive the transaction that read them. Those that mirror no table are frozen.

Everything of a student goes with their row (``ON DELETE CASCADE``). What the database itself refuses to change or to
delete is in :mod:`labcourse.grading.gradebook.guards`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, ClassVar, NamedTuple

import sqlalchemy as sa
from sqlalchemy.orm import DeclarativeBase, Mapped, MappedAsDataclass, composite, mapped_column

from labcourse.grading.gradebook import storable

#: The statuses of marks that a person set, and is to set.
GIVEN_BY_A_PERSON, FOR_A_PERSON = "given by a person", "for a person"
DECIDED = "as the instructor decided"  #: how a time of arrival, or an owner, may be known
NEW: Any = None  #: the number of a record that is not stored yet: the database gives it one
#: Mark a column in which persons write about others' work. An erasure strikes names out of its text; out of its JSON,
#: from ``reason``.
WRITTEN = {"names": True}

Where = tuple[str, str]  #: question and part


@dataclass(frozen=True)
class MarkRecord:
    """The mark for one part of a question.

    Attributes
    ----------
    question, part : which
    status : in a few words, as "right" or "given by a person"
    points, out_of : earned, and possible
    reason : for the student
    given : the answer in a few words; the student's own
    """

    question: str
    part: str
    status: str
    points: float
    out_of: float
    reason: str
    given: str = ""

    @property
    def where(self) -> Where:
        """Question and part."""
        return self.question, self.part


@dataclass(frozen=True)
class MarkState:
    """What of a mark is worth a line in the audit trail when it changes."""

    status: str
    points: float
    out_of: float
    reason: str


class Text(sa.TypeDecorator[str]):
    """A text, cleaned when it is stored or compared: see :mod:`labcourse.grading.gradebook.storable`."""

    impl = sa.Text
    cache_ok = True

    def process_bind_param(self, value: str | None, dialect: sa.Dialect) -> str | None:
        return None if value is None else storable.text(value)


class Instant(sa.TypeDecorator[datetime]):
    """A moment in UTC, also in a database that stores no time zone (SQLite)."""

    impl = sa.DateTime(timezone=True)
    cache_ok = True

    def process_bind_param(self, value: datetime | None, dialect: sa.Dialect) -> datetime | None:
        return value and value.astimezone(UTC)

    def process_result_value(self, value: datetime | None, dialect: sa.Dialect) -> datetime | None:
        return value and (value.astimezone(UTC) if value.tzinfo else value.replace(tzinfo=UTC))


class Json(sa.TypeDecorator[Any]):
    """A tuple, stored as a list in sa.JSON, or the state of a mark, stored as an object; None is NULL."""

    impl = sa.JSON(none_as_null=True)
    cache_ok = True

    def process_bind_param(self, value: Any, dialect: sa.Dialect) -> Any:
        return vars(value) if isinstance(value, MarkState) else value

    def process_result_value(self, value: Any, dialect: sa.Dialect) -> Any:
        return tuple(value) if isinstance(value, list) else value and MarkState(**value)


class Base(MappedAsDataclass, DeclarativeBase):
    """Base of all tables."""

    type_annotation_map: ClassVar = {
        str: Text,
        float: sa.Double,
        datetime: Instant,
        Mapping[str, Any]: sa.JSON,
        **dict.fromkeys((tuple[str, ...], tuple[Mapping[str, Any], ...], MarkState), Json),
    }


def _of_student(**options: Any) -> Any:
    return mapped_column(sa.ForeignKey("students.id", ondelete="CASCADE"), nullable=False, **options)


def _mark_columns(**reason: Any) -> list[Any]:
    """Return the columns of a :class:`MarkRecord`; the reason's with options."""
    keys = [mapped_column(name, primary_key=True) for name in ("question", "part")]
    numbers = [mapped_column(name) for name in ("status", "points", "out_of")]
    return [*keys, *numbers, mapped_column("reason", **reason), mapped_column("given")]


class OfAnswer(MappedAsDataclass):
    """What the tables of what happened to an answer have in common.

    Attributes
    ----------
    number : of the row; rows are numbered in the order in which they were written
    student, question, part : the answer's student, and its place
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
    """What a gradebook knows of itself: the version of its tables, and its secret."""

    __tablename__ = "gradebook"

    version: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    secret: Mapped[bytes]


class StudentRecord(Base):
    """A student; all but the ID may be empty.

    ``aliases`` are other names by which platforms know them; ``enrolled`` says whether they are on the roster, and not
    only known from what they handed in.
    """

    __tablename__ = "students"

    id = mapped_column(sa.Integer, primary_key=True)
    folded = mapped_column(Text, unique=True, nullable=False)  # the ID without regard to capitals
    student: Mapped[str]
    name: Mapped[str] = mapped_column(default="")
    email: Mapped[str] = mapped_column(default="")
    section: Mapped[str] = mapped_column(default="")
    aliases: Mapped[tuple[str, ...]] = mapped_column(default=())
    enrolled: Mapped[bool] = mapped_column(default=False)


class Delivery(Base):
    """A file that a student handed in; each version of it is a row.

    Attributes
    ----------
    name : a notebook's file name, an own file's path relative to the folder, "answers.json" or "course.json"
    digest : by which equal content is known
    content : as it was handed in, or what is stored of it
    received : when
    source : what it came in, for people, as the name of a zip
    clock : how the time is known; "" where only the student's computer wrote it, None where nothing was recorded of it
    """

    __tablename__ = "deliveries"
    __table_args__ = (sa.UniqueConstraint("student_id", "name", "digest", "received"),)

    id = mapped_column(sa.Integer, primary_key=True)
    student_id = _of_student()
    name: Mapped[str]
    digest: Mapped[str]
    content: Mapped[bytes]
    received: Mapped[datetime]
    source: Mapped[str] = mapped_column(default="", info=WRITTEN)
    clock: Mapped[str | None] = mapped_column(default=None)


class Arrival(NamedTuple):
    """When a file came, and how that is known: as :class:`Delivery` has them."""

    received: datetime
    clock: str | None = None


class RunRecord(Base):
    """One run of a submission.

    Attributes
    ----------
    key : hash of all that the run depends on, the student included: two runs with one key are the same run
    student : ID, as the submission spells it
    submission : digest of what was handed in
    master : digest of the notebooks that it was run in
    software : name and version
    probe_seed : from which the inputs of functions were drawn
    isolation : how it was run
    answers : what it left; None if nothing
    problems : what went wrong
    notes : what else is worth knowing
    cells : what the cells reported while they ran, in order
    claim : question → part → id of the cell that recorded it when the student ran it
    words : question → part → ``{"text": ..., "pictures": {name: PNG in base64}}``: answers read from text cells
    supplied : values that an instructor gave in place of missing ones: as "1.2.speed" → value
    release : identity of the release that it was run under; empty where it has none
    files : names of the student's own files that came along

    The last six are plain data as JSON has it: lists, and no tuples; finite numbers.
    """

    __tablename__ = "runs"

    id = mapped_column(sa.Integer, primary_key=True)
    student_id = _of_student(index=True)
    current = mapped_column(sa.Boolean, nullable=False)  # whether it is the student's run that counts
    key_digest = mapped_column(Text, nullable=False)  # of the key that its marks were made with
    recorded = mapped_column(Instant, nullable=False)
    key: Mapped[str] = mapped_column(unique=True)
    student: Mapped[str]
    submission: Mapped[str]
    master: Mapped[str]
    software: Mapped[str]
    probe_seed: Mapped[int] = mapped_column(sa.BigInteger)
    isolation: Mapped[str]
    answers: Mapped[bytes | None] = mapped_column(default=None)
    problems: Mapped[tuple[str, ...]] = mapped_column(default=())
    notes: Mapped[tuple[str, ...]] = mapped_column(default=())
    cells: Mapped[tuple[Mapping[str, Any], ...]] = mapped_column(default=())
    claim: Mapped[Mapping[str, Any]] = mapped_column(default_factory=dict)
    words: Mapped[Mapping[str, Any]] = mapped_column(default_factory=dict)
    supplied: Mapped[Mapping[str, Any]] = mapped_column(default_factory=dict)
    release: Mapped[str] = mapped_column(default="")
    files: Mapped[tuple[str, ...]] = mapped_column(default=())


_COUNTS = sa.text("current")
sa.Index("uq_runs_one_current", RunRecord.student_id, unique=True, sqlite_where=_COUNTS, postgresql_where=_COUNTS)


class Mark(Base):
    """A mark of a run, as the software made it. A person's mark for the same answer counts more."""

    __tablename__ = "marks"

    run_id: Mapped[int] = mapped_column(sa.ForeignKey("runs.id", ondelete="CASCADE"), primary_key=True)
    record: Mapped[MarkRecord] = composite(*_mark_columns())
    position: Mapped[int]


class GivenMark(Base):
    """A mark that a person gave, who, and when (UTC). It holds while answer and possible points stay the same."""

    __tablename__ = "decisions"

    student_id = _of_student(primary_key=True)
    mark: Mapped[MarkRecord] = composite(*_mark_columns(info=WRITTEN))
    actor: Mapped[str]
    when: Mapped[datetime] = mapped_column("decided")

    def as_json(self) -> dict[str, Any]:
        """Return it as plain data, from which :meth:`from_json` makes it again."""
        return {**vars(self.mark), "actor": self.actor, "when": self.when.isoformat()}

    @staticmethod
    def from_json(actor: str, when: str, **mark: Any) -> GivenMark:
        """Make a person's mark from plain data."""
        return GivenMark(MarkRecord(**mark), actor, datetime.fromisoformat(when))


@dataclass(frozen=True)
class Graded:
    """A run with its marks.

    Attributes
    ----------
    run : the run
    marks : in the order of the key; a person's mark in place of the software's, where it holds
    key_digest : of the key that they were made with
    lapsed : marks by persons that do not hold for this run: another answer was given, or it is out of other points. The
        gradebook returns them, and ignores those that it is given
    """

    run: RunRecord
    marks: tuple[MarkRecord, ...]
    key_digest: str
    lapsed: tuple[GivenMark, ...] = ()


class CommentRecord(Base):
    """A person's comment for a student, on a question or, where that is None, on everything."""

    __tablename__ = "comments"

    id = mapped_column(sa.Integer, primary_key=True)
    student_id = _of_student(index=True)
    student: str
    question: Mapped[str | None]
    text: Mapped[str] = mapped_column(info=WRITTEN)
    actor: Mapped[str]
    when: Mapped[datetime] = mapped_column("written")


class AuditRecord(OfAnswer, Base):
    """One change of one mark. This table only grows.

    Attributes
    ----------
    before, after : the mark; None where there was, or is, none
    run : key of the run that counts after the change
    actor, reason, when : who changed it, why, and when (UTC)
    """

    __tablename__ = "audit"

    before: Mapped[MarkState | None] = mapped_column("mark_before", info=WRITTEN)
    after: Mapped[MarkState | None] = mapped_column("mark_after", info=WRITTEN)
    run: Mapped[str]
    actor: Mapped[str]
    reason: Mapped[str] = mapped_column(info=WRITTEN)
    when: Mapped[datetime] = mapped_column("changed")


class Act(OfAnswer, Base):
    """One thing that a scorer did to one answer; it is undone by its number. This table only grows.

    Attributes
    ----------
    actor : the scorer
    level : that was given; None if points were given without one, or the instructor is asked
    points, out_of : given, and possible; points are None where the instructor is asked
    remark : for the student; where the instructor is asked, for the instructor
    given : the answer as it was read
    asked : whether the instructor is asked; then the answer waits
    undoes : number of the act that this one takes back
    when : UTC
    """

    __tablename__ = "scores"
    __table_args__ = (sa.Index("ix_scores_question_part", "question", "part"),)

    # The decision that was there before, for undo; NULL: none.
    replaced = mapped_column(sa.JSON(none_as_null=True), info=WRITTEN)
    actor: Mapped[str]
    level: Mapped[int | None]
    points: Mapped[float | None]
    out_of: Mapped[float]
    remark: Mapped[str] = mapped_column(info=WRITTEN)
    given: Mapped[str]
    asked: Mapped[bool]
    undoes: Mapped[int | None] = mapped_column(sa.ForeignKey("scores.id"))
    when: Mapped[datetime] = mapped_column("acted")

    def left(self, given: GivenMark | None) -> bool:
        """Return whether this act left a person's mark as it is now; None where the act left none."""
        if given is None or self.points is None:
            return given is None and self.points is None
        mark, own = given.mark, (self.actor, self.out_of, self.remark, self.given)
        return own == (given.actor, mark.out_of, mark.reason, mark.given) and math.isclose(self.points, mark.points)


class Claim(Base):
    """Who is reading which answer, and until when nobody else is given it."""

    __tablename__ = "claims"

    student_id: Mapped[int] = mapped_column(sa.ForeignKey("students.id", ondelete="CASCADE"), primary_key=True)
    question: Mapped[str] = mapped_column(primary_key=True)
    part: Mapped[str] = mapped_column(primary_key=True)
    actor: Mapped[str]
    until: Mapped[datetime]


@dataclass(frozen=True)
class Answer:
    """An answer that a person reads or has marked, as it is now.

    Attributes
    ----------
    student, question, part : the student, and the answer
    mark : as it counts
    acts : on this very answer, in order; without those that were taken back
    given : the mark as a person gave it, by an act or by ``labcourse mark``; None if nobody gave one
    """

    student: str
    question: str
    part: str
    mark: MarkRecord
    acts: tuple[Act, ...] = ()
    given: GivenMark | None = None

    @property
    def where(self) -> Where:
        """Question and part."""
        return self.mark.where

    def last(self) -> Act | None:
        """Return the last act. :attr:`decision` says whether the mark comes from it."""
        return self.acts[-1] if self.acts else None

    @property
    def decision(self) -> Act | None:
        """The act that the mark comes from; None while it waits, and if ``labcourse mark`` replaced it."""
        last = self.last()
        return last if last is not None and last.points is not None and last.left(self.given) else None

    @property
    def asked(self) -> bool:
        """Whether it waits for the instructor: asked, and decided by nobody since."""
        last = self.last()
        return last is not None and last.asked and self.mark.status != GIVEN_BY_A_PERSON

    @property
    def waiting(self) -> bool:
        """Whether nobody has decided yet."""
        return self.asked or self.mark.status == FOR_A_PERSON


class Request(OfAnswer, Base):
    """A student's wish to have an answer looked at again; it is answered by its number, and open until then.

    Attributes
    ----------
    text, made : what the student asks, and when (UTC)
    answered_by, answer, answered : by whom, what, and when; None while it is open
    """

    __tablename__ = "requests"

    text: Mapped[str] = mapped_column(info=WRITTEN)
    made: Mapped[datetime]
    answered_by: Mapped[str | None] = mapped_column(default=None)
    answer: Mapped[str | None] = mapped_column(default=None, info=WRITTEN)
    answered: Mapped[datetime | None] = mapped_column(default=None)

    @property
    def is_open(self) -> bool:
        """Whether nobody has answered."""
        return self.answered is None


class Publication(Base):
    """Feedback given back to the class: who did it, when (UTC), and a note."""

    __tablename__ = "publications"

    number: Mapped[int] = mapped_column("id", primary_key=True)
    actor: Mapped[str]
    note: Mapped[str] = mapped_column(info=WRITTEN)
    when: Mapped[datetime] = mapped_column("published")


class Erasure(Base):
    """A record that somebody was erased, without a name. This table only grows.

    Attributes
    ----------
    number : that their row had, and nobody's has again
    gone : the same number; before their row is deleted its negative, which refers to no erasure, so that the
        transaction cannot end
    fingerprint : of their ID, by which it is recognised if it comes again
    actor, lines, erased : who erased them, how many rows, when (UTC)
    """

    __tablename__ = "erasures"

    number: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    gone: Mapped[int] = mapped_column(sa.ForeignKey("erasures.number", deferrable=True, initially="DEFERRED"))
    fingerprint: Mapped[bytes]
    actor: Mapped[str]
    lines: Mapped[int]
    erased: Mapped[datetime]


@dataclass(frozen=True)
class RosterReport:
    """What became of a roster.

    Attributes
    ----------
    added, changed, unchanged : numbers of students
    problems : a sentence on each line that was not taken
    notes : a sentence on all that was replaced, removed, left though its cell is empty, or not read
    """

    added: int
    changed: int
    unchanged: int
    problems: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Erased:
    """What became of a person who was erased, or would.

    Attributes
    ----------
    about : what was known of them
    counts : name of a table → how many rows of it were theirs
    struck : where their name was replaced in what is said of others, in words
    left : where they are still named, in words: others' own work, and as who decided
    sources : what their hand-ins came in, as the names of zips
    unsought : of what names them, what is too short to be looked for
    """

    about: StudentRecord
    counts: Mapping[str, int]
    struck: tuple[str, ...] = ()
    left: tuple[str, ...] = ()
    sources: tuple[str, ...] = ()
    unsought: tuple[str, ...] = ()
