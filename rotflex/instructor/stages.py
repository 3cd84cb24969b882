"""What a student handed in before, and now: hand-ins come in stages, and a gradebook keeps all of them."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence

from rotflex.courseware.files import COURSE_FILE
from rotflex.instructor.gradebook import Delivery, Gradebook
from rotflex.instructor.running import intake
from rotflex.instructor.running.intake import Delivered, Item, Submission


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


def _delivery(item: Item) -> Delivery:
    digest = hashlib.sha256(item.content).hexdigest()
    return Delivery(item.name, digest, item.content, item.received, item.source)
