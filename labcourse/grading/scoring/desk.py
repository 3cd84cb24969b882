"""Decide who gets which answers next; give points to answers, ask the instructor, and take acts back.

Scorers know an answer by a key and a number that do not tell whose it is, and the answers to each part come in an order
of their own, so that nobody is always the first to be read. Equal answers come together; the first of them is claimed
for all.
"""

from __future__ import annotations

import hashlib
import json
import unicodedata
from collections import Counter, defaultdict
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import count
from urllib.parse import urlencode

from labcourse.answers.catalogue import Catalogue
from labcourse.answers.report_files import is_given
from labcourse.errors import GradebookError
from labcourse.grading.accounts import points as shown_points
from labcourse.grading.accounts import worth as in_points
from labcourse.grading.assignments import asked_of_persons, exact
from labcourse.grading.gradebook import Act, Answer, Gradebook, standing
from labcourse.grading.marks import Status
from labcourse.grading.reports.result import moment, without_numbers
from labcourse.grading.scoring.rubric import LEVELS, RubricItem
from labcourse.grading.settings import LevelSettings
from labcourse.patterns import ANSWER, pattern
from labcourse.problems import Problem, Reason, Where
from labcourse.sentences import sentence
from labcourse.student_id import caseless

HELD = 120.0  #: s for which an answer is a scorer's: three renewals, and not long after a page was closed by force
MOST_AT_ONCE = 8  #: answers that are scored in one go: each is shown
REMARK_KEYS = "abcdefg"  #: by which remarks are put in; "h" is help
_PICTURE = "!["  # in Markdown
_BEGINNINGS = pattern(
    r"(?:\A|[.!?]\s)\s*[A-Z](?=[a-z])", ANSWER
)  # of sentences; other capitals may be symbols or units
_AT_ENDS = pattern(r"[.,;:](?=\s|$)", ANSWER)  # they say nothing that another answer does not
_KEY = 16  # hexadecimal digits of a key


@dataclass(frozen=True)
class Pick:
    """An answer as a page showed it: its key, and a digest of the answer and its mark."""

    key: str
    seen: str


@dataclass
class Done:
    """The result of something that a scorer did: the acts that were written, and messages on what was not."""

    acts: list[Act] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)


def shuffled(student: str, where: Where) -> str:
    """Return the key by which the answers to a part are sorted; it does not tell whose they are."""
    return hashlib.sha256(json.dumps([*where, caseless(student)]).encode()).hexdigest()


def key_of(student: str, where: Where) -> str:
    """Return the key by which a page names an answer."""
    return shuffled(student, where)[:_KEY]


def link(student: str, question: str = "", part: str = "") -> str:
    """Return the address of a student's answer, or, without a question, of the copy of their feedback.

    It stands behind that of the scoring page.
    """
    if not question:
        return f"student?{urlencode({'id': student})}"
    return f"answer?{urlencode({'student': student, 'question': question, 'part': part})}"


def seen(answer: Answer) -> str:
    """Compute a digest of an answer and its mark: a different one says that one of them has changed."""
    mark = answer.mark
    state = [mark.status, mark.points, answer.referred, mark.out_of, mark.given]
    return hashlib.sha256(json.dumps(state).encode()).hexdigest()[:_KEY]


