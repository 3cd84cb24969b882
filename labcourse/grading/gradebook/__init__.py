"""The gradebook: what a class handed in, what it earned, and who changed which mark, when and why. Instructor only.

==============  ======================================================================================================
``records``     the tables, as dataclasses: what goes in and comes out
``guards``      what the database itself refuses
``database``    SQLite or PostgreSQL behind two kinds of transactions, reading and writing; the version of the tables
``storable``    untrusted text and data, as every database accepts them
``roster``      the CSV of a class → students
``marks``       students, marks that count, decisions and the audit trail, inside a transaction
``persons``     a copy of all data of a person, and erasing it, one transaction a method
``store``       :class:`Gradebook`, with scoring and requests to look again, one transaction a method
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
