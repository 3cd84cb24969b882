"""When what was handed in: a file of times, for platforms that do not write them into names."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Mapping, Sequence
from datetime import UTC, datetime, tzinfo
from pathlib import Path

from labcourse.errors import GradingError
from labcourse.student_id import caseless

_NAMES = ("name", "student", "studentid", "id", "file", "folder", "identifier", "fullname", "username", "emailaddress")
_TIMES = ("time", "submitted", "received", "lastmodifiedsubmission", "date", "datesubmitted", "submittedat")
_SPELLED = re.compile(
    r"(?:\w+,? )?(?P<day>\d{1,2}) (?P<month>[A-Za-z]{3})[a-z]*\.? (?P<year>\d{4}),? (?:at )?"
    r"(?P<hour>\d{1,2}):(?P<minute>\d\d)(?::\d\d)? ?(?P<half>[AP]M)?",
    re.IGNORECASE,
)
_MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
_MAX_BYTES = 10_000_000  # 100 000 lines


def read(path: Path, zone: tzinfo = UTC) -> tuple[dict[str, datetime], list[str]]:
    """A CSV of times → name → time, and a word on each line that was not taken.

    It has a column of names (``name`` of the folder or file, or ``student``), and one of times (``time``), written as
    ``2026-11-21 13:05`` or as Moodle's grading worksheet has them, which can be given as it is. Of several names in a
    line, each counts.

    Parameters
    ----------
    path : the file
    zone : of times that do not say theirs

    Raises
    ------
    GradingError
        If it cannot be read, is too long, or has no such columns.
    """
    try:
        with open(path, "rb") as file:
            data = file.read(_MAX_BYTES + 1)
        if len(data) > _MAX_BYTES:
            raise GradingError(f"The times {path} are too long: more than {_MAX_BYTES} bytes.")
        text = data.decode("utf-8-sig")
    except OSError as error:
        raise GradingError(f"The times {path} cannot be read: {error.strerror}.") from None
    except UnicodeDecodeError:
        raise GradingError(f"The times {path} are not UTF-8.") from None
    first = text.partition("\n")[0]
    table = csv.reader(io.StringIO(text, newline=""), delimiter=max(",;\t", key=first.count))
    try:
        heads = ["".join(filter(str.isalnum, cell.casefold())) for cell in next(table, [])]
        named = [place for place, head in enumerate(heads) if head in _NAMES]
        timed = next((heads.index(head) for head in _TIMES if head in heads), None)
        if not named or timed is None:
            raise GradingError(
                f"The times {path} should have a line of headings, with a column 'name' or 'student' and a "
                "column 'time'."
            )
        return _rows(((table.line_num, row) for row in table), named, timed, zone)
    except csv.Error as error:
        raise GradingError(f"The times {path} cannot be read: {error}.") from None


def _rows(
    rows: Iterable[tuple[int, list[str]]], named: Sequence[int], timed: int, zone: tzinfo
) -> tuple[dict[str, datetime], list[str]]:
    found: dict[str, datetime] = {}
    problems = []
    for line, row in rows:
        given = row[timed].strip() if timed < len(row) else ""
        if given in ("", "-"):
            continue
        time = parsed(given, zone)
        if time is None:
            problems.append(f"Line {line}: {given!a:.40} is not a time; write it as 2026-11-21 13:05.")
            continue
        found.update({row[place].strip(): time for place in named if place < len(row) and row[place].strip()})
    return found, problems


def parsed(text: str, zone: tzinfo = UTC) -> datetime | None:
    """A time in UTC; None if it is not one."""
    try:
        time = datetime.fromisoformat(text)
    except ValueError:
        spelled = _spelled(text)
        if spelled is None:
            return None
        time = spelled
    return in_utc(time, zone)


def _spelled(text: str) -> datetime | None:
    found = _SPELLED.fullmatch(text)
    if found is None:
        return None
    try:
        month, hour = _MONTHS.index(found["month"].lower()) + 1, hour_of(found["hour"], found["half"])
        return datetime(int(found["year"]), month, int(found["day"]), hour, int(found["minute"]))
    except ValueError:
        return None


def hour_of(hour: str, half: str | None) -> int:
    """Return an hour of the day, from 0 to 23.

    Parameters
    ----------
    hour : as written
    half : AM or PM, in any letters, where the hour has one

    Raises
    ------
    ValueError
        If an hour with AM or PM is beyond 12.
    """
    if not half:
        return int(hour)
    if int(hour) > 12:
        raise ValueError(f"{hour} {half} is not an hour.")
    return int(hour) % 12 + 12 * (half[0].lower() == "p")


def in_utc(time: datetime, zone: tzinfo) -> datetime:
    """A time in UTC; one that does not say its zone is taken to be of the given one."""
    try:
        return (time if time.tzinfo else time.replace(tzinfo=zone)).astimezone(UTC)
    except (OverflowError, ValueError, OSError):
        return datetime(*time.timetuple()[:6], tzinfo=UTC)


def folded(times: Mapping[str, datetime]) -> dict[str, datetime]:
    """Times by the form in which names are compared."""
    return {caseless(name): in_utc(time, UTC) for name, time in times.items()}
