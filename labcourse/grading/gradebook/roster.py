"""Read the students of a class from a CSV.

Its first line has the headings. These are understood, without regard to capitals, spaces and punctuation; a note names
the columns that are not read:

===========  =========================================================================================================
ID           the first of these: student ID, student number, SIS user ID, SIS ID, OrgDefinedId, ID number, username,
             SIS login ID, ID, student
name         name, full name, student name; or first and last name; or student, where that is not the ID
email        email, e-mail, email address
section      section; or group, groups
group        group, groups: students of one group, of four at most, may hand in together
other names  alias, aliases, other names (several with ; between them), Identifier, user ID, Canvas user ID, and all
             columns of IDs that are not the ID: platforms name submissions by these
===========  =========================================================================================================

Missing columns and empty cells leave existing values unchanged. A cell of "-" removes the value.

Separators are commas, semicolons or tabs; the file is UTF-8 with or without a byte-order mark, or Excel's UTF-16. Cells
are text, whatever they begin with, with two exceptions: ``="0042"``, by which Excel preserves the zeros of a number, is
0042; and so is ``#0042`` in a file that Brightspace wrote (it has a column OrgDefinedId).
"""

from __future__ import annotations

import codecs
import csv
import io
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

from labcourse import student_id
from labcourse.errors import GradebookError, StudentIDError
from labcourse.grading.gradebook import storable
from labcourse.grading.gradebook.records import StudentRecord
from labcourse.messages import listed
from labcourse.student_id import caseless

#: Data of a student → headings of the columns that may have it, the best first.
_HEADINGS = {
    "ID": (
        *("studentid", "studentnumber", "sisuserid", "sisid", "orgdefinedid", "idnumber", "username", "sisloginid"),
        *("id", "student"),
    ),
    "name": ("name", "fullname", "studentname", "student"),
    "first name": ("firstname", "givenname"),
    "last name": ("lastname", "surname", "familyname"),
    "email": ("email", "emailaddress"),
    "section": ("section", "group", "groups"),
    "group": ("group", "groups"),
}
_KNOWN = {heading for headings in _HEADINGS.values() for heading in headings}
_OTHER_NAMES = (*_HEADINGS["ID"], "alias", "aliases", "othernames", "identifier", "userid", "canvasuserid")
_BRIGHTSPACES, _MARKED = "orgdefinedid", ("orgdefinedid", "username")  # columns of Brightspace, with # before cells
_REMOVED = "-"
_MOST_UNREAD = 12  # columns that are named in the note
_STAYS = "stays; the roster's cell is empty"
_EXCELS_SEPARATOR = re.compile(r"\Asep=[^\r\n]*", re.IGNORECASE)  # a line before the headings
_EXCELS_ZEROS = re.compile(r'="([^"]*)"')


