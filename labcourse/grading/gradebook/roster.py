"""The CSV of a class → its students.

It has a line of headings, of which these are understood, without regard to capitals, spaces and punctuation; others
are not read, and are named in a note:

===========  =========================================================================================================
ID           student ID, student number, SIS user ID, SIS ID, OrgDefinedId, ID number, username, SIS login ID, ID,
             student: the first of these that is there
name         name, full name, student name; or first and last name; or student, where that is not the ID
email        email, e-mail, email address
section      section, group, groups
other names  alias, aliases, other names (several with ; between them), Identifier, user ID, Canvas user ID, and all
             columns of IDs that are not the ID: by these, platforms name what students hand in
===========  =========================================================================================================

Missing columns and empty cells leave existing values unchanged. A cell of "-" removes the value.

Separators are commas, semicolons or tabs; the file is UTF-8 with or without a byte-order mark, or Excel's UTF-16. Cells
are text, whatever they begin with; only ``="0042"``, with which Excel preserves the zeros of a number, is 0042, and so
is ``#0042`` in a file that Brightspace wrote (it has a column OrgDefinedId).
"""

from __future__ import annotations

import codecs
import csv
import io
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from labcourse import student_id
from labcourse.errors import GradebookError, StudentIDError
from labcourse.grading.gradebook import storable
from labcourse.grading.gradebook.records import StudentRecord
from labcourse.messages import listed
from labcourse.student_id import caseless

_IDS = (
    *("studentid", "studentnumber", "sisuserid", "sisid", "orgdefinedid", "idnumber", "username", "sisloginid"),
    *("id", "student"),
)
_NAMES = ("name", "fullname", "studentname", "student")
_FIRST_NAMES, _LAST_NAMES = ("firstname", "givenname"), ("lastname", "surname", "familyname")
_EMAILS = ("email", "emailaddress")
_SECTIONS = ("section", "group", "groups")
_OTHER_NAMES = ("alias", "aliases", "othernames", "identifier", "userid", "canvasuserid")
_BRIGHTSPACES, _MARKED = "orgdefinedid", ("orgdefinedid", "username")  # its columns that begin with #
_KNOWN = {*_IDS, *_NAMES, *_FIRST_NAMES, *_LAST_NAMES, *_EMAILS, *_SECTIONS}
_REMOVED = "-"
_MOST_UNREAD = 12  # columns that are named in the note
_STAYS = "stays; the roster's cell is empty"
_EXCELS_ZEROS = re.compile(r'="([^"]*)"')


@dataclass(frozen=True)
class Entry:
    """A student as the roster has them; ``details`` holds what it has a column for: fields of StudentRecord."""

    student: str
    details: dict[str, Any]

    def update(self, record: StudentRecord) -> list[str]:
        """Write what the roster says into a record; return a note on all that it replaces, removes or leaves.

        Parameters
        ----------
        record : what is known; a new student's is empty
        """
        notes = []
        for field, cell in self.details.items():
            old, value = getattr(record, field), cell
            if cell in (_REMOVED, (_REMOVED,)):
                value = type(old)()
            if cell:
                setattr(record, field, value)
            if old and old != value:
                change = f"→ {_shown(value)}" if value else "is removed"
                name = "other names" if field == "aliases" else field
                notes.append(f"{self.student}: {name} {_shown(old)} {change if cell else _STAYS}.")
        record.student, record.enrolled = self.student, True
        return notes


def _shown(value: str | Sequence[str]) -> str:
    return repr(value if isinstance(value, str) else "; ".join(value))


@dataclass(frozen=True)
class Roster:
    """The content of a file.

    Attributes
    ----------
    entries : its students
    problems : a sentence on each line that was not taken
    notes : a sentence on the columns that are not understood, if there are any
    """

    entries: tuple[Entry, ...]
    problems: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


def read(path: Path) -> Roster:
    """Read the students of a roster, and say what was not taken of it.

    Raises
    ------
    GradebookError
        If the file cannot be read, or has no column of IDs.
    """
    lines = list(io.StringIO(_text(path), newline=""))
    skipped = 1 if lines and lines[0].lower().startswith("sep=") else 0  # a line for Excel
    del lines[:skipped]
    try:
        separator = max(",;\t", key=lambda mark: len(_KNOWN.intersection(map(_heading, _first_row(lines, mark)))))
        table = csv.reader(lines, delimiter=separator)
        columns = _Columns(path, next(table, []))
        entries: dict[str, tuple[int, Entry]] = {}
        problems = tuple(columns.read(((table.line_num + skipped, row) for row in table), entries))
    except csv.Error as error:
        raise GradebookError(f"The roster {path} is not a CSV that can be read: {error}.") from None
    notes = [f"Columns that are not read: {listed(columns.unread, _MOST_UNREAD)}."] if columns.unread else []
    return Roster(tuple(entry for _line, entry in entries.values()), problems, tuple(notes))


