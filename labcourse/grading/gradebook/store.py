"""The gradebook in three classes: :class:`Gradebook`, and its parts for scoring and for tokens.

Each method is one transaction: after an error or a kill, nothing of it is stored.

A mark by a person is called a decision. Each act of a scorer is stored and stays, even if it is taken back; it also
writes the decision that follows from it, and the marks that count follow from decisions.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

from sqlalchemy import ColumnElement, Select, and_, delete, exists, insert, or_, select, tuple_, update
from sqlalchemy.orm import Session, aliased, defer

from labcourse import clock
from labcourse.errors import GradebookError
from labcourse.grading.gradebook import roster, storable
from labcourse.grading.gradebook.database import Database
from labcourse.grading.gradebook.persons import (
    Persons,
    add_student,
    erased_students,
    is_student,
    known_student,
    put,
    read,
    remove,
    student_for,
)
from labcourse.grading.gradebook.records import (
    DECIDED,
    NEW,
    About,
    Act,
    Answer,
    Arrival,
    AuditRecord,
    Claim,
    CommentRecord,
    Delivery,
    Excuse,
    GivenMark,
    Graded,
    MarkRow,
    MarkState,
    Publication,
    RosterReport,
    RunRecord,
    Stored,
    StudentRecord,
    Take,
    Token,
    answer_digest,
)
from labcourse.grading.marks import Mark, Status
from labcourse.problems import Where
from labcourse.sentences import sentence
from labcourse.student_id import caseless

NO_LONGER = "The answer, or the points possible, changed: the mark that a person gave no longer holds."
_ROWS = 1000  # that are in memory twice while they are read
_IS_NOTEBOOK = Delivery.name.endswith(".ipynb", autoescape=True)
_WEAK_CLOCKS = (None, "", DECIDED)  # another time replaces a time that is known so


@dataclass(frozen=True)
class Current:
    """A student, their run that counts, and the marks that count."""

    student: StudentRecord
    run: RunRecord
    marks: Mapping[Where, Mark]

    def mark(self, where: Where) -> Mark:
        """Return the mark of an answer. Raises GradebookError if there is none."""
        if where not in self.marks:
            question, part = where
            raise GradebookError(f"{self.run.student!r} has no mark for question {question}, {part}.")
        return self.marks[where]


class Gradebook(AbstractContextManager["Gradebook"]):
    """A class's submissions, runs, answers, marks, comments, and every change of a mark.

    Several processes and several threads may use it at once. IDs of students are compared without regard to capitals
    (:mod:`labcourse.student_id`); untrusted text is cleaned (:mod:`labcourse.grading.gradebook.storable`).

    Parameters
    ----------
    url : a file (SQLite), ``sqlite:///file`` or ``postgresql://user:password@host/name``; made if it does not exist

    Attributes
    ----------
    scores : what scorers do
    tokens : who may open the scoring page from another computer
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
        self.tokens = Tokens(self._database)
        self.persons = Persons(self._database)

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
        """Add and update the students of a class from a CSV, see :mod:`labcourse.grading.gradebook.roster`.

        Students who are not in it stay. Names, numbers and addresses are added. Missing columns and empty cells leave
        existing values unchanged. Students who were erased are left out and reported, unless their ID is in ``again``.

        Raises
        ------
        GradingError
            If the file as a whole cannot be read; then nothing changes.
        """
        entries, problems, notes = roster.read(path)
        allowed = set(map(caseless, again))
        added = changed = 0
        with self._database.writing() as session:
            doubtful = (entry.student for entry in entries.values() if caseless(entry.student) not in allowed)
            erased = erased_students(session, filter(None, doubtful))
            entries = {line: entry for line, entry in entries.items() if entry.student not in erased}
            pairs, unknown = roster.match(entries, session.scalars(select(StudentRecord)))
            for student, entry in pairs:
                notes += roster.add(student, entry)
                if student in session:
                    changed += session.is_modified(student)
                else:
                    add_student(session, student)
                    added += 1
        notes += [
            f"{student} was erased on {when:%Y-%m-%d}, and is not taken in. --again {student} takes them in."
            for student, when in erased.items()
        ]
        return RosterReport(added, changed, len(pairs) - added - changed, (*problems, *unknown), tuple(notes))

    def remove(self, student: str) -> StudentRecord:
        """Remove a student who was only enrolled from a roster, for example with a mistyped ID.

        Returns
        -------
        StudentRecord
            The removed record.

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
        """Store files that a student handed in, beside all earlier ones; add the student if needed.

        A file with the name, the digest and the time of a stored file is the same file.

        Parameters
        ----------
        student : ID
        files : what was handed in

        Returns
        -------
        int
            Number of new files.

        Raises
        ------
        GradebookError
            If the student's ID cannot be one, or a file is too large.
        """
        with self._database.writing() as session:
            about = student_for(session, student)
            return _put_deliveries(session, about.id, [storable.cleaned(file, file.name) for file in files])

    def copy_files(self, student: str, partner: str, source: str, received: datetime) -> None:
        """Store the files of a student's hand-in for a partner, too."""
        with self._database.writing() as session:
            about = student_for(session, partner)
            own = (Delivery.source == source, Delivery.received == received, is_student(student))
            for file in session.scalars(select(Delivery).join(StudentRecord).where(*own).order_by(Delivery.id)).all():
                put(session, about.id, file)

    def delete_of_others(self, source: str, received: datetime, owners: Collection[str]) -> list[str]:
        """Delete the files of a submission from all students but its owners.

        Parameters
        ----------
        source, received : path of the submission in the class's folder, and time of receipt
        owners : IDs of the owners

        Returns
        -------
        list
            IDs of the students who had some of these files.
        """
        same = (Delivery.source == source) & (Delivery.received == received)  # the next week's may have this name, too
        with self._database.writing() as session:
            others = same & Delivery.student_id.not_in([student_for(session, owner).id for owner in owners])
            students = session.scalars(select(StudentRecord.student).join(Delivery).where(others).distinct()).all()
            session.execute(delete(Delivery).where(others))
            return list(students)

    def delivered(self, student: str, notebooks: bool = True) -> list[Delivery]:
        """Return the newest version of each file that a student handed in, by name; with notebooks, or without.

        It is the version that was received last; of equal times, the one that was stored last.
        """
        order = (Delivery.received, Delivery.id)
        ids = select(Delivery.name, Delivery.id).join(StudentRecord).where(is_student(student)).order_by(*order)
        if not notebooks:
            ids = ids.where(~_IS_NOTEBOOK)
        with self._database.reading() as session:
            newest = {name: number for name, number in session.execute(ids)}
            files = session.scalars(select(Delivery).where(Delivery.id.in_(newest.values())))
            return sorted(files, key=lambda file: file.name)

    def stored(self, student: str) -> list[Stored]:
        """Return what is known of all files that a student handed in, in order of storing; not their contents."""
        columns = select(*(getattr(Delivery, name) for name in Stored._fields)).join(StudentRecord)
        with self._database.reading() as session:
            return [Stored(*row) for row in session.execute(columns.where(is_student(student)).order_by(Delivery.id))]

    def contents(self, student: str, digests: Collection[str]) -> dict[str, bytes]:
        """Return the contents of files that a student handed in, by digest."""
        wanted = select(Delivery.digest, Delivery.content).join(StudentRecord).where(is_student(student))
        with self._database.reading() as session:
            rows = session.execute(wanted.where(Delivery.digest.in_(digests)))
            return {digest: content for digest, content in rows}

    def received(self, student: str) -> dict[str, Arrival]:
        """Return file name → when the newest version of each notebook of a student was received.

        It is the time at which this content was received first, so that a notebook is not late for being handed in
        again. A time that only the student's computer wrote counts if the content has no other.
        """
        columns = select(Delivery.name, Delivery.digest, Delivery.received, Delivery.clock)
        files = columns.join(StudentRecord).where(is_student(student), _IS_NOTEBOOK)
        first: dict[tuple[str, str], Arrival] = {}
        last: dict[str, str] = {}
        with self._database.reading() as session:
            for name, digest, when, clock in session.execute(files.order_by(Delivery.received, Delivery.id)):
                if (name, digest) not in first or first[name, digest].clock == "":
                    first[name, digest] = Arrival(when, clock)
                last[name] = digest
        return {name: first[name, digest] for name, digest in sorted(last.items())}

    def handed_in(self) -> list[str]:
        """Return the IDs of the students who handed in files, graded or not, in order."""
        with_files = StudentRecord.id.in_(select(Delivery.student_id))
        with self._database.reading() as session:
            return list(session.scalars(select(StudentRecord.student).where(with_files).order_by(StudentRecord.folded)))

    # --- runs and marks -----------------------------------------------------------------------------------------------

    def record(self, graded: Graded, actor: str, reason: str) -> int:
        """Store a run, and make its marks the student's. Storing the same again changes nothing.

        A run with the key of a stored run replaces it. A person's mark holds while the answer (apart from white space)
        and the possible points stay the same. If they change, the new mark counts, and the audit trail and ``lapsed``
        say so. If the same answer is handed in again, the person's mark counts again.

        Parameters
        ----------
        graded : the run and its marks
        actor, reason : for the audit trail

        Returns
        -------
        int
            Number of marks that changed: rows in the audit trail.

        Raises
        ------
        GradebookError
            If it cannot be stored: an impossible ID, points that are not finite, another student's key.
        """
        with self._database.writing() as session:
            student = student_for(session, graded.run.student)
            before = current_marks(session, student.id)
            run = _put_run(session, student, graded)
            _put_marks(session, run.id, graded.marks)
            if not run.current:
                session.execute(update(RunRecord).where(RunRecord.student_id == student.id).values(current=False))
                run.current = True
            return put_audit(session, Current(student, run, before), actor, reason)

    def set_mark(
        self,
        student: str,
        question: str,
        part: str,
        points: float,
        *,
        reason: str,
        actor: str,
        expected: Mark | None = None,
    ) -> int:
        """Store a person's mark for an answer, which counts in place of the software's; see :meth:`record`.

        Parameters
        ----------
        student, question, part : the student, and the answer
        points : to give
        reason, actor : for the student, and for the audit trail
        expected : the mark to be replaced, as the person saw it; None for any mark

        Returns
        -------
        int
            How many marks changed.

        Raises
        ------
        GradebookError
            If there is no such mark, or the points are below 0 or more than possible; or if status, points or answer
            are not the expected ones: then the message says who gave the present mark, when and why.
        """
        with self._database.writing() as session:
            before = current(session, student)
            mark = before.mark((question, part))
            new = decided(mark, points, reason)
            if new == mark:
                return 0
            check_expected(session, before, mark, expected)
            given = GivenMark(new, actor, clock.now())
            return decide(session, before, new.where, given, actor, reason, mark.given)

    def note_prepared(self, key: str, prepared_from: str) -> None:
        """Store from what the run with a key was prepared last: its :attr:`RunRecord.prepared_from`."""
        with self._database.writing() as session:
            session.execute(update(RunRecord).where(RunRecord.key == key).values(prepared_from=prepared_from))

    def find_made(self, key: str) -> Graded | None:
        """Return the run with a key, and its marks as the software made them; None without one."""
        with self._database.reading() as session:
            run = session.scalar(select(RunRecord).where(RunRecord.key == key))
            made = read_marks(session, RunRecord.key == key)
            marks = tuple(mark for _student, mark, _given in made)
            return None if run is None else Graded(run, marks, run.key_digest)

    def given_marks(self, student: str) -> dict[tuple[Where, str], GivenMark]:
        """Return what persons gave for a student's answers: (question, part) and digest of the answer → mark."""
        with self._database.reading() as session:
            given = session.scalars(select(GivenMark).join(StudentRecord).where(is_student(student)))
            return {(one.mark.where, one.answer): one for one in given}

    def run_of(self, ran: str) -> RunRecord | None:
        """Return a run of equal content, whoever handed it in; None if nothing equal was run."""
        with self._database.reading() as session:
            return session.scalar(select(RunRecord).where(RunRecord.ran == ran).order_by(RunRecord.id).limit(1))

    def keep(self, graded: Graded) -> None:
        """Store a run and its marks beside the run that counts. Raises GradebookError as :meth:`record` does."""
        with self._database.writing() as session:
            run = _put_run(session, student_for(session, graded.run.student), graded)
            _put_marks(session, run.id, graded.marks)

    def current(self, student: str) -> Graded | None:
        """Return the run of a student that counts, and its marks; None if nothing was graded."""
        with self._database.reading() as session:
            run = current_run(session, student)
            return None if run is None else _graded(session, run)

    def all_current(self) -> Iterator[Graded]:
        """Yield the runs that count, by student; each is read when the loop comes to it."""
        for student in self.students():
            graded = self.current(student.student)
            if graded is not None:
                yield graded

    def versions(self) -> dict[str, tuple[Mapping[str, Any], ...]]:
        """Return the versions that each student's run that counts was chosen among, by ID."""
        columns = select(StudentRecord.student, RunRecord.versions).join(RunRecord).where(RunRecord.current)
        with self._database.reading() as session:
            rows = session.execute(columns.order_by(StudentRecord.folded))
            return {student: versions for student, versions in rows}

    # --- excuses ------------------------------------------------------------------------------------------------------

    def excuse(self, student: str, notebooks: Iterable[str], *, reason: str, actor: str, excused: bool = True) -> None:
        """Excuse a student from notebooks, or take that back.

        Parameters
        ----------
        student : ID
        notebooks : names without ending
        reason, actor : why, and who decides it
        excused : whether they are excused from now on

        Raises
        ------
        GradebookError
            If there is no such student, or no reason is given.
        """
        reason = _not_empty(reason, "The reason is empty: say why.")
        with self._database.writing() as session:
            about = known_student(session, student)
            for name in notebooks:
                put(session, about.id, Excuse(NEW, about.student, name, excused, actor, reason, clock.now()))

    def excuses(self, student: str) -> dict[str, Excuse]:
        """Return the excuses of a student that hold now: notebook without ending → the act."""
        with self._database.reading() as session:
            last = {act.notebook: act for act in read(session, Excuse, is_student(student))}
        return {name: act for name, act in last.items() if act.excused}

    # --- versions that are taken --------------------------------------------------------------------------------------

    def take(
        self, student: str, notebook: str, source: str, received: datetime | None, *, reason: str, actor: str
    ) -> None:
        """Take a version of a notebook, whatever the rule says, or let the rule decide again.

        Parameters
        ----------
        student, notebook : ID, and name without ending
        source, received : of the hand-in with the version; "" and None to let the rule decide again
        reason, actor : why, and who decides it

        Raises
        ------
        GradebookError
            If there is no such student, or no reason is given.
        """
        reason = _not_empty(reason, "The reason is empty: say why.")
        with self._database.writing() as session:
            about = known_student(session, student)
            put(session, about.id, Take(NEW, about.student, notebook, source, received, actor, reason, clock.now()))

    def takes(self, student: str) -> dict[str, Take]:
        """Return what was taken of a student and counts now: notebook without ending → the act."""
        with self._database.reading() as session:
            last = {act.notebook: act for act in read(session, Take, is_student(student))}
        return {name: act for name, act in last.items() if act.received is not None}

    def decisions(self, student: str | None = None) -> list[Excuse | Take]:
        """Return every act that excuses a student, takes a version, or takes that back; of one student, if given."""
        which = [] if student is None else [is_student(student)]
        with self._database.reading() as session:
            return [*read(session, Excuse, *which), *read(session, Take, *which)]

    # --- comments, publications and the audit trail -------------------------------------------------------------------

    def comment(
        self,
        student: str,
        text: str,
        actor: str,
        question: str | None = None,
        part: str | None = None,
        *,
        asks: bool = False,
    ) -> None:
        """Store a person's comment for a student, or a student's request to look at an answer again.

        Parameters
        ----------
        student, text, actor : for whom, what, and who writes it down
        question, part : what it is about
        asks : whether it is a request, which is open until a person marks or comments on this answer

        Raises
        ------
        GradebookError
            If the text is empty, or there is no such student; or no mark for the part, if it is a request or names one.
        """
        text = _not_empty(text, "The text is empty: say what it is about.")
        with self._database.writing() as session:
            about = known_student(session, student)
            if asks or part is not None:
                current(session, student).mark((question or "", part or ""))
            put(session, about.id, CommentRecord(about.student, question, text, actor, clock.now(), part, asks))

    def comments(self, student: str | None = None) -> list[CommentRecord]:
        """Return comments and requests in the order in which they were written; of one student, if given."""
        with self._database.reading() as session:
            found = read(session, CommentRecord, *([] if student is None else [is_student(student)]))
            waiting = set(session.scalars(_open_requests()))
        for comment in found:
            comment.is_open = comment.id in waiting
        return found

    def publish(
        self, actor: str, note: str = "", *, when: datetime | None = None, notebooks: Iterable[str] = ()
    ) -> Publication:
        """Store that feedback was given back to the class.

        Parameters
        ----------
        actor, note : who does it, and a note for the record
        when : UTC; changes after it are not in what was given back. None for now
        notebooks : names, without ending, of the notebooks of which feedback is given back; none for all
        """
        publication = Publication(NEW, actor, note, when or clock.now(), tuple(notebooks))
        publication = storable.cleaned(publication, "The note")
        with self._database.writing() as session:
            session.add(publication)
        return publication

    def unpublish(self) -> Publication:
        """Delete the last publication, and return it. Raises GradebookError if feedback was never given back."""
        with self._database.writing() as session:
            if (last := session.scalar(select(Publication).order_by(Publication.number.desc()).limit(1))) is None:
                raise GradebookError("Feedback was not given back yet: there is nothing to take back.")
            session.delete(last)
        return last

    def publications(self) -> list[Publication]:
        """Return the publications of feedback, in order."""
        with self._database.reading() as session:
            return list(session.scalars(select(Publication).order_by(Publication.number)))

    def audit(
        self, student: str | None = None, question: str | None = None, since: datetime | None = None
    ) -> list[AuditRecord]:
        """Return every change of a mark, in order; of one student or one question, or after a time, if given."""
        which: list[Any] = [] if student is None else [is_student(student)]
        which += [] if question is None else [AuditRecord.question == question]
        which += [] if since is None else [AuditRecord.when > since]
        with self._database.reading() as session:
            return read(session, AuditRecord, *which)