@dataclass(frozen=True)
class RosterEntry:
    """A student in a roster; ``details`` holds the fields of StudentRecord for which the roster has a column."""

    student: str
    details: dict[str, Any]

    def update(self, record: StudentRecord) -> list[str]:
        """Update a student's record, and enrol them; return notes on values replaced, removed, or with an empty cell.

        Parameters
        ----------
        record : as stored; that of a new student has only the ID
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
    """Return the value of a field (a text, or several) as text, for messages."""
    return repr(value if isinstance(value, str) else "; ".join(value))


def read(path: Path) -> tuple[list[RosterEntry], list[str], list[str]]:
    """Read the students of a roster.

    Returns
    -------
    list
        The students, in order.
    list
        A message on each line that is not taken: it has no valid ID, or a student of an earlier line, with other data.
    list
        A message that names the columns that are not read, if there are any.

    Raises
    ------
    GradebookError
        If the file cannot be read, or has no column of IDs.
    """
    lines = list(io.StringIO(_EXCELS_SEPARATOR.sub("", _text(path)), newline=""))
    entries: dict[str, tuple[int, RosterEntry]] = {}
    problems = []
    try:
        separator = max(",;\t", key=lambda mark: len(_KNOWN.intersection(_headings(lines, mark))))
        headings = _headings(lines, separator)
        columns = _columns(path, headings)
        table = csv.DictReader(lines, list(headings), delimiter=separator, restval="")
        next(table, None)
        for row in table:
            line, cells = table.line_num, {heading: _stripped(row[heading]) for heading in headings}
            if not any(cells.values()):
                continue
            try:
                if not cells[columns["student"][0]]:
                    raise StudentIDError(f"The cell in the column {headings[columns['student'][0]]!r} is empty.")
                entry = _entry(cells, columns)
            except StudentIDError as error:
                problems.append(f"Line {line}: {error} It is not taken.")
                continue
            first, same = entries.setdefault(caseless(entry.student), (line, entry))
            if same != entry:
                problems.append(f"Line {line}: {entry.student!r} is in line {first} already. It is not taken.")
    except csv.Error as error:
        raise GradebookError(f"The roster {path} is not a CSV that can be read: {error}.") from None
    unread = [name for heading, name in headings.items() if name and heading not in chain(*columns.values())]
    notes = [f"Columns that are not read: {listed(unread, _MOST_UNREAD)}."] if unread else []
    return [entry for _line, entry in entries.values()], problems, notes


def _text(path: Path) -> str:
    """Return the text of a file in UTF-8 or UTF-16. Raises GradebookError if it cannot be read."""
    try:
        data = path.read_bytes()
        coding = "utf-16" if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)) else "utf-8-sig"
        return data.decode(coding)
    except OSError as error:
        raise GradebookError(f"The roster {path} cannot be read: {error.strerror}.") from None
    except UnicodeDecodeError:
        raise GradebookError(f"The roster {path} is not UTF-8. In Excel, save it as 'CSV UTF-8'.") from None


def _headings(lines: Sequence[str], separator: str) -> dict[str, str]:
    """Return letters and digits of each heading → the heading; to repeated ones, the column's number is added."""
    headings: dict[str, str] = {}
    for place, name in enumerate(next(filter(None, csv.reader(lines, delimiter=separator)), [])):
        heading = "".join(filter(str.isalnum, name.casefold()))
        headings[f"{heading} {place}" if heading in headings else heading] = _on_one_line(name)
    return headings


def _stripped(cell: str) -> str:
    """Return a cell's text without white space around it, and without Excel's signs around a number."""
    zeros = _EXCELS_ZEROS.fullmatch(cell.strip())
    return (zeros[1] if zeros else cell).strip()


def _on_one_line(cell: str) -> str:
    """Return a cell's text on one line, with single spaces."""
    return storable.text(" ".join(_stripped(cell).split()))


def _columns(path: Path, headings: Collection[str]) -> dict[str, list[str]]:
    """Return field of a student → headings of its columns. Raises GradebookError without a column of IDs."""
    student = [heading for heading in _HEADINGS["ID"] if heading in headings][:1]
    if not student:
        raise GradebookError(
            f"The roster {path} has no column of IDs: call one 'student', in the first line. Besides it, "
            "'name', 'email' and 'section' are understood."
        )
    usable = [heading for heading in headings if heading not in student]
    first = {field: [name for name in names if name in usable][:1] for field, names in _HEADINGS.items()}
    name = first["name"] or first["first name"] + first["last name"]
    aliases = [heading for heading in usable if heading in _OTHER_NAMES and heading not in name]
    of_headings = {field: first[field] for field in ("email", "section", "group")}
    return {"student": student, **of_headings, "name": name, "aliases": aliases}


def _entry(cells: Mapping[str, str], columns: Mapping[str, list[str]]) -> RosterEntry:
    """Return the student of a row. Raises StudentIDError if the ID is not valid.

    Parameters
    ----------
    cells : heading → text of the cell
    columns : from :func:`_columns`
    """
    if _BRIGHTSPACES in cells:
        cells = {heading: cell.removeprefix("#") if heading in _MARKED else cell for heading, cell in cells.items()}
    texts = {field: [cells[heading] for heading in headings] for field, headings in columns.items() if headings}
    (student,) = texts.pop("student")
    others = [_on_one_line(name) for text in texts.pop("aliases", ()) for name in text.split(";")]
    details: dict[str, Any] = {field: " ".join(filter(None, map(_on_one_line, cell))) for field, cell in texts.items()}
    if columns["aliases"]:
        details["aliases"] = tuple(dict.fromkeys(filter(None, others)))
    return RosterEntry(student_id.normalised(student), details)
