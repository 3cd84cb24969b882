"""The whole content of a gradebook as plain data, in an order that does not depend on who was recorded first."""

from __future__ import annotations

import hashlib
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from labcourse.grading.gradebook import Gradebook
from labcourse.grading.gradebook.records import Base
from labcourse.problems import as_json

#: Numbers of rows, times, and what the order in the dump says already.
_LEFT_OUT = {"id", "student_id", "run_id", "folded", "position", "number", "digest"}
_TIMES = {"recorded", "decided", "written", "changed", "received", "acted", "published", "erased"}
_TIMES |= {"replaced", "stored"}  # what was replaced holds a time
#: Tables of a student, and by what their rows are ordered; the others are in the order in which they grew.
_ORDER = {
    "deliveries": ("name", "received", "id"),
    "runs": ("key",),
    "decisions": ("question", "part"),
    "comments": ("question", "actor", "text"),
    "audit": ("id",),
    "scores": ("id",),
}


def dump(book: Gradebook) -> dict[str, Any]:
    """Return all of a gradebook but times, the secret, claims and numbers of rows: equal where the content is equal.

    Of answers and of files that were handed in, size and SHA-256 stand for the content. An act that takes another back
    names its place among the student's acts.
    """
    with book._database.reading() as session:
        students = sorted(_rows(session, "students"), key=lambda row: row["folded"])
        tables = {name: _rows(session, name) for name in (*_ORDER, "marks")}
        others = {name: [_plain(row) for row in _rows(session, name)] for name in ("publications", "erasures")}
    return {"students": [{**_plain(student), **_of(student["id"], tables)} for student in students], **others}


def _rows(session: Session, table: str) -> list[dict[str, Any]]:
    found = Base.metadata.tables[table]
    return [dict(row) for row in session.execute(select(found).order_by(*found.primary_key)).mappings()]


def _of(number: int, tables: dict[str, list[dict[str, Any]]]) -> dict[str, Any]:
    found = {}
    for name, order in _ORDER.items():
        own = [row for row in tables[name] if row["student_id"] == number]
        own.sort(key=lambda row: [row[column] or "" for column in order])
        place = {row["id"]: number for number, row in enumerate(own) if "undoes" in row}
        found[name] = [_plain({**row, "undoes": place.get(row.get("undoes"))}) for row in own]
        if name == "runs":
            for row, shown in zip(own, found[name], strict=True):
                made = [mark for mark in tables["marks"] if mark["run_id"] == row["id"]]
                shown["marks"] = [_plain(mark) for mark in sorted(made, key=lambda mark: mark["position"])]
    return found


def _plain(row: dict[str, Any]) -> dict[str, Any]:
    return {name: _shown(value) for name, value in row.items() if name not in _LEFT_OUT | _TIMES}


def _shown(value: Any) -> Any:
    if isinstance(value, bytes):
        return {"bytes": len(value), "sha256": hashlib.sha256(value).hexdigest()}
    return as_json(vars(value) if hasattr(value, "out_of") else value)
