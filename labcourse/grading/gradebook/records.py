"""What goes into a gradebook and comes out of it: plain data, that outlives the connection."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any, NamedTuple

#: The statuses of marks that a person set, and is to set.
GIVEN_BY_A_PERSON, FOR_A_PERSON = "given by a person", "for a person"


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
    cells : what the cells reported while they ran, in order
    claim : question → part → id of the cell that recorded it when the student ran it
    words : question → part → ``{"text": ..., "pictures": {name: PNG in base64}}``: answers read from text cells
    supplied : values that an instructor gave in place of missing ones: as "1.2.speed" → value
    release : identity of the release that it was run under; empty where it has none
    files : names of the student's own files that came along

    The last six are plain data as JSON has it: lists, and no tuples; finite numbers.
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
    cells: tuple[Mapping[str, Any], ...] = ()
    claim: Mapping[str, Any] = field(default_factory=dict)
    words: Mapping[str, Any] = field(default_factory=dict)
    supplied: Mapping[str, Any] = field(default_factory=dict)
    release: str = ""
    files: tuple[str, ...] = ()


@dataclass(frozen=True)
class GivenMark:
    """A mark that a person gave, who, and when (UTC)."""

    mark: MarkRecord
    actor: str
    when: datetime


@dataclass(frozen=True)
class Graded:
    """A run with its marks.

    Attributes
    ----------
    run : the run
    marks : in the order of the key; a person's mark in place of the software's, where it holds
    key_digest : of the key that they were made with
    lapsed : marks by persons that do not hold for this run: another answer was given, or it is out of other points. The
        gradebook tells them, and takes none
    """

    run: RunRecord
    marks: tuple[MarkRecord, ...]
    key_digest: str
    lapsed: tuple[GivenMark, ...] = ()


@dataclass(frozen=True)
class StudentRecord:
    """A student; all but the ID may be empty.

    ``aliases`` are other names by which platforms know them; ``enrolled`` says whether they are on the roster, and not
    only known from what they handed in.
    """

    student: str
    name: str = ""
    email: str = ""
    section: str = ""
    aliases: tuple[str, ...] = ()
    enrolled: bool = False


@dataclass(frozen=True)
class Delivery:
    """A file that a student handed in.

    Attributes
    ----------
    name : a notebook's file name, an own file's path relative to the folder, "answers.json" or "course.json"
    digest : by which equal content is known
    content : as it was handed in, or what is kept of it
    received : when
    source : what it came in, for people, as the name of a zip
    clock : how the time is known; "" where only the student's computer wrote it, None where nothing was recorded of it
    """

    name: str
    digest: str
    content: bytes
    received: datetime
    source: str = ""
    clock: str | None = None


DECIDED = "as the instructor decided"  #: how a time of arrival, or an owner, may be known


class Arrival(NamedTuple):
    """When a file came, and how that is known: as :class:`Delivery` has them."""

    received: datetime
    clock: str | None = None


@dataclass(frozen=True)
class RosterReport:
    """What became of a roster.

    Attributes
    ----------
    added, changed, unchanged : numbers of students
    problems : a word on each line that was not taken
    notes : a word on all that was replaced, removed, kept though its cell is empty, or not read
    """

    added: int
    changed: int
    unchanged: int
    problems: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


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


@dataclass(frozen=True)
class Erased:
    """What became of a person who was erased, or would.

    Attributes
    ----------
    about : what was known of them
    counts : name of a table → how many rows of it were theirs
    struck : where their name was taken out of what is said of others, in words
    left : where they are named still, in words: others' own work, and as who decided
    sources : what their hand-ins came in, as the names of zips
    unsought : of what names them, what is too short to be looked for
    """

    about: StudentRecord
    counts: Mapping[str, int]
    struck: tuple[str, ...] = ()
    left: tuple[str, ...] = ()
    sources: tuple[str, ...] = ()
    unsought: tuple[str, ...] = ()
