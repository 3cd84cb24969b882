"""Taking a student out of a gradebook, of whom it has no more than the roster's line. Inside a transaction."""

from __future__ import annotations

from sqlalchemy import Connection, delete, select

from labcourse.errors import GradebookError
from labcourse.grading.gradebook import rows
from labcourse.grading.gradebook.records import StudentRecord
from labcourse.grading.gradebook.tables import metadata, students

#: Each table that holds something of students → what that is, for people.
THEIRS = {
    **dict.fromkeys(("deliveries", "submissions"), "files that were handed in"),
    **dict.fromkeys(("runs", "decisions", "audit"), "marks"),
    **dict.fromkeys(("scores", "claims"), "what scorers did"),
    "comments": "words to them",
    "requests": "requests to look again",
}


def remove(connection: Connection, student: str) -> StudentRecord:
    """Take a student's row away; what it said. Raises GradebookError if there is none, or anything else is theirs."""
    student_id = rows.known_student(connection, student)
    record = rows.student_record(connection.execute(select(students).where(students.c.id == student_id)).one())
    there = dict.fromkeys(THEIRS[name] for name in THEIRS if _has(connection, name, student_id))
    if there:
        raise GradebookError(
            f"{record.student!r} is not removed: the gradebook has more of them than a line of a roster, "
            f"{', '.join(there)}."
        )
    connection.execute(delete(students).where(students.c.id == student_id))
    return record


def _has(connection: Connection, name: str, student_id: int) -> bool:
    """Whether a table has a row of a student's."""
    column = metadata.tables[name].c.student_id
    return connection.scalar(select(column).where(column == student_id).limit(1)) is not None
