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

import re
from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from itertools import chain, repeat
from pathlib import Path
from typing import Any

from labcourse import student_id
from labcourse.errors import GradebookError, GradingError, StudentIDError
from labcourse.grading.gradebook import storable
from labcourse.grading.gradebook.records import StudentRecord
from labcourse.messages import listed
from labcourse.safe_text import from_csv
from labcourse.student_id import caseless, letters, name_words

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
_OTHER_NAMES = (*_HEADINGS["ID"], "alias", "aliases", "othernames", "identifier", "userid", "canvasuserid")
_BRIGHTSPACES, _MARKED = "orgdefinedid", ("orgdefinedid", "username")  # columns of Brightspace, with # before cells
_REMOVED = "-"
MAX_TABLE = 10_000_000  #: bytes of a table that an instructor writes; 100 000 lines
_MOST_UNREAD = 12  # columns that are named in the note
_ADDED = ("name", "email", "aliases")  # fields of which a student keeps all values
#: Names in Canvas's export that are no student's: the row of maximum points, and the test student.
NO_STUDENTS = ("Points Possible", "Student, Test", "Test Student")
PARTICIPANT = re.compile(r"\w+ (?=\d+$)")  #: in Moodle's "Participant 1234567"
_Pairs = list[tuple[StudentRecord, StudentRecord]]  # of a student's record, and what a line says
_EXCELS_ZEROS = re.compile(r'="([^"]*)"')


def add(record: StudentRecord, entry: StudentRecord) -> list[str]:
    """Add what a line of a roster says to a student's record, and enrol them.

    Parameters
    ----------
    record : as stored; that of a new student has only the ID
    entry : the line

    Returns
    -------
    list
        A note that says what was added beside known values, replaced and removed; none if nothing was.
    """
    changes, others = list[str](), [entry.student]
    entry.section = entry.section or (entry.group if record.section in ("", record.group) else "")
    for name in ("name", "email", "section", "group", "aliases"):
        old, cell = getattr(record, name), getattr(entry, name)
        is_removed = cell in (_REMOVED, (_REMOVED,))
        if old and name in _ADDED and not is_removed:
            others += [cell] if isinstance(cell, str) else cell
        elif cell:
            setattr(record, name, type(old)() if is_removed else cell)
            if old and old != cell:
                change = "is removed" if is_removed else f"→ {_shown(cell)}"
                changes.append(f"{name.replace('aliases', 'other names')} {_shown(old)} {change}")
    known = {*map(caseless, (record.student, record.email, *record.aliases, ""))}
    new = {caseless(other): other for other in others if name_words(other) != name_words(record.name)}
    if added := tuple(new[other] for other in new if other not in known):
        record.aliases += added
        changes.append(f"also {_shown(added)}")
    record.student = entry.student if caseless(entry.student) == caseless(record.student) else record.student
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


def match(entries: Mapping[int, StudentRecord], students: Iterable[StudentRecord]) -> tuple[_Pairs, list[str]]:
    """Find the student of each line of a roster.

    It is the one with its ID; or else the one with another of its numbers or addresses, if the two names have a word in
    common or one is not known; or else, of a line without an ID, the only one with its name. A student with a line of
    their own is found by no other line.

    Parameters
    ----------
    entries : number of a line → what it says
    students : of the gradebook

    Returns
    -------
    list
        The record of each student, a new one if nobody is found, and what the line says.
    list
        A message on each line that has no ID and leads to nobody, or to several students.
    """
    known = {student.folded: student for student in students}
    own = {caseless(entry.student) for entry in entries.values()}
    others = {student.student: student for folded, student in known.items() if folded not in own}
    keys, names = by_key(others.values()), Counter(name_words(entry.name) for entry in entries.values())
    pairs, problems = _Pairs(), list[str]()
    for line, entry in entries.items():
        record, words = known.get(caseless(entry.student)), name_words(entry.name)
        led = {who for key in by_key([entry]) for who in keys.get(key, ()) if who in others}
        found = [who for who in led if not contradict(entry.name, others[who].name)]
        if not (found or entry.student) and names[words] == 1:
            found = [who for who in others if words and name_words(others[who].name) == words]
        if record is None and len(found) == 1:
            record = others.pop(found[0])
        if record or entry.student:
            pairs.append((record or StudentRecord(entry.student), entry))
        else:
            leads = f"may be one or another: {', '.join(sorted(found))}" if found else "leads to nobody"
            problems.append(f"Line {line}: it has no ID, and {leads}. It is not taken.")
    return pairs, problems


