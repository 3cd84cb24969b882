"""The gradebook: what a class handed in and earned, and who changed which mark, when and why. Instructor only.

==============  ======================================================================================================
``records``     the tables, as dataclasses: what goes in and comes out
``database``    SQLite or PostgreSQL in two kinds of transactions, reading and writing; its version
``storable``    clean untrusted text and data, so that every database accepts them
``roster``      read the students of a class from a CSV
``persons``     look up students and their records; copy and erase all data of a person
``store``       :class:`Gradebook`: submissions, marks, comments, the audit trail and scoring
==============  ======================================================================================================

It is a general package: it knows of students, questions and points, but of no course, and depends on
the mark (:mod:`labcourse.grading.marks`), and on modules of ``labcourse`` that know no course, alone.
"""

from __future__ import annotations

from labcourse.grading.gradebook.records import DECIDED as DECIDED
from labcourse.grading.gradebook.records import ON_DISK as ON_DISK
from labcourse.grading.gradebook.records import Act as Act
from labcourse.grading.gradebook.records import Answer as Answer
from labcourse.grading.gradebook.records import Arrival as Arrival
from labcourse.grading.gradebook.records import AuditRecord as AuditRecord
from labcourse.grading.gradebook.records import CommentRecord as CommentRecord
from labcourse.grading.gradebook.records import Delivery as Delivery
from labcourse.grading.gradebook.records import Erased as Erased
from labcourse.grading.gradebook.records import Excuse as Excuse
from labcourse.grading.gradebook.records import GivenMark as GivenMark
from labcourse.grading.gradebook.records import Graded as Graded
from labcourse.grading.gradebook.records import MarkState as MarkState
from labcourse.grading.gradebook.records import Publication as Publication
from labcourse.grading.gradebook.records import RunRecord as RunRecord
from labcourse.grading.gradebook.records import Stored as Stored
from labcourse.grading.gradebook.records import StudentRecord as StudentRecord
from labcourse.grading.gradebook.records import Take as Take
from labcourse.grading.gradebook.records import Token as Token
from labcourse.grading.gradebook.store import Gradebook as Gradebook
from labcourse.grading.gradebook.store import standing as standing
from labcourse.grading.gradebook.store import with_given as with_given
