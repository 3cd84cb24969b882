"""What came in: pieces, and whose they are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any

from labcourse.grading.running.intake.decisions import Doubt
from labcourse.grading.running.intake.stores import Entry, Where


@dataclass(frozen=True)
class Piece:
    """Something that a student handed in at one time: a folder, a zip, or loose files.

    Attributes
    ----------
    source : its name for people, from the class's folder on
    where : the store that has its files
    files : path, as the student named it, → file in the store
    others : path → why it is not read
    received : when it was handed in, UTC
    clock : how that is known, in words; "" where only the student's computer wrote the time
    rule : how the student was found, in words
    order : of those received at one time, the higher came later
    course : what its course.json says, unchecked
    trouble : why nothing of it can be read; "" where it can
    """

    source: str
    where: Where
    files: Mapping[str, Entry]
    received: datetime
    clock: str
    rule: str = ""
    others: Mapping[str, str] = field(default_factory=dict)
    order: tuple[int, datetime, int] = (0, datetime.min, 0)
    course: Mapping[str, Any] = field(default_factory=dict)
    trouble: str = ""

    @property
    def when(self) -> tuple[datetime, tuple[int, datetime, int]]:
        """By which pieces are put in order of time."""
        return self.received, self.order


@dataclass(frozen=True)
class Submission:
    """All that a student handed in.

    Attributes
    ----------
    student : ID
    pieces : in order of time
    bench_of : ID of the student whose bench it is to be run on: another's, where several handed in together
    partners : IDs of those with whom it was handed in
    claimed_by : ID of the partner whose course.json alone says that it is this student's, too; "" for their own
    problems : what was contradictory about whose it is
    notes : what else is worth knowing about that
    """

    student: str
    pieces: tuple[Piece, ...] = ()
    bench_of: str = ""
    partners: tuple[str, ...] = ()
    claimed_by: str = ""
    problems: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Found:
    """What is in a class's folder.

    Attributes
    ----------
    submissions : one for each student, by ID
    ignored : a sentence on everything that is not taken
    doubts : what an instructor may decide otherwise
    """

    submissions: list[Submission]
    ignored: list[str]
    doubts: list[Doubt] = field(default_factory=list)
