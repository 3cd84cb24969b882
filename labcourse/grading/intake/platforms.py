"""Read the names that learning platforms give to submissions, and the lists of times that they export.

:data:`DOWNLOAD_NAMES` has the pattern of each platform. To support another platform, add a row, and an example to
``docs/handing_in.md``: tests read the examples there.
"""

from __future__ import annotations

import contextlib
import re
import unicodedata
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime, tzinfo
from pathlib import Path
from typing import TypeVar

from labcourse.errors import GradingError
from labcourse.grading.gradebook.roster import read_table
from labcourse.patterns import pattern
from labcourse.student_id import letters

MOODLE, CANVAS, BLACKBOARD, BRIGHTSPACE, NBGRADER = "Moodle", "Canvas", "Blackboard", "Brightspace", "nbgrader"
_LONGEST = 300  # characters of a name that a platform writes; a file system's longest, and some
_MOODLES = r"(?:(?P<receipt>onlinetext|comments)|[a-z]+)(?:_(?P<file>.*))?"
_PART = r"(?:(?! ?- ).)"  # a character of a part between two dashes, in names of Brightspace
_YEAR = rf"(?P<time>{_PART}*\b(?:19|20)\d\d\b{_PART}*)"

#: Platform → the sign that ends a group's or an assignment's name before the student's, and the pattern. Its groups:
#: ``name`` and ``login`` of the student, ``number`` by which the platform knows them, ``time``, ``attempt``, ``file``
#: as the student called it, and ``receipt`` for what the platform itself wrote. What the platform wrote comes first in
#: each name and is matched first, so the student's own name for a file, the rest, changes none of the others.
DOWNLOAD_NAMES = {
    platform: (sign, pattern(form, _LONGEST, re.DOTALL | re.IGNORECASE))
    for platform, sign, form in (
        (MOODLE, "-", r"(?P<name>.+?)_(?P<number>\d+)_assignsubmission_" + _MOODLES),
        (BRIGHTSPACE, "", rf"\d+-\d+ ?- (?:(?P<login>\S+) - )??(?P<name>{_PART}+) ?- {_YEAR}(?: ?- (?P<file>.*))?"),
        (BLACKBOARD, "_", r"(?P<name>.+?)_attempt_(?P<time>\d{4}(?:-\d\d){5})(?:_(?P<file>.*)|(?P<receipt>\.txt))?"),
        (CANVAS, "", r"(?P<name>\w+?)(?:_late)?_(?P<number>\d+|(?<=anon_)[a-z0-9]+)_(?P<attempt>\d+)_(?P<file>.*)"),
        (NBGRADER, "", r"(?P<login>[^+]+)\+[^+]+\+(?P<time>\d{4}-\d\d-\d\d \d\d:\d\d:\d\d(?:\.\d+)? UTC)(?:\+[^+]+)?"),
    )
}
#: What stands for the student's name where marking is blind.
_NOBODY = pattern(r"participant[ea]?|teilnehmer(?:in)?|deelnemer|partecipante|(?:late_)?anon", _LONGEST, re.IGNORECASE)

_AGAIN = pattern(r"(?P<name>.+?)(?: ?\((\d{1,3})\)|[-_](\d{1,2})| ?-? ?copy ?(\d*))", _LONGEST, re.IGNORECASE)
_CANVAS_COUNT = pattern(r"-\d{1,2}(?=\.[^.]+$)")

_ENCODINGS = [(written, read) for written in ("utf-8", "cp850", "cp1252") for read in ("cp437", "cp1252", "latin-1")]

_TIME = pattern(
    r"(?:[a-z]+,? )?(?:(?P<day>\d{1,2}) (?P<month>[a-z]{3})[a-z]*\.?|(?P<month_first>[a-z]{3})[a-z]*\.? "
    r"(?P<day_second>\d{1,2}),) (?P<year>\d{4}),? (?:at )?(?P<hour>\d{1,2}?)[:.]?(?P<minute>\d\d)(?::\d\d)? ?"
    r"(?P<half>[ap]m)?",
    flags=re.IGNORECASE,
)
_NAMES = ("name", "student", "studentid", "id", "file", "folder", "identifier", "fullname", "username", "emailaddress")
_TIMES = ("time", "submitted", "received", "lastmodifiedsubmission", "date", "datesubmitted", "submittedat")

_Content = TypeVar("_Content")


@dataclass(frozen=True)
class Label:
    """A parsed file name of a learning platform.

    Attributes
    ----------
    platform : name of the platform; "" for a name that begins with an ID of the roster
    people : possible names of the student, the likeliest first; none where marking is blind
    number : the platform's number of the student; "" without one
    time : time of receipt by the platform's clock, with a time zone if the name has one; None without a time
    attempt : number of the attempt; the higher, the later
    file : the student's own name for it; "" for a folder
    is_receipt : whether the platform itself wrote the file
    """

    platform: str
    people: tuple[str, ...]
    number: str = ""
    time: datetime | None = None
    attempt: int = 0
    file: str = ""
    is_receipt: bool = False


