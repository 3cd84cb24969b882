""":class:`Gradebook`. Each method is one transaction: it is done, or, after an error or a kill, it never was."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any

from sqlalchemy import insert, select, update

from labcourse.errors import GradebookError
from labcourse.grading.gradebook import deciding, removal, roster, rows, schema, storable
from labcourse.grading.gradebook.database import Database
from labcourse.grading.gradebook.persons import Persons
from labcourse.grading.gradebook.records import (
    Arrival,
    AuditRecord,
    CommentRecord,
    Delivery,
    Graded,
    MarkRecord,
    MarkState,
    RosterReport,
    StudentRecord,
)
from labcourse.grading.gradebook.requests import Requests
from labcourse.grading.gradebook.scores import Scores
from labcourse.grading.gradebook.tables import audit, comments, deliveries, meta, students
from labcourse.student_id import caseless


class Gradebook:
    """A class's submissions, runs, answers, marks, comments, and every change of a mark.

    It may be used by several processes at once, and by several threads. Students are told apart without regard to
    capitals, as :mod:`labcourse.student_id` says; untrusted text is kept as
    :mod:`labcourse.grading.gradebook.storable` says.

    Parameters
    ----------
    url : a file (SQLite), or ``sqlite:///file``, or ``postgresql://user:password@host/name``; made if it is not there,
        migrated if it is older than this software

    Attributes
    ----------
    scores : what scorers do
    requests : what students ask to have looked at again, and when feedback was given back
    persons : all that there is of a person, and erasing it

    Raises
    ------
    GradebookError
        If it cannot be opened, holds something else, or is newer than this software. So do all methods, if the database
        fails.
    """

    def __init__(self, url: str | Path) -> None:
        self._database = Database(url)
        try:
            schema.prepare(self._database)
        except BaseException:
            self._database.close()
            raise
        self.scores = Scores(self._database)
        self.requests = Requests(self._database)
        self.persons = Persons(self._database, self.secret)

    def __enter__(self) -> Gradebook:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the database."""
        self._database.close()

    def secret(self) -> bytes:
        """32 random bytes, drawn when the gradebook was made; it never leaves the trusted side."""
        with self._database.reading() as connection:
            value = connection.scalar(select(meta.c.value).where(meta.c.name == "secret"))
        if value is None:
            raise GradebookError(f"The gradebook {self._database.where} has lost its secret: it is damaged.")
        return bytes(value)

    # --- students -----------------------------------------------------------------------------------------------------

    def import_roster(self, path: Path, again: Collection[str] = ()) -> RosterReport:
        """Take in a class from a CSV, see :mod:`labcourse.grading.gradebook.roster`. Students who are not in it stay.

        So does what it says nothing of: it has no such column, or the cell is empty. Who was erased is not taken in,
        and that is told, unless their ID is in ``again``.

        Raises
        ------
        GradebookError
            If the file as a whole cannot be read; then nothing is taken in.
        """
        found = roster.read(path)
        added = changed = 0
        notes = found.notes()
        gone = self.persons.erased([entry.student for entry in found.entries])
        kept_out = {one: when for one, when in gone.items() if caseless(one) not in set(map(caseless, again))}
        with self._database.writing() as connection:
            there = {row.folded: (row.id, rows.student_record(row)) for row in connection.execute(select(students))}
            for entry in found.entries:
                if entry.student in kept_out:
                    continue
                student_id, record = there.get(caseless(entry.student), (None, StudentRecord(entry.student)))
                new, words = entry.added_to(record)
                notes += words
                if student_id is None:
                    rows.add_student(connection, entry.student, vars(new))
                    added += 1
                elif new != record:
                    connection.execute(update(students).where(students.c.id == student_id).values(vars(new)))
                    changed += 1
        told = "{student} was erased on {when:%Y-%m-%d}, and is not taken in. --again {student} takes them in."
        problems = (*found.problems, *(told.format(student=one, when=when) for one, when in kept_out.items()))
        unchanged = len(found.entries) - len(kept_out) - added - changed
        return RosterReport(added, changed, unchanged, problems, tuple(notes))

    def remove(self, student: str) -> StudentRecord:
        """Take a student out of whom there is nothing but their line of the roster, as a slip in their ID makes one.

        Returns
        -------
        StudentRecord
            What was known of them.

        Raises
        ------
        GradebookError
            If there is no such student, or anything was handed in, graded or said of them.
        """
        with self._database.writing() as connection:
            return removal.remove(connection, storable.text(student))

    def students(self) -> list[StudentRecord]:
        """All students, by ID."""
        with self._database.reading() as connection:
            found = [rows.student_record(row) for row in connection.execute(select(students))]
        return sorted(found, key=lambda one: caseless(one.student))

    # --- what was handed in -------------------------------------------------------------------------------------------

    def deliver(self, student: str, files: Sequence[Delivery]) -> int:
        """Keep files that a student handed in, beside all earlier ones; the student is added if needed.

        What has the name, the digest and the time of one that is there is the same.

        Parameters
        ----------
        student : ID
        files : what was handed in

        Returns
        -------
        int
            How many are new.

        Raises
        ------
        GradebookError
            If the student's ID cannot be one, or a file is too large.
        """
        student = storable.student(student)
        new = list(map(storable.delivery, files))
        with self._database.writing() as connection:
            return rows.put_deliveries(connection, rows.student_for(connection, student), new)

    def give_over(self, source: str, received: datetime, student: str) -> list[str]:
        """Take what came in a submission from all students but its owner, and return their IDs."""
        student = storable.student(student)
        with self._database.writing() as connection:
            owner = rows.student_for(connection, student)
            return rows.give_over_deliveries(connection, storable.text(source), received, owner)

    def delivered(self, student: str) -> list[Delivery]:
        """The newest of each file that a student handed in, by name: received last, of equals recorded last."""
        with self._database.reading() as connection:
            student_id = rows.find_student(connection, storable.text(student))
            return [] if student_id is None else rows.newest_deliveries(connection, student_id)

    def content(self, student: str, name: str, digest: str) -> bytes | None:
        """What a student handed in under a name, by its digest; None if it is not there."""
        with self._database.reading() as connection:
            student_id = rows.find_student(connection, storable.text(student))
            wanted = select(deliveries.c.content).where(
                deliveries.c.student_id == student_id, deliveries.c.name == name, deliveries.c.digest == digest
            )
            found = connection.scalar(wanted.limit(1)) if student_id is not None else None
        return None if found is None else bytes(found)

    def received(self, student: str) -> dict[str, Arrival]:
        """When a student handed in the notebooks that count, by file name: each, when its content came first."""
        with self._database.reading() as connection:
            student_id = rows.find_student(connection, storable.text(student))
            return {} if student_id is None else rows.notebooks_received(connection, student_id)

    def handed_in(self) -> list[str]:
        """Students of whom there are files, graded or not."""
        found = select(students.c.student).where(students.c.id.in_(select(deliveries.c.student_id)))
        with self._database.reading() as connection:
            return list(connection.scalars(found.order_by(students.c.folded)))

    # --- runs and marks -----------------------------------------------------------------------------------------------

    def record(self, graded: Graded, actor: str, reason: str) -> int:
        """Record a run, and let its marks be the student's. Recording the same again changes nothing.

        A run with a key that is there replaces that run. A mark that a person set holds on, as long as what was given
        (white space aside), and the points that there are for it, stay the same; where they do not, the new mark
        counts, and the audit trail and ``lapsed`` say so. Should the same be given again, the person's mark counts
        again.

        Parameters
        ----------
        graded : the run and its marks
        actor, reason : for the audit trail

        Returns
        -------
        int
            How many marks changed: rows in the audit trail.

        Raises
        ------
        GradebookError
            If it is not fit to be recorded: an impossible ID, marks that are not finite, another student's key.
        """
        graded = storable.graded(graded)
        change = _change(actor, reason)
        with self._database.writing() as connection:
            student_id = rows.student_for(connection, graded.run.student)
            before = rows.current_run(connection, student_id)
            there = rows.find_run(connection, graded.run.key)
            run_id = rows.put_run(connection, student_id, graded, there)
            rows.put_marks(connection, run_id, graded.marks)
            rows.make_current(connection, student_id, run_id)
            return rows.put_audit(connection, student_id, before, change)

    def remark(self, student: str, marks: Sequence[MarkRecord], key_digest: str, actor: str, reason: str) -> int:
        """New marks for the run of a student that counts, all of them; the rest as for :meth:`record`."""
        new = storable.marks(tuple(marks))
        change = _change(actor, reason)
        with self._database.writing() as connection:
            before = deciding.run_of(connection, student)
            graded = replace(before.graded, key_digest=storable.text(key_digest))
            rows.put_run(connection, before.student_id, graded, before)
            rows.put_marks(connection, before.run_id, new)
            return rows.put_audit(connection, before.student_id, before, change)

    def set_mark(
        self,
        student: str,
        question: str,
        part: str,
        points: float,
        reason: str,
        actor: str,
        expected: MarkRecord | None = None,
    ) -> int:
        """A person's mark for an answer, in place of the software's; see :meth:`record` for how long it holds.

        Parameters
        ----------
        student, question, part : whose, and which
        points : to give
        reason, actor : for the student, and for the audit trail
        expected : the mark that this one is to replace, as it was seen last; None for whatever is there

        Raises
        ------
        GradebookError
            If there is no such mark, the points are not among those that there are for it, or status, points or answer
            are others by now than expected; the message says who gave what, and when.
        """
        change = _change(actor, reason)
        with self._database.writing() as connection:
            before = deciding.run_of(connection, student)
            mark = deciding.mark_of(before, (question, part))
            deciding.check_points(mark, points)
            new = deciding.decided(mark, points, change.reason)
            if new == mark:
                return 0
            deciding.check_expected(connection, before, mark, expected)
            rows.put_decision(connection, before.student_id, new, change)
            return rows.put_audit(connection, before.student_id, before, change)

    def find(self, key: str) -> Graded | None:
        """The run with a content key, and its marks as they are now; it need not be the one that counts."""
        with self._database.reading() as connection:
            found = rows.find_run(connection, storable.text(key))
        return None if found is None else found.graded

    def current(self, student: str) -> Graded | None:
        """The run of a student that counts, and its marks."""
        with self._database.reading() as connection:
            student_id = rows.find_student(connection, storable.text(student))
            found = None if student_id is None else rows.current_run(connection, student_id)
        return None if found is None else found.graded

    def all_current(self) -> Iterator[Graded]:
        """The runs that count, by student; each is read when it is asked for."""
        for one in self.students():
            graded = self.current(one.student)
            if graded is not None:
                yield graded

    # --- comments ---------------------------------------------------------------------------------------------------

    def comment(self, student: str, text: str, actor: str, question: str | None = None) -> None:
        """A person's word to a student."""
        row = {
            "question": None if question is None else storable.text(question),
            "text": storable.text(text),
            "actor": storable.text(actor),
        }
        with self._database.writing() as connection:
            student_id = rows.known_student(connection, storable.text(student))
            connection.execute(insert(comments).values({**row, "student_id": student_id, "written": rows.now()}))

    def comments(self, student: str) -> list[CommentRecord]:
        """Persons' words to a student, in the order in which they were written."""
        found = (
            select(comments, students.c.student)
            .join(students)
            .where(students.c.folded == caseless(storable.text(student)))
            .order_by(comments.c.id)
        )
        with self._database.reading() as connection:
            return [
                CommentRecord(row.student, row.question, row.text, row.actor, row.written)
                for row in connection.execute(found)
            ]

    def audit(self, student: str | None = None, question: str | None = None) -> list[AuditRecord]:
        """Every change of a mark, in the order in which they were made; of one student or one question, if given."""
        found = select(audit, students.c.student).join(students).order_by(audit.c.id)
        if student is not None:
            found = found.where(students.c.folded == caseless(storable.text(student)))
        if question is not None:
            found = found.where(audit.c.question == storable.text(question))
        with self._database.reading() as connection:
            return [_audit_record(row) for row in connection.execute(found)]


def _change(actor: str, reason: str) -> rows.Change:
    return rows.Change(storable.text(actor), storable.text(reason))


def _audit_record(row: Any) -> AuditRecord:
    before, after = (
        MarkState(*state)
        if (state := [getattr(row, f"{name}_{side}") for name in MarkState.__dataclass_fields__])[0] is not None
        else None
        for side in ("before", "after")
    )
    return AuditRecord(row.student, row.question, row.part, before, after, row.run, row.actor, row.why, row.changed)
