"""What scorers do: who reads what, levels and points, questions to the instructor, and taking back. Nothing is lost.

Each act stays, also one that was taken back: what counts is made from them and from the decisions that they wrote.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from datetime import datetime
from typing import Any

from sqlalchemy import Connection

from labcourse.errors import GradebookError
from labcourse.grading.gradebook import deciding, rows, score_rows, storable
from labcourse.grading.gradebook.database import Database
from labcourse.grading.gradebook.decided import Act, Answer
from labcourse.grading.gradebook.records import FOR_A_PERSON, MarkRecord
from labcourse.grading.gradebook.rows import Where
from labcourse.grading.gradebook.tables import scores
from labcourse.student_id import caseless


class Scores:
    """Scoring in a gradebook. Each method is one transaction; all raise GradebookError where the database fails.

    Parameters
    ----------
    database : the gradebook's, with its tables
    """

    def __init__(self, database: Database) -> None:
        self._database = database

    # --- what there is ------------------------------------------------------------------------------------------------

    def answers(self, parts: Collection[Where] | None = None) -> list[Answer]:
        """Everybody's answers that a person reads or has marked, by student; of these parts, or all.

        What was left blank is not among them: it is done.
        """
        with self._database.reading() as connection:
            return score_rows.answers(connection, parts)

    def acts(self, parts: Collection[Where] | None = None, actor: str | None = None) -> list[Act]:
        """What scorers did, in order; what was taken back, and the taking back, too.

        Parameters
        ----------
        parts : of these only; of all where it is None
        actor : by this scorer only; by all where it is None
        """
        with self._database.reading() as connection:
            return score_rows.acts_of(connection, parts, None if actor is None else storable.text(actor))

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
        points, level : given; the level is kept beside the points
        actor : the scorer
        remark : for the student
        expected : the mark as the scorer saw it; None for whatever is there

        Raises
        ------
        GradebookError
            If there is no such mark, or not so many points for it; or if the mark, or the answer, is another by now
            than expected: the message says who gave what, and when. Then nothing is written.
        """
        with self._database.writing() as connection:
            before = deciding.run_of(connection, student)
            mark = deciding.mark_of(before, where)
            deciding.check_points(mark, points)
            deciding.check_expected(connection, before, mark, expected)
            change = _change(actor, remark, "scored" if level is None else f"level {level}")
            act = _act(before, mark, change.actor, storable.text(remark), level=level, points=float(points) + 0.0)
            was = deciding.stored_decision(connection, before.student_id, where)
            done = score_rows.put_act(connection, before.student_id, act, was)
            new = deciding.decided(mark, points, act.remark)
            rows.put_decision(connection, before.student_id, new, change)
            rows.put_audit(connection, before.student_id, before, change)
            return done

    def ask(
        self, student: str, where: Where, actor: str, *, remark: str = "", expected: MarkRecord | None = None
    ) -> Act:
        """Ask the instructor: until somebody decides, the answer waits, also where it was decided before."""
        with self._database.writing() as connection:
            before = deciding.run_of(connection, student)
            mark = deciding.mark_of(before, where)
            deciding.check_expected(connection, before, mark, expected)
            change = _change(actor, remark, "the instructor is asked")
            act = _act(before, mark, change.actor, storable.text(remark), asked=True)
            was = deciding.stored_decision(connection, before.student_id, where)
            done = score_rows.put_act(connection, before.student_id, act, was)
            deciding.put_back(connection, before.student_id, where, None)
            rows.put_audit(connection, before.student_id, before, change)
            return done

    def undo(self, number: int, actor: str) -> Act:
        """Take an act back: the mark is again what it was before.

        Raises
        ------
        GradebookError
            If there is no such act of this scorer, it was taken back before, or another decided since.
        """
        with self._database.writing() as connection:
            act = _own_act(connection, number, storable.text(actor))
            before = deciding.run_of(connection, act.student)
            mark = deciding.mark_of(before, act.where)
            change = _change(actor, "", f"taken back: act {number}")
            undoing = _act(before, mark, change.actor, "", undoes=number)
            now = deciding.stored_decision(connection, before.student_id, act.where)
            if not _is_as_left(now, act):
                raise deciding.taken(connection, before, mark)
            deciding.put_back(connection, before.student_id, act.where, score_rows.replaced(connection, number))
            done = score_rows.put_act(connection, before.student_id, undoing, None)
            rows.put_audit(connection, before.student_id, before, change)
            return done

    # --- who reads what -----------------------------------------------------------------------------------------------

    def claim(self, order: Sequence[str], where: Where, actor: str, seconds: float) -> str | None:
        """The next answer for a scorer: of the first in an order that waits, and that nobody else is reading.

        It is theirs for a while; a claim that has run out is anybody's. What they had claimed before is let go.

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
        with self._database.writing() as connection:
            score_rows.let_go(connection, actor)
            held = score_rows.claimed(connection, where)
            free = [
                one.student
                for one in score_rows.answers(connection, [where])
                if one.student not in held and one.mark.status == FOR_A_PERSON and not one.asked
            ]
            student = score_rows.first_free(order, free)
            if student is not None:
                score_rows.claim(connection, student, where, actor, seconds)
            return student

    def hold(self, student: str, where: Where, actor: str, seconds: float) -> str | None:
        """Claim one answer for a scorer who has opened it, whatever became of it; what they had claimed is let go.

        Returns
        -------
        str or None
            Who else is reading it; then it stays theirs.
        """
        actor = storable.text(actor)
        with self._database.writing() as connection:
            score_rows.let_go(connection, actor)
            for one, (holder, _until) in score_rows.claimed(connection, where).items():
                if caseless(one) == caseless(student):
                    return holder
            score_rows.claim(connection, student, where, actor, seconds)
            return None

    def claimed(self, where: Where) -> dict[str, tuple[str, datetime]]:
        """Student → who is reading their answer, and until when."""
        with self._database.reading() as connection:
            return score_rows.claimed(connection, where)

    def let_go(self, actor: str) -> None:
        """Let others have what a scorer has claimed."""
        with self._database.writing() as connection:
            score_rows.let_go(connection, storable.text(actor))


def _change(actor: str, remark: str, otherwise: str) -> rows.Change:
    return rows.Change(storable.text(actor), storable.text(remark) or otherwise)


def _act(
    before: rows.Stored,
    mark: MarkRecord,
    actor: str,
    remark: str,
    *,
    level: int | None = None,
    points: float | None = None,
    asked: bool = False,
    undoes: int | None = None,
) -> Act:
    """An act as it is to be written; number and time come with that."""
    student = before.graded.run.student
    where = (mark.question, mark.part)
    return Act(0, student, *where, actor, level, points, mark.out_of, remark, mark.given, asked, undoes, rows.now())


def _own_act(connection: Connection, number: int, actor: str) -> Act:
    """An act that its scorer may take back."""
    found = score_rows.acts(connection, scores.c.id == number)
    if not found or found[0].undoes is not None or found[0].actor != actor:
        raise GradebookError(f"{actor} has no act {number} to take back.")
    if score_rows.acts(connection, scores.c.undoes == number):
        raise GradebookError(f"Act {number} was taken back before.")
    return found[0]


def _is_as_left(decision: dict[str, Any] | None, act: Act) -> bool:
    """Whether the decision that is there is the one that an act left."""
    if decision is None or act.points is None:
        return decision is None and act.points is None
    left = (act.actor, act.out_of, act.remark, act.given)
    there = (decision["actor"], decision["out_of"], decision["reason"], decision["given"])
    return there == left and math.isclose(decision["points"], act.points)
