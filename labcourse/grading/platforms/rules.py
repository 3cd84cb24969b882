"""What each platform's file looks like. Headings are those of the platform's English.

===========  =========================================================================================================
Canvas       ``Student,ID,SIS User ID,SIS Login ID,Section,Lab 3 (1234),…``; a row "Points Possible", and before it
             perhaps one of posting policies; "(read only)" below what Canvas computes
Moodle       the gradebook: ``First name,Last name,ID number,…,Email address,Assignment: Lab 3 (Real),…``, and an
             assignment's grading worksheet: ``Identifier,Full name,Email address,Status,Grade,Maximum Grade,…``
Blackboard   ``Last Name,First Name,Username,Student ID,Last Access,Availability,Lab 3 [Total Pts: 100 Score] |123456``
Brightspace  ``OrgDefinedId,Username,…,Lab 3 Points Grade <Numeric MaxPoints:100 …>,End-of-Line Indicator``
===========  =========================================================================================================
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from labcourse.errors import GradingError
from labcourse.grading.intake.platforms import BLACKBOARD, BRIGHTSPACE, CANVAS, MOODLE
from labcourse.grading.platforms.recognised import Column, Export, Key, stated
from labcourse.grading.platforms.their_file import SEPARATORS, Table, Text, table

WORKSHEET = "Moodle's grading worksheet"  #: of one assignment, beside the export of Moodle's gradebook

_CANVAS_ITEM = re.compile(r"(?P<title>.*\S)\s*\((?P<id>\d+)\)", re.DOTALL)
#: Canvas passes over any heading that has one of these in it.
_CANVAS_SUM = re.compile(r"(?:Current|Final|Override) (?:Score|Points|Grade|Status)")
_MOODLE_OWN = {
    *("First name", "Last name", "Surname", "ID number", "Institution", "Department", "Email address", "Username"),
    *("City/town", "Country", "Phone", "Mobile phone", "Address", "Suspended", "Groups", "Student ID"),
    "Last downloaded from this course",
}
_MOODLE_ITEM = re.compile(r"(?P<title>.*\S) \((?P<kind>Real|Percentage|Letter|Feedback)\)", re.DOTALL)
_MOODLE_SUM = re.compile(r"(?:Course|(?!Assignment:|Quiz:).*\S) total", re.DOTALL)
_BLACKBOARD_ITEM = re.compile(
    r"(?P<title>.*\S) \[Total Pts: (?P<sum>up to )?(?P<most>[\d.,]+)(?: (?P<kind>[^\]]*))?\] ?\|(?P<id>\w+)", re.DOTALL
)
_BLACKBOARD_OWN = ("Last Name", "First Name", "Username", "Student ID", "Last Access", "Availability")
_BRIGHTSPACE_ITEM = re.compile(
    r"(?P<title>.*\S) (?P<kind>Points Grade|Text Grade|Grade Symbol|Scheme Symbol|Weighted Grade)(?: <(?P<about>.*)>)?",
    re.DOTALL,
)
_BRIGHTSPACE_MOST = re.compile(r"\bMaxPoints:(?P<most>[\d.,]+)")
_BRIGHTSPACE_OWN = ("OrgDefinedId", "Username", "Last Name", "First Name", "Email", "Section Membership")
_END_OF_LINE = "End-of-Line Indicator"


def recognised(source: Text) -> Export:
    """A platform's file, understood.

    Raises
    ------
    GradingError
        If it is none of those that are known, or damaged.
    """
    headings: list[str] = []
    damaged: list[GradingError] = []
    for separator in SEPARATORS:
        try:
            found = table(source, separator)
        except GradingError as error:  # a quote that is none, where the cells are separated otherwise
            damaged.append(error)
            continue
        head = [cell.text.strip() for cell in found.rows[0]] if found.rows else []
        for understands in (_canvas, _worksheet, _moodle, _blackboard, _brightspace):
            export = understands(found, head)
            if export is not None:
                return export
        headings = max(headings, head, key=len)
    if damaged:
        raise damaged[0]
    raise GradingError(
        "It is not a file of Canvas, Moodle, Blackboard or Brightspace, or not as the platform wrote it. Its "
        f"first line has {', '.join(map(repr, headings[:8])) or 'nothing'}. Canvas's begins with 'Student', "
        "'ID'; Moodle's has 'First name', 'Last name' and 'Email address', or 'Identifier' and 'Grade'; "
        "Blackboard's 'Last Name', 'First Name', 'Username'; Brightspace's 'OrgDefinedId' or 'Username', and "
        "'End-of-Line Indicator'. Export it again, with the platform in English."
    )


def _canvas(found: Table, head: Sequence[str]) -> Export | None:
    if not (head[:2] == ["Student", "ID"] or head[:3] == ["LastName", "FirstName", "ID"]) or "Section" not in head:
        return None
    rows = _filled_rows(found)
    points = next((row for row in rows if "Points Possible" in found.cell(row, 0)), None)
    students = [row for row in rows if row != points and not _is_policy(found, row)]
    columns = []
    for place, heading in enumerate(head):
        if place <= head.index("Section"):
            continue
        below = "" if points is None else found.cell(points, place).strip()
        item = _CANVAS_ITEM.fullmatch(heading)
        why = ""
        if below == "(read only)":
            why = "Canvas has it as read only."
        elif _CANVAS_SUM.search(heading):
            why = "by its name, Canvas takes it for what it computes itself."
        elif item is None:
            why = "it has no number in brackets, so it is a column of notes, or Canvas would make a new assignment."
        called = () if item is None else (str(item["title"]), str(item["id"]))
        most = None if why else stated(below, heading)
        columns.append(Column(place, heading, called, most, why))
    keys = [
        Key(head.index(name), name, internal=name == "ID")
        for name in ("SIS User ID", "SIS Login ID", "Integration ID", "ID")
        if name in head
    ]
    left = {
        "n/a": "Canvas has not assigned it to them (N/A).",
        "ex": "they are excused on Canvas (EX).",
    }
    names = tuple(head.index(name) for name in ("FirstName", "LastName", "Student") if name in head)
    return Export(CANVAS, found, tuple(students), tuple(keys), names, tuple(columns), ("-",), left)


def _is_policy(found: Table, row: int) -> bool:
    """Whether a row of Canvas's says how assignments are posted, and is nobody's."""
    said = {cell.text.strip() for cell in found.rows[row]} - {""}
    return all(one == "Muted" or one.startswith("Manual Posting") for one in said)


def _worksheet(found: Table, head: Sequence[str]) -> Export | None:
    if not {"Identifier", "Grade"} <= set(head):
        return None
    students = _filled_rows(found)
    why, most = "", None
    if "Scale" in head:
        why = "the assignment is graded by a scale, and not by points."
    elif "Maximum Grade" in head:
        stated_there = {found.cell(row, head.index("Maximum Grade")).strip() for row in students}
        if len(stated_there) > 1:
            why = "its rows have different maximum grades."
        most = None if why else stated(stated_there.pop(), "Grade") if stated_there else None
    grade = Column(head.index("Grade"), "Grade", (), most, why)
    others = [
        Column(place, heading, (), None, "marks of a grading worksheet stand under Grade.")
        for place, heading in enumerate(head)
        if heading not in ("Identifier", "Full name", "Email address", "ID number", "Username", "Grade")
    ]
    known = [name for name in ("ID number", "Username", "Email address", "Identifier") if name in head]
    keys = tuple(Key(head.index(name), name, internal=name == "Identifier") for name in known)
    locked = head.index("Grade can be changed") if "Grade can be changed" in head else None
    names = tuple(head.index(name) for name in ("Full name",) if name in head)
    return Export(WORKSHEET, found, tuple(students), keys, names, (grade, *others), ("-",), {}, locked)


def _moodle(found: Table, head: Sequence[str]) -> Export | None:
    last = next((name for name in ("Last name", "Surname") if name in head), None)
    known = [name for name in ("ID number", "Student ID", "Username", "Email address") if name in head]
    if "First name" not in head or last is None or not known:
        return None
    items = {place: _MOODLE_ITEM.fullmatch(heading) for place, heading in enumerate(head)}
    told = any(items.values())  # newer ones say of each grade what it is
    columns = []
    for place, heading in enumerate(head):
        if heading in _MOODLE_OWN:
            continue
        item = items[place]
        title, kind = (item["title"], item["kind"]) if item else (heading, "")
        why = ""
        if told and item is None:
            why = "it is no grade."
        elif kind == "Feedback":
            why = "it is for words."
        elif kind in ("Percentage", "Letter"):
            why = f"it shows grades as {kind.lower()}, and marks are points. Export the gradebook with 'Real'."
        elif _MOODLE_SUM.fullmatch(title):
            why = "Moodle computes it."
        columns.append(Column(place, heading, (title, title.partition(": ")[2] or title), None, why))
    keys = tuple(Key(head.index(name), name) for name in known)
    names = (head.index("First name"), head.index(last))
    return Export(MOODLE, found, tuple(_filled_rows(found)), keys, names, tuple(columns), ("-",))


def _blackboard(found: Table, head: Sequence[str]) -> Export | None:
    items = {place: _BLACKBOARD_ITEM.fullmatch(heading) for place, heading in enumerate(head)}
    if "Username" not in head or not ({"Last Name", "First Name"} <= set(head) or any(items.values())):
        return None
    if _is_brightspace(head):
        return None
    columns = []
    for place, heading in enumerate(head):
        if heading in _BLACKBOARD_OWN:
            continue
        item = items[place]
        called: tuple[str, ...] = ()
        most, why = None, ""
        if item is None:
            why = "its heading has no number of Blackboard's, as '|123456': it would become a new column, worth 0."
        else:
            called = (item["title"], item["id"])
            if item["sum"]:
                why = "Blackboard computes it."
            elif item["kind"] not in (None, "", "Score"):
                why = f"its kind is {item['kind']}, and marks are a Score."
            else:
                most = stated(item["most"], heading)
        columns.append(Column(place, heading, called, most, why))
    keys = tuple(Key(head.index(name), name) for name in ("Username", "Student ID") if name in head)
    names_at = tuple(head.index(name) for name in ("First Name", "Last Name") if name in head)
    left = {"in progress": "they are still at work on it on Blackboard (In Progress)."}
    return Export(
        BLACKBOARD, found, tuple(_filled_rows(found)), keys, names_at, tuple(columns), ("Needs Grading",), left
    )


def _is_brightspace(head: Sequence[str]) -> bool:
    of_theirs = _END_OF_LINE in head or any(map(_BRIGHTSPACE_ITEM.fullmatch, head))
    return bool({"OrgDefinedId", "Username"} & set(head)) and of_theirs


def _brightspace(found: Table, head: Sequence[str]) -> Export | None:
    if not _is_brightspace(head):
        return None
    columns = []
    for place, heading in enumerate(head):
        if heading in (*_BRIGHTSPACE_OWN, _END_OF_LINE):
            continue
        item = _BRIGHTSPACE_ITEM.fullmatch(heading)
        called: tuple[str, ...] = ()
        most, why = None, ""
        if item is None:
            why = "it is none of the items whose points are entered: Brightspace computes it, or knows it otherwise."
        else:
            called = (item["title"],)
            about = item["about"] or ""
            if item["kind"] != "Points Grade" or (about and not about.startswith(("Numeric", "MaxPoints"))):
                kind = item["kind"] if item["kind"] != "Points Grade" else about.split(" ")[0]
                why = f"its kind is {kind}, and marks are a Points Grade that is Numeric."
            else:
                said = _BRIGHTSPACE_MOST.search(about)
                most = stated(said["most"], heading) if said else None
        columns.append(Column(place, heading, called, most, why))
    keys = tuple(Key(head.index(name), name) for name in ("OrgDefinedId", "Username", "Email") if name in head)
    names_at = tuple(head.index(name) for name in ("First Name", "Last Name") if name in head)
    return Export(BRIGHTSPACE, found, tuple(_filled_rows(found)), keys, names_at, tuple(columns))


def _filled_rows(found: Table) -> list[int]:
    """The rows below the headings that say anything."""
    return [row for row in range(1, len(found.rows)) if any(cell.text.strip() for cell in found.rows[row])]
