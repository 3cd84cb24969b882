"""Take over a gradebook of an earlier version: what was handed in, and what persons decided; not runs and marks.

Runs and marks are made anew from the files that are stored in it (``grade MARKS EARLIER.sqlite``).
"""

from __future__ import annotations

import json
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

from labcourse.errors import GradebookError
from labcourse.grading.gradebook.database import TAKEN_OVER
from labcourse.grading.gradebook.records import Base, answer_digest

_MAGIC = b"SQLite format 3\0"
_MADE_ANEW = ("gradebook", "runs", "marks", "claims")
#: Columns that an earlier version does not have, and what they hold for a row of it.
_NEW_COLUMNS = {
    ("deliveries", "folder_of"): "''",
    ("deliveries", "assignment"): "''",
    ("deliveries", "attempt"): "0",
    ("deliveries", "copy"): "0",
    ("deliveries", "stored"): "received",
    ("decisions", "answer"): "answer_digest(given)",
}
#: What was run on a bench came with that bench's ``course.json``.
_BENCHES = """
    UPDATE deliveries SET folder_of = coalesce((
        SELECT runs.cells ->> '$[0].bench_of' FROM earlier.runs
        WHERE runs.student_id = deliveries.student_id AND runs.current), '')
"""
#: What only a partner handed in was stored as theirs; both were run on one bench.
_OF_PARTNERS = """
    INSERT INTO deliveries
        (student_id, name, digest, content, received, source, clock, folder_of, assignment, attempt, copy, stored)
    SELECT mine.student_id, name, digest, content, received, source, clock, folder_of, assignment, attempt, copy, stored
    FROM earlier.runs AS mine
        JOIN earlier.runs AS theirs ON theirs.cells ->> '$[0].bench_of' = mine.cells ->> '$[0].bench_of'
        JOIN deliveries ON deliveries.student_id = theirs.student_id
    WHERE mine.current AND theirs.current AND theirs.id <> mine.id
        AND mine.student_id NOT IN (SELECT student_id FROM earlier.deliveries)
"""
_CURRENT = """
    SELECT students.student, runs.supplied FROM earlier.runs JOIN earlier.students ON students.id = runs.student_id
    WHERE runs.current ORDER BY students.folded
"""


def is_gradebook(path: Path) -> bool:
    """Return whether a file is a database of SQLite, by its first bytes."""
    if not path.is_file():
        return False
    with path.open("rb") as file:
        return file.read(len(_MAGIC)) == _MAGIC


def take_over(new: Path, earlier: Path) -> dict[str, dict[str, Any]]:
    """Copy all but runs, marks and claims from an earlier gradebook into a new one, unless that was done before.

    Parameters
    ----------
    new : file of a gradebook without students, or of one that was made from this earlier one
    earlier : file of a gradebook of an earlier version

    Returns
    -------
    dict
        ID of each student who was graded → "1.2.speed" → value that an instructor supplied.

    Raises
    ------
    GradebookError
        If the earlier file is damaged or of another version, or if the new one has students and was not made from this
        earlier file. Then nothing is copied.
    """
    with closing(sqlite3.connect(new, isolation_level=None)) as connection:
        try:
            connection.execute("ATTACH DATABASE ? AS earlier", (f"{earlier}",))
            about = connection.execute("SELECT version, secret FROM earlier.gradebook").fetchone()
            version, secret = about or (0, b"")
            if version != TAKEN_OVER:
                raise GradebookError(f"{earlier} has version {version}, and only {TAKEN_OVER} can be taken over.")
            connection.execute("BEGIN IMMEDIATE")
            if connection.execute("SELECT secret FROM gradebook").fetchone() != (secret,):
                if connection.execute("SELECT count(*) FROM students").fetchone() != (0,):
                    raise GradebookError(f"{new} has students already. Name a new gradebook, and then {earlier}.")
                _copy(connection)
                connection.execute("UPDATE gradebook SET secret = ?", (secret,))
            connection.execute("COMMIT")
            runs = connection.execute(_CURRENT).fetchall()
        except sqlite3.Error as error:
            raise GradebookError(f"{earlier} cannot be taken over: {error}.") from None
    return {student: json.loads(supplied or "{}") for student, supplied in runs}


def _copy(connection: sqlite3.Connection) -> None:
    """Copy the rows of all tables that are not made anew, and give partners the files of their common work."""
    connection.create_function("answer_digest", 1, answer_digest, deterministic=True)
    for table in Base.metadata.sorted_tables:
        there = {name for _place, name, *_about in connection.execute(f'PRAGMA earlier.table_info("{table.name}")')}
        if there and table.name not in _MADE_ANEW:
            names = [column.name for column in table.columns]
            values = [f'"{name}"' if name in there else _NEW_COLUMNS[table.name, name] for name in names]
            columns = ", ".join(f'"{name}"' for name in names)
            connection.execute(
                f'INSERT INTO "{table.name}" ({columns}) SELECT {", ".join(values)} FROM earlier."{table.name}"'
            )
    connection.execute(_BENCHES)
    connection.execute(_OF_PARTNERS)
