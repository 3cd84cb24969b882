"""The gradebook: what a class handed in, what it earned, and who changed which mark, when and why. Instructor only.

==============  ======================================================================================================
``records``     what goes in and comes out: plain dataclasses
``storable``    untrusted text and numbers, as every database takes them
``roster``      the CSV of a class → students
``tables``      the tables
``migrations``  how they came to be, revision by revision
``schema``      a new, an old or somebody else's database → one with these tables
``database``    SQLite or PostgreSQL behind one pair of transactions, reading and writing
``rows``        records ↔ rows, inside a transaction
``store``       :class:`Gradebook`, one transaction to a method
``dump``        the whole content in canonical order
==============  ======================================================================================================

It is a general package: it knows of students, questions and points, but of no course, and depends on ``errors`` and
``courseware`` alone.
"""

from __future__ import annotations

from rotflex.instructor.gradebook.records import (
    GIVEN_BY_A_PERSON,
    AuditRecord,
    CommentRecord,
    Delivery,
    GivenMark,
    Graded,
    MarkRecord,
    MarkState,
    RosterReport,
    RunRecord,
    StudentRecord,
)
from rotflex.instructor.gradebook.store import Gradebook

__all__ = [
    "GIVEN_BY_A_PERSON",
    "AuditRecord",
    "CommentRecord",
    "Delivery",
    "GivenMark",
    "Gradebook",
    "Graded",
    "MarkRecord",
    "MarkState",
    "RosterReport",
    "RunRecord",
    "StudentRecord",
]
