"""The whole content of a gradebook as plain data, in an order that does not depend on who was recorded first."""

from __future__ import annotations

import hashlib
from collections import defaultdict
from typing import Any

from sqlalchemy import Connection, Table, select

from labcourse.grading.gradebook import Gradebook
from labcourse.grading.gradebook.tables import (
    answers,
    audit,
    comments,
    decisions,
    deliveries,
    erasures,
    marks,
    publications,
    requests,
    runs,
    scores,
    students,
    submissions,
)

#: Numbers of rows, times, and what the order in the dump says already.
_LEFT_OUT = {"id", "student_id", "submission_id", "run_id", "folded", "position"}
_TIMES = {"first_seen", "recorded", "decided", "written", "changed", "received", "made", "acted", "published"}
_TIMES |= {"answered", "replaced"}  # who answered says as much; what was replaced holds a time
#: What is the same where it is NULL.
_NOTHING: dict[str, Any] = {
    "aliases": [],
    "cells": [],
    "claim": {},
    "words": {},
    "supplied": {},
    "release": "",
    "files": [],
}


def dump(book: Gradebook) -> dict[str, Any]:
    """Return all of a gradebook but times, the secret and numbers of rows: equal where the content is equal."""
    with book._database.reading() as connection:
        return _content(connection)


def _content(connection: Connection) -> dict[str, Any]:
    """All students and what is known of them; of answers and of files that were handed in, size and SHA-256.

    Submissions are in the order of their digests, runs of their keys, marks as recorded, files by name and time,
    comments by their text; the audit trail, scores and requests of each student in the order in which they grew; an act
    that takes another back names its place among them. Claims, which run out, are left out.
    """
    of_student = {
        table: _grouped(connection, table, "student_id")
        for table in (submissions, deliveries, decisions, comments, audit, scores, requests)
    }
    of_submission = _grouped(connection, runs, "submission_id")
    of_run = {table: _grouped(connection, table, "run_id") for table in (marks, answers)}

    def run(row: dict[str, Any]) -> dict[str, Any]:
        left = [_summary(one["content"]) for one in of_run[answers][row["id"]]]
        ordered = sorted(of_run[marks][row["id"]], key=lambda one: one["position"])
        return {**_plain(row), "answers": left[0] if left else None, "marks": list(map(_plain, ordered))}

    def submission(row: dict[str, Any]) -> dict[str, Any]:
        own = sorted(of_submission[row["id"]], key=lambda one: one["key"])
        return {**_plain(row), "runs": list(map(run, own))}

    def student(row: dict[str, Any]) -> dict[str, Any]:
        def own(table: Table, *order: str) -> list[dict[str, Any]]:
            return sorted(of_student[table][row["id"]], key=lambda one: [one[name] or "" for name in order])

        def in_order(table: Table) -> list[dict[str, Any]]:
            found = sorted(of_student[table][row["id"]], key=lambda one: one["id"])
            place = {one["id"]: number for number, one in enumerate(found)}
            return [{**one, "undoes": place.get(one["undoes"])} if "undoes" in one else one for one in found]

        return {
            **_plain(row),
            "deliveries": [_file(one) for one in own(deliveries, "name", "received", "id")],
            "submissions": list(map(submission, own(submissions, "digest"))),
            "decisions": list(map(_plain, own(decisions, "question", "part"))),
            "comments": list(map(_plain, own(comments, "question", "actor", "text"))),
            **{table.name: list(map(_plain, in_order(table))) for table in (audit, scores, requests)},
        }

    everybody = sorted(_rows(connection, students), key=lambda one: one["folded"])
    given_back = sorted(_rows(connection, publications), key=lambda one: one["id"])
    gone = sorted(_rows(connection, erasures), key=lambda one: one["number"])
    return {
        "students": list(map(student, everybody)),
        "publications": list(map(_plain, given_back)),
        "erasures": [{"actor": one["actor"], "lines": one["lines"]} for one in gone],
    }


def _rows(connection: Connection, table: Table) -> list[dict[str, Any]]:
    return [dict(row) for row in connection.execute(select(table)).mappings()]


def _grouped(connection: Connection, table: Table, column: str) -> dict[int, list[dict[str, Any]]]:
    groups = defaultdict(list)
    for row in _rows(connection, table):
        groups[row[column]].append(row)
    return groups


def _plain(row: dict[str, Any]) -> dict[str, Any]:
    shown = {name: value for name, value in row.items() if name not in _LEFT_OUT | _TIMES}
    return {name: _NOTHING.get(name) if value is None else value for name, value in shown.items()}


def _file(row: dict[str, Any]) -> dict[str, Any]:
    return {**_plain(row), "content": _summary(row["content"])}


def _summary(data: bytes) -> dict[str, Any]:
    return {"bytes": len(data), "sha256": hashlib.sha256(data).hexdigest()}