def _text(path: Path) -> str:
    try:
        data = path.read_bytes()
        coding = "utf-16" if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)) else "utf-8-sig"
        return data.decode(coding)
    except OSError as error:
        raise GradebookError(f"The roster {path} cannot be read: {error.strerror}.") from None
    except UnicodeDecodeError:
        raise GradebookError(f"The roster {path} is not UTF-8. In Excel, save it as 'CSV UTF-8'.") from None


def _first_row(lines: Sequence[str], separator: str) -> list[str]:
    return next(csv.reader(lines, delimiter=separator), [])


def _heading(cell: str) -> str:
    return "".join(filter(str.isalnum, cell.casefold()))


def _stripped(cell: str) -> str:
    """Return a cell's text without white space around."""
    zeros = _EXCELS_ZEROS.fullmatch(cell.strip())
    return (zeros[1] if zeros else cell).strip()


def _on_one_line(cell: str) -> str:
    return " ".join(_stripped(cell).split())


class _Columns:
    """Which field of a student stands in which columns."""

    def __init__(self, path: Path, line: list[str]) -> None:
        headings = list(map(_heading, line))

        def first(names: Iterable[str]) -> list[int]:
            return [headings.index(name) for name in names if name in headings][:1]

        student = first(_IDS)
        if not student:
            raise GradebookError(
                f"The roster {path} has no column of IDs: call one 'student', in the first line. Besides it, "
                "'name', 'email' and 'section' are understood."
            )
        self._student, self._id_heading = student[0], _on_one_line(line[student[0]])
        names = first(name for name in _NAMES if name != headings[self._student])
        names = names or [*first(_FIRST_NAMES), *first(_LAST_NAMES)]
        self._columns = {"email": first(_EMAILS), "section": first(_SECTIONS), "name": names}
        marked = _MARKED if _BRIGHTSPACES in headings else ()
        self._marked = {place for place, heading in enumerate(headings) if heading in marked}
        others = {place for place, heading in enumerate(headings) if heading in (*_IDS, *_OTHER_NAMES)}
        self._others = sorted(others - {*student, *names})
        used = {*student, *self._others, *(place for places in self._columns.values() for place in places)}
        unread = (_on_one_line(cell) for place, cell in enumerate(line) if place not in used)
        self.unread = tuple(filter(None, unread))

    def read(self, rows: Iterable[tuple[int, list[str]]], entries: dict[str, tuple[int, Entry]]) -> Iterator[str]:
        """Read numbered rows into entries, by caseless ID; yield a sentence on each row that is not taken."""
        for line, row in rows:
            if not any(map(_stripped, row)):
                continue
            if not (student := _stripped(self._cell(row, self._student))):
                yield f"Line {line} has no ID in the column {self._id_heading!r}: not taken."
                continue
            try:
                entry = Entry(student_id.normalised(student), self._details(row))
            except StudentIDError as error:
                yield f"Line {line}: {error} It is not taken."
                continue
            first, same = entries.setdefault(caseless(entry.student), (line, entry))
            if same != entry:
                yield f"Line {line}: {entry.student!r} is in line {first} already: not taken."

    def _cell(self, row: list[str], place: int) -> str:
        cell = row[place] if place < len(row) else ""
        return cell.strip().removeprefix("#") if place in self._marked else cell

    def _details(self, row: list[str]) -> dict[str, Any]:
        details: dict[str, Any] = {
            field: storable.text(" ".join(filter(None, (_on_one_line(self._cell(row, place)) for place in places))))
            for field, places in self._columns.items()
            if places
        }
        if self._others:
            cells = (_stripped(self._cell(row, place)) for place in self._others)
            names = filter(None, (_on_one_line(name) for cell in cells for name in cell.split(";")))
            details["aliases"] = tuple(dict.fromkeys(map(storable.text, names)))
        return details