def read(path: Path) -> tuple[dict[int, StudentRecord], list[str], list[str]]:
    """Read the students of a roster.

    Returns
    -------
    dict
        Number of the line → the student in it; without ID if it has none.
    list
        A message on each line that is not taken: its ID is not valid, or a student of an earlier line, with other data.
    list
        A message that names the columns that are not read, if there are any.

    Raises
    ------
    GradingError
        If the file cannot be read, or has no column of IDs, e-mail addresses or other names.
    """
    numbered = ((line, row) for line, row in enumerate(read_table(path), 1) if any(row))
    headings = _headings(next(numbered, (0, []))[1])
    columns = _columns(path, headings)
    is_canvas = {"id", "section"} <= {*headings} and bool({"student", "lastname"} & {*headings})
    entries: dict[int, StudentRecord] = {}
    lines: dict[str, int] = {}
    problems = []
    for line, row in numbered:
        cells = dict(zip(headings, map(_stripped, chain(row, repeat(""))), strict=False))
        try:
            entry = _entry(cells, columns)
        except StudentIDError as error:
            problems.append(f"Line {line}: {error} It is not taken.")
            continue
        is_student = not is_canvas or entry.name not in NO_STUDENTS or bool(cells.get("sisuserid"))
        if is_student and any((entry.student, entry.name, entry.email, entry.aliases)):
            first = lines.setdefault(caseless(entry.student) or str(line), line)
            if entries.setdefault(first, entry) != entry:
                problems.append(f"Line {line}: {entry.student!r} is in line {first} already. It is not taken.")
    unread = [name for heading, name in headings.items() if name and heading not in chain(*columns.values())]
    notes = [f"Columns that are not read: {listed(unread, _MOST_UNREAD)}."] if unread else []
    return entries, problems, notes


def _headings(names: Sequence[str]) -> dict[str, str]:
    """Return letters and digits of each heading → the heading; to repeated ones, the column's number is added."""
    headings: dict[str, str] = {}
    for place, name in enumerate(names):
        heading = letters(name)
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


def _entry(cells: Mapping[str, str], columns: Mapping[str, list[str]]) -> StudentRecord:
    """Return the student of a row. Raises StudentIDError if the ID is not valid.

    Parameters
    ----------
    cells : heading → text of the cell
    columns : from :func:`_columns`
    """
    if _BRIGHTSPACES in cells:
        cells = {heading: cell.removeprefix("#") if heading in _MARKED else cell for heading, cell in cells.items()}
    texts = {field: [cells[heading] for heading in headings] for field, headings in columns.items() if headings}
    (student,) = texts.pop("student", [""])
    others = [_on_one_line(name) for text in texts.pop("aliases", ()) for name in text.split(";")]
    details: dict[str, Any] = {field: " ".join(filter(None, map(_on_one_line, cell))) for field, cell in texts.items()}
    details["aliases"] = tuple(dict.fromkeys(filter(None, others)))
    return StudentRecord(student and student_id.normalised(student), **details)


def read_table(path: Path) -> list[list[str]]:
    """Read the rows of a CSV that an instructor wrote.

    Raises
    ------
    GradingError
        If there is no such file, or if it cannot be read or is too long.
    """
    try:
        with open(path, "rb") as file:
            data = file.read(MAX_TABLE + 1)
        if len(data) > MAX_TABLE:
            raise GradingError(f"{path} has more than {MAX_TABLE} bytes. Delete rows that are not needed.")
        return from_csv(data)
    except FileNotFoundError:
        raise GradingError(f"There is no file {path}.") from None
    except OSError as error:
        raise GradingError(f"{path} cannot be read: {error.strerror}.") from None
    except ValueError as error:
        raise GradingError(f"{path} cannot be read: {error}. Save it as CSV in UTF-8.") from None
