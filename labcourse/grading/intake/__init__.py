"""Taking in what students hand in, however a learning platform packs and names it (docs/handing_in.md).

=============  =======================================================================================================
``archives``   folders, zips and tars, read alike and within limits
``platforms``  a pattern for each platform's names; lists of times
``owners``     who: the roster and the name of a submission; partners
``finding``    a class's folder → the submissions of each student, with owner and time: :func:`find`
``reading``    which: a submission → cells, own files, what was recorded at home: :func:`read`, :func:`newest`
=============  =======================================================================================================

What is ambiguous is a :class:`Doubt`, a row of ``intake.csv`` for the instructor to decide.
"""

from labcourse.grading.intake.finding import (
    OWNER,
    PARTNER,
    PLATFORM,
    TIME_RECEIVED,
    ClassFolder,
    Decisions,
    Doubt,
    Submission,
    find,
)
from labcourse.grading.intake.owners import students_in
from labcourse.grading.intake.reading import (
    Master,
    ReadSubmission,
    is_answered,
    is_unread,
    newest,
    read,
)

__all__ = [
    "OWNER",
    "PARTNER",
    "PLATFORM",
    "TIME_RECEIVED",
    "ClassFolder",
    "Decisions",
    "Doubt",
    "Master",
    "ReadSubmission",
    "Submission",
    "find",
    "is_answered",
    "is_unread",
    "newest",
    "read",
    "students_in",
]
