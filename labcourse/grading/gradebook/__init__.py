"""The gradebook: what a class handed in, what it earned, and who changed which mark, when and why. Instructor only.

==============  ======================================================================================================
``records``     the tables, as dataclasses: what goes in and comes out
``guards``      what the database itself refuses
``database``    SQLite or PostgreSQL behind two kinds of transactions, reading and writing; the version of the tables
``storable``    untrusted text and data, as every database accepts them
``roster``      the CSV of a class → students
``persons``     look up students and their records; copy and erase all data of a person
``store``       :class:`Gradebook`, with marks that count, the audit trail, scoring and requests
==============  ======================================================================================================

It is a general package: it knows of students, questions and points, but of no course, and depends on
``labcourse.errors``, ``messages``, ``program`` and ``student_id`` alone.
"""

from __future__ import annotations

from labcourse.grading.gradebook.records import (
    DECIDED,
    FOR_A_PERSON,
    GIVEN_BY_A_PERSON,
    Act,
    Answer,
    Arrival,
    AuditRecord,
    CommentRecord,
    Delivery,
    Erased,
    GivenMark,
    Graded,
    MarkRecord,
    MarkState,
    Publication,
    Request,
    RunRecord,
    StudentRecord,
)
from labcourse.grading.gradebook.store import Gradebook, standing

__all__ = [
    "DECIDED",
    "FOR_A_PERSON",
    "GIVEN_BY_A_PERSON",
    "Act",
    "Answer",
    "Arrival",
    "AuditRecord",
    "CommentRecord",
    "Delivery",
    "Erased",
    "GivenMark",
    "Gradebook",
    "Graded",
    "MarkRecord",
    "MarkState",
    "Publication",
    "Request",
    "RunRecord",
    "StudentRecord",
    "standing",
]