# --- inside a transaction ---------------------------------------------------------------------------------------------


def _open_requests() -> Select[int]:
    """Select the IDs of requests after which nobody marked or commented on the answer. A later request is no comment.

    Taking a mark back restores the mark before it with its old time, so the request is open again.
    """
    asked: Any = CommentRecord
    later: Any = aliased(CommentRecord)
    given: Any = GivenMark

    def same_answer(other: Any) -> ColumnElement[bool]:
        return and_(*(getattr(other, name) == getattr(asked, name) for name in ("student_id", "question", "part")))

    is_marked = exists().where(same_answer(given), given.when > asked.when)
    is_commented = exists().where(same_answer(later), ~later.asks, later.id > asked.id)
    return select(asked.id).where(asked.asks, ~is_marked, ~is_commented)


def _put_deliveries(session: Session, student_id: int, new: Sequence[Delivery]) -> int:
    """Store the files of a student that are not stored yet, in place of those that they replace; return how many.

    A stored file is deleted if the new one has another content but the same name, time and source: an instructor
    decided that another file counts. It is also deleted if the new one has another time but the same content and
    source, and an instructor decided one of the two times, or only the student's computer wrote the old one.
    """
    wanted = {(file.name, file.digest, file.received): file for file in new}
    same_time = {(file.name, file.received, file.source) for file in new}
    same_content = {(file.name, file.digest, file.source): (file.received, file.clock) for file in new}

    given_for = {key: file.assignment for key, file in wanted.items() if file.assignment}

    def is_replaced(old: Delivery) -> bool:
        """Return whether a new file replaces a stored one."""
        received, clock = same_content.get((old.name, old.digest, old.source), (old.received, old.clock))
        redated = (clock != old.clock and old.clock in _WEAK_CLOCKS) or (clock == DECIDED and received != old.received)
        came_with_it = (old.name, old.received, old.source) in same_time
        return redated or (came_with_it and (old.name, old.digest, old.received) not in wanted)

    files = select(Delivery).where(Delivery.student_id == student_id).options(defer(Delivery.content))
    stored = list(session.scalars(files))
    replaced = {old.id for old in stored if is_replaced(old)}
    session.execute(delete(Delivery).where(Delivery.id.in_(replaced)))
    for old in stored:
        if old.id not in replaced:
            key = old.name, old.digest, old.received
            wanted.pop(key, None)
            old.assignment = given_for.get(key, old.assignment)
    for file in wanted.values():
        put(session, student_id, file)
    return len(wanted)


