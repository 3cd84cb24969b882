"""Taking in what students hand in, however a learning platform packs and names it (docs/handing_in.md).

=================  ===================================================================================================
``finding``        a class's folder → hand-ins of each student: :func:`find`
``reading``        one student's → cells, own files, what was recorded at home: :func:`read`
``delivered``      all that came, then and now → the newest of each: :func:`newest`
``labels``         what platforms write into names
``people``         which student a name means
``whose``          whose a hand-in is, by its name and by its course.json
``times``          the file that says what came when
``decisions``      what cannot be known for certain, and what an instructor decided
``scripts``        a notebook that was handed in as a program
``places``         folders and zips, alike; ``stores`` reads them, bounded
``notebooks``      a notebook without its outputs; ``notebook_names`` tells which it is
``own_files``      which of a student's own files come along
``limits``         how much of all this
=================  ===================================================================================================
"""

from labcourse.grading.running.intake.decisions import OWNER, TIME, Decisions, Doubt
from labcourse.grading.running.intake.delivered import Item, newest
from labcourse.grading.running.intake.finding import find
from labcourse.grading.running.intake.hand_ins import Found, Piece, Submission
from labcourse.grading.running.intake.reading import Delivered, is_unread, notes, problems, read
from labcourse.grading.running.intake.whose import named_in

__all__ = [
    "OWNER",
    "TIME",
    "Decisions",
    "Delivered",
    "Doubt",
    "Found",
    "Item",
    "Piece",
    "Submission",
    "find",
    "is_unread",
    "named_in",
    "newest",
    "notes",
    "problems",
    "read",
]
