"""The CSV of a class → its students.

It has a line of headings, of which these are understood, without regard to capitals, spaces and punctuation; others
are passed over, and told:

===========  =========================================================================================================
ID           student ID, student number, SIS user ID, SIS ID, OrgDefinedId, ID number, username, SIS login ID, ID,
             student: the first of these that is there
name         name, full name, student name; or first and last name; or student, where that is not the ID
email        email, e-mail, email address
section      section, group, groups
other names  alias, aliases, other names (several with ; between them), Identifier, user ID, Canvas user ID, and all
             columns of IDs that are not the ID: by these, platforms name what students hand in
===========  =========================================================================================================

An empty cell says nothing: what is known of a student stays, as where there is no such column. A cell of "-" removes
it.

Commas, semicolons or tabs; UTF-8 with or without a byte-order mark, or Excel's UTF-16. Cells are text, whatever they
begin with; only ``="0042"``, by which Excel keeps the zeros of a number, is 0042, and so is ``#0042`` in a file that
Brightspace wrote (it has a column OrgDefinedId).
"""

from __future__ import annotations

import codecs
import csv
import io
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
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
_MOST_TOLD = 12  # columns that are not read
_KEPT_ZEROS = re.compile(r'="([^"]*)"')


@dataclass(frozen=True)
class Entry:
    """A student as the roster has them; ``details`` holds what it has a column for: fields of StudentRecord."""

    student: str
    details: dict[str, Any]

    def added_to(self, record: StudentRecord) -> tuple[StudentRecord, list[str]]:
        """What is known of a student with what the roster says, and a word on all that it takes away or leaves.

        Parameters
        ----------
        record : what is known; a new student's is empty
        """
        new, words = {}, []
        for what, said in self.details.items():
            was = getattr(record, what)
            is_now = type(was)() if said in (_REMOVED, (_REMOVED,)) else said
            if not said and was:
                word = "{student}: {what} {was} stays; the roster's cell is empty."
            elif was and not is_now:
                word = "{student}: {what} {was} is removed."
            else:
                word = "{student}: {what} {was} → {new}." if was and is_now != was else ""
            new[what] = is_now if said else was
            if word:
                called = "other names" if what == "aliases" else what
                words.append(word.format(student=self.student, what=called, was=_shown(was), new=_shown(is_now)))
        return replace(record, student=self.student, enrolled=True, **new), words


def _shown(value: str | Sequence[str]) -> str:
    return repr(value if isinstance(value, str) else "; ".join(value))


@dataclass(frozen=True)
class Roster:
    """What a file says.

    Attributes
    ----------
    entries : its students
    problems : a word on each line that was not taken
    unread : headings of columns that are not understood
    """

    entries: tuple[Entry, ...]
    problems: tuple[str, ...] = ()
    unread: tuple[str, ...] = ()

    def notes(self) -> list[str]:
        """What is passed over without harm, in a line."""
        if not self.unread:
            return []
        return [f"Columns that are not read: {listed(self.unread, _MOST_TOLD)}."]


def read(path: Path) -> Roster:
    """The students of a roster, and what was not taken of it.

    Raises
    ------
    GradebookError
        If the file cannot be read, or has no column of IDs.
    """
    lines = list(io.StringIO(_text(path), newline=""))
    skipped = 1 if lines and lines[0].lower().startswith("sep=") else 0  # a line for Excel
    del lines[:skipped]
    try:
        separator = max(",;\t", key=lambda one: len(_KNOWN.intersection(_headings(lines, one))))
        table = csv.reader(lines, delimiter=separator)
        columns = _Columns(path, next(table, []))
        entries, problems = _entries(columns, ((table.line_num + skipped, row) for row in table))
        return Roster(tuple(entries), tuple(problems), columns.unread)
    except csv.Error as error:
        raise GradebookError(f"The roster {path} is not a CSV that can be read: {error}.") from None


