"""What scorers do at the desk: who gets which answers next, what they give, and what they take back.

An answer is known outside by a key and a number that say nothing of whose it is, and the answers to each part come in
an order of their own, so that nobody is always the first to be read. Answers that are nearly the same come together;
the first of them is claimed, and stands for all.
"""

from __future__ import annotations

import hashlib
import json
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import count

from labcourse.answers.catalogue import Catalogue
from labcourse.answers.report_files import is_given
from labcourse.errors import GradebookError
from labcourse.grading.accounts.exact import exact
from labcourse.grading.gradebook import Act, Answer, Gradebook
from labcourse.grading.reports.result import points as shown_points
from labcourse.grading.reports.result import worth as in_points
from labcourse.grading.scoring import alike
from labcourse.grading.scoring.rubric import Item
from labcourse.grading.settings import LevelSettings
from labcourse.student_id import caseless

Where = tuple[str, str]  #: question, part

HELD = 120.0  #: s for which an answer is a scorer's: three renewals, and not long after a page was closed by force
MOST_TOGETHER = 8  #: answers that are scored in one go: each is shown; with what differs in each, two screens
_PICTURE = "!["  # in Markdown
_KEY = 16  # hexadecimal digits of a key


@dataclass(frozen=True)
class Pick:
    """An answer as a page showed it: its key, and a digest of the answer and its mark."""

    key: str
    seen: str


@dataclass
class Done:
    """What became of something that a scorer did: the acts that were written, and in words what was not."""

    acts: list[Act] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)


def shuffled(student: str, where: Where) -> str:
    """By which the answers to a part are put in order; it says nothing of whose they are."""
    return hashlib.sha256(json.dumps([*where, caseless(student)]).encode()).hexdigest()


def key_of(student: str, where: Where) -> str:
    """By which a page names an answer."""
    return shuffled(student, where)[:_KEY]


def seen(answer: Answer) -> str:
    """Compute a digest of an answer and its mark: a different one says that one of them has changed."""
    mark = answer.mark
    state = [mark.status, mark.points, answer.asked, mark.out_of, mark.given]
    return hashlib.sha256(json.dumps(state).encode()).hexdigest()[:_KEY]