def _put_run(session: Session, student: StudentRecord, graded: Graded) -> RunRecord:
    """Store a run, or update the stored run with its key; return the stored run. Raises GradebookError."""
    run = storable.cleaned(graded.run, f"The run of {student.student}")
    run.student = storable.student(graded.run.student)
    run.key_digest = graded.key_digest
    earlier = session.scalar(select(RunRecord).where(RunRecord.key == run.key))
    if earlier is None:
        run.student_id, run.current = student.id, False
    elif earlier.student_id == student.id:
        run.id = earlier.id
    else:
        raise GradebookError(
            f"The run {run.key} of {run.student!r} has the key of a run of {earlier.student!r}: a key should depend on "
            "the student, too."
        )
    stored = session.merge(run)
    if session.is_modified(stored):
        stored.recorded = clock.now()
    session.flush()
    return stored


def _put_marks(session: Session, run_id: int, new: Iterable[Mark]) -> None:
    """Replace the software's marks of a run. If a new one is a person's, the old one stays. Raises GradebookError."""
    stored = [mark for _student, mark, _given in read_marks(session, RunRecord.id == run_id)]
    beneath = {mark.where: mark for mark in stored}
    wanted: dict[Where, Mark] = {}
    for mark in new:
        name = f"Question {mark.question}, {mark.part}"
        clean = storable.cleaned(mark, name)
        if clean.where in wanted:
            raise GradebookError(f"{name} has two marks.")
        is_manual = clean.status == Status.BY_A_PERSON
        if is_manual and clean.where not in beneath:
            raise GradebookError(f"{name}: a person's mark is set by set_mark only.")
        wanted[clean.where] = beneath[clean.where] if is_manual else clean
    if list(wanted.values()) != stored:
        session.execute(delete(MarkRow).where(MarkRow.run_id == run_id))
        rows = [
            {"run_id": run_id, "position": place, "answer": answer_digest(mark.given), **vars(mark)}
            for place, mark in enumerate(wanted.values())
        ]
        if rows:
            session.execute(insert(MarkRow), rows)


