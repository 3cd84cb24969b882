"""What the database refuses, whichever program writes: triggers for SQLite and PostgreSQL, made along with the tables.

* A row of a table that only grows can be deleted only if an erasure names its student.
* Such a row can be changed only in the transaction that erases a person, and only so that the marker of the erasure
  replaces the person's ID, name, e-mail address or other name. Nothing else of the row can change.
* An erasure can be neither changed nor deleted, and no student gets the number of an erased one. A transaction with an
  erasure cannot end before the student's row is deleted: until then, ``gone`` refers to an erasure that does not exist,
  and the database checks this foreign key at the end of the transaction. So a person is erased wholly or not at all.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from sqlalchemy import DDL, Column, event

from labcourse.grading.gradebook.records import WRITTEN, Base, Text

_STAYS = "an erasure stays as it is"  # message of a refusal
_GONE = "UPDATE erasures SET gone = number WHERE number = OLD.id"
#: Table that only grows → message of a refusal.
_GROWING = {"audit": "the audit trail only grows", "scores": "what scorers did only grows"}
#: The persons whom the transaction erases: each of their names, and the marker that replaces it.
_BEING_ERASED = """
CREATE VIEW being_erased AS
SELECT '[erased ' || erasures.number || ']' AS mark, names.word AS word
FROM erasures JOIN students ON students.id = erasures.number
JOIN (SELECT id, student AS word FROM students UNION ALL SELECT id, name FROM students
      UNION ALL SELECT id, email FROM students
      UNION ALL SELECT students.id, other.value FROM students, {elements}(students.aliases) AS other{columns})
  AS names ON names.id = students.id
WHERE names.word <> ''
"""


def _same(old: str, new: str) -> str:
    """Return the condition that a value does not change."""
    return f"coalesce({new} = {old}, {new} IS NULL AND {old} IS NULL)"


def _struck(old: str, new: str) -> str:
    """Return the condition that at most names of persons who are being erased change in a text."""
    return (
        f"({_same(old, new)} OR EXISTS (SELECT 1 FROM being_erased WHERE replace({new}, mark, '') <> {new} "
        f"AND lower(replace({new}, mark, word)) = lower(replace({old}, mark, word))))"
    )


def _allowed(column: Column[Any], reason: str, rest: str) -> str:
    """Return the condition that nothing of a column changes but names of persons, and these only where persons write.

    Parameters
    ----------
    column : of a table that only grows, or of erasures
    reason, rest : SQL of the database for the ``reason`` of an object in JSON, and for the object without it
    """
    old, new = f"OLD.{column.name}", f"NEW.{column.name}"
    if column.info != WRITTEN:
        return _same(old, new)
    if isinstance(column.type, Text):
        return _struck(old, new)
    same_text = _same(f"CAST({old} AS text)", f"CAST({new} AS text)")
    same_rest = _same(rest.format(old), rest.format(new))
    return f"({same_text} OR ({same_rest} AND {_struck(reason.format(old), reason.format(new))}))"


def _guards(reason: str, rest: str) -> Iterator[tuple[str, str, str, str]]:
    """Yield each trigger: its name, its event, the message of a refusal, and the condition that must hold.

    Parameters
    ----------
    reason, rest : as :func:`_allowed` takes them
    """

    def unchanged(table: str, but: str = "") -> str:
        """Return the condition that a row changes as :func:`_allowed` says; one column may change freely."""
        columns = Base.metadata.tables[table].columns
        return " AND ".join(_allowed(column, reason, rest) for column in columns if column.name != but)

    for table, refusal in _GROWING.items():
        erased = "EXISTS (SELECT 1 FROM erasures WHERE number = OLD.student_id)"
        yield f"{table}_no_delete", f"DELETE ON {table}", refusal, erased
        yield f"{table}_no_update", f"UPDATE ON {table}", refusal, unchanged(table)
    yield "erasures_begin", "INSERT ON erasures", _STAYS, "NEW.gone = -NEW.number AND NEW.gone < 0"
    yield "erasures_no_delete", "DELETE ON erasures", _STAYS, "1 = 0"
    is_gone = "NEW.gone = NEW.number AND NOT EXISTS (SELECT 1 FROM students WHERE id = OLD.number)"
    yield "erasures_no_update", "UPDATE ON erasures", _STAYS, f"{unchanged('erasures', but='gone')} AND {is_gone}"
    yield "students_no_other_number", "UPDATE ON students", "the number of a student stays as it is", "NEW.id = OLD.id"
    never, free = "the number of an erased student is never given again", "NEW.id NOT IN (SELECT number FROM erasures)"
    yield "students_no_number_again", "INSERT ON students", never, free


def _sqlite() -> Iterator[str]:
    """Yield the statements for SQLite."""
    yield _BEING_ERASED.format(elements="json_each", columns="")
    for name, when, refusal, condition in _guards("json_extract({}, '$.reason')", "json_remove({}, '$.reason')"):
        moment = "AFTER" if when.startswith("INSERT") else "BEFORE"  # before an insertion there is no number yet
        code = f"SELECT RAISE(ABORT, '{refusal}')"
        yield f"CREATE TRIGGER {name} {moment} {when} WHEN NOT ({condition}) BEGIN {code}; END"
    yield f"CREATE TRIGGER students_gone AFTER DELETE ON students BEGIN {_GONE}; END"


def _postgresql() -> Iterator[str]:
    """Yield the statements for PostgreSQL."""
    yield _BEING_ERASED.format(elements="json_array_elements_text", columns="(value)")
    for name, when, refusal, condition in _guards("({} ->> 'reason')", "(CAST({} AS jsonb) - 'reason')"):
        code = f"IF ({condition}) THEN RETURN coalesce(NEW, OLD); END IF; RAISE EXCEPTION '{refusal}';"
        yield from _function_and_trigger(name, f"BEFORE {when} FOR EACH ROW", code)
    for name, refusal in {**_GROWING, "erasures": _STAYS}.items():
        when = f"BEFORE TRUNCATE ON {name} FOR EACH STATEMENT"
        yield from _function_and_trigger(f"{name}_no_truncate", when, f"RAISE EXCEPTION '{refusal}';")
    yield from _function_and_trigger("students_gone", "AFTER DELETE ON students FOR EACH ROW", f"{_GONE}; RETURN NULL;")


def _function_and_trigger(name: str, when: str, code: str) -> Iterator[str]:
    """Yield the statements that make a trigger of PostgreSQL, which calls a function."""
    yield f"CREATE FUNCTION {name}() RETURNS trigger LANGUAGE plpgsql AS $$BEGIN {code} END$$"
    yield f"CREATE TRIGGER {name} {when} EXECUTE FUNCTION {name}()"


for _dialect, _statements in {"sqlite": _sqlite, "postgresql": _postgresql}.items():
    for _statement in _statements():
        event.listen(Base.metadata, "after_create", DDL(_statement).execute_if(dialect=_dialect))  # type: ignore[no-untyped-call]  # SQLAlchemy's
