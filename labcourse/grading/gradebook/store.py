""":class:`Gradebook`. Each method is one transaction: it is done, or, after an error or a kill, it never was."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import fields
from datetime import UTC, datetime
from pathlib import Path

from sqlalchemy import ColumnElement, select

from labcourse.grading.gradebook import marks, roster, storable
from labcourse.grading.gradebook.database import Database
from labcourse.grading.gradebook.marks import Current
from labcourse.grading.gradebook.persons import Persons, remove
from labcourse.grading.gradebook.records import (
    About,
    Arrival,
    AuditRecord,
    CommentRecord,
    Delivery,
    GivenMark,
    Graded,
    MarkRecord,
    RosterReport,
    StudentRecord,
)
from labcourse.grading.gradebook.scoring import Requests, Scores
from labcourse.student_id import caseless


class Gradebook:
    """A class's submissions, runs, answers, marks, comments, and every change of a mark.

    Several processes and several threads may use it at once. Students are told apart without regard to capitals, as
    :mod:`labcourse.student_id` says; untrusted text is stored as :mod:`labcourse.grading.gradebook.storable` says.

    Parameters
    ----------
    url : a file (SQLite), or ``sqlite:///file``, or ``postgresql://user:password@host/name``; made if it is not there

    Attributes
    ----------
    scores : what scorers do
    requests : what students ask to have looked at again, and when feedback was given back
    persons : a copy of all data of a person, and erasing it

    Raises
    ------
    GradebookError
        If it cannot be opened, holds something else, or was made by an older or a newer version. So do all methods, if
        the database fails.
    """

    def __init__(self, url: str | Path) -> None:
        self._database = Database(url)
        try:
            self._database.prepare()
        except BaseException:
            self._database.close()
            raise
        self.scores = Scores(self._database)
        self.requests = Requests(self._database)
        self.persons = Persons(self._database)

    def __enter__(self) -> Gradebook:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the database."""
        self._database.close()

    def secret(self) -> bytes:
        """Return 32 random bytes, drawn when the gradebook was made; students never see them."""
        with self._database.reading() as session:
            return session.scalars(select(About.secret)).one()

    # --- students -----------------------------------------------------------------------------------------------------

    def import_roster(self, path: Path, again: Collection[str] = ()) -> RosterReport:
        """Take in a class from a CSV, see :mod:`labcourse.grading.gradebook.roster`.

        Students who are not in it stay. Missing columns and empty cells leave existing values unchanged. Students who
        were erased are not taken in, and are reported, unless their ID is in ``again``.

        Raises
        ------
        GradebookError
            If the file as a whole cannot be read; then nothing is taken in.
        """
        table = roster.read(path)
        notes = list(table.notes)
        welcome = set(map(caseless, again))
        gone = self.persons.erased([entry.student for entry in table.entries if caseless(entry.student) not in welcome])
        entries = [entry for entry in table.entries if entry.student not in gone]
        added = changed = 0
        with self._database.writing() as session:
            there = {student.folded: student for student in session.scalars(select(StudentRecord))}
            for entry in entries:
                old = there.get(caseless(entry.student), StudentRecord(entry.student))
                new, more = entry.added_to(old)
                notes += more
                if caseless(entry.student) not in there:
                    marks.add_student(session, new)
                    added += 1
                elif new != old:
                    for field in fields(new):
                        setattr(old, field.name, getattr(new, field.name))
                    changed += 1
        problems = [
            f"{student} was erased on {when:%Y-%m-%d}, and is not taken in. --again {student} takes them in."
            for student, when in gone.items()
        ]
        return RosterReport(added, changed, len(entries) - added - changed, (*table.problems, *problems), tuple(notes))

    def remove(self, student: str) -> StudentRecord:
        """Remove a student who has nothing but their line of the roster, as after a slip in an ID.

        Returns
        -------
        StudentRecord
            What was known of them.

        Raises
        ------
        GradebookError
            If there is no such student, or the gradebook holds anything else of theirs.
        """
        with self._database.writing() as session:
            return remove(session, student)

    def students(self) -> list[StudentRecord]:
        """Return all students, by ID."""
        with self._database.reading() as session:
            students = list(session.scalars(select(StudentRecord)))
        return sorted(students, key=lambda student: caseless(student.student))

    # --- what was handed in -------------------------------------------------------------------------------------------

    def deliver(self, student: str, files: Sequence[Delivery]) -> int:
        """Store files that a student handed in, beside all earlier ones; the student is added if needed.

        A file with the name, the digest and the time of a stored one is the same.

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
        with self._database.writing() as session:
            return marks.put_deliveries(session, marks.student_for(session, student).id, new)

    def give_over(self, source: str, received: datetime, student: str) -> list[str]:
        """Delete what came in a submission from all students but its owner, and return their IDs."""
        student = storable.student(student)
        with self._database.writing() as session:
            owner = marks.student_for(session, student)
            return marks.give_over_deliveries(session, storable.text(source), received.astimezone(UTC), owner.id)

    def delivered(self, student: str) -> list[Delivery]:
        """Return the newest of each file that a student handed in, by name: received last, of equals recorded last."""
        with self._database.reading() as session:
            about = marks.find_student(session, student)
            return [] if about is None else marks.newest_deliveries(session, about.id)

    def content(self, student: str, name: str, digest: str) -> bytes | None:
        """Return what a student handed in under a name, by its digest; None if it is not there."""
        wanted = select(Delivery.content).join(StudentRecord).where(Delivery.name == name, Delivery.digest == digest)
        with self._database.reading() as session:
            return session.scalar(wanted.where(_is(student)).limit(1))

    def received(self, student: str) -> dict[str, Arrival]:
        """Return when a student handed in the notebooks that count, by file name: each, when its content came first."""
        with self._database.reading() as session:
            about = marks.find_student(session, student)
            return {} if about is None else marks.notebooks_received(session, about.id)

    def handed_in(self) -> list[str]:
        """Return the students who handed in files, graded or not."""
        with_files = StudentRecord.id.in_(select(Delivery.student_id))
        with self._database.reading() as session:
            return list(session.scalars(select(StudentRecord.student).where(with_files).order_by(StudentRecord.folded)))

    # --- runs and marks -----------------------------------------------------------------------------------------------

    def record(self, graded: Graded, actor: str, reason: str) -> int:
        """Record a run, and make its marks the student's. Recording the same again changes nothing.

        A run with the key of a stored one replaces it. A mark that a person set stays as long as the answer (white
        space aside) and the points possible stay the same; where they do not, the new mark counts, and the audit trail
        and ``lapsed`` say so. If the same answer comes again, the person's mark counts again.

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
            If it cannot be recorded: an impossible ID, marks that are not finite, another student's key.
        """
        graded = storable.graded(graded)
        with self._database.writing() as session:
            student = marks.student_for(session, graded.run.student)
            before = marks.current_marks(session, student.id)
            run = marks.put_run(session, student.id, graded)
            marks.put_marks(session, run.id, graded.marks)
            marks.make_current(session, run)
            return marks.put_audit(session, Current(student, run, before), *_clean(actor, reason))

    def remark(self, student: str, new: Sequence[MarkRecord], key_digest: str, actor: str, reason: str) -> int:
        """Replace all marks of the student's run that counts; the rest as for :meth:`record`."""
        new = storable.marks(tuple(new))
        with self._database.writing() as session:
            before = marks.current(session, student)
            before.run.key_digest = storable.text(key_digest)
            marks.put_marks(session, before.run.id, new)
            return marks.put_audit(session, before, *_clean(actor, reason))

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
        """Set a person's mark for an answer, in place of the software's; :meth:`record` says how long it holds.

        Parameters
        ----------
        student, question, part : whose, and which
        points : to give
        reason, actor : for the student, and for the audit trail
        expected : the mark that this one is to replace, as it was seen last; None for whatever is there

        Raises
        ------
        GradebookError
            If there is no such mark, there are not so many points for it, or status, points or answer are not the
            expected ones; the message says who gave what, and when.
        """
        where, actor, reason = (question, part), *_clean(actor, reason)
        with self._database.writing() as session:
            before = marks.current(session, student)
            new = marks.decided(before.mark(where), points, reason)
            if new == before.mark(where):
                return 0
            marks.check_expected(session, before, where, expected)
            marks.put_decision(session, before.student.id, GivenMark(new, actor, marks.now()))
            return marks.put_audit(session, before, actor, reason)

    def find(self, key: str) -> Graded | None:
        """Return the run with a content key, and its marks as they are now; it need not be the one that counts."""
        with self._database.reading() as session:
            run = marks.find_run(session, key)
            return None if run is None else marks.graded(session, run)

    def current(self, student: str) -> Graded | None:
        """Return the run of a student that counts, and its marks."""
        with self._database.reading() as session:
            about = marks.find_student(session, student)
            run = None if about is None else marks.current_run(session, about.id)
            return None if run is None else marks.graded(session, run)

    def all_current(self) -> Iterator[Graded]:
        """Yield the runs that count, by student; each is read when it is asked for."""
        for student in self.students():
            graded = self.current(student.student)
            if graded is not None:
                yield graded

    # --- comments and the audit trail ---------------------------------------------------------------------------------

    def comment(self, student: str, text: str, actor: str, question: str | None = None) -> None:
        """Store a person's comment for a student."""
        question = None if question is None else storable.text(question)
        with self._database.writing() as session:
            about = marks.known_student(session, student)
            comment = (about.student, question, storable.text(text), storable.text(actor), marks.now())
            marks.put(session, about.id, CommentRecord(*comment))

    def comments(self, student: str) -> list[CommentRecord]:
        """Return persons' comments for a student, in the order in which they were written."""
        with self._database.reading() as session:
            return marks.read(session, CommentRecord, _is(student))

    def audit(self, student: str | None = None, question: str | None = None) -> list[AuditRecord]:
        """Return every change of a mark, in order; of one student or one question, if given."""
        which = [] if student is None else [_is(student)]
        which += [] if question is None else [AuditRecord.question == storable.text(question)]
        with self._database.reading() as session:
            return marks.read(session, AuditRecord, *which)


def _is(student: str) -> ColumnElement[bool]:
    return StudentRecord.folded == caseless(storable.text(student))


def _clean(actor: str, reason: str) -> tuple[str, str]:
    return storable.text(actor), storable.text(reason)