def _graded(session: Session, run: RunRecord) -> Graded:
    """Return a run with its marks as they count now."""
    made = read_marks(session, RunRecord.id == run.id)
    counting = tuple(with_decision(mark, given) for _student, mark, given in made)
    own = select(GivenMark).where(GivenMark.student_id == run.student_id).order_by(GivenMark.when)
    last = {given.mark.where: given for given in session.scalars(own)}
    lapsed = (last[mark.where] for mark in counting if mark.where in last and mark.status != Status.BY_A_PERSON)
    return Graded(run, counting, run.key_digest, tuple(lapsed))


# --- the marks that count ---------------------------------------------------------------------------------------------


def current_run(session: Session, student: str) -> RunRecord | None:
    """Return the run of a student that counts; None if nothing was graded."""
    return session.scalar(select(RunRecord).join(StudentRecord).where(is_student(student), RunRecord.current))


def current(session: Session, student: str) -> Current:
    """Return the run and the marks of a student that count. Raises GradebookError if there are none."""
    about, run = known_student(session, student), current_run(session, student)
    if run is None:
        raise GradebookError(f"Nothing of {student!r} has been graded.")
    return Current(about, run, current_marks(session, about.id))


def current_marks(session: Session, student_id: int) -> dict[Where, Mark]:
    """Return (question, part) → mark that counts for a student; nothing without a run."""
    made = read_marks(session, RunRecord.student_id == student_id, RunRecord.current)
    return {mark.where: with_decision(mark, given) for _student, mark, given in made}