def label_of(name: str, platform: str) -> Label | None:
    """Read a file name by the pattern of a platform; return None if it does not fit, or the platform has no pattern."""
    sign, form = DOWNLOAD_NAMES.get(platform, ("", None))
    match = form.fullmatch(name[:_LONGEST]) if form else None
    if match is None:
        return None
    part = defaultdict(str, match.groupdict(default=""))
    written = part["name"]
    people = [written, *(written[place + 1 :] for place, letter in enumerate(written) if letter == sign)]
    return Label(
        platform,
        () if _NOBODY.fullmatch(people[-1]) else tuple(filter(None, [*people, part["login"]])),
        part["number"],
        _parse(part["time"]),
        int(part["attempt"] or 0),
        f"{part['file']}{name[_LONGEST:]}",
        bool(part["receipt"]),
    )


def platforms_of(name: str) -> list[str]:
    """Return the names of the platforms with a pattern that a file name fits."""
    return [platform for platform in DOWNLOAD_NAMES if label_of(name, platform)]


def without_copy_number(name: str) -> tuple[str, int] | None:
    """Return ("ada", 1) of ``ada (1)``, ``ada-1`` or ``ada copy``, name and number of the copy; None for others."""
    match = _AGAIN.fullmatch(name) if len(name) <= _LONGEST else None
    return (match["name"].strip(), int(next(filter(None, match.groups()[1:]), 1))) if match else None


def without_canvas_counts(files: Mapping[str, _Content]) -> dict[str, _Content]:
    """Return files under the names that they had before Canvas counted them: ``tools-1.py`` may have been ``tools.py``.

    Only files with such other names are returned. Notebooks are left out, as they are recognised by their names anyway,
    and so are names that ``files`` has already, or that several files would have.
    """
    uncounted: dict[str, list[_Content]] = {}
    for name, content in files.items():
        if _CANVAS_COUNT.search(name) and not name.endswith(".ipynb"):
            uncounted.setdefault(_CANVAS_COUNT.sub("", name), []).append(content)
    return {name: contents[0] for name, contents in uncounted.items() if len(contents) == 1 and name not in files}


# --- names ------------------------------------------------------------------------------------------------------------


def readable(name: str) -> str:
    """Return a name in Unicode's composed form: a Mac takes an ü apart."""
    return unicodedata.normalize("NFC", name)


def encodings(name: str) -> Iterator[str]:
    """Yield the name, then what else it may be: programs that unpack old zips often guess its encoding wrongly."""
    yield readable(name)
    for written, read in _ENCODINGS if not name.isascii() else ():
        with contextlib.suppress(UnicodeError):
            yield readable(name.encode(read, "surrogateescape").decode(written))


# --- times ------------------------------------------------------------------------------------------------------------


def parse_time(text: str, zone: tzinfo = UTC) -> datetime | None:
    """Read a time, as ``2026-11-21 13:05`` or as platforms write it; return it in UTC, or None if it is no time."""
    time = _parse(text)
    return None if time is None else in_utc(time, zone)


def _parse(text: str) -> datetime | None:
    """Read a time as :func:`parse_time` does, but leave it in its own zone, or without one."""
    try:
        return datetime.fromisoformat(text.replace(" UTC", "+00:00"))
    except ValueError:
        match = _TIME.fullmatch(text.strip())
    try:
        if match is None:
            return datetime.strptime(text, "%Y-%m-%d-%H-%M-%S")
        day, month = match["day"] or match["day_second"], match["month"] or match["month_first"]
        written = f"{day} {month} {match['year']} {match['hour']}:{match['minute']} {match['half'] or ''}"
        return datetime.strptime(written, "%d %b %Y %I:%M %p" if match["half"] else "%d %b %Y %H:%M ")
    except ValueError:
        return None


def in_utc(time: datetime, zone: tzinfo) -> datetime:
    """Return a time in UTC; one without a zone is of the given one."""
    try:
        return (time if time.tzinfo else time.replace(tzinfo=zone)).astimezone(UTC)
    except (OverflowError, ValueError, OSError):
        return datetime(*time.timetuple()[:6], tzinfo=UTC)


def read_times(path: Path, zone: tzinfo = UTC) -> tuple[dict[str, datetime], list[str]]:
    """Read a list of times of receipt: a CSV with columns of names and one of times, as Moodle's grading worksheet.

    Parameters
    ----------
    path : the file
    zone : of the times that name no zone

    Returns
    -------
    tuple
        name → time in UTC, for each name in a line; and a message on each line with a text that is not a time (lines
        with no text or "-" there are passed over)

    Raises
    ------
    GradingError
        If it cannot be read, is too long, or has no such columns.
    """
    first, *rows = read_table(path) or [[]]
    headings = [*map(letters, first)]
    name_columns = [column for column, heading in enumerate(headings) if heading in _NAMES]
    time_column = next((headings.index(heading) for heading in _TIMES if heading in headings), None)
    if not name_columns or time_column is None:
        raise GradingError(
            f"The times {path} should have a line of headings, with a column 'name' or 'student' and a column 'time'."
        )
    times: dict[str, datetime] = {}
    problems = []
    for number, row in enumerate(rows, 2):
        cells = [*map(str.strip, row), *[""] * len(headings)]
        if cells[time_column] in ("", "-"):
            continue
        if (time := parse_time(cells[time_column], zone)) is None:
            problems.append(f"Line {number}: {cells[time_column]!a:.40} is not a time; write it as 2026-11-21 13:05.")
        else:
            times |= {cells[column]: time for column in name_columns if cells[column]}
    return times, problems
