"""What waits for whom: texts for a person, questions for the instructor, requests of students, faults of the key."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from labcourse import program
from labcourse.grading.gradebook import Answer, Graded, Request
from labcourse.grading.graded_run import FAILED, key_faults
from labcourse.grading.overview.section import Section, Table, moment
from labcourse.grading.reports.result import points, worth
from labcourse.grading.verdicts import Status
from labcourse.messages import plural

_LONGEST = 300  # characters of what somebody wrote


def for_persons(answers: Sequence[Answer], titles: Mapping[str, str]) -> Section:
    """Answers that nobody has decided, by question and part, in the order of the course.

    Parameters
    ----------
    answers : all that persons read or have marked
    titles : question → what it is called, in the order of the course
    """
    order = {number: place for place, number in enumerate(titles)}
    waiting = [one for one in answers if one.waiting]
    by_part: dict[tuple[str, str], list[Answer]] = {}
    for one in sorted(answers, key=lambda one: (order.get(one.question, len(order)), one.question, one.part)):
        by_part.setdefault(one.where, []).append(one)
    rows = tuple(
        (
            f"{question} {part}",
            titles.get(question, ""),
            str(len(left)),
            str(len(those)),
            points(sum(one.mark.out_of for one in left)),
        )
        for (question, part), those in by_part.items()
        if (left := [one for one in those if one.waiting])
    )
    first = (
        "To be read: {answers}, worth {points}.".format(
            answers=plural(len(waiting), "{count} answer", "{count} answers"),
            points=worth(sum(one.mark.out_of for one in waiting)),
        )
        if waiting
        else "No answer waits for a person."
    )
    head = ("Part", "Question", "Waiting", "Of", "Points")
    return Section("Waiting for a person", first, (), (Table(head, rows, frozenset({2, 3, 4})),), urgent=bool(waiting))


def asked(answers: Sequence[Answer]) -> Section:
    """Answers about which a scorer asks the instructor."""
    found = [(one, act) for one in answers if one.asked and (act := one.last()) is not None]
    rows = tuple(
        (one.student, f"{one.question} {one.part}", act.actor, moment(act.when), _cut(act.remark)) for one, act in found
    )
    first = (
        "For you to decide, as a scorer asked: {answers}.".format(
            answers=plural(len(found), "{count} answer", "{count} answers")
        )
        if found
        else "No scorer asks you."
    )
    head = ("Student", "Part", "Asked by", "When", "What")
    return Section("Asked of the instructor", first, (), (Table(head, rows),), urgent=bool(found))


def requests(there: Sequence[Request]) -> Section:
    """What students asked to have looked at again."""
    left = [one for one in there if one.answered is None]
    rows = tuple(
        (str(one.number), one.student, f"{one.question} {one.part}", moment(one.made), _cut(one.text)) for one in left
    )
    first = (
        "{open} not answered; {answered} answered.".format(
            open=plural(len(left), "{count} request", "{count} requests"), answered=len(there) - len(left)
        )
        if there
        else "Nobody asks to have anything looked at again."
    )
    more = (f"{program.name()} requests answer NUMBER TEXT --by NAME answers one.",) if left else ()
    head = ("Number", "Student", "Part", "Since", "What")
    table = Table(head, rows, frozenset({0}))
    return Section("Requests to look again", first, more, (table,), urgent=bool(left))


def faults(everybody: Sequence[Graded]) -> Section:
    """Parts that could not be marked, through a fault of the key."""
    count: dict[tuple[str, str], int] = {}
    lines: dict[str, None] = {}
    for graded in everybody:
        for one in graded.marks:
            if one.status == Status.NOT_MARKED and not graded.run.key.startswith(FAILED):
                count[one.where] = count.get(one.where, 0) + 1
        lines |= dict.fromkeys(key_faults(graded))
    rows = tuple((f"{question} {part}", str(number)) for (question, part), number in count.items())
    first = (
        (
            f"Could not be marked: {plural(len(count), '{count} part', '{count} parts')}. Mend the key, and say "
            f"{program.name()} regrade."
        )
        if count
        else "The key had no fault."
    )
    table = Table(("Part", "Students"), rows, frozenset({1}))
    return Section("Faults of the key", first, tuple(lines), (table,), urgent=bool(count))


def _cut(text: str) -> str:
    words = " ".join(text.split())
    return words if len(words) <= _LONGEST else f"{words[:_LONGEST]}…"