def read_marks(session: Session, *which: Any) -> Iterator[tuple[str, Mark, GivenMark | None]]:
    """Yield marks in order, each with its student's ID, and with the decision on it, even one that does not hold."""
    made: Any = MarkRow
    given: Any = GivenMark
    same = and_(
        given.student_id == RunRecord.student_id,
        *(getattr(given, name) == getattr(made, name) for name in ("question", "part", "answer")),
    )
    columns = select(StudentRecord.student, MarkRow.mark, GivenMark).select_from(StudentRecord)
    statement = columns.join(RunRecord).join(MarkRow).outerjoin(GivenMark, same).where(*which)
    rows = session.execute(statement.order_by(StudentRecord.folded, MarkRow.position))
    yield from ((student, mark, decision) for student, mark, decision in rows.yield_per(_ROWS))


def with_decision(mark: Mark, decision: GivenMark | None) -> Mark:
    """Return the mark that counts: that of the decision if it holds, else the software's."""
    return replace(decision.mark, given=mark.given) if decision and holds(decision.mark, mark) else mark


def with_given(marks: Iterable[Mark], given: Mapping[tuple[Where, str], GivenMark]) -> list[Mark]:
    """Return marks that the software made, with those that persons gave (from :meth:`Gradebook.given_marks`)."""
    return [with_decision(mark, given.get((mark.where, answer_digest(mark.given)))) for mark in marks]


def holds(decision: Mark | Act, mark: Mark) -> bool:
    """Return whether a decision holds for a mark: it is on the same answer, out of the same possible points."""
    return decision.out_of == mark.out_of and same_answer(decision.given, mark.given)


def same_answer(first: str, second: str) -> bool:
    """Return whether two answers are equal but for white space and the composition of accents."""
    return first == second or answer_digest(first) == answer_digest(second)


# --- the audit trail --------------------------------------------------------------------------------------------------


