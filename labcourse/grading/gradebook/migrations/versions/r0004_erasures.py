"""A person can be erased; the tables that only grow let go of whoever is, and of nobody and nothing else.

What holds from here on, whoever writes:

* A line of a table that only grows is deleted only if an erasure names its student.
* It is changed only while its transaction erases somebody, and only so that the mark of that erasure takes the place of
  that person's ID, name, e-mail address or other name; nothing else of the line may be another.
* An erasure is never changed or deleted, its student's number is given to nobody again, and a transaction that makes
  one cannot end while the student is still there: until then ``gone`` names an erasure that there is not, and the
  foreign key is looked at when the transaction ends. So nobody loses a part of what there is of them.
"""

from __future__ import annotations

from collections.abc import Iterator

import sqlalchemy as sa
from alembic import op

revision = "0004"
down_revision = "0003"
branch_labels = None
depends_on = None

_GROWING = {"audit": "the audit trail only grows", "scores": "what scorers did only grows"}
_OLD_FUNCTIONS = {"audit": "audit_only_grows", "scores": "scores_only_grow"}
#: Columns of texts by persons, from which a name may be struck out; and, of one that holds JSON, the text in it.
_TEXTS = {"audit": ("reason_before", "reason_after", "why"), "scores": ("remark",)}
_IN_JSON = {"audit": None, "scores": ("replaced", "reason")}
_FIXED = {
    "audit": (
        *("id", "student_id", "question", "part", "status_before", "points_before", "out_of_before"),
        *("status_after", "points_after", "out_of_after", "run", "actor", "changed"),
    ),
    "scores": (
        *("id", "student_id", "question", "part", "round", "actor", "level", "points", "out_of", "given", "asked"),
        *("undoes", "acted"),
    ),
}
_ERASURE = ("number", "fingerprint", "actor", "lines", "erased")
_ERASURES_STAY = "an erasure stays as it is"
_NOBODYS = "the number of a student who was erased is given to nobody"
_NUMBER_STAYS = "the number of a student stays as it is"

#: Who is being erased just now: what stands in the place of each word that names them.
_BEING_ERASED = """
CREATE VIEW being_erased AS
SELECT '[erased ' || erasures.number || ']' AS mark, names.word AS word
FROM erasures JOIN students ON students.id = erasures.number
JOIN (SELECT id, student AS word FROM students UNION ALL SELECT id, name FROM students
      UNION ALL SELECT id, email FROM students UNION ALL {aliases}) AS names ON names.id = students.id
WHERE names.word <> ''
"""
_ALIASES = {
    "sqlite": "SELECT students.id, other.value FROM students, json_each(students.aliases) AS other",
    "postgresql": "SELECT students.id, other.word FROM students, json_array_elements_text("
    "CASE WHEN json_typeof(students.aliases) = 'array' THEN students.aliases ELSE CAST('[]' AS json) END"
    ") AS other(word)",
}