@dataclass
class Desk:
    """Where a class's answers are scored.

    Attributes
    ----------
    book : the gradebook
    catalogue : of the course's questions
    rubric : what to look for in each part; a part that is not in it is scored without
    levels : what each level is worth
    names : whether scorers see whose an answer is
    """

    book: Gradebook
    catalogue: Catalogue
    rubric: Mapping[Where, RubricItem]
    levels: LevelSettings
    names: bool = False

    def __post_init__(self) -> None:
        self._together: dict[int, tuple[int, ...]] = {}  # act → all that were written in one go
        self._put_off: dict[tuple[str, str], int] = {}  # scorer and key of an answer → in which order
        self._order = count(1)
        self._stuck: dict[str, set[int]] = defaultdict(set)  # scorer → acts that could not be taken back

    # --- what there is ------------------------------------------------------------------------------------------------

    def in_order(self, wheres: Sequence[Where]) -> list[Where]:
        """Sort parts in the catalogue's order; those that it does not have any more come last."""
        places = [(q.number, part.name) for q in self.catalogue.marked.values() for part in q.parts]
        ranks = {where: rank for rank, where in enumerate(places)}
        return sorted(set(wheres), key=lambda where: (ranks.get(where, len(ranks)), where))

    def label(self, student: str, where: Where) -> str:
        """Return a number for an answer, or, if names are shown, the student's name."""
        return self.labels(where)[student]

    def labels(self, where: Where) -> dict[str, str]:
        """Return student → :meth:`label` of their answer to a part."""
        everybody = self.book.students()
        if self.names:
            return {one.student: f"{one.name} ({one.student})" if one.name else one.student for one in everybody}
        order = sorted((one.student for one in everybody), key=lambda student: shuffled(student, where))
        return {student: f"Answer {place}" for place, student in enumerate(order, start=1)}

    def points(self, level: int, out_of: float) -> float:
        """Return the points of a level: its share of ``out_of``, not rounded.

        Rounded points might be those of another level by the course's thresholds.
        """
        return float(exact(self.levels.shares[level]) * exact(out_of))

    def meaning(self, where: Where, level: int) -> str:
        """Return what a level of a part means: "Level 3: ...", in the rubric's words; without these, "Level 3."."""
        item = self.rubric.get(where)
        return f"Level {level}: {item.levels[level]}" if item and level in item.levels else f"Level {level}."

    def answers(self, parts: Collection[Where] | None = None) -> list[Answer]:
        """Return the answers of :func:`labcourse.grading.assignments.asked_of_persons`."""
        return asked_of_persons(self.book, self.catalogue, parts)

    def due(self, where: Where) -> list[Answer]:
        """Return the answers that wait for a scorer, in their order; those left to the instructor are left out."""
        answers = sorted(self.answers([where]), key=lambda one: shuffled(one.student, where))
        return [one for one in answers if one.waiting and not one.referred]

    def remarks(self, where: Where) -> dict[str, str]:
        """Return key → remark for a part: the rubric's first, then those that were written most often before.

        Each line of a remark counts; of two that were written as often, the later one comes first.
        """
        acts = [act for act in standing(self.book.scores.acts([where])) if not act.referred]
        lines = [line.strip() for act in reversed(acts) for line in reversed(act.remark.split("\n"))]
        written = [line for line, _count in Counter(filter(None, lines)).most_common()]
        item = self.rubric.get(where)
        texts = dict.fromkeys([*(item.remarks if item else ()), *written])
        return dict(zip(REMARK_KEYS, texts, strict=False))

    # --- what comes next ----------------------------------------------------------------------------------------------

    def next(self, actor: str, where: Where) -> list[Answer]:
        """Claim the next answer for a scorer; return it, and after it those that are equal, as many as are shown.

        Returns
        -------
        list of Answer
            Without those that somebody else is reading; empty if none are left.
        """
        groups = defaultdict[str, list[Answer]](list)
        for answer in self.due(where):
            groups[_without_trifles(answer)].append(answer)
        first = {group[0].student: group for group in groups.values()}
        order = sorted(first, key=lambda student: self._put_off.get((actor, key_of(student, where)), 0))
        student = self.book.scores.claim(order, where, actor, HELD)
        group = first.get(student or "", [])
        held = self.book.scores.claimed(where)
        free = [one for one in group[1:] if held.get(one.student, (actor,))[0] == actor]
        return [*group[:1], *free][:MOST_AT_ONCE]

    def part_after(self, where: Where) -> Where | None:
        """Return the next part that has answers to score, in the catalogue's order; None without any.

        After the last part, the first one is next.
        """
        waiting = {answer.where for answer in self.answers() if answer.waiting and not answer.referred}
        order = self.in_order([*waiting, where])
        place = order.index(where)
        return next(iter([*order[place + 1 :], *order[:place]]), None)

    def put_off(self, actor: str, key: str) -> None:
        """Let an answer come to this scorer again when there is nothing else."""
        self._put_off[actor, key] = next(self._order)

    def find(self, where: Where, key: str) -> Answer | None:
        """Return the answer of a key in any state, whoever marks it; None if there is none."""
        return next((one for one in self.book.scores.any_answers(where) if key_of(one.student, where) == key), None)

    def alike(self, decided: Answer) -> list[Answer]:
        """Return the answers on which nobody decided, and to which the machine gave what it gave to a decided one.

        Status and reason are the same, apart from numbers in the reason. Answers on which the instructor is asked are
        left out: somebody has a question about them. The result is empty if nobody decided on the answer, and for
        answers that the machine leaves to a person.
        """
        made = decided.made
        if decided.given is None or made is None or made.status == Status.FOR_A_PERSON:
            return []
        same = (made.status, _same_for_all(made.reason))
        theirs = sorted(self.book.scores.any_answers(made.where), key=lambda one: shuffled(one.student, made.where))
        return [one for one in theirs if (one.mark.status, _same_for_all(one.mark.reason)) == same and not one.referred]

    def hold(self, actor: str, where: Where, key: str) -> str | None:
        """Claim an answer for a scorer, or extend the claim.

        Return None, or a message if it is gone or another scorer has it. The scorer's other claim ends if the answer is
        found, even if this claim fails.
        """
        answer = self.find(where, key)
        if answer is None:
            return "This answer is not there any more."
        holder = self.book.scores.hold(answer.student, where, actor, HELD)
        return None if holder is None else f"{holder} is reading this one, too, and had it before you."

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
        """Score answers in one go: a level, or points without one. An answer that has changed is not scored."""

        def write(answer: Answer) -> Act:
            worth = self.points(level or 0, answer.mark.out_of) if points is None else points
            meaning = "" if level is None else self.meaning(where, level)
            return self.book.scores.give(
                answer.student, where, worth, actor, level=level, remark=remark, meaning=meaning, expected=answer.mark
            )

        return self._act(where, picks, write)

    def give_same(self, actor: str, where: Where, decided: Pick, picks: Sequence[Pick]) -> Done:
        """Give answers the share of their points, and the remark, that a person gave to another answer.

        Nothing is given if the decision is not any more what the page showed.
        """
        example = self.find(where, decided.key)
        if example is None or example.given is None or seen(example) != decided.seen:
            return Done(problems=["The decision has changed. " + ("" if example is None else state(example))])
        mark = example.mark
        share = exact(mark.points) / (exact(mark.out_of) or 1)

        def write(answer: Answer) -> Act:
            points = float(share * exact(answer.mark.out_of))
            return self.book.scores.give(
                answer.student, where, points, actor, remark=sentence(mark.reason), expected=answer.mark
            )

        return self._act(where, picks, write)

    def ask(self, actor: str, where: Where, picks: Sequence[Pick], remark: str = "") -> Done:
        """Leave answers to the instructor, with a question. Of an answer that has changed, nothing is written."""

        def write(answer: Answer) -> Act:
            return self.book.scores.ask(answer.student, where, actor, remark=remark, expected=answer.mark)

        return self._act(where, picks, write)

    def _act(self, where: Where, picks: Sequence[Pick], write: Callable[[Answer], Act]) -> Done:
        """Write an act for each answer. The first one is claimed, and comes last: until then nobody gets the others."""
        done = Done()
        for pick in reversed(picks):
            answer = self.find(where, pick.key)
            if answer is None:
                done.problems.append("An answer is not there any more: the student’s work has no such part now.")
            elif seen(answer) != pick.seen:
                done.problems.append(self.conflict(answer))
            else:
                try:
                    done.acts.append(write(answer))
                except GradebookError as error:
                    now = self.find(where, pick.key)
                    changed = now is not None and seen(now) != pick.seen
                    done.problems.append(self.conflict(now) if now is not None and changed else str(error))
        numbers = tuple(act.number for act in done.acts)
        self._together |= dict.fromkeys(numbers, numbers)
        return done

    def conflict(self, answer: Answer) -> str:
        """Return a message that an answer is not any more what a page showed."""
        label = self.label(answer.student, answer.where)
        return f"{label} has changed. {state(answer)} Nothing of yours was written for it."

    def last_acts(self, actor: str) -> list[Act]:
        """Return what a scorer did last, with all that was done by the same key: what :meth:`undo` takes back.

        Leave out what could not be taken back before.
        """
        left = [act for act in standing(self.book.scores.acts(actor=actor)) if act.number not in self._stuck[actor]]
        together = self._together.get(left[-1].number, (left[-1].number,)) if left else ()
        by_number = {act.number: act for act in left}
        return [by_number[number] for number in together if number in by_number]

    def undo(self, actor: str) -> Done:
        """Undo what a scorer did last, with all that was done by the same key.

        A mark that cannot be undone is reported in ``problems``, and the next undo skips it.
        """
        stuck, done, last = self._stuck[actor], Done(), self.last_acts(actor)
        if not last:
            stuck.clear()  # start again: what could not be undone may have been changed back
            done.problems.append("There is nothing of yours to undo.")
        for act in last:
            try:
                self.book.scores.undo(act.number, actor)
                done.acts.append(act)
            except GradebookError:
                stuck.add(act.number)
                answer = self.find(act.where, key_of(act.student, act.where))
                why = "It is not there any more." if answer is None else state(answer)
                label = self.label(act.student, act.where)
                done.problems.append(f"{label} was not undone: it has been changed since. {why}")
        return done


