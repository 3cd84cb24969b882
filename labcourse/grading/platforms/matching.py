"""Whose row is whose: by ID, login or e-mail, as the roster has them. Nobody is guessed, and a name finds nobody.

A name may only contradict: where nothing but a number of the platform's own leads to a student, and the names have not
a word in common, it is another student's number by chance.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from labcourse.grading.gradebook import StudentRecord
from labcourse.grading.intake.platforms import BRIGHTSPACE, plain_letters
from labcourse.grading.platforms.recognised import Export, Key
from labcourse.student_id import caseless

_PARTICIPANT = re.compile(r"\w+ (?=\d+$)")  # Moodle's "Participant 1234567"


@dataclass(frozen=True)
class Matches:
    """Whose row is whose.

    Attributes
    ----------
    found : row → student
    unknown : rows of students that the gradebook does not have
    refused : rows that may be of one student or another → why they are nobody's
    missing : students of the gradebook who have no row
    """

    found: dict[int, StudentRecord]
    unknown: tuple[int, ...]
    refused: dict[int, str]
    missing: tuple[StudentRecord, ...]


def match(export: Export, students: Sequence[StudentRecord]) -> Matches:
    """Find the students of a gradebook in a platform's file.

    Parameters
    ----------
    export : the platform's file
    students : the gradebook's
    """
    known, numbers = known_by(students), known_by(students, _number)
    records = {one.student: one for one in students}
    candidates: dict[int, str] = {}
    unknown, refused, seen = [], {}, set[str]()
    for row in export.students:
        led = {
            key: (numbers if key.internal else known).get(caseless(value), set()) for key, value in _values(export, row)
        }
        own = set().union(*(found for key, found in led.items() if not key.internal))
        several = own or set().union(*led.values())
        seen |= several
        if not several:
            unknown.append(row)
        elif len(several) > 1:
            refused[row] = _several(led)
        elif not own and _contradicts(export.name(row), records[min(several)].name):
            (student,) = several
            refused[row] = f"only a number of {export.platform}'s own leads to {student!r}, who has another name."
        else:
            (candidates[row],) = several
    for student in set(candidates.values()):
        rows = [row for row, one in candidates.items() if one == student]
        for row in rows if len(rows) > 1 else ():
            del candidates[row]
            refused[row] = f"several lines lead to {student!r}."
    missing = tuple(one for one in students if one.student not in seen)
    found = {row: records[student] for row, student in candidates.items()}
    return Matches(found, tuple(unknown), dict(sorted(refused.items())), missing)


def known_by(students: Sequence[StudentRecord], form: Callable[[str], str] = str) -> dict[str, set[str]]:
    """IDs, e-mails and other names of students, in the form in which they are compared → whose, by ID."""
    known: dict[str, set[str]] = {}
    for one in students:
        for name in filter(None, (one.student, one.email, *one.aliases)):
            known.setdefault(caseless(form(name)), set()).add(one.student)
    return known


def _number(name: str) -> str:
    """A platform's own number, of "Participant 1234567" as well. Elsewhere 1234567 may be another student's ID."""
    return _PARTICIPANT.sub("", name)


def _values(export: Export, row: int) -> Iterator[tuple[Key, str]]:
    """What a row's student is known by, column by column."""
    for key in export.keys:
        value = export.table.cell(row, key.place).strip()
        if export.platform == BRIGHTSPACE:
            value = value.removeprefix("#")
        if value:
            yield key, _number(value) if key.internal else value


def _several(led: dict[Key, set[str]]) -> str:
    told = (
        f"{key.heading} is that of {', '.join(sorted(students))}"
        for key, students in led.items()
        if students and not key.internal
    )
    return f"it may be one or another: {'; '.join(told) or 'its number is that of several'}."


def _contradicts(theirs: str, ours: str) -> bool:
    """Whether two names are both known and have not a word in common."""
    one, other = ({plain_letters(word) for word in name.split()} - {""} for name in (theirs, ours))
    return bool(one and other) and not one & other
