"""A gradebook as the version before left it: one of the present version, turned back."""

import json
import shutil
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

from labcourse.problems import Code, Problem
from labcourse.sentences import sentence

VERSION = 10
_CODES = {code.value for code in Code}
_JSON = {"runs": ("problems", "notes", "cells"), "audit": ("mark_before", "mark_after"), "scores": ("replaced",)}
_TEXTS = ("marks", "decisions")  # with a reason, which was a text and is JSON now


def turned_back(book: Path, path: Path, version: int = VERSION) -> Path:
    """Copy a gradebook; in the copy, which is returned, all problems are the texts that they were."""
    shutil.copyfile(book, path)
    with closing(sqlite3.connect(path)) as connection, connection:
        connection.create_function("told", 1, lambda stored: json.dumps(_told(json.loads(stored))))
        for table, columns in _JSON.items():
            for column in columns:
                connection.execute(f"UPDATE {table} SET {column} = told({column}) WHERE {column} IS NOT NULL")
        for table in _TEXTS:
            connection.execute(f"ALTER TABLE {table} ADD COLUMN words TEXT NOT NULL DEFAULT ''")
            connection.execute(f"UPDATE {table} SET words = told(reason) ->> '$'")
            connection.execute(f"ALTER TABLE {table} DROP COLUMN reason")
            connection.execute(f"ALTER TABLE {table} RENAME COLUMN words TO reason")
        connection.execute("UPDATE gradebook SET version = ?", (version,))
    return path


def with_other_names(book: Path, path: Path) -> Path:
    """Copy a gradebook; the copy, which is returned, is of version 11, in which facts of a run had other names."""
    shutil.copyfile(book, path)
    with closing(sqlite3.connect(path)) as connection, connection:
        for new, former in (("cell_reports", "reports"), ("documents", "reports_in_pdf")):
            connection.execute("UPDATE runs SET cells = replace(cells, ?, ?)", (f'"{new}"', f'"{former}"'))
        connection.execute("UPDATE gradebook SET version = 11")
    return path


def _told(stored: Any) -> Any:
    """Put data into words: problems become texts."""
    if isinstance(stored, list):
        return [*map(_told, stored)]
    if not isinstance(stored, dict):
        return stored
    if stored.get("code") in _CODES:
        return sentence(Problem.from_json(stored))
    return {name: _told(value) for name, value in stored.items()}
