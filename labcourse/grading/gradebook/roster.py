"""Read the students of a class from a CSV.

Its first line has the headings. These are understood, without regard to capitals, spaces and punctuation; a note names
the columns that are not read:

===========  =========================================================================================================
ID           the first of these: student ID, student number, SIS user ID, SIS ID, OrgDefinedId, ID number, username,
             SIS login ID, ID, student
name         name, full name, student name; or first and last name; or student, where that is not the ID
email        email, e-mail, email address
section      section; or group, groups, where the student has no other
group        group, groups: students of one group, of four at most, may hand in together
other names  alias, aliases, other names (several with ; between them), Identifier, user ID, Canvas user ID, and all
             columns of IDs that are not the ID: platforms name submissions by these
===========  =========================================================================================================

Lists add up: several platforms may name the same students. Another name, number or address of a student becomes one of
their other names, and replaces none. Section and group are replaced. Missing columns and empty cells leave existing
values unchanged. A cell of "-" removes the value.

A line without an ID, or with one that nobody has, is of the student who has another of its numbers or addresses. Rows
of Canvas's export that are of no student are left out: the maximum points, and the test student.

Separators are commas, semicolons or tabs; the file is UTF-8 with or without a byte-order mark, or Excel's UTF-16. Cells
are text, whatever they begin with, with two exceptions: ``="0042"``, by which Excel preserves the zeros of a number, is
0042; and so is ``#0042`` in a file that Brightspace wrote (it has a column OrgDefinedId).
"""

from __future__ import annotations

import codecs
import csv
import io
import re
from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path
from typing import Any

from labcourse import student_id
from labcourse.errors import GradebookError, StudentIDError
from labcourse.grading.gradebook import storable
from labcourse.grading.gradebook.records import StudentRecord
from labcourse.messages import listed
from labcourse.student_id import caseless, name_words

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
    "section": ("section",),
    "group": ("group", "groups"),
}
_KNOWN = {heading for headings in _HEADINGS.values() for heading in headings}
_OTHER_NAMES = (*_HEADINGS["ID"], "alias", "aliases", "othernames", "identifier", "userid", "canvasuserid")
_BRIGHTSPACES, _MARKED = "orgdefinedid", ("orgdefinedid", "username")  # columns of Brightspace, with # before cells
_REMOVED = "-"
_MOST_UNREAD = 12  # columns that are named in the note
_ADDED = ("name", "email", "aliases")  # fields of which a student keeps all values
#: Names in Canvas's export that are no student's: the row of maximum points, and the test student.
NO_STUDENTS = ("Points Possible", "Student, Test", "Test Student")
_EXCELS_SEPARATOR = re.compile(r"\Asep=[^\r\n]*", re.IGNORECASE)  # a line before the headings
_EXCELS_ZEROS = re.compile(r'="([^"]*)"')


@dataclass(frozen=True)
class RosterEntry:
    """A student in a roster.

    Attributes
    ----------
    student : ID; "" without one
    details : the fields of StudentRecord for which the roster has a column
    line : number of the line
    """

    student: str
    details: dict[str, Any]
    line: int = field(default=0, compare=False)

    @property
    def name(self) -> str:
        """Name of the student; "" without one."""
        return str(self.details.get("name", ""))

    def update(self, record: StudentRecord) -> list[str]:
        """Update a student's record, and enrol them; return a note, if something was added, replaced or removed.

        Parameters
        ----------
        record : as stored; that of a new student has only the ID
        """
        details, changes, others = dict(self.details), list[str](), [self.student]
        if record.section in ("", record.group):
            details.setdefault("section", details.get("group", ""))
        for name, cell in details.items():
            old, is_removed = getattr(record, name), cell in (_REMOVED, (_REMOVED,))
            if old and name in _ADDED and not is_removed:
                others += [cell] if isinstance(cell, str) else cell
            elif cell:
                setattr(record, name, type(old)() if is_removed else cell)
                if old and old != cell:
                    label = "other names" if name == "aliases" else name
                    changes.append(f"{label} {_shown(old)} {'is removed' if is_removed else f'→ {_shown(cell)}'}")
        known = {*map(caseless, (record.student, record.email, *record.aliases, ""))}
        new = {caseless(other): other for other in others if name_words(other) != name_words(record.name)}
        if added := tuple(new[other] for other in new if other not in known):
            record.aliases = (*record.aliases, *added)
            changes.append(f"also {_shown(added)}")
        if caseless(self.student) == caseless(record.student):
            record.student = self.student
        record.enrolled = True
        return [f"{record.student}: {', '.join(changes)}."] if changes else []


def _shown(value: str | Sequence[str]) -> str:
    """Return the value of a field (a text, or several) as text, for messages."""
    return repr(value if isinstance(value, str) else "; ".join(value))


def by_key(students: Iterable[StudentRecord], ignored: str | re.Pattern[str] = "") -> dict[str, set[str]]:
    """Return ID, e-mail address or other name without regard to capitals → IDs of the students who have it.

    Parameters
    ----------
    students : of the gradebook
    ignored : pattern of what is taken out of these names. Where a platform's own numbers are compared, "Participant
        1234567" is 1234567; elsewhere that may be another's ID.
    """
    known: dict[str, set[str]] = {}
    for student in students:
        for name in filter(None, (student.student, student.email, *student.aliases)):
            known.setdefault(caseless(re.sub(ignored, "", name)), set()).add(student.student)
    return known


