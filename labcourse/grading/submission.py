"""A submission: all that is known of what a student handed in, on its way from the class's folder to the marks.

It is one object. Each step of grading fills its part, and reads what the steps before it filled:

============  ==========================================================  =============================================
step          where                                                       what it fills
============  ==========================================================  =============================================
find          :func:`labcourse.grading.intake.finding.find`               the student, the pieces, the partners
read          :func:`labcourse.grading.intake.reading.read`               the files of the pieces, and what cannot be
                                                                          read
choose        ``Batch._count``                                            which versions of the notebooks may count, of
                                                                          all that was ever handed in; the next six
                                                                          steps are taken once for each folder that has
                                                                          to be run
prepare       :func:`labcourse.grading.running.prepared.prepare`          the release, and the notebooks to run
identify      ``Batch._identify``                                         the digests by which an equal run is known
run           ``Batch._run``                                              what came back from the sandbox: claims
explain       ``Batch._explain``                                          why answers are missing
mark          :func:`labcourse.grading.marking.marking.mark`              the marks
count         :func:`labcourse.grading.counting.assembled`                what counts, put together from the runs
store         ``Batch._store``                                            what counts in the gradebook
============  ==========================================================  =============================================

The gradebook stores a part of it as a ``RunRecord`` (:mod:`labcourse.grading.graded_run`).
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

from labcourse.answers.cell_reports import CellReports
from labcourse.answers.report_files import ReportFile
from labcourse.answers.words import TextAnswer
from labcourse.benches import BenchPolicy
from labcourse.grading.marks import Mark
from labcourse.problems import Problem, Reason, Where

if TYPE_CHECKING:
    from labcourse.answers.notebooks import Cell
    from labcourse.grading.gradebook.records import Delivery, Graded
    from labcourse.grading.intake.archives import StoredFile
    from labcourse.grading.intake.platforms import Label
    from labcourse.grading.running.bundle import Bundle
    from labcourse.run.merge import Merged
    from labcourse.run.portability import Version
    from labcourse.run.reasons import CellIdsAtHome

NEVER = datetime.fromtimestamp(0, UTC)

#: What an instructor may decide, besides a file (by its name in the course).
OWNER, TIME_RECEIVED, PARTNER, PLATFORM = "owner", "time received", "partner", "platform"
#: :attr:`Doubt.key` → what the instructor decided, as text.
Decisions = Mapping[tuple[str, str], str]


@dataclass(frozen=True)
class Doubt:
    """A row of ``intake.csv``: something that an instructor may decide.

    Attributes
    ----------
    submission : path of the folder, archive or file in the class's folder; for a partner, ID of the student who named
        them
    about : :data:`OWNER`, :data:`TIME_RECEIVED`, :data:`PARTNER` or :data:`PLATFORM`; or the name of a file of the
        course, if several of the submission may be it
    assumed : what counts without a decision; "" for nothing
    why : reasons for the doubt; texts if the row was read from the file
    alternatives : what it may be instead, as text; of a time, when the files were saved; of a partner, their ID
    content : of an owner or a file, what the files in doubt hold, from :func:`content_name`; "" for anything
    """

    submission: str
    about: str
    assumed: str
    why: tuple[Reason, ...]
    alternatives: str = ""
    content: str = ""

    @property
    def key(self) -> tuple[str, str]:
        """The key of the row in :data:`Decisions`; it has the partner, when the files were saved, or their content."""
        of = self.alternatives if self.about in (TIME_RECEIVED, PARTNER) else self.content
        return self.submission, f"{self.about}: {of}" if of else self.about

    def decided(self, decisions: Decisions) -> str:
        """Return what was decided on this row, or else on one that leaves the content open; "" for nothing yet.

        Somebody else's file may have the same name a week later, so a row that leaves it open is written anew with it.
        """
        return decisions.get(self.key) or decisions.get((self.submission, self.about), "")


def content_name(parts: Iterable[bytes]) -> str:
    """Return a name for what files hold, which is short enough for a table: equal for equal content."""
    digest = hashlib.sha256()
    for part in parts:
        digest.update(len(part).to_bytes(8, "big") + part)
    return digest.hexdigest()[:12]


@dataclass(frozen=True)
class Owner:
    """The students to whom a piece belongs.

    Attributes
    ----------
    students : IDs of the students that its name says; none if nobody was identified
    claimed : IDs of further students whom its course.json names
    waiting : those of ``claimed`` whom a person has to confirm; until then nothing of the submission is theirs
    declined : those of ``claimed`` who are no partners, as the instructor decided
    bench_of : ID of the student with the bench that was used
    attempt : number of the attempt, or of the copy, in the name; the higher, the later
    group : the platform's group in the name; "" without one
    is_certain : whether the name is on the roster, be it of several students
    is_decided : whether the instructor decided this
    problems : contradictions about the owner; if nobody was identified, the reasons
    notes : what else is worth knowing about the owner
    """

    students: tuple[str, ...] = ()
    claimed: tuple[str, ...] = ()
    waiting: tuple[str, ...] = ()
    declined: tuple[str, ...] = ()
    bench_of: str = ""
    attempt: int = 0
    group: str = ""
    is_certain: bool = False
    is_decided: bool = False
    problems: tuple[Problem, ...] = ()
    notes: tuple[Problem, ...] = ()

    @property
    def everybody(self) -> tuple[str, ...]:
        """IDs of all students to whom the piece belongs: partners who count last, without those waiting or declined."""
        return (*self.students, *(name for name in self.claimed if name not in (*self.waiting, *self.declined)))


@dataclass(frozen=True, kw_only=True)
class Piece:
    """What a student handed in at one time: a folder, an archive, or loose files.

    Attributes
    ----------
    source : path in the class's folder, which may lead through archives
    name : name that says who handed it in: of the folder, archive or file, without the ending of an archive
    outer : name of the folder, archive or file among the submissions that holds this piece, or is it
    label : what the name says if a platform gave it; None if the student did
    archived : when the archive or file among the submissions was received, UTC; None if that is not known
    copy : number of the copy in the name of an archive within the submission; the higher, the later
    files : path → file
    refused : path → reason why it is not read
    trouble : why nothing of it can be read; empty if it can be read
    course : content of its course.json; empty if it has none that can be read
    owner : the students to whom it belongs
    received : time of receipt, UTC; when it was saved, if no time of receipt is known
    clock : how the time of receipt is known; "" if only the student's computer wrote it
    saved : when it was saved, UTC, by the student's computer
    """

    source: str
    name: str
    outer: str = ""
    label: Label | None = None
    archived: datetime | None = None
    copy: int = 0
    files: Mapping[str, StoredFile] = field(default_factory=dict)
    refused: Mapping[str, Problem] = field(default_factory=dict)
    trouble: tuple[Problem, ...] = ()
    course: Mapping[str, Any] = field(default_factory=dict)
    owner: Owner = field(default_factory=Owner)
    received: datetime = NEVER
    clock: str = ""
    saved: datetime = NEVER

    @property
    def folder_of(self) -> str:
        """ID of the student who owns the folder that it was done in; "" if nothing says it.

        It is the student of its course.json. Without one, it is the first of several students in its name.
        """
        return self.owner.bench_of if self.course or len(self.owner.students) > 1 else ""


@dataclass(kw_only=True)
class Submission:
    """All that a student handed in, and what became of it.

    Attributes
    ----------
    student : ID of the student
    problems, notes : what went wrong, and what is worth knowing; each step adds its own

    pieces : found: all that the student handed in, in order of time
    bench_of : ID of the student with the bench for the run: a partner's, if several handed in together
    partners : IDs of the students with whom it was handed in
    unconfirmed : pieces that others handed in who name this student as a partner, while no person has confirmed that

    items : read: all files of the pieces, in order of time, until they are stored; notebooks without outputs
    names : names of all files of the pieces, also of those that are not read
    has_notebooks : whether notebooks of the course are among the items
    python : newest version of Python with which a notebook was saved; None if no notebook says it
    faults : problems that stay, whatever is read later
    unread : name of a file of the course → why it cannot be read; removed when a later one is read
    unreadable : pieces that cannot be read; moved to the notes when a later piece has notebooks
    doubts : rows of ``intake.csv``: what an instructor may decide
    waiting : file name of a notebook in the unconfirmed pieces → IDs of the students who handed it in

    notebooks : what counts of all that was ever handed in: notebook's file name → its cells
    files : the student's own files beside the notebooks: relative path, with "/" → content
    answers_at_home : the student's own answers.json, which is only compared with what a run records; None without one
    course : content of the student's course.json; empty without one
    pdfs : file name of a report's PDF → content of the PDF; nothing of it is run

    bundle : prepared: the release that the submission is run with
    merged : the notebooks to run
    words : (question, part) → answer in words, from the saved notebooks
    claim : by which cells answers were recorded at home; None if that is not known
    supplied : "1.2.speed" → value that the instructor supplied in place of a missing answer
    untouched : names of notebooks, without ending, in which the student changed nothing

    key : identified: digest of all that marks depend on besides the course's key
    ran : digest of all that the run depends on: a partner's run with the same need not be repeated
    digest : digest of the whole submission, problems and notes included
    prepared_from : digest of all that it was prepared from
    probe_seed : seed from which the inputs of functions are drawn

    answers : run: content of the answers' file; None if there is none; untrusted, like the next two
    cell_reports : what the cells reported
    evidence : what the course's function read from the student's files in the sandbox, JSON
    ended : what went wrong with the run as a whole

    missing : explained: (question, part) → why there is no answer, where that is known
    asked : the (question, part) that the student's release asks for; None if that is all that the course asks for
    policy : which bench each student had; None if it is not known
    documents : number of a report → the PDF that was handed in
    waits : the (question, part) of missing notebooks that are in ``waiting``

    marks : of the key, in its order
    before : run and marks that counted before; None without any
    graded : run and marks that count now
    is_new : whether the marks were made just now; else they are those before
    has_run : whether it was run just now; else the gradebook had the run already
    """

    student: str
    problems: list[Problem] = field(default_factory=list)
    notes: list[Reason] = field(default_factory=list)

    pieces: tuple[Piece, ...] = ()
    bench_of: str = ""
    partners: tuple[str, ...] = ()
    unconfirmed: tuple[Piece, ...] = ()

    items: list[Delivery] = field(default_factory=list)
    names: set[str] = field(default_factory=set)
    has_notebooks: bool = False
    python: Version | None = None
    faults: list[Problem] = field(default_factory=list)
    unread: dict[str, Problem] = field(default_factory=dict)
    unreadable: list[Problem] = field(default_factory=list)
    doubts: list[Doubt] = field(default_factory=list)
    waiting: dict[str, list[str]] = field(default_factory=dict)

    notebooks: Mapping[str, tuple[Cell, ...]] = field(default_factory=dict)
    files: Mapping[str, bytes] = field(default_factory=dict)
    answers_at_home: bytes | None = None
    course: Mapping[str, Any] = field(default_factory=dict)
    pdfs: Mapping[str, bytes] = field(default_factory=dict)

    bundle: Bundle = field(init=False, repr=False, compare=False)
    merged: Merged = field(init=False, repr=False, compare=False)
    words: Mapping[Where, TextAnswer] = field(default_factory=dict)
    claim: CellIdsAtHome | None = None
    supplied: Mapping[str, Any] = field(default_factory=dict)
    untouched: tuple[str, ...] = ()

    key: str = ""
    ran: str = ""
    digest: str = ""
    prepared_from: str = ""
    probe_seed: int = 0

    answers: bytes | None = None
    cell_reports: CellReports = field(default_factory=CellReports)
    evidence: bytes = b""
    ended: tuple[Problem, ...] = ()

    missing: Mapping[Where, Reason] = field(default_factory=dict)
    asked: list[Where] | None = None
    policy: BenchPolicy | None = None
    documents: Mapping[str, ReportFile] = field(default_factory=dict)
    waits: list[Where] = field(default_factory=list)

    marks: tuple[Mark, ...] = ()
    before: Graded | None = None
    graded: Graded = field(init=False, repr=False, compare=False)
    is_new: bool = True
    has_run: bool = True

    def __post_init__(self) -> None:
        self.bench_of = self.bench_of or self.student

    @property
    def handed_in(self) -> tuple[str, ...]:
        """File names of the course's notebooks that were handed in."""
        return tuple(sorted(self.notebooks))

    @property
    def sources(self) -> set[str]:
        """Paths of its pieces in the class's folder, also of those that nobody confirmed."""
        return {piece.source for piece in (*self.pieces, *self.unconfirmed)}

    @property
    def supplied_parts(self) -> set[Where]:
        """The (question, part) of the values that an instructor supplied."""
        return {(question, part) for question, _dot, part in (name.rpartition(".") for name in self.supplied)}
