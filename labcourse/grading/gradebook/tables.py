"""The tables. What is here and what the newest of the migrations makes are the same; a test compares them."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Any

from sqlalchemy import (
    JSON,
    BigInteger,
    Boolean,
    Column,
    DateTime,
    Dialect,
    Double,
    ForeignKey,
    Index,
    Integer,
    LargeBinary,
    MetaData,
    Table,
    Text,
    TypeDecorator,
    UniqueConstraint,
    text,
)

#: Where a database keeps which revision it is at.
VERSION_TABLE = "gradebook_version"


class Instant(TypeDecorator[datetime]):
    """A moment in UTC, aware of it also where the database is not (SQLite)."""

    impl = DateTime(timezone=True)
    cache_ok = True

    def process_bind_param(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        return value and value.astimezone(UTC)

    def process_result_value(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        return value and (value.astimezone(UTC) if value.tzinfo else value.replace(tzinfo=UTC))


metadata = MetaData(
    naming_convention={
        "ix": "ix_%(table_name)s_%(column_0_N_name)s",
        "uq": "uq_%(table_name)s_%(column_0_N_name)s",
        "fk": "fk_%(table_name)s_%(column_0_N_name)s",
        "pk": "pk_%(table_name)s",
    }
)


def _must(name: str, kind: Any, **more: Any) -> Column[Any]:
    return Column(name, kind, nullable=False, **more)


def _belongs(name: str, to: str, **more: Any) -> Column[Any]:
    return Column(name, Integer, ForeignKey(to), nullable=False, **more)


#: What the gradebook knows of itself: its secret.
meta = Table("meta", metadata, Column("name", Text, primary_key=True), _must("value", LargeBinary))

students = Table(
    "students",
    metadata,
    Column("id", Integer, primary_key=True),
    _must("student", Text),
    _must("folded", Text, unique=True),  # the ID without regard to capitals
    _must("name", Text),
    _must("email", Text),
    _must("section", Text),
    Column("aliases", JSON),  # NULL: none
    Column("enrolled", Boolean),  # NULL: not known, from before it was kept
)

#: The files that students handed in, each version of them.
deliveries = Table(
    "deliveries",
    metadata,
    Column("id", Integer, primary_key=True),
    _belongs("student_id", "students.id"),
    _must("name", Text),
    _must("digest", Text),
    _must("received", Instant),
    _must("content", LargeBinary),
    _must("source", Text),
    Column("clock", Text),  # NULL: not known, from before it was kept
    UniqueConstraint("student_id", "name", "digest", "received"),
)

submissions = Table(
    "submissions",
    metadata,
    Column("id", Integer, primary_key=True),
    _belongs("student_id", "students.id"),
    _must("digest", Text),
    _must("first_seen", Instant),
    UniqueConstraint("student_id", "digest"),
)

runs = Table(
    "runs",
    metadata,
    Column("id", Integer, primary_key=True),
    _belongs("student_id", "students.id", index=True),
    _belongs("submission_id", "submissions.id", index=True),
    _must("key", Text, unique=True),
    _must("spelled", Text),  # the ID, as the submission has it
    _must("master", Text),
    _must("software", Text),
    _must("probe_seed", BigInteger),
    _must("isolation", Text),
    _must("problems", JSON),
    _must("notes", JSON),
    _must("key_digest", Text),
    _must("current", Boolean),
    _must("recorded", Instant),
    # These came with revision 0002; they are NULL in runs that were there before.
    Column("cells", JSON),
    Column("claim", JSON),
    Column("words", JSON),
    Column("supplied", JSON),
    Column("release", Text),
    Column("files", JSON),
)
Index(
    "uq_runs_one_current",
    runs.c.student_id,
    unique=True,
    sqlite_where=text("current"),
    postgresql_where=text("current"),
)

answers = Table(
    "answers",
    metadata,
    Column("run_id", Integer, ForeignKey("runs.id"), primary_key=True, autoincrement=False),
    _must("content", LargeBinary),
)

#: As the software made them; a person's decision lies on top, see ``decisions``.
marks = Table(
    "marks",
    metadata,
    Column("run_id", Integer, ForeignKey("runs.id"), primary_key=True, autoincrement=False),
    Column("question", Text, primary_key=True),
    Column("part", Text, primary_key=True),
    _must("position", Integer),
    _must("status", Text),
    _must("points", Double),
    _must("out_of", Double),
    _must("reason", Text),
    _must("given", Text),
)

#: The marks that persons set. One holds as long as what was given, and what it is out of, are the same.
decisions = Table(
    "decisions",
    metadata,
    Column("student_id", Integer, ForeignKey("students.id"), primary_key=True, autoincrement=False),
    Column("question", Text, primary_key=True),
    Column("part", Text, primary_key=True),
    _must("points", Double),
    _must("out_of", Double),
    _must("reason", Text),
    _must("given", Text),
    _must("actor", Text),
    _must("decided", Instant),
)

comments = Table(
    "comments",
    metadata,
    Column("id", Integer, primary_key=True),
    _belongs("student_id", "students.id", index=True),
    Column("question", Text),
    _must("text", Text),
    _must("actor", Text),
    _must("written", Instant),
)

#: Grows only: the database itself refuses to change or to delete a row.
audit = Table(
    "audit",
    metadata,
    Column("id", Integer, primary_key=True),
    _belongs("student_id", "students.id", index=True),
    _must("question", Text),
    _must("part", Text),
    *(
        Column(f"{name}_{side}", kind)
        for side in ("before", "after")
        for name, kind in (("status", Text), ("points", Double), ("out_of", Double), ("reason", Text))
    ),
    _must("run", Text),
    _must("actor", Text),
    _must("why", Text),
    _must("changed", Instant),
)

#: What scorers did, act by act. Grows only, as the audit trail does.
scores = Table(
    "scores",
    metadata,
    Column("id", Integer, primary_key=True),
    _belongs("student_id", "students.id"),
    _must("question", Text),
    _must("part", Text),
    _must("round", Integer),  # always 1 now: see score_rows.ROUND
    _must("actor", Text),
    Column("level", Integer),  # NULL: points without a level, or the instructor is asked
    Column("points", Double),  # NULL: the instructor is asked
    _must("out_of", Double),
    _must("remark", Text),
    _must("given", Text),  # the answer as it was read
    _must("asked", Boolean),
    Column("undoes", Integer, ForeignKey("scores.id")),
    Column("replaced", JSON),  # the decision that was there before, for undo; NULL: none
    _must("acted", Instant),
)
Index("ix_scores_question_part", scores.c.question, scores.c.part)

#: Who is reading which answer, and until when nobody else is given it.
claims = Table(
    "claims",
    metadata,
    Column("student_id", Integer, ForeignKey("students.id"), primary_key=True, autoincrement=False),
    Column("question", Text, primary_key=True),
    Column("part", Text, primary_key=True),
    Column("round", Integer, primary_key=True, autoincrement=False),  # as above
    _must("actor", Text),
    _must("until", Instant),
)

#: What students ask to have looked at again.
requests = Table(
    "requests",
    metadata,
    Column("id", Integer, primary_key=True),
    _belongs("student_id", "students.id", index=True),
    _must("question", Text),
    _must("part", Text),
    _must("text", Text),
    _must("made", Instant),
    Column("answered_by", Text),
    Column("answer", Text),
    Column("answered", Instant),
)

#: When feedback was given back, and by whom.
publications = Table(
    "publications",
    metadata,
    Column("id", Integer, primary_key=True),
    _must("actor", Text),
    _must("note", Text),
    _must("published", Instant),
)

#: Who was erased, without a word of who it was: the number that their row had and nobody's has again, and by what the
#: same ID would be known if it came once more. Grows only; the guards of the tables above go by it (revision 0004).
erasures = Table(
    "erasures",
    metadata,
    Column("number", Integer, primary_key=True, autoincrement=False),
    # The negative number until the student's row is gone: nothing has that, so that a transaction cannot end before.
    Column("gone", Integer, ForeignKey("erasures.number", deferrable=True, initially="DEFERRED"), nullable=False),
    _must("fingerprint", LargeBinary),
    _must("actor", Text),
    _must("lines", Integer),
    _must("erased", Instant),
)