class Desk:
    """Where a class's answers are scored.

    Parameters
    ----------
    book : the gradebook
    catalogue : of the course's questions
    rubric : what to look for in each part; what is missing in it is scored without
    levels : what each is worth, and which level a share of the points is
    names : whether scorers see whose an answer is
    """

    def __init__(
        self,
        book: Gradebook,
        catalogue: Catalogue,
        rubric: Mapping[Where, Item],
        levels: LevelSettings,
        names: bool = False,
    ) -> None:
        self.book, self.catalogue, self.rubric, self.levels = book, catalogue, rubric, levels
        self.names = names
        self._together: dict[int, tuple[int, ...]] = {}
        self._put_off: dict[tuple[str, Where], dict[str, None]] = defaultdict(dict)
        self._stuck: dict[str, set[int]] = defaultdict(set)  # scorer → acts that could not be taken back

    # --- what there is ------------------------------------------------------------------------------------------------

    def in_order(self, wheres: Sequence[Where]) -> list[Where]:
        """Parts in the catalogue's order; those that it does not have any more come last."""
        places = [(q.number, part.name) for q in self.catalogue.marked.values() for part in q.parts]
        ranks = {where: rank for rank, where in enumerate(places)}
        return sorted(set(wheres), key=lambda where: (ranks.get(where, len(ranks)), where))

    def label(self, student: str, where: Where) -> str:
        """What an answer is called: by a number, or, if names are shown, by whose it is."""
        everybody = self.book.students()
        if self.names:
            name = next((one.name for one in everybody if one.student == student), "")
            return f"{name} ({student})" if name else student
        order = sorted(shuffled(one.student, where) for one in everybody)
        return f"Answer {order.index(shuffled(student, where)) + 1}"

    def points(self, level: int, out_of: float) -> float:
        """What a level is worth: exactly its share, or by the course's thresholds it may be another level."""
        return float(exact(self.levels.shares[level]) * exact(out_of))

    def due(self, where: Where) -> list[Answer]:
        """List the answers that wait for a scorer, in their order."""
        answers = sorted(self.book.scores.answers([where]), key=lambda one: shuffled(one.student, where))
        return [one for one in answers if one.waiting and not one.asked]

    # --- what comes next ----------------------------------------------------------------------------------------------

    def next(self, actor: str, where: Where) -> list[Answer]:
        """The next answer for a scorer, claimed for them, and after it those that are nearly the same.

        Returns
        -------
        list of Answer
            Empty if nothing is left that nobody else is reading.
        """
        groups = _alike(self.due(where))
        put_off = list(self._put_off[actor, where])
        groups.sort(key=lambda group: _place(put_off, key_of(group[0].student, where)))
        student = self.book.scores.claim([group[0].student for group in groups], where, actor, HELD)
        found = next((group for group in groups if group[0].student == student), [])
        held = self.book.scores.claimed(where)
        others = [one for one in found[1:] if held.get(one.student, (actor,))[0] == actor]
        return [*found[:1], *others][:MOST_TOGETHER]

    def part_after(self, where: Where) -> Where | None:
        """The part that comes next in the catalogue's order of which answers wait; the first of all after the last."""
        waiting = {one.where for one in self.book.scores.answers() if one.waiting and not one.asked}
        order = self.in_order([*waiting, where])
        place = order.index(where)
        return next(iter([*order[place + 1 :], *order[:place]]), None)

    def put_off(self, actor: str, where: Where, key: str) -> None:
        """Let an answer come again when there is nothing else."""
        later = self._put_off[actor, where]
        later.pop(key, None)
        later[key] = None

    def find(self, where: Where, key: str) -> Answer | None:
        """The answer of a key, whatever became of it."""
        return next((one for one in self.book.scores.answers([where]) if key_of(one.student, where) == key), None)

    def renew(self, actor: str, where: Where, key: str) -> str:
        """Hold on to an answer; in words what stands against it, "" if nothing does."""
        answer = self.find(where, key)
        if answer is None:
            return "This answer is not there any more."
        holder = self.book.scores.hold(answer.student, where, actor, HELD)
        return "" if holder is None else f"{holder} is reading this one, too, and had it before you."

    # --- deciding -----------------------------------------------------------------------------------------------------

    def give(
        self,
        actor: str,
        where: Where,
        picks: Sequence[Pick],
        *,
        level: int | None = None,
        points: float | None = None,
        remark: str = "",
    ) -> Done:
        """Score answers in one go: a level, or points without one. What is another by now than was seen is not written.

        The first of the answers, which is claimed, comes last: until then nobody else is given one of the others.
        """

        def write(answer: Answer) -> Act:
            out_of = answer.mark.out_of
            worth = points if points is not None else self.points(level or 0, out_of)
            return self.book.scores.give(
                answer.student,
                where,
                worth,
                actor,
                level=None if points is not None else level,
                remark=remark,
                expected=answer.mark,
            )

        done = Done()
        for pick in reversed(picks):
            self._one(done, where, pick, write)
        self._remember(done)
        return done

    def ask(self, actor: str, where: Where, picks: Sequence[Pick], remark: str = "") -> Done:
        """Leave answers to the instructor, with a question."""
        done = Done()
        for pick in reversed(picks):
            self._one(
                done,
                where,
                pick,
                lambda one: self.book.scores.ask(one.student, where, actor, remark=remark, expected=one.mark),
            )
        self._remember(done)
        return done

    def _one(self, done: Done, where: Where, pick: Pick, write: Callable[[Answer], Act]) -> None:
        answer = self.find(where, pick.key)
        if answer is None:
            done.problems.append("An answer is not there any more: it was handed in again, and left blank.")
            return
        if seen(answer) != pick.seen:
            done.problems.append(self.conflict(answer))
            return
        try:
            done.acts.append(write(answer))
        except GradebookError as error:
            now = self.find(where, pick.key)
            changed = now is not None and seen(now) != pick.seen
            done.problems.append(self.conflict(now) if now is not None and changed else str(error))

    def _remember(self, done: Done) -> None:
        numbers = tuple(act.number for act in done.acts)
        self._together |= dict.fromkeys(numbers, numbers)

    def conflict(self, answer: Answer) -> str:
        """In words what is there in place of what a page showed."""
        label = self.label(answer.student, answer.where)
        if answer.waiting and not answer.asked:
            return f"{label} is another by now, or somebody scored it. Nothing of yours was written for it."
        return f"{label}: {state(answer)} Nothing of yours was written for it."

    def undo(self, actor: str) -> Done:
        """Take back what a scorer did last; where that were several answers in one go, all of them.

        What cannot be taken back is told, and the next time it is passed over: it is not to stand before all else.
        """
        acts = self.book.scores.acts(actor=actor)
        undone = {act.undoes for act in acts}
        own = {act.number: act for act in acts if act.undoes is None}
        stuck = self._stuck[actor]
        left = [number for number in own if number not in undone and number not in stuck]
        done = Done()
        if not left:
            stuck.clear()  # from here it begins anew: meanwhile it may be as it was
            done.problems.append("There is nothing of yours to take back.")
            return done
        for number in self._together.get(left[-1], (left[-1],)):
            if number in undone or number in stuck:
                continue
            try:
                self.book.scores.undo(number, actor)
                done.acts.append(own[number])
            except GradebookError:
                stuck.add(number)
                answer = self.find(own[number].where, key_of(own[number].student, own[number].where))
                why = state(answer) if answer is not None else "It is not there any more."
                done.problems.append(
                    f"{self.label(own[number].student, own[number].where)} was not taken back, for it is another "
                    f"by now. {why}"
                )
        return done


def state(answer: Answer) -> str:
    """In words what became of an answer so far."""
    last, mark = answer.last(), answer.mark
    if last is not None and answer.asked:
        return f"{last.actor} asked the instructor at {last.when:%H:%M} UTC: “{last.remark}”"
    points, out_of = shown_points(mark.points), in_points(mark.out_of)
    if answer.given is None:
        return f"It has {points} of {out_of} now ({mark.status})."
    by, act = answer.given, answer.decision
    if act is None:  # by labcourse mark, which has a reason
        return f"{by.actor} gave it {points} of {out_of} at {by.when:%H:%M} UTC: “{mark.reason}”"
    what = f"level {act.level}, " if act.level is not None else ""
    return f"{act.actor} gave it {what}{points} of {out_of} at {act.when:%H:%M} UTC."


def _place(put_off: Sequence[str], key: str) -> int:
    return put_off.index(key) + 1 if key in put_off else 0


def _alike(answers: Sequence[Answer]) -> list[list[Answer]]:
    """Answers that are nearly the same, together; one with a picture or a PDF stands alone: these are not compared."""
    alone = count()
    besides = [next(alone) if _PICTURE in (text := one.mark.given) or is_given(text) else -1 for one in answers]
    return [[answers[place] for place in group] for group in alike.groups([one.mark.given for one in answers], besides)]
