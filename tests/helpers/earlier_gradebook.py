"""A gradebook as the version before left it: one of the present version, turned back."""

import shutil
import sqlite3
from contextlib import closing
from pathlib import Path

VERSION = 12
#: Table → its columns that the version before does not have.
_NEW = {
    "deliveries": ("folder_of", "assignment", "attempt", "copy", "stored"),
    "marks": ("answer",),
    "runs": ("ran", "versions"),
}


def turned_back(book: Path, path: Path, version: int = VERSION, without_files: str = "") -> Path:
    """Copy a gradebook; the copy, which is returned, has the tables of the version before.

    What only a partner handed in was not stored for ``without_files``.
    """
    shutil.copyfile(book, path)
    with closing(sqlite3.connect(path)) as connection, connection:
        own = "(SELECT id FROM students WHERE student = ?)"
        connection.execute(f"DELETE FROM deliveries WHERE student_id = {own}", (without_files,))
        connection.execute("DROP INDEX ix_runs_ran")
        for table, columns in _NEW.items():
            for column in columns:
                connection.execute(f"ALTER TABLE {table} DROP COLUMN {column}")
        names = [name for _place, name, *_about in connection.execute("PRAGMA table_info(decisions)")]
        kept = ", ".join(name for name in names if name != "answer")  # it is part of a key, and cannot be dropped
        connection.execute(f"CREATE TABLE before AS SELECT {kept} FROM decisions")
        connection.execute("DROP TABLE decisions")
        connection.execute("ALTER TABLE before RENAME TO decisions")
        connection.execute("DROP TABLE takes")
        connection.execute("UPDATE gradebook SET version = ?", (version,))
    return path
