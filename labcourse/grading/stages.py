"""What a student handed in before, and now: hand-ins come in stages, and a gradebook keeps all of them."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence

from labcourse.files import COURSE_FILE
from labcourse.grading.gradebook import DECIDED, Delivery, Gradebook
from labcourse.grading.running import intake
from labcourse.grading.running.intake import Delivered, Item, Submission
from labcourse.student_id import caseless


def named_in(gradebook: Gradebook) -> Callable[[str], list[str] | None]:
    """Whom a student's own course.json named, as it was handed in last, of a student; None if nothing was."""

    def named(student: str) -> list[str] | None:
        delivered = {one.name: one for one in gradebook.delivered(student)}
        if not delivered:
            return None
        return intake.named_in(delivered[COURSE_FILE].content) if COURSE_FILE in delivered else []

    return named


def kept(gradebook: Gradebook, submission: Submission, read: Sequence[Delivered]) -> tuple[list[str], list[Delivery]]:
    """Keep what is new of a submission.

    What a partner says is this student's as well stays among the partner's: nobody else's word, with whatever time, may
    stand before what this student hands in.

    Parameters
    ----------
    gradebook : where it is kept
    submission : as it was found
    read : what is in it

    Returns
    -------
    tuple
        names of what was there before, and all that was handed in until now
    """
    holder = submission.claimed_by or submission.student
    earlier = gradebook.delivered(holder)
    names = [one.name for one in earlier]
    delivered = [_delivery(item) for one in read for item in one.items()]
    if submission.claimed_by:
        return names, [*earlier, *delivered]
    gradebook.deliver(holder, delivered)
    return names, gradebook.delivered(holder)


def given_over(gradebook: Gradebook, found: Sequence[Submission]) -> list[Submission]:
    """Take submissions from those who counted as their owners before an instructor decided otherwise.

    Returns
    -------
    list
        an empty submission for each of them who handed in nothing else, so that their marks are made anew
    """
    there = {caseless(one.student) for one in found}
    losing: dict[str, Submission] = {}
    for piece, owner in ((piece, one.student) for one in found for piece in one.pieces if piece.rule == DECIDED):
        for student in gradebook.give_over(piece.source, piece.received, owner):
            why = f"{piece.source} is {owner}'s, as the instructor decided."
            losing[student] = Submission(student, problems=(why,))
    return [one for student, one in losing.items() if caseless(student) not in there]


def without_erased(
    gradebook: Gradebook, found: Sequence[Submission], again: Sequence[str]
) -> tuple[list[Submission], list[str]]:
    """What was found, but for what is of persons who were erased, and a sentence on each of these.

    Parameters
    ----------
    gradebook : which knows who was erased
    found : in the class's folder
    again : IDs of those who are taken in as new persons
    """
    theirs = gradebook.persons.erased([one.student for one in found])
    wanted = set(map(caseless, again))
    gone = {one: when for one, when in theirs.items() if caseless(one) not in wanted}
    told = [
        (
            f"{one} was erased on {when:%Y-%m-%d}, and what they handed in is here still. It is not taken in: take "
            f"it away. If they begin anew, say --again {one}."
        )
        for one, when in gone.items()
    ]
    benches = gradebook.persons.erased(list({one.bench_of for one in found if one.bench_of}))
    told += [
        (
            f"{one.student} handed in work that names {one.bench_of}, who was erased on "
            f"{benches[one.bench_of]:%Y-%m-%d}: take {one.bench_of} out of its course.json and its name, or the "
            "gradebook names them again."
        )
        for one in found
        if one.student not in gone and one.bench_of in benches and caseless(one.bench_of) not in wanted
    ]
    return [one for one in found if one.student not in gone], told


def _delivery(item: Item) -> Delivery:
    digest = hashlib.sha256(item.content).hexdigest()
    return Delivery(item.name, digest, item.content, item.received, item.source, item.clock)