def put_audit(session: Session, before: Current, actor: str, reason: str, *, is_decided: bool = False) -> int:
    """Store a row for each mark that changed; return the number of rows.

    Parameters
    ----------
    before : the student, the run that counts now, and the marks that counted before
    actor, reason : who changed them, and why
    is_decided : a person decided it: no mark lapses by itself
    """
    new_states = _states(current_marks(session, before.student.id))
    old_states = _states(before.marks) or _taken_over(session, before.student.id, new_states)
    same = {"student_id": before.student.id, "run": before.run.key, "actor": actor, "when": clock.now()}
    rows = []
    for question, part in sorted(old_states.keys() | new_states.keys()):
        old, new = old_states.get((question, part)), new_states.get((question, part))
        if old != new:
            lapsed = not is_decided and _is_manual(old) and not _is_manual(new)
            why = f"{reason} {NO_LONGER if lapsed else ''}".strip()
            rows.append({**same, "question": question, "part": part, "before": old, "after": new, "reason": why})
    if rows:
        session.execute(insert(AuditRecord), rows)
    return len(rows)


def _states(marks: Mapping[Where, Mark]) -> dict[Where, MarkState]:
    """Return (question, part) → what the audit trail stores of the mark."""
    return {where: MarkState(mark.status, mark.points, mark.out_of, mark.reason) for where, mark in marks.items()}


def _taken_over(session: Session, student_id: int, new: Mapping[Where, MarkState]) -> dict[Where, MarkState]:
    """Return the marks that a student had in the gradebook of an earlier version, as its audit trail has them.

    A mark that is the same now has the present reason, which may have been a text and be a problem now.
    """
    last = {entry.where: entry.after for entry in read(session, AuditRecord, AuditRecord.student_id == student_id)}
    marks = {where: state for where, state in last.items() if state is not None}
    same = {where for where in marks.keys() & new if replace(marks[where], reason=new[where].reason) == new[where]}
    return {where: new[where] if where in same else state for where, state in marks.items()}


def _is_manual(state: MarkState | None) -> bool:
    return state is not None and state.status == Status.BY_A_PERSON


# --- a person's decision ----------------------------------------------------------------------------------------------


def decided(mark: Mark, points: float, reason: str) -> Mark:
    """Return a mark with a person's points. Raises GradebookError if they are below 0 or more than possible."""
    if not 0 <= points <= mark.out_of:  # not a number is refused, too
        raise GradebookError(
            f"Question {mark.question}, {mark.part}: give 0 to {mark.out_of:g} points, not {points:g}."
        )
    return replace(mark, status=Status.BY_A_PERSON, points=float(points) + 0.0, reason=storable.text(reason))


def decide(
    session: Session, before: Current, where: Where, given: GivenMark | None, actor: str, reason: str, answer: str
) -> int:
    """Store a person's mark; None deletes the one on this answer. Write the audit trail.

    Returns
    -------
    int
        How many marks changed.
    """
    if given is not None:
        given.student_id = before.student.id
        session.merge(given)
    elif (earlier := _given_for(session, before, where, answer)) is not None:
        session.delete(earlier)
    return put_audit(session, before, actor, reason, is_decided=True)


def _given_for(session: Session, before: Current, where: Where, answer: str) -> GivenMark | None:
    """Return the mark that a person gave for an answer of a student; None without one."""
    return session.get(GivenMark, (before.student.id, answer_digest(answer), *where))


def check_expected(session: Session, before: Current, mark: Mark, expected: Mark | None) -> None:
    """Raise GradebookError if a mark has not the status, points and answer of the expected one (None: any)."""
    if expected is None:
        return
    same = (mark.status, mark.points) == (expected.status, expected.points)
    if not same or not same_answer(mark.given, expected.given):
        raise _changed_error(session, before, mark)


def _changed_error(session: Session, before: Current, mark: Mark) -> GradebookError:
    """Return the error that a mark changed since a person saw it: who changed it, when, and why."""
    which = (AuditRecord.question == mark.question, AuditRecord.part == mark.part)
    last = read(session, AuditRecord, AuditRecord.student_id == before.student.id, *which)[-1]
    why, points = sentence(mark.reason), "1 point" if mark.points == 1 else f"{mark.points:g} points"
    return GradebookError(
        f"Question {mark.question}, {mark.part}: {before.run.student!r} has {points} ({mark.status}) by "
        f"now, from {last.actor}, {last.when:%Y-%m-%d %H:%M} UTC: {why!r}. Nothing was changed. If that is to be "
        f"replaced, say that you expect {mark.points:g} (mark --expect {mark.points:g})."
    )


# --- scoring ----------------------------------------------------------------------------------------------------------