def upgrade() -> None:
    """Add a table, and let the guards of two others know it."""
    op.create_table(
        "erasures",
        sa.Column("number", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("gone", sa.Integer(), nullable=False),
        sa.Column("fingerprint", sa.LargeBinary(), nullable=False),
        sa.Column("actor", sa.Text(), nullable=False),
        sa.Column("lines", sa.Integer(), nullable=False),
        sa.Column("erased", sa.DateTime(timezone=True), nullable=False),
        sa.ForeignKeyConstraint(
            ["gone"], ["erasures.number"], name=op.f("fk_erasures_gone"), deferrable=True, initially="DEFERRED"
        ),
        sa.PrimaryKeyConstraint("number", name=op.f("pk_erasures")),
    )
    dialect = op.get_bind().dialect.name
    op.execute(_BEING_ERASED.format(aliases=_ALIASES[dialect]))
    for statement in {"sqlite": _sqlite, "postgresql": _postgresql}[dialect]():
        op.execute(statement)


def _sqlite() -> Iterator[str]:
    def guard(name: str, when: str, refusal: str, unless: str) -> str:
        return f"CREATE TRIGGER {name} {when} WHEN NOT ({unless}) BEGIN SELECT RAISE(ABORT, '{refusal}'); END"

    def struck(before: str, after: str) -> str:
        return (
            f"({after} IS {before} OR EXISTS (SELECT 1 FROM being_erased WHERE instr({after}, mark) > 0 "
            f"AND lower(replace({after}, mark, word)) = lower(replace({before}, mark, word))))"
        )

    for table, refusal in _GROWING.items():
        yield f"DROP TRIGGER {table}_no_delete"
        yield f"DROP TRIGGER {table}_no_update"
        named = "EXISTS (SELECT 1 FROM erasures WHERE number = OLD.student_id)"
        yield guard(f"{table}_no_delete", f"BEFORE DELETE ON {table}", refusal, named)
        same = [f"NEW.{name} IS OLD.{name}" for name in _FIXED[table]]
        texts = [struck(f"OLD.{name}", f"NEW.{name}") for name in _TEXTS[table]]
        if inside := _IN_JSON[table]:
            column, key = inside
            before, after = (f"json_extract({side}.{column}, '$.{key}')" for side in ("OLD", "NEW"))
            rest = [f"json_remove({side}.{column}, '$.{key}')" for side in ("OLD", "NEW")]
            texts.append(f"(NEW.{column} IS OLD.{column} OR ({rest[0]} IS {rest[1]} AND {struck(before, after)}))")
        yield guard(f"{table}_no_update", f"BEFORE UPDATE ON {table}", refusal, " AND ".join([*same, *texts]))
    yield guard(
        "erasures_begin", "BEFORE INSERT ON erasures", _ERASURES_STAY, "NEW.gone = -NEW.number AND NEW.gone < 0"
    )
    yield guard("erasures_no_delete", "BEFORE DELETE ON erasures", _ERASURES_STAY, "0")
    same = [f"NEW.{name} IS OLD.{name}" for name in _ERASURE]
    there = "EXISTS (SELECT 1 FROM students WHERE id = OLD.number)"
    as_it_was = " AND ".join([*same, "NEW.gone = NEW.number", f"NOT {there}"])
    yield guard("erasures_no_update", "BEFORE UPDATE ON erasures", _ERASURES_STAY, as_it_was)
    free = "NEW.id NOT IN (SELECT number FROM erasures)"
    yield guard("students_no_number_again", "AFTER INSERT ON students", _NOBODYS, free)
    yield guard("students_no_other_number", "BEFORE UPDATE OF id ON students", _NUMBER_STAYS, "NEW.id = OLD.id")
    yield (
        "CREATE TRIGGER students_gone AFTER DELETE ON students "
        "BEGIN UPDATE erasures SET gone = number WHERE number = OLD.id; END"
    )


def _postgresql() -> Iterator[str]:
    def guard(name: str, when: str, refusal: str, unless: str, given: str = "NEW") -> Iterator[str]:
        yield (
            f"CREATE FUNCTION {name}() RETURNS trigger LANGUAGE plpgsql AS "
            f"$$BEGIN IF ({unless}) THEN RETURN {given}; END IF; RAISE EXCEPTION '{refusal}'; END$$"
        )
        yield f"CREATE TRIGGER {name} {when} FOR EACH ROW EXECUTE FUNCTION {name}()"

    def same(names: tuple[str, ...]) -> list[str]:
        return [f"NEW.{name} IS NOT DISTINCT FROM OLD.{name}" for name in names]

    yield (
        "CREATE FUNCTION struck(before text, after text) RETURNS boolean LANGUAGE sql STABLE AS "
        "$$SELECT after IS NOT DISTINCT FROM before OR EXISTS (SELECT 1 FROM being_erased "
        "WHERE strpos(after, mark) > 0 AND lower(replace(after, mark, word)) = lower(replace(before, mark, word)))$$"
    )
    for table, refusal in _GROWING.items():
        function = _OLD_FUNCTIONS[table]
        yield f"DROP TRIGGER {function} ON {table}"
        yield (f"CREATE TRIGGER {function} BEFORE TRUNCATE ON {table} FOR EACH STATEMENT EXECUTE FUNCTION {function}()")
        named = "EXISTS (SELECT 1 FROM erasures WHERE number = OLD.student_id)"
        yield from guard(f"{table}_no_delete", f"BEFORE DELETE ON {table}", refusal, named, "OLD")
        texts = [f"struck(OLD.{name}, NEW.{name})" for name in _TEXTS[table]]
        if inside := _IN_JSON[table]:
            column, key = inside
            as_text = [f"CAST({side}.{column} AS text)" for side in ("OLD", "NEW")]
            rest = [f"(CAST({side}.{column} AS jsonb) - '{key}')" for side in ("OLD", "NEW")]
            texts.append(
                f"({as_text[0]} IS NOT DISTINCT FROM {as_text[1]} OR CASE WHEN json_typeof(OLD.{column}) = 'object' "
                f"AND json_typeof(NEW.{column}) = 'object' THEN {rest[0]} = {rest[1]} "
                f"AND struck(OLD.{column} ->> '{key}', NEW.{column} ->> '{key}') ELSE false END)"
            )
        unless = " AND ".join([*same(_FIXED[table]), *texts])
        yield from guard(f"{table}_no_update", f"BEFORE UPDATE ON {table}", refusal, unless)
    begins = "NEW.gone = -NEW.number AND NEW.gone < 0"
    yield from guard("erasures_begin", "BEFORE INSERT ON erasures", _ERASURES_STAY, begins)
    yield from guard("erasures_no_delete", "BEFORE DELETE ON erasures", _ERASURES_STAY, "false", "OLD")
    there = "EXISTS (SELECT 1 FROM students WHERE id = OLD.number)"
    as_it_was = " AND ".join([*same(_ERASURE), "NEW.gone = NEW.number", f"NOT {there}"])
    yield from guard("erasures_no_update", "BEFORE UPDATE ON erasures", _ERASURES_STAY, as_it_was)
    yield (
        "CREATE FUNCTION erasures_stay() RETURNS trigger LANGUAGE plpgsql AS "
        f"$$BEGIN RAISE EXCEPTION '{_ERASURES_STAY}'; END$$"
    )
    yield (
        "CREATE TRIGGER erasures_stay BEFORE TRUNCATE ON erasures FOR EACH STATEMENT EXECUTE FUNCTION erasures_stay()"
    )
    free = "NOT EXISTS (SELECT 1 FROM erasures WHERE number = NEW.id)"
    yield from guard("students_no_number_again", "BEFORE INSERT ON students", _NOBODYS, free)
    yield from guard("students_no_other_number", "BEFORE UPDATE OF id ON students", _NUMBER_STAYS, "NEW.id = OLD.id")
    yield (
        "CREATE FUNCTION students_gone() RETURNS trigger LANGUAGE plpgsql AS "
        "$$BEGIN UPDATE erasures SET gone = number WHERE number = OLD.id; RETURN NULL; END$$"
    )
    yield "CREATE TRIGGER students_gone AFTER DELETE ON students FOR EACH ROW EXECUTE FUNCTION students_gone()"
