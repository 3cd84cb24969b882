"""What goes into a gradebook and comes out of it: plain data, that outlives the connection."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime

#: The status of a mark that a person set.
GIVEN_BY_A_PERSON = "given by a person"


@dataclass(frozen=True)
class MarkRecord:
    """The mark for one part of a question.

    Attributes
    ----------
    question, part : which
    status : in a few words, as "right" or "given by a person"
    points, out_of : earned, and possible
    reason : for the student
    given : the answer in a few words; the student's own
    """

    question: str
    part: str
    status: str
    points: float
    out_of: float
    reason: str
    given: str = ""

    @property
    def where(self) -> tuple[str, str]:
        """Question and part."""
        return self.question, self.part


@dataclass(frozen=True)
class RunRecord:
    """One run of a submission.

    Attributes
    ----------
    key : hash of all that the run depends on, the student included: two runs with one key are the same run
    student : ID, as the submission spells it
    submission : digest of what was handed in
    master : digest of the notebooks that it was run in
    software : name and version
    probe_seed : from which the inputs of functions were drawn
    isolation : how it was run
    answers : what it left; None if nothing
    problems : what went wrong
    notes : what else is worth knowing
    """

    key: str
    student: str
    submission: str
    master: str
    software: str
    probe_seed: int
    isolation: str
    answers: bytes | None = None
    problems: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Graded:
    """A run with its marks, in the order of the key, and the digest of the key that they were made with."""

    run: RunRecord
    marks: tuple[MarkRecord, ...]
    key_digest: str


@dataclass(frozen=True)
class StudentRecord:
    """A student; all but the ID may be empty."""

    student: str
    name: str = ""
    email: str = ""
    section: str = ""


@dataclass(frozen=True)
class RosterReport:
    """What became of a roster: numbers of students, and a word on each line that was not taken."""

    added: int
    changed: int
    unchanged: int
    problems: tuple[str, ...] = ()


@dataclass(frozen=True)
class MarkState:
    """What of a mark is worth a line in the audit trail when it changes."""

    status: str
    points: float
    out_of: float
    reason: str


@dataclass(frozen=True)
class AuditRecord:
    """One change of one mark.

    Attributes
    ----------
    student, question, part : whose, and which
    before, after : the mark; None where there was, or is, none
    run : key of the run that counts after the change
    actor, reason, when : who changed it, why, and when (UTC)
    """

    student: str
    question: str
    part: str
    before: MarkState | None
    after: MarkState | None
    run: str
    actor: str
    reason: str
    when: datetime


@dataclass(frozen=True)
class CommentRecord:
    """A person's word to a student, on a question or, where that is None, on everything."""

    student: str
    question: str | None
    text: str
    actor: str
    when: datetime