def _text(path: Path) -> str:
    try:
        data = path.read_bytes()
        coding = "utf-16" if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)) else "utf-8-sig"
        return data.decode(coding)
    except OSError as error:
        raise GradebookError(f"The roster {path} cannot be read: {error.strerror}.") from None
    except UnicodeDecodeError:
        raise GradebookError(f"The roster {path} is not UTF-8. Excel saves it so as 'CSV UTF-8'.") from None


def _headings(lines: Sequence[str], separator: str) -> list[str]:
    return list(map(_heading, next(csv.reader(lines, delimiter=separator), [])))


def _heading(cell: str) -> str:
    return "".join(filter(str.isalnum, cell.casefold()))


def _plain(cell: str) -> str:
    """A cell's text without white space around."""
    kept_zeros = _KEPT_ZEROS.fullmatch(cell.strip())
    return (kept_zeros[1] if kept_zeros else cell).strip()


def _on_one_line(cell: str) -> str:
    return " ".join(_plain(cell).split())


class _NoID(Exception):
    """A row whose cell for the ID is empty."""


class _Columns:
    """Where to find what in a row."""

    def __init__(self, path: Path, line: list[str]) -> None:
        headings = list(map(_heading, line))

        def first(names: Iterable[str]) -> int | None:
            return next((headings.index(name) for name in names if name in headings), None)

        student = first(_IDS)
        if student is None:
            raise GradebookError(
                f"The roster {path} has no column of IDs: call one 'student', in the first line. Besides it, "
                "'name', 'email' and 'section' are understood."
            )
        self._student = student
        self.id_heading = _on_one_line(line[student])
        name = first(name for name in _NAMES if name != headings[student])
        self._columns = {"email": [first(_EMAILS)], "section": [first(_SECTIONS)], "name": [name]}
        if name is None:
            self._columns["name"] = [first(_FIRST_NAMES), first(_LAST_NAMES)]
        marked = _MARKED if _BRIGHTSPACES in headings else ()
        self._marked = {place for place, heading in enumerate(headings) if heading in marked}
        taken = {student, *self._columns["name"]}
        self._others = [
            place for place, heading in enumerate(headings) if heading in (*_IDS, *_OTHER_NAMES) and place not in taken
        ]
        read = {*taken, *self._others, *self._columns["email"], *self._columns["section"]}
        named = (_on_one_line(cell) for place, cell in enumerate(line) if place not in read)
        self.unread = tuple(filter(None, named))

    def entry(self, row: list[str]) -> Entry:
        """What a row says. Raises _NoID where it has no ID, StudentIDError where it has what cannot be one."""

        def cell(place: int) -> str:
            found = row[place] if place < len(row) else ""
            return found.strip().removeprefix("#") if place in self._marked else found

        details: dict[str, Any] = {}
        for what, places in self._columns.items():
            there = [place for place in places if place is not None]
            if there:
                details[what] = storable.text(" ".join(filter(None, map(_on_one_line, map(cell, there)))))
        if self._others:
            named = [_on_one_line(one) for place in self._others for one in _plain(cell(place)).split(";")]
            details["aliases"] = tuple(dict.fromkeys(map(storable.text, filter(None, named))))
        given = _plain(cell(self._student))
        if not given:
            raise _NoID
        return Entry(student_id.normalised(given), details)


def _entries(columns: _Columns, rows: Iterable[tuple[int, list[str]]]) -> tuple[list[Entry], list[str]]:
    taken: dict[str, tuple[int, Entry]] = {}
    problems = []
    for line, row in rows:
        if not any(map(_plain, row)):
            continue
        try:
            entry = columns.entry(row)
        except _NoID:
            problem = "Line {line} has no ID in the column {column!r}: not taken."
            problems.append(problem.format(line=line, column=columns.id_heading))
        except StudentIDError as error:
            problems.append(f"Line {line}: {error} It is not taken.")
        else:
            first, same = taken.setdefault(caseless(entry.student), (line, entry))
            if same != entry:
                problem = "Line {line}: {student!r} is in line {first} already: not taken."
                problems.append(problem.format(line=line, student=entry.student, first=first))
    return [entry for _line, entry in taken.values()], problems