def contradict(first: str, second: str) -> bool:
    """Return whether two names are both known and have no word in common."""
    words = [name_words(name) for name in (first, second)]
    return all(words) and words[0].isdisjoint(words[1])


def match(
    entries: Sequence[RosterEntry], students: Iterable[StudentRecord]
) -> tuple[list[tuple[RosterEntry, StudentRecord]], list[str]]:
    """Find the student of each line of a roster.

    It is the one with its ID; or else the one with another of its numbers or addresses, if the two names have a word in
    common or one is not known; or else, of a line without an ID, the only one with its name. A student with a line of
    their own is found by no other line.

    Parameters
    ----------
    entries : the lines
    students : of the gradebook

    Returns
    -------
    list
        Each line, with the record of its student: a new one if nobody is found.
    list
        A message on each line that has no ID and leads to nobody, or to several students.
    """
    known = {student.folded: student for student in students}
    own = {caseless(entry.student) for entry in entries}
    others = {student.student: student for folded, student in known.items() if folded not in own}
    keys, lines = by_key(others.values()), Counter(name_words(entry.name) for entry in entries)
    pairs, problems = list[tuple[RosterEntry, StudentRecord]](), list[str]()
    for entry in entries:
        record, words = known.get(caseless(entry.student)), name_words(entry.name)
        values = (entry.student, entry.details.get("email", ""), *entry.details.get("aliases", ()))
        led = set[str]().union(*(keys.get(caseless(value), ()) for value in values)) & {*others}
        found = [who for who in led if not contradict(entry.name, others[who].name)]
        if not (found or entry.student) and words and lines[words] == 1:
            found = [who for who in others if name_words(others[who].name) == words]
        if record is None and len(found) == 1:
            record = others.pop(found[0])
        if record or entry.student:
            pairs.append((entry, record or StudentRecord(entry.student)))
        else:
            leads = f"may be one or another: {', '.join(sorted(found))}" if found else "leads to nobody"
            problems.append(f"Line {entry.line}: it has no ID, and {leads}. It is not taken.")
    return pairs, problems


def read(path: Path) -> tuple[list[RosterEntry], list[str], list[str]]:
    """Read the students of a roster.

    Returns
    -------
    list
        The students, in order.
    list
        A message on each line that is not taken: its ID is not valid, or a student of an earlier line, with other data.
    list
        Messages that name the columns that are not read, and Canvas's rows of no student, if there are any.

    Raises
    ------
    GradebookError
        If the file cannot be read, or has no column of IDs, e-mail addresses or other names.
    """
    lines = list(io.StringIO(_EXCELS_SEPARATOR.sub("", _text(path)), newline=""))
    entries: dict[str, RosterEntry] = {}
    problems, canvas = list[str](), list[str]()
    try:
        separator = max(",;\t", key=lambda mark: len(_KNOWN.intersection(_headings(lines, mark))))
        headings = _headings(lines, separator)
        columns = _columns(path, headings)
        is_canvas = {"id", "section"} <= {*headings} and bool({"student", "lastname"} & {*headings})
        table = csv.DictReader(lines, list(headings), delimiter=separator, restval="")
        next(table, None)
        for row in table:
            line, cells = table.line_num, {heading: _stripped(row[heading]) for heading in headings}
            try:
                entry = _entry(cells, columns, line)
            except StudentIDError as error:
                problems.append(f"Line {line}: {error} It is not taken.")
                continue
            if is_canvas and entry.name in NO_STUDENTS and not cells.get("sisuserid"):
                canvas.append(str(line))
            elif entry.student or any(entry.details.values()):
                first = entries.setdefault(caseless(entry.student) or f" {line}", entry)
                if first != entry:
                    problems.append(f"Line {line}: {entry.student!r} is in line {first.line} already. It is not taken.")
    except csv.Error as error:
        raise GradebookError(f"The roster {path} is not a CSV that can be read: {error}.") from None
    unread = [name for heading, name in headings.items() if name and heading not in chain(*columns.values())]
    notes = [f"Columns that are not read: {listed(unread, _MOST_UNREAD)}."] if unread else []
    notes += [f"Rows of Canvas's own, of no student: lines {', '.join(canvas)}."] if canvas else []
    return list(entries.values()), problems, notes


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
    """Return field of a student → headings of its columns. Raises GradebookError without a column to find them by."""
    student = [heading for heading in _HEADINGS["ID"] if heading in headings][:1]
    if not student and not {*_OTHER_NAMES, *_HEADINGS["email"]} & {*headings}:
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


def _entry(cells: Mapping[str, str], columns: Mapping[str, list[str]], line: int) -> RosterEntry:
    """Return the student of a row. Raises StudentIDError if the ID is not valid.

    Parameters
    ----------
    cells : heading → text of the cell
    columns : from :func:`_columns`
    line : number of the line
    """
    if _BRIGHTSPACES in cells:
        cells = {heading: cell.removeprefix("#") if heading in _MARKED else cell for heading, cell in cells.items()}
    texts = {field: [cells[heading] for heading in headings] for field, headings in columns.items() if headings}
    (student,) = texts.pop("student", [""])
    others = [_on_one_line(name) for text in texts.pop("aliases", ()) for name in text.split(";")]
    details: dict[str, Any] = {field: " ".join(filter(None, map(_on_one_line, cell))) for field, cell in texts.items()}
    if columns["aliases"]:
        details["aliases"] = tuple(dict.fromkeys(filter(None, others)))
    return RosterEntry(student and student_id.normalised(student), details, line)