def _same_for_all(reason: Reason) -> str:
    """Return what the reason is for everybody with the same slip: a code, or the words of the key without numbers."""
    return reason.code if isinstance(reason, Problem) else without_numbers(reason)


def state(answer: Answer) -> str:
    """Describe what became of an answer so far: who decided, when, and why."""
    last, mark, by, act = answer.last(), answer.mark, answer.given, answer.decision
    if last is not None and answer.referred:
        return f"{last.actor} asked the instructor at {moment(last.when)}: “{last.remark}”"
    points = f"{shown_points(mark.points)} of {in_points(mark.out_of)}"
    if by is None:
        return f"It has {points} now ({mark.status}). {sentence(mark.reason)}"
    level = "" if act is None or act.level is None else f"level {act.level}, "
    remark = f": “{sentence(answer.remark)}”" if answer.remark else "."
    return f"{by.actor} gave it {level}{points} at {moment(by.when)}{remark}"


def _without_trifles(answer: Answer) -> str:
    """Return a text that is equal for equal answers; unique for the student if it has a picture or a PDF.

    White space, signs at ends of words, and capitals at beginnings of sentences say nothing.
    """
    text = answer.mark.given
    if _PICTURE in text or is_given(text):
        return f"{answer.student}: {text}"
    text = _BEGINNINGS.sub(lambda capital: capital[0].lower(), unicodedata.normalize("NFC", text))
    return " ".join(_AT_ENDS.sub("", text).split())


# --- how far it is ----------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Tally:
    """How far the answers to a part are.

    Attributes
    ----------
    total, done, waiting, referred : answers: all, decided, to be read, left to the instructor
    levels : level → how many have it; points without a level, also those of ``labcourse mark``, count as ``other``
    """

    total: int
    done: int
    waiting: int
    referred: int
    levels: dict[int, int]
    other: int


def tally(answers: Sequence[Answer]) -> Tally:
    """Count how far some answers are."""
    done = [one for one in answers if not one.waiting]
    referred = sum(one.referred for one in answers)
    given = Counter(one.decision.level if one.decision else None for one in done)
    levels = {level: given[level] for level in LEVELS}
    waiting = len(answers) - len(done) - referred
    return Tally(len(answers), len(done), waiting, referred, levels, len(done) - sum(levels.values()))
