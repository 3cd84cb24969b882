"""All that there is of a person: a copy of it, and erasing it. One transaction to a method."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from datetime import datetime
from typing import Any

from labcourse.errors import GradebookError
from labcourse.grading.gradebook import erasing, storable
from labcourse.grading.gradebook.database import Database
from labcourse.grading.gradebook.erasing import OfOthers
from labcourse.grading.gradebook.records import Delivery, Erased
from labcourse.grading.gradebook.tables import metadata


class Persons:
    """Persons in a gradebook. Each method is one transaction; GradebookError as the gradebook's.

    Parameters
    ----------
    database : the gradebook's, with its tables
    secret : gives the gradebook's secret
    """

    def __init__(self, database: Database, secret: Callable[[], bytes]) -> None:
        self._database, self._secret = database, secret

    def erase(self, student: str, actor: str, of_others: OfOthers | None = None) -> Erased:
        """Erase a person: every row of theirs, and their name in what others are told. See :mod:`.erasing`.

        The file, or the tables of a server, are written anew after it, so that no byte lies on in them.

        Parameters
        ----------
        student, actor : whom, and who does it
        of_others : what becomes of others' runs and files that name them; they stay as they are unless it is given

        Raises
        ------
        GradebookError
            If there is no such student. If the last step fails, the person is erased; the message says what is left.
        """
        secret = self._secret()
        with self._database.writing() as connection:
            whom, who = storable.text(student), storable.text(actor)
            done = erasing.erase(connection, whom, who, secret, of_others or OfOthers())
        try:
            self._database.rebuild([table.name for table in metadata.sorted_tables])
        except GradebookError as error:
            raise GradebookError(
                f"{student!r} is erased from the gradebook's tables, but the space where they stood could not be "
                f"written anew, as the next erasure will do: {error}"
            ) from error
        return done

    def would_be_erased(self, student: str, of_others: OfOthers | None = None) -> Erased:
        """What would become of a person who is erased; all stays as it is. Raises GradebookError if there is none."""
        secret, found = self._secret(), []
        try:
            with self._database.writing() as connection:
                found.append(erasing.erase(connection, storable.text(student), "", secret, of_others or OfOthers()))
                raise _TakenBack
        except _TakenBack:
            return found[0]

    def erased(self, students: Sequence[str]) -> dict[str, datetime]:
        """Of these IDs, those of persons who were erased and have not come into the gradebook again, and when."""
        secret = self._secret()
        with self._database.reading() as connection:
            return erasing.erased(connection, secret, students)

    def everything_of(self, student: str) -> tuple[dict[str, list[dict[str, Any]]], list[Delivery]]:
        """A student's rows, by table, and each version of all that they handed in, in the order in which it came.

        Raises
        ------
        GradebookError
            If there is no such student.
        """
        with self._database.reading() as connection:
            return erasing.everything_of(connection, storable.text(student))


class _TakenBack(Exception):
    """Nothing of a transaction is to stay."""