class Scores:
    """Scoring in a gradebook. Each method is one transaction, and raises GradebookError if the database fails.

    Parameters
    ----------
    database : the gradebook's, with its tables
    """

    def __init__(self, database: Database) -> None:
        self._database = database

    # --- reading ------------------------------------------------------------------------------------------------------

    def answers(self, parts: Collection[Where] | None = None) -> list[Answer]:
        """Return all students' answers that a person reads or has marked, by student; of ``parts``, or of all parts.

        Answers that are missing or marked by the software alone are left out.
        """
        with self._database.reading() as session:
            return _answers(session, parts)

    def any_answers(self, where: Where) -> list[Answer]:
        """Return all students' answers to a part, by student, whoever marks them; missing ones, too."""
        with self._database.reading() as session:
            return _answers(session, [where], any_state=True)

    def acts(self, parts: Collection[Where] | None = None, actor: str | None = None) -> list[Act]:
        """Return what scorers did, in order; also acts that were taken back, and the acts that took them back.

        Parameters
        ----------
        parts : only of these; of all if it is None
        actor : only by this scorer; by all if it is None
        """
        by = [] if actor is None else [Act.actor == actor]
        with self._database.reading() as session:
            return read(session, Act, *_among(Act, parts), *by)

    # --- deciding -----------------------------------------------------------------------------------------------------

    def give(
        self,
        student: str,
        where: Where,
        points: float,
        actor: str,
        *,
        level: int | None = None,
        remark: str = "",
        meaning: str = "",
        expected: Mark | None = None,
    ) -> Act:
        """Give points for an answer.

        Parameters
        ----------
        student, where : the student, and the answer
        points, level : what is given; the level, if any, is stored beside the points
        actor : the scorer
        remark : for the student
        meaning : what the level means; the student reads it as the reason if there is no remark
        expected : the mark as the scorer saw it; None for any mark

        Raises
        ------
        GradebookError
            As for :meth:`Gradebook.set_mark`; then nothing is stored.
        """
        with self._database.writing() as session:
            before = current(session, student)
            mark = before.mark(where)
            new = decided(mark, points, remark or meaning)
            check_expected(session, before, mark, expected)
            reason = "scored" if level is None else f"level {level}"
            given = GivenMark(new, actor, clock.now())
            done = {"remark": remark, "level": level, "points": new.points, "when": given.when}
            return _act(session, before, given, reason, where, actor, **done)

    def ask(self, student: str, where: Where, actor: str, *, remark: str = "", expected: Mark | None = None) -> Act:
        """Ask the instructor about an answer: it waits until somebody decides, even if it was decided before.

        Parameters and errors as for :meth:`give`; the remark is for the instructor.
        """
        with self._database.writing() as session:
            before = current(session, student)
            check_expected(session, before, before.mark(where), expected)
            return _act(session, before, None, "the instructor is asked", where, actor, remark=remark, referred=True)

    def undo(self, number: int, actor: str) -> Act:
        """Take an act of a scorer (``actor``) back, by its number: the mark that counted before counts again.

        Raises
        ------
        GradebookError
            If there is no such act of this scorer, it was taken back before, or somebody decided since.
        """
        with self._database.writing() as session:
            act = _own_act(session, number, storable.text(actor))
            before = current(session, act.student)
            if not act.still_stands(_given_for(session, before, act.where, act.given)):
                raise _changed_error(session, before, before.mark(act.where))
            earlier = act.replaced and GivenMark.from_json(**act.replaced)
            return _act(
                session, before, earlier, f"taken back: act {number}", act.where, actor, given=act.given, undoes=number
            )

    # --- who reads what -----------------------------------------------------------------------------------------------

    def claim(self, order: Sequence[str], where: Where, actor: str, seconds: float) -> str | None:
        """Claim for a scorer the first answer, in an order of students, that waits for a scorer and that nobody reads.

        Nobody else is given it until the claim runs out. What the scorer had claimed before is released.

        Parameters
        ----------
        order : IDs of students
        where : the question and the part
        actor, seconds : the scorer, and how long the claim lasts, s

        Returns
        -------
        str or None
            ID of the student; None if no answer is left.
        """
        with self._database.writing() as session:
            _let_go(session, actor)
            taken = _claimed(session, where)
            free = {
                caseless(answer.student): answer.student
                for answer in _answers(session, [where])
                if answer.student not in taken and answer.mark.status == Status.FOR_A_PERSON and not answer.referred
            }
            student = next((free[name] for name in map(caseless, order) if name in free), None)
            if student is not None:
                _claim(session, student, where, actor, seconds)
            return student

    def hold(self, student: str, where: Where, actor: str, seconds: float) -> str | None:
        """Claim an answer that a scorer has opened, in any state, for some seconds; what they had claimed is released.

        Returns
        -------
        str or None
            Another scorer, who is reading it already; None if it is claimed now.
        """
        with self._database.writing() as session:
            _let_go(session, actor)
            return _claim(session, student, where, actor, seconds)

    def claimed(self, where: Where) -> dict[str, tuple[str, datetime]]:
        """Return student → who is reading their answer to a part, and until when (UTC)."""
        with self._database.reading() as session:
            return _claimed(session, where)

    def let_go(self, actor: str) -> None:
        """Release what a scorer has claimed."""
        with self._database.writing() as session:
            _let_go(session, actor)


def standing(acts: Sequence[Act]) -> list[Act]:
    """Return the acts that were not taken back and that do not take back others."""
    undone = {act.undoes for act in acts if act.undoes is not None}
    return [act for act in acts if act.undoes is None and act.number not in undone]


def _act(
    session: Session, before: Current, decision: GivenMark | None, reason: str, where: Where, actor: str, **more: Any
) -> Act:
    """Store what a scorer did, the decision that follows from it, and the audit trail; return the act.

    Parameters
    ----------
    before : what counts for the student now
    decision : the mark that follows from it; None leaves the software's mark
    reason : for the audit trail, if there is no remark
    where, actor, more : fields of the act
    """
    mark = before.mark(where)
    usual = {"level": None, "points": None, "remark": "", "referred": False, "undoes": None, "when": clock.now()}
    fields: dict[str, Any] = {**usual, "out_of": mark.out_of, "given": mark.given, **more}
    act = Act(NEW, before.student.student, *where, actor, **fields)
    replaced = _given_for(session, before, where, act.given)
    act = put(session, before.student.id, act, replaced=replaced and replaced.as_json())
    decide(session, before, where, decision, actor, act.remark or reason, act.given)
    return act


