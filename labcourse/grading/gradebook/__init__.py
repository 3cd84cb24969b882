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
``removal``     taking out a student of whom there is nothing
``erasing``     erasing a person, and what stays of them
``naming``      what names a person in a text
``deciding``    a person's decision on a mark: what is refused, what is written
``decided``     acts of scoring, answers as scorers see them, requests, publications: plain dataclasses
``score_rows``  acts and claims ↔ rows
``scores``      what scorers do, one transaction to a method
``requests``    requests to look again; when feedback was given back
``store``       :class:`Gradebook`, one transaction to a method
``persons``     all that there is of a person, one transaction to a method
``dump``        the whole content in canonical order
==============  ======================================================================================================

It is a general package: it knows of students, questions and points, but of no course, and depends on
``labcourse.errors``, ``messages`` and ``student_id`` alone.
"""

from __future__ import annotations

from labcourse.grading.gradebook.decided import Act, Answer, Publication, Request
from labcourse.grading.gradebook.erasing import OfOthers
from labcourse.grading.gradebook.naming import Person
from labcourse.grading.gradebook.records import (
    DECIDED,
    FOR_A_PERSON,
    GIVEN_BY_A_PERSON,
    Arrival,
    AuditRecord,
    CommentRecord,
    Delivery,
    Erased,
    GivenMark,
    Graded,
    MarkRecord,
    MarkState,
    RosterReport,
    RunRecord,
    StudentRecord,
)
from labcourse.grading.gradebook.store import Gradebook

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
    "OfOthers",
    "Person",
    "Publication",
    "Request",
    "RosterReport",
    "RunRecord",
    "StudentRecord",
]
