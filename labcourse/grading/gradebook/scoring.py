"""What scorers do, what students ask to have looked at again, and when feedback was given back.

Nothing is lost: each act of a scorer stays, also one that was taken back. What counts follows from the acts and from
the decisions that they wrote.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Collection, Sequence
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from typing import Any

from sqlalchemy import delete, select, tuple_
from sqlalchemy.orm import Session

from labcourse.errors import GradebookError
from labcourse.grading.gradebook import marks, storable
from labcourse.grading.gradebook.database import Database
from labcourse.grading.gradebook.marks import Current
from labcourse.grading.gradebook.records import (
    FOR_A_PERSON,
    NEW,
    Act,
    Answer,
    Claim,
    GivenMark,
    Mark,
    MarkRecord,
    Publication,
    Request,
    RunRecord,
    StudentRecord,
    Where,
)
from labcourse.student_id import caseless


class Scores:
    """Scoring in a gradebook. Each method is one transaction; all raise GradebookError where the database fails.

    Parameters
    ----------
    database : the gradebook's, with its tables
    """

    def __init__(self, database: Database) -> None:
        self._database = database

    # --- reading ------------------------------------------------------------------------------------------------------

    def answers(self, parts: Collection[Where] | None = None) -> list[Answer]:
        """Return everybody's answers that a person reads or has marked, by student; of these parts, or all.

        Blank answers are not among them: there is nothing to do.
        """
        with self._database.reading() as session:
            return _answers(session, parts)

    def acts(self, parts: Collection[Where] | None = None, actor: str | None = None) -> list[Act]:
        """Return what scorers did, in order, with acts that were taken back and the acts that took them back.

        Parameters
        ----------
        parts : of these only; of all where it is None
        actor : by this scorer only; by all where it is None
        """
        by = [] if actor is None else [Act.actor == storable.text(actor)]
        with self._database.reading() as session:
            return marks.read(session, Act, *_among(Act, parts), *by)

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
        expected: MarkRecord | None = None,
    ) -> Act:
        """Give points for an answer: they are its mark.

        Parameters
        ----------
        student, where : whose, and which
        points, level : given; the level is stored beside the points
        actor : the scorer
        remark : for the student
        expected : the mark as the scorer saw it; None for whatever is there

        Raises
        ------
        GradebookError
            If there is no such mark, or not so many points for it; or if the mark, or the answer, is not the expected
            one: the message says who gave what, and when. Then nothing is written.
        """
        with self._database.writing() as session:
            before = marks.current(session, student)
            act = _act(before, before.mark(where), actor, remark, level=level)
            new = marks.decided(before.mark(where), points, act.remark)
            marks.check_expected(session, before, where, expected)
            act.points = new.points
            reason = "scored" if level is None else f"level {level}"
            return _carry_out(session, before, act, GivenMark(new, act.actor, marks.now()), reason)

    def ask(
        self, student: str, where: Where, actor: str, *, remark: str = "", expected: MarkRecord | None = None
    ) -> Act:
        """Ask the instructor: until somebody decides, the answer waits, also where it was decided before."""
        with self._database.writing() as session:
            before = marks.current(session, student)
            act = _act(before, before.mark(where), actor, remark, asked=True)
            marks.check_expected(session, before, where, expected)
            return _carry_out(session, before, act, None, "the instructor is asked")

    def undo(self, number: int, actor: str) -> Act:
        """Take an act back: the mark is again what it was before.

        Raises
        ------
        GradebookError
            If there is no such act of this scorer, it was taken back before, or another decided since.
        """
        with self._database.writing() as session:
            act = _own_act(session, number, storable.text(actor))
            before = marks.current(session, act.student)
            undoing = _act(before, before.mark(act.where), actor, undoes=number)
            if not _is_as_left(marks.decision(session, before.student.id, act.where), act):
                raise marks.changed_since(session, before, act.where)
            earlier = act.replaced and marks.from_json(act.replaced)
            return _carry_out(session, before, undoing, earlier, f"taken back: act {number}")

    # --- who reads what -----------------------------------------------------------------------------------------------

    def claim(self, order: Sequence[str], where: Where, actor: str, seconds: float) -> str | None:
        """Claim the next answer for a scorer: of the first student in an order whose answer waits and nobody reads.

        It is theirs for a while; a claim that has run out is anybody's. What they had claimed before is released.

        Parameters
        ----------
        order : students
        where : which part
        actor, seconds : for whom, and for how long

        Returns
        -------
        str or None
            The student; None if there is nothing left.
        """
        actor = storable.text(actor)
        with self._database.writing() as session:
            _let_go(session, actor)
            taken = _claimed(session, where)
            free = {
                caseless(answer.student): answer.student
                for answer in _answers(session, [where])
                if answer.student not in taken and answer.mark.status == FOR_A_PERSON and not answer.asked
            }
            student = next((free[name] for name in map(caseless, order) if name in free), None)
            if student is not None:
                _claim(session, student, where, actor, seconds)
            return student

    def hold(self, student: str, where: Where, actor: str, seconds: float) -> str | None:
        """Claim an answer that a scorer has opened, in any state; what they had claimed is released.

        Returns
        -------
        str or None
            Who else is reading it; then it stays theirs.
        """
        actor = storable.text(actor)
        with self._database.writing() as session:
            _let_go(session, actor)
            for other, (holder, _until) in _claimed(session, where).items():
                if caseless(other) == caseless(student):
                    return holder
            _claim(session, student, where, actor, seconds)
            return None

    def claimed(self, where: Where) -> dict[str, tuple[str, datetime]]:
        """Return who is reading an answer, and until when, by student."""
        with self._database.reading() as session:
            return _claimed(session, where)

    def let_go(self, actor: str) -> None:
        """Release what a scorer has claimed."""
        with self._database.writing() as session:
            _let_go(session, storable.text(actor))


def standing(acts: Sequence[Act]) -> list[Act]:
    """Leave out acts that were taken back, and those that took them back."""
    undone = {act.undoes for act in acts if act.undoes is not None}
    return [act for act in acts if act.undoes is None and act.number not in undone]


def _act(before: Current, mark: MarkRecord, actor: str, remark: str = "", **more: Any) -> Act:
    """Make an act on a mark, not stored yet."""
    who, remark = storable.text(actor), storable.text(remark)
    nothing = (NEW, before.student.student, *mark.where, who, None, None, mark.out_of, remark, mark.given, False, None)
    return replace(Act(*nothing, marks.now()), **more)


def _carry_out(session: Session, before: Current, act: Act, given: GivenMark | None, reason: str) -> Act:
    """Write an act, the decision that follows from it, and the audit trail; a reason for that if the act has none."""
    student_id = before.student.id
    replaced = marks.decision(session, student_id, act.where)
    marks.put(session, student_id, act, replaced=replaced and marks.as_json(replaced))
    if given is not None:
        marks.put_decision(session, student_id, given)
    elif replaced is not None:
        session.delete(replaced)
    marks.put_audit(session, before, act.actor, act.remark or reason)
    return act


def _own_act(session: Session, number: int, actor: str) -> Act:
    """Return an act that its scorer may take back."""
    acts = marks.read(session, Act, (Act.number == number) | (Act.undoes == number))
    if not acts or acts[0].undoes is not None or acts[0].actor != actor:
        raise GradebookError(f"{actor} has no act {number} to take back.")
    if len(acts) > 1:
        raise GradebookError(f"Act {number} was taken back before.")
    return acts[0]


def _is_as_left(decision: GivenMark | None, act: Act) -> bool:
    """Return whether the present decision is the one that an act left."""
    if decision is None or act.points is None:
        return decision is None and act.points is None
    left, mark = (act.actor, act.out_of, act.remark, act.given), decision.mark
    return (decision.actor, mark.out_of, mark.reason, mark.given) == left and math.isclose(mark.points, act.points)


# --- answers ----------------------------------------------------------------------------------------------------------


def _answers(session: Session, parts: Collection[Where] | None) -> list[Answer]:
    made = (
        select(StudentRecord.student, Mark.record)
        .join(RunRecord, RunRecord.student_id == StudentRecord.id)
        .join(Mark)
        .where(RunRecord.current, *_among(Mark, parts))
        .order_by(StudentRecord.folded, Mark.position)
    )
    decisions = select(StudentRecord.student, GivenMark).join(GivenMark).where(*_among(GivenMark, parts))
    given = {(student, given.mark.where): given for student, given in session.execute(decisions)}
    done: dict[tuple[str, Where], list[Act]] = defaultdict(list)
    for act in standing(marks.read(session, Act, *_among(Act, parts))):
        done[act.student, act.where].append(act)
    answers = []
    for student, mark in session.execute(made):
        own = given.get((student, mark.where))
        if own is not None and not marks.holds(own.mark, mark):
            own = None
        acts = tuple(act for act in done[student, mark.where] if marks.holds(act, mark))
        if mark.status == FOR_A_PERSON or own is not None or acts:
            current = marks.with_decision(mark, {mark.where: own} if own else {})
            answers.append(Answer(student, *mark.where, current, acts, own))
    return answers


def _among(table: Any, parts: Collection[Where] | None) -> list[Any]:
    return [] if parts is None else [tuple_(table.question, table.part).in_([tuple(where) for where in parts])]


# --- claims -----------------------------------------------------------------------------------------------------------


def _claimed(session: Session, where: Where) -> dict[str, tuple[str, datetime]]:
    claims = select(StudentRecord.student, Claim.actor, Claim.until).join(Claim)
    rows = session.execute(claims.where(*_among(Claim, [where]), Claim.until > marks.now()))
    return {student: (actor, until) for student, actor, until in rows}


def _claim(session: Session, student: str, where: Where, actor: str, seconds: float) -> None:
    """Write who reads an answer, in place of who did."""
    until = marks.now() + timedelta(seconds=seconds)
    session.merge(Claim(marks.known_student(session, student).id, *where, actor, until))


def _let_go(session: Session, actor: str) -> None:
    """Delete what an actor has claimed, and all claims that have run out."""
    session.execute(delete(Claim).where((Claim.actor == actor) | (Claim.until <= marks.now())))


# --- requests and publications ----------------------------------------------------------------------------------------


class Requests:
    """Requests and publications in a gradebook. Each method is one transaction; GradebookError as the gradebook's.

    Parameters
    ----------
    database : the gradebook's, with its tables
    """

    def __init__(self, database: Database) -> None:
        self._database = database

    def make(self, student: str, where: Where, text: str) -> Request:
        """Store beside an answer that a student asks to have it looked at again.

        Raises
        ------
        GradebookError
            If there is no mark for that part, or the request is empty.
        """
        text = _not_empty(text, "A request says what is to be looked at again; this one is empty.")
        with self._database.writing() as session:
            current = marks.current(session, student)
            request = Request(NEW, current.student.student, *current.mark(where).where, text, marks.now())
            return marks.put(session, current.student.id, request)

    def answer(self, number: int, actor: str, text: str) -> Request:
        """Answer a request, which closes it.

        Raises
        ------
        GradebookError
            If there is no such request, it was answered before (the message says by whom), or the answer is empty.
        """
        text = _not_empty(text, "An answer to a request says something; this one is empty.")
        with self._database.writing() as session:
            requests = marks.read(session, Request, Request.number == number)
            if not requests:
                raise GradebookError(f"There is no request {number}.")
            request = requests[0]
            if request.answered is not None:
                raise GradebookError(
                    f"Request {number} was answered by {request.answered_by} on "
                    f"{request.answered:%Y-%m-%d %H:%M} UTC: {request.answer!r}"
                )
            request.answered_by, request.answer, request.answered = storable.text(actor), text, marks.now()
            return request

    def all(self, open_only: bool = False) -> list[Request]:
        """Return requests, in the order in which they were made."""
        which = [Request.answered.is_(None)] if open_only else []
        with self._database.reading() as session:
            return marks.read(session, Request, *which)

    def publish(self, actor: str, note: str = "", when: datetime | None = None) -> Publication:
        """Store that feedback was given back to the class.

        Parameters
        ----------
        actor, note : who does it, and for the record
        when : UTC; what changes after it is not in what was given back. Now, where it is None
        """
        publication = Publication(NEW, storable.text(actor), storable.text(note), (when or marks.now()).astimezone(UTC))
        with self._database.writing() as session:
            session.add(publication)
        return publication

    def publications(self) -> list[Publication]:
        """Return when feedback was given back, in order."""
        with self._database.reading() as session:
            return list(session.scalars(select(Publication).order_by(Publication.number)))


def _not_empty(given: str, otherwise: str) -> str:
    text = storable.text(given).strip()
    if not text:
        raise GradebookError(otherwise)
    return text
