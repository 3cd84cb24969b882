"""What the database itself refuses, whoever writes: triggers for SQLite and PostgreSQL, made along with the tables.

* A row of a table that only grows is deleted only if an erasure names its student.
* It is changed only while its transaction erases somebody, and only so that the marker of that erasure takes the place
  of that person's ID, name, e-mail address or other name. Nothing else of the row may change.
* An erasure is never changed or deleted, and its student's number is never given again. A transaction that makes
  one cannot end while the student's row is still there: until then ``gone`` refers to an erasure that does not exist,
  and the foreign key is checked when the transaction ends. So nobody is erased in part.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from sqlalchemy import DDL, Column, event

from labcourse.grading.gradebook.records import WRITTEN, Base, Text

_STAYS = "an erasure stays as it is"
_GONE = "UPDATE erasures SET gone = number WHERE number = OLD.id"
#: Table that only grows → what a refusal says.
_GROWING = {"audit": "the audit trail only grows", "scores": "what scorers did only grows"}
#: Persons who are being erased: each word that names them, and the marker that replaces it.
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
    return f"coalesce({new} = {old}, {new} IS NULL AND {old} IS NULL)"


def _struck(old: str, new: str) -> str:
    """Return the condition that a text is as before, but for names of persons who are being erased."""
    return (
        f"({_same(old, new)} OR EXISTS (SELECT 1 FROM being_erased WHERE replace({new}, mark, '') <> {new} "
        f"AND lower(replace({new}, mark, word)) = lower(replace({old}, mark, word))))"
    )


def _allowed(column: Column[Any], reason: str, rest: str) -> str:
    """Return the condition that a column is as before, but for names where persons write.

    Parameters
    ----------
    column : of a table that only grows, or of erasures
    reason, rest : how a database writes the ``reason`` of an object in JSON, and the object without it
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
    """Yield name and event of each guard, what a refusal says, and the condition without which it refuses.

    Parameters
    ----------
    reason, rest : as :func:`_allowed` takes them
    """

    def unchanged(table: str, but: str = "") -> str:
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
    yield _BEING_ERASED.format(elements="json_each", columns="")
    for name, when, refusal, condition in _guards("json_extract({}, '$.reason')", "json_remove({}, '$.reason')"):
        moment = "AFTER" if when.startswith("INSERT") else "BEFORE"  # before an insertion there is no number yet
        code = f"SELECT RAISE(ABORT, '{refusal}')"
        yield f"CREATE TRIGGER {name} {moment} {when} WHEN NOT ({condition}) BEGIN {code}; END"
    yield f"CREATE TRIGGER students_gone AFTER DELETE ON students BEGIN {_GONE}; END"


def _postgresql() -> Iterator[str]:
    yield _BEING_ERASED.format(elements="json_array_elements_text", columns="(value)")
    for name, when, refusal, condition in _guards("({} ->> 'reason')", "(CAST({} AS jsonb) - 'reason')"):
        code = f"IF ({condition}) THEN RETURN coalesce(NEW, OLD); END IF; RAISE EXCEPTION '{refusal}';"
        yield from _function_and_trigger(name, f"BEFORE {when} FOR EACH ROW", code)
    for name, refusal in {**_GROWING, "erasures": _STAYS}.items():
        when = f"BEFORE TRUNCATE ON {name} FOR EACH STATEMENT"
        yield from _function_and_trigger(f"{name}_no_truncate", when, f"RAISE EXCEPTION '{refusal}';")
    yield from _function_and_trigger("students_gone", "AFTER DELETE ON students FOR EACH ROW", f"{_GONE}; RETURN NULL;")


def _function_and_trigger(name: str, when: str, code: str) -> Iterator[str]:
    yield f"CREATE FUNCTION {name}() RETURNS trigger LANGUAGE plpgsql AS $$BEGIN {code} END$$"
    yield f"CREATE TRIGGER {name} {when} EXECUTE FUNCTION {name}()"


for _dialect, _statements in {"sqlite": _sqlite, "postgresql": _postgresql}.items():
    for _statement in _statements():
        event.listen(Base.metadata, "after_create", DDL(_statement).execute_if(dialect=_dialect))  # type: ignore[no-untyped-call]  # SQLAlchemy's
