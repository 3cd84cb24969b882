"""What students ask to have looked at again, and when feedback was given back."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from sqlalchemy import Connection, insert, select, update

from labcourse.errors import GradebookError
from labcourse.grading.gradebook import deciding, rows, storable
from labcourse.grading.gradebook.database import Database
from labcourse.grading.gradebook.decided import Publication, Request
from labcourse.grading.gradebook.rows import Where
from labcourse.grading.gradebook.tables import publications, requests, students


class Requests:
    """Requests and publications in a gradebook. Each method is one transaction; GradebookError as the gradebook's.

    Parameters
    ----------
    database : the gradebook's, with its tables
    """

    def __init__(self, database: Database) -> None:
        self._database = database

    def make(self, student: str, where: Where, text: str) -> Request:
        """Note beside an answer that a student asks to have it looked at again.

        Raises
        ------
        GradebookError
            If there is no mark for that part, or the request says nothing.
        """
        words = _said(text, "A request says what is to be looked at again; this one is empty.")
        with self._database.writing() as connection:
            run = deciding.run_of(connection, student)
            mark = deciding.mark_of(run, where)
            row = {"question": mark.question, "part": mark.part, "text": words}
            made = insert(requests).values(**row, student_id=run.student_id, made=rows.now())
            number = rows.added(connection, made)
            return _found(connection, requests.c.id == number)[0]

    def answer(self, number: int, actor: str, text: str) -> Request:
        """Answer a request; then it is open no more.

        Raises
        ------
        GradebookError
            If there is no such request, it was answered before (the message says by whom), or the answer is empty.
        """
        words = _said(text, "An answer to a request says something; this one is empty.")
        with self._database.writing() as connection:
            there = _found(connection, requests.c.id == number)
            if not there:
                raise GradebookError(f"There is no request {number}.")
            if not there[0].is_open:
                raise GradebookError(
                    f"Request {number} was answered by {there[0].answered_by} on "
                    f"{there[0].answered:%Y-%m-%d %H:%M} UTC: {there[0].answer!r}"
                )
            values = {"answered_by": storable.text(actor), "answer": words, "answered": rows.now()}
            connection.execute(update(requests).where(requests.c.id == number).values(values))
            return _found(connection, requests.c.id == number)[0]

    def all(self, open_only: bool = False) -> list[Request]:
        """Requests, in the order in which they were made."""
        which = [requests.c.answered.is_(None)] if open_only else []
        with self._database.reading() as connection:
            return _found(connection, *which)

    def publish(self, actor: str, note: str = "", when: datetime | None = None) -> Publication:
        """Note that feedback was given back to the class.

        Parameters
        ----------
        actor, note : who does it, and for the record
        when : UTC; what changes after it is not in what was given back. Now, where it is None
        """
        values = {"actor": storable.text(actor), "note": storable.text(note), "published": when or rows.now()}
        with self._database.writing() as connection:
            connection.execute(insert(publications).values(values))
            return _publications(connection)[-1]

    def publications(self) -> list[Publication]:
        """When feedback was given back, in order."""
        with self._database.reading() as connection:
            return _publications(connection)


def _said(text: str, otherwise: str) -> str:
    words = storable.text(text).strip()
    if not words:
        raise GradebookError(otherwise)
    return words


def _found(connection: Connection, *which: Any) -> list[Request]:
    found = select(requests, students.c.student).join(students).where(*which).order_by(requests.c.id)
    return [
        Request(
            row.id,
            row.student,
            row.question,
            row.part,
            row.text,
            row.made,
            row.answered_by,
            row.answer,
            row.answered,
        )
        for row in connection.execute(found)
    ]


def _publications(connection: Connection) -> list[Publication]:
    found = select(publications).order_by(publications.c.id)
    return [Publication(row.id, row.actor, row.note, row.published) for row in connection.execute(found)]