def _own_act(session: Session, number: int, actor: str) -> Act:
    """Return an act of a scorer. Raises GradebookError if they cannot take it back."""
    acts = read(session, Act, (Act.number == number) | (Act.undoes == number))
    if not acts or acts[0].undoes is not None or acts[0].actor != actor:
        raise GradebookError(f"{actor} has no act {number} to take back.")
    if len(acts) > 1:
        raise GradebookError(f"Act {number} was taken back before.")
    return acts[0]


# --- answers ----------------------------------------------------------------------------------------------------------


def _answers(session: Session, parts: Collection[Where] | None, any_state: bool = False) -> list[Answer]:
    """Return the answers of these parts or of all: those that a person reads or has marked, or those in any state."""
    done: dict[tuple[str, Where], list[Act]] = defaultdict(list)
    for act in standing(read(session, Act, *_among(Act, parts))):
        done[act.student, act.where].append(act)
    answers, among = [], _among(MarkRow, parts)
    if not any_state:  # most marks of a class are no such answers
        made: Any = MarkRow
        of_answer = and_(*(getattr(Act, name) == getattr(made, name) for name in ("question", "part")))
        acted = exists().where(Act.student_id == RunRecord.student_id, of_answer)
        among.append(or_(made.status == Status.FOR_A_PERSON, GivenMark.student_id.is_not(None), acted))
    for student, mark, given in read_marks(session, RunRecord.current, *among):
        own = given if given is not None and holds(given.mark, mark) else None
        acts = tuple(act for act in done[student, mark.where] if holds(act, mark))
        if any_state or mark.status == Status.FOR_A_PERSON or own is not None or acts:
            answers.append(Answer(student, *mark.where, with_decision(mark, own), acts, own, mark))
    return answers


def _among(table: Any, parts: Collection[Where] | None) -> list[Any]:
    """Return the conditions that a row is on one of ``parts``; no conditions if it is None."""
    return [] if parts is None else [tuple_(table.question, table.part).in_([tuple(where) for where in parts])]


# --- claims -----------------------------------------------------------------------------------------------------------


def _claimed(session: Session, where: Where) -> dict[str, tuple[str, datetime]]:
    """Return student → who is reading their answer to a part, and until when (UTC)."""
    claims = select(StudentRecord.student, Claim.actor, Claim.until).join(Claim)
    rows = session.execute(claims.where(*_among(Claim, [where]), Claim.until > clock.now()))
    return {student: (actor, until) for student, actor, until in rows}


def _claim(session: Session, student: str, where: Where, actor: str, seconds: float) -> str | None:
    """Store a claim that lasts some seconds, and return None; if the answer is claimed already, return the scorer."""
    about = known_student(session, student)
    claimed = session.get(Claim, (about.id, *where))
    if claimed is not None:
        return claimed.actor
    session.add(Claim(about.id, *where, actor, clock.now() + timedelta(seconds=seconds)))
    return None


def _let_go(session: Session, actor: str) -> None:
    """Delete the claims of a scorer, and all that have run out."""
    session.execute(delete(Claim).where((Claim.actor == actor) | (Claim.until <= clock.now())))


# --- tokens ----------------------------------------------------------------------------------------------------------


class Tokens:
    """Who may open the scoring page from another computer. Each method is one transaction.

    Names of scorers are compared without regard to capitals.

    Parameters
    ----------
    database : the gradebook's, with its tables
    """

    def __init__(self, database: Database) -> None:
        self._database = database

    def find(self, digest: str) -> Token | None:
        """Return the token with a digest, valid or not; None if there is none."""
        with self._database.reading() as session:
            return session.scalar(select(Token).where(Token.digest == digest))

    def valid(self) -> list[Token]:
        """Return the tokens that are neither revoked nor too old, in the order in which they were made."""
        with self._database.reading() as session:
            return _valid_tokens(session)

    def replace(self, actor: str, digest: str) -> Token:
        """Store the digest of a scorer's new token, and revoke the former one."""
        token = storable.cleaned(Token(actor, digest, clock.now()), "The address")
        with self._database.writing() as session:
            _revoke(session, token.actor)
            session.add(token)
        return token

    def revoke(self, actor: str) -> None:
        """Revoke a scorer's token. Raises GradebookError if there is none."""
        with self._database.writing() as session:
            if not _revoke(session, storable.text(actor)):
                names = ", ".join(token.actor for token in _valid_tokens(session)) or "nobody"
                raise GradebookError(f"{storable.text(actor)} has no address. These have one: {names}.")


def _valid_tokens(session: Session) -> list[Token]:
    """Return the valid tokens, in the order in which they were made."""
    return [token for token in session.scalars(select(Token).order_by(Token.number)) if token.is_valid]


def _revoke(session: Session, actor: str) -> bool:
    """Revoke a scorer's token; return whether there was one."""
    own = [token for token in _valid_tokens(session) if token.actor.casefold() == actor.casefold()]
    for token in own:
        token.revoked = clock.now()
    return bool(own)


def _not_empty(given: str, otherwise: str) -> str:
    """Return a text cleaned, without white space around it. Raises GradebookError(``otherwise``) if it is empty."""
    text = storable.text(given).strip()
    if not text:
        raise GradebookError(otherwise)
    return text
