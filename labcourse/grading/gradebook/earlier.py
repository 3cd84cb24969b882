"""Take over a gradebook of an earlier version: what was handed in, and what persons decided; not runs and marks.

Runs and marks are made anew from the files that are stored in it (``grade MARKS EARLIER.sqlite``).
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Collection, Mapping
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from labcourse.errors import GradebookError
from labcourse.grading.gradebook.database import TAKEN_OVER
from labcourse.grading.gradebook.records import Base

_MAGIC = b"SQLite format 3\0"
_MADE_ANEW = ("gradebook", "runs", "marks", "claims")
#: Columns that held a text and hold JSON now.
_TEXTS = frozenset({("decisions", "reason")})
_HAS_FILES = "EXISTS (SELECT 1 FROM earlier.deliveries WHERE deliveries.student_id = runs.student_id)"
_CURRENT = f"""
    SELECT students.student, runs.cells, runs.supplied, {_HAS_FILES}
    FROM earlier.runs JOIN earlier.students ON students.id = runs.student_id WHERE runs.current ORDER BY students.folded
"""


@dataclass(frozen=True)
class EarlierRun:
    """What of a student's run cannot be read from the files that are stored.

    Attributes
    ----------
    bench_of : ID of the student with the bench on which it was run; "" if that is not known
    has_files : whether the student handed in files, and not only a partner for them
    supplied : "1.2.speed" → value that an instructor supplied
    """

    bench_of: str = ""
    has_files: bool = True
    supplied: Mapping[str, Any] = field(default_factory=dict)


def is_gradebook(path: Path) -> bool:
    """Return whether a file is a database of SQLite, by its first bytes."""
    if not path.is_file():
        return False
    with path.open("rb") as file:
        return file.read(len(_MAGIC)) == _MAGIC


def take_over(new: Path, earlier: Path) -> dict[str, EarlierRun]:
    """Copy all but runs, marks and claims from an earlier gradebook into a new one, unless that was done before.

    Parameters
    ----------
    new : file of a gradebook without students, or of one that was made from this earlier one
    earlier : file of a gradebook of an earlier version

    Returns
    -------
    dict
        ID of each student who was graded → what the stored files do not say, for grading them again.

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
            if version not in TAKEN_OVER:
                known = " and ".join(map(str, TAKEN_OVER))
                raise GradebookError(f"{earlier} has version {version}, and only {known} can be taken over.")
            connection.execute("BEGIN IMMEDIATE")
            if connection.execute("SELECT secret FROM gradebook").fetchone() != (secret,):
                if connection.execute("SELECT count(*) FROM students").fetchone() != (0,):
                    raise GradebookError(f"{new} has students already. Name a new gradebook, and then {earlier}.")
                _copy(connection, _TEXTS if version == min(TAKEN_OVER) else frozenset())
                connection.execute("UPDATE gradebook SET secret = ?", (secret,))
            connection.execute("COMMIT")
            runs = connection.execute(_CURRENT).fetchall()
        except sqlite3.Error as error:
            raise GradebookError(f"{earlier} cannot be taken over: {error}.") from None
    return {student: _run(cells, supplied, has_files) for student, cells, supplied, has_files in runs}


def _copy(connection: sqlite3.Connection, texts: Collection[tuple[str, str]]) -> None:
    """Copy the rows of all tables that are not made anew; texts that are JSON now are quoted."""
    for table in Base.metadata.sorted_tables:
        if table.name not in _MADE_ANEW:
            names = [column.name for column in table.columns]
            values = [f'json_quote("{name}")' if (table.name, name) in texts else f'"{name}"' for name in names]
            columns = ", ".join(f'"{name}"' for name in names)
            connection.execute(
                f'INSERT INTO "{table.name}" ({columns}) SELECT {", ".join(values)} FROM earlier."{table.name}"'
            )


def _run(cells: str, supplied: str, has_files: int) -> EarlierRun:
    """Return what a row of the earlier table of runs says; ``cells`` and ``supplied`` are JSON."""
    facts = [*json.loads(cells or "[]"), {}][0]
    return EarlierRun(facts.get("bench_of", ""), bool(has_files), json.loads(supplied or "{}"))
