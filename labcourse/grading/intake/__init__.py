"""Taking in what students hand in, however a learning platform packs and names it (docs/handing_in.md).

=============  =======================================================================================================
``archives``   folders, zips and tars, read alike and within limits
``platforms``  a pattern for each platform's names; lists of times
``owners``     who: the roster and the name of a submission; partners
``finding``    a class's folder → the submissions of each student, with owner and time: :func:`find`
``reading``    which: a submission → cells, own files, what was recorded at home: :func:`read`, :func:`choose_newest`
=============  =======================================================================================================

All of them fill in a :class:`~labcourse.grading.submission.Submission`. What is ambiguous is a ``Doubt``, a row of
``intake.csv`` for the instructor to decide.
"""

from labcourse.grading.intake.finding import ClassFolder, find
from labcourse.grading.intake.owners import course_data, students_in
from labcourse.grading.intake.reading import (
    Master,
    choose_newest,
    found_digest,
    is_changed,
    is_unread,
    read,
    unread_problems,
)

__all__ = [
    "ClassFolder",
    "Master",
    "choose_newest",
    "course_data",
    "find",
    "found_digest",
    "is_changed",
    "is_unread",
    "read",
    "students_in",
    "unread_problems",
]
